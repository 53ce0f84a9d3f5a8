"""Sec. 7.6, Fig. 8: a rod spun at its clamped end twirls straight, or whirls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.observables import time_series
from ibfil.studies.member import Member

from .drawing import COLOURS, axes_labels, new_figure, stroboscopic
from .results import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ibfil.io.reader import RunFile

    from .results import Runs

ZETA = 4 * np.pi  # zeta_perp at eta = 1
# A2/A1, a/L: threshold in A+/(zeta_r L^2) and Hopf frequency in A+/(zeta_perp L^4), by linear stability
THEORY = {
    (1.0, 0.1): (8.8651, 22.846),
    (0.5, 0.1): (8.941, 23.67),
    (0.05, 0.1): (9.203, 23.10),
    (0.05, 0.05): (8.936, None),
    (0.05, 0.02): (8.875, None),
}
SPINS = (0.985, 0.995, 1.005, 1.015)  # about the rounded values below, which the paper's 8.9 and THEORY suggest
ABOUT = {(1.0, 0.1): 8.9, (0.5, 0.1): 8.9, (0.05, 0.1): 9.2, (0.05, 0.05): 8.9, (0.05, 0.02): 8.9}
CLAMP = "/(4*pi*eta*a**2)"
UP, DOWN = "8.6 + 0.005*t", "where(t < 60, 10, 9.4 - 0.005*max(t - 80, 0))"
RIBBON_UP, RIBBON_DOWN = "9 + 0.02*t", "10.5 - 0.025*max(t - 60, 0)"


def members(quick: bool) -> list[Member]:
    """The runs: spins about each threshold, the two large states, sweeps up and down."""
    found = [
        Member(_name(*rod, share), *_onset_run(*rod, share, quick))
        for rod in THEORY
        if not quick or rod[1] == 0.1
        for share in (SPINS if rod[1] == 0.1 and not quick else SPINS[::3])
    ]
    if quick:
        coarse = (
            "parameters.ratio=12",
            "time.end=30",
            "filament.rod.nodes=49",
            "stop.0.after=15",
            "stop.0.steady.over=5",
        )
        found.append(Member("fig8-large-round", "whirling", coarse))
        found.append(Member("fig8-large-ribbon", "whirling_ribbon", ("time.end=150", "parameters.ratio=10.5")))
        return found
    found.append(Member("fig8-large-round", "whirling"))
    found.append(Member("fig8-large-ribbon", "whirling_ribbon", ("time.end=600",)))
    steady = ("stop.0.after=1e6", "filament.rod.nodes=49")
    for name, spin, end in (("up", UP, 200), ("down", DOWN, 320)):
        driven = f"filament.rod.start.spin=({spin}){CLAMP}"
        found.append(
            Member(f"fig8-sweep-round-{name}", "whirling", (driven, f"time.end={end}", "time.step=0.01", *steady))
        )
    for name, spin, end in (("up", RIBBON_UP, 75), ("down", RIBBON_DOWN, 160)):
        driven = f"filament.rod.start.spin=({spin})*(1 + A2)/2{CLAMP}"
        found.append(Member(f"fig8-sweep-ribbon-{name}", "whirling_ribbon", (driven, f"time.end={end}", *steady)))
    return found


def _name(ratio: float, radius: float, share: float) -> str:
    return f"fig8-onset-A2={ratio:g}-a={radius:g}-{share:g}"


def _onset_run(ratio: float, radius: float, share: float, quick: bool) -> tuple[str, tuple[str, ...]]:
    """Case and overrides of a run near a threshold, long enough for the fit of its growth."""
    spin = f"parameters.ratio={share * ABOUT[ratio, radius]:.6g}"
    end = "time.end=30" if quick else "time.end=40"
    if ratio == 1.0:
        return "whirling", (spin, end)
    step = 0.75 * radius**2 if radius < 0.1 else 0.004 if quick else 0.002  # omega dt 0.28, and 0.08
    nodes = 65 if radius == 0.1 else 49
    ribbon = (
        f"parameters.A2={ratio:g}",
        f"parameters.a={radius:g}",
        f"time.step={step:g}",
        f"filament.rod.nodes={nodes}",
    )
    return "whirling_ribbon", (spin, end, *ribbon, "output.every=0.02", "stop.0.after=1e6")


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The figure, and thresholds, frequencies and states."""
    rows = _onsets(runs) + _states(runs)
    figure = new_figure(11, 8.2, "Twirling to whirling (Sec. 7.6, Fig. 8)")
    grid = figure.add_gridspec(2, 3)
    for k, (name, title) in enumerate((("round", "round rod"), ("ribbon", "ribbon, A2 = A1/20"))):
        run = runs[f"fig8-large-{name}"]
        shapes = run.position()[run.time > run.time[-1] - 2 * np.pi / abs(_rate(run))]
        spin = f"{title}, ω = {_spin(run):.3g} A+/(ζr L²)"
        for j, (plane, labels) in enumerate((((0, 2), "xz"), ((1, 2), "yz"))):
            axes = figure.add_subplot(grid[k, j])
            stroboscopic(axes, shapes[:, :, list(plane)], 12)
            axes.plot(0, 0, "s", color="#D55E00", ms=5)
            axes_labels(axes, f"{labels[0]}/L", f"{labels[1]}/L", spin if j == 0 else "end on; square: the clamp")
    _draw_onsets(figure.add_subplot(grid[0, 2]), runs)
    _draw_sweeps(figure.add_subplot(grid[1, 2]), runs)
    return figure, rows


