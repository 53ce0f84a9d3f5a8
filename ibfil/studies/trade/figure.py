"""The figure of `ibfil trade`: error against seconds a unit of simulated time, a panel a measure."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...visualization.style import COLOURS, MARKS, drawing, literal, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .results import Trade, Trial


MOST = 4  # panels
_APART = np.array([0.5, 0.12])  # decades between two texts


def draw(result: Trade, path: Path) -> None:
    """Draw the trade into ``path``."""
    from matplotlib.figure import Figure

    measures = result.measures[:MOST]
    with drawing():
        fig = Figure(figsize=(1.2 + 4.3 * len(measures), 4.6), layout="constrained")
        panels = fig.subplots(1, len(measures), sharex=True, squeeze=False)[0]
        groups, along = group(result)
        for axes, measure in zip(panels, measures, strict=True):
            _panel(axes, result, measure, groups, along)
        title = literal(textwrap.fill(result.title or "error against wall time", 34 * len(measures) + 20))
        fig.suptitle(title, x=0.012, ha="left", fontsize=10.5, fontweight="bold")
        about = f"{result.about['date']}, ibfil {result.about['versions']['ibfil']}, {result.about['machine']}"
        many = result.about["repeats"]
        bars = f"bars: range of up to {many} runs, point: the least; hollow: under the reference's own error"
        _few_ticks(panels[0])
        fig.legend(
            *panels[0].get_legend_handles_labels(),
            loc="outside lower left",
            ncols=2 * len(measures),
            fontsize=7.5,
            title=f"{bars}\n{about}",
            title_fontsize=7,
            alignment="left",
        )
        save(fig, path)


def _few_ticks(axes: Axes) -> None:
    """On an axis of little more than a decade: 1, 2, 5 with plain numbers; room on both sides of a single point."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    if high < 1.1 * low:  # matplotlib takes what rounding makes of one point for two
        axes.set_xlim(low := low / 3, high := high * 3)
    if high < 50 * low:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, location: f"{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())


def group(result: Trade) -> tuple[dict[str, list[int]], str]:
    """Settings that differ in one key of numbers, which a line joins; the key with the most values is taken."""
    values: dict[str, set[str]] = {}
    for one in result.trials:
        for key, value in one.setting.values.items():
            values.setdefault(key, set()).add(value)
    numeric = [key for key, found in values.items() if all(map(_is_number, found))]
    along = max(numeric, key=lambda key: len(values[key]), default="")
    varied = [key for key, found in values.items() if key != along and len(found) > 1]
    groups: dict[str, list[int]] = {}
    for i, one in enumerate(result.trials):
        words = [f"{_tail(key)} {one.setting.values[key]}" for key in varied]
        groups.setdefault(", ".join(words) or _tail(along), []).append(i)
    return groups, along


def _tail(key: str) -> str:
    return key.rsplit(".", 1)[-1]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _panel(axes: Axes, result: Trade, measure: str, groups: dict[str, list[int]], along: str) -> None:
    """One measure."""
    floor = result.reference.estimate(measure)
    good = [one.errors[measure] for one in result.trials if one.errors and one.errors[measure] > 0]
    low = 0.4 * min([*good, floor] if floor > 0 else good, default=1e-3)
    high = 3.0 * max([*good, floor], default=1.0)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhspan(low / 10, max(floor, low / 10), color="0.9", label="under the reference's own error", zorder=0)
    if not result.reference.nodes:
        own = result.reference.of_nodes(measure)
        high = max(high, 2 * own)
        axes.axhline(own, color="0.45", ls=(0, (5, 3)), lw=1, label="the case's own nodes against the finest tried")
    front = [result.trials[i] for i in result.fronts[measure]]
    axes.step(
        [one.cost for one in front],
        [one.errors[measure] for one in front],
        where="post",
        color="0.55",
        lw=5,
        alpha=0.35,
        solid_capstyle="round",
        label="Pareto front",
        zorder=1,
    )
    named: list[np.ndarray] = []  # places that have a text
    for number, (name, members) in enumerate(groups.items()):
        _line(axes, [result.trials[i] for i in members], result, measure, name, along, number, high, named)
    axes.set_ylim(low, high * 1.6)
    clock = {"wall": "seconds", "processor": "processor seconds"}[result.about["clock"]]
    axes.set_xlabel(f"{clock} a unit of simulated time")
    words = "position: rms over nodes / L" if measure == "position" else f"{measure}: relative error"
    axes.set_ylabel(words)
    axes.grid(True, which="major", color="0.92", lw=0.6)


def _line(
    axes: Axes,
    trials: list[Trial],
    result: Trade,
    measure: str,
    name: str,
    along: str,
    number: int,
    top: float,
    named: list[np.ndarray],
) -> None:
    """The settings of one group: hollow where the reference cannot tell, crosses at the top where they failed."""
    colour, mark = COLOURS[number % len(COLOURS)], MARKS[number % len(MARKS)]
    done = [one for one in trials if one.errors]
    if along:
        done.sort(key=lambda one: float(one.setting.values[along]))
    x = np.array([one.cost for one in done])
    y = np.array([max(one.errors[measure], 1e-300) for one in done])
    spread = np.array([[0.0, max(one.seconds, default=0.0) - one.cost] for one in done]).reshape(-1, 2).T
    axes.errorbar(x, y, xerr=spread, color=colour, lw=1.2, elinewidth=0.8, capsize=2, zorder=2)
    if done:
        axes.plot([], [], mark + "-", color=colour, ms=5.5, lw=1.2, label=name)
    for one, cost, error in zip(done, x, y, strict=True):
        face = "white" if result.uncertain(one, measure) else colour
        axes.plot(cost, error, mark, color=colour, mfc=face, ms=5.5, zorder=3)
    for i in (0, -1) if along and done else ():
        here = np.log10([x[i], y[i]])
        if all(np.any(np.abs(here - there) > _APART) for there in named):
            named.append(here)
            words = f"{_tail(along)} {float(done[i].setting.values[along]):.3g}"
            axes.annotate(words, (x[i], y[i]), (6, 3), textcoords="offset points", fontsize=6, color=colour)
    lost = [one for one in trials if one.status == "failed"]
    for one in lost:
        # Where a run fails at its first step it has no pace: at the left edge then.
        cost, where = (one.cost, axes.transData) if one.seconds else (0.02, axes.get_yaxis_transform())
        axes.plot(cost, top, "x", color=colour, ms=7, mew=1.6, transform=where, clip_on=False, zorder=3)
    if lost:
        axes.plot([], [], "x", color=colour, label=f"{name}: failed")
