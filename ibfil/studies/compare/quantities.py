"""The quantities of a run over whole periods, each with its scatter between them: the rows of `ibfil compare`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...io.units import label
from ...observables import time_series
from ...observables.time_series import trapezoid_weights
from ..distance import common_outputs, rms, rms_of_shape
from ..estimates import combined

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...io.reader import RunFile
    from ..uncertainty.results import Source


@dataclass(frozen=True)
class Window:
    """``count`` whole periods, the last of which ends at ``end``; or equal parts, and ``why`` they are no periods."""

    end: float
    period: float
    count: int
    why: str = ""

    @property
    def start(self) -> float:
        """When the first of them begins."""
        return self.end - self.count * self.period

    def each(self) -> Iterator[tuple[float, float]]:
        """The start and the end of each."""
        for k in range(self.count):
            yield self.start + k * self.period, self.start + (k + 1) * self.period


@dataclass(frozen=True)
class Quantity:
    """A number, its standard error from the scatter between periods (None with fewer than two), and its unit.

    ``sources`` are those of its numerical errors, where they were looked for.
    """

    value: float
    error: float | None
    unit: str
    sources: tuple[Source, ...] = ()

    @property
    def bar(self) -> float | None:
        """The bar of step, nodes and place, as in ../uncertainty; None where one of them is not known."""
        told = [one.estimate for one in self.sources]
        known = [one for one in told if one is not None and np.isfinite(one.doubt)]
        if not told or len(known) < len(told):
            return None
        error, doubt = combined(known)
        return abs(error) + doubt


def quantity(values: np.ndarray, unit: str) -> Quantity:
    """Return the mean of one value a period."""
    error = float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else None
    return Quantity(float(np.mean(values)), error, unit)


def quantities(run: RunFile, window: Window, first: RunFile | None = None) -> dict[str, Quantity]:
    """All rows of a run; with distances from the run ``first`` where that is another."""
    found: dict[str, Quantity] = {}
    names = list(run.filaments)
    for name in names:
        prefix = f"{name}: " if len(names) > 1 else ""
        found |= {prefix + key: value for key, value in _of_filament(run, name, window).items()}
    found |= _powers(run, window)
    if first is not None:
        found |= _distances(run, first, window)
    return found


def _of_filament(run: RunFile, name: str, window: Window) -> dict[str, Quantity]:
    """Swimming, reactions and frequency of one filament."""
    units = run.case.units
    columns, s = run.filaments[name], run.arclength(name)
    position = np.asarray(columns["position"])
    centroid = np.einsum("n,tni->ti", trapezoid_weights(s) / (s[-1] - s[0]), position)
    at = [[time_series.at_time(run.time, centroid, t) for t in ends] for ends in window.each()]
    velocity = np.array([(after - before) / window.period for before, after in at])  # (count, 3)
    mean = velocity.mean(axis=0)
    speed = float(np.linalg.norm(mean))
    direction = mean / speed if speed > 0 else np.zeros(3)
    unit = label(units, "length/time")
    out = {"speed": quantity(velocity @ direction if speed > 0 else np.zeros(len(velocity)), unit)}
    for axis, letter in enumerate("xyz"):
        out[f"velocity {letter}"] = quantity(velocity[:, axis], unit)
    for end in ("start", "finish"):
        if f"reaction_{end}" in columns:
            reaction = _means(run.time, np.asarray(columns[f"reaction_{end}"]), window)
            for axis, letter in enumerate("xyz"):
                out[f"reaction at {end} {letter}"] = quantity(reaction[:, axis], label(units, "force"))
    held = any(f"reaction_{end}" in columns for end in ("start", "finish"))
    if not held and run.case.fluid.flow is None:
        out |= _efficiency(run, name, window, velocity, s[-1] - s[0])
    tip = position[:, -1] - (position[:, 0] if "reaction_start" in columns else centroid)
    rate = _frequency(run.time, tip, window)
    return out | ({} if rate is None else {"frequency (angular)": rate})


def _means(times: np.ndarray, values: np.ndarray, window: Window) -> np.ndarray:
    """The mean over each period, (count,) or (count, 3)."""
    return np.array([time_series.mean(times, values, start, end) for start, end in window.each()])


def _efficiency(run: RunFile, name: str, window: Window, velocity: np.ndarray, length: float) -> dict[str, Quantity]:
    """2 pi eta L U^2/P of each period, as the observable of that name."""
    columns = run.filaments[name]
    power = np.sum(np.asarray(columns["force"]) * np.asarray(columns["velocity"]), axis=(1, 2))
    spent = _means(run.time, power, window)
    if not np.all(spent > 0):
        return {}
    drawn = 2 * np.pi * run.case.fluid.viscosity * length * np.sum(velocity**2, axis=1)
    return {"Lighthill efficiency": quantity(drawn / spent, "1")}


def _frequency(times: np.ndarray, tip: np.ndarray, window: Window) -> Quantity | None:
    """Angular frequency of the tip seen along the two longest axes of its path; its error from the two halves."""
    t, path = time_series.cut(times, tip, window.start, window.end)
    if len(t) < 8 or np.ptp(path) == 0:
        return None
    away = path - path.mean(axis=0)
    _, axes = np.linalg.eigh(away.T @ away)
    flat = path @ axes[:, [2, 1]]
    # About its mean: the path of a tip that is bent to one side as it turns is no circle about the axis.
    rate = abs(time_series.angular_rate(t, flat - flat.mean(axis=0)).value)
    if not np.isfinite(rate):
        return None
    half = len(t) // 2
    halves = (slice(half), slice(half, None))
    parts = [abs(time_series.angular_rate(t[cut], flat[cut] - flat[cut].mean(axis=0)).value) for cut in halves]
    error = 0.5 * abs(parts[1] - parts[0]) if np.all(np.isfinite(parts)) else None
    return Quantity(float(rate), error, "rad/time")


def _powers(run: RunFile, window: Window) -> dict[str, Quantity]:
    """The dissipated power from both sides, and what is lost on the way there: by slip, and by a rod's own spin drag.

    A fluid with inertia is set in motion by what it does not dissipate.
    """
    unit = label(run.case.units, "force length/time")
    read: Callable[[str], np.ndarray] = lambda name: np.asarray(run.diagnostics[name])  # noqa: E731
    out = {"power of the nodes": quantity(_means(run.time, read("power"), window), unit)}
    if "dissipation" in run.diagnostics:
        out["dissipated by the fluid"] = quantity(_means(run.time, read("dissipation"), window), unit)
    if "grid_power" in run.diagnostics:
        grid, slip = (_means(run.time, read(name), window) for name in ("grid_power", "slip_power"))
        out["power upon the grid"] = quantity(grid, unit)
        if run.case.fluid.inertial:
            moving = _means(run.time, read("grid_power") - read("dissipation"), window)
            out["of that into the fluid's motion"] = quantity(moving, unit)
        elif run.case.fluid.sides is not None:  # in free space they are one number
            inside = (run.time >= window.start * (1 - 1e-9)) & (read("grid_power") != 0)
            ratio = read("dissipation")[inside] / read("grid_power")[inside] - 1
            if len(ratio):
                out["both sides differ by, at most"] = Quantity(float(np.max(np.abs(ratio))), None, "1")
        out["lost between nodes and grid, a share"] = quantity(slip / (grid + slip), "1")
    return out


def _distances(run: RunFile, first: RunFile, window: Window) -> dict[str, Quantity]:
    """How far its filaments are from those of the first run, in lengths, mean square over a period."""
    times = run.time[common_outputs(run, first)[0]]
    apart = rms(run, first)
    shape, turn = rms_of_shape(run, first)
    out = {}
    for name, series, unit in (
        ("distance from the first, rms/L", apart, "1"),
        ("the same without rigid motion", shape, "1"),
        ("turned from the first", turn, "rad"),
    ):
        inside = [series[(times >= a * (1 - 1e-9)) & (times <= b * (1 + 1e-9))] for a, b in window.each()]
        if all(len(part) for part in inside):
            out[name] = quantity(np.array([np.sqrt(np.mean(part**2)) for part in inside]), unit)
    return out
