"""Sec. 7.1, Fig. 3: the swimmer by finite volumes, and by finite differences, which push it where nothing pushes."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

import numpy as np

from ibfil.studies.member import Member

from . import finite_difference
from .drawing import COLOURS, axes_labels, new_figure, stroboscopic
from .old_schemes import Swimmer
from .results import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .results import Runs

PERIOD = 2 * np.pi / 10
GRAY_HANCOCK = 0.11475  # amplitude 8/k^2, drag ratio 2
# viscosity, step and end of the finite-difference runs
DIFFERENCES = {"1": (1.0, 1e-4, 4.0), "1e-3": (1e-3, 1e-5, 1.0)}
DIFFERENCES_QUICK = {"1": (1.0, 1e-4, 1.0), "1e-3": (1e-3, 1e-5, 0.2)}


def members(quick: bool) -> list[Member]:
    """The paper's 128 nodes over t = 4, at both viscosities."""
    own = ("filament.swimmer.nodes=128", "time.end=4", f"output.every={PERIOD / 40:.15g}")
    coarse = ("filament.swimmer.nodes=64", f"time.step={PERIOD / 120:.15g}")
    return [
        Member(f"fig3-eta={eta}", "swimmer_rft", (*own, *(coarse if quick else ()), f"fluid.viscosity={eta}"))
        for eta in ("1", "1e-3")
    ]


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """Stroboscopic shapes and the way of the centroid, as in Fig. 3, for both schemes."""
    rows = [row for eta in ("1", "1e-3") for row in _rows(runs, eta)]
    figure = new_figure(11, 6.4, "The swimmer by finite differences and by finite volumes (Sec. 7.1, Fig. 3)")
    panels = figure.subplots(2, 3, width_ratios=[1.2, 1.2, 1])
    for k, (eta, (viscosity, step, end)) in enumerate((DIFFERENCES_QUICK if quick else DIFFERENCES).items()):
        times, shapes, seconds = _differences(runs, eta, viscosity, step, end)
        stroboscopic(panels[0, k], shapes[:, :, :2], 14)
        axes_labels(panels[0, k], "x/L", "y/L", f"finite differences, η = {eta}, to t = {times[-1]:.2g}")
        panels[0, 2].plot(times, shapes[:, :, 0].mean(axis=1), color=COLOURS[k], label=f"finite differences, η = {eta}")
        rows += _difference_rows(eta, times, shapes, seconds)
        run = runs[f"fig3-eta={eta}"]
        stroboscopic(panels[1, k], run.position()[:, :, :2], 14)
        axes_labels(panels[1, k], "x/L", "y/L", f"finite volumes, η = {eta}, to t = 4")
        style = {"color": COLOURS[k], "ls": "-" if k == 0 else "--"}
        panels[1, 2].plot(run.time, _centroid(run)[:, 0], label=f"finite volumes, η = {eta}", **style)
        if k == 0:
            panels[1, 2].plot(times, shapes[:, :, 0].mean(axis=1), color=COLOURS[3], label="finite differences, η = 1")
    for axes in panels[:, 2]:
        axes.axhline(0, color="0.8", lw=0.8)
        axes.legend()
        axes_labels(axes, "t", "x of the centroid (L)", "the wave runs to +x: it must swim to -x")
    return figure, rows


def _centroid(run) -> np.ndarray:
    """Mean position along the swimmer (T, 3)."""
    return _mean(run.position())


def _mean(r: np.ndarray) -> np.ndarray:
    return (0.5 * (r[:, 1:] + r[:, :-1])).mean(axis=1)


def _angle(r: np.ndarray) -> np.ndarray:
    """Angle of the line from end to end with x (T,), degrees."""
    chord = r[:, -1] - r[:, 0]
    return np.degrees(np.unwrap(np.arctan2(chord[:, 1], chord[:, 0])))


def _rows(runs: Runs, eta: str) -> list[Row]:
    run = runs[f"fig3-eta={eta}"]
    ends = np.searchsorted(run.time, [PERIOD - 1e-9, 3 * PERIOD - 1e-9])
    moved = (_centroid(run)[ends[1]] - _centroid(run)[ends[0]]) / (2 * PERIOD)
    angle = _angle(run.position())
    turned = float(angle[ends[1]] - angle[ends[0]]) / 2
    known = 0.1035 if eta == "1" else 0.1034
    seconds = run.wall_time
    return [
        Row(
            "7.1",
            f"speed along -x, eta = {eta}",
            0.106,
            known,
            float(-moved[0]),
            seconds,
            0.005,
            note="Gray-Hancock: 0.1147",
        ),
        Row("7.1", f"drift along y, eta = {eta}", "", -0.0047, float(moved[1]), seconds, 0.05),
        Row("7.1", f"turning, degrees a period, eta = {eta}", "none", None, f"{turned:.4f}", seconds),
        Row("7.1", f"largest angle it rocks by, degrees, eta = {eta}", "", None, float(angle.max()), seconds),
    ]


def _differences(
    runs: Runs, eta: str, viscosity: float, step: float, end: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """The finite-difference run, from the folder of runs if it is there; times, shapes, wall time."""
    path = runs.folder / f"fig3-finite-differences-eta={eta}.npz"
    if not path.exists():
        began = monotonic()
        times, shapes = finite_difference.swim(Swimmer(viscosity=viscosity), step, end, end / 100)
        np.savez(path, times=times, shapes=shapes, seconds=monotonic() - began)
    with np.load(path) as known:
        return known["times"], known["shapes"], float(known["seconds"])


def _difference_rows(eta: str, times: np.ndarray, shapes: np.ndarray, seconds: float) -> list[Row]:
    way = _mean(shapes)[:, 0]
    turned = _angle(shapes)
    speed = float(way[-1] / times[-1])
    return [
        Row(
            "7.1",
            f"finite differences, mean speed along +x, eta = {eta}",
            "> 0",
            None,
            speed,
            seconds,
            note="right: -0.1035",
        ),
        Row(
            "7.1",
            f"finite differences, largest turn in degrees, eta = {eta}",
            "turns",
            None,
            float(np.abs(turned).max()),
            seconds,
        ),
    ]
