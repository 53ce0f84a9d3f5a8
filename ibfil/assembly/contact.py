"""From the [contact] of a case to the search for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from ..rods.contact import Contact, ContactRepels, ContactStops, ContactWarns
from ..rods.neighbour_search import Segments
from .profiles import alone

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case


CROSSED = 1e-6  # of the distance of contact: axes nearer than that lie in each other, and have no side to part to
BUCKLING = 10.0  # A/L^2: about pi^2, the push at which a filament would rather bend


def strength(case: Case) -> float:
    """The force of repulsion at contact: what the case gives, else 10 A/L^2 of the filament that has the most."""
    assert case.contact is not None
    if case.contact.strength is not None:
        return case.contact.strength
    most = 0.0
    for filament in case.filaments.values():
        s = np.linspace(0.0, filament.length, filament.nodes)
        most = max(most, *(float(np.max(alone(modulus, s))) / filament.length**2 for modulus in filament.bending))
    return BUCKLING * most


def contact(
    case: Case, names: Sequence[str], filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray
) -> Contact:
    """Contact of all filaments of a case. Raises CaseError where a periodic box is too small for its distance."""
    given = case.contact
    assert given is not None
    parts: list[tuple[np.ndarray, ...]] = []
    for number, (filament, where) in enumerate(zip(filaments, nodes, strict=True)):
        here, first = s[where], np.arange(where.start, where.stop - 1)
        if given.distance is not None:
            radius = np.full(len(first), 0.5 * given.distance)
        else:
            assert filament.radius is not None
            thick = alone(filament.radius, here)
            radius = 0.5 * (thick[1:] + thick[:-1])
        around = np.full(len(first), filament.length if filament.closed else 0.0)
        parts.append((first, here[:-1], here[1:], np.full(len(first), number), radius, around))
    segments = Segments(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    box = np.zeros(3)
    if case.fluid.on_grid and case.fluid.sides is not None:
        box[:] = case.fluid.sides
        widest, longest = 2 * float(np.max(segments.radius)), float(np.max(segments.end - segments.begin))
        reach = (2 if given.action == "repel" else 1) * widest + longest
        if reach > 0.5 * np.min(box):
            allowed = "so much that with a segment's length it reaches less than half of fluid.box"
            raise CaseError([f"{case.file}: contact.distance: found {widest:g}; allowed: {allowed}"])
    offsets = [where.start for where in nodes]
    if given.action == "repel":
        return ContactRepels(segments, names, offsets, box, strength(case))
    return (ContactStops if given.action == "stop" else ContactWarns)(segments, names, offsets, box)


def refuse_crossed(case: Case, touching: Contact, names: Sequence[str], r: np.ndarray) -> None:
    """Raises CaseError where rods that are to repel each other begin (nodes r (n, 3)) with one laid through the other.

    Ends may begin at one point, as where they are linked.
    """
    if touching.repulsion is None:
        return
    segments, pairs = touching.segments, touching.near(r)
    length = np.array([np.max(segments.end[segments.rod == rod]) for rod in range(len(names))])

    def place(segment: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        s = segments.begin[segment] + part * (segments.end[segment] - segments.begin[segment])
        whole = length[segments.rod[segment]]
        return s, (s > 1e-3 * whole) & (s < (1 - 1e-3) * whole)

    (s, inside), (other, within) = place(pairs.i, pairs.a), place(pairs.j, pairs.b)
    reach = segments.radius[pairs.i] + segments.radius[pairs.j]
    crossed = np.nonzero(inside & within & (pairs.distance < CROSSED * reach))[0]
    if crossed.size:
        k = crossed[0]
        first, second = names[segments.rod[pairs.i[k]]], names[segments.rod[pairs.j[k]]]
        raise CaseError(
            [
                f"{case.file}: filament.{first}: found laid through {second} at s = {s[k]:.3g} and {other[k]:.3g}, "
                'with no side to part to under contact.action = "repel"; allowed: axes apart, by '
                f"{1e-3 * reach[k]:.1g} or more, as by another position"
            ]
        )
