"""A file of a run opened for reading: put right where its writer died, looked over, and of a format that is known."""

from __future__ import annotations

import io
import os
import re
import stat
import time as clock
from pathlib import Path
from shlex import quote
from typing import NamedTuple

import h5py

from ..errors import RunFileError
from . import journal
from .ownership import SIGNATURE, is_being_written
from .paths import checkpoint_path, journal_path
from .vetting import look_over

FORMAT = "ibfil-run"
FORMAT_VERSION = 1
_HEAD = 65536  # bytes that say what a file is
_LOOKS = 10  # at a file that is being written, 50 ms apart, until it is whole


class Bytes(io.FileIO):
    """The bytes of a file, for h5py. Ends in OSError where another program has cut the file short meanwhile.

    Read like this, and not by HDF5 itself, a file may be open more than once in a process, in `h5py.File` too: HDF5
    has each file once, and wants it opened alike each time.
    """

    def __init__(self, path: Path) -> None:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)  # a pipe would be waited for
        super().__init__(handle, "rb")
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            self.close()
            raise RunFileError(f"{path}: is not a file")

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        """Fill all of ``buffer`` (one read stops at 2 GiB)."""
        view, done = memoryview(buffer).cast("B"), 0
        while done < len(view):
            count = super().readinto(view[done:])
            if not count:
                raise OSError(f"cut short at byte {self.tell()}")
            done += count
        return done


class Opened(NamedTuple):
    """An open file of HDF5, and the bytes that it is read from."""

    h5: h5py.File
    bytes: Bytes

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return os.fstat(self.bytes.fileno()).st_size

    def close(self) -> None:
        """Close it."""
        self.h5.close()
        self.bytes.close()


def open_hdf5(path: Path) -> Opened:
    """Open a file of HDF5. Raises OSError where it is none, or damaged, and RunFileError for a pipe."""
    source = Bytes(path)
    try:
        return Opened(h5py.File(source, "r"), source)
    except BaseException:
        source.close()
        raise


def open_run_file(path: Path) -> tuple[Opened, dict[str, int]]:
    """A run file, and the rows of its datasets by name. Bytes that a killed writer left are put right before.

    Raises RunFileError, with one line, for what is not there, is no run file, is of another format or is damaged, or
    has in it what no run file has.
    """
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    for look in range(1, _LOOKS + 1):
        try:
            journal.recover(path, journal_path(path))
            return _looked_over(open_hdf5(path), path)
        except PermissionError as error:
            raise RunFileError(f"{path}: cannot be read ({error.strerror})") from None
        except (OSError, RuntimeError, KeyError, ValueError, TypeError, RunFileError) as error:  # HDF5, on torn bytes
            if look == _LOOKS or not is_being_written(journal_path(path)):
                raise (error if isinstance(error, RunFileError) else _no_run(path)) from None
            clock.sleep(0.05)
    raise AssertionError


def _looked_over(opened: Opened, path: Path) -> tuple[Opened, dict[str, int]]:
    """The same, and its rows; closed where it is no run file that can be read."""
    try:
        attributes = opened.h5.attrs
        if str(attributes.get("format", "")) != FORMAT:
            raise RunFileError(f"{path}: is an HDF5 file, but not a run file of ibfil")
        version = int(attributes["format_version"])
        if version != FORMAT_VERSION:
            raise RunFileError(f"{path}: {other_format(version, str(attributes['ibfil_version']))}")
        return opened, look_over(opened.h5, path, opened.size)
    except BaseException:
        opened.close()
        raise


def _no_run(path: Path) -> RunFileError:
    """The error for a file that HDF5 cannot open."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head.startswith(SIGNATURE) or checkpoint_path(path).exists():
        return RunFileError(damaged(path))
    found = "is not a run file of ibfil"
    if re.search(rb"^\s*\[(fluid|time|output|filament\.[^\n]*)\]", head, re.MULTILINE):
        found = f"is a case, not a run file; `ibfil run {quote(str(path))}` makes one of it"
    return RunFileError(f"{path}: {found}")


def other_format(version: int, written_by: str) -> str:
    """The error for a file of another format version."""
    if version > FORMAT_VERSION:
        remedy = f"read it with ibfil {written_by} or later (pip install -U ibfil)"
    else:
        remedy = f"read it with ibfil {written_by}, or run its case again (it is in the attribute `case`)"
    return f"has format {version}, written by ibfil {written_by}; this ibfil reads format {FORMAT_VERSION}: {remedy}"


def damaged(path: Path) -> str:
    """The error for a file that cannot be read."""
    line = f"{path}: is damaged or cut short"
    if checkpoint_path(path).exists():
        line += f"; `ibfil run --resume {quote(str(path))}` rebuilds it"
    return line
