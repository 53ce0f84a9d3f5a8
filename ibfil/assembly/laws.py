"""From the moduli and the law of each filament to one law for the whole stack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..case.filament import Stiffening, TwoWell
from ..case.table import ZERO
from ..errors import CaseError
from ..rods import constitutive
from .profiles import alone, along, field, half

if TYPE_CHECKING:
    from ..case.expressions import Expression
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..rods.base import Law
    from ..rods.mesh import Mesh


def law(
    filaments: Sequence[Filament],
    nodes: Sequence[slice],
    s: np.ndarray,
    mesh: Mesh,
    given: Sequence[constitutive.MomentLaw | None],
) -> Law:
    """The law of all nodes (n,). ``given`` are laws made in Python, one a filament or None; they go first."""
    out: Law = linear(filaments, nodes, s)
    others: list[tuple[slice, Law]] = []
    for filament, where, own in zip(filaments, nodes, given, strict=True):
        if own is not None:
            others.append((where, constitutive.Given(own, s[where], filament.twisting is not None)))
        elif filament.law.kind != "linear":
            others.append((where, _nonlinear(filament, s[where])))
    if others:
        out = constitutive.Mixed(out, others)
    if any(f.loads is not None and f.loads.internal_moment is not None for f in filaments):
        along_e1 = field(filaments, nodes, s, lambda f: _internal(f, 0))
        out = constitutive.Driven(out, (along_e1, field(filaments, nodes, s, lambda f: _internal(f, 1))))
    gradient = np.zeros(len(s))
    for filament, where, own in zip(filaments, nodes, given, strict=True):
        if own is None and isinstance(filament.law, TwoWell):
            gradient[where] = filament.law.gradient
    if gradient.any():
        out = constitutive.DomainWalls(out, mesh, gradient, field(filaments, nodes, s, lambda f: f.twist_rate))
    if any(f.damping for f in filaments):
        from ..rods.damping import Damped

        time = np.zeros(len(s))
        for filament, where in zip(filaments, nodes, strict=True):
            time[where] = filament.damping
        out = Damped(out, time[:, None] * _bending(filaments, nodes, s), time * _torsion(filaments, nodes, s))
    return out


def active(case: Case, law: Law, given: Mapping[str, Any], ranges: Mapping[str, slice], s: np.ndarray) -> Law:
    """The law with the activities among ``given`` beside it. Raises CaseError where they do not go with the case."""
    from ..rods.activity import Active, Part

    parts = []
    for name, activity in given.items():
        filament = case.filaments[name]
        wrong = {
            "copies": filament.copies is not None,
            'force = "torque-free"': filament.force == "torque-free",
            'time.scheme = "explicit"': case.time.explicit,
            "[thermal]": case.thermal is not None,
        }
        if hasattr(activity, "active"):
            for found in (key for key, there in wrong.items() if there):
                raise CaseError([f"{case.file}: laws: found an activity of {name} with {found}; allowed: without it"])
            parts.append(Part(name, ranges[name], s[ranges[name]], activity))
    return Active(law, parts)


def _bending(filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray) -> np.ndarray:
    """A1, A2 (n, 2)."""
    first = along(filaments, nodes, s, lambda f: f.bending[0])
    return np.stack([first, along(filaments, nodes, s, lambda f: f.bending[1])], axis=1)


def _torsion(filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray) -> np.ndarray:
    """C (n,) at half nodes, zero where nothing twists."""
    torsion = np.zeros(len(s))
    for filament, where in zip(filaments, nodes, strict=True):
        if filament.twisting is not None:
            torsion[where.start : where.stop - 1] = half(alone(filament.twisting, s[where]))[:-1]
    return torsion


def linear(filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray) -> constitutive.Linear:
    """Eq. 9 with the moduli and the preferred strains of all nodes."""
    first = field(filaments, nodes, s, lambda f: f.curvature[0])
    curvature = first, field(filaments, nodes, s, lambda f: f.curvature[1])
    rate = field(filaments, nodes, s, lambda f: f.twist_rate)
    return constitutive.Linear(_bending(filaments, nodes, s), _torsion(filaments, nodes, s), curvature, rate)


def _nonlinear(filament: Filament, s: np.ndarray) -> Law:
    """The law of one filament of nodes s (k,)."""
    it = [filament], [slice(0, len(s))], s
    plain, chosen = linear(*it), filament.law
    if isinstance(chosen, Stiffening):
        return constitutive.Stiffening(plain, _bending(*it), _torsion(*it), chosen.coefficient, chosen.exponent)
    assert isinstance(chosen, TwoWell)
    rate = field(*it, lambda f: f.twist_rate)
    return constitutive.TwoWell(plain, rate, chosen.wells, chosen.barrier)


def _internal(filament: Filament, part: int) -> Expression:
    """The internal moment along e1 (0) or e2 (1); zero where the filament has none."""
    if filament.loads is None or filament.loads.internal_moment is None:
        return ZERO
    return filament.loads.internal_moment[part]
