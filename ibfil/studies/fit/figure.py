"""The figure of `ibfil fit`: data and run, what remains over time and along the filament, the parameters' ellipses."""

from __future__ import annotations

import textwrap
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...visualization.style import AXES, COLOURS, drawing, literal, save, with_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

    from .results import Fit, Fitted

SHAPES, PAIRS = 6, 3  # drawn
_BINS = 12  # along the filament
_LEVELS = ((0.68, 2.28), (0.95, 5.99))  # of two parameters: chi-squared


def draw(result: Fit, path: Path) -> None:
    """Draw the fit into ``path``."""
    from matplotlib.figure import Figure

    bounded = [i for i, one in enumerate(result.parameters) if one.interval is not None]
    pairs = list(combinations(bounded, 2))[:PAIRS]
    with drawing():
        panels = [_shapes, _over_time, _along] if result.data is not None else []
        panels += [_observables] if result.observables else []
        count = len(panels) + len(pairs)
        columns = min(max(count, 1), 3)
        lines = -(-max(count, 1) // columns)
        fig = Figure(figsize=(1.0 + 3.5 * columns, 0.7 + 3.1 * lines), layout="constrained")
        axes = list(fig.subplots(lines, columns, squeeze=False).ravel())
        for panel, place in zip(panels, axes, strict=False):
            panel(place, result)
        for (i, j), place in zip(pairs, axes[len(panels) :], strict=False):
            _ellipse(place, result, i, j)
        for place in axes[count:]:
            place.set_axis_off()
        title = literal(textwrap.fill(result.title or "fit", 34 * columns))
        fig.suptitle(title, x=0.012, ha="left", fontsize=10.5, fontweight="bold")
        save(fig, path)


def _plane(result: Fit) -> tuple[int, int]:
    """The two of the data's axes along which they reach farthest."""
    every = np.concatenate([one.data for one in result.seen])
    a, b = sorted(np.argsort(-np.ptp(every, axis=0), kind="stable")[:2])
    return int(a), int(b)


def _shapes(axes: Axes, result: Fit) -> None:
    """Data as points, the run as lines, at six times."""
    import matplotlib

    assert result.data is not None
    a, b = _plane(result)
    times = result.data.times
    chosen = [times[i] for i in dict.fromkeys(np.linspace(0, len(times) - 1, SHAPES).round().astype(int))]
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(chosen)))
    for shade, time in zip(shades, chosen, strict=True):
        for one, frame in zip(result.seen, result.data.frames, strict=True):
            if frame.time == time:
                order = np.argsort(frame.s)
                axes.plot(one.model[order, a], one.model[order, b], color=shade, lw=1.2)
                axes.plot(one.data[:, a], one.data[:, b], ".", color=shade, ms=4, label=f"t = {time:.3g}")
    handles, labels = axes.get_legend_handles_labels()
    known = dict(zip(labels, handles, strict=True))
    axes.legend(known.values(), known.keys(), fontsize=6.5, loc="best", handletextpad=0.1)
    axes.set_aspect("equal", adjustable="datalim")
    seen = result.data.axes
    axes.set_xlabel(with_units(AXES[seen[a]], result.unit))
    axes.set_ylabel(with_units(AXES[seen[b]], result.unit))
    axes.set_title("data (points), run (lines)")


def _gaps(result: Fit) -> list[np.ndarray]:
    return [np.sum((one.model - one.data) ** 2, axis=1) for one in result.seen]


def _over_time(axes: Axes, result: Fit) -> None:
    """Root mean square distance of points, time by time."""
    assert result.data is not None
    gaps, times = _gaps(result), result.data.times
    held = {time: [] for time in times}  # type: dict[float, list[np.ndarray]]
    for gap, frame in zip(gaps, result.data.frames, strict=True):
        held[frame.time].append(gap)
    rms = [float(np.sqrt(np.mean(np.concatenate(held[time])))) for time in times]
    axes.plot(times, rms, "o-", color=COLOURS[0], ms=3.5)
    axes.set_ylim(0, 1.15 * max(max(rms), 1e-300))
    axes.set_xlabel(with_units("t", result.time_unit))
    axes.set_ylabel(with_units("rms distance of data from run", result.unit))
    axes.set_title("over time: level if the model holds")


