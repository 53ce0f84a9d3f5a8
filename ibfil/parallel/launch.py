"""The launcher of MPI programs that started this process, if one did: what its environment variables say.

Each sets its own, for the processes that it starts and no others. A batch script of SLURM sees the number of tasks
too, but not that of a step, which only `srun` has.
"""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from ..errors import CaseError

_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE", "SLURM_STEP_NUM_TASKS")
_RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "MV2_COMM_WORLD_RANK", "PMIX_RANK", "SLURM_PROCID")


def _first(names: tuple[str, ...], absent: int) -> int:
    return next((int(os.environ[name]) for name in names if os.environ.get(name, "").isdecimal()), absent)


def processes() -> int:
    """How many processes were started together with this one; 1 where it was started by itself."""
    return max(1, _first(_SIZES, 1))


def place() -> int:
    """Which of them this one is, from 0."""
    return _first(_RANKS, 0)


def refuse(line: str) -> NoReturn:
    """Raises CaseError on process 0; the others end without a word."""
    if place() == 0:
        raise CaseError([line])
    raise SystemExit(0)


def refuse_copies(command: str) -> None:
    """Raises, as ``refuse``, where each process would do all of a command; workers of mpi4py.futures wait."""
    count = processes()
    if count == 1 or "mpi4py.futures" in sys.modules:
        return
    name = next(name for name in _SIZES if name in os.environ)
    refuse(
        f"{command}: found {count} processes ({name}), each of which would do all of it; allowed: 1 process, or "
        f"ibfil run, which they share (in a shell that a launcher opened: unset {name})"
    )
