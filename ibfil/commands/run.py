"""`ibfil run`: a case from its start, or on from a checkpoint."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ..errors import CaseError
from ..parallel.launch import processes
from ..screen import tell
from ..threads import set_threads
from .arguments import DONE, add_case, only_changes, read_case, say_if_cold

if TYPE_CHECKING:
    from ..running.result import Result

NAME, HELP = "run", "run a case: a file, or the name of a shipped case"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    add_case(command, "*")
    command.add_argument("-o", dest="output", metavar="RUN.h5", help="the run file (default: the case's name, here)")
    command.add_argument("--force", action="store_true", help="replace a run file that is there already")
    longer = "go on with this run where it was cut, or with time.end=... make it longer"
    command.add_argument("--resume", metavar="RUN.h5", help=longer)


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status. Under mpiexec process 0 does, and the others share its grid."""
    if processes() == 1:
        return _do(arguments)
    set_threads(1)  # of numpy's libraries in all processes but 0, which reads its case first
    from ..parallel.ranks import Ranks, agree, join, serve

    comm = join()
    agree(comm, (arguments.words, arguments.output, arguments.force, arguments.resume))
    if comm.rank:
        serve(comm)
        return DONE
    with Ranks(comm) as ranks, ranks.sharing():
        return _do(arguments)


def _do(arguments: argparse.Namespace) -> int:
    words = arguments.words
    if arguments.resume:
        return _resume(arguments)
    if not words:
        raise CaseError(["run: found no case; allowed: CASE [KEY=VALUE ...], or --resume RUN.h5"])
    case = read_case(words)
    output = Path(arguments.output or Path(words[0]).with_suffix(".h5").name)
    if not output.parent.is_dir():
        raise CaseError([f"{output}: there is no folder {output.parent}"])
    say_if_cold()
    from ..running.run import run

    changes = " ".join(word for word in words[1:] if not word.startswith(("output.", "compute.")))
    return _end(run(case, output, overwrite=arguments.force, log=tell), changes)


def _resume(arguments: argparse.Namespace) -> int:
    """Go on with a run; its number of threads is needed before the libraries that can read it are loaded."""
    if arguments.output or arguments.force:
        raise CaseError(["run --resume: found -o or --force; allowed: neither, it goes on in the same file"])
    words = arguments.words
    with_case = bool(words) and ("=" not in words[0] or Path(words[0]).is_file())
    case = read_case(words) if with_case else None
    if case is None:
        only_changes(words)
        set_threads(_threads_of(arguments.resume))
    say_if_cold()
    from ..running.run import resume_run

    return _end(resume_run(arguments.resume, case, () if with_case else words, log=tell))


def _threads_of(run: str) -> int:
    """The threads of a run's case, read by another process; 1 where it cannot be read, to fail later."""
    import subprocess

    code = (
        "import sys, pathlib; from ibfil.case.reading import parse_case; from ibfil.io import checkpoint, paths; "
        "c = checkpoint.read(paths.checkpoint_path(pathlib.Path(sys.argv[1]))); "
        "print(parse_case(c.case, c.file).compute.threads)"
    )
    answer = subprocess.run([sys.executable, "-c", code, run], capture_output=True, text=True, check=False)
    return int(answer.stdout) if answer.returncode == 0 else 1


def _end(result: Result, changes: str = "") -> int:
    """Print the end of a run: the file, how it ended, the observables, and what was expected before ``changes``."""
    from ..analysis.summary import digest, duration, results
    from ..io.reader import RunFile

    assert result.path is not None
    with RunFile(result.path) as run:
        told = digest(run)
    reason = f" ({told['reason']})" if told["reason"] else ""
    tell(f"{told['status']}{reason}: {told['steps']} steps in {duration(told['wall_time'])}")
    again = f" (longer: ibfil run --resume {quote(str(result.path))} time.end=...)"
    longer = again if told["status"] == "finished" else ""
    tell(f"{result.path}: {told['outputs']} outputs{longer}")
    tell(results(told, changes))
    return DONE
