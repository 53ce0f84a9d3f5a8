"""The figure of `ibfil modes`: the eigenvalues in the complex plane, the first modes over a period, the threshold."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...timestepping.steady import rods
from ...visualization.style import AXES, COLOURS, MARKS, STYLE, save
from ..tables import with_bar
from .run_file import SWING, swing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.ticker import Locator

    from ...simulation.at_rest import SceneAtRest
    from .results import Found, Mode, Threshold

SHAPES = 4  # modes drawn
PHASES = 8  # of each
_COARSE = 30.0  # ratio of rates from which on the plane's growth axis is not linear


def draw(found: Found, scene: SceneAtRest, path: Path) -> None:
    """Draw the modes into ``path``."""
    import matplotlib
    from matplotlib.figure import Figure

    shapes = found.modes[:SHAPES]
    wide = 1 + (found.threshold is not None)
    with matplotlib.rc_context(STYLE):
        fig = Figure(figsize=(4.0 * wide + 4.6, 4.2), layout="constrained")
        grid = fig.add_gridspec(2, 2 * wide + 2, width_ratios=[1.0] * (2 * wide) + [1.1, 1.1])
        _plane(fig.add_subplot(grid[:, :2]), found)
        if found.threshold is not None:
            _threshold(fig.add_subplot(grid[:, 2:4]), found.threshold)
        for number, mode in enumerate(shapes):
            axes = fig.add_subplot(grid[number // 2, 2 * wide + number % 2])
            _shape(axes, scene, found, mode, number)
        fig.suptitle(textwrap.fill(found.title, 90), x=0.012, ha="left", fontsize=10.5, fontweight="bold")
        words = (
            f"modes over half a period, drawn {SWING:g} L large; dashed: the rest; growth and frequency of many nodes"
        )
        fig.text(0.995, 0.005, words, ha="right", va="bottom", fontsize=7, color="0.4")
        save(fig, path)


def _plane(axes: Axes, found: Found) -> None:
    """Growth across, frequency up; the half plane that grows is shaded."""
    values = [mode.corrected for mode in found.modes]
    sizes = [abs(value.real) for value in values if value.real]
    if sizes and max(sizes) > _COARSE * min(sizes):
        axes.set_xscale("symlog", linthresh=min(sizes))
        axes.xaxis.set_major_locator(_decades(min(sizes), max(sizes)))
    kinds = list(dict.fromkeys(mode.kind.word for mode in found.modes))
    for number, mode in enumerate(found.modes):
        which = kinds.index(mode.kind.word)
        value, colour, mark = mode.corrected, COLOURS[which % len(COLOURS)], MARKS[which % len(MARKS)]
        for sign in (1, -1) if value.imag else (1,):
            axes.errorbar(
                value.real,
                sign * abs(value.imag),
                xerr=None if mode.growth is None else mode.growth.doubt,
                yerr=None if mode.frequency is None else mode.frequency.doubt,
                fmt=mark,
                color=colour,
                ms=6 + 3 * (mode.count > 1),
                mfc="none" if mode.count > 1 else colour,
                capsize=2,
                label=None,
            )
        axes.annotate(str(number + 1), (value.real, abs(value.imag)), (5, 5), textcoords="offset points", fontsize=7.5)
    for which, word in enumerate(kinds):
        axes.plot([], [], MARKS[which % len(MARKS)], color=COLOURS[which % len(COLOURS)], label=word)
    if any(mode.count > 1 for mode in found.modes):
        axes.plot([], [], "o", color="0.4", mfc="none", ms=9, label="double")
    low, high = axes.get_xlim()
    high = max(high, 0.02 * (high - low))
    axes.axvspan(0, 10 * max(abs(low), abs(high)), color=COLOURS[1], alpha=0.08, lw=0)
    axes.axvline(0, color="0.4", lw=0.8)
    axes.set_xlim(low, high)
    if not any(value.imag for value in values):
        axes.set_ylim(-1, 1)
        axes.set_yticks([0])
    axes.set_xlabel("growth, 1/time (shaded: grows)")
    axes.set_ylabel("frequency, radians/time")
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.16), fontsize=7.5, ncols=3)


def _decades(small: float, large: float) -> Locator:
    """Ticks at zero and at three powers of ten to either side."""
    from matplotlib.ticker import FixedLocator

    low, high = np.ceil(np.log10(small)), np.floor(np.log10(large)) + 1
    powers = 10.0 ** np.unique(np.round(np.linspace(low, high, 3)))
    return FixedLocator([*-powers[::-1], 0.0, *powers])


def _shape(axes: Axes, scene: SceneAtRest, found: Found, mode: Mode, number: int) -> None:
    """One mode over a period, in the plane in which it moves most; a turn alone as a curve over arclength."""
    rest, vector = found.rest.configuration, swing(scene, mode)
    phases = np.exp(1j * np.pi * np.arange(PHASES) / (PHASES - 1))
    value = mode.corrected
    name = f"{number + 1}  {value.real:+.4g}" + (f" {abs(value.imag):+.4g}i" if value.imag else "")
    axes.set_title(name, fontsize=8.5, loc="left")
    axes.tick_params(labelsize=7)
    if mode.kind.energy[1] > 0.9 and vector.shape[1] == 4:
        for rod in rods(scene.system):
            s = scene.simulation.arclength[rod]
            for i, turn in enumerate(phases):
                axes.plot(s, (vector[rod, 3] * turn).real, color=_shade(i), lw=1.0)
        axes.set_xlabel("s", fontsize=7.5, labelpad=1)
        axes.set_ylabel("turn", fontsize=7.5, labelpad=1)
        return
    moved = np.abs(vector[:, :3]).max(axis=0)
    reach = np.ptp(rest.r, axis=0) + 2 * moved
    up = int(np.argmax(moved))
    across = int(np.argmax(np.where(np.arange(3) == up, -1.0, reach)))
    for rod in rods(scene.system):
        for i, turn in enumerate(phases):
            r = rest.r[rod] + (vector[rod, :3] * turn).real
            axes.plot(r[:, across], r[:, up], color=_shade(i), lw=1.0)
        axes.plot(rest.r[rod, across], rest.r[rod, up], color="black", lw=1.2, ls=(0, (4, 2)))
    axes.set_xlabel(AXES[across], fontsize=7.5, labelpad=1)
    axes.set_ylabel(AXES[up], fontsize=7.5, labelpad=1)


def _shade(phase: int) -> tuple[float, float, float]:
    """From blue to ochre over half a period."""
    from matplotlib.colors import to_rgb

    a, b = (np.array(to_rgb(COLOURS[k])) for k in (0, 4))
    r, g, b = a + (b - a) * phase / (PHASES - 1)
    return float(r), float(g), float(b)


def _threshold(axes: Axes, limit: Threshold) -> None:
    """Growth against the key, its zero, and the bar."""
    x, y = np.array(limit.scan).T
    axes.axhline(0, color="0.4", lw=0.8)
    axes.plot(x, y, MARKS[0] + "-", color=COLOURS[0], ms=4)
    axes.axvspan(limit.value - limit.bar, limit.value + limit.bar, color=COLOURS[1], alpha=0.4, lw=0)
    axes.axvline(limit.value, color=COLOURS[1], lw=1.2)
    axes.annotate(
        with_bar(limit.value, limit.bar).replace("+-", "\u00b1"),
        (limit.value, 0.04),
        (5, 0),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        color=COLOURS[1],
        fontsize=8.5,
    )
    axes.set_xlabel(limit.key)
    axes.set_ylabel("growth of the leading mode, 1/time")
