"""Sec. 7.7, Fig. 9: a clamped rod under a compressive follower force flails in its plane, or rotates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.observables import time_series
from ibfil.studies.member import Member

from .drawing import COLOURS, axes_labels, new_figure, stroboscopic
from .results import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .results import Runs

ONSET = (37.4, 37.6, 37.8, 38.0)
FORCES = (40.0, 43.6, 60.0, 80.0, 100.0, 120.0)
ZETA = 4 * np.pi  # zeta_perp at eta = 1
SOFT = "filament.rod.stretching=2e4"


def members(quick: bool) -> list[Member]:
    """The runs: onset, the two planar states, the scan with a twist, and a slow rise from the rotating state."""
    forces = (40.0, 60.0, 100.0) if quick else FORCES
    end = 12 if quick else 30
    found = [Member(f"fig9-onset-{f:g}", "flailing", (f"parameters.F0={f:g}",)) for f in ONSET]
    small = ("parameters.F0=38", SOFT, "filament.rod.nodes=128", "time.end=60", "time.step=5e-3")
    found.append(Member("fig9-planar-38", "flailing", (*small, "filament.rod.nodes=65") if quick else small))
    large = ("parameters.F0=200", SOFT, "filament.rod.nodes=128", "time.step=1e-4", "output.every=2e-3")
    ends = ("time.end=0.6",) if quick else ("time.end=2",)
    found.append(Member("fig9-planar-200", "flailing", (*large, *ends)))
    window = (f"time.end={end}", *(f"observe.{name}.over=[{end - 5},{end}]" for name in ("planarity", "frequency")))
    for f in forces:
        found.append(Member(f"fig9-twist-{f:g}", "flailing_with_twist", (f"parameters.F0={f:g}", *window)))
    if not quick:
        ramp = ("filament.rod.finish.follower=-where(t < 6, 60, 60 + 2*(t - 6))", "parameters.F0=60", "time.end=36")
        found.append(Member("fig9-ramp", "flailing_with_twist", ramp))
    return found


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The figure, and the threshold, frequency, states and branches."""
    rows = _onset(runs) + _states(runs) + _branches(runs)
    figure = new_figure(11, 8.2, "Flailing under a follower force (Sec. 7.7, Fig. 9)")
    grid = figure.add_gridspec(2, 6, height_ratios=[1, 1])
    for at, name, title in (
        (grid[0, :2], "fig9-planar-38", "F0 = 38, planar"),
        (grid[0, 2:4], "fig9-planar-200", "200"),
    ):
        run = runs[name]
        period = 2 * np.pi / _rate(run)
        axes = figure.add_subplot(at)
        shapes = run.position()[run.time > run.time[-1] - period]
        stroboscopic(axes, shapes[:, :, [0, 2]], 12)
        axes_labels(
            axes, "x/L", "z/L", f"{title}: one period" if "38" in title else f"F0 = {title}, planar: one period"
        )
    name = "fig9-twist-43.6" if "fig9-twist-43.6" in set(runs) else "fig9-twist-60"
    run = runs[name]
    late = run.position()[run.time > run.time[-1] - 2 * np.pi / _rate(run)]
    force = run.case.parameters["F0"]
    side, end_on = figure.add_subplot(grid[1, :2]), figure.add_subplot(grid[1, 2:4])
    stroboscopic(side, late[:, :, [0, 2]], 12)
    axes_labels(side, "x/L", "z/L", f"F0 = {force:g} with a twist: from the side")
    tip = run.position()[:, -1]
    end_on.plot(tip[:, 1], tip[:, 2], color="0.75", lw=0.6, zorder=0)
    stroboscopic(end_on, late[:, :, [1, 2]], 12)
    axes_labels(end_on, "y/L", "z/L", "the same, end on (grey: the tip's path)")
    _draw_onset(figure.add_subplot(grid[0, 4:]), runs)
    _draw_branches(figure.add_subplot(grid[1, 4:]), runs)
    return figure, rows


def _growth(run) -> tuple[float, float]:
    """Rate of growth and frequency of the tip's oscillation in the linear phase, in A/(zeta_perp L^4)."""
    times, z = run.time, run.position()[:, -1, 2]
    inside = (times >= 2) & (times <= 8)
    seen = np.column_stack([z[inside], np.zeros(inside.sum())])
    growth = time_series.growth(times[inside], np.abs(z[inside])).value
    return growth * ZETA, time_series.angular_rate(times[inside], seen).value * ZETA


def _onset(runs: Runs) -> list[Row]:
    forces, rates, frequencies = _onset_points(runs)
    threshold = _zero(forces, rates)
    frequency = float(np.polyval(np.polyfit(forces, frequencies, 1), threshold))
    seconds = runs.seconds("fig9-onset")
    return [
        Row("7.7", "flutter threshold F0 L^2/A", 37.5, 37.6954, threshold, seconds, 0.005, note="EA = 2e5 A/L^2"),
        Row("7.7", "flutter frequency, A/(zeta_perp L^4)", "", 191.26, frequency, seconds, 0.01),
    ]


