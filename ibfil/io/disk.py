"""Bytes to and from the disk, all that were asked for; names in a folder; what to do where it fails."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from ..errors import RunFailed

NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_ADVICE = {
    errno.EIO: "its disk reports errors: look at it, copy the run and its checkpoint to another one, and go on there",
    errno.ENOENT: "leave the run file and its folder where they are while it runs",
    errno.ESTALE: "leave the run file and its folder where they are while it runs",
    errno.EROFS: "have its disk writable again",
    **dict.fromkeys(NO_ROOM, "free some space"),
}


def failed_write(path: Path, error: OSError, begun: bool = True) -> RunFailed:
    """The failure of a run whose file could not be written; ``begun``: there is something in it."""
    advice = "free some space, or write elsewhere with -o; nothing was written"
    if begun:
        advice = f"{_ADVICE.get(error.errno or 0, 'have it writable again')}; what was written before is whole"
    return RunFailed(f"{path} cannot be written ({error.strerror or error})", advice=advice)


def read_all(handle: int, start: int, size: int) -> bytes:
    """``size`` bytes from ``start``, fewer only at the end of the file (one pread stops at 2 GiB)."""
    parts, done = [], 0
    while done < size:
        part = os.pread(handle, size - done, start + done)
        if not part:
            break
        parts.append(part)
        done += len(part)
    return b"".join(parts)


def sync_folder(folder: Path) -> None:
    """Have the names in a folder on the disk."""
    handle = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_all(handle: int, view: memoryview, start: int) -> None:
    """All of ``view`` (one pwrite may take a part only, as on a disk that fills up)."""
    done = 0
    while done < len(view):
        done += os.pwrite(handle, view[done:], start + done)
