"""The panels of Fig. 7."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .buckled import first_below
from .drawing import COLOURS, TIME, axes_labels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D

    from .results import Runs

MISSING = "data points of refs. 41 and 43 are not at hand and not drawn"


def montage(axes: Axes, runs: Runs) -> None:
    """a: one filament over time, the shortest marked."""
    names = [n for n in runs.named("fig7-plane-") if runs[n].case.parameters["Lambda"] > 2]
    run = runs[min(names, key=lambda n: np.asarray(runs[n].observables["shortest"]).min())]
    gamma, tips = run.case.parameters["gamma"], np.asarray(run.observables["shortest"])
    shortest = int(np.argmin(tips))
    outputs = np.unique(np.linspace(0, min(len(run) - 1, int(1.6 * shortest) + 1), 9).round().astype(int))
    for k, i in enumerate(outputs):
        r = run.position()[i]
        axes.plot(r[:, 0], r[:, 1] - 1.0 * k, color=TIME(0.9 * k / (len(outputs) - 1)))
        axes.text(2.2, -1.0 * k, f"γt = {gamma * run.time[i]:.2f}", va="center", fontsize=7.5)
    near = int(np.argmin(np.abs(outputs - shortest)))
    axes.text(-2.45, -1.0 * near, "*", fontsize=16, va="center")
    axes.set_aspect("equal")
    axes.set_yticks([])
    axes.set_xlim(-2.7, 3.6)
    axes_labels(
        axes, "x (µm)", "", f"a  in the plane, Λ = {run.case.parameters['Lambda']:.2g}; *: the ends are closest"
    )


def planar(axes: Axes, found: list[tuple[float, float, int]], thresholds: list[float]) -> None:
    """b: shortest tip-to-tip distance against Lambda, by bending mode."""
    for k, Lambda in enumerate(thresholds):
        axes.axvline(Lambda, color="0.75", lw=0.8)
        axes.text(Lambda * 1.03, 1.06, f"mode {k + 1}: {Lambda:.3g}", fontsize=7.5, color="0.35")
    for mode, marker in ((0, "x"), (1, "o"), (2, "s"), (3, "D"), (4, "^")):
        some = np.array([(x, y) for x, y, which in found if which == mode])
        if len(some):
            name = {0: "stays above 0.9 L", 1: "1 (C)", 2: "2 (S)", 3: "3 (W)", 4: "4"}[mode]
            axes.plot(*some.T, marker, color=COLOURS[mode - 1] if mode else "0.6", ms=4.5, mfc="none", label=name)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.12)
    axes.legend(title="bending mode at 0.9 L", title_fontsize=7.5, loc="lower left")
    axes.text(0.98, 0.02, MISSING, transform=axes.transAxes, ha="right", fontsize=7, style="italic")
    axes_labels(axes, "Λ (Eq. 58)", "shortest tip-to-tip distance δ/L", "b  lines: where modes begin to grow")


def coils(axes: Axes3D, runs: Runs) -> None:
    """c: one filament in space over time."""
    names = runs.named("fig7-space-round-eta=0.2") or runs.named("fig7-space-round-eta")
    run = runs[names[0]]
    length, gamma = run.case.parameters["L"], run.case.parameters["gamma"]
    tips = np.asarray(run.observables["tip_to_tip"]) / length
    for k, level in enumerate((0.97, 0.8, 0.6, 0.4)):
        i = first_below(tips, level)
        r = run.position()[i] - run.position()[i].mean(axis=0)
        axes.plot(r[:, 0], r[:, 1], r[:, 2] - 0.9 * k, color=COLOURS[k], label=f"γt = {gamma * run.time[i]:.2f}")
    axes.set_box_aspect((2, 1, 2))
    axes.set_zticks([])
    axes.set_xlabel("x (µm)")
    axes.set_ylabel("y (µm)")
    axes.legend(loc="upper left")
    axes.set_title(f"c  in space, round, µ = {run.case.parameters['mu_bar']:.2g}; shifted down with time", loc="left")


def space(axes: Axes, points: dict, slopes: dict, words: dict) -> None:
    """d: effective radius of the coil against mu-bar, the ribbons by either modulus."""
    for k, (family, found) in enumerate(points.items()):
        if not len(found):
            continue
        slope, error = slopes[family]
        label = f"{words[family]}: slope {slope:.2f} ± {error:.2f}"
        axes.plot(found[:, 0], found[:, 1], "osD^"[k], color=COLOURS[k], ms=4, mfc="none", label=label)
        if family.startswith("ribbon"):
            axes.plot(20 * found[:, 0], found[:, 1], "osD^"[k], color=COLOURS[k], ms=2, alpha=0.6)
    x = np.array([6e2, 2e5])
    axes.plot(x, 0.03 * (x / 1e4) ** -0.25, "-", color="0.5", lw=0.9, label="slope -1/4")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.legend(title="small symbols: ribbons by A2 = A1/20", title_fontsize=7.5)
    axes.text(0.98, 0.02, MISSING, transform=axes.transAxes, ha="right", fontsize=7, style="italic")
    axes_labels(axes, "µ (Eq. 59, by A1)", "R_eff/L when the ends are 0.8 L apart", "d")
