"""Files that may be written over: those that ibfil wrote, of the same kind, and where that was asked for; no others.

A file is written under a name of its own beside its place, and takes the place when it is whole.
"""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from ..errors import RunFileError
from .checkpoint import FORMAT as CHECKPOINT_FORMAT
from .opening import FORMAT, open_hdf5
from .ownership import SIGNATURE
from .paths import checkpoint_path

_HEAD = 2**20  # bytes that say what a file is


class Kind(NamedTuple):
    """A kind of file: words for it; whether a file, with these first bytes, is one; whether a pipe may stand for it."""

    words: str
    fits: Callable[[Path, bytes], bool]
    flows: bool = False


def _format(path: Path) -> str:
    """The format that an HDF5 file names; "" where it names none, or nothing can be read."""
    with suppress(OSError, RuntimeError, KeyError, ValueError, TypeError, RunFileError):
        opened = open_hdf5(path)
        try:
            return str(opened.h5.attrs.get("format", ""))
        finally:
            opened.close()
    return ""


def _is_run(path: Path, head: bytes) -> bool:
    """A run file; one that is damaged shows it by a word, or by its checkpoint."""
    if not head.startswith(SIGNATURE):
        return False
    found = _format(path)
    if found or not checkpoint_path(path).is_file():
        return found == FORMAT or (not found and FORMAT.encode() in head)
    return _format(checkpoint_path(path)) == CHECKPOINT_FORMAT


def _begins(*starts: bytes) -> Callable[[Path, bytes], bool]:
    return lambda path, head: head.startswith(starts)


RUN = Kind("a run file of ibfil", _is_run)
CHECKPOINT = Kind("a checkpoint of ibfil", lambda path, head: _format(path) == CHECKPOINT_FORMAT)
VTK = Kind("a file of VTK", lambda path, head: b"<VTKFile" in head[:256])
BY_ENDING = {
    ".png": Kind("a picture", _begins(b"\x89PNG\r\n\x1a\n")),
    ".pdf": Kind("a PDF", _begins(b"%PDF-")),
    ".svg": Kind("an SVG", lambda path, head: b"<svg" in head[:4096]),
    ".gif": Kind("a gif", _begins(b"GIF8")),
    ".mp4": Kind("a film", lambda path, head: head[4:8] == b"ftyp"),
}


def table_of(first: str) -> Kind:
    """Tables whose first column has this name."""
    name = first.encode()
    return Kind(
        "a table of ibfil's", lambda path, head: head.startswith((name + b",", name + b" (", name + b"\r")), True
    )


def refuse(path: Path, kind: Kind, force: bool, reads: Iterable[Path] = ()) -> None:
    """Raise RunFileError where ``path`` may not be written over by a file of that kind.

    ``force`` says that this was asked for; ``reads`` are files that the command reads. An empty file may be written
    over, and for a table what takes bytes and keeps none: a pipe, a terminal.
    """
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        raise RunFileError(f"{path}: cannot be written ({error.strerror})") from None
    if stat.S_ISDIR(found.st_mode):
        raise RunFileError(f"{path}: is a folder")
    if not stat.S_ISREG(found.st_mode):
        if kind.flows:
            return
        raise RunFileError(f"{path}: is not a file")
    if found.st_size == 0:
        return
    if any(other.exists() and path.samefile(other) for other in reads):
        raise RunFileError(f"{path}: is read for this, and not written over; choose another name")
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if not kind.fits(path, head):
        raise RunFileError(f"{path}: is there, and not {kind.words}: it is not replaced; choose another name")
    if not force:
        raise RunFileError(f"{path}: exists already; overwrite=True writes over it")
    if not os.access(path, os.W_OK):
        raise RunFileError(f"{path}: cannot be written (Permission denied)")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name to write to within the ``with``; the file takes the place of ``path`` at its end, if that came.

    A link is followed. Raises OSError, with the name of ``path``, where it cannot be written.
    """
    place = Path(os.path.realpath(path))
    part = place.with_name(f"{place.stem}.part{os.getpid()}_{threading.get_ident()}{place.suffix}")
    if place.exists() and not place.is_file():  # a terminal, a pipe
        yield place
        return
    try:
        os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        try:
            yield part
            os.replace(part, place)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        if error.filename is not None and Path(error.filename) not in (part, place):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
