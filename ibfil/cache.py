"""The user's cache: what takes time to find and may be found again by anyone. Losing it costs time and nothing else."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import threading
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

_PATIENCE = 60.0  # seconds for another process to find what it is looking for
TABLES = 256 * 2**20  # bytes of tables, of which those not used for longest go first


def folder() -> Path:
    """Where the cache of this user is; it need not exist, nor be one that can be made."""
    from platformdirs import user_cache_path

    try:
        return user_cache_path("ibfil")
    except (RuntimeError, KeyError):  # a user without a home
        return Path(os.devnull) / "ibfil"


def keep(path: Path, content: str | bytes) -> bool:
    """Write a file of the cache, whole or not at all; whether it is there. That it cannot be is no fault."""
    part = path.with_suffix(f".{os.getpid()}_{threading.get_ident()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content.encode() if isinstance(content, str) else content)
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


def table(key: Mapping[str, object], make: Callable[[], np.ndarray]) -> np.ndarray:
    """The array of that ``key`` (values as of JSON): as it is kept, or made and then kept. The bits are the same.

    The key must name all that the array depends on, the code that makes it too (`code`). A file says its key and its
    checksum: one that is damaged, or of another key, is made again. It holds bare numbers: nothing in it can run.
    """
    text = json.dumps(dict(key), sort_keys=True)
    path = folder() / "tables" / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.table"
    known = _read_table(path, text)
    if known is not None:
        return known
    made = make()
    content = _packed(text, made)
    if len(content) <= TABLES // 4 and keep(path, content):
        _bound(path.parent)
    return made


def code(*folders: Path) -> str:
    """A hash of the source files in folders: what a table that they make depends on; "" where they cannot be read."""
    found = hashlib.sha256()
    try:
        for path in sorted(path for place in folders for path in place.glob("*.py")):
            found.update(path.read_bytes())
    except OSError:
        return ""
    return found.hexdigest()[:16]


def _packed(text: str, array: np.ndarray) -> bytes:
    """A file: a line with the checksum of all that follows; the key, the kind of number and the shape; the numbers."""
    rest = f"{text}\n{array.dtype.str} {json.dumps(array.shape)}\n".encode() + array.tobytes()
    return f"{zlib.crc32(rest):08x}\n".encode() + rest


def _read_table(path: Path, text: str) -> np.ndarray | None:
    """The array that is kept; None where there is none, or it is not whole."""
    import numpy as np

    try:
        if not path.is_file() or path.stat().st_size > TABLES:
            return None
        checksum, _, rest = path.read_bytes().partition(b"\n")
        if checksum != f"{zlib.crc32(rest):08x}".encode():
            return None
        key, kind, numbers = rest.split(b"\n", 2)
        if key != text.encode():
            return None
        number, shape = kind.decode().split(" ", 1)
        array: np.ndarray = np.frombuffer(numbers, number).reshape(json.loads(shape)).copy()
    except (OSError, ValueError, TypeError):
        return None
    with suppress(OSError):
        os.utime(path)  # used now
    return array


def _bound(place: Path) -> None:
    """Remove the tables, and parts of writers that were killed, that were not used for longest."""
    with suppress(OSError):
        files = sorted(((entry.stat(), entry) for entry in place.iterdir()), key=lambda found: -found[0].st_mtime)
        total = 0
        for state, path in files:
            total += state.st_size
            if total > TABLES:
                path.unlink(missing_ok=True)
