"""From the keys of a case to the forces and moments of rods/loads.py. A load the case does not name is not made.

A kind of load is one row: its key, what `ibfil check` calls it, and the function that makes it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..rods.loads import ActiveMoment, BodyForce, DeadForce, EndMoment, Follower, ForceField, Tether
from ..rods.mesh import Mesh

if TYPE_CHECKING:
    from ..case.bodies.end import End
    from ..case.expressions import Expression
    from ..case.filament import Filament
    from ..rods.base import Load


_DIFFERENCE = 1e-5  # of the length: the step by which a force that depends on place is differenced


def triple(expressions: Sequence[Expression], *names: str) -> Callable[..., np.ndarray]:
    """Three expressions as one function of arrays (k,), giving (k, 3); of scalars, giving (3,)."""
    parts = [e.bind(*names) for e in expressions]
    return lambda *values: np.stack(np.broadcast_arrays(*(np.asarray(part(*values), float) for part in parts)), axis=-1)


def number(expression: Expression) -> Callable[[float], float]:
    """An expression of t as a plain function."""
    bound = expression.bind("t")
    return lambda t: float(bound(t))


class AtEnd(NamedTuple):
    """An end of a filament that something pulls: its table, its node in the stack, which end it is."""

    end: End
    node: int
    finish: bool
    mesh: Mesh
    torque_free: bool


class Along(NamedTuple):
    """A filament that something pulls along it: its nodes in the stack (k,), arclength (k,), start shape (k, 3)."""

    filament: Filament
    where: slice
    s: np.ndarray
    mesh: Mesh
    start: np.ndarray

    @property
    def nodes(self) -> np.ndarray:
        """Its nodes (k,)."""
        return np.arange(self.where.start, self.where.stop)

    @property
    def volume(self) -> np.ndarray:
        """Their control volumes (k, 1)."""
        return self.mesh.volume[self.where][:, None]


# --- loads on an end, from the value of their key ------------------------------------------------------------------


def _end_force(force, at: AtEnd) -> Load:
    of_time = triple(force, "t")
    return DeadForce(np.array([at.node]), lambda t: of_time(t)[None])


def _follower(size, at: AtEnd) -> Load | None:
    return None if size.constant == 0.0 else Follower(at.node, number(size))


def _end_moment(moment, at: AtEnd) -> Load:
    return EndMoment(at.mesh, at.node, at.finish, triple(moment, "t"), at.end.body_frame, at.torque_free)


def _spring(spring, at: AtEnd) -> Load:
    to = np.array([spring.to])
    return Tether(np.array([at.node]), np.array([spring.stiffness]), lambda t: to)


# --- loads along a filament ----------------------------------------------------------------------------------------


def _force(given, on: Along) -> Load:
    force, s, volume = triple(given, "s", "t", "x", "y", "z"), on.s, on.volume
    if any(e.variables & {"x", "y", "z"} for e in given):
        return ForceField(on.nodes, lambda r, t: volume * force(s, t, *r.T), _DIFFERENCE * on.filament.length)
    zero = np.zeros_like(s)
    return DeadForce(on.nodes, lambda t: volume * force(s, t, zero, zero, zero))


def _body_force(given, on: Along) -> Load:
    parts, s, volume = triple(given, "s", "t"), on.s, on.volume
    return BodyForce(on.nodes, lambda t: volume * parts(s, t))


def _moment(given, on: Along) -> Load:
    return ActiveMoment(on.mesh, _over_all(triple(given, "s", "t"), on.where, on.s, len(on.mesh.ds)))


def _weight(given, on: Along) -> Load:
    weight = on.volume * np.array(given)
    return DeadForce(on.nodes, lambda t: weight)


def _tether(tether, on: Along) -> Load:
    stiffness, start, s = tether.stiffness * on.volume[:, 0], on.start, on.s
    if tether.places is None:
        return Tether(on.nodes, stiffness, lambda t: start)
    to = triple(tether.places, "s", "t")
    return Tether(on.nodes, stiffness, lambda t: to(s, t))


class Row(NamedTuple):
    """A kind of load: the key of its table, its name for the user, what makes it (None: it is part of the law)."""

    key: str
    words: str
    build: Callable[..., Load | None] | None


ON_ENDS = (
    Row("force", "force", _end_force),
    Row("follower", "follower force", _follower),
    Row("moment", "moment", _end_moment),
    Row("spring", "spring", _spring),
)
ALONG = (
    Row("force", "force per length", _force),
    Row("body_force", "body force", _body_force),
    Row("moment", "active moment", _moment),
    Row("internal_moment", "internal moment", None),  # assembly/laws.py: it stands with the moments of the law
    Row("weight", "weight", _weight),
    Row("tether", "tethers", _tether),
)


def named(rows: Sequence[Row], table: object) -> list[Row]:
    """Those of the rows whose key the table gives."""
    return [row for row in rows if getattr(table, row.key, None) is not None]


def loads(
    filaments: Sequence[Filament],
    nodes: Sequence[slice],
    s: np.ndarray,
    mesh: Mesh,
    start: Sequence[np.ndarray],
) -> list[Load]:
    """All loads of a scene. ``start`` are the filaments' positions at t = 0, for tethers to them."""
    out: list[Load | None] = []
    for filament, where, r in zip(filaments, nodes, start, strict=True):
        for end, node, finish in (
            (filament.start, where.start, False),
            (filament.finish, where.stop - 1, True),
        ):
            at = AtEnd(end, node, finish, mesh, filament.force == "torque-free")
            out += [row.build(getattr(end, row.key), at) for row in named(ON_ENDS, end) if row.build]
        on = Along(filament, where, s[where], mesh, r)
        out += [row.build(getattr(filament.loads, row.key), on) for row in named(ALONG, filament.loads) if row.build]
    return [load for load in out if load is not None]


def _over_all(parts: Callable[..., np.ndarray], where: slice, s: np.ndarray, count: int) -> Callable:
    """A field of one filament as one of the whole stack (n, 3), zero on the others."""

    def values(t: float) -> np.ndarray:
        out = np.zeros((count, 3))
        out[where] = parts(s, t)
        return out

    return values
