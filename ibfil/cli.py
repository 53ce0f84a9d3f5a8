"""The command ``ibfil``: words to calls, faults to lines and an exit status.

Only the standard library is imported here, so that help is instant and the number of threads can be set
before numpy is loaded; each command imports what it needs when it runs.
"""

from __future__ import annotations

import argparse
import errno
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from . import __version__
from .cli_studies import add_studies
from .errors import CaseError, Interrupted, RunFailed
from .threads import set_threads

if TYPE_CHECKING:
    from .case import Case
    from .loop import Result

DONE, FAILED, BAD_INPUT, CUT = 0, 1, 2, 130
NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}
CHANGES = "KEY=VALUE overrides one key of the case, by its dotted path: fluid.model=rft, stop.0.below=1e-3"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv`` (default: the program's own); returns the exit status."""
    arguments = _parse(list(sys.argv[1:] if argv is None else argv))
    try:
        status: int = arguments.do(arguments)
        sys.stdout.flush()
        return status
    except BrokenPipeError:
        _let_go()
        return FAILED
    except CaseError as error:
        return _say(error.faults, BAD_INPUT)
    except RunFailed as error:
        return _say(str(error).splitlines(), FAILED)
    except (Interrupted, KeyboardInterrupt) as error:
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            _let_go()
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


def _damages(arguments: argparse.Namespace) -> list[str]:
    """What is wrong with the run file a command has read; where nothing is, an error is the program's own fault."""
    path = getattr(arguments, "run", None) or getattr(arguments, "resume", None)
    if path is None:
        return []
    from .examine import examine

    return examine(Path(path))


def _let_go() -> None:
    """The reader (`| head`) has gone: what Python still holds for it must not raise again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _say(faults: Sequence[str], status: int) -> int:
    """Faults to standard error, one line each."""
    for fault in faults:
        print(f"ibfil: {fault}", file=sys.stderr)
    return status


def _parse(argv: list[str]) -> argparse.Namespace:
    """Parse; words after an option (`run CASE -o OUT KEY=VALUE`) belong to the command's words too."""
    parser = _parser()
    arguments, rest = parser.parse_known_args(argv)
    unknown = [word for word in rest if word.startswith("-") or not hasattr(arguments, "words")]
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    if rest:
        arguments.words = [*arguments.words, *rest]
    return arguments


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ibfil",
        description="Elastic filaments in viscous fluids: bending, twisting rods in resistive-force theory "
        "or in an immersed-boundary grid fluid. A case is one TOML file, a run one HDF5 file.",
        epilog="Exit status: 0 done, 1 the run failed, 2 bad input, 130 after Ctrl-C.",
    )
    parser.add_argument("--version", action="version", version=f"ibfil {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    def add(name: str, do: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text, epilog=None)
        command.set_defaults(do=do)
        return command

    run = add("run", _run, "run a case: a file, or the name of a shipped case")
    run.epilog = CHANGES
    run.add_argument("words", nargs="*", metavar="CASE [KEY=VALUE ...]", help="the case, and changes to it")
    run.add_argument("-o", dest="output", metavar="RUN.h5", help="the run file (default: the case's name, here)")
    run.add_argument("--force", action="store_true", help="replace a run file that is there already")
    run.add_argument("--resume", metavar="RUN.h5", help="go on from the last checkpoint of this run")
    check = add("check", _check, "run nothing: what is modelled, sizes, stable steps, estimated time, warnings")
    check.epilog = CHANGES
    check.add_argument("words", nargs="+", metavar="CASE [KEY=VALUE ...]", help="the case, and changes to it")
    new = add("new", _new, "copy a shipped case to a file, to edit it")
    new.add_argument("name", metavar="NAME", help="a shipped case (`ibfil cases` lists them)")
    new.add_argument("file", metavar="FILE", help="the file to make; one that is there is not replaced")
    add("cases", _cases, "list the shipped cases")
    schema = add("schema", _schema, "print every table and key of a case")
    schema.add_argument("--json", action="store_true", help="as JSON Schema")
    show = add("show", _show, "what is in a run: case, versions, summary, observables")
    show.add_argument("run", metavar="RUN.h5")
    show.add_argument("--json", action="store_true", help="the summary as JSON")
    show.add_argument("--plot", metavar="FILE.png", help="draw the run (png, pdf or svg)")
    show.add_argument("--csv", metavar="FILE.csv", help="write time and all observables as a table")
    vtk = add("vtk", _vtk, "write ParaView files: a .pvd collection of filaments and fields")
    vtk.add_argument("run", metavar="RUN.h5")
    vtk.add_argument("-o", dest="folder", metavar="DIR", help="the folder (default: the run's name)")
    vtk.add_argument("--wrap", action="store_true", help="bring filaments into the periodic box, cut at its faces")
    vtk.add_argument("--images", type=_count, default=0, metavar="N", help="periodic images in N boxes on each side")
    vtk.add_argument(
        "--watch", type=_seconds, nargs="?", const=5.0, metavar="SECONDS", help="follow a run until it ends (5 s)"
    )
    render = add("render", _render, "draw a run without a display: a picture (png) or a film (mp4, gif)")
    render.add_argument("run", metavar="RUN.h5")
    render.add_argument("-o", dest="output", metavar="FILE", required=True, help="film.mp4, film.gif or picture.png")
    render.add_argument("--colour", default="tension", metavar="WHAT", help="tension, moment, curvature, speed ...")
    render.add_argument("--flow", default="none", metavar="HOW", help="none, slice, glyphs or streamlines")
    render.add_argument("--montage", type=int, default=0, metavar="N", help="N shapes over the run in one picture")
    render.add_argument("--time", type=float, metavar="T", help="of a picture (default: the last)")
    render.add_argument("--size", type=_size, default=(1280, 960), metavar="WxH", help="in pixels (1280x960)")
    render.add_argument("--fps", type=float, default=25.0, metavar="N", help="pictures a second of a film (25)")
    render.add_argument("--every", type=int, default=1, metavar="N", help="show every N-th output only")
    add_studies(add)
    verify = add("verify", _verify, "run shipped or given cases and hold their [expect] numbers against the result")
    verify.add_argument("cases", nargs="*", metavar="CASE")
    verify.add_argument("--quick", action="store_true", help="the quick form of each case")
    bench = add("bench", _bench, "time the pieces of a step against floors measured in the same run")
    bench.add_argument("parts", nargs="*", metavar="PART", help="pieces, swimmer (the usual two), large, threads, many")
    bench.add_argument("--json", action="store_true", help="as JSON")
    return parser


def _count(text: str) -> int:
    """A whole number from 0 to 9."""
    if len(text) != 1 or not text.isdecimal():
        raise argparse.ArgumentTypeError(f"found {text}; allowed: 0 to 9")
    return int(text)


def _size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and len(text) < 12):
        raise argparse.ArgumentTypeError(f"found {text}; allowed: WIDTHxHEIGHT, as 1280x960")
    return int(width), int(height)


