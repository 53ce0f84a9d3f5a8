"""The figure of `ibfil tune`: the bar against the cost, a curve a number of nodes, the target, the answer."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...visualization.style import COLOURS, drawing, literal, save
from .choice import settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .choice import Aim
    from .results import Tuned

MOST = 3  # numbers drawn
WIDE = np.geomspace(1 / 64, 8, 60)  # steps of a curve, in those of the answer


def draw(result: Tuned, path: Path) -> None:
    """Draw the bars of the first numbers into ``path``."""
    from matplotlib.figure import Figure

    aims = list(result.aims)[:MOST]
    with drawing():
        fig = Figure(figsize=(1.6 + 4.2 * len(aims), 4.6), layout="constrained")
        panels = fig.subplots(1, len(aims), squeeze=False)[0]
        for axes, aim in zip(panels, aims, strict=True):
            _panel(axes, result, aim)
        title = literal(textwrap.fill(result.title or "cheapest settings", 34 * len(aims) + 20))
        fig.suptitle(title, x=0.012, ha="left", fontsize=10.5, fontweight="bold")
        fig.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=3, fontsize=7.5)
        save(fig, path)


def _panel(axes: Axes, result: Tuned, aim: Aim) -> None:
    """Curves over the step for some numbers of nodes; target, answer, the case's own settings."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    value = abs(aim.nodes.coarsest.values[-1])
    scale = 100.0 / value if value > aim.allowed else 1.0
    counts = sorted({result.answer.nodes, *result.probed})
    for nodes, colour, style in zip(counts, (*COLOURS[1:], *COLOURS), _STYLES, strict=False):
        line = [settings([aim], float(step), nodes, result.end, result.seconds) for step in WIDE * result.answer.step]
        bars = np.array([one.bar(aim.number) for one in line]) * scale
        axes.plot(
            [one.seconds for one in line],
            np.where(np.isfinite(bars), bars, np.nan),
            style,
            color=colour,
            lw=1.3,
            label=f"{nodes} nodes",
        )
    axes.axhline(aim.allowed * scale, color="0.35", lw=1, ls=(0, (1, 1)), label="target")
    for one, mark, label in ((result.own, "s", "the case's own"), (result.answer, "o", "chosen, its bar as foretold")):
        height = one.bar(aim.number) * scale
        if np.isfinite(height):
            axes.plot(one.seconds, height, mark, color="black", mfc="white", ms=7, label=label)
    axes.plot(
        result.answer.seconds,
        result.found(aim.number) * scale,
        "x",
        color="black",
        ms=7,
        label="chosen, as a run found it",
    )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(top=min(axes.get_ylim()[1], 30 * aim.allowed * scale))
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, place: f"{y:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_title(aim.number, loc="left", fontweight="bold")
    axes.set_xlabel("seconds of a run's steps, from counts")
    axes.set_ylabel("error bar, % of the number" if scale != 1.0 else "error bar")


_STYLES = ("-", "--", "-.", ":")
