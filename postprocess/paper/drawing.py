"""What the figures have in common: style, colours, shapes over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")  # told apart by all eyes (Okabe, Ito)
TIME = matplotlib.colormaps["viridis"]
STYLE = {
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
}


def new_figure(width: float, height: float, title: str) -> Figure:
    """An empty figure, in inches, with a title."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.06))
    figure.suptitle(title, x=0.012, ha="left", fontsize=11, fontweight="bold")
    return figure


def axes_labels(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Names of the axes, and of the panel."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, loc="left")


def stroboscopic(axes: Axes, shapes: np.ndarray, count: int) -> None:
    """``count`` of the shapes (T, N, 2), evenly spaced in time and coloured by it: dark first, light last."""
    chosen = np.unique(np.linspace(0, len(shapes) - 1, count).round().astype(int))
    for k, shape in enumerate(shapes[chosen]):
        axes.plot(*shape.T, color=TIME(0.92 * k / max(len(chosen) - 1, 1)), lw=1.2)
    axes.set_aspect("equal", adjustable="datalim")