def _seconds(text: str) -> float:
    """A time above zero."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a number of seconds above 0")
    return value


def _read(words: Sequence[str]) -> Case:
    """The case with its overrides; sets the number of threads, which libraries read once, when they load."""
    from .case import read_case
    from .shipped import find

    name, *changes = words
    _only_changes(changes)
    case = read_case(find(name), changes)
    set_threads(case.compute.threads)
    return case


def _only_changes(words: Sequence[str]) -> None:
    stray = [f"{word}: found a word; allowed: KEY=VALUE" for word in words if "=" not in word]
    if stray:
        raise CaseError(stray)


def _say_if_cold() -> None:
    """Say so where numba has yet to compile; its caches are where it looks for them itself."""
    from platformdirs import user_cache_path

    cache = os.environ.get("NUMBA_CACHE_DIR") or user_cache_path("numba", appauthor=False)
    if not any((Path(__file__).parent / "__pycache__").glob("*.nbi")) and not any(Path(cache).glob("ibfil_*/*.nbi")):
        print("compiling the numerical kernels, once: half a minute or so", file=sys.stderr, flush=True)


def _log(line: str) -> None:
    print(line, flush=True)


def _run(arguments: argparse.Namespace) -> int:
    words = arguments.words
    if arguments.resume:
        return _resume(arguments)
    if not words:
        raise CaseError(["run: found no case; allowed: CASE [KEY=VALUE ...], or --resume RUN.h5"])
    case = _read(words)
    output = Path(arguments.output or Path(words[0]).with_suffix(".h5").name)
    if not output.parent.is_dir():
        raise CaseError([f"{output}: there is no folder {output.parent}"])
    _say_if_cold()
    from .running import run

    changes = " ".join(word for word in words[1:] if not word.startswith(("output.", "compute.")))
    return _end(run(case, output, overwrite=arguments.force, log=_log), changes)


def _resume(arguments: argparse.Namespace) -> int:
    """Go on with a run; its number of threads is needed before the libraries that can read it are loaded."""
    if arguments.output or arguments.force:
        raise CaseError(["run --resume: found -o or --force; allowed: neither, it goes on in the same file"])
    words = arguments.words
    with_case = bool(words) and ("=" not in words[0] or Path(words[0]).is_file())
    case = _read(words) if with_case else None
    if case is None:
        _only_changes(words)
        set_threads(_threads_of(arguments.resume))
    _say_if_cold()
    from .running import resume_run

    return _end(resume_run(arguments.resume, case, () if with_case else words, log=_log))


def _threads_of(run: str) -> int:
    """The threads of a run's case, read by another process; 1 where it cannot be read, to fail later."""
    code = (
        "import sys, pathlib; from ibfil import case, checkpoint, record; "
        "c = checkpoint.read(record.checkpoint_path(pathlib.Path(sys.argv[1]))); "
        "print(case.parse_case(c.case, c.file).compute.threads)"
    )
    answer = subprocess.run([sys.executable, "-c", code, run], capture_output=True, text=True, check=False)
    return int(answer.stdout) if answer.returncode == 0 else 1


