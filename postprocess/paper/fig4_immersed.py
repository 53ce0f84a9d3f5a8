"""Fig. 4: the swimmer in an immersed-boundary fluid with its flow, on a grid that is right and on the paper's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.studies.member import Member

from .drawing import axes_labels, new_figure
from .results import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ibfil.io.reader import RunFile

    from .results import Runs

PERIOD = 2 * np.pi / 10
GRIDS = {
    "right": ("swimmer_stokes", -0.0437, "128³ cells, ds = h"),
    "paper": ("swimmer_paper_grid", -0.01783, "paper's 64³ cells, ds = h/2, slip"),
    "locked": ("swimmer_locked", None, "64³, ds = h/2, no slip, EA = 1.6e4"),
}
HALF = 0.9  # of the side of the square drawn
ARROWS = 21


def members(quick: bool) -> list[Member]:
    """The three shipped cases, with the velocity field once a period."""
    period = f"{PERIOD:.15g}"
    found = []
    for name, (case, *_) in GRIDS.items():
        field = (f"output.grid_every={period}", 'output.fields=["velocity"]')
        found.append(Member(f"fig4-{name}", case, (*field, f"time.step={PERIOD / 50:.15g}") if quick else field))
    return found


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The flow in the plane of the swimmer after three periods, and the speeds."""
    figure = new_figure(12.5, 4.6, "The swimmer in an immersed-boundary Stokes fluid (Fig. 4), after three periods")
    rows = []
    for axes, (name, (_, known, words)) in zip(figure.subplots(1, 3), GRIDS.items(), strict=True):
        run = runs[f"fig4-{name}"]
        speed = _speed(run)
        mappable = _flow(axes, run)
        axes_labels(axes, "x/L", "y/L", f"{words}\nU = {speed:+.4f}")
        note = (
            "the wrong way, and nothing but a warning says so"
            if name == "locked"
            else "thicker rods are slower: h is the thickness"
        )
        rows.append(
            Row(
                "Fig. 4", f"speed along x, {words}", "", known, speed, run.wall_time, 0.01 if known else None, note=note
            )
        )
    figure.colorbar(mappable, ax=axes, label="speed of the fluid (L per time)", shrink=0.8, extend="max")
    return figure, rows


def _speed(run: RunFile) -> float:
    """Mean over periods 2 and 3."""
    ends = np.searchsorted(run.time, [PERIOD - 1e-9, 3 * PERIOD - 1e-9])
    r = run.position()[ends][:, :, 0]
    middle = 0.5 * (r[:, 1:] + r[:, :-1]).mean(axis=1)
    return float((middle[1] - middle[0]) / (2 * PERIOD))


def _flow(axes: Axes, run: RunFile):
    """Speed as colour, velocity as arrows, in the plane z = 0; the swimmer."""
    grid = run.grid
    assert grid is not None  # asked for in members
    field = grid.fields["velocity"][-1]
    x, y, z = (grid.origin[a] + grid.spacing[a] * np.arange(field.shape[a]) for a in range(3))
    plane = field[:, :, int(np.argmin(np.abs(z)))]
    i, j = (np.nonzero(np.abs(c) <= HALF)[0] for c in (x, y))
    cut = plane[np.ix_(i, j)]
    speed = np.linalg.norm(cut[..., :2], axis=-1)
    mappable = axes.pcolormesh(x[i], y[j], speed.T, cmap="Blues", shading="gouraud", vmin=0, vmax=0.3)
    every = max(1, len(i) // ARROWS)
    few = (slice(None, None, every), slice(None, None, every))
    axes.quiver(
        x[i][::every], y[j][::every], cut[..., 0][few].T, cut[..., 1][few].T, color="0.25", scale=7, width=2.5e-3
    )
    r = run.position()[np.searchsorted(run.time, grid.time[-1] - 1e-9)]
    axes.plot(r[:, 0], r[:, 1], color="#D55E00", lw=2)
    axes.set_aspect("equal")
    return mappable
