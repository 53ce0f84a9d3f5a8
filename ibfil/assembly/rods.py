"""From a case to its rods, stacked, with their law, ends, loads and contact.

The fluid is assembled in assembly/fluids. Nothing is built that the case does not name: the step asks nothing about it.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..case import spacing
from ..case.filament import copy_name
from ..errors import CaseError
from ..rods.base import NoContact
from ..rods.boundary_conditions import PrescribedEnd, PrescribedEnds, Turn, spinning, steady, turned
from ..rods.mesh import Segmented, stack
from ..rods.system import RodSystem
from ..shapes import copies, initial
from . import laws
from .loads import loads, number, triple
from .profiles import along, half
from .stacked import RodStack

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..rods.constitutive import MomentLaw
    from ..rods.contact import Contact
    from ..rods.links.base import Link


def _turn(end) -> Turn | None:
    """How e1 turns at a held end; None where it is free."""
    if not end.turn_held:
        return None
    if end.angle is not None:
        return turned(number(end.angle))
    if end.spin is None:
        return steady(0.0)
    if end.spin.constant is not None:
        return steady(end.spin.constant)
    return spinning(number(end.spin))


Tangents = tuple[np.ndarray | None, np.ndarray | None]


class Placed(NamedTuple):
    """One filament where it starts: name, arclength (k,), positions and directors (k, 3), tangents of its clamps."""

    name: str
    filament: Filament
    s: np.ndarray
    r: np.ndarray
    e1: np.ndarray
    held: tuple[np.ndarray | None, ...]


def _place(case: Case) -> list[Placed]:
    """All filaments, copies one by one. Raises CaseError for shapes that cannot be made."""
    out = []
    for name, filament in case.filaments.items():
        key, folder = f"{case.file}: filament.{name}", Path(case.file).parent
        s = spacing.node_arclength(filament, key)
        r, e1 = initial.initial_shape(filament, key, folder)
        held = _clamp_tangents(filament, key, folder)
        if filament.copies is None:
            out.append(Placed(name, filament, s, r, e1, held))
            continue
        about = _centre(case, name)
        for k, turn, shift in copies.places(filament.copies, about, key, folder):
            moved = (r - about) @ turn.T + shift
            turned = tuple(None if t is None else turn @ t for t in held)
            out.append(Placed(copy_name(name, k), filament, s, moved, e1 @ turn.T, turned))
    return out


def _centre(case: Case, name: str) -> tuple[float, float, float]:
    """The point about which a filament is copied: its position, or that of the first of all that are linked to it."""
    joined, more = {name}, True
    while more:
        found = {other for link in case.links.values() if joined & set(link.names) for other in link.names}
        more = not found <= joined
        joined |= found
    return next(filament.position for other, filament in case.filaments.items() if other in joined)


def _clamp_tangents(filament: Filament, key: str, folder: Path) -> Tangents:
    """The tangents that clamped ends hold: those given, else those the start shape has there."""
    ends = (filament.start, filament.finish)
    if not any(end.clamped for end in ends):
        return None, None
    at = initial.end_tangents(filament, key, folder)
    held = []
    for own, end in zip(at, ends, strict=True):
        given = own if end.tangent is None else np.array(end.tangent) / np.linalg.norm(end.tangent)
        held.append(given if end.clamped else None)
    return held[0], held[1]


def _ends(filaments, nodes, unknowns: int) -> tuple[PrescribedEnds, np.ndarray]:
    """The held unknowns, and the mask (n,) of end nodes that carry no moment."""
    held, free = [], np.zeros(nodes[-1].stop, bool)
    idle: list[int] = []
    for filament, where in zip(filaments, nodes, strict=True):
        for end, node in ((filament.start, where.start), (filament.finish, where.stop - 1)):
            free[node] = not end.clamped
            if end.held:
                moves = None if end.moves is None else triple(end.moves, "t")
                held.append(PrescribedEnd(node, _turn(end), moves))
        if unknowns == 4 and filament.twisting is None:
            idle += range(where.start, where.stop)
    return PrescribedEnds(held, unknowns, np.array(idle, np.int64)), free


def _segmented(placed: Placed, thermal: bool) -> Segmented:
    """A filament for the stack. Equipartition asks for a symmetric stiffness, which order 2 has with ghost nodes."""
    derivative = placed.filament.derivative
    return Segmented(placed.s, derivative, placed.held[0], placed.held[1], thermal and derivative == 2)


def rods(case: Case, given: Mapping[str, MomentLaw] = MappingProxyType({})) -> RodStack:
    """All filaments of the case, placed and stacked; ``given`` are laws made in Python, by filament.

    Raises CaseError for shapes that cannot be made and laws of filaments there are not.
    """
    for name in set(given) - set(case.filaments):
        raise CaseError([f"{case.file}: laws: found {name}; allowed: one of {', '.join(case.filaments)}"])
    placed = _place(case)
    filaments, positions = tuple(p.filament for p in placed), [p.r for p in placed]
    offsets = np.cumsum([0] + [len(p.s) for p in placed]).tolist()
    nodes = [slice(a, b) for a, b in pairwise(offsets)]
    s = np.concatenate([p.s for p in placed])
    mesh = stack([_segmented(p, case.thermal is not None) for p in placed])
    unknowns = 4 if any(f.twisting is not None for f in filaments) else 3
    ends, free = _ends(filaments, nodes, unknowns)
    own = [next((law for name, law in given.items() if case.filaments[name] is f), None) for f in filaments]
    law = laws.law(filaments, nodes, s, mesh, own)
    stretching = half(along(filaments, nodes, s, lambda f: f.stretching))
    length = min(f.length for f in filaments)
    kind = RodSystem
    if filaments[0].force == "torque-free":
        from ..rods.torque_free import TorqueFree

        kind = TorqueFree
    forces, names = loads(filaments, nodes, s, mesh, positions), tuple(p.name for p in placed)
    touching: Contact | NoContact = NoContact()
    if case.contact is not None:
        from .contact import contact

        touching = contact(case, names, filaments, nodes, s)
        forces += touching.loads()
    joined: list[Link] = []
    if case.links:
        from .links import Held, links

        held = [Held(k, p.name, p.filament, where, p.s) for k, (p, where) in enumerate(zip(placed, nodes, strict=True))]
        joined = links(case, held, np.concatenate(positions), np.concatenate([p.e1 for p in placed]))
        forces += joined
    system = kind(mesh, law, stretching, free, ends, forces, unknowns, length)
    start = system.start(np.concatenate(positions), np.concatenate([p.e1 for p in placed]))
    return RodStack(names, filaments, tuple(nodes), s, system, start, touching, tuple(joined))