def _end(result: Result, changes: str = "") -> int:
    """What a run ends with: the file, how it ended, the observables, and what was expected before ``changes``."""
    from .record import RunFile
    from .show import digest, duration, results

    assert result.path is not None
    with RunFile(result.path) as run:
        told = digest(run)
    reason = f" ({told['reason']})" if told["reason"] else ""
    print(f"{told['status']}{reason}: {told['steps']} steps in {duration(told['wall_time'])}")
    print(f"{result.path}: {told['outputs']} outputs")
    print(results(told, changes))
    return DONE


def _check(arguments: argparse.Namespace) -> int:
    case = _read(arguments.words)
    from .check import report

    print(report(case))
    return DONE


def _new(arguments: argparse.Namespace) -> int:
    from . import shipped

    print(f"{arguments.name} -> {shipped.copy(arguments.name, arguments.file)}")
    return DONE


def _cases(arguments: argparse.Namespace) -> int:
    from .shipped import listing

    rows = listing()
    width = max((len(row.name) for row in rows), default=0)
    group = None
    for row in rows:
        if row.group != group:
            group = row.group
            print(f"{group}/")
        print(f"  {row.name:{width}}  {row.title}")
        print(f"  {'':{width}}    {row.source}")
    return DONE


def _schema(arguments: argparse.Namespace) -> int:
    import json

    from .case_listing import schema_json, schema_text

    if arguments.json:
        print(json.dumps(schema_json(), indent=2))
        return DONE
    from .observe import kinds_text

    print(schema_text())
    print(kinds_text())
    return DONE


def _show(arguments: argparse.Namespace) -> int:
    from . import show
    from .record import RunFile

    with RunFile(arguments.run) as run:
        told = show.digest(run)
        print(show.as_json(told) if arguments.json else show.as_text(told))
        if arguments.csv:
            show.write_csv(run, arguments.csv)
        if arguments.plot:
            from .show_figure import draw

            draw(run, arguments.plot)
    return DONE


def _vtk(arguments: argparse.Namespace) -> int:
    from .vtk import write_vtk

    more = {"wrap": arguments.wrap, "images": arguments.images, "watch": arguments.watch, "log": _log}
    path = write_vtk(arguments.run, arguments.folder, **more)
    print(f"open {path} in ParaView, or a ready scene: paraview --state={path.with_name(path.stem + '_paraview.py')}")
    alone = path.with_stem(f"{path.stem}_filaments")
    if alone.exists():
        print(f"for filters of lines, such as Tube: {alone}, without the grid")
    return DONE


def _render(arguments: argparse.Namespace) -> int:
    from .render import Wish, render

    a = arguments
    wish = Wish(a.colour, a.flow, a.montage, a.time, a.size, a.fps, a.every)
    print(render(a.run, a.output, wish, _log))
    return DONE


def _verify(arguments: argparse.Namespace) -> int:
    set_threads(1)
    _say_if_cold()
    from .verify import verify

    return verify(arguments.cases, arguments.quick, _log)


def _bench(arguments: argparse.Namespace) -> int:
    set_threads(1)
    from . import bench

    bench.main(json=arguments.json, parts=arguments.parts)
    return DONE
