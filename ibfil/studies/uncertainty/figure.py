"""The figure of `ibfil uncertainty`: each number's sources as signed bars, and the number as stated and as meant."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...visualization.style import COLOURS, STYLE, save, with_units
from ..tables import with_bar

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .results import Bar, Uncertainty

MOST = 6  # numbers drawn
NUMERICAL, CHOICE = COLOURS[0], COLOURS[4]


def draw(result: Uncertainty, path: Path) -> None:
    """Draw the bars of the first numbers into ``path``."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    bars = [bar for bar in result.bars if not bar.nothing][:MOST]
    lines = max((len(bar.sources) for bar in bars), default=1)
    with matplotlib.rc_context(STYLE):
        fig = Figure(figsize=(9.2, 1.2 + max(len(bars), 1) * (0.75 + 0.28 * lines)), layout="constrained")
        grid = fig.subplots(max(len(bars), 1), 2, squeeze=False, gridspec_kw={"width_ratios": [1.5, 1.0]})
        for (left, right), bar in zip(grid, bars, strict=False):
            _sources(left, bar)
            _values(right, bar)
        if not bars:
            for axes in grid.ravel():
                axes.set_axis_off()
        fig.suptitle(
            textwrap.fill(result.title or "uncertainty", 100), x=0.012, ha="left", fontsize=10.5, fontweight="bold"
        )
        marks = [Patch(color=NUMERICAL, label="numerical: goes to zero with effort")]
        if any(not one.numerical for bar in bars for one in bar.sources):
            marks.append(Patch(color=CHOICE, label="choice: another scene"))
        left_out = len(result.bars) - len(bars)
        note = "error of the run, signed; whiskers: its doubt" + (f"; {left_out} numbers not drawn" if left_out else "")
        fig.legend(
            handles=marks,
            loc="outside lower left",
            ncols=2,
            fontsize=8,
            title=note,
            title_fontsize=7.5,
            alignment="left",
        )
        save(fig, path)


def percent(bar: Bar) -> bool:
    """Whether errors are told in per cent of the number: not of one that its bar does not tell from zero."""
    return abs(bar.value) > bar.bar


def _sources(axes: Axes, bar: Bar) -> None:
    """A bar a source, first on top."""
    scale = 100.0 / bar.value if percent(bar) else 1.0
    axes.axvline(0, color="0.4", lw=0.8)
    for place, one in enumerate(bar.sources):
        colour = NUMERICAL if one.numerical else CHOICE
        if one.estimate is None:
            axes.text(0, place, " not known", va="center", fontsize=7.5, color=colour)
            continue
        axes.barh(place, scale * one.estimate.error, 0.6, color=colour, alpha=0.8)
        axes.errorbar(
            scale * one.estimate.error, place, xerr=abs(scale) * one.estimate.doubt, color="black", lw=1.0, capsize=2.5
        )
    axes.set_yticks(range(len(bar.sources)), [one.name for one in bar.sources])
    axes.set_ylim(len(bar.sources) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_title(bar.name, loc="left", fontweight="bold")
    axes.set_xlabel("error, % of the number" if percent(bar) else with_units("error", bar.unit), fontsize=8)


def _values(axes: Axes, bar: Bar) -> None:
    """The number of the run as a line with its bar; corrected, and as meant, as points."""
    axes.axvspan(bar.value - bar.bar, bar.value + bar.bar, color=NUMERICAL, alpha=0.15, lw=0)
    axes.axvline(bar.value, color=NUMERICAL, lw=1.4)
    points = [("corrected", *bar.corrected, NUMERICAL)]
    if bar.meant is not None:
        points.append(("as meant", *bar.meant, CHOICE))
    for place, (_, value, doubt, colour) in enumerate(points, 1):
        axes.errorbar(value, place, xerr=doubt, fmt="o" if colour == NUMERICAL else "s", color=colour, capsize=3, ms=5)
    names = [f"as stated\n{with_bar(bar.value, bar.bar)}", *(f"{n}\n{with_bar(v, u)}" for n, v, u, _ in points)]
    axes.set_yticks(range(len(names)), names, fontsize=7.5)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_locator(_few())
    axes.ticklabel_format(axis="x", useOffset=False)
    axes.set_xlabel(with_units(bar.name, bar.unit), fontsize=8)
    reach = [abs(value - bar.value) + doubt for _, value, doubt, _ in points]
    wide = 1.25 * max(bar.bar, *reach, 1e-12 * abs(bar.value), 1e-300)
    if np.isfinite(wide):
        axes.set_xlim(bar.value - wide, bar.value + wide)


def _few():
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(4)
