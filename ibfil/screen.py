"""Lines to the screen.

Words of a case or a file may come from anyone: a terminal is shown its control characters, and does not obey them. No
line is worth a run: where a stream is closed, its disk is full or its letters are few, the run goes on.
"""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from typing import TextIO

# Control characters but for tabs and ends of lines, what turns the direction of writing, halves of letters.
_OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_lost: list[str] = []  # why lines could not be written to standard output; one is enough


def printable(text: str) -> str:
    r"""The text with an escape, such as \u001b, for each character that a terminal would obey or cannot show."""
    return _OBEYED.sub(lambda found: f"\\u{ord(found.group()):04x}", text)


def tell(line: object = "") -> None:
    """Print a line, or several, at once. Raises BrokenPipeError where the reader has gone, and nothing else."""
    _print(line, sys.stdout)


def warn(line: object) -> None:
    """The same to standard error."""
    _print(line, sys.stderr)


def lost() -> str:
    """Why lines to standard output were lost; "" where none were."""
    return _lost[0] if _lost else ""


def on_terminal() -> bool:
    """Whether standard error is a terminal."""
    try:
        return sys.stderr is not None and sys.stderr.isatty()
    except ValueError:  # closed
        return False


def in_notebook() -> bool:
    """Whether cells of a notebook show what is printed."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


def prepare() -> None:
    """Have a process begin with three open streams that take every letter.

    A stream that was closed by whoever began it would lend its number to the next file that is opened, and libraries
    that write to standard error would write into that.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 (it stays open)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def let_go() -> None:
    """Have nothing more come of standard output: what Python still holds for it must not raise again at exit."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _print(line: object, stream: TextIO | None) -> None:
    if stream is None:
        return
    text = printable(str(line))
    try:
        try:
            print(text, file=stream, flush=True)
        except UnicodeEncodeError:
            print(text.encode("ascii", "backslashreplace").decode(), file=stream, flush=True)
    except BrokenPipeError:
        raise
    except (OSError, ValueError) as error:  # a full disk, a terminal that is gone; a stream that was closed
        if stream is sys.stdout:
            _lost.append(getattr(error, "strerror", None) or str(error))
            let_go()
