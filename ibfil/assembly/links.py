"""From the [link.NAME] tables of a case to the links of rods/links."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..case import link as tables
from ..case.copies import copy_name
from ..errors import CaseError
from ..rods.links.base import Elements, Link, length
from ..rods.links.bind import Binding, Bound, Driven, Motors, OfTime
from ..rods.links.hinge import Hinge
from ..rods.links.spring import DampedSpring, Spring
from .profiles import alone

if TYPE_CHECKING:
    from ..case.expressions import Expression
    from ..case.filament import Filament
    from ..case.schema import Case

_NEAR = 1e-9  # of a length: places that are one
_WORDS = {"start": 0.0, "middle": 0.5, "finish": 1.0}  # of the length


class Held(NamedTuple):
    """A filament that a link holds on to: its number and name, its nodes in the stack, their arclength (k,)."""

    number: int
    name: str
    filament: Filament
    where: slice
    s: np.ndarray

    def segment(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The nodes (l, 2) of the segments at arclengths (l,), their rest lengths (l,), the fractions there (l,)."""
        i = np.clip(np.searchsorted(self.s, at, side="right") - 1, 0, len(self.s) - 2)
        ds = self.s[i + 1] - self.s[i]
        t = (at - self.s[i]) / ds
        t = np.where(np.abs(t - np.rint(t)) < _NEAR, np.rint(t), t)
        return self.where.start + np.stack([i, i + 1], axis=1), ds, t

    @property
    def middles(self) -> np.ndarray:
        """The arclength of the middle of each of its segments (k - 1,)."""
        return 0.5 * (self.s[1:] + self.s[:-1])

    def place(self, at: float | str) -> float:
        """An arclength, by its number or its word."""
        return _WORDS[at] * self.filament.length if isinstance(at, str) else at


def links(case: Case, held: Sequence[Held], r: np.ndarray, e1: np.ndarray) -> list[Link]:
    """All links of a case between the filaments ``held``, at nodes r (n, 3) with e1 (n, 3) when it begins.

    Raises CaseError where what is linked lies upon each other, or is drawn out of the plane that it must keep.
    """
    out: list[Link] = []
    for name, table in case.links.items():
        for own, parts in _copies(name, table, held):
            key = f"{case.file}: link.{name}"
            made = _MAKE[type(table)](key, own, table, parts, r)
            _refuse_leaving(key, made, parts, r, e1)
            out.append(made)
    return out


def _copies(name: str, table: tables.AnyLink, held: Sequence[Held]) -> Iterator[tuple[str, list[Held]]]:
    """A link for each copy of what it joins, with its name and its filaments."""
    by_name = {one.name: one for one in held}
    if all(each in by_name for each in table.names):
        yield name, [by_name[each] for each in table.names]
        return
    k = 0
    while copy_name(table.names[0], k) in by_name:
        yield copy_name(name, k), [by_name[copy_name(each, k)] for each in table.names]
        k += 1