def _spin(run: RunFile) -> float:
    """The spin, in A+/(zeta_r L^2)."""
    return float(run.case.parameters["ratio"])


def _amplitude(run: RunFile) -> np.ndarray:
    """Distance of the tip from the clamp's axis (T,)."""
    return np.linalg.norm(run.position()[:, -1, 1:], axis=1)


def _fit(run: RunFile) -> tuple[float, float]:
    """Growth and frequency in the linear phase, both in A/(zeta_perp L^4)."""
    inside = run.time >= 10
    tip = run.position()[inside, -1, 1:]
    times = run.time[inside]
    rate, turning = time_series.growth(times, _amplitude(run)[inside]), time_series.angular_rate(times, tip)
    return rate.value * ZETA, abs(turning.value) * ZETA


def _rate(run: RunFile) -> float:
    late = run.time > 0.8 * run.time[-1]
    return time_series.angular_rate(run.time[late], run.position()[late, -1, 1:]).value


def _onset_points(runs: Runs, ratio: float, radius: float) -> np.ndarray:
    """Spin, growth, frequency (k, 3), in units of A+."""
    average = (1 + ratio) / 2
    names = [_name(ratio, radius, share) for share in SPINS]
    points = []
    for name in names:
        if name in set(runs):
            growth, frequency = _fit(runs[name])
            points.append((_spin(runs[name]), growth / average, frequency / average))
    return np.array(points)


def _zero(points: np.ndarray) -> tuple[float, float]:
    """Spin of no growth, by a straight line, and the frequency there."""
    slope, level = np.polyfit(points[:, 0], points[:, 1], 1)
    threshold = -level / slope
    return float(threshold), float(np.polyval(np.polyfit(points[:, 0], points[:, 2], 1), threshold))


def _onsets(runs: Runs) -> list[Row]:
    rows = []
    for (ratio, radius), (threshold, frequency) in THEORY.items():
        points = _onset_points(runs, ratio, radius)
        if not len(points):
            continue
        zero, rate = _zero(points)
        seconds = runs.seconds(f"fig8-onset-A2={ratio:g}-a={radius:g}-")
        what = f"A2/A1 = {ratio:g}, a = {radius:g} L"
        note = "" if radius == 0.1 else "towards the paper's rule for thin rods"
        title = f"whirling threshold, A+/(zeta_r L^2), {what}"
        rows.append(Row("7.6", title, 8.9, threshold, zero, seconds, 0.005, note=note))
        if frequency is not None:
            rows.append(Row("7.6", f"Hopf frequency, A+/(zeta_perp L^4), {what}", "", frequency, rate, seconds, 0.01))
    return rows


