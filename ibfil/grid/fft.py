"""FFTs by FFTW: its plans, and transforms of real vector fields on the grid, three plans of one component each way.

Two plans of a transform differ in the last bits, and FFTW chooses between them by a clock. So that equal runs have
equal bits, a plan is measured once on a machine and remembered as wisdom in the user's cache folder; where none can be
kept, and for transforms of which there are many kinds in a run, it is estimated from counts. The wisdom known is
written into the run file and its checkpoint, so that a run that is resumed takes the same plans.
"""

from __future__ import annotations

import base64
import json
import math
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from .. import cache
from .fftw import pyfftw

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # else FFTW's threads spin while they wait for a busy core

_LIMIT = 20.0  # seconds of planning a transform at the most
MEASURED, ESTIMATED = "FFTW_MEASURE", "FFTW_ESTIMATE"
_PLANNER = threading.RLock()  # FFTW's planner and its wisdom are those of the process
_SHARED = 2**19  # numbers of a transform below which a second thread costs more on a busy machine than it takes over


def wisdom_file() -> Path:
    """Where plans are remembered between runs."""
    return cache.folder() / "fftw-wisdom.json"


def learn(wisdom: str = "") -> None:
    """Takes the plans in ``wisdom`` (of a checkpoint) and no others, else those of the user's cache, if there are."""
    with _PLANNER:
        try:
            text = wisdom or wisdom_file().read_text()
            parts = tuple(base64.b64decode(part) for part in json.loads(text))
            if wisdom:
                pyfftw.forget_wisdom()
            pyfftw.import_wisdom(parts)
        except (OSError, ValueError, TypeError, IndexError, RecursionError):
            return  # no cache, or a damaged one, costs planning time and nothing else


def wisdom() -> str:
    """The plans known now, as one line of text."""
    with _PLANNER:
        return json.dumps([base64.b64encode(part).decode() for part in pyfftw.export_wisdom()])


def remember() -> bool:
    """Writes the plans known now into the user's cache; whether they are there."""
    return cache.keep(wisdom_file(), wisdom())


def modes_of(number: type) -> np.dtype:
    """The complex type whose parts are of the type ``number``."""
    return np.result_type(number, np.complex64)


def useful_threads(size: int, threads: int) -> int:
    """How many of ``threads`` a transform of ``size`` numbers is given: one below 80 cells a side."""
    return threads if size > _SHARED else 1


def plan(
    source: np.ndarray,
    to: np.ndarray,
    axes: tuple[int, ...],
    direction: str,
    threads: int = 1,
    planning: str = MEASURED,
    keeps: bool = False,
) -> pyfftw.FFTW:
    """A transform of ``source`` into ``to``, whose contents are lost; executed it keeps ``source`` if ``keeps``."""

    def made(*flags: str) -> pyfftw.FFTW:
        flags = flags if keeps else (*flags, "FFTW_DESTROY_INPUT")
        return pyfftw.FFTW(
            source, to, axes=axes, direction=direction, flags=flags, threads=threads, planning_timelimit=_LIMIT
        )

    with _PLANNER:
        return _estimated(made) if planning == ESTIMATED else _measured(made)


def _estimated(made: Callable[..., pyfftw.FFTW]) -> pyfftw.FFTW:
    """A plan from counts alone: FFTW would also take what it knows of parts of it, which may be another time's."""
    known = pyfftw.export_wisdom()
    pyfftw.forget_wisdom()
    try:
        return made(ESTIMATED)
    finally:
        pyfftw.import_wisdom(known)


def _measured(made: Callable[..., pyfftw.FFTW]) -> pyfftw.FFTW:
    """The plan that is known, here or in the cache; else the fastest, which is then remembered."""
    try:
        return made(MEASURED, "FFTW_WISDOM_ONLY")
    except RuntimeError:
        pass
    with cache.alone(wisdom_file()) as kept:
        if not kept:
            return _estimated(made)
        learn()  # another process may have found it meanwhile
        try:
            return made(MEASURED, "FFTW_WISDOM_ONLY")
        except RuntimeError:
            found = made(MEASURED)
            return found if remember() else _estimated(made)


def staggered(shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Zeros of a ``shape`` (fields, ..), aligned, each field nine cache lines further into its page than the last.

    Fields one after the other share few lines of the caches where the grid's extents are powers of two, and a loop over
    six of them takes up to half as long again.
    """
    line = 64 // dtype.itemsize
    size = math.prod(shape[1:])
    pitch = -(-size // line) * line + 9 * line
    room = pyfftw.zeros_aligned(shape[0] * pitch, dtype).reshape(shape[0], pitch)
    return room[:, :size].reshape(shape)


class VectorTransform:
    """Forward and backward transforms of ``real`` (3, nx, ny, nz) and ``modes`` (3, nx, ny, nz//2 + 1).

    ``forward`` keeps ``real``; ``backward`` overwrites both, and leaves the normalisation 1/(nx ny nz) to the caller.
    ``planning`` is ESTIMATED for a few transforms, MEASURED for many. There may be more
    ``fields`` than 3. ``number`` is the type of ``real``, double or single precision. ``stagger``: the modes of fields
    lie apart (`staggered`), for loops over all of them.
    """

    def __init__(
        self,
        cells: tuple[int, int, int],
        threads: int = 1,
        planning: str = MEASURED,
        fields: int = 3,
        number: type = np.float64,
        stagger: bool = False,
    ) -> None:
        nx, ny, nz = cells
        self.real = pyfftw.zeros_aligned((fields, nx, ny, nz), dtype=number)
        room = staggered if stagger else pyfftw.zeros_aligned
        self.modes = room((fields, nx, ny, nz // 2 + 1), modes_of(number))
        self.size = nx * ny * nz

        axes, threads = (0, 1, 2), useful_threads(self.size, threads)
        pairs = list(zip(self.real, self.modes, strict=True))
        self._forward = [plan(r, m, axes, "FFTW_FORWARD", threads, planning, keeps=True) for r, m in pairs]
        self._backward = [plan(m, r, axes, "FFTW_BACKWARD", threads, planning) for r, m in pairs]
        self.real[:] = 0.0
        self.modes[:] = 0.0

    def forward(self, fields: int = 3, into: np.ndarray | None = None) -> np.ndarray:
        """``modes`` of the first ``fields`` of ``real``, or ``into`` another array like them, aligned like them."""
        modes = self.modes if into is None else into
        for c, plan in enumerate(self._forward[:fields]):
            plan.update_arrays(self.real[c], modes[c])
            plan.execute()
        return modes

    def backward(self, fields: int = 3) -> np.ndarray:
        """``real`` of the first ``fields`` of ``modes``, times the number of cells."""
        for plan in self._backward[:fields]:
            plan.execute()
        return self.real
