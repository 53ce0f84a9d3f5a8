"""The loop of a run: steps between outputs; at each output the record, the observables, the stop rules."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from ..errors import Interrupted, RunFailed, Stopped
from ..io import checkpoint
from ..io.datasets import Meaning
from ..io.disk import failed_write
from ..io.ownership import Stranger
from ..io.pace import Pace
from ..io.paths import checkpoint_path
from ..io.writer import GridPlace, Recorder, record_end
from ..observables.observers import ObservableSet
from ..observables.stop_rules import StopRules
from ..simulation.schedule import SAME, Due, due_times, lasts
from ..threads import one_thread_of_blas
from .progress import Progress, Signals
from .result import Result

if TYPE_CHECKING:
    from ..io.snapshots import Snapshot
    from ..simulation.simulation import Simulation


_LOOK = 0.2  # seconds between two looks at clocks and progress


class Loop:
    """A simulation and everything around it. ``start`` or ``go_on`` runs it to its end, once."""

    def __init__(
        self,
        simulation: Simulation,
        seen: ObservableSet,
        log: Callable[[str], object],
        progress: bool,
        rules: StopRules | None = None,
        extends: bool = True,
    ) -> None:
        """``extends``: the run may be made longer one day; without it checkpoints are of runs that are cut alone."""
        self.simulation, self.case, self._observed = simulation, simulation.case, seen
        self._rules = rules or StopRules(self.case, seen)
        self._log, self._show, self._extends = log, progress, extends
        self._signals = Signals()
        self._recorder: Recorder | None = None
        self._path: Path | None = None
        self._snapshot: Snapshot | None = None
        self._began, self._spent = clock.monotonic(), 0.0  # now; seconds spent by the parts of the run before
        self._pace = Pace()
        self._next_look = self._next_checkpoint = 0.0
        self._good: float | None = None  # time of the last checkpoint
        self._longer: checkpoint.Checkpoint | None = None  # what a longer run goes on from, where that is not the end
        self._progress: Progress | None = None

    def start(self, path: Path | None, overwrite: bool, groups: Mapping[str, float]) -> Result:
        """From the state the simulation is in; ``path`` None writes nothing. ``groups``: the dimensionless ones."""
        first, *rest = due_times(self.case, self.simulation.grid is not None)
        self._path = path

        def work() -> tuple[str, str]:
            snapshot = self._snapshot = self.simulation.snapshot(self._fields(first))
            values = self._observed.record(snapshot)
            if path is not None:
                meanings = {
                    self._observed.recorded(name): Meaning(observable.dimension, observable.description)
                    for name, observable in self._observed.observables.items()
                }
                self._recorder = Recorder.create(
                    path,
                    self.case,
                    snapshot,
                    values,
                    meanings,
                    grid=self._grid_place(),
                    method=self.simulation.method,
                    wisdom=self.simulation.wisdom,
                    groups=groups,
                    expected=sum(due.output for due in rest) + 1,
                    overwrite=overwrite,
                )
                if snapshot.grid:
                    self._recorder.append_fields(snapshot.time, snapshot.grid)
                self._begin()
            reason = self._rules.check(snapshot.time)
            return ("stopped", reason) if reason else self._steps(rest)

        return self._guarded(work)

    def go_on(self, path: Path, last: checkpoint.Checkpoint, fields_at: float) -> Result:
        """From a checkpoint the simulation has taken up; ``fields_at`` is when fields were last written."""
        self._path, self._spent, self._good = path, last.wall_time, last.time

        def work() -> tuple[str, str]:
            self._snapshot = self.simulation.snapshot()
            self._recorder = Recorder.resume(path, self.case, last.outputs, last.fields, self._grid_place())
            self._pace = Pace(self._recorder.pace)
            self._next_checkpoint = clock.monotonic() + self.case.output.checkpoint_every
            slack, written = SAME * self.case.time.end, float(self._observed.times[-1])
            rest = []
            for due in due_times(self.case, self.simulation.grid is not None):
                output, fields = (
                    due.output and due.time > written + slack,
                    due.fields and due.time > fields_at + slack,
                )
                if due.time > self.simulation.time - slack and (output or fields):
                    rest.append(Due(due.time, output, fields))
            return self._steps(rest)

        return self._guarded(work)

    def _steps(self, dues: Sequence[Due]) -> tuple[str, str]:
        """Go from one due time to the next; how it ended."""
        simulation, slack = self.simulation, SAME * self.case.time.end
        self._progress = Progress(simulation.time, self.case.time.end, self._log, self._show)
        for due in dues:
            longer = due is dues[-1] and self._extends and not lasts(self.case, simulation.grid is not None)
            if longer and self._recorder is not None:
                self._longer = self._present(self._recorder).copied()
            if due.time > simulation.time + slack:
                try:
                    simulation.advance(due.time, self._after_step)
                except Stopped as stopped:
                    if self._snapshot is None or simulation.time > self._snapshot.time:
                        self._output(simulation.snapshot())
                    return "stopped", str(stopped)
            with self._pace.paused():
                reason = self._look(due)
            if reason:
                return "stopped", reason
        return "finished", ""

    def _look(self, due: Due) -> str:
        """The stop rule that is true at what is due now; "" where none is."""
        snapshot = self.simulation.snapshot(self._fields(due))
        if due.fields and snapshot.grid and self._recorder is not None:
            self._recorder.append_fields(snapshot.time, snapshot.grid)
        if not due.output:
            return ""
        self._output(snapshot)
        return self._rules.check(snapshot.time)

    def _output(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        values = self._observed.record(snapshot)
        if self._recorder is not None:
            self._recorder.append(snapshot, values)

    def _after_step(self) -> None:
        self._pace.step(self.simulation.time)
        for told in (self.simulation.notices, self._recorder.notices if self._recorder else []):
            while told:
                self._log(f"warning: {told.pop(0)}")
        if self._signals.caught:
            raise Interrupted
        now = clock.monotonic()
        if now >= self._next_look:
            self._next_look = now + min(_LOOK, self.case.output.checkpoint_every)
            assert self._progress is not None
            self._progress.tell(self.simulation.time, self.simulation.steps)
            if self._recorder is not None:
                self._recorder.settle()
                if now >= self._next_checkpoint:
                    self._checkpoint()

    def _fields(self, due: Due) -> Sequence[str]:
        return self.case.output.fields if due.fields else ()

    def _grid_place(self) -> GridPlace | None:
        grid = self.simulation.grid
        return None if grid is None else GridPlace(grid.origin, grid.spacing, self.case.output.grid_stride)

    def _wall_time(self) -> float:
        return self._spent + clock.monotonic() - self._began

    def _attributes(self) -> dict[str, Any]:
        simulation = self.simulation
        pace = self._pace.attributes(simulation.time)
        return {"steps": simulation.steps, "wall_time": self._wall_time(), "wisdom": simulation.wisdom, **pace}

    def _present(self, recorder: Recorder) -> checkpoint.Checkpoint:
        """The checkpoint of the present state, in the memory of the simulation."""
        simulation = self.simulation
        return checkpoint.Checkpoint(
            state=simulation.state(),
            time=simulation.time,
            steps=simulation.steps,
            outputs=recorder.outputs,
            fields=recorder.fields,
            wall_time=self._wall_time(),
            case=self.case.text,
            file=self.case.file,
            wisdom=simulation.wisdom,
            created=recorder.created,
        )

    def _checkpoint(self, of_end: checkpoint.Checkpoint | None = None) -> None:
        """Have all outputs so far on the disk, then the present state, or that ``of_end``. Raises RunFailed."""
        recorder, path = self._recorder, self._path
        assert recorder is not None
        assert path is not None
        recorder.write(**self._attributes())
        place = checkpoint_path(path)
        try:
            checkpoint.write(place, of_end or self._present(recorder))
        except OSError as error:
            raise failed_write(place, error) from error
        except Stranger as stranger:
            raise RunFailed(str(stranger), advice="the outputs up to here are in the run file") from None
        self._good = self.simulation.time
        self._next_checkpoint = clock.monotonic() + self.case.output.checkpoint_every

    def _guarded(self, work: Callable[[], tuple[str, str]]) -> Result:
        """Do the work, and leave the files as they should be however it ends."""
        try:
            with self._signals, one_thread_of_blas():
                try:
                    status, reason = work()
                except (Interrupted, BrokenPipeError):  # the pipe it speaks into: `ibfil run CASE | head`
                    raise self._interrupted() from None
                return self._finished(status, reason)
        except Interrupted:
            raise
        except RunFailed as failure:
            raise self._of_this_run(failure) from failure.__cause__
        except MemoryError as error:
            words = f"not enough memory ({error})" if str(error) else "not enough memory"
            less = "fewer nodes, cells or threads, or a machine with more; `ibfil check` estimates what is needed"
            raise self._of_this_run(RunFailed(words, time=self.simulation.time, advice=less)) from error
        except BaseException as error:
            self._failed(f"{type(error).__name__}: {error}")
            raise
        finally:
            if self._progress is not None:
                self._progress.close()
            if self._recorder is not None:
                self._recorder.close()

    def _of_this_run(self, failure: RunFailed) -> RunFailed:
        """The failure, noted in the run file, with where one may go on from."""
        self._failed(failure.message if failure.time is None else str(failure))
        if self._good is not None and self._path is not None:
            more = f"the last good checkpoint is {checkpoint_path(self._path)}, t = {self._good:.6g}"
            failure.advice = f"{failure.advice}; {more}" if failure.advice else more
        return failure

    def _finished(self, status: str, reason: str) -> Result:
        """Close the run file. The checkpoint stays, where it is to be made longer and no rule has ended it."""
        if self._recorder is not None and self._path is not None:
            kept = status == "finished" and self._extends
            if kept:
                self._keep()
            self._recorder.finish(status, reason, **self._attributes())
            if not kept:
                checkpoint_path(self._path).unlink(missing_ok=True)
        assert self._snapshot is not None
        steps, wall_time = self.simulation.steps, self._wall_time()
        return Result(self.case, status, reason, self._path, steps, wall_time, self._snapshot, self._observed)

    def _begin(self) -> None:
        """Have a checkpoint of the start, where it is of use: a run that nobody makes longer begins as fast anew."""
        if self._extends:
            self._checkpoint()
        else:
            self._next_checkpoint = clock.monotonic() + self.case.output.checkpoint_every

    def _keep(self) -> None:
        """Write what a longer run goes on from; where that fails an earlier checkpoint has to do, and it is told."""
        try:
            self._checkpoint(self._longer)
        except RunFailed as failure:
            self._log(f"warning: {failure.message}; to make the run longer will take more of it again")

    def _interrupted(self) -> Interrupted:
        """Write a checkpoint, and say how to go on."""
        line = f"interrupted at t = {self.simulation.time:.6g}"
        if self._recorder is None:
            return Interrupted(f"{line}; nothing was written")
        self._checkpoint()
        self._recorder.finish("interrupted", line, **self._attributes())
        return Interrupted(f"{line}; go on with: ibfil run --resume {quote(str(self._path))}")

    def _failed(self, reason: str) -> None:
        """Note it in the run file, or try to."""
        if self._recorder is None or self._path is None:
            return
        try:
            self._recorder.finish("failed", reason, **self._attributes())
        except Exception:  # what went wrong first is what counts
            self._recorder.close()
            record_end(self._path, "failed", reason)
