"""One figure for a run: `ibfil show RUN.h5 --plot FILE.png`.

Shapes in the plane of largest motion, the path of the centroids, curvature along the first filament against time, the
flow in that plane where a velocity field was written, and the observables, speed, elastic energy, power and stretch
against time. Drawn by matplotlib without a display. Panels are as high as what is in them.
"""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import CaseError
from ..io.overwriting import BY_ENDING, Kind, replacing
from . import run_panels
from .moments import Look, moments
from .run_series import against_time, panels
from .style import drawing, literal, plane_of_motion, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..io.reader import RunFile


DOTS = 170  # an inch
ENDINGS = (".png", ".pdf", ".svg")
WIDTH, LEFT = 12.0, 6.6  # inches of the figure, and of its left column without labels
LOWEST, HIGHEST = 1.5, 4.2  # inches of the panel of shapes
UPRIGHT = 0.7  # height over width from which shapes share their row with the path
OTHERS = 2.4  # inches of the other rows
EACH = 1.15  # inches of a panel against time, at least


def draw(run: RunFile, path: str | Path, look: Look | None = None) -> None:
    """Draw the run into ``path``; the ending (png, pdf, svg) says how. Raises CaseError for another one."""
    kind_of(Path(path))
    with drawing(), replacing(Path(path)) as part:
        fig = figure(run, look)
        told = {"Description": told_of(fig)} if Path(path).suffix == ".png" else None
        fig.savefig(part, dpi=DOTS, metadata=told)


def told_of(fig: Figure) -> str:
    """The titles of its panels, a line each: kept in a png, so that one that older code drew can be told."""
    return "\n".join(title for axes in fig.axes if (title := axes.get_title(loc="left")))


def kind_of(path: Path) -> Kind:
    """The kind of file that a name asks for. Raises CaseError where it ends otherwise."""
    if path.suffix not in ENDINGS:
        raise CaseError([f"{path}: found a name that does not end in {', '.join(ENDINGS)}"])
    return BY_ENDING[path.suffix]


def figure(run: RunFile, look: Look | None = None) -> Figure:
    """The figure of a run with at least one output. Raises CaseError for a window that has none."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    look = look or Look()
    seen, series = moments(run, look), panels(run)
    every = [np.asarray(arrays["position"]) for arrays in run.filaments.values()]
    shown = [position[seen.shapes] for position in every]
    middle = run_panels.centroid(shown) * look.co_moving
    shown = [position - middle for position in shown]
    if look.co_moving:
        seen = seen._replace(words=f"{seen.words}, from their centroid")
    plane = plane_of_motion([position[seen.span] for position in every])
    number = _field(run, float(run.time[seen.span.stop - 1]))
    rows, heights = _rows(run_panels.reach(shown, plane), number is not None, seen.span.stop - seen.span.start > 2)

    tall = max(sum(heights) + 0.55 * len(heights), EACH * len(series)) + 0.5
    layout = ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.03, hspace=0.04)
    fig = Figure(figsize=(WIDTH, tall), layout=layout)
    columns = fig.add_gridspec(1, 2, width_ratios=[1.45, 1])
    title = literal(textwrap.fill(run.case.title or run.path.name, 100))
    fig.suptitle(title, x=0.012, ha="left", fontsize=11.5, fontweight="bold")
    left = columns[0].subgridspec(len(rows), 1, height_ratios=heights)
    make: dict[str, Any] = {
        "shapes": lambda axes: run_panels.shapes(fig, axes, run, seen, shown, plane, middle),
        "path": lambda axes: run_panels.paths(axes, run, seen, every, plane),
        "curvature": lambda axes: run_panels.curvature(fig, axes, run, seen),
        "flow": lambda axes: run_panels.flow(fig, axes, run, number or 0, every, plane),
    }
    for row, names in enumerate(rows):
        places = left[row].subgridspec(1, len(names))
        for place, name in enumerate(names):
            make[name](fig.add_subplot(places[place]))
    right, first = columns[1].subgridspec(len(series), 1), None
    for row, panel in enumerate(series):
        axes: Axes = fig.add_subplot(right[row], sharex=first)
        first = first or axes
        against_time(axes, run, panel, seen)
        axes.tick_params(labelbottom=row == len(series) - 1)
    axes.set_xlabel(with_units("time", run.case.units.time))
    return fig


def _field(run: RunFile, time: float) -> int | None:
    """The number of the last velocity field up to a time; None where none was written by then."""
    if run.grid is None or "velocity" not in run.grid.fields:
        return None
    count = int(np.searchsorted(np.asarray(run.grid.time), time * (1 + 1e-9), side="right"))
    return count - 1 if count else None


def _rows(reach: tuple[float, float], flow: bool, in_time: bool) -> tuple[list[tuple[str, ...]], list[float]]:
    """The rows of the left column, and their heights in inches: that of shapes follows from their reach."""
    share = reach[1] / max(reach[0], 1e-300)
    curved = ("curvature",) if in_time else ()
    if share < UPRIGHT:
        rows = [("shapes",), *((curved,) if curved else ()), ("path", "flow") if flow else ("path",)]
        return rows, [float(np.clip(LEFT * share, LOWEST, HIGHEST)), *[0.7 * OTHERS] * len(curved), OTHERS]
    rows = [("shapes", "path"), *((("flow", *curved),) if flow else ((curved,) if curved else ()))]
    return rows, [float(np.clip(0.5 * LEFT * share, 2.6, HIGHEST)), *[OTHERS] * (len(rows) - 1)]