def _along(axes: Axes, result: Fit) -> None:
    """Root mean square and mean distances, along the filament."""
    assert result.data is not None
    s = np.concatenate([frame.s for frame in result.data.frames])
    gap = np.concatenate([one.data - one.model for one in result.seen])
    ends = np.linspace(0, result.length, _BINS + 1)
    which = np.clip(np.digitize(s, ends) - 1, 0, _BINS - 1)
    kept = [k for k in range(_BINS) if np.any(which == k)]
    middle = [float(np.mean(s[which == k])) for k in kept]
    rms = [float(np.sqrt(np.mean(np.sum(gap[which == k] ** 2, axis=1)))) for k in kept]
    axes.plot(middle, rms, "o-", color=COLOURS[0], ms=3.5, label="rms distance")
    for number, axis in enumerate(result.data.axes):
        mean = [float(np.mean(gap[which == k, number])) for k in kept]
        axes.plot(
            middle, mean, "sD^"[number] + "--", ms=3, lw=1, color=COLOURS[1 + number], label=f"mean of {AXES[axis]}"
        )
    axes.axhline(0, color="0.7", lw=0.7, zorder=0)
    axes.set_xlabel(with_units("s", result.unit))
    axes.set_ylabel(with_units("data - run", result.unit))
    axes.legend(fontsize=7)
    axes.set_title("along the filament")


def _observables(axes: Axes, result: Fit) -> None:
    """How far each measured number is from the run's, in its standard errors."""
    names = list(result.observables)
    off = [(value - own) / error for value, error, own in result.observables.values()]
    axes.errorbar(off, range(len(names)), xerr=1.0, fmt="o", color=COLOURS[0], capsize=3)
    axes.axvline(0, color="0.5", lw=0.8)
    axes.set_yticks(range(len(names)), [literal(name) for name in names])
    axes.set_ylim(-0.7, len(names) - 0.3)
    axes.set_xlabel("measured - run, in standard errors")
    axes.set_title("measured numbers")


def _ellipse(axes: Axes, result: Fit, i: int, j: int) -> None:
    """Where two parameters lie together, 68 and 95 %."""
    one, other = result.parameters[i], result.parameters[j]
    sub = result.spread.covariance[np.ix_([i, j], [i, j])]
    widths, vectors = np.linalg.eigh(sub)
    turn = np.linspace(0, 2 * np.pi, 200)
    circle = vectors @ (np.sqrt(np.maximum(widths, 0))[:, None] * np.stack([np.cos(turn), np.sin(turn)]))
    for (level, limit), style in zip(_LEVELS, ("-", "--"), strict=True):
        x, y = (_outer(p, row) for p, row in zip((one, other), np.sqrt(limit) * circle, strict=True))
        axes.plot(x, y, style, color=COLOURS[0], lw=1.2, label=f"{level:.0%}")
    axes.plot(one.value, other.value, "+", color=COLOURS[1], ms=9, mew=1.6)
    for parameter, scale in ((one, axes.set_xscale), (other, axes.set_yscale)):
        if parameter.word:
            both = parameter.parameter
            scale("log" if both.by_log and both.high > 10 * both.low else "linear")
            _few_ticks(axes.xaxis if parameter is one else axes.yaxis)
    axes.set_xlabel(literal(one.parameter.key))
    axes.set_ylabel(literal(other.parameter.key))
    axes.legend(fontsize=7)
    axes.set_title("what the data leave open")


def _few_ticks(axis: Axis) -> None:
    """On a logarithmic axis: 1, 2, 5 over a decade or so, decades over more; plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    if axis.get_scale() == "log":
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 30 * low else (1,), numticks=5))
        axis.set_major_formatter(FuncFormatter(lambda x, location: f"{x:g}"))
        axis.set_minor_formatter(NullFormatter())


def _outer(one: Fitted, off: np.ndarray) -> np.ndarray:
    """Values of a parameter within its bounds, by steps from where it was found."""
    parameter = one.parameter
    wide = parameter.high - parameter.low
    values = one.value * np.exp(np.clip(off, -300, 300)) if parameter.by_log else one.value + off * wide
    return np.asarray(np.clip(values, parameter.low, parameter.high))
