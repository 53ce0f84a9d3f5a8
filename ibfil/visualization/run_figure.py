"""One figure for a run: `ibfil show RUN.h5 --plot FILE.png`.

Shapes over time in the plane of largest motion, the path of the centroids, the flow in that plane where a
velocity field was written, and the observables, speed, elastic energy, power and stretch against time. Drawn by
matplotlib without a display.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import periodic_images
from ..analysis.energy import elastic_energy
from ..analysis.meshes import box_of
from ..assembly.fluids.models import fluid_model
from ..errors import CaseError
from ..io.overwriting import BY_ENDING, Kind, replacing
from ..io.units import label
from ..observables.base import KINDS
from ..observables.copies import series_parts
from ..observables.time_series import trapezoid_weights
from .style import AXES, COLOURS, drawing, literal, plane_of_motion, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    from ..io.reader import RunFile


ENDINGS = (".png", ".pdf", ".svg")
SHAPES = 14  # shapes drawn of each filament, evenly spaced in time
SERIES = 3  # observables drawn; the rest are in --csv
DIAGNOSTICS = {
    "power on the fluid": {"power": ""},
    "stretch of segments": {"stretch_max": "max", "stretch_min": "min"},
}
ARROWS = 22  # arrows along the longer side of the flow panel
XYZ = COLOURS[:3]  # colours of components, or of filaments


def draw(run: RunFile, path: str | Path) -> None:
    """Draw the run into ``path``; the ending (png, pdf, svg) says how. Raises CaseError for another one."""
    kind_of(Path(path))
    with drawing(), replacing(Path(path)) as part:
        figure(run).savefig(part, dpi=170)


def kind_of(path: Path) -> Kind:
    """The kind of file that a name asks for. Raises CaseError where it ends otherwise."""
    if path.suffix not in ENDINGS:
        raise CaseError([f"{path}: found a name that does not end in {', '.join(ENDINGS)}"])
    return BY_ENDING[path.suffix]


def figure(run: RunFile) -> Figure:
    """The figure of a run with at least one output."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    series = _series(run)
    flow = run.grid is not None and "velocity" in run.grid.fields
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.03, hspace=0.04)
    fig = Figure(figsize=(11, max(7.2, 1.3 * len(series))), layout=layout)
    columns = fig.add_gridspec(1, 2, width_ratios=[1.45, 1])
    left = columns[0].subgridspec(2, 2 if flow else 1, height_ratios=[1.15, 1])
    right = columns[1].subgridspec(len(series), 1)
    title = literal(textwrap.fill(run.case.title or run.path.name, 100))
    fig.suptitle(title, x=0.012, ha="left", fontsize=11.5, fontweight="bold")

    positions = [np.asarray(arrays["position"]) for arrays in run.filaments.values()]
    plane = plane_of_motion(positions)
    _shapes(fig, fig.add_subplot(left[0, :]), run, positions, plane)
    _paths(fig.add_subplot(left[1, 0]), run, positions, plane)
    if flow:
        _flow(fig, fig.add_subplot(left[1, 1]), run, positions, plane)
    first: Axes | None = None
    for row, (title, units, lines) in enumerate(series):
        axes = fig.add_subplot(right[row], sharex=first)
        first = first or axes
        _against_time(axes, run, title, units, lines)
        axes.tick_params(labelbottom=row == len(series) - 1)
    axes.set_xlabel(with_units("time", run.case.units.time))
    return fig


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


def _shapes(fig: Figure, axes: Axes, run: RunFile, positions: Sequence[np.ndarray], plane: tuple[int, int]) -> None:
    """Every filament at times evenly spaced over the run, coloured by time."""
    from matplotlib.collections import LineCollection

    times = np.asarray(run.time)
    picked = np.unique(np.searchsorted(times, np.linspace(times[0], times[-1], SHAPES)).clip(0, len(times) - 1))
    for position in positions:
        lines = LineCollection(position[picked][:, :, plane], cmap=_time_colours(), linewidths=1.5, capstyle="round")
        lines.set_array(times[picked])
        lines.set_clim(times[0], times[-1])
        axes.add_collection(lines)
    axes.autoscale_view()
    axes.margins(0.06)
    _names(axes, run, plane)
    _wall(axes, run, plane)
    axes.set_title("Shapes", loc="left")
    bar = fig.colorbar(lines, ax=axes, pad=0.015, aspect=28)
    bar.set_label(with_units("time", run.case.units.time))
    bar.outline.set_visible(False)


def _paths(axes: Axes, run: RunFile, positions: Sequence[np.ndarray], plane: tuple[int, int]) -> None:
    """The mean position of each filament's nodes, coloured by time as the shapes are."""
    from matplotlib.collections import LineCollection

    times = np.asarray(run.time)
    for position in positions:
        path = position.mean(axis=1)[:, plane]
        pieces = LineCollection(list(np.stack([path[:-1], path[1:]], axis=1)), cmap=_time_colours(), linewidths=1.6)
        pieces.set_array(times[:-1])
        pieces.set_clim(times[0], times[-1])
        axes.add_collection(pieces)
        axes.plot(*path[0], "o", mfc="white", mec="0.2", ms=5, zorder=3)
        axes.plot(*path[-1], "o", color="0.2", ms=5, zorder=3)
    axes.margins(0.12)
    _names(axes, run, plane)
    axes.set_title("Centroid: start (ring) to end (dot)", loc="left")


