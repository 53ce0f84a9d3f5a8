"""The processes of a run: process 0 runs the case, the others do their parts of what it asks for.

Shared are parts: each a class whose methods all processes call together, each with its own share of the data.
Process 0 alone knows rods, files, clocks and signals, so nothing has to be agreed upon: the others wait, take up a call
with its small arguments, and wait again. An error on one of them ends all, by MPI_Abort, as the rest could wait for it
for ever; one on process 0 amid a call does too, once its files are closed.
"""

from __future__ import annotations

import atexit
import signal
import sys
import time
import traceback
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

import numpy as np

from ..screen import warn
from . import launch

_SPIN, _NAP = 2e-3, 1e-4  # seconds of looking all the time for what is asked next; seconds between two looks after that
_MISSING = (
    "mpiexec: started {count} processes, and to make one run they need mpi4py and an MPI library ({why}); install "
    "them: pip install 'ibfil[mpi]' mpich"
)
_STRANGE = (
    "mpiexec: started {count} processes, of which MPI knows {size}: mpi4py was built for another MPI ({library}) than "
    "this mpiexec belongs to; use that one's mpiexec, or pip install --no-binary mpi4py mpi4py"
)
_DIFFERENT = (
    "mpiexec: started {count} processes with different words, and they share one run; give all the same, or start "
    "each run by itself"
)
_STOP, _MAKE, _CALL = range(3)
_ours: Ranks | None = None


def ours() -> Ranks | None:
    """The processes that this one, process 0, shares its run with; None where it is alone."""
    return _ours


class Shared:
    """The handle that process 0 has on a part: ``local`` is its own share of it."""

    def __init__(self, ranks: Ranks, key: int, local: Any) -> None:
        self._ranks, self._key, self.local = ranks, key, local
        weakref.finalize(self, ranks.forget, key)

    def call(self, method: str, *told: Any, own: tuple[Any, ...] = ()) -> Any:
        """The value of the method on process 0, of arguments ``told`` to all, and its ``own``, None on the others."""
        return self._ranks.call(self, method, told, own)


class Ranks:
    """All processes that the launcher started, as process 0 sees them; a context at whose end the others are done."""

    def __init__(self, comm: Any) -> None:
        self.comm, self.size = comm, int(comm.size)
        self._made = 0
        self._forgotten: list[int] = []
        self._broken = False

    def __enter__(self) -> Ranks:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        if self._broken:  # the others wait for the rest of a call: they are ended once this process has said why
            atexit.register(self.comm.Abort, 1)
        else:
            self._tell((_STOP, (), ()))

    @contextmanager
    def sharing(self) -> Iterator[None]:
        """Within it scenes are assembled for all of them."""
        global _ours
        _ours = self
        try:
            yield
        finally:
            _ours = None

    def make(self, part: Callable[..., Any], *told: Any) -> Shared:
        """A part, made by each process with its communicator and what it is told, the same for all."""
        self._made += 1
        key = self._made
        return Shared(self, key, self._together((_MAKE, (key, part, told), ()), lambda: part(self.comm, *told)))

    def call(self, shared: Shared, method: str, told: tuple[Any, ...], own: tuple[Any, ...]) -> Any:
        """See ``Shared.call``."""
        order = (_CALL, (shared._key, method, told, len(own)), self._forgotten)
        self._forgotten = []
        return self._together(order, lambda: getattr(shared.local, method)(*told, *own))

    def forget(self, key: int) -> None:
        """The part is not used any more; the others are told with the next call."""
        self._forgotten.append(key)

    def _together(self, order: tuple[Any, ...], work: Callable[[], Any]) -> Any:
        if self._broken:
            raise RuntimeError("the processes of this run are no longer together, as a call went wrong before")
        self._broken = True  # unless it comes to its end
        self._tell(order)
        out = work()
        self._broken = False
        return out

    def _tell(self, order: tuple[Any, ...]) -> None:
        self.comm.Ibcast(np.zeros(1, np.int8)).Wait()
        self.comm.bcast(order)


def join() -> Any:
    """The communicator of all processes that the launcher started. Raises CaseError, on process 0, where there is none.

    The others then end without a word.
    """
    count = launch.processes()
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        launch.refuse(_MISSING.format(count=count, why=str(error).strip().split("\n")[0]))
    comm = MPI.COMM_WORLD
    if comm.size != count:
        library = MPI.Get_library_version().split("\n")[0].strip(" \0")
        launch.refuse(_STRANGE.format(count=count, size=comm.size, library=library))
    return comm


def agree(comm: Any, words: object) -> None:
    """Raises CaseError, on process 0, where processes were not all asked for the same run."""
    if any(other != words for other in comm.allgather(words)):
        launch.refuse(_DIFFERENT.format(count=comm.size))


def serve(comm: Any) -> None:
    """The work of a process other than 0: its part of all that is asked for, until there is nothing more."""
    for number in (signal.SIGINT, signal.SIGTERM):  # process 0 ends the run, and with it this
        signal.signal(number, signal.SIG_IGN)
    parts: dict[int, Any] = {}
    try:
        while True:
            kind, words, forgotten = _order(comm)
            for key in forgotten:
                del parts[key]
            if kind == _STOP:
                return
            if kind == _MAKE:
                key, part, told = words
                parts[key] = part(comm, *told)
            else:
                key, method, told, own = words
                getattr(parts[key], method)(*told, *[None] * own)
    except BaseException as error:
        _end_all(comm, error)


def _order(comm: Any) -> Any:
    """The next thing that process 0 asks for; while that takes long, this process leaves its core to others."""
    asked, began = comm.Ibcast(np.zeros(1, np.int8)), time.monotonic()
    while not asked.Test():
        if time.monotonic() - began > _SPIN:
            time.sleep(_NAP)
    return comm.bcast(None)


def _end_all(comm: Any, error: BaseException) -> NoReturn:
    """Says, once, why this process cannot go on, and ends all."""
    known = isinstance(error, (MemoryError, OSError))
    if not known:
        traceback.print_exception(error)
    found = "not enough memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}"
    warn(f"ibfil: the run stopped: process {comm.rank} of {comm.size} failed: {found}")
    warn("what to change: the run file has what was written last; go on from its checkpoint with --resume")
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    comm.Abort(1)
    raise SystemExit(1)  # where Abort came back
