"""The members of a study: ordinary runs side by side, one HDF5 file each in one folder.

Finished runs are kept, cut ones go on from their checkpoint, failures are reported and take no other run
with it. Everything above (sweep, compare, trade, stability, and scripts of users) makes a list of `Member` and
reads the files of the `Outcome`s:

    outcomes = run_members([Member("thin", "swimmer_rft", ("fluid.viscosity=2",)), ...], "folder", jobs=2)
    for outcome in outcomes:
        if outcome.done:
            with RunFile(outcome.path) as run: ...

Nothing but the standard library is loaded with this module, so that a worker can set its number of threads.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CaseError, Interrupted, RunFailed
from ..screen import tell
from .member import Member, Outcome
from .progress import MemberProgress
from .workers import side_by_side, stop_if_cut

if TYPE_CHECKING:
    from ..case.schema import Case


_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.,=+-]*")  # becomes the name of a file
_WORDS = {"title", "source", "expect"}  # what a case may say otherwise and still be the same run
_LOOK = 0.2  # seconds between two looks at signals, of an executor given

Log = Callable[[str], object]


def run_members(
    members: Sequence[Member],
    folder: str | Path,
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = tell,
) -> list[Outcome]:
    """Run what is not done, ``jobs`` at a time in processes of one thread each; the outcomes in the order given.

    ``executor`` is any of concurrent.futures, a cluster's for instance: `work` and its arguments can be pickled,
    and the folder must be the same on all its machines. With one job and no executor they run in this process.
    ``log`` is told a line when a member ends, with the time left; a terminal has a bar too. A run that failed for
    reasons of the scene counts as known until its case or the versions change, and is not tried again.

    Raises CaseError where two members have one name or one cannot be that of a file, the folder cannot be made, or
    processes of a script without `if __name__ == "__main__"` would begin others; Interrupted after Ctrl-C or
    SIGTERM, when the runs under way have written their checkpoints, and where the executor broke: the same call goes
    on. A member whose case is at fault, fails or kills its process is an Outcome, no exception.
    """
    folder = Path(folder)
    _check_names(members)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaseError([f"{folder}: cannot be made ({error.strerror})"]) from None
    # What cannot be read is not sent to other machines.
    outcomes = {member.name: _standing(member, folder, log, read=executor is not None) for member in members}
    for known in outcomes.values():
        if not known.done and known.status != "waiting":
            log(_line(known))
    todo = [member for member in members if outcomes[member.name].status == "waiting"]
    with MemberProgress(len(members), len(members) - len(todo)) as progress:
        for outcome in _run_all(todo, folder, jobs, executor):
            outcomes[outcome.member.name] = outcome
            progress.tell(_line(outcome), outcome.status not in ("interrupted", "waiting"), log)
    if any(outcome.status in ("interrupted", "waiting") for outcome in outcomes.values()):
        done = sum(outcome.done for outcome in outcomes.values())
        raise Interrupted(f"interrupted; {done} of {len(members)} runs are done; the same command goes on")
    return [outcomes[member.name] for member in members]


def _line(outcome: Outcome) -> str:
    """The line about a member that has ended."""
    spent = f" in {outcome.seconds:.1f} s" if outcome.seconds else ""
    return f"{outcome.member.name}: {outcome.status}{spent}" + (f": {outcome.message}" if outcome.message else "")


def work(member: Member, folder: str) -> Outcome:
    """Run one member, or go on with it; nothing where it is done. Reads its arguments and the files they name.

    May be called again at any time, and in any process.
    """
    from time import monotonic

    standing, began = _standing(member, Path(folder), _silence), monotonic()
    if standing.status != "waiting":
        return standing
    try:
        status, message = _run(member.resolved(), standing.path)
    except (Interrupted, KeyboardInterrupt) as cut:
        status, message = "interrupted", str(cut)
    except RunFailed as failure:
        status, message = "failed", _why(failure, standing.path)
    except CaseError as error:
        status, message = "failed", "; ".join(error.faults)
    except Exception as error:  # one member never takes the others down
        status, message = "failed", f"{type(error).__name__}: {error}"
    return Outcome(member, status, standing.path, message, monotonic() - began)


def _run(case: Case, path: Path) -> tuple[str, str]:
    """Run the case, or go on where it was cut; its status and reason."""
    from ..case.reading import parse_case
    from ..io.checkpoint import read
    from ..io.paths import checkpoint_path
    from ..running.run import run

    begun = False
    with contextlib.suppress(CaseError):  # no checkpoint, or one that cannot be read
        last = read(checkpoint_path(path))
        begun = path.exists() and not _differing(parse_case(last.case, last.file), case)
    # No checkpoint stays: many small files, for runs that are of one length.
    result = run(case, path, overwrite=True, resume=begun, progress=False, log=stop_if_cut, extends=False)
    checkpoint_path(path).unlink(missing_ok=True)
    return result.status, result.reason


def _why(failure: RunFailed, path: Path) -> str:
    """In one line, as the run file has it: there without what it would take to go on with the same run."""
    from ..io.reader import RunFile

    words = str(failure)
    with contextlib.suppress(CaseError), RunFile(path) as run:
        words = run.reason or words
    return words.replace("\n", "; ")


def _differing(a: Case, b: Case) -> list[str]:
    """The keys in which two cases differ, those aside that leave the run the same."""
    from ..case.reading import differences

    keys = differences(a, b)
    return [key for key in keys if key.split(".")[0] not in _WORDS and key != "output.checkpoint_every"]


def of_other_cases(members: Sequence[Member], folder: Path) -> dict[str, list[str]]:
    """The members whose file in the folder is a run of another case: by name, the keys in which they differ."""
    from ..io.reader import RunFile

    found = {}
    for member in members:
        path = folder / f"{member.name}.h5"
        with contextlib.suppress(CaseError):  # at fault, damaged, or of another version: told when it is its turn
            if path.exists():
                case = member.resolved()
                with RunFile(path) as run:
                    found[member.name] = _differing(run.case, case)
    return {name: keys for name, keys in found.items() if keys}


def _standing(member: Member, folder: Path, log: Log, read: bool = False) -> Outcome:
    """How far a member is: as its file says, failed where its case is at fault, waiting where there is work to do.

    The case of one without a file is left unread but where ``read`` is set: those of hundreds take seconds.
    """
    from ..errors import RunFileError
    from ..io.reader import RunFile

    path = folder / f"{member.name}.h5"
    if not path.exists() and not read:
        return Outcome(member, "waiting", path)
    try:
        case = member.resolved()
    except CaseError as error:
        return Outcome(member, "failed", path, "; ".join(error.faults))
    if not path.exists():
        return Outcome(member, "waiting", path)
    try:
        with RunFile(path) as run:
            status, reason, written_by = run.status, run.reason, run.versions
            changed = _differing(run.case, case)
    except RunFileError as damage:
        log(f"{member.name}: {damage}")
        return Outcome(member, "waiting", path)
    except CaseError:  # a case of another version of ibfil
        status, reason, written_by, changed = "cut", "", {}, ["its keys"]
    if status == "running":
        return Outcome(member, status, path, "is being written by another ibfil")
    if changed:
        log(f"{member.name}: what is there is of another case ({', '.join(changed)}); computed again")
    again = changed or status in ("cut", "interrupted") or (status == "failed" and not _known(reason, written_by))
    return Outcome(member, "waiting" if again else status, path, "" if again else reason.replace("\n", "; "))


def _known(reason: str, versions: dict[str, str]) -> bool:
    """Whether a failure is the scene's own and would come again, bit for bit: not a full disk, say."""
    from ..io.provenance import versions as present

    return reason.startswith("the run stopped") and "cannot be written" not in reason and versions == present()


