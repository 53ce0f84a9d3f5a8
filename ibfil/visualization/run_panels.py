"""The panels of the run's figure that show where things are: shapes, paths, the flow, curvature along the arclength."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import periodic_images
from ..analysis.meshes import box_of
from ..assembly.fluids.models import fluid_model
from ..io.units import label
from .bodies import add_outlines
from .moments import Moments
from .style import AXES, COLOURS, literal, with_unit, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    from ..io.reader import RunFile


ARROWS = 22  # arrows along the longer side of the flow panel
ONE_SCALE = 2.5  # of two reaches: a path that is longer than that has axes of two scales, and says so
FLAT = 0.05  # of the larger of two curvatures: the smaller is none


def _time_colours() -> ListedColormap:
    """Viridis, which all eyes can order, without its end that is too light for a line on white."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0, 0.92, 256)))


def _wall(axes: Axes, run: RunFile, plane: tuple[int, int]) -> None:
    """A wall below the fluid, seen from the side; as artists, which the limits of the axes do not follow."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle

    height = fluid_model(run.case).wall
    if height is None or plane[1] != 2:
        return
    across, deep = axes.get_yaxis_transform(), 10 * float(np.ptp(axes.get_ylim()))
    axes.add_artist(Rectangle((0, height - deep), 1, deep, transform=across, color="0.85", lw=0, zorder=0))
    axes.add_artist(Line2D((0, 1), (height, height), transform=across, color="0.45", lw=1.2, zorder=0))


def _names(axes: Axes, run: RunFile, plane: tuple[int, int]) -> None:
    axes.set_xlabel(with_units(AXES[plane[0]], run.case.units.length))
    axes.set_ylabel(with_units(AXES[plane[1]], run.case.units.length))
    axes.set_aspect("equal", adjustable="datalim")


def centroid(positions: Sequence[np.ndarray]) -> np.ndarray:
    """The mean (T, 1, 3) of the nodes of all filaments (T, N, 3)."""
    return np.concatenate(positions, axis=1).mean(axis=1, keepdims=True)


def reach(positions: Sequence[np.ndarray], plane: tuple[int, int]) -> tuple[float, float]:
    """How far the filaments (T, N, 3) reach along the two axes of the plane."""
    low, high = (f([f(p[..., plane], axis=(0, 1)) for p in positions], axis=0) for f in (np.min, np.max))
    return float(high[0] - low[0]), float(high[1] - low[1])


def shapes(
    fig: Figure,
    axes: Axes,
    run: RunFile,
    seen: Moments,
    positions: Sequence[np.ndarray],
    plane: tuple[int, int],
    middle: np.ndarray,
) -> None:
    """Every filament at the picked moments (K, N, 3), seen from ``middle`` (K, 1, 3), coloured by time; and bodies."""
    from matplotlib.collections import LineCollection

    times = np.asarray(run.time)[seen.shapes]
    wide = 1.5 if len(positions) <= 12 else 0.9
    for position in positions:
        lines = LineCollection(list(position[:, :, plane]), cmap=_time_colours(), linewidths=wide, capstyle="round")
        lines.set_array(times)
        lines.set_clim(times[0], times[-1])
        axes.add_collection(lines)
    add_outlines(axes, run, plane, seen.shapes, _time_colours(), (times[0], times[-1]), middle[:, 0])
    axes.autoscale_view()
    axes.margins(0.06)
    _names(axes, run, plane)
    _wall(axes, run, plane)
    axes.set_title(literal(f"Shapes, {seen.words}"), loc="left")
    if len(times) > 1:
        bar = fig.colorbar(lines, ax=axes, pad=0.015, aspect=28)
        bar.set_label(with_units("time", run.case.units.time))
        bar.outline.set_visible(False)


def paths(axes: Axes, run: RunFile, seen: Moments, positions: Sequence[np.ndarray], plane: tuple[int, int]) -> None:
    """The mean position of each filament's nodes over the window, coloured by time from its start to its end."""
    from matplotlib.collections import LineCollection

    times, ways = np.asarray(run.time)[seen.span], [p[seen.span].mean(axis=1, keepdims=True) for p in positions]
    for way in ways:
        path = way[:, 0][:, plane]
        pieces = LineCollection(list(np.stack([path[:-1], path[1:]], axis=1)), cmap=_time_colours(), linewidths=1.6)
        pieces.set_array(times[:-1])
        pieces.set_clim(times[0], times[-1])
        axes.add_collection(pieces)
        axes.plot(*path[0], "o", mfc="white", mec="0.2", ms=5, zorder=3)
        axes.plot(*path[-1], "o", color="0.2", ms=5, zorder=3)
    axes.margins(0.12)
    _names(axes, run, plane)
    title, (a, b) = "Centroid, ring to dot", reach(ways, plane)
    if max(a, b) > ONE_SCALE * min(a, b) > 0.0:
        axes.set_aspect("auto")
        title += "; axes of two scales"
    axes.locator_params(nbins=5)
    axes.set_title(title, loc="left")


