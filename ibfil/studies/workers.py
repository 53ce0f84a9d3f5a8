"""Members of a study in processes of our own, one thread each: what `--jobs` does.

A process of which the pool knows what it is at: when one is killed, that member is told as failed, another
process takes its place, and no other member is touched (which a ProcessPoolExecutor does not give). Ctrl-C is
passed on once, so that each run under way writes its checkpoint.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CaseError, Interrupted
from ..threads import set_threads

if TYPE_CHECKING:
    from .member import Member, Outcome

    Work = Callable[[Member, str], Outcome]  # what is done with a member in a folder; it can be pickled

_LOOK = 0.2  # seconds between two looks at signals
_UNGUARDED = 76  # exit status of a worker whose script, read anew, would begin workers of its own


class Worker:
    """A process that runs members one after another. ``member`` is what it is at, None where it waits."""

    def __init__(self, work: Work, folder: Path) -> None:
        spawn = multiprocessing.get_context("spawn")  # a fork would keep the locks of this process's threads
        self.pipe, end = spawn.Pipe()
        self._process = spawn.Process(target=_serve, args=(end, work, str(folder)), daemon=True)
        self._process.start()
        end.close()  # so that its death is the end of the pipe
        self.member: Member | None = None
        self.dead = self._told = False
        self._folder = folder

    def begin(self, member: Member) -> None:
        """Give it something to do."""
        self.member = member
        with suppress(ConnectionError):  # told when it is waited for
            self.pipe.send(member)

    def ended(self, cut: bool) -> Outcome:
        """Return what it has sent; where it has died, that: interrupted if ``cut``, failed otherwise.

        Raises CaseError where it could not begin.
        """
        from .member import Outcome

        member, self.member = self.member, None
        assert member is not None
        try:
            outcome: Outcome = self.pipe.recv()
        except (EOFError, ConnectionError):
            self.dead = True
            self.close()
            if self._process.exitcode == _UNGUARDED:
                allowed = 'what runs members under `if __name__ == "__main__":`'
                raise CaseError([f"jobs: each process reads the script anew; allowed: {allowed}"]) from None
            status = "interrupted" if cut else "failed"
            words = "its process was killed; by the system, perhaps, for want of memory"
            outcome = Outcome(member, status, self._folder / f"{member.name}.h5", words)
        return outcome

    def interrupt(self) -> None:
        """Have the run under way write its checkpoint and end; once, a second signal would kill it."""
        if self.member is not None and not self._told and self._process.pid is not None:
            self._told = True
            with suppress(ProcessLookupError):
                os.kill(self._process.pid, signal.SIGINT)

    def close(self) -> None:
        """Let it end, after what it is at."""
        self.pipe.close()
        self._process.join()


def side_by_side(work: Work, todo: Sequence[Member], folder: Path, jobs: int) -> Iterator[Outcome]:
    """Yield each outcome of ``work`` when it is known; after SIGINT or SIGTERM those of the runs under way, no more.

    Raises CaseError where workers cannot begin.
    """
    from ..running.progress import Signals

    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(_UNGUARDED)  # a worker that is reading its script, of which its parent tells
    left, workers = list(reversed(todo)), [Worker(work, folder) for _ in range(jobs)]
    with Signals() as signals:
        try:
            for worker in workers:
                worker.begin(left.pop())
            while busy := {worker.pipe: worker for worker in workers if worker.member}:
                for pipe in wait(list(busy), timeout=_LOOK):
                    worker = busy[pipe]  # type: ignore[index]
                    yield worker.ended(signals.caught)
                    if worker.dead:
                        workers.remove(worker)
                        if left:
                            workers.append(worker := Worker(work, folder))
                    if left and not signals.caught:
                        worker.begin(left.pop())
                if signals.caught:
                    for worker in workers:
                        worker.interrupt()
        except CaseError:
            for worker in workers:
                worker.member = None  # they read their script, and end by themselves
            raise
        finally:
            for worker in workers:
                worker.interrupt()
                worker.close()


def stop_if_cut(line: str) -> None:
    """Take a line of a run's log; raise Interrupted where Ctrl-C came before the run could see to it itself."""
    if _cut:
        raise Interrupted("interrupted before its first step")


_cut: list[int] = []  # the signals this process has had as a worker


def _serve(pipe: Connection, work: Work, folder: str) -> None:
    """The work of a worker: members, until there are no more. It leaves the terminal's Ctrl-C to its parent."""
    signal.signal(signal.SIGINT, lambda number, snapshot: _cut.append(number))
    os.setpgrp()
    set_threads(1)
    try:
        while True:
            pipe.send(work(pipe.recv(), folder))
    except (EOFError, ConnectionError):
        return  # no more to do, or the parent has gone
