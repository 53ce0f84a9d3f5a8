"""The user's cache: what takes time to find and may be found again by anyone. Losing it costs time and nothing else."""

from __future__ import annotations

import fcntl
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_PATIENCE = 60.0  # seconds for another process to find what it is looking for


def folder() -> Path:
    """Where the cache of this user is; it need not exist, nor be one that can be made."""
    from platformdirs import user_cache_path

    try:
        return user_cache_path("ibfil")
    except (RuntimeError, KeyError):  # a user without a home
        return Path(os.devnull) / "ibfil"


def keep(path: Path, text: str) -> bool:
    """Write a file of the cache, whole or not at all; whether it is there. That it cannot be is no fault."""
    part = path.with_suffix(f".{os.getpid()}_{threading.get_ident()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text)
        os.replace(part, path)
    except OSError:
        with suppress(OSError):
            part.unlink()
        return False
    return True


@contextmanager
def alone(path: Path) -> Iterator[bool]:
    """Within it no other process looks for what a file of the cache is to hold; False where it cannot be kept."""
    handle = -1
    try:
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        yield handle >= 0 and _locked(handle)
    finally:
        if handle >= 0:
            os.close(handle)


def _locked(handle: int) -> bool:
    """Lock it, when whoever has it is done; False where that takes too long. True on a file system without locks."""
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > end:
                return False
            time.sleep(0.05)
        except OSError:
            return True
        else:
            return True
