"""Sec. 7.5, Fig. 7: actin filaments buckle at a stagnation point, in the plane of the flow and in space."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ibfil.observables import time_series
from ibfil.studies.member import Member

from . import fig7_panels as panels
from .buckled import bending_mode, first_below, fold
from .drawing import new_figure
from .results import Row
from .stagnation import threshold

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .results import Runs

ONSET = (130, 145, 160, 175)  # zeta_perp gamma L^4/A
LAMBDA = 4 * np.pi**4  # mu/Lambda
# A (pN um^2), eta (pN s/um^2), gamma (1/s): the paper's ranges, L = 4 um
PLANAR = (
    *((a, 0.01, 40) for a in (3, 2, 1.5, 1.2, 1.0, 0.8, 0.6)),
    *((a, 0.015, 60) for a in (1.0, 0.7, 0.5, 0.3, 0.2, 0.15, 0.1)),
)
FAMILIES = {
    "round": (),
    "round-soft": ("parameters.C=0.01",),
    "ribbon": ("parameters.thin=0.05",),
    "ribbon-soft": ("parameters.thin=0.05", "parameters.C=0.05"),
}
WORDS = {
    "round": "round, C = A",
    "round-soft": "round, C = A/50",
    "ribbon": "ribbon, C = A1",
    "ribbon-soft": "ribbon, C = A1/10",
}
# eta (pN s/um^2) and nodes: as many as waves of length 2 pi L sqrt(32/mu) ask for, no more than the kicks allow
SPACE = ((0.02, 25), (0.05, 33), (0.1, 49), (0.2, 65), (0.5, 97), (1, 97))
SPACE_ROUND = ((2, 97),)
COILED = 0.8  # of the length: the tip-to-tip distance at which a coil's radius is measured
BUCKLED = 153.2  # mu, by the weaker axis, above which a rod buckles
COIL = 32 * (4 * np.pi) ** 2  # above this the fastest wave, 2 pi L sqrt(32/mu), goes once into the window [L/4, 3L/4]


def members(quick: bool) -> list[Member]:
    """The runs: onset without noise, sets of parameters in the plane, and four kinds of rods in space."""
    window = ("time.end=5/gamma", 'observe.growth.over=["2/gamma", "5/gamma"]')
    found = [Member(f"fig7-onset-{mu}", "stagnation_point", (f"parameters.mu={mu}", *window)) for mu in ONSET]
    for a, eta, gamma in PLANAR[::3] if quick else PLANAR:
        for seed in range(1, 3 if quick else 6):
            own = (f"parameters.A={a:g}", f"parameters.eta={eta:g}", f"parameters.gamma={gamma:g}")
            name = f"fig7-plane-A={a:g}-eta={eta:g}-seed{seed}"
            found.append(Member(name, "buckling_in_plane", (*own, f"parameters.seed={seed}")))
    for family, kind in FAMILIES.items():
        sets = SPACE + (SPACE_ROUND if family.startswith("round") else ())
        for eta, nodes in sets[1::2] if quick or family.endswith("soft") else sets:
            for seed in range(1, 2 if quick else 4):
                own = (*kind, f"parameters.eta={eta:g}", f"filament.actin.nodes={nodes}", f"parameters.seed={seed}")
                found.append(Member(f"fig7-space-{family}-eta={eta:g}-seed{seed}", "buckling_in_space", own))
    return found


def draw(runs: Runs, quick: bool) -> tuple[Figure, list[Row]]:
    """The figure; threshold, modes, slopes, and how many runs ended at a contact."""
    rows = _onset(runs)
    planar, more = _planar(runs)
    space, slopes = _space(runs)
    figure = new_figure(11.5, 9, "Buckling at a stagnation point, with thermal kicks (Sec. 7.5, Fig. 7)")
    grid = figure.add_gridspec(2, 2, width_ratios=[1, 1.25])
    panels.montage(figure.add_subplot(grid[0, 0]), runs)
    panels.planar(figure.add_subplot(grid[0, 1]), planar, _thresholds())
    panels.coils(figure.add_subplot(grid[1, 0], projection="3d"), runs)
    panels.space(figure.add_subplot(grid[1, 1]), space, slopes, WORDS)
    return figure, rows + more + _space_rows(runs, space, slopes)


def _thresholds() -> list[float]:
    """Lambda of the first three bending modes."""
    return [
        threshold(mode, low, high) / LAMBDA for mode, (low, high) in enumerate(((100, 250), (400, 1200), (1000, 3000)))
    ]


def _onset(runs: Runs) -> list[Row]:
    """The zero of the growth rate, by a parabola through the four."""
    points = []
    for mu in ONSET:
        run = runs[f"fig7-onset-{mu}"]
        gamma = run.case.parameters["gamma"]
        middle, first = (run.position()[:, node, 1] for node in (run.case.filaments["rod"].nodes // 2, 0))
        late = run.time * gamma > 2
        points.append((mu, time_series.growth(run.time[late], np.abs(middle - first)[late]).value / gamma))
    mu, rate = np.array(points).T
    zero = min(np.roots(np.polyfit(mu, rate, 2)), key=lambda root: abs(root - mu.mean())).real
    seconds = runs.seconds("fig7-onset")
    return [
        Row("7.5", "buckling threshold, Lambda (without noise)", 0.393, 0.3932, float(zero / LAMBDA), seconds, 0.005)
    ]


def _planar(runs: Runs) -> tuple[list[tuple[float, float, int]], list[Row]]:
    """Lambda, shortest tip-to-tip distance over L, bending mode (0: not bent) of each run; what they come to."""
    found = []
    for name in runs.named("fig7-plane-"):
        run = runs[name]
        given, tips = run.case.parameters, np.asarray(run.observables["shortest"])
        mode = bending_mode(run, first_below(tips, 0.9 * given["L"])) if tips.min() < 0.9 * given["L"] else 0
        found.append((given["Lambda"], float(tips.min() / given["L"]), mode))
    seconds = runs.seconds("fig7-plane-")
    below = [tip for Lambda, tip, _ in found if Lambda < 0.3]
    above = sorted(found)
    rows = [Row("7.5", "tip to tip over L, Lambda < 0.3, at least", 1.0, None, min(below), seconds)]
    for low, high in ((0.393, 1.99), (1.99, 4.96), (4.96, 99)):
        some = [(tip, which) for Lambda, tip, which in above if low < Lambda < high]
        modes = "/".join(str(sum(which == m for _, which in some)) for m in (1, 2, 3, 4))
        shortest = f"{np.median([tip for tip, _ in some]):.3f}"
        window = f"Lambda > {low:g}" if high == 99 else f"{low:g} < Lambda < {high:g}"
        title = f"tip to tip over L, {window}, median of {len(some)}"
        rows.append(
            Row(
                "7.5",
                title,
                "falls",
                None,
                shortest,
                seconds,
                note=f"bent in modes 1/2/3/4: {modes}; the others turn away first",
            )
        )
    rows.append(_stopped(runs, "fig7-plane-", "in the plane", seconds))
    return found, rows


def _stopped(runs: Runs, start: str, where: str, seconds: float) -> Row:
    """How many runs ended at a contact, and how many failed and why."""
    outcomes = [o for name, o in runs.outcomes.items() if name.startswith(start)]
    contacts = sum(o.status == "stopped" for o in outcomes)
    failed = [o.message for o in outcomes if not o.done]
    folded = sum("quarter turn" in message for message in failed)
    note = (
        f"and {folded} at a quarter turn of twist between two nodes, {len(failed) - folded} otherwise" if failed else ""
    )
    return Row("7.5", f"ended at a contact, {where}", "", None, f"{contacts} of {len(outcomes)}", seconds, note=note)


Points = dict[str, np.ndarray]  # family -> mu-bar by A1, radius over L when coiled, largest until shortest (k, 3)


def _space(runs: Runs) -> tuple[Points, dict[str, tuple[float, float]]]:
    """The radii of each family; slope and its standard error where there is a whole turn to measure."""
    points, slopes = {}, {}
    for family in FAMILIES:
        found = [fold(runs[name], COILED) for name in runs.named(f"fig7-space-{family}-eta")]
        points[family] = np.array([one for one in found if one is not None]).reshape(-1, 3)
        slopes[family] = _slope(points[family], family, COIL)
    return points, slopes


def _slope(points: np.ndarray, family: str, above: float, column: int = 1) -> tuple[float, float]:
    """Of the logarithm of the radius in that of mu, where mu by the weaker axis is ``above``; and its standard error.

    Not a number where there are too few points.
    """
    kept = points[points[:, 0] * (20.0 if family.startswith("ribbon") else 1.0) > above]
    if len(np.unique(kept[:, 0])) < 2 or len(kept) < 3:
        return float("nan"), float("nan")
    x, y = np.log(kept[:, 0]), np.log(kept[:, column])
    d = x - x.mean()
    slope = float(d @ y / (d @ d))
    left = y - y.mean() - slope * d
    return slope, float(np.sqrt(left @ left / (len(x) - 2) / (d @ d)))


def _space_rows(runs: Runs, points: Points, slopes: dict[str, tuple[float, float]]) -> list[Row]:
    rows = []
    for family, (slope, error) in slopes.items():
        start = f"fig7-space-{family}-eta"
        seconds, count = runs.seconds(start), len(points[family])
        everything, largest = _slope(points[family], family, BUCKLED), _slope(points[family], family, COIL, 2)
        title = f"slope of log R_eff in log(eta gamma/Ap), {WORDS[family]}"
        note = (
            f"± {error:.2f}; {count} coils, radius when the ends are {COILED:g} L apart, fitted where the window holds "
            f"a whole turn (mu by the weaker axis > {COIL:.0f}); all above threshold: {everything[0]:.2f} ± "
            f"{everything[1]:.2f}; largest radius until the ends are closest: {largest[0]:.2f} ± {largest[1]:.2f}"
        )
        rows.append(Row("7.5", title, -0.25, None, slope if np.isfinite(slope) else "too few", seconds, note=note))
        rows.append(_stopped(runs, start, WORDS[family], seconds))
    return rows