def _sides(parts: Sequence[Held], at: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """The nodes (1, 4) of two points, and the weights (1, 2, 4) of each."""
    nodes, weights = [], np.zeros((1, 2, 4))
    for k, (part, place) in enumerate(zip(parts, at, strict=True)):
        segment, _, t = part.segment(np.array([place]))
        nodes.append(segment)
        weights[0, k, 2 * k : 2 * k + 2] = 1.0 - t[0], t[0]
    return np.concatenate(nodes, axis=1), weights


def _spring(key: str, name: str, table: tables.Spring, parts: list[Held], r: np.ndarray) -> Link:
    sites = sorted(table.between, key=lambda site: site.point is not None)  # a place in the lab comes second
    offset = np.zeros((1, 1, 3))
    if len(parts) == 1:
        nodes, weights = _sides([parts[0], parts[0]], [parts[0].place(sites[0].at)] * 2)
        weights[0, 1], offset[0, 0] = 0.0, sites[1].point
    else:
        nodes, weights = _sides(parts, [part.place(site.at) for part, site in zip(parts, sites, strict=True)])
    elements = Elements(nodes, (weights[:, 1] - weights[:, 0])[:, None], offset)
    apart = length(elements.vectors(r)[:, 0])
    rest = apart if isinstance(table.rest, str) else np.array([table.rest])
    if apart[0] <= _NEAR * parts[0].filament.length and rest[0] > _NEAR * parts[0].filament.length:
        raise CaseError([f"{key}.rest: found {rest[0]:g} between places that are one; allowed: 0, or places apart"])
    stiffness, filaments = np.array([table.stiffness]), tuple(part.number for part in parts)
    if table.damping:
        return DampedSpring(name, filaments, elements, stiffness, rest, table.damping, r)
    return Spring(name, filaments, elements, stiffness, rest)


def _hinge(key: str, name: str, table: tables.Hinge, parts: list[Held], r: np.ndarray) -> Link:
    at = [part.place(site.at) for part, site in zip(parts, table.between, strict=True)]
    nodes, _ = _sides(parts, at)
    shortest = min(float(part.segment(np.array([place]))[1][0]) for part, place in zip(parts, at, strict=True))
    if np.array_equal(nodes[0, :2], nodes[0, 2:]):
        raise CaseError([f"{key}.between: found one segment twice; allowed: two different segments"])
    weights = np.array([[[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]]])
    elements = Elements(nodes, weights, np.zeros((1, 2, 3)))
    return Hinge(name, tuple(part.number for part in parts), elements, np.array([table.stiffness]), shortest)


def _bind(key: str, name: str, table: tables.Bind, parts: list[Held], r: np.ndarray) -> Link:
    one, other = parts
    s = one.middles
    first, last = table.range or (0.0, one.filament.length)
    beside = s + table.offset
    s = s[(s > first) & (s < last) & (beside > 0.0) & (beside < other.filament.length)]
    if not s.size:
        raise CaseError([f"{key}.range: found {first:g} to {last:g}, between the middles of segments; allowed: wider"])
    nodes_a, ds, t_a = one.segment(s)
    nodes_b, ds_b, t_b = other.segment(s + table.offset)
    weights = np.zeros((len(s), 2, 4))
    weights[:, 0] = np.stack([t_a - 1.0, -t_a, 1.0 - t_b, t_b], axis=1)
    weights[:, 1] = np.stack([-1.0 / ds, 1.0 / ds, -1.0 / ds_b, 1.0 / ds_b], axis=1)
    elements = Elements(np.concatenate([nodes_a, nodes_b], axis=1), weights, np.zeros((len(s), 2, 3)))
    d, c = elements.vectors(r).transpose(1, 0, 2)
    if np.min(length(c)) < 0.1:
        raise CaseError([f"{key}.filaments: found two that run against each other; allowed: alike, start by start"])
    distance = length(np.cross(d, c)) / length(c)
    if np.min(distance) <= _NEAR * one.filament.length:
        raise CaseError([f"{key}.distance: found 0 at the start, at s = {s[np.argmin(distance)]:g}; allowed: apart"])
    if not isinstance(table.distance, str):
        distance = np.full(len(s), table.distance)
    shear, normal = alone(table.shear, s), alone(table.normal, s)
    for word, values in (("shear", shear), ("normal", normal)):
        if not np.min(values) >= 0.0:
            raise CaseError([f"{key}.{word}: found {np.min(values):g} at s = {s[np.argmin(values)]:g}; allowed: >= 0"])
    binding = Binding(ds, shear, normal, distance, _of_time(table.slide, s), _of_time(table.force, s))
    numbers, motor = (one.number, other.number), table.motor
    if motor is None:
        return Bound(name, numbers, elements, binding)
    motors = Motors(motor.friction, motor.lag, np.inf if motor.stall is None else motor.stall)
    return Driven(name, numbers, elements, binding, motors, r)


def _of_time(expression: Expression, s: np.ndarray) -> OfTime:
    """An expression of s and t at arclengths (l,); evaluated once where it does not depend on time."""
    bound = expression.bind("s", "t")
    if "t" in expression.variables:
        return lambda t: np.broadcast_to(bound(s, t), s.shape)
    fixed = np.broadcast_to(bound(s, 0.0), s.shape).astype(float)
    return lambda t: fixed


_MAKE: dict[type, Callable[..., Link]] = {tables.Spring: _spring, tables.Hinge: _hinge, tables.Bind: _bind}


def _refuse_leaving(key: str, made: Link, parts: Sequence[Held], r: np.ndarray, e1: np.ndarray) -> None:
    """Raises CaseError where a filament without twisting that must keep a plane may be linked out of it.

    Preferred curvature kappa1 keeps it in the plane normal to e1, kappa2 in that normal to e2, A1 != A2 in either.
    """
    offsets = made.elements.offset.reshape(-1, 3)
    points = np.concatenate([*(r[part.where] for part in parts), offsets[np.any(offsets != 0.0, axis=1)]])
    for part in parts:
        filament, first = part.filament, part.where.start
        if filament.twisting is not None or filament.keeps_no_plane:
            continue
        along = r[first + 1] - r[first]
        across = e1[first], np.cross(along, e1[first]) / np.linalg.norm(along)
        bent = [kappa.constant != 0.0 for kappa in filament.curvature]
        away = [np.max(np.abs((points - r[first]) @ across[k])) for k in (0, 1) if not bent[1 - k]]
        turned = any(other.filament.twisting is not None for other in parts)
        if turned or min(away) > 1e-6 * filament.length:
            found = f"{part.name}, of A1 != A2 or preferred curvature and no twisting, linked to what leaves its plane"
            raise CaseError([f"{key}: found {found}; allowed: one plane for all, or twisting, the twist modulus C"])
