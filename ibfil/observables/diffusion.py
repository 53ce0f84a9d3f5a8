"""The kinds of observables that are of diffusion: mean squares of displacements over an interval.

Along the gyration axis that the filament has as each interval begins, and across it: the most distinct axis of its
gyration tensor, a rod's or helix's long axis, a ring's normal. An interval from every output in `over`.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from ..io.snapshots import Snapshot
from .base import Unfit
from .blocks import StandardError, means_of_blocks, standard_error
from .local import AtPlace

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


class Steps(AtPlace):
    """Squares of displacements over `interval` of a place, by default the centroid.

    The series (T, 3) holds those of the interval that ends at each output, along the axis and in two directions across
    it.
    """

    keys = ("at", "space", "interval", "over")
    mean_only = fitted = True
    default_at = "centroid"
    dimension = "length length"
    description = "squares of displacements along the gyration axis and across it, over an interval,"

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.lag, every = observe.interval, case.output.every
        if every and abs(self.lag / every - max(round(self.lag / every), 1)) > 1e-6:
            raise Unfit("interval", self.lag, f"a multiple of output.every = {every:g}")
        self._past: deque[tuple[float, np.ndarray, np.ndarray]] = deque()

    @property
    def vector(self) -> bool:
        """Always."""
        return True

    def sample(self, snapshot: Snapshot) -> np.ndarray:
        """Those of the interval that ends here; no numbers where none does."""
        position, time, past = self.look(snapshot).position, snapshot.time, self._past
        begin, slack = time - self.lag, 1e-6 * self.lag
        while past and past[0][0] < begin - slack:
            past.popleft()
        here, out = self.point(position), np.full(3, np.nan)
        if past and past[0][0] <= begin + slack:
            _, before, axes = past[0]
            out = ((here - before) @ axes) ** 2
        past.append((time, here, self._axes(position)))
        return out

    def _axes(self, position: np.ndarray) -> np.ndarray:
        """The gyration axis, and two across it (columns)."""
        d = position - self.share @ position
        squares, axes = np.linalg.eigh((d * self.share[:, None]).T @ d)
        return axes[:, ::-1] if squares[2] - squares[1] >= squares[1] - squares[0] else axes

    def seen(self, times: np.ndarray, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Times (t,) and squares (t, 3) of the intervals within `over`."""
        start, end = (-np.inf, np.inf) if self.over is None else self.over
        slack = 1e-9 * abs(times[-1])
        inside = (times - self.lag >= start - slack) & (times <= end + slack) & np.isfinite(samples[:, 0])
        return times[inside], samples[inside]

    def _error_of_mean(self, times: np.ndarray, values: np.ndarray) -> StandardError | None:
        """That of values (t,), one an interval; those of intervals that overlap are related."""
        if not self.random or len(times) < 2:
            return None
        return standard_error(means_of_blocks(times, values), len(times), times[0], times[-1])


class Diffusion(Steps, kind="diffusion"):
    """Diffusivity D of a place (default the centroid), mean square displacement over `interval` by 6 times that."""

    summary_dimension = "length length/time"
    number = "diffusivity"

    def summary(self, times: np.ndarray, samples: np.ndarray) -> float:
        """The mean of all intervals within `over`."""
        _, squares = self.seen(times, samples)
        return float(np.mean(self._of(squares))) if len(squares) else float("nan")

    def error(self, times: np.ndarray, samples: np.ndarray) -> StandardError | None:
        """From blocks of intervals."""
        times, squares = self.seen(times, samples)
        return self._error_of_mean(times, self._of(squares))

    def _of(self, squares: np.ndarray) -> np.ndarray:
        """D (t,) from squares (t, 3)."""
        return np.sum(squares, axis=1) / (6 * self.lag)


class DiffusionAlong(Diffusion, kind="diffusion_along"):
    """The same along the gyration axis as each interval begins."""

    number = "diffusivity along the gyration axis"

    def _of(self, squares: np.ndarray) -> np.ndarray:
        return squares[:, 0] / (2 * self.lag)


class DiffusionAcross(Diffusion, kind="diffusion_across"):
    """The same across the gyration axis as each interval begins, mean of the two directions."""

    number = "diffusivity across the gyration axis"

    def _of(self, squares: np.ndarray) -> np.ndarray:
        return np.sum(squares[:, 1:], axis=1) / (4 * self.lag)


class DiffusionRatio(Steps, kind="diffusion_ratio"):
    """D_perp/D_par of a place (default the centroid): across and along the gyration axis as each interval begins.

    From mean squares of displacements over `interval`, an interval from every output in `over`. The axis belongs to the
    most distinct eigenvalue of the gyration tensor: a rod's or helix's long axis, a ring's normal.
    """

    summary_dimension = "1"
    number = "diffusion across over along the gyration axis"

    def summary(self, times: np.ndarray, samples: np.ndarray) -> float:
        """The ratio of all intervals within `over`."""
        _, squares = self.seen(times, samples)
        along, *across = np.sum(squares, axis=0)
        return float(0.5 * sum(across) / along) if along > 0 else float("nan")

    def error(self, times: np.ndarray, samples: np.ndarray) -> StandardError | None:
        """From blocks of (across - ratio along)/(mean along), whose mean is zero."""
        ratio = self.summary(times, samples)
        times, squares = self.seen(times, samples)
        if not np.isfinite(ratio):
            return None
        across = 0.5 * np.sum(squares[:, 1:], axis=1)
        return self._error_of_mean(times, (across - ratio * squares[:, 0]) / np.mean(squares[:, 0]))
