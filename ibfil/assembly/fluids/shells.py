"""From the [body] tables of a case to shells of markers on a grid, and what is told of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError
from ..bodies.clouds import cloud, path_key, size

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...case.bodies.body import Body
    from ...case.schema import Case
    from ...fluids.shells.calibration import Fit
    from ...fluids.shells.shell import Shells
    from ..stacked import RodStack

SPACING = 1.75  # of markers, in cells: closer ones lock against each other, those further apart leak
NEAREST = 0.4  # cells between a marker and a node, or markers of two bodies, at the start
CLOSE, WIDE = 1.25, 2.0  # cells to the nearest: closer markers lock, fluid leaks between those further apart
SMALL = 3.0  # cells a semi-axis below which a body's two radii differ by 7 % and more
MANY = 600  # markers from which steps by the table take seconds
_TURNS = 24  # ways to turn the markers of a sphere, of which that farthest from rods is taken


def markers(case: Case, name: str, body: Body, kernel: str, h: float) -> np.ndarray:
    """The markers (k, 3) of a body in its axes: of its file, or of its shell; none of a joint."""
    found = cloud(case, name, body)
    if found is not None:
        return found
    shell = fit(case, name, body, kernel, h)
    return np.zeros((0, 3)) if shell is None else h * shell.markers


def fit(case: Case, name: str, body: Body, kernel: str, h: float) -> Fit | None:
    """The shell of a body, unit h; None where it is a joint or a cloud. Raises CaseError where it is too small."""
    from ...fluids.shells import calibration

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
        points = markers(case, name, body, kernel, h)
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
    for name, points in zip(case.each_body, own.clouds(start.r, start.e3), strict=True):
        height = float(np.min(points[:, 2], initial=np.inf))
        if height < lowest:
            found = f"found markers at z = {height:.3g}, in the wall or too near"
            faults.append(f"{case.file}: body.{name}: {found}; allowed: {lowest:.3g} or more")
    if faults:
        raise CaseError(faults)


def _turned(points: np.ndarray, body: Body, nodes: np.ndarray) -> np.ndarray:
    """Markers (k, 3) as far from nodes (n, 3) as turning them helps: those of a sphere may be."""
    if not any(body.shape.semi_axes) or len(set(body.shape.semi_axes)) > 1:
        return points
    from ...bodies.rotation import rotation

    axes = np.array([[1.0, 0.3, 0.2], [-0.2, 1.0, 0.4]])
    turns = [rotation(0.4 * (k % 6) * axes[0]) @ rotation(0.4 * (k // 6) * axes[1]) for k in range(_TURNS)]
    near = nodes[np.linalg.norm(nodes, axis=1) < 2 * max(body.shape.semi_axes)]
    if not len(near):
        return points
    return max((points @ turn.T for turn in turns), key=lambda cloud: _distance(cloud, near))


def _spaced(name: str, apart: np.ndarray) -> list[str]:
    """Lines on markers of a file that lock against each other, or between which fluid passes."""
    dense, loose = int((apart < CLOSE).sum()), int((apart > WIDE).sum())
    out, key = [], f"body.{name}.shape.path"
    if dense:
        out.append(
            f"{key}: {dense} markers less than {CLOSE:g} cells from another: their forces may be large; take fewer"
        )
    if loose:
        out.append(
            f"{key}: {loose} markers more than {WIDE:g} cells from all others: fluid passes between them; take more"
        )
    return out


def _distance(cloud: np.ndarray, others: np.ndarray) -> float:
    return float(np.min(np.linalg.norm(cloud[:, None] - others, axis=2), initial=np.inf))


def _in_the_way(case: Case, rods: RodStack, placed: list[np.ndarray], h: float) -> Iterator[str]:
    """Bodies whose markers are too close to nodes, or to those of another body."""
    tables, nodes = case.each_body, rods.nodes_at_start.r
    names = list(tables)
    for b, (name, points) in enumerate(zip(names, placed, strict=True)):
        nearest = apart(points).min(initial=np.inf) / h
        if tables[name].shape.file is not None and nearest < NEAREST:
            found = f"found markers {nearest:.2g} cells apart, which lock against each other"
            yield f"{path_key(case, name)}: {found}; allowed: {NEAREST:g} cells or more"
        for filament, where in zip(rods.names, rods.nodes, strict=True):
            away = _distance(points, nodes[where]) / h
            if away < NEAREST:
                found = f"found nodes of {filament} {away:.2g} cells from markers of body {name}"
                yield f"filament.{filament}: {found}; allowed: {NEAREST:g} cells or more"
        for other, others in zip(names[:b], placed[:b], strict=True):
            away = _distance(points, others) / h
            if away < NEAREST:
                found = f"found markers {away:.2g} cells from those of {other}"
                yield f"body.{name}: {found}; allowed: {NEAREST:g} cells or more"


def told(case: Case, kernel: str, h: float) -> list[str]:
    """Lines on the shells of bodies: how many markers, and how well they stand for the bodies."""
    out = []
    for name, body in case.bodies.items():
        given = cloud(case, name, body)
        if given is not None:
            out.append(_cloud(name, given / h, kernel, h))
        found = fit(case, name, body, kernel, h)
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


def _cloud(name: str, points: np.ndarray, kernel: str, h: float) -> str:
    """The line on a cloud of markers (k, 3), in cells: the spheres that it drags as, and how dense it is."""
    from ...fluids.shells import calibration

    moved, turned = calibration.mobilities(points, kernel, calibration.PLACES[0]).mean(axis=1)
    a, b = h / (6 * np.pi * moved), h / (8 * np.pi * turned) ** (1 / 3)
    near, far = np.percentile(apart(points), [0, 100])
    return (
        f"body {name}: {len(points)} markers of its file, as they are, neighbours {near:.3g} to {far:.3g} cells apart; "
        f"in free space they drag as a sphere of radius {a:.4g} when moved, of {b:.4g} when turned about its centre "
        "(means over directions)"
    )


def apart(points: np.ndarray) -> np.ndarray:
    """How far each of points (k, 3) is from the nearest other."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query(points, k=2)[0])[:, 1] if len(points) > 1 else np.full(len(points), np.inf)


def _many(numbers: np.ndarray) -> str:
    """Numbers once each."""
    return ", ".join(dict.fromkeys(f"{x:+.2g}" for x in numbers))


def warnings(case: Case, kernel: str, h: float, box: np.ndarray | None, dense: bool) -> list[str]:
    """Bodies that the grid tells badly, or whose markers are many for one ``dense`` system."""
    out, count = [], 0
    for name, body in case.bodies.items():
        points = markers(case, name, body, kernel, h)
        if not len(points):
            continue
        count += len(points) * sum(own is body for own in case.each_body.values())
        least, longest = min(body.shape.semi_axes), float(size(case, name, body).max())
        if not least:
            out += _spaced(name, apart(points) / h)
        elif least < SMALL * h:
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
