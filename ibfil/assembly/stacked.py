"""All filaments of a scene, stacked node after node, with their mechanics."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from ..case.copies import number_of
from ..case.table import expressions
from ..rods.base import NoContact
from ..rods.geometry import Configuration
from ..rods.system import RodSystem

if TYPE_CHECKING:
    from ..bodies.system import RodsWithBodies
    from ..case.expressions import Expression
    from ..case.filament import Filament
    from ..rods.contact import Contact
    from ..rods.links.base import Link


TOGETHER = 500  # nodes of linked filaments that a preconditioner takes as one block


class Copied(NamedTuple):
    """Where a copy goes: it is turned (3, 3) ``about`` a point (3,), which then goes to ``point`` (3,)."""

    turn: np.ndarray
    about: np.ndarray
    point: np.ndarray

    def place(self, r: np.ndarray) -> np.ndarray:
        """Places (.., 3) of the filament, in its copy."""
        return (r - self.about) @ self.turn.T + self.point


@dataclass(frozen=True)
class RodStack:
    """The rods of a scene: names and node ranges of its filaments, arclength (n,), links, and all their mechanics.

    Where there are ``bodies``, their rows come after the nodes in all arrays (bodies/rows.py).
    """

    names: tuple[str, ...]
    filaments: tuple[Filament, ...]
    nodes: tuple[slice, ...]
    ranges: tuple[slice, ...]  # the same, with the copies beyond the ends of closed rods (rods/closed.py)
    s: np.ndarray
    system: RodSystem
    start: Configuration
    contact: Contact | NoContact
    links: tuple[Link, ...] = ()
    bodies: tuple[str, ...] = ()
    motors: tuple[str, ...] = ()
    tables: tuple[str, ...] = field(kw_only=True)  # the names that the case gives them: of copies one
    copied: tuple[Copied | None, ...] = field(kw_only=True)  # where copies went, of each filament

    @property
    def count(self) -> int:
        """How many nodes there are, copies beyond the ends of closed rods among them, rows of bodies left out."""
        return self.ranges[-1].stop

    @property
    def with_bodies(self) -> RodsWithBodies:
        """The system, where there are bodies."""
        return cast("RodsWithBodies", self.system)

    @property
    def nodes_at_start(self) -> Configuration:
        """The configuration of the nodes alone at t = 0."""
        return Configuration(self.start.table[: self.count])

    @property
    def different(self) -> tuple[Filament, ...]:
        """The filaments that differ: of copies that are alike one."""
        return tuple({id(filament): filament for filament in self.filaments}.values())

    def own(self, table: str) -> Filament:
        """The filament that the case gives that name, or its first copy."""
        return self.filaments[self.tables.index(table)]

    def written(self, every: int) -> list[int]:
        """The filaments that outputs have, by their place: of copies every so many-th (output.copies_every)."""
        named = enumerate(zip(self.names, self.tables, strict=True))
        return [k for k, (name, table) in named if name == table or number_of(name) % every == 0]

    def variation(self, table: str, expression: Expression) -> dict[str, np.ndarray]:
        """The values (k,) of i and phase over the copies of a filament, of those that a formula of it uses."""
        mine = [f for name, f in zip(self.tables, self.filaments, strict=True) if name == table]
        if all(f is mine[0] for f in mine):  # copies that are alike
            mine = mine[:1]
        found = [dict(f.origin[1]) for it in mine for _, f in expressions(it) if f.origin and f.origin[0] == expression]
        return {name: np.array([one[name] for one in found]) for name in (found[0] if found else ())}

    @cached_property
    def groups(self) -> tuple[tuple[slice, ...], ...]:
        """The node ranges of filaments that a preconditioner takes together: linked ones, while they are few nodes."""
        group = list(range(len(self.ranges)))
        nodes = [where.stop - where.start for where in self.ranges]
        for link in self.links:
            one, other = (group[k] for k in (link.filaments[0], link.filaments[-1]))
            if one != other and nodes[one] + nodes[other] <= TOGETHER:
                group = [one if k == other else k for k in group]
                nodes[one] += nodes[other]
        members: dict[int, list[slice]] = {}
        for k, where in zip(group, self.ranges, strict=True):
            members.setdefault(k, []).append(where)
        return tuple(tuple(ranges) for ranges in members.values())

    @cached_property
    def twists(self) -> np.ndarray:
        """Which nodes are of filaments that twist (n,): e1 of others may come to differ from node to node."""
        out = np.zeros(len(self.s), bool)
        for filament, where in zip(self.filaments, self.ranges, strict=True):
            out[where] = filament.twisting is not None
        return out

    @property
    def linked(self) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of nodes (l,) that links couple."""
        rows, columns = zip(*(link.pairs for link in self.links), strict=True)
        return np.concatenate(rows), np.concatenate(columns)

    @property
    def group_sizes(self) -> list[int]:
        """How many nodes each of the groups has."""
        return [sum(where.stop - where.start for where in group) for group in self.groups]

    def locate(self, node: int) -> tuple[str, int]:
        """The filament that a node of the stack is of, and its number there."""
        k = next(k for k, where in enumerate(self.ranges) if node < where.stop)
        where = self.nodes[k]
        return self.names[k], min(max(node, where.start), where.stop - 1) - where.start
