"""The command ``ibfil``: words to calls, faults to lines and an exit status.

A command is a module with its ``NAME``, its ``HELP``, what it adds to its parser and what it does; COMMANDS lists them.
Only the standard library is imported when they are, so that help is instant and the number of threads can be set before
numpy is loaded; each imports what it needs when it runs.
"""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from ..errors import CaseError, Interrupted, RunFailed
from ..parallel.launch import refuse_copies
from ..screen import let_go, lost, prepare, warn
from ..version import __version__
from . import bench, cases, check, live, new, page, render, run, schema, show, verify, vtk, warm
from .arguments import BAD_INPUT, CUT, FAILED
from .studies import compare, fit, modes, rest, stability, sweep, trade, tune, uncertainty

COMMANDS = (
    *(run, check, new, cases, schema, show, vtk, render, page, live),
    *(sweep, uncertainty, tune, trade, compare, stability, rest, modes, fit, verify, bench, warm),
)
NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv`` (default: the program's own); returns the exit status."""
    prepare()
    os.environ["MPLBACKEND"] = "agg"  # no window; one that the surroundings ask for may not be there at all
    words = list(sys.argv[1:] if argv is None else argv)
    strange = [word for word in words if not _is_text(word)]
    if strange:
        return _say([f"command line: found {strange[0]}, whose bytes are not UTF-8; allowed: UTF-8"], BAD_INPUT)
    arguments = parse(words)
    try:
        if not _of_many(arguments):
            refuse_copies(arguments.command)
        status: int = arguments.do(arguments)
        return status if not lost() else _say([f"standard output cannot be written ({lost()})"], status or FAILED)
    except BrokenPipeError:
        let_go()
        return FAILED
    except MemoryError as error:
        found = f"not enough memory ({error})" if str(error) else "not enough memory"
        return _say([found, "what to change: fewer nodes, cells or outputs, or a machine with more"], FAILED)
    except CaseError as error:
        return _say([fault.replace("overwrite=True", "--force") for fault in error.faults], BAD_INPUT)
    except RunFailed as error:
        return _say(str(error).splitlines(), FAILED)
    except (Interrupted, KeyboardInterrupt) as error:
        return _say(str(error).splitlines() or ["interrupted"], CUT)
    except OSError as error:
        faults = [] if error.errno is not None else _damages(arguments)  # HDF5 gives no number
        if faults:
            return _say(faults, BAD_INPUT)
        where = f"{error.filename}: " if error.filename else ""
        return _say([f"{where}{error.strerror or error}"], FAILED if error.errno in NO_ROOM else BAD_INPUT)
    except Exception:
        faults = _damages(arguments)
        if not faults:
            raise
        return _say(faults, BAD_INPUT)


def parse(argv: list[str]) -> argparse.Namespace:
    """Parse; words after an option (`run CASE -o OUT KEY=VALUE`) belong to the command's words too."""
    parser = _parser()
    arguments, rest = parser.parse_known_args(argv)
    unknown = [word for word in rest if word.startswith("-") or not hasattr(arguments, "words")]
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    if rest:
        arguments.words = [*arguments.words, *rest]
    return arguments


def _of_many(arguments: argparse.Namespace) -> bool:
    """Whether several processes may do it together: they share a run, and have each its own index of a sweep."""
    return arguments.do is run.do or getattr(arguments, "index", None) is not None


class _Help(argparse.HelpFormatter):
    """Help that takes names like CASE [KEY=VALUE ...] as they are: argparse would write them twice."""

    def _format_args(self, action: argparse.Action, default_metavar: str) -> str:
        name = str(action.metavar)
        if not name.endswith("...]"):
            return super()._format_args(action, default_metavar)
        return name if action.nargs == "+" else f"[{name}]"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ibfil",
        description="Elastic filaments in viscous fluids: bending, twisting rods in resistive-force theory "
        "or in an immersed-boundary grid fluid. A case is one TOML file, a run one HDF5 file.",
        epilog="Exit status: 0 done, 1 the run failed, 2 bad input, 130 after Ctrl-C.",
    )
    parser.add_argument("--version", action="version", version=f"ibfil {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for module in COMMANDS:
        command = commands.add_parser(
            module.NAME, help=module.HELP, description=module.HELP, epilog=None, formatter_class=_Help
        )
        command.set_defaults(do=module.do, command=module.NAME)
        module.add(command)
    return parser


def _damages(arguments: argparse.Namespace) -> list[str]:
    """The damages of the run file a command has read; where there are none, an error is the program's own fault."""
    path = getattr(arguments, "run", None) or getattr(arguments, "resume", None)
    if path is None:
        return []
    from ..io.integrity import examine

    return examine(Path(path))


def _is_text(word: str) -> bool:
    """Whether a word came as UTF-8: bytes that are none are halves of letters in it."""
    try:
        word.encode()
    except UnicodeEncodeError:
        return False
    return True


def _say(faults: Sequence[str], status: int) -> int:
    """Faults to standard error, one line each."""
    for fault in faults:
        warn(f"ibfil: {fault}")
    return status
