"""The common part of the commands: kinds of arguments, the case that words name, lines to the screen."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CaseError
from ..screen import warn
from ..threads import set_threads

if TYPE_CHECKING:
    from ..case.schema import Case

DONE, FAILED, BAD_INPUT, CUT = 0, 1, 2, 130  # exit statuses
CHANGES = (
    "KEY=VALUE overrides one key of the case, by its dotted path: fluid.model=rft, stop.0.below=1e-3; "
    "KEY=absent takes it out"
)


# --- kinds of arguments -----------------------------------------------------------------------------------------------


def digit(text: str) -> int:
    """A whole number from 0 to 9."""
    if len(text) != 1 or not text.isdecimal():
        raise argparse.ArgumentTypeError(f"found {text}; allowed: 0 to 9")
    return int(text)


def count(text: str) -> int:
    """A whole number from 1 to 4096."""
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a whole number from 1 to 4096")
    return int(text)


def port(text: str) -> int:
    """A port that needs no rights, or 0."""
    if not text.isascii() or not text.isdigit() or not (int(text) == 0 or 1024 <= int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"found {text}; allowed: 1024 to 65535, or 0 for one that is free")
    return int(text)


def positive(text: str) -> float:
    """A number above zero."""
    value = _number(text)
    if value is None:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a number above 0")
    return value


def seconds(text: str) -> float:
    """A time above zero, in seconds."""
    value = _number(text)
    if value is None or value >= 1e6:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a number of seconds above 0")
    return value


def duration(text: str) -> float:
    """Seconds of 90s, 10m, 2h."""
    scale = {"s": 1.0, "m": 60.0, "h": 3600.0}.get(text[-1:])
    value = _number(text[:-1] if scale else text)
    if value is None:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: a time such as 90s, 10m or 2h")
    return value * (scale or 1.0)


def pixels(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and len(text) < 12):
        raise argparse.ArgumentTypeError(f"found {text}; allowed: WIDTHxHEIGHT, as 1280x960")
    return int(width), int(height)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0 < value < 1e12 else None


# --- the case that words name -----------------------------------------------------------------------------------------


def add_case(command: argparse.ArgumentParser, nargs: str = "+") -> None:
    """Add CASE [KEY=VALUE ...] to a command."""
    command.epilog = CHANGES
    command.add_argument("words", nargs=nargs, metavar="CASE [KEY=VALUE ...]", help="the case, and changes to it")


def read_case(words: Sequence[str]) -> Case:
    """The case with its overrides; sets the number of threads, which libraries read once, when they load."""
    from ..case.reading import read_case

    name, *changes = words
    only_changes(changes)
    case = read_case(name, changes)
    set_threads(case.compute.threads)
    return case


def only_changes(words: Sequence[str]) -> None:
    """Raises CaseError for words that are no KEY=VALUE."""
    stray = [f"{word}: found a word; allowed: KEY=VALUE" for word in words if "=" not in word]
    if stray:
        raise CaseError(stray)


# --- lines to the screen ----------------------------------------------------------------------------------------------


def say_if_cold() -> None:
    """Say so where numba has yet to compile: it keeps kernels beside their files, or under a hash of the path."""
    import hashlib

    from platformdirs import user_cache_path

    package = Path(__file__).parents[1] / "rods"
    cache = Path(os.environ.get("NUMBA_CACHE_DIR") or user_cache_path("numba", appauthor=False))
    elsewhere = cache / f"{package.name}_{hashlib.sha1(str(package).encode()).hexdigest()}"
    if not any((package / "__pycache__").glob("*.nbi")) and not any(elsewhere.glob("*.nbi")):
        warn("compiling the numerical kernels, once: ten seconds to half a minute")
