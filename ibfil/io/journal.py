"""A file whose changes reach the disk all together or not at all.

HDF5 changes its file in many places for one append. A process killed, a power cut or a full disk between two
of them leaves a file that nothing can open. h5py can write through a Python object, so run files go through
`JournaledFile`:

    writes beyond the committed end   go to the disk at once: no reader looks there yet;
    writes below it                   are held in memory until `commit`, which
                                      1. saves the bytes they will cover in RUN.journal,
                                      2. makes them,  3. empties the journal.

Whoever opens the file next and finds a journal that is not empty puts the saved bytes back: the file is then
as at its last commit. The journal is locked while a writer lives, so that two runs never write one file. HDF5
is never told of a write that failed (it cannot take that without crashing): the failure is kept, everything
later is dropped, and `commit` raises it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import struct
import time
import zlib
from pathlib import Path

PAGE = 4096
_ATTEMPTS = 6  # to lock a journal, 20 ms apart
_HEADER = struct.Struct("<8sQQI")  # magic, committed size, number of pages, crc32 of what follows
_MAGIC = b"ibfiljnl"


class Busy(Exception):
    """Another process is writing this file."""


class JournaledFile:
    """A file for h5py (seek, tell, readinto, write, truncate, flush), and `commit`.

    The file is first put back to its last commit; ``recovered`` says whether that was needed. With ``create``
    it need not be there. Raises Busy, and OSError where the file or its journal cannot be opened.
    """

    def __init__(self, path: Path, journal: Path, create: bool = False) -> None:
        self.path, self.journal = path, journal
        self.error: OSError | None = None
        self._lock = _open_locked(journal)
        try:
            self._file = os.open(path, os.O_RDWR | (os.O_CREAT if create else 0), 0o666)
        except OSError:
            _release(self._lock, journal)
            raise
        self.recovered = _put_back(self._file, self._lock)
        self._size = self._end = os.fstat(self._file).st_size  # at the last commit; now
        self._pages: dict[int, bytearray] = {}  # changed since, below _size
        self._at = 0

    def clear(self) -> None:
        """Empty the file, at once and for good."""
        os.ftruncate(self._file, 0)
        self._size = self._end = 0
        self._pages.clear()

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """As of any file."""
        self._at = offset + (0, self._at, self._end)[whence]
        return self._at

    def tell(self) -> int:
        """As of any file."""
        return self._at

    def read(self, size: int) -> bytes:
        """As of any file; h5py asks for its presence."""
        data = bytearray(size)
        self.readinto(data)
        return bytes(data)

    def readinto(self, buffer: bytearray | memoryview) -> int:
        """Fill ``buffer`` with the file as it will be after `commit`; zeros beyond the end."""
        view, start = memoryview(buffer).cast("B"), self._at
        data = os.pread(self._file, max(0, min(len(view), self._end - start)), start)
        view[: len(data)] = data
        view[len(data) :] = bytes(len(view) - len(data))
        for page in range(start // PAGE, (start + len(view) - 1) // PAGE + 1):
            held = self._pages.get(page)
            if held is not None:
                begin, end = max(start, page * PAGE), min(start + len(view), page * PAGE + len(held))
                if begin < end:
                    view[begin - start : end - start] = held[begin - page * PAGE : end - page * PAGE]
        self._at += len(view)
        return len(view)

    def write(self, data: bytes | memoryview) -> int:
        """Hold what lies below the committed end, write the rest at once. Never raises: see `commit`."""
        view = memoryview(data).cast("B")
        if self.error is None:
            try:
                self._write(view, self._at)
            except OSError as error:
                self.error = error
        self._at += len(view)
        self._end = max(self._end, self._at)
        return len(view)

    def _write(self, view: memoryview, start: int) -> None:
        below = max(0, min(len(view), self._size - start))
        done = 0
        while done < below:
            page, offset = divmod(start + done, PAGE)
            held = self._pages.get(page)
            if held is None:
                length = min(PAGE, self._size - page * PAGE)
                held = self._pages[page] = bytearray(_read_all(self._file, page * PAGE, length))
            count = min(below - done, len(held) - offset)
            held[offset : offset + count] = view[done : done + count]
            done += count
        _write_all(self._file, view[below:], start + below)

    def truncate(self, size: int) -> int:
        """Set the length, from the next commit on where it is below the committed one."""
        self._end = size
        if self.error is None and size >= self._size:
            try:
                os.ftruncate(self._file, size)
            except OSError as error:
                self.error = error
        return size

    def flush(self) -> None:
        """Nothing: `commit` alone makes changes visible."""

    def commit(self) -> None:
        """Make all changes since the last commit, and have them on the disk on return.

        Raises OSError, and then the file is as at the last commit and takes no more changes.
        """
        if self.error is None:
            cut = range(self._end // PAGE, -(-self._size // PAGE)) if self._end < self._size else ()
            pages = sorted(self._pages.keys() | set(cut))
            try:
                self._apply(pages)
            except OSError as error:
                self.error = error
        if self.error is not None:
            self._pages.clear()
            if not _put_back(self._file, self._lock):
                os.ftruncate(self._file, self._size)
            raise self.error
        self._pages.clear()
        self._size = self._end

    def _apply(self, pages: list[int]) -> None:
        body = bytearray()
        for page in pages:
            body += page.to_bytes(8, "little")
            body += _read_all(self._file, page * PAGE, min(PAGE, self._size - page * PAGE)).ljust(PAGE, b"\0")
        head = _HEADER.pack(_MAGIC, self._size, len(pages), zlib.crc32(body))
        _write_all(self._lock, memoryview(head + body), 0)
        os.fsync(self._lock)
        for page, held in self._pages.items():
            _write_all(self._file, memoryview(held), page * PAGE)
        os.ftruncate(self._file, self._end)
        os.fsync(self._file)
        os.ftruncate(self._lock, 0)
        with contextlib.suppress(OSError):  # the commit is made; this only keeps a power cut from undoing it
            os.fsync(self._lock)

    def close(self) -> None:
        """Let go of the file and the lock; changes that were not committed are lost. Twice is once."""
        if self._file < 0:
            return
        if self._end > self._size or self._pages:
            os.ftruncate(self._file, self._size)
        os.close(self._file)
        self._file = -1
        _release(self._lock, self.journal)


def recover(path: Path, journal: Path) -> bool:
    """Put a file back to its last commit if a dead writer left it between two; True where that was needed.

    A living writer is left alone (False). Raises OSError where the file may not be written.
    """
    if not journal.exists() or journal.stat().st_size == 0 or is_being_written(journal):
        return False
    try:
        file = JournaledFile(path, journal)
    except Busy:
        return False
    file.close()
    return file.recovered


def is_being_written(journal: Path) -> bool:
    """Whether a living process holds the lock."""
    try:
        handle = os.open(journal, os.O_RDONLY)
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


def _open_locked(journal: Path) -> int:
    """Open and lock the journal; again if its last owner removed it meanwhile, or someone looked."""
    for attempt in range(_ATTEMPTS):
        time.sleep(0.02 * min(attempt, 1))
        handle = os.open(journal, os.O_RDWR | os.O_CREAT, 0o666)
        with contextlib.suppress(BlockingIOError, FileNotFoundError):
            if _locks(handle) and os.stat(journal).st_ino == os.fstat(handle).st_ino:
                return handle
        os.close(handle)
    raise Busy(str(journal))


def _locks(handle: int) -> bool:
    """Lock it; True also on a file system without locks. Raises BlockingIOError where another has it."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass
    return True


