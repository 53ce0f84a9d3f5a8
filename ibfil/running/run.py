"""Running a case from its start, or on from a checkpoint. The loop between is in loop.py."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ..case.reading import differences, parse_case, read_case, written
from ..check.overview import Overview, overview_of
from ..errors import CaseError, RunFileError
from ..io import checkpoint, journal
from ..io.overwriting import RUN, refuse
from ..io.ownership import is_being_written
from ..io.paths import checkpoint_path, journal_path
from ..io.provenance import versions
from ..io.reader import RunFile
from ..observables.base import Observable
from ..observables.factory import observers
from ..observables.observers import ObservableSet
from ..observables.stop_rules import StopRules
from ..screen import tell
from ..simulation.schedule import meets
from .loop import Loop
from .result import Result

if TYPE_CHECKING:
    from ..case.overrides import Overrides
    from ..case.reading import Source
    from ..case.schema import Case
    from ..rods.constitutive import MomentLaw
    from ..simulation.simulation import Simulation

    Build = Callable[[Case, str], Simulation]
    Look = Callable[[Simulation], Overview]

# Keys that may differ where a run goes on: each dataset has a row an output, of one shape, from the first to the last.
# Those of fields may before there are any.
_TIMES = ("time.end", *(f"output.{key}" for key in ("every", "times", "grid_every", "checkpoint_every")))
_OF_FIELDS = tuple(f"output.{key}" for key in ("fields", "grid_stride", "window", "window_at"))


def run(
    case: Source,
    output: str | Path | None = None,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    resume: bool = False,
    progress: bool = True,
    log: Callable[[str], object] = tell,
    observables: Mapping[str, Observable] | None = None,
    laws: Mapping[str, MomentLaw] | None = None,
    build: Build | None = None,
    look: Look = overview_of,
    extends: bool = True,
) -> Result:
    """Run a case and write the run file ``output``; None writes nothing.

    The case is one that was read, a file, the name of a shipped case, or a dict; ``overrides`` as in `read_case`.

    With ``resume`` it goes on from the checkpoint of ``output`` if there is one, or makes a finished run longer.
    ``observables`` are further ones, made
    in Python, and ``laws`` constitutive laws by filament (rods/constitutive.py). ``build`` makes the simulation from
    the case and FFTW wisdom, by default `Simulation` with
    these laws, and ``look`` says what is told of it before it runs. Without ``extends`` the run is not to be made
    longer one day: a checkpoint is written only where it is cut, or takes longer than `output.checkpoint_every`.

    Raises CaseError (also where ``output`` exists and ``overwrite`` is not set), RunFailed, and Interrupted
    after Ctrl-C or SIGTERM; a second one kills.

    >>> result = ibfil.run("case.toml", progress=False, log=lambda line: None)
    >>> print(result.status, result.times.shape, result.series("tip").shape)
    finished (3,) (3, 3)
    """
    case = read_case(case, overrides)
    build = build or _builder(laws)
    path = None if output is None else Path(output)
    if path is not None and resume and checkpoint_path(path).exists() and case.time.end > _end_of(path):
        return resume_run(path, case, progress=progress, log=log, observables=observables, build=build, look=look)
    seen = observers(case, observables)
    if path is not None:
        overwrite = overwrite or _holds_no_more_than_its_start(path)
        refuse(path, RUN, overwrite, case.reads)
    simulation = build(case, "")
    overview = look(simulation)
    for line in _banner(simulation, overview):
        log(line)
    return Loop(simulation, seen, log, progress, extends=extends).start(path, overwrite, overview.groups)


def resume_run(
    path: str | Path,
    case: Case | None = None,
    overrides: Overrides = (),
    *,
    progress: bool = True,
    log: Callable[[str], object] = tell,
    observables: Mapping[str, Observable] | None = None,
    laws: Mapping[str, MomentLaw] | None = None,
    build: Build | None = None,
    look: Look = overview_of,
) -> Result:
    """Go on with the run in ``path`` from its last checkpoint, bit for bit as if it had never been cut.

    One that is finished is made longer, to a later time.end, as if that had been asked for at first. The case is the
    one it began with, or ``case``, or that with ``overrides``: only time.end and the times of outputs may differ. The
    run file is cut back to the checkpoint; a torn one is put right, and one damaged beyond that is computed again.
    ``laws`` made in Python have to be given again. Raises as `run`, and RunFileError (a CaseError) where there is
    nothing to go on from.
    """
    path, build = Path(path), build or _builder(laws)
    if is_being_written(journal_path(path)):
        raise RunFileError(f"{path}: is being written by another ibfil that is still running")
    last = _last_checkpoint(path)
    began = parse_case(last.case, last.file)
    case = _goes_on(path, began, case or parse_case(last.case, last.file, overrides), last)
    seen = observers(case, observables)
    rules = StopRules(case, seen)
    try:
        if journal.recover(path, journal_path(path)):
            log(f"{path} was torn when its run was killed; put back to its last whole write")
        fields_at, other = _replay(path, last, seen, rules)
    except (RunFileError, OSError, KeyError, ValueError, RuntimeError) as damage:
        log(f"{path} cannot be used ({_why(damage)}); rebuilt by computing it again from t = 0")
        return run(
            case, path, overwrite=True, progress=progress, log=log, observables=observables, build=build, look=look
        )
    simulation = build(case, last.wisdom)
    try:
        simulation.restore(dict(last.state))
    except KeyError as missing:
        place, wrote = checkpoint_path(path), "another version of ibfil wrote it: go on with that one"
        raise RunFileError(f"{place}: has no {missing} in its state; {wrote}") from None
    if other:
        log(f"warning: {other}; the rest may differ in the last digits from a run that was not cut")
    if case.time.end != began.time.end and not meets(began, case, last.time, simulation.grid is not None):
        log(f"warning: {path} was cut on its way to its end, which is no output now: steps from here are other ones")
    log(f"going on with {path} from t = {last.time:.6g}, after {last.outputs} outputs and {last.steps} steps")
    return Loop(simulation, seen, log, progress, rules).go_on(path, last, fields_at)


def _holds_no_more_than_its_start(path: Path) -> bool:
    """Whether it is a run that failed or was killed at its start: nothing in it that the same command does not make."""
    beside = checkpoint_path(path)
    with suppress(CaseError, OSError, KeyError, ValueError, RuntimeError), RunFile(path) as found:
        if found.status in ("failed", "cut") and len(found) <= 1:
            return not beside.exists() or checkpoint.read(beside).time == 0.0
    return False


def _end_of(path: Path, created: str = "") -> float:
    """When a finished run, ``created`` then, ended; -1 where it is another, has not finished or cannot be read."""
    with suppress(CaseError, OSError, KeyError, ValueError, RuntimeError), RunFile(path) as found:
        if found.status == "finished" and created in ("", found.created):
            return float(found.time[-1])
    return -1.0


def _builder(laws: Mapping[str, MomentLaw] | None) -> Build:
    def build(case: Case, wisdom: str) -> Simulation:
        from ..simulation.simulation import Simulation

        return Simulation(case, wisdom, laws or {})

    return build


def _banner(simulation: Simulation, overview: Overview) -> Iterator[str]:
    """Say what a run begins with: the case, the dimensionless groups, the warnings."""
    case = simulation.case
    if case.title:
        yield case.title
    scheme = f"{case.time.scheme} of order {case.time.order}"
    yield f"fluid {case.fluid.words}, method {simulation.method}, {scheme}"
    if overview.groups:
        yield "  ".join(f"{name} = {value:.4g}" for name, value in overview.groups.items())
    for warning in overview.warnings:
        yield f"warning: {warning}"


def _last_checkpoint(path: Path) -> checkpoint.Checkpoint:
    beside = checkpoint_path(path)
    if not beside.exists():
        status = ""
        if path.exists():
            with RunFile(path) as run_file:
                status = f"; its run is {run_file.status}"
                if run_file.status in ("finished", "stopped"):
                    status += ', and a new one may start from its last output: shape = { kind = "run", path = ... }'
        raise RunFileError(f"{path}: no checkpoint {beside.name} to go on from{status}")
    return checkpoint.read(beside)


def _goes_on(path: Path, began: Case, case: Case, last: checkpoint.Checkpoint) -> Case:
    """The case to go on with. Raises CaseError where more than its times differs, or nothing is to do."""
    may = _TIMES if began.output.grid_every else (*_TIMES, *_OF_FIELDS)
    faults = [
        f"{case.file}: {key}: found {written(now)}; the run began with {written(then)}, and only time.end and times of "
        'output may change: go on without that, or begin a new run (shape.kind = "run" starts from a frame of this one)'
        for key, (then, now) in differences(began, case).items()
        if ".".join(key.split(".")[:2]) not in may
    ]
    if case.time.end < last.time:
        allowed = f"at least {last.time:g}, where the run is"
        faults.append(f"{case.file}: time.end: found {case.time.end:g}; allowed: {allowed}")
    if faults:
        raise CaseError(faults)
    ended = _end_of(path, last.created)
    if case.time.end <= ended:
        allowed = f"above {ended:g}, to make it longer: time.end=..."
        raise RunFileError(f"{path}: is finished; time.end: found {case.time.end:g}; allowed: {allowed}")
    return case


def _replay(path: Path, last: checkpoint.Checkpoint, seen: ObservableSet, rules: StopRules) -> tuple[float, str]:
    """Show the outputs up to the checkpoint to all that looks.

    Gives the time of the last fields, -1 if there are none, and in words which versions have changed. Raises
    RunFileError where the run file has not got all outputs, and whatever h5py raises where it cannot read them.
    """
    with RunFile(path) as run_file:
        if run_file.created != last.created:
            raise CaseError([f"{path}: its checkpoint {checkpoint_path(path).name} belongs to another run"])
        grid = run_file.grid
        if len(run_file) < last.outputs or (0 if grid is None else len(grid.time)) < last.fields:
            raise RunFileError(f"{path}: ends before its checkpoint")
        for snapshot in run_file.snapshots(0, last.outputs):
            seen.record(snapshot)
            rules.check(snapshot.time)
        began, now = run_file.versions, versions()
        other = [f"{name} is {v}, was {began.get(name, 'none')}" for name, v in now.items() if v != began.get(name)]
        fields_at = -1.0 if grid is None or last.fields == 0 else float(grid.time[last.fields - 1])
    return fields_at, ", ".join(other)


def _why(damage: Exception) -> str:
    line = damage.faults[0] if isinstance(damage, CaseError) else str(damage)
    return line.splitlines()[0] if line else type(damage).__name__
