"""From a case to its rods, stacked, with their law, ends, loads and contact.

The fluid is assembled in assembly/fluids. Nothing is built that the case does not name: the step asks nothing about it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..case import spacing
from ..case.consistency.filament import check_one
from ..case.copies import copy_name
from ..case.expressions import COPIED, ExpressionError
from ..case.table import expressions
from ..errors import CaseError
from ..rods.base import NoContact
from ..rods.mesh import Segmented, stack
from ..shapes import copies, initial
from . import laws
from .ends import prescribed_ends
from .kinds import rod_system
from .loads import loads
from .profiles import along, half
from .rest import settled
from .stacked import Copied, RodStack

if TYPE_CHECKING:
    from ..case.copies import Copies
    from ..case.filament import Filament
    from ..case.schema import Case
    from ..rods.constitutive import MomentLaw
    from ..rods.contact import Contact
    from ..rods.links.base import Link
    from ..rods.system import RodSystem


Tangents = tuple[np.ndarray | None, np.ndarray | None]


class Placed(NamedTuple):
    """One filament where it starts: name, arclength (k,), positions and directors (k, 3), tangents of its clamps."""

    name: str
    table: str  # the name that the case gives it, or all its copies
    filament: Filament
    s: np.ndarray
    r: np.ndarray
    e1: np.ndarray
    held: Tangents
    copied: Copied | None = None


class _Stacked(NamedTuple):
    """Where filaments are in the stack: the nodes of each, all its nodes with copies, the source of every node."""

    nodes: list[slice]
    ranges: list[slice]
    source: np.ndarray

    @classmethod
    def of(cls, parts: list[Segmented]) -> _Stacked:
        """Filaments one after the other."""
        offsets = np.cumsum([0] + [len(part.source) for part in parts]).tolist()
        ranges = [slice(a, b) for a, b in pairwise(offsets)]
        nodes = [slice(w.start + p.phantoms, w.stop - p.phantoms) for w, p in zip(ranges, parts, strict=True)]
        return cls(nodes, ranges, np.concatenate([p.source + a for p, a in zip(parts, offsets, strict=False)]))

    def whole(self, values: list[np.ndarray]) -> np.ndarray:
        """Values of the nodes of each filament (k, ..) as one of all (n, ..)."""
        out = np.zeros((len(self.source), *values[0].shape[1:]))
        for where, given in zip(self.nodes, values, strict=True):
            out[where] = given
        return out[self.source]


def _place(case: Case) -> list[Placed]:
    """All filaments, copies one by one. Raises CaseError for shapes that cannot be made."""
    out = []
    for name, filament in case.filaments.items():
        if filament.copies is None:
            out.append(_one(case, name, name, filament))
        else:
            out += _copies(case, name, filament, filament.copies)
    return out


def _one(case: Case, name: str, table: str, filament: Filament) -> Placed:
    """One filament where its own keys put it."""
    key, folder = f"{case.file}: filament.{name}", Path(case.file).parent
    s = spacing.node_arclength(filament, key)
    held = _clamp_tangents(filament, key, folder)
    segmented = _segmented(filament, s, held, case.thermal is not None)
    r, e1 = initial.initial_shape(filament, key, folder, partial(settled, filament, segmented))
    return Placed(name, table, filament, s, r, e1, held)


def _copies(case: Case, table: str, filament: Filament, many: Copies) -> Iterator[Placed]:
    """The copies of a filament, turned about its position and moved; shapes are made anew where formulas differ."""
    about, made = np.array(_centre(case, table)), dict[tuple[float, ...], Placed]()
    key, folder = f"{case.file}: filament.{table}", Path(case.file).parent

    differ = any(formula.variables & set(COPIED) for _, formula in expressions(filament))

    def own(number: int, values: Mapping[str, float]) -> Placed:
        which = tuple(values.values()) if differ else ()
        if which not in made:
            it = _own(case, table, number, filament, values) if differ else filament
            made.clear()
            made[which] = _one(case, copy_name(table, number) if differ else table, table, it)
        return made[which]

    sides = case.fluid.sides if case.fluid.on_grid else None
    curve = None if many.apart is None else lambda number, values: own(number, values).r - about
    for place in copies.places(many, key, folder, curve, sides):
        it, turn = own(place.number, place.values), place.turn
        copied = Copied(turn, about, place.point)
        first, last = (None if t is None else turn @ t for t in it.held)
        name, r, e1 = copy_name(table, place.number), copied.place(it.r), it.e1 @ turn.T
        yield it._replace(name=name, r=r, e1=e1, held=(first, last), copied=copied)


def _own(case: Case, table: str, number: int, filament: Filament, values: Mapping[str, float]) -> Filament:
    """The filament that one copy is. Raises CaseError for what its formulas make that is not allowed."""
    name = f"filament.{copy_name(table, number)}"
    try:
        it = filament.of_copy(values)
    except ExpressionError as error:
        raise CaseError([f"{case.file}: {name}: a formula has no value at i = {number} ({error})"]) from None
    faults = [fault.line(case.file) for fault in check_one(name, it, case)]
    if faults:
        raise CaseError(faults)
    return it


def _centre(case: Case, name: str) -> tuple[float, float, float]:
    """The point about which a filament is copied: its position, or that of the first of all that are joined to it.

    Filaments are joined by links, and by bodies that they are in.
    """
    together = [set(link.names) for link in case.links.values()]
    in_body: dict[str, set[str]] = {}
    for own, filament in case.filaments.items():
        for end in (filament.start, filament.finish):
            if end.attached:
                in_body.setdefault(end.body, set()).add(own)
    together += in_body.values()
    joined, more = {name}, True
    while more:
        found = {other for names in together if joined & names for other in names}
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


def _segmented(filament: Filament, s: np.ndarray, held: Tangents, thermal: bool) -> Segmented:
    """A filament for the stack. Equipartition asks for a symmetric stiffness, which order 2 has with ghost nodes."""
    ghost = thermal and filament.derivative == 2
    return Segmented(s, filament.derivative, *held, ghost, filament.closed)


def rods(case: Case, given: Mapping[str, MomentLaw] = MappingProxyType({})) -> RodStack:
    """All filaments of the case, placed and stacked; ``given`` are laws made in Python, by filament.

    Raises CaseError for shapes that cannot be made and laws of filaments there are not.
    """
    for name in set(given) - set(case.filaments):
        raise CaseError([f"{case.file}: laws: found {name}; allowed: one of {', '.join(case.filaments)}"])
    placed = _place(case)
    filaments, positions = tuple(p.filament for p in placed), [p.r for p in placed]
    parts = [_segmented(p.filament, p.s, p.held, case.thermal is not None) for p in placed]
    stacked = _Stacked.of(parts)
    nodes, ranges = stacked.nodes, stacked.ranges
    s, mesh = stacked.whole([p.s for p in placed]), stack(parts)
    for where, p in zip(nodes, placed, strict=True):
        s[where] = p.s  # of the last node of a closed rod its length, not 0
    unknowns = 4 if any(f.twisting is not None for f in filaments) else 3
    ends, free = prescribed_ends(filaments, nodes, ranges, unknowns)
    own = [given.get(p.table) for p in placed]
    law = laws.law(filaments, ranges, s, mesh, [each if hasattr(each, "bending") else None for each in own])
    if any(hasattr(each, "active") for each in own):
        law = laws.active(case, law, given, dict(zip([p.name for p in placed], ranges, strict=True)), s)
    stretching = half(along(filaments, ranges, s, lambda f: f.stretching))
    length = min(f.length for f in filaments)
    forces, names = loads(filaments, nodes, s, mesh, positions), tuple(p.name for p in placed)
    r, e1 = stacked.whole(positions), stacked.whole([p.e1 for p in placed])
    touching: Contact | NoContact = NoContact()
    if case.contact is not None:
        from .contact import contact, refuse_crossed

        touching = contact(case, names, filaments, nodes, s)
        refuse_crossed(case, touching, names, r)
        forces += touching.loads()
    joined: list[Link] = []
    if case.links:
        from .links import Held, links

        held = [Held(k, p.name, p.filament, where, p.s) for k, (p, where) in enumerate(zip(placed, nodes, strict=True))]
        joined = links(case, held, r, e1)
        forces += joined
    system = _kind(filaments, stacked)(mesh, law, stretching, free, ends, forces, unknowns, length)
    start = system.start(r, e1)
    for part in system.remembering:
        part.start(start)
    known = names, filaments, tuple(nodes), tuple(ranges), s, system, start, touching, tuple(joined)
    out = RodStack(*known, tables=tuple(p.table for p in placed), copied=tuple(p.copied for p in placed))
    if not case.bodies:
        return out
    from .bodies.system import with_bodies

    return with_bodies(case, out)


def _kind(filaments: tuple[Filament, ...], stacked: _Stacked) -> Callable[..., RodSystem]:
    """The class of the rods: open, closed or of the torque-free force."""
    if not any(f.closed for f in filaments):
        return rod_system(filaments[0])
    from ..rods.closed import ClosedRods

    closures = [(w.start, w.stop - 1) for f, w in zip(filaments, stacked.nodes, strict=True) if f.closed]
    return partial(ClosedRods, source=stacked.source, closures=closures)