def _release(handle: int, journal: Path) -> None:
    """Remove the journal if nothing is left to put back, then unlock it."""
    if os.fstat(handle).st_size == 0:
        journal.unlink(missing_ok=True)
    os.close(handle)


def _put_back(file: int, journal: int) -> bool:
    """Write the saved pages back, cut the file to its old size, empty the journal; False where it was empty.

    A journal that is not whole was cut before the first change was made, so it is only emptied.
    """
    head = os.pread(journal, _HEADER.size, 0)
    if not head:
        return False
    whole = False
    if len(head) == _HEADER.size:
        magic, size, count, crc = _HEADER.unpack(head)
        body = _read_all(journal, _HEADER.size, count * (8 + PAGE)) if magic == _MAGIC else b""
        whole = magic == _MAGIC and len(body) == count * (8 + PAGE) and zlib.crc32(body) == crc
    if whole:
        for start in range(0, len(body), 8 + PAGE):
            page = int.from_bytes(body[start : start + 8], "little")
            length = min(PAGE, size - page * PAGE)
            _write_all(file, memoryview(body)[start + 8 : start + 8 + length], page * PAGE)
        os.ftruncate(file, size)
        os.fsync(file)
    os.ftruncate(journal, 0)
    os.fsync(journal)
    return whole


def _read_all(handle: int, start: int, size: int) -> bytes:
    """``size`` bytes from ``start``, fewer only at the end of the file (one pread stops at 2 GiB)."""
    parts, done = [], 0
    while done < size:
        part = os.pread(handle, size - done, start + done)
        if not part:
            break
        parts.append(part)
        done += len(part)
    return b"".join(parts)


def _write_all(handle: int, view: memoryview, start: int) -> None:
    """All of ``view`` (one pwrite may take a part only, as on a disk that fills up)."""
    done = 0
    while done < len(view):
        done += os.pwrite(handle, view[done:], start + done)
