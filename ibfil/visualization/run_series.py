"""The panels of the run's figure against time: observables, speed, elastic energy, power, stretch."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..analysis.energy import elastic_energy
from ..io.units import label
from ..observables.base import KINDS
from ..observables.copies import series_parts
from ..observables.time_series import trapezoid_weights
from .moments import Moments
from .style import AXES, COLOURS, literal, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..io.reader import RunFile


SERIES = 3  # observables drawn; the rest are in --csv
LINES = 3  # filaments, or copies, with a line of their own; more are a mean and a band
WIDEST = 62  # letters of a title without its units
TITLE = 60  # letters in a line with the title of a panel
BAND = (10, 90)  # percent of filaments within the band
DIAGNOSTICS = {
    "power on the fluid": {"power": ""},
    "stretch of segments": {"stretch_max": "max", "stretch_min": "min"},
}


class Panel(NamedTuple):
    """A panel against time: its title, its units, the lines by their labels, and a band (2, T) about the first."""

    title: str
    units: str
    lines: dict[str, np.ndarray]
    band: np.ndarray | None = None


def panels(run: RunFile) -> list[Panel]:
    """The panels of a run, over all its outputs."""
    series = []
    for name, column in list(run.observables.items())[:SERIES]:
        lines = series_parts(run.case, name, np.asarray(column))
        series.append(_observed(_meaning(run, name), run.units(f"observables/{name}"), lines))
    series += _motion(run)
    for title, parts in DIAGNOSTICS.items():
        lines = {word: np.asarray(run.diagnostics[key]) for key, word in parts.items() if key in run.diagnostics}
        if lines and not (thermal(run) and "power" in parts):
            series.append(Panel(title, run.units(f"diagnostics/{next(iter(parts))}"), lines))
    return series


def _observed(title: str, units: str, lines: dict[str, np.ndarray]) -> Panel:
    """The lines of an observable; of many copies' vectors, called 000_x, the mean of each component."""
    axes = {word.partition("_")[2] for word in lines}
    if len(lines) <= LINES or axes == {""}:
        return _of_many(title, units, lines)
    own = {axis: [line for word, line in lines.items() if word.endswith(axis)] for axis in AXES}
    words = f", mean of {len(own[AXES[0]])}"
    return Panel(_short(title, words), units, {axis: np.mean(every, axis=0) for axis, every in own.items()})


def thermal(run: RunFile) -> bool:
    """Whether the run has noise: a velocity of it is a kick over the step, and says nothing of the motion."""
    return run.case.thermal is not None and run.case.thermal.energy > 0


def _motion(run: RunFile) -> list[Panel]:
    """Speed of the centroid, of a thermal run how far it went, and elastic energy."""
    units, kicked = run.case.units, thermal(run)
    moves, energies = {}, {}
    for name in run.filaments:
        s, column = run.arclength(name), "position" if kicked else "velocity"
        mean = np.einsum("tnc,n->tc", np.asarray(run.filaments[name][column]), trapezoid_weights(s) / s[-1])
        moves[name] = np.linalg.norm(mean - mean[0] if kicked else mean, axis=1)
        energy = elastic_energy(run, name)
        if energy is not None:
            energies[name] = energy
    if kicked:
        out = [_of_many("distance of the centroid from its start", units.length, moves)]
    else:
        out = [_of_many("speed of the centroid", label(units, "length/time"), moves)]
    return out + ([_of_many("elastic energy", label(units, "force length"), energies)] if energies else [])


def _of_many(title: str, units: str, lines: dict[str, np.ndarray]) -> Panel:
    """A line a filament or copy, or of many the mean, in a band that most are within."""
    if len(lines) == 1:
        return Panel(title, units, {"": next(iter(lines.values()))})
    if len(lines) <= LINES:
        return Panel(title, units, lines)
    every = np.array(list(lines.values()))
    words = f", mean of {len(lines)}, band {BAND[0]} to {BAND[1]} %"
    return Panel(_short(title, words), units, {"": every.mean(axis=0)}, np.percentile(every, BAND, axis=0))


def _short(title: str, more: str = "") -> str:
    """A title that fits above its panel, and more words that are not cut."""
    return textwrap.shorten(title, WIDEST - len(more), placeholder=" ...") + more


def _meaning(run: RunFile, name: str) -> str:
    """An observable's name, what its series is and where: "speed (drift): position at centroid along x".

    The series need not be the like of its summary.
    """
    words = run.description(f"observables/{name}")
    if len(run.filaments) == 1:
        words = words.replace(f" of {next(iter(run.filaments))}", "", 1)
    words = words.replace('"', "").replace(", at = ", " at ")
    for k, axis in enumerate(AXES):
        for sign in (1, -1):
            unit = [sign * int(i == k) for i in range(3)]
            words = words.replace(f", along = {unit}", f" along {'-' if sign < 0 else ''}{axis}")
    known = run.case.observe.items()
    own, observe = next(((own, one) for own, one in known if one.recorded(own) == name), (name, None))
    fit = f" ({observe.kind})" if observe is not None and KINDS[observe.kind].number else ""
    return _short(f"{own}{fit}: {words}")


def against_time(axes: Axes, run: RunFile, panel: Panel, seen: Moments) -> None:
    """One panel of values against time; its title says what and in which units: labels would collide.

    A start that dwarfs all the rest, as of a shape that has yet to relax, is left out of the scale, and the
    title says so.
    """
    times, lines = np.asarray(run.time)[seen.span], {word: line[seen.span] for word, line in panel.lines.items()}
    if panel.band is not None:
        axes.fill_between(times, *panel.band[:, seen.span], color=COLOURS[0], alpha=0.25, linewidth=0)
    wide = 1.4 if len(times) < 1000 else 0.7
    for (word, values), colour in zip(lines.items(), COLOURS, strict=False):
        axes.plot(times, values, color=colour, label=word, lw=wide)
    title = with_units(literal(panel.title), panel.units)
    if len(lines) > 1:
        beside = len(title) + sum(4 + len(word) for word in lines) < TITLE
        place = (
            {"loc": "lower right", "bbox_to_anchor": (1.0, 0.98), "borderaxespad": 0.0} if beside else {"loc": "best"}
        )
        axes.legend(ncols=len(lines), handlelength=1.0, **place)
    limits = limits_without_start(list(lines.values()))
    if limits is not None and panel.band is None:
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
