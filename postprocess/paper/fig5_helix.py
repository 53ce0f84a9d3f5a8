"""Sec. 7.3, Fig. 5: a clamped helix is drawn out by an axial flow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.studies.member import Member

from .drawing import COLOURS, TIME, axes_labels, new_figure
from .helix_statics import Helix
from .results import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .results import Runs

MODULI = {"2/3": 2 / 3, "5/6": 5 / 6, "1": 1.0}  # pN um^2
PAR = 0.2 * np.pi  # zeta_par, pN s/um^2
SCALE = PAR * 0.3**2 * 5.0**2  # the abscissa is this u/A, um


def members(quick: bool) -> list[Member]:
    """Eleven speeds (four) of three moduli, the helix at rest on its nodes, and a flow so slow that all is linear."""
    coarse = ("filament.helix.nodes=161", "time.step=0.2", "output.every=0.2") if quick else ()
    rest = ("parameters.u=0", "stop.0.below=1e-7", "time.end=60", *coarse)
    linear = ("time.step=0.5",) if quick else ()
    found = [Member("fig5-rest", "helix_extension", rest), Member("fig5-linear", "helix_in_flow", linear)]
    for u in (0.3, 0.9, 1.8):
        longer = (f"parameters.u={u:g}", "stop.0.below=1e-5", *coarse)
        found.append(Member(f"fig5-longer-u={u:g}", "helix_extension", longer))
    for name, modulus in MODULI.items():
        for u in _speeds(quick):
            own = (f"parameters.u={u:g}", f"parameters.A={modulus:.15g}", *coarse)
            found.append(Member(f"fig5-A={name.replace('/', 'over')}-u={u:g}", "helix_extension", own))
    return found


def _speeds(quick: bool) -> np.ndarray:
    return np.array([0.3, 0.75, 1.2, 1.8]) if quick else np.round(np.arange(0.3, 1.81, 0.15), 2)


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The figure, and the slope, the collapse, and the distance from the rod's equations at rest."""
    points = {name: _points(runs, f"fig5-A={name.replace('/', 'over')}-u=") for name in MODULI}
    theory_at = np.unique(np.concatenate([p[:, 0] for p in points.values()]).round(9))
    theory = np.array(Helix(5.0, 3.0, 1.0, 1.0, 1.0, 2 * PAR, PAR).extensions(list(theory_at / SCALE)))
    figure = new_figure(10, 4.6, "A helix drawn out by a flow (Sec. 7.3, Fig. 5)")
    shapes, curve = figure.subplots(1, 2, width_ratios=[0.8, 1])
    _draw_shapes(shapes, runs)
    _draw_curve(curve, points, theory_at, theory)
    return figure, _rows(runs, points, theory_at, theory)


def _points(runs: Runs, start: str) -> np.ndarray:
    """zeta_par u R^2 L^2/A and extension (k, 2): how far the tip is from where it is at rest on the same nodes."""
    rest = runs["fig5-rest"].position()[-1, -1, 0]
    found = []
    for member in runs.named(start):
        run = runs[member]
        given = run.case.parameters
        found.append((SCALE * given["u"] / given["A"], run.position()[-1, -1, 0] - rest))
    return np.array(sorted(found))


def _rows(runs: Runs, points: dict[str, np.ndarray], at: np.ndarray, theory: np.ndarray) -> list[Row]:
    run = runs["fig5-linear"]
    x = SCALE * run.case.parameters["u"] / run.case.parameters["A"]
    slope = run.position()[-1, -1, 0] - run.position()[np.searchsorted(run.time, run.case.parameters["on"]), -1, 0]
    rows = [Row("7.3", "slope of the extension, C = A", 1.0, 1.029, float(slope / x), run.wall_time, 0.01)]
    seconds = runs.seconds("fig5-A=")
    title, note = (
        "extension over that of the rod's equations at rest",
        "the worst; until the tip is slower than 1e-5 um/s",
    )
    value = _worst(_points(runs, "fig5-longer-"), at, theory)
    rows.append(Row("7.3", title, "", 1.0, value, runs.seconds("fig5-longer-"), 0.01, note=note))
    everything = np.concatenate(list(points.values()))
    note = f"the worst of {len(everything)}, which the paper's 0.01 um/s ends before they are at rest"
    rows.append(
        Row("7.3", "the same, ended as in the paper", "", 1.0, _worst(everything, at, theory), seconds, note=note)
    )
    first, *others = points.values()
    inside = [p[(p[:, 0] >= first[0, 0]) & (p[:, 0] <= first[-1, 0])] for p in others]
    apart = max(np.abs(p[:, 1] / _smooth(first, p[:, 0]) - 1).max() for p in inside)
    rows.append(
        Row("7.3", "three moduli on one curve: farthest apart", "one curve", None, f"{100 * apart:.2f} %", seconds)
    )
    speeds = [np.asarray(runs[name].observables["tip_speed"])[-1] for name in runs.named("fig5-A=")]
    rows.append(Row("7.3", "tip's speed at the end, um/s, at most", 0.01, None, f"{max(speeds):.4f}", seconds))
    return rows


def _worst(points: np.ndarray, at: np.ndarray, theory: np.ndarray) -> float:
    """Of the extensions over theory the one farthest from 1."""
    over = points[:, 1] / np.interp(points[:, 0], at, theory)
    return float(over[np.argmax(np.abs(over - 1))])


def _smooth(points: np.ndarray, x: np.ndarray) -> np.ndarray:
    from scipy.interpolate import CubicSpline

    return CubicSpline(*points.T)(x)


def _draw_shapes(axes: Axes, runs: Runs) -> None:
    names = runs.named("fig5-A=1-u=")
    names = ["fig5-rest", *sorted(names, key=lambda n: runs[n].case.parameters["u"])[:: max(1, len(names) // 5)]]
    for k, name in enumerate(names):
        r = runs[name].position()[-1]
        colour = TIME(0.9 * k / (len(names) - 1))
        axes.plot(r[:, 0], r[:, 2] - 0.8 * k, color=colour)
        axes.text(
            r[-1, 0] + 0.12, r[-1, 2] - 0.8 * k, f"u = {runs[name].case.parameters['u']:g}", va="center", fontsize=7.5
        )
    axes.set_aspect("equal")
    axes.set_yticks([])
    axes.set_xlim(right=4.3)
    axes_labels(axes, "x (µm)", "", "a  shapes at rest, A = 1 pN µm², u in µm/s; clamped at the left")


def _draw_curve(axes: Axes, points: dict[str, np.ndarray], at: np.ndarray, theory: np.ndarray) -> None:
    for k, (name, p) in enumerate(points.items()):
        axes.plot(*p.T, "osD"[k], color=COLOURS[k], mfc="none", label=f"ibfil, A = C = {name} pN µm²")
    axes.plot([0, *at], [0, *theory], "-", color="0.3", lw=0.9, label="the rod's equations at rest")
    x = np.array([0.0, 1.6])
    axes.plot(x, 1.029 * x, "--", color="0.5", lw=0.9, label="linear, 1.029 (Eq. 49: 1)")
    axes.legend()
    axes_labels(axes, "ζ∥ u R² L²/A (µm)", "extension δx (µm)", "b")
