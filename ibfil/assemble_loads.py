"""From the keys of a case to the forces and moments of loads.py. A load the case does not name is not made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .loads import ActiveMoment, BodyForce, DeadForce, EndMoment, Follower, ForceField, Tether
from .mesh import Mesh

if TYPE_CHECKING:
    from .case_filament import End, Filament
    from .expressions import Expression
    from .mechanics import Load

_DIFFERENCE = 1e-5  # of the length: the step by which a force that depends on place is differenced


def triple(expressions: Sequence[Expression], *names: str) -> Callable[..., np.ndarray]:
    """Three expressions as one function of arrays (k,), giving (k, 3); of scalars, giving (3,)."""
    parts = [e.bind(*names) for e in expressions]
    return lambda *values: np.stack(np.broadcast_arrays(*(np.asarray(part(*values), float) for part in parts)), axis=-1)


def number(expression: Expression) -> Callable[[float], float]:
    """An expression of t as a plain function."""
    bound = expression.bind("t")
    return lambda t: float(bound(t))


def loads(
    filaments: Sequence[Filament],
    nodes: Sequence[slice],
    s: np.ndarray,
    mesh: Mesh,
    start: Sequence[np.ndarray],
) -> list[Load]:
    """All loads of a scene. ``start`` are the filaments' positions at t = 0, for tethers to them."""
    out: list[Load] = []
    for filament, where, r in zip(filaments, nodes, start, strict=True):
        for end, node, finish in (
            (filament.start, where.start, False),
            (filament.finish, where.stop - 1, True),
        ):
            out += _on_end(end, node, finish, mesh, filament.force == "torque-free")
        if filament.loads is not None:
            out += _along(filament, where, s[where], mesh, r)
    return out


def _on_end(end: End, node: int, finish: bool, mesh: Mesh, torque_free: bool) -> list[Load]:
    out: list[Load] = []
    at = np.array([node])
    if end.follower is not None and end.follower.constant != 0.0:
        out.append(Follower(node, number(end.follower)))
    if end.force is not None:
        force = triple(end.force, "t")
        out.append(DeadForce(at, lambda t: force(t)[None]))
    if end.moment is not None:
        out.append(EndMoment(mesh, node, finish, triple(end.moment, "t"), end.frame == "body", torque_free))
    if end.spring is not None:
        to = np.array([end.spring.to])
        out.append(Tether(at, np.array([end.spring.stiffness]), lambda t: to))
    return out


def _along(filament: Filament, where: slice, s: np.ndarray, mesh: Mesh, start: np.ndarray) -> list[Load]:
    given, nodes = filament.loads, np.arange(where.start, where.stop)
    assert given is not None
    volume = mesh.volume[where][:, None]
    out: list[Load] = []
    if given.force is not None:
        force = triple(given.force, "s", "t", "x", "y", "z")
        if any(e.variables & {"x", "y", "z"} for e in given.force):
            reach = _DIFFERENCE * filament.length
            out.append(ForceField(nodes, lambda r, t: volume * force(s, t, *r.T), reach))
        else:
            zero = np.zeros_like(s)
            out.append(DeadForce(nodes, lambda t: volume * force(s, t, zero, zero, zero)))
    if given.body_force is not None:
        parts = triple(given.body_force, "s", "t")
        out.append(BodyForce(nodes, lambda t: volume * parts(s, t)))
    if given.moment is not None:
        out.append(ActiveMoment(mesh, _over_all(triple(given.moment, "s", "t"), where, s, len(mesh.ds))))
    if given.weight is not None:
        weight = volume * np.array(given.weight)
        out.append(DeadForce(nodes, lambda t: weight))
    if given.tether is not None:
        stiffness = given.tether.stiffness * volume[:, 0]
        if given.tether.to == "initial":
            out.append(Tether(nodes, stiffness, lambda t: start))
        else:
            to = triple(given.tether.to, "s", "t")
            out.append(Tether(nodes, stiffness, lambda t: to(s, t)))
    return out


def _over_all(parts: Callable[..., np.ndarray], where: slice, s: np.ndarray, count: int) -> Callable:
    """A field of one filament as one of the whole stack (n, 3), zero on the others."""

    def values(t: float) -> np.ndarray:
        out = np.zeros((count, 3))
        out[where] = parts(s, t)
        return out

    return values