def curvature(fig: Figure, axes: Axes, run: RunFile, seen: Moments) -> None:
    """The curvature of the first filament, against time; signed where it bends about one axis."""
    name = next(iter(run.filaments))
    s, times = run.arclength(name), np.asarray(run.time)[seen.span]
    bend = np.asarray(run.filaments[name]["strain"][seen.span])[..., :2]
    largest = np.abs(bend).max(axis=(0, 1))
    main = int(np.argmax(largest))
    if largest[1 - main] <= FLAT * largest[main]:
        values, word, low = bend[..., main], f"curvature Omega_{main + 1}", -1.0
    else:
        values, word, low = np.linalg.norm(bend, axis=-1), "curvature", 0.0
    top = float(np.percentile(np.abs(values), 99)) or 1.0
    every = max(1, len(times) // 1200)
    shown = values[::every].T
    mesh = axes.pcolormesh(
        times[::every],
        s[: len(shown)],
        shown,
        cmap="RdBu_r" if low else "viridis",
        vmin=low * top,
        vmax=top,
        shading="nearest",
        rasterized=True,
    )
    axes.set_xlabel(with_units("time", run.case.units.time))
    axes.set_ylabel(with_units("arclength", run.case.units.length))
    axes.set_title("Curvature" + (f" of {literal(name)}" if len(run.filaments) > 1 else ""), loc="left")
    bar = fig.colorbar(mesh, ax=axes, pad=0.02, aspect=24, extend="max" if not low else "both")
    bar.set_label(with_units(word, label(run.case.units, "1/length")))
    bar.outline.set_visible(False)


def flow(
    fig: Figure, axes: Axes, run: RunFile, number: int, positions: Sequence[np.ndarray], plane: tuple[int, int]
) -> None:
    """The grid plane nearest the filaments (T, N, 3), around them, in a field that was written.

    Colour is the speed, all three components; arrows have the direction in the plane, and no length: the
    speed falls too fast from the filament for both to be seen.
    """
    grid = run.grid
    assert grid is not None
    time, velocity = float(grid.time[number]), grid.fields["velocity"][number].astype(float)
    output = int(np.argmin(np.abs(run.time - time)))
    cells = np.array(velocity.shape[:3])
    box = box_of(run)
    nodes = [position[output] for position in positions]
    if box is not None:
        nodes = [wrapped(r, grid.origin, cells * grid.spacing) for r in nodes]
    across = 3 - sum(plane)
    middle = float(np.nanmean(np.concatenate(nodes)[:, across]))
    level = round((middle - grid.origin[across]) / grid.spacing[across])
    level = level % cells[across] if box is not None else int(np.clip(level, 0, cells[across] - 1))
    sheet = velocity.take(level, axis=across).swapaxes(0, 1)  # [b, a]
    a, b = (grid.origin[d] + grid.spacing[d] * np.arange(cells[d]) for d in plane)

    speed = np.linalg.norm(sheet, axis=-1)
    mesh = axes.pcolormesh(a, b, speed, cmap="Blues", vmin=0, shading="gouraud", rasterized=True)
    window = [_window([r[:, d] for r in nodes], x) for d, x in zip(plane, (a, b), strict=True)]
    step = max(1, round(max(high - low for low, high in window) / (a[1] - a[0]) / ARROWS))
    thin = sheet[step // 2 :: step, step // 2 :: step][..., plane]
    arrows = np.moveaxis(thin / np.maximum(np.linalg.norm(thin, axis=-1, keepdims=True), 1e-300), -1, 0)
    at = (a[step // 2 :: step], b[step // 2 :: step])
    length = 0.75 * step * (a[1] - a[0])
    axes.quiver(*at, *length * arrows, color="0.25", pivot="mid", angles="xy", scale_units="xy", scale=1, width=0.004)
    for r in nodes:
        axes.plot(*r[:, plane].T, color=COLOURS[1], lw=2.2)

    _names(axes, run, plane)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(*window[0])
    axes.set_ylim(*window[1])
    _wall(axes, run, plane)
    place = with_unit(grid.origin[across] + grid.spacing[across] * level, run.case.units.length, 3)
    when = with_unit(time, run.case.units.time)
    axes.set_title(literal(f"Flow at {AXES[across]} = {place}, time {when}"), loc="left")
    bar = fig.colorbar(mesh, ax=axes, pad=0.02, aspect=24)
    bar.set_label(with_units("speed; arrows: direction", run.units("grid/velocity")))
    bar.outline.set_visible(False)


def _window(values: Sequence[np.ndarray], axis: np.ndarray) -> tuple[float, float]:
    """The filaments' reach along an axis and as much again; at least 0.6 of the axis, at most all of it."""
    low, high = (float(f([f(v) for v in values])) for f in (np.nanmin, np.nanmax))
    half = max(high - low, 0.3 * (axis[-1] - axis[0]))
    middle = float(np.clip(0.5 * (low + high), axis[0], axis[-1]))
    return max(middle - half, float(axis[0])), min(middle + half, float(axis[-1]))


def wrapped(r: np.ndarray, origin: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Nodes (N, 3) brought into the periodic box, a row of NaN wherever the filament crosses its faces."""
    pieces = periodic_images.wrapped(r, origin, box)
    inside = pieces.take(r) - pieces.image * box
    return np.insert(inside, np.cumsum(pieces.lengths)[:-1], np.nan, axis=0)