def _flow(fig: Figure, axes: Axes, run: RunFile, positions: Sequence[np.ndarray], plane: tuple[int, int]) -> None:
    """The grid plane nearest the filaments, around them, at the last time a field was written.

    Colour is the speed, all three components; arrows have the direction in the plane, and no length: the
    speed falls too fast from the filament for both to be seen.
    """
    grid = run.grid
    assert grid is not None
    time, velocity = float(grid.time[-1]), grid.fields["velocity"][-1].astype(float)
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
    place = with_units(
        f"{AXES[across]} = {grid.origin[across] + grid.spacing[across] * level:.3g}", run.case.units.length
    )
    axes.set_title(f"Flow at {place}, " + with_units(f"time {time:.4g}", run.case.units.time), loc="left")
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


def _series(run: RunFile) -> list[tuple[str, str, dict[str, np.ndarray]]]:
    """A panel against time: title, units, and label -> values; a line for each component."""
    series = []
    for name, column in list(run.observables.items())[:SERIES]:
        values = np.asarray(column)
        lines = {_axis(part): line for part, line in series_parts(run.case, name, values).items()}
        series.append((_meaning(run, name), run.units(f"observables/{name}"), lines))
    series += _motion(run)
    for title, parts in DIAGNOSTICS.items():
        lines = {word: np.asarray(run.diagnostics[key]) for key, word in parts.items() if key in run.diagnostics}
        if lines:
            series.append((title, run.units(f"diagnostics/{next(iter(parts))}"), lines))
    return series


def _axis(part: str) -> str:
    """The label of a line: an axis in the figure's words, a copy by its number."""
    return AXES["xyz".index(part)] if part and part in "xyz" else part


def _motion(run: RunFile) -> list[tuple[str, str, dict[str, np.ndarray]]]:
    """Speed of the centroid and elastic energy, a line for each of the first filaments."""
    speeds, energies = {}, {}
    for name in list(run.filaments)[: len(XYZ)]:
        s = run.arclength(name)
        words = name if len(run.filaments) > 1 else ""
        mean = np.einsum("tnc,n->tc", np.asarray(run.filaments[name]["velocity"]), trapezoid_weights(s) / s[-1])
        speeds[words] = np.linalg.norm(mean, axis=1)
        energy = elastic_energy(run, name)
        if energy is not None:
            energies[words] = energy
    units = run.case.units
    some = f", {len(XYZ)} of {len(run.filaments)} filaments" if len(run.filaments) > len(XYZ) else ""
    out = [(f"speed of the centroid{some}", label(units, "length/time"), speeds)]
    return out + ([(f"elastic energy{some}", label(units, "force length"), energies)] if energies else [])


def _meaning(run: RunFile, name: str) -> str:
    """An observable's name and what its series is, which need not be the like of its summary: "speed: position"."""
    words = run.description(f"observables/{name}").split(",")[0]
    for filament in run.filaments:
        words = words.removesuffix(f" of {filament}")
    known = run.case.observe.items()
    own, observe = next(((own, one) for own, one in known if one.recorded(own) == name), (name, None))
    fit = f" ({observe.kind})" if observe is not None and KINDS[observe.kind].number else ""
    return textwrap.shorten(f"{own}{fit}: {words}", 60, placeholder=" ...")


def _against_time(axes: Axes, run: RunFile, title: str, units: str, lines: dict[str, np.ndarray]) -> None:
    """One panel of values against time; its title says what and in which units: labels would collide.

    A start that dwarfs all the rest, as of a shape that has yet to relax, is left out of the scale, and the
    title says so.
    """
    for (word, values), colour in zip(lines.items(), XYZ, strict=False):
        axes.plot(run.time, values, color=colour, label=word)
    if len(lines) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.0, borderaxespad=0.0)
    title = with_units(title, units)
    limits = limits_without_start(list(lines.values()))
    if limits is not None:
        axes.set_ylim(*limits)
        title += ", starts off scale"
    axes.set_title(title, loc="left")
    axes.margins(x=0.01)
    axes.yaxis.set_major_formatter("{x:.4g}")
    axes.grid(axis="y", color="0.9", linewidth=0.6)


def limits_without_start(lines: Sequence[np.ndarray]) -> tuple[float, float] | None:
    """The y limits of all but the first output, where that one would make the range ten times as wide."""
    rest = np.concatenate([values[1:] for values in lines])
    every = np.concatenate(lines)
    if len(rest) < 3 or not np.all(np.isfinite(every)):
        return None
    span = float(np.ptp(rest))
    if span == 0.0 or np.ptp(every) < 10 * span:
        return None
    return float(rest.min()) - 0.08 * span, float(rest.max()) + 0.08 * span
