"""Sec. 7.4, Fig. 6: how a free helix diffuses across its axis and along it, by pitch angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.studies.member import Member

from .drawing import COLOURS, axes_labels, new_figure
from .elastic_diffusion import diffusion_ratio
from .results import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .results import Runs

ANGLES = (20, 30, 45, 60, 75)
ELASTIC = {20: 1.161, 30: 1.002, 45: 0.779, 60: 0.620, 75: 0.529}  # independent code: N = 300, 1 ms
LAG = 1e-3


def members(quick: bool) -> list[Member]:
    """Ten seeds (three) of each angle, of the ring and of the straight rod."""
    found = []
    for name, case, filament, own in _rods(quick):
        coarse = (f"filament.{filament}.nodes=60", "time.step=2e-4") if quick and name != "helix-20" else ()
        for seed in range(1, 4 if quick else 11):
            found.append(Member(f"fig6-{name}-seed{seed}", case, (*own, *coarse, f"parameters.seed={seed}")))
    return found


def _rods(quick: bool) -> list[tuple[str, str, str, tuple[str, ...]]]:
    """Name, case, its filament and its own overrides."""
    angles = (30, 45, 75) if quick else ANGLES
    helices = [(f"helix-{angle}", "brownian_helix", "helix", (f"parameters.theta={angle}*pi/180",)) for angle in angles]
    return [("ring", "brownian_ring", "ring", ()), *helices, ("rod", "brownian_rod", "rod", ())]


def drag_ratio(theta: np.ndarray) -> np.ndarray:
    """Eq. 57: the ratio of drags of a helix that is held from turning."""
    sin2 = np.sin(theta) ** 2
    return (2 * (1 - sin2) + sin2) / (1 + sin2 + 0.5 * (1 - sin2))


def rigid_ratio(theta: np.ndarray) -> np.ndarray:
    """D_perp/D_par of a long rigid helix, which turns as it slides: 4/((1 + sin^2)(3 + sin^2))."""
    sin2 = np.sin(theta) ** 2
    return 4 / ((1 + sin2) * (3 + sin2))


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The figure, and a row for each angle."""
    figure = new_figure(7.5, 5.2, "Diffusion of a helix, across over along (Sec. 7.4, Fig. 6b)")
    axes = figure.add_subplot()
    rows, at, elastic = [], [], []
    for name, *_ in _rods(quick):
        angle = {"ring": 0.0, "rod": 90.0}.get(name) if name in ("ring", "rod") else float(name.split("-")[1])
        found = np.array([np.asarray(runs[run].observables["ratio"])[-1] for run in runs.named(f"fig6-{name}-")])
        one = runs[runs.named(f"fig6-{name}-")[0]]
        theory = 0.5 if name == "rod" else diffusion_ratio(one.case, LAG)
        at.append(angle)
        elastic.append(theory)
        _box(axes, angle, found)
        rows.append(_row(name, angle, found, theory, runs.seconds(f"fig6-{name}-")))
    _curves(axes, np.array(at), np.array(elastic), len(found))
    return figure, rows


def _row(name: str, angle: float, found: np.ndarray, theory: float, seconds: float) -> Row:
    error = float(found.std(ddof=1) / np.sqrt(len(found)))
    paper = {"ring": 4 / 3, "rod": 0.5}.get(name, float(drag_ratio(np.radians(angle))))
    quartiles = np.percentile(found, [25, 50, 75])
    note = f"quartiles {quartiles[0]:.3f}, {quartiles[1]:.3f}, {quartiles[2]:.3f}"
    if name == "ring":
        note += "; rigid 4/3: in 1 ms it does not yield to all kicks"
    elif name != "rod":
        note += f"; independent code at N = 300: {ELASTIC[round(angle)]}; Eq. 57 leaves out that it turns as it slides"
    return Row(
        "7.4",
        f"D_perp/D_par, {name}, mean of {len(found)}",
        paper,
        theory,
        float(found.mean()),
        seconds,
        error=error,
        note=note,
    )


def _box(axes: Axes, angle: float, found: np.ndarray) -> None:
    """The runs as dots, quartiles and median as bars."""
    axes.plot(np.full(len(found), angle), found, "o", color=COLOURS[0], alpha=0.4, ms=3.5, mew=0)
    for value, width in zip(np.percentile(found, [25, 50, 75]), (1.2, 2.2, 1.2), strict=True):
        axes.plot([angle - width, angle + width], [value, value], color=COLOURS[1], lw=1.5)


def _curves(axes: Axes, at: np.ndarray, elastic: np.ndarray, count: int) -> None:
    theta = np.linspace(0, np.pi / 2, 91)
    axes.plot(np.degrees(theta), drag_ratio(theta), "--", color="0.4", label="Eq. 57: held from turning")
    axes.plot(np.degrees(theta), rigid_ratio(theta), ":", color="0.4", label="rigid and long, free to turn")
    axes.plot(at, elastic, "D", color=COLOURS[2], mfc="none", ms=7, label="linearised elastic rod, 1 ms")
    axes.plot([], [], "o", color=COLOURS[0], alpha=0.5, ms=3.5, label=f"ibfil, {count} seeds")
    axes.plot([], [], color=COLOURS[1], label="quartiles and median")
    axes.legend()
    axes_labels(axes, "pitch angle θ (degrees; 0: a ring, 90: a straight rod)", "D⊥/D∥")