def _states(runs: Runs) -> list[Row]:
    rows = []
    for name, message in (("round", "large, past the clamp"), ("ribbon", "finite")):
        run = runs[f"fig8-large-{name}"]
        tip, amplitude = run.position()[-1, -1], _amplitude(run)
        late, before = (_last(run, amplitude, k) for k in (0, 1))
        swing = 0.5 * np.ptp(late) / late.mean()
        steady = f"mean over 5 units changes by {abs(late.mean() / before.mean() - 1):.1e}, swings by {swing:.1%}"
        state = f"{late.mean():.4f}"
        where = f"tip's distance from the axis, {name}, spin {_spin(run):.3g}"
        behind = f"{steady} at t = {run.time[-1]:.4g}; the free end is at x = {tip[0]:.3f} L"
        rows.append(Row("7.6", where, message, None, state, run.wall_time, note=behind))
    for name, words in (("up", "jump to the large whirl, spin slowly raised"), ("down", "fall from it, lowered")):
        whole = f"fig8-sweep-round-{name}"
        if whole in set(runs):
            spin, amplitude = _sweep(runs[whole], name)
            where = amplitude > 0.2 if name == "up" else amplitude < 0.2
            jump = float(spin[np.argmax(where)]) if where.any() else float("nan")
            note = "later than the threshold: it has to grow first" if name == "up" else "hysteresis"
            rows.append(Row("7.6", f"{words}, A/(zeta_r L^2)", "", None, jump, runs[whole].wall_time, note=note))
    if "fig8-sweep-ribbon-down" in set(runs):
        run = runs["fig8-sweep-ribbon-down"]
        spin, amplitude = _sweep(run, "down", ribbon=True)
        held = float(amplitude[np.abs(spin - 9.0) < 0.02].mean())
        title, note = "tip's distance from the axis, ribbon, spin lowered to 9", "below its threshold, 9.203"
        rows.append(Row("7.6", title, "small", None, held, run.wall_time, note=note))
        fallen = float(spin[np.argmax(amplitude < 0.5 * held)]) if (amplitude < 0.5 * held).any() else float("nan")
        title = "half of that is left, ribbon, lowered on, A+/(zeta_r L^2)"
        rows.append(Row("7.6", title, "", None, fallen, run.wall_time, note="its finite state has hysteresis as well"))
    return rows


def _last(run: RunFile, values: np.ndarray, k: int) -> np.ndarray:
    """The values of the last five units of time, or (k = 1) of the five before them."""
    end = run.time[-1] - 5 * k
    return values[(run.time > end - 5) & (run.time <= end)]


def _sweep(run: RunFile, name: str, ribbon: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Spin (in A+/(zeta_r L^2)) and amplitude of a sweep, its start left out."""
    t, amplitude = run.time, _amplitude(run)
    if ribbon:
        spin, start = (9 + 0.02 * t, 0.0) if name == "up" else (10.5 - 0.025 * np.maximum(t - 60, 0), 60.0)
    else:
        spin, start = (8.6 + 0.005 * t, 0.0) if name == "up" else (9.4 - 0.005 * np.maximum(t - 80, 0), 80.0)
    kept = t >= start
    return spin[kept], amplitude[kept]


def _draw_onsets(axes: Axes, runs: Runs) -> None:
    axes.axhline(0, color="0.7", lw=0.8)
    for k, (rod, (threshold, _)) in enumerate(THEORY.items()):
        points = _onset_points(runs, *rod)
        if len(points):
            label = f"A2/A1 = {rod[0]:g}, a = {rod[1]:g} L: {_zero(points)[0]:.3f}"
            axes.plot(points[:, 0], points[:, 1], "o-", color=COLOURS[k], label=label)
            axes.plot(threshold, 0, "x", color=COLOURS[k], ms=8, mew=2)
    axes.set_ylim(bottom=-1.3)
    axes.legend(title="zero of the growth (crosses: theory)", title_fontsize=7.5, loc="lower right")
    axes_labels(axes, "ω (A+/(ζr L²))", "growth (A+/(ζ⊥L⁴))", "onset")


def _draw_sweeps(axes: Axes, runs: Runs) -> None:
    shown = False
    for k, rod in enumerate(("round", "ribbon")):
        for name, style in (("up", "-"), ("down", "--")):
            whole = f"fig8-sweep-{rod}-{name}"
            if whole in set(runs):
                shown = True
                axes.plot(*_sweep(runs[whole], name, rod == "ribbon"), style, color=COLOURS[k], label=f"{rod}, {name}")
    if shown:
        axes.legend()
    else:
        for k, rod in enumerate(("round", "ribbon")):
            run = runs[f"fig8-large-{rod}"]
            axes.plot(_spin(run), _amplitude(run)[-1], "o", color=COLOURS[k], label=rod)
        axes.legend(title="sweeps: in the full form", title_fontsize=7.5)
    axes_labels(axes, "ω (A+/(ζr L²))", "tip's distance from the axis (L)", "spin slowly raised and lowered")
