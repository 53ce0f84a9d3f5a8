"""The figure of `ibfil compare`: shapes, paths, power, and the numbers of each fluid against the first."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...visualization.style import AXES, COLOURS, MARKS, drawing, literal, plane_of_motion, save, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...io.reader import RunFile
    from .results import Comparison


_LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))
# Numbers drawn against those of the first fluid, as far as there are any.
_DRAWN = ("speed", "reaction at start", "reaction at finish", "power of the nodes", "dissipated by the fluid",
          "Lighthill efficiency", "frequency (angular)")  # fmt: skip
_NEAR_ZERO = 1e-3  # of the largest component: a ratio of such numbers says nothing
_CERTAIN = 0.3
_NOISE = 1e-9  # of the largest number: what is left of a rod that rests


def draw(result: Comparison, runs: Mapping[str, RunFile], path: Path) -> None:
    """Draw the comparison into ``path``."""
    from matplotlib.figure import Figure

    with drawing():
        fig = Figure(figsize=(9.2, 6.6), layout="constrained")
        panels = fig.subplots(2, 2, gridspec_kw={"width_ratios": [1.15, 1]})
        looks = {name: (COLOURS[i % len(COLOURS)], _LINES[i % len(_LINES)]) for i, name in enumerate(runs)}
        positions = [np.asarray(columns["position"]) for run in runs.values() for columns in run.filaments.values()]
        plane = plane_of_motion(positions)
        _shapes(panels[0, 0], runs, looks, plane)
        _paths(panels[0, 1], runs, looks)
        _powers(panels[1, 0], result, runs, looks)
        _numbers(panels[1, 1], result, looks)
        handles, labels = panels[0, 1].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8.5)
        fig.suptitle(literal(textwrap.fill(result.title, 100)), x=0.012, ha="left", fontsize=10.5, fontweight="bold")
        for axes, letter in zip(panels.flat, "abcd", strict=True):
            axes.set_title(f"({letter})", loc="left", fontsize=9)
        save(fig, path)


Looks = Mapping[str, tuple]


def _shapes(axes: Axes, runs: Mapping[str, RunFile], looks: Looks, plane: tuple[int, int]) -> None:
    """The filaments at the end, and in grey as they began."""
    a, b = plane
    for i, (name, run) in enumerate(runs.items()):
        colour, line = looks[name]
        for columns in run.filaments.values():
            if i == 0:
                begin = columns["position"][0]
                axes.plot(begin[:, a], begin[:, b], color="0.75", lw=1)
            end = columns["position"][-1]
            axes.plot(end[:, a], end[:, b], color=colour, ls=line)
            axes.plot(end[0, a], end[0, b], "o", color=colour, ms=3)
    unit = next(iter(runs.values())).case.units.length
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(with_units(AXES[a], unit))
    axes.set_ylabel(with_units(AXES[b], unit) + "\n(grey: at the start; dot: s = 0)")


def _paths(axes: Axes, runs: Mapping[str, RunFile], looks: Looks) -> None:
    """How far the tip of the first filament has gone where an end is held, else its middle, along its longest way."""
    first = next(iter(runs.values()))
    name = next(iter(first.filaments))
    held = any(key in first.filaments[name] for key in ("reaction_start", "reaction_finish"))
    where = {True: "tip", False: "centroid"}[held]

    def track(run: RunFile) -> np.ndarray:
        r = np.asarray(run.filaments[name]["position"])
        return r[:, -1] if held else r.mean(axis=1)

    tracks = {fluid: track(run) - track(run)[0] for fluid, run in runs.items()}
    axis = int(np.argmax([max(np.ptp(t[:, k]) for t in tracks.values()) for k in range(3)]))
    for fluid, run in runs.items():
        colour, line = looks[fluid]
        axes.plot(run.time, tracks[fluid][:, axis], color=colour, ls=line, label=fluid)
    units = first.case.units
    axes.set_xlabel(with_units("time", units.time))
    axes.set_ylabel(with_units(f"{AXES[axis]} of the {where}, from the start", units.length))


def _powers(axes: Axes, result: Comparison, runs: Mapping[str, RunFile], looks: Looks) -> None:
    """Power of the nodes over the periods that count, and dots for what the fluid dissipates."""
    start = result.window.start if result.window else 0.0
    for fluid, run in runs.items():
        colour, line = looks[fluid]
        inside = run.time >= start - 1e-9 * run.time[-1]
        times = run.time[inside]
        axes.plot(times, np.asarray(run.diagnostics["power"])[inside], color=colour, ls=line)
        if "dissipation" in run.diagnostics:
            every = max(1, len(times) // 24)
            heat = np.asarray(run.diagnostics["dissipation"])[inside]
            axes.plot(times[::every], heat[::every], "o", color=colour, ms=2.6)
    from ...io.units import label

    units = next(iter(runs.values())).case.units
    axes.set_xlabel(with_units("time", units.time))
    unit = label(units, "force length/time")
    axes.set_ylabel(with_units("power", unit) + "\n(lines: F.u of the nodes; dots: dissipated)")


def _numbers(axes: Axes, result: Comparison, looks: Looks) -> None:
    """Each number over that of the first fluid, with the scatter between periods."""
    columns = [column for column in result.columns if column.numbers]
    first = columns[0].numbers
    names = [key for key in first if key.startswith("observed: ") or any(word in key for word in _DRAWN)]
    names = [
        key for key in names if key.removeprefix("observed: ") == key or key.removeprefix("observed: ") not in names
    ]
    largest = max((abs(first[key].value) for key in names), default=0.0)
    across = {word: max((abs(first[k].value) for k in names if word in k), default=0.0) for word in _DRAWN}

    def counts(key: str) -> bool:
        of_kind = max((size for word, size in across.items() if word in key), default=0.0)
        known = (first[key].error or 0.0) < _CERTAIN * abs(first[key].value)  # not what is left of a transient
        return known and abs(first[key].value) > max(_NEAR_ZERO * of_kind, _NOISE * largest)

    names = [key for key in names if counts(key)][:9]
    barred = any(one.sources for column in columns for one in column.numbers.values())
    step = 0.6 / max(len(columns) - 1, 1)
    for i, column in enumerate(columns):
        colour = looks[column.fluid][0]
        for row, key in enumerate(names):
            found = column.numbers.get(key)
            if found is None:
                continue
            y = row + (i - 0.5 * (len(columns) - 1)) * step
            scale = first[key].value
            error = abs(((found.bar if barred else found.error) or 0.0) / scale)
            axes.errorbar(found.value / scale, y, xerr=error, fmt=MARKS[i % len(MARKS)], color=colour, ms=5, capsize=2)
    axes.axvline(1.0, color="0.8", lw=0.8, zorder=0)
    axes.set_yticks(range(len(names)), [textwrap.fill(name, 20) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    count, what = (
        (result.window.count, "parts" if result.window.why else "periods") if result.window else (0, "periods")
    )
    bars = "step, nodes, place" if barred else "standard error"
    axes.set_xlabel(f"over that of {columns[0].fluid}\n(mean of {count} {what}; bars: {bars})")
