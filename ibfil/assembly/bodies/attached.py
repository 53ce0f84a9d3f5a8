"""Whether ends of rods are where their bodies are. Raises CaseError, a line for each that is not."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CaseError
from .clouds import size

if TYPE_CHECKING:
    from ...bodies.body import Body
    from ...case.bodies.end import End
    from ...case.schema import Case
    from ...rods.geometry import Configuration
    from ..stacked import Copied, RodStack

INSIDE = 0.5  # of a segment, that nodes may be within a body
_PARALLEL = 1e-6


class InBody(NamedTuple):
    """An end of a rod in a body: its table, whether it is at s = L, its node, the rod's nodes, and if that twists."""

    end: End
    finish: bool
    node: int
    where: slice
    twists: bool
    filament: str  # its name
    copied: Copied | None  # where it went as one of copies


def attached_ends(rods: RodStack) -> list[InBody]:
    """The ends that are in bodies."""
    out = []
    each = zip(rods.names, rods.tables, rods.filaments, rods.nodes, rods.copied, strict=True)
    for name, table, filament, where, copied in each:
        number = name.removeprefix(table)  # of a copy, which is in the copy of a body
        for finish, (end, node) in enumerate(((filament.start, where.start), (filament.finish, where.stop - 1))):
            if end.attached:
                own = end if copied is None else end.model_copy(update={"body": end.body + number})
                twists = filament.twisting is not None
                out.append(InBody(own, bool(finish), node, where, twists, name, copied))
    return out


def by_body(ends: Sequence[InBody]) -> defaultdict[str, list[InBody]]:
    """The ends in each body, by its name."""
    out: defaultdict[str, list[InBody]] = defaultdict(list)
    for at in ends:
        out[at.end.body].append(at)
    return out


def check_places(case: Case, rods: RodStack, ends: Sequence[InBody], bodies: Sequence[Body]) -> None:
    """Ends lie on their bodies, or within the size of these; rods do not run through them; a joint can turn one way."""
    faults, tables, inside = [], case.each_body, by_body(ends)
    made = dict(zip(tables, bodies, strict=True))
    for at in ends:
        body, table = made[at.end.body], tables[at.end.body]
        key = f"{case.file}: filament.{at.filament}.{'finish' if at.finish else 'start'}.body"
        if body.cloud is None:
            length = rods.filaments[rods.names.index(at.filament)].length
            fault = _misplaced(at, body, np.array(table.shape.semi_axes), rods.start, length)
        else:
            fault = _away(at, body, body.cloud, rods.start)
        faults += [f"{key}: {fault.format(name=at.end.body)}"] if fault else []
    for name, table in tables.items():
        if not size(case, name, table).any() and _in_line(inside[name], rods.start):
            found = "found clamped filaments without twisting that leave a joint along one line, and may turn about it"
            faults.append(f"{case.file}: body.{name}: {found}; allowed: twisting, or hinged ends")
    if faults:
        raise CaseError(faults)


def _misplaced(at: InBody, body: Body, size: np.ndarray, start: Configuration, length: float) -> str:
    """The fault of one end, with a place for the body's name; "" where there is none."""
    segment = length / (at.where.stop - at.where.start - 1)
    place = (start.r[at.where] - body.centre) @ body.axes
    end = place[-1 if at.finish else 0]
    away = float(np.linalg.norm(end))
    if not size.any():
        if away > segment:
            return f"found an end {away:.3g} away from joint {{name}}; allowed: at most a segment, {segment:.3g}"
        return ""
    outside = _outside(end, size)
    if outside > size.max():
        return f"found an end {outside:.3g} off the surface of {{name}}; allowed: at most its size, {size.max():.3g}"
    deepest = -min(float(_outside(point, size)) for point in place)
    if deepest > INSIDE * segment * (1 + 1e-9):
        return f"found nodes up to {deepest:.3g} inside {{name}}; allowed: at most half a segment, {0.5 * segment:.3g}"
    return ""


def _away(at: InBody, body: Body, cloud: np.ndarray, start: Configuration) -> str:
    """The fault of one end in a cloud of markers, as above: it may be as far off as the cloud is large."""
    end = (start.r[at.node] - body.centre) @ body.axes
    away, allowed = float(np.linalg.norm(cloud - end, axis=1).min()), float(np.ptp(cloud, axis=0).max())
    if away > allowed:
        return f"found an end {away:.3g} off the markers of {{name}}; allowed: at most its size, {allowed:.3g}"
    return ""


def _outside(point: np.ndarray, size: np.ndarray) -> float:
    """How far a point (3,) is outside of an ellipsoid, seen from its centre; negative inside."""
    scaled = float(np.linalg.norm(point / size))
    return float(np.linalg.norm(point)) * (1 - 1 / scaled) if scaled > 0 else -float(size.min())


def _in_line(ends: Sequence[InBody], start: Configuration) -> bool:
    """Whether clamped ends, none of which holds a turn, have one line as their tangents."""
    clamped = [at for at in ends if at.end.clamped]
    if not clamped or any(at.twists for at in clamped):
        return False
    first, *others = (start.e3[at.node] for at in clamped)
    return all(float(np.linalg.norm(np.cross(first, other))) < _PARALLEL for other in others)
