"""The user's cache: what takes time to find and may be found again by anyone. Losing it costs time and nothing else."""

from __future__ import annotations

import fcntl
import hashlib
import io
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

    The key must name all that the array depends on, the code that makes it too (`code`). What is kept says its key and
    its checksum: a file that is damaged, or of another key, is made again.
    """
    text = json.dumps(dict(key), sort_keys=True)
    path = folder() / "tables" / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.table"
    known = _read_table(path, text)
    if known is not None:
        return known
    made = make()
    body = _as_npy(made)
    content = _head(text, body) + body
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


def _head(text: str, body: bytes) -> bytes:
    """The line before an array: its key and its checksum."""
    return f"{text} {zlib.crc32(body):08x}\n".encode()


def _as_npy(array: np.ndarray) -> bytes:
    import numpy as np

    out = io.BytesIO()
    np.save(out, array, allow_pickle=False)
    return out.getvalue()


def _read_table(path: Path, text: str) -> np.ndarray | None:
    """The array that is kept; None where there is none, or it is not whole."""
    import numpy as np

    try:
        if not path.is_file() or path.stat().st_size > TABLES:
            return None
        head, _, body = path.read_bytes().partition(b"\n")
        if head + b"\n" != _head(text, body):
            return None
        array: np.ndarray = np.load(io.BytesIO(body), allow_pickle=False)
    except (OSError, ValueError):
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
