"""The figure of a sweep: an observable against one or two of the keys that were varied."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from ..visualization.style import COLOURS, MARKS, drawing, literal, save, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .sweep import Swept


MAPPED = len(COLOURS)  # values of the second key from which a map is drawn, and no lines
LOGARITHMIC = 20.0  # of the largest value to the least, from which an axis is logarithmic


def check(names: Sequence[str], against: Sequence[str], varied: Sequence[str]) -> list[str]:
    """The keys of a figure's axes, by default the first two that are varied. Raises CaseError for others."""
    faults = [f"--against: found {key}; allowed: {', '.join(varied)}" for key in against if key not in varied]
    if len(against) > 2 or len(set(against)) < len(against):
        faults.append(f"--against: found {', '.join(against)}; allowed: one key or two")
    if against and not names:
        faults.append("--against: found without --figure; allowed: with it")
    if faults:
        raise CaseError(faults)
    return list(against or varied[:2])


def draw(rows: Sequence[Swept], name: str, keys: Sequence[str], title: str, folder: Path) -> Path:
    """Draw the observable ``name`` into ``folder``/sweep_NAME.png and .pdf; returns the first path.

    Against one key it is a line; a second one gives each of its values a line, many of them a map. Where others vary
    too all runs are shown, and lines go through their means. Bars are standard errors. Raises CaseError for an
    observable that no run has.
    """
    from matplotlib.figure import Figure

    done = [row for row in rows if name in row.numbers and np.isfinite(row.numbers[name])]
    if not done:
        there = ", ".join(dict.fromkeys(key for row in rows for key in row.numbers)) or "none: no run is done"
        raise CaseError([f"--figure: found {name}; allowed: {there}"])
    path, shown = folder / f"sweep_{name}.png", _labelled(done[0], name)
    with drawing():
        fig = Figure(figsize=(6.4, 4.4), layout="constrained")
        axes = fig.add_subplot()
        places = [_places([row.setting.values[key] for row in done]) for key in keys]
        values = np.array([row.numbers[name] for row in done])
        errors = np.array([row.errors.get(name, 0.0) for row in done])
        if len(keys) == 2 and len(set(places[1][0])) > MAPPED:
            _map(fig, axes, places, values, shown, keys)
        else:
            _lines(axes, places, values, errors, keys)
            axes.set_ylabel(shown)
        _scale(axes, "x", *places[0])
        axes.set_xlabel(literal(keys[0]))
        others = [key for key in done[0].setting.values if key not in keys]
        note = f"; lines: means over {', '.join(others)}" if others else ""
        note += f"; {len(rows) - len(done)} of {len(rows)} runs have no number" if len(done) < len(rows) else ""
        axes.set_title(literal(textwrap.fill(title + note, 90)), loc="left")
        save(fig, path)
    return path


def _labelled(row: Swept, name: str) -> str:
    """The observable, a vector's NAME_x for a part of it, with its units as the run has them."""
    from ..analysis.summary import digest
    from ..io.reader import RunFile

    with RunFile(row.outcome.path) as run:
        told = digest(run)["observables"]
    one = told.get(name) or told.get(name.rpartition("_")[0])
    return with_units(literal(name), one["units"] if one else "")


def _places(texts: Sequence[str]) -> tuple[np.ndarray, list[str]]:
    """Values as numbers, and no words; or words, each with its place, where one is no number."""
    try:
        return np.array([float(text) for text in texts]), []
    except ValueError:
        words = list(dict.fromkeys(texts))
        return np.array([float(words.index(text)) for text in texts]), words


def _lines(
    axes: Axes,
    places: Sequence[tuple[np.ndarray, list[str]]],
    values: np.ndarray,
    errors: np.ndarray,
    keys: Sequence[str],
) -> None:
    """A line for each value of the second key, through the means of the runs at each value of the first."""
    x = places[0][0]
    second, words = places[1] if len(places) == 2 else (np.zeros(len(x)), [])
    for k, value in enumerate(np.unique(second)):
        own, colour, mark = second == value, COLOURS[k % len(COLOURS)], MARKS[k % len(MARKS)]
        at = np.unique(x[own])
        means = [values[own & (x == one)].mean() for one in at]
        axes.plot(at, means, color=colour, lw=1.2, zorder=1)
        label = (words[int(value)] if words else f"{value:.6g}") if len(places) == 2 else None
        bars = errors[own] if np.any(errors[own] > 0) else None
        axes.errorbar(x[own], values[own], bars, fmt=mark, color=colour, ms=4.5, capsize=2, lw=1, label=label)
    if len(places) == 2:
        axes.legend(title=literal(keys[1]), title_fontsize=8)
    axes.grid(axis="y", color="0.9", linewidth=0.6)


def _map(
    fig: Figure,
    axes: Axes,
    places: Sequence[tuple[np.ndarray, list[str]]],
    values: np.ndarray,
    name: str,
    keys: Sequence[str],
) -> None:
    """The observable as colour over both keys; what has no run is left white."""
    (x, _), (y, _) = places
    across, up = np.unique(x), np.unique(y)
    table = np.full((len(up), len(across)), np.nan)
    for j, b in enumerate(up):
        for i, a in enumerate(across):
            here = (x == a) & (y == b)
            table[j, i] = values[here].mean() if here.any() else np.nan
    mesh = axes.pcolormesh(_edges(*places[0]), _edges(*places[1]), table, cmap="viridis")
    _scale(axes, "y", *places[1])
    axes.set_ylabel(literal(keys[1]))
    bar = fig.colorbar(mesh, ax=axes)
    bar.set_label(name)
    bar.outline.set_visible(False)


def _logarithmic(places: np.ndarray, words: Sequence[str]) -> bool:
    return not words and bool(places.min() > 0 and places.max() >= LOGARITHMIC * places.min())


def _edges(places: np.ndarray, words: Sequence[str]) -> np.ndarray:
    """The edges (n+1,) of cells about n values, half way between two as the axis shows them."""
    logarithmic = _logarithmic(places, words)
    at = np.unique(np.log(places) if logarithmic else places)
    middles = 0.5 * (at[1:] + at[:-1])
    half = 0.5 * (at[[1, -1]] - at[[0, -2]]) if len(at) > 1 else np.full(2, 0.5)
    edges = np.concatenate([[at[0] - half[0]], middles, [at[-1] + half[1]]])
    return np.exp(edges) if logarithmic else edges


def _scale(axes: Axes, side: str, places: np.ndarray, words: Sequence[str]) -> None:
    """The axis of a key: words at their places, a logarithm where values span a decade or more."""
    if words:
        getattr(axes, f"set_{side}ticks")(range(len(words)), [literal(textwrap.shorten(word, 24)) for word in words])
    elif _logarithmic(places, words):
        getattr(axes, f"set_{side}scale")("log")
