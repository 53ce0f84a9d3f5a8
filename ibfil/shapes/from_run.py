"""A start shape taken from another run: positions and directors of the filament of that name at one of its outputs.

It stands where it stood, so the keys that place a shape do nothing. The clock starts again at zero, and nothing but the
shape is carried over: no velocity, no memory of a fluid.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..case.shape import RunShape
from ..errors import CaseError
from ..linalg.finite_differences import clamped_weights, ghost_weights
from .curves import Curve, unit

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..io.reader import RunFile


def curve_from_run(filament: Filament, name: str, s: np.ndarray, folder: Path) -> Curve:
    """The nodes ``s`` (N,) of filament ``name`` as they stand in the run that ``shape.path`` names.

    Where the run's nodes lie at the same arclengths they are taken as they are; otherwise r and e1 are cubic splines
    through them over arclength, which keeps the stretch. Raises ValueError, with a sentence, where the run cannot be
    read, has no such filament or output, or its filament is not as long.
    """
    from ..io.reader import RunFile

    shape = filament.shape
    assert isinstance(shape, RunShape)
    try:
        with RunFile(folder / shape.path) as run:
            return _curve(run, filament, name, s)
    except CaseError as error:
        raise ValueError("; ".join(error.faults)) from None


def _curve(run: RunFile, filament: Filament, name: str, s: np.ndarray) -> Curve:
    from scipy.interpolate import CubicSpline

    shape = filament.shape
    assert isinstance(shape, RunShape)
    if name not in run.filaments:
        raise ValueError(f"has no filament {name}; it has {', '.join(run.filaments)}")
    old = run.arclength(name)
    if abs(old[-1] - s[-1]) > 1e-9 * s[-1]:
        raise ValueError(f"its filament {name} has length {old[-1]:g}; this one has {s[-1]:g}")
    output, columns = _output(run, shape), run.filaments[name]
    r, e1 = columns["position"][output], columns["e1"][output]
    spline, half = CubicSpline(old, r), 0.5 * s[-1]
    # Nodes that are the same keep every bit; splines only round.
    same = len(old) == len(s) and np.allclose(old, s, rtol=0.0, atol=1e-12 * s[-1])
    if not same:
        r, e1 = spline(s), CubicSpline(old, e1)(s)
    slope = spline(s, 1)
    for end, tangent in zip((0, -1), _clamps(run, name, output, old), strict=True):
        if tangent is not None:
            slope[end] = tangent
    # Normal to the tangents of the nodes' stencils, as they were: whoever asks for the shape makes the others so.
    return Curve(r, slope, unit(e1), spline(half), None)


def _output(run: RunFile, shape: RunShape) -> int:
    """The number of the output that ``shape.time`` names."""
    times, wanted = run.time, shape.instant
    if wanted is None:
        return len(times) - 1
    nearest = int(np.argmin(np.abs(times - wanted)))
    if abs(times[nearest] - wanted) > 1e-9 * max(times[-1], abs(wanted)):
        raise ValueError(f"has no output at t = {wanted:g}; the nearest is at {float(times[nearest])!r}")
    return nearest


def _clamps(run: RunFile, name: str, output: int, s: np.ndarray) -> list[np.ndarray | None]:
    """The tangents that the run's own clamps hold; None at ends that are not clamped.

    The strain there tells: r'' = W r + w T with the tangent T normal to e1, so O1 = -(T x e1).r'' = -(T x e1).W r, and
    T is at the angle asin(O1/|p|) from p, the part of W r normal to e1 (rods/mesh.py has W).
    """
    columns, filament = run.filaments[name], run.filament(name)
    r, e1, strain = (columns[key][output] for key in ("position", "e1", "strain"))
    ghost = run.case.thermal is not None and filament.derivative == 2
    held: list[np.ndarray | None] = []
    for end, nodes in ((filament.start, [0, 1, 2]), (filament.finish, [-1, -2, -3])):
        if not end.clamped:
            held.append(None)
            continue
        w, _ = (ghost_weights if ghost else clamped_weights)(s[nodes])
        director = e1[nodes[0]]
        across = w @ r[nodes]
        across = across - (across @ director) * director
        sine = -strain[nodes[0], 0] / np.linalg.norm(across)
        forwards = (s[nodes[1]] - s[nodes[0]]) * (r[nodes[1]] - r[nodes[0]])
        cosine = np.copysign(np.sqrt(1.0 - sine**2), forwards @ across)
        tangent = cosine * unit(across) + sine * np.cross(director, unit(across))
        if tangent @ unit(forwards) < 0.2:  # the other cosine might be meant
            raise ValueError(f"its filament {name} is bent by a right angle at its clamp")
        held.append(tangent)
    return held