def _onset_points(runs: Runs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    names = runs.named("fig9-onset-")
    points = [(runs[name].case.parameters["F0"], *_growth(runs[name])) for name in names]
    forces, rates, frequencies = np.array(sorted(points)).T
    return forces, rates, frequencies


def _zero(x: np.ndarray, y: np.ndarray) -> float:
    """Where the straight line of least squares is zero."""
    slope, level = np.polyfit(x, y, 1)
    return float(-level / slope)


def _rate(run) -> float:
    """Frequency of the tip in the last quarter of the run."""
    times, tip = run.time, run.position()[:, -1, 1:]
    late = times > 0.75 * times[-1]
    return abs(time_series.angular_rate(times[late], tip[late]).value)


def _states(runs: Runs) -> list[Row]:
    rows = []
    for force, theory in ((38, None), (200, 0.58)):
        run = runs[f"fig9-planar-{force}"]
        late = run.time > run.time[-1] - 2 * 2 * np.pi / _rate(run)
        amplitude = float(np.abs(run.position()[late, -1, 2]).max())
        d = np.linalg.norm(np.diff(run.position()[late], axis=1), axis=2) * (run.case.filaments["rod"].nodes - 1)
        seconds = run.wall_time
        rows.append(
            Row("7.7", f"amplitude of flailing at F0 = {force}, L", "", theory, amplitude, seconds, theory and 0.02)
        )
        compressed = float(1 - d.min())
        bar = (0.0097, 0.05) if force == 200 else (None, None)
        rows.append(
            Row("7.7", f"largest compression at F0 = {force}", "within 0.01", bar[0], compressed, seconds, bar[1])
        )
    return rows


def _branches(runs: Runs) -> list[Row]:
    rows = []
    for name in sorted(runs.named("fig9-twist-"), key=lambda name: float(name.rsplit("-", 1)[1])):
        run = runs[name]
        value, force = _planarity(run), run.case.parameters["F0"]
        state = "rotates" if value > 0.5 else "planar" if value < 0.05 else "neither yet"
        message = "rotation possible" if 40 <= force <= 100 else ""
        rows.append(Row("7.7", f"with a small twist at F0 = {force:g}", message, None, state, run.wall_time))
    if "fig9-ramp" in set(runs):
        force, width = _ramp(runs["fig9-ramp"])
        lost = next((f"{f:.0f}" for f, w in zip(force, width, strict=True) if f > 61 and w < 0.5), "above 120")
        message = Row("7.7", "rotation is left, F0 slowly raised, at", "100", None, lost, runs["fig9-ramp"].wall_time)
        rows.append(message)
    return rows


def _planarity(run) -> float:
    """Smaller over larger variance of the tip across x in the last sixth: 0 in a plane, 1 on a circle."""
    late = run.time > run.time[-1] * 5 / 6
    return time_series.circularity(run.time[late], run.position()[late, -1, 1:])


def _ramp(run) -> tuple[np.ndarray, np.ndarray]:
    """F0 and circularity of the tip's path, window after window of one unit."""
    starts = np.arange(5.0, run.time[-1] - 1e-9, 1.0)
    tips = run.position()[:, -1, 1:]
    width = []
    for start in starts:
        inside = (run.time >= start) & (run.time < start + 1)
        width.append(time_series.circularity(run.time[inside], tips[inside]))
    return np.where(starts < 6, 60.0, 60.0 + 2 * (starts + 0.5 - 6)), np.array(width)


def _draw_onset(axes, runs: Runs) -> None:
    forces, rates, _ = _onset_points(runs)
    axes.axhline(0, color="0.7", lw=0.8)
    axes.plot(forces, rates, "o-", color=COLOURS[0], label="fitted, EA = 2e5")
    axes.plot([37.5, 37.6954, 38], [-1.434, 0, 2.241], "x", color=COLOURS[1], label="linear stability")
    axes.legend()
    axes_labels(axes, "F0 (A/L²)", "growth (A/(ζ⊥L⁴))", f"onset: zero at {_zero(forces, rates):.3f}")


def _draw_branches(axes, runs: Runs) -> None:
    points = [(runs[n].case.parameters["F0"], _planarity(runs[n])) for n in runs.named("fig9-twist-")]
    axes.plot(*np.array(sorted(points)).T, "o", color=COLOURS[0], label="from a small twist")
    if "fig9-ramp" in set(runs):
        axes.plot(*_ramp(runs["fig9-ramp"]), ".-", color=COLOURS[1], lw=0.8, ms=4, label="F0 raised from rotation")
    axes.legend()
    axes_labels(axes, "F0 (A/L²)", "circularity of the tip's path", "1 rotates, 0 flails in a plane")
