"""What is read off a buckled filament: its mode, and the radius of its coil."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import trapezoid
from scipy.optimize import brentq

if TYPE_CHECKING:
    from ibfil.io.reader import RunFile


def first_below(series: np.ndarray, level: float) -> int:
    """The first output below the level; that of the smallest value where there is none."""
    below = np.nonzero(series < level)[0]
    return int(below[0]) if len(below) else int(np.argmin(series))


def free_modes(s: np.ndarray, count: int) -> np.ndarray:
    """Curvatures (count, n) of the bending modes of a free rod of length 1, of mean square 1."""
    shapes = []
    for k in range(1, count + 1):
        guess = (k + 0.5) * np.pi
        beta = brentq(lambda b: np.cos(b) - 1 / np.cosh(b), guess - 0.3, guess + 0.3)
        ratio = (np.cosh(beta) - np.cos(beta)) / (np.sinh(beta) - np.sin(beta))
        shape = np.cosh(beta * s) - np.cos(beta * s) - ratio * (np.sinh(beta * s) - np.sin(beta * s))
        shapes.append(shape / np.sqrt(trapezoid(shape**2, s)))
    return np.array(shapes)


def bending_mode(run: RunFile, output: int) -> int:
    """Which free bending mode (1: a C, 2: an S, 3: a W ...) the curvature of a planar filament holds most of."""
    (name,) = run.filaments
    curvature = run.filaments[name]["strain"][output][:, 0]
    s = np.linspace(0.0, 1.0, len(curvature))
    return 1 + int(np.argmax([abs(trapezoid(curvature * mode, s)) for mode in free_modes(s, 4)]))


def fold(run: RunFile, coiled: float) -> tuple[float, float, float] | None:
    """mu-bar by A1, effective radius over L when the ends are first ``coiled`` L apart, and the largest until shortest.

    None for a filament that never folds so far.
    """
    given = run.case.parameters
    tips = np.asarray(run.observables["tip_to_tip"]) / given["L"]
    radius = np.asarray(run.observables["radius"]) / given["L"]
    if tips.min() >= coiled:
        return None
    shortest = int(np.argmin(tips))
    return given["mu_bar"], float(radius[first_below(tips, coiled)]), float(radius[: shortest + 1].max())
