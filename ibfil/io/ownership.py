"""Whose a file beside a run is: locked by a writer, left by one that died, or a user's, which is not touched."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import stat
import time
from pathlib import Path

MAGIC = b"ibfiljnl"  # the first bytes of a journal
SIGNATURE = b"\x89HDF\r\n\x1a\n"  # the first bytes of every file of HDF5
_PLAIN = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC  # no link is followed, no pipe waited for
_ATTEMPTS = 6  # to lock a journal, 20 ms apart


class Busy(Exception):
    """Another process is writing this file."""


class Stranger(Exception):
    """A file of that name is no journal, or no part of a run: the text is a sentence about it."""


def is_being_written(journal: Path) -> bool:
    """Whether a living process holds the lock."""
    try:
        handle = os.open(journal, os.O_RDONLY | _PLAIN)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    finally:
        os.close(handle)
    return False


def open_locked(journal: Path) -> int:
    """Open and lock the journal; again if its last owner removed it meanwhile, or someone looked."""
    for attempt in range(_ATTEMPTS):
        time.sleep(0.02 * min(attempt, 1))
        try:
            handle = os.open(journal, os.O_RDWR | os.O_CREAT | _PLAIN, 0o666)
        except OSError as error:
            if error.errno not in (errno.ELOOP, errno.ENXIO, errno.EISDIR):
                raise
            raise _stranger(journal, "journal") from None
        kept = False
        try:
            if _locks(handle) and os.stat(journal).st_ino == os.fstat(handle).st_ino:
                kept = _is_ours(handle, MAGIC)
                if not kept:
                    raise _stranger(journal, "journal")
                return handle
        except (BlockingIOError, FileNotFoundError):
            pass
        finally:
            if not kept:
                os.close(handle)
    raise Busy(str(journal))


def open_new(part: Path) -> int:
    """A new file of that name; one that a killed run has left there is removed before."""
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | _PLAIN
    try:
        return os.open(part, flags, 0o666)
    except FileExistsError:
        remove_part(part)
        return os.open(part, flags, 0o666)


def remove_part(part: Path) -> None:
    """Remove a part of a file of HDF5 that was never finished. Raises Stranger where it is anything else."""
    try:
        handle = os.open(part, os.O_RDONLY | _PLAIN)
    except FileNotFoundError:
        return
    except OSError:
        raise _stranger(part, "part of a run file") from None
    try:
        if not _is_ours(handle, SIGNATURE):
            raise _stranger(part, "part of a run file")
    finally:
        os.close(handle)
    part.unlink(missing_ok=True)


def _is_ours(handle: int, first: bytes) -> bool:
    """Whether it is a plain file that has these first bytes, or as many of them as it has.

    Or zeros: after a power cut a file may be as long as it was to be, and nothing in it.
    """
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        return False
    head = os.pread(handle, len(first), 0)
    return first.startswith(head) or not any(head)


def _stranger(path: Path, kind: str) -> Stranger:
    return Stranger(f"{path}: is there, and no {kind} of ibfil's: it is not touched; rename it, or the run")


def _locks(handle: int) -> bool:
    """Lock it; True also on a file system without locks. Raises BlockingIOError where another has it."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass
    return True


def release(handle: int, journal: Path) -> None:
    """Remove the journal if nothing is left to put back, then unlock it. Never raises."""
    with contextlib.suppress(OSError):
        found = os.fstat(handle)
        if found.st_size == 0 and os.stat(journal).st_ino == found.st_ino:
            journal.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        os.close(handle)
