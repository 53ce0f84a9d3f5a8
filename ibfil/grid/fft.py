"""FFTs of real vector fields on the grid, by FFTW: three plans of one component each way.

Plans are measured once and remembered as wisdom in the user's cache folder; the wisdom used is written into the run
file, so a run that is resumed takes the same plans and gives the same bits.
"""

from __future__ import annotations

import base64
import json
import os
from pathlib import Path

import numpy as np
import pyfftw

from .. import cache

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # else FFTW's threads spin while they wait for a busy core

_LIMIT = 20.0  # seconds of planning a transform at the most
_SHARED = 2**19  # numbers of a transform below which a second thread costs more on a busy machine than it takes over


def wisdom_file() -> Path:
    """Where plans are remembered between runs."""
    return cache.folder() / "fftw-wisdom.json"


def learn(wisdom: str = "") -> None:
    """Takes the plans in ``wisdom`` (of a run file), else those of the user's cache, if there are any."""
    try:
        text = wisdom or wisdom_file().read_text()
        pyfftw.import_wisdom(tuple(base64.b64decode(part) for part in json.loads(text)))
    except (OSError, ValueError, TypeError, IndexError, RecursionError):
        return  # no cache, or a damaged one, costs planning time and nothing else


def wisdom() -> str:
    """The plans known now, as one line of text."""
    return json.dumps([base64.b64encode(part).decode() for part in pyfftw.export_wisdom()])


def remember() -> None:
    """Writes the plans known now into the user's cache."""
    cache.keep(wisdom_file(), wisdom())


def modes_of(number: type) -> np.dtype:
    """The complex type whose parts are of the type ``number``."""
    return np.result_type(number, np.complex64)


def useful_threads(size: int, threads: int) -> int:
    """How many of ``threads`` a transform of ``size`` numbers is given: one below 80 cells a side."""
    return threads if size > _SHARED else 1


class VectorTransform:
    """Forward and backward transforms of ``real`` (3, nx, ny, nz) and ``modes`` (3, nx, ny, nz//2 + 1).

    ``forward`` keeps ``real``; ``backward`` overwrites both, and leaves the normalisation 1/(nx ny nz) to the caller.
    ``planning`` is FFTW's: "FFTW_ESTIMATE" for a few transforms, "FFTW_MEASURE" for many. There may be more
    ``fields`` than 3. ``number`` is the type of ``real``, double or single precision.
    """

    def __init__(
        self,
        cells: tuple[int, int, int],
        threads: int = 1,
        planning: str = "FFTW_MEASURE",
        fields: int = 3,
        number: type = np.float64,
    ) -> None:
        nx, ny, nz = cells
        self.real = pyfftw.zeros_aligned((fields, nx, ny, nz), dtype=number)
        self.modes = pyfftw.zeros_aligned((fields, nx, ny, nz // 2 + 1), dtype=modes_of(number))
        self.size = nx * ny * nz

        def plan(component: int, direction: str) -> pyfftw.FFTW:
            ends = (self.real[component], self.modes[component])
            return pyfftw.FFTW(
                *(ends if direction == "FFTW_FORWARD" else ends[::-1]),
                axes=(0, 1, 2),
                direction=direction,
                flags=(planning,) if direction == "FFTW_FORWARD" else (planning, "FFTW_DESTROY_INPUT"),
                threads=useful_threads(self.size, threads),
                planning_timelimit=_LIMIT,
            )

        self._forward = [plan(c, "FFTW_FORWARD") for c in range(fields)]
        self._backward = [plan(c, "FFTW_BACKWARD") for c in range(fields)]
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
