"""How far a run is from the data: residuals of points at the data's own times and arclengths, and of observables.

A rigid motion that the data leave open is taken out by superposing the data on the run (Kabsch, Acta Cryst. A 32 (1976)
922, weighted): of each frame, or of the first, whose motion then holds for all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ...io.reader import RunFile
    from .data import Data

_SAME = 1e-9  # of the last time: an output and a frame are at one time
Motion = tuple[np.ndarray, np.ndarray]  # a turn (d, d) and a shift (d,): x -> x turn + shift


@dataclass(frozen=True)
class Seen:
    """The run and the data at one frame, in case units: ``model`` and ``data`` (n, d), the data superposed."""

    model: np.ndarray
    data: np.ndarray


def look(run: RunFile, data: Data, align: str) -> list[Seen]:
    """The run at every frame of the data, at its arclengths by a quintic spline; CaseError where it lacks one."""
    from scipy.interpolate import make_interp_spline

    times, models = run.time, []
    held = {name: np.asarray(run.position(name)) for name in {frame.filament for frame in data.frames}}
    for frame in data.frames:
        i = int(np.argmin(np.abs(times - frame.time)))
        if abs(times[i] - frame.time) > _SAME * max(times[-1], frame.time):
            raise CaseError([f"--data: t = {frame.time:g}: the run has no output there: it ended at {times[-1]:g}"])
        s = run.arclength(frame.filament)
        models.append(make_interp_spline(s, held[frame.filament][i], k=5)(frame.s)[:, data.axes])
    moved = ALIGNED[align](models, data)
    return [Seen(model, points) for model, points in zip(models, moved, strict=True)]


def residuals(seen: Sequence[Seen], data: Data) -> list[np.ndarray]:
    """sqrt(weight)(model - data), (n, d) a frame."""
    return [np.sqrt(f.weight)[:, None] * (one.model - one.data) for one, f in zip(seen, data.frames, strict=True)]


def _not_aligned(models: list[np.ndarray], data: Data) -> list[np.ndarray]:
    """As they are; what has no place of its own, by its first point."""
    shift = [model[0] - f.points[0] if data.free else 0.0 for model, f in zip(models, data.frames, strict=True)]
    return [frame.points + one for frame, one in zip(data.frames, shift, strict=True)]


def _by_first(models: list[np.ndarray], data: Data) -> list[np.ndarray]:
    """The motion that superposes the first frame of all filaments, for all frames."""
    first = [i for i, frame in enumerate(data.frames) if frame.time == data.frames[0].time]
    turn, shift = motion(
        np.concatenate([models[i] for i in first]),
        np.concatenate([data.frames[i].points for i in first]),
        np.concatenate([data.frames[i].weight for i in first]),
    )
    return [frame.points @ turn + shift for frame in data.frames]


def _by_each(models: list[np.ndarray], data: Data) -> list[np.ndarray]:
    """A motion of its own for every frame."""
    out = []
    for model, frame in zip(models, data.frames, strict=True):
        turn, shift = motion(model, frame.points, frame.weight)
        out.append(frame.points @ turn + shift)
    return out


ALIGNED: dict[str, Callable[[list[np.ndarray], Data], list[np.ndarray]]] = {
    "none": _not_aligned,
    "start": _by_first,
    "each": _by_each,
}


def motion(model: np.ndarray, points: np.ndarray, weight: np.ndarray) -> Motion:
    """The turn and the shift, no mirror, that bring ``points`` (n, d) nearest to ``model`` (n, d)."""
    share = weight / np.sum(weight)
    here, there = share @ model, share @ points
    u, _, vt = np.linalg.svd((points - there).T @ (share[:, None] * (model - here)))
    signs = np.ones(points.shape[1])
    signs[-1] = np.sign(np.linalg.det(u @ vt)) or 1.0
    turn = (u * signs) @ vt
    return turn, here - there @ turn
