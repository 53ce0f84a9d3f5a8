"""From the [body] tables of a case to shells of markers on a grid, and what is told of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...case.bodies.body import Body
    from ...case.schema import Case
    from ...fluids.shells.calibration import Fit
    from ...fluids.shells.shell import Shells
    from ..stacked import RodStack

SPACING = 1.75  # of markers, in cells: closer ones lock against each other, those further apart leak
NEAREST = 0.4  # cells between a marker and a node, or markers of two bodies, at the start
SMALL = 3.0  # cells a semi-axis below which a body's two radii differ by 7 % and more
MANY = 600  # markers from which steps by the table take seconds
_TURNS = 24  # ways to turn the markers of a sphere, of which that farthest from rods is taken


def fit(case: Case, name: str, kernel: str, h: float) -> Fit | None:
    """The shell of a body in units of the spacing h; None of a joint. Raises CaseError where it is too small."""
    from ...fluids.shells import calibration

    body = case.bodies[name] if name in case.bodies else case.each_body[name]
    a, b, c = (size / h for size in body.shape.semi_axes)
    if not a:
        return None
    try:
        return calibration.fitted((a, b, c), kernel, SPACING, body.meets_rotation)
    except calibration.TooSmall as error:
        found = f"a semi-axis of {min(a, b, c):.3g} cells, within which markers would lie at {error}"
        allowed = f"markers at {calibration.LEAST:g} cells or more: a larger body or smaller cells"
        raise CaseError([f"{case.file}: body.{name}.shape: found {found}; allowed: {allowed}"]) from None


def shells(case: Case, rods: RodStack, kernel: str, h: float) -> Shells:
    """The markers of all bodies. Raises CaseError where they are in the way of a rod or of each other."""
    from ...fluids.shells.shell import Shells

    rows, nodes = rods.with_bodies.rows, rods.nodes_at_start.r
    poses, own = rows.start(), []
    for b, (name, body) in enumerate(case.each_body.items()):
        found = fit(case, name, kernel, h)
        points = np.zeros((0, 3)) if found is None else h * found.markers
        own.append(_turned(points, body, (nodes - poses.centre[b]) @ poses.axes[b]))
    placed = [poses.centre[b] + points @ poses.axes[b].T for b, points in enumerate(own)]
    faults = [f"{case.file}: {fault}" for fault in _in_the_way(case, rods, placed, h)]
    if faults:
        raise CaseError(faults)
    return Shells(rods.count, tuple(own), rows.length)


def refuse_below(case: Case, rods: RodStack, kernel: str, h: float, lowest: float) -> None:
    """Raises CaseError for bodies whose markers are below a height at the start."""
    start, faults = rods.start, []
    own = shells(case, rods, kernel, h)
    for name, cloud in zip(case.each_body, own.clouds(start.r, start.e3), strict=True):
        height = float(np.min(cloud[:, 2], initial=np.inf))
        if height < lowest:
            found = f"found markers at z = {height:.3g}, in the wall or too near"
            faults.append(f"{case.file}: body.{name}: {found}; allowed: {lowest:.3g} or more")
    if faults:
        raise CaseError(faults)


def _turned(points: np.ndarray, body: Body, nodes: np.ndarray) -> np.ndarray:
    """Markers (k, 3) as far from nodes (n, 3) as turning them helps: those of a sphere may be."""
    if not len(points) or len(set(body.shape.semi_axes)) > 1:
        return points
    from ...bodies.rotation import rotation

    axes = np.array([[1.0, 0.3, 0.2], [-0.2, 1.0, 0.4]])
    turns = [rotation(0.4 * (k % 6) * axes[0]) @ rotation(0.4 * (k // 6) * axes[1]) for k in range(_TURNS)]
    near = nodes[np.linalg.norm(nodes, axis=1) < 2 * max(body.shape.semi_axes)]
    if not len(near):
        return points
    return max((points @ turn.T for turn in turns), key=lambda cloud: _distance(cloud, near))


def _distance(cloud: np.ndarray, others: np.ndarray) -> float:
    return float(np.min(np.linalg.norm(cloud[:, None] - others, axis=2), initial=np.inf))


def _in_the_way(case: Case, rods: RodStack, placed: list[np.ndarray], h: float) -> Iterator[str]:
    """Bodies whose markers are too close to nodes, or to those of another body."""
    names, nodes = list(case.each_body), rods.nodes_at_start.r
    for b, (name, cloud) in enumerate(zip(names, placed, strict=True)):
        for filament, where in zip(rods.names, rods.nodes, strict=True):
            away = _distance(cloud, nodes[where]) / h
            if away < NEAREST:
                found = f"found nodes of {filament} {away:.2g} cells from markers of body {name}"
                yield f"filament.{filament}: {found}; allowed: {NEAREST:g} cells or more"
        for other, points in zip(names[:b], placed[:b], strict=True):
            away = _distance(cloud, points) / h
            if away < NEAREST:
                found = f"found markers {away:.2g} cells from those of {other}"
                yield f"body.{name}: {found}; allowed: {NEAREST:g} cells or more"


def told(case: Case, kernel: str, h: float) -> list[str]:
    """Lines on the shells of bodies: how many markers, and how well they stand for the bodies."""
    out = []
    for name, body in case.bodies.items():
        found = fit(case, name, kernel, h)
        if found is None:
            continue
        met, other = ("rotation", "translation") if body.meets_rotation else ("translation", "rotation")
        drags = 100 * (1.0 / getattr(found, other) - 1.0)
        spread = 100 * float(np.max(np.abs(getattr(found, met) - 1.0)))
        out.append(
            f"body {name}: {len(found.markers)} markers, {found.offset:.3g} cells within its surface, which have its "
            f"mean mobility of {met} (fit), each axis to {spread:.1g} %; drag of {other} along its axes off by "
            f"{_many(drags)} %"
        )
    return out


def _many(numbers: np.ndarray) -> str:
    """Numbers once each."""
    return ", ".join(dict.fromkeys(f"{x:+.2g}" for x in numbers))


def warnings(case: Case, kernel: str, h: float, box: np.ndarray | None, dense: bool) -> list[str]:
    """Bodies that the grid tells badly, or whose markers are many for one ``dense`` system."""
    out, count = [], 0
    for name, body in case.bodies.items():
        found = fit(case, name, kernel, h)
        if found is None:
            continue
        count += len(found.markers) * sum(own is body for own in case.each_body.values())
        least, longest = min(body.shape.semi_axes), max(body.shape.semi_axes)
        if least < SMALL * h:
            out.append(
                f"body.{name}: a semi-axis of {least / h:.2g} cells: its drags differ from the body's as told "
                f'above; below {SMALL:g} cells take a finer grid, or kernel = "bspline4"'
            )
        if box is not None and 2 * longest > 0.5 * float(box.min()):
            out.append(f"body.{name}: longer than half the box: its images are as near as it is long")
    if dense and count > MANY:
        out.append(
            f"bodies have {count} markers: a step takes seconds beyond {MANY}; take a coarser grid, or where they are "
            'of several swimmers method = "krylov"'
        )
    return out