def _check_names(members: Sequence[Member]) -> None:
    names = [member.name for member in members]
    faults = [
        f"{name!r}: found as the name of a run; allowed: letters, digits, _ . , = + -"
        for name in names
        if not _NAME.fullmatch(name) or len(name) > 200
    ]
    faults += [f"{name}: found twice; allowed: one run of a name" for name in set(names) if names.count(name) > 1]
    if faults:
        raise CaseError(sorted(faults))


def _run_all(todo: Sequence[Member], folder: Path, jobs: int, executor: Executor | None) -> Iterator[Outcome]:
    """Yield each outcome when it is known. Ends early after a signal."""
    if executor is not None:
        yield from _submitted(executor, todo, folder)
    elif jobs > 1 and len(todo) > 1:
        yield from side_by_side(work, todo, folder, min(jobs, len(todo)))
    else:
        for member in todo:
            outcome = work(member, str(folder))
            yield outcome
            if outcome.status == "interrupted":
                return


def _submitted(executor: Executor, todo: Sequence[Member], folder: Path) -> Iterator[Outcome]:
    """In an executor that was given. After a signal what has not begun is taken back, what has is left to it."""
    from ..running.progress import Signals
    from .executors import loss

    futures: dict[Future[Outcome], Member] = {}
    with Signals() as signals:
        try:
            for member in todo:
                futures[executor.submit(work, member, str(folder.resolve()))] = member
        except Exception as error:  # one that is broken, or whose scheduler has gone; the rest waits
            yield Outcome(todo[len(futures)], "waiting", folder, f"the executor takes no more: {error}")
        while futures and not signals.caught:
            for future in wait(futures, timeout=_LOOK, return_when=FIRST_COMPLETED).done:
                member, lost = futures.pop(future), loss(future)
                path = folder / f"{member.name}.h5"
                yield Outcome(member, lost[0], path, lost[1]) if lost else future.result()
    for future in futures:
        future.cancel()


def _silence(line: str) -> None:
    """Say nothing."""
