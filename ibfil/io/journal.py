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

A new file is made as FILE.part, and takes its place at its first commit: what stands there until then is left alone,
and a run that is killed before leaves nothing in the way of the next. Where the file has been removed since, `commit`
writes it again from the bytes that are still held open; where another has taken its place it raises OSError.

Names beside a run may be a user's: a journal or a part that is a link, or has not the first bytes of ours, is a
`Stranger` and not touched.
"""

from __future__ import annotations

import contextlib
import errno
import os
import struct
import zlib
from pathlib import Path

from .disk import read_all, sync_folder, write_all
from .ownership import MAGIC, Busy, Stranger, is_being_written, open_locked, open_new, release
from .paths import part_path

PAGE = 4096
_BLOCK = 2**24  # bytes copied at once
_HEADER = struct.Struct("<8sQQI")  # magic, committed size, number of pages, crc32 of what follows


class JournaledFile:
    """A file for h5py (seek, tell, readinto, write, truncate, flush), and `commit`.

    The file is first put back to its last commit; ``recovered`` says whether that was needed. With ``create`` it is a
    new one, which takes the place of what is there when it is first committed. ``written_again`` counts how often it
    had to be because it was gone. Raises Busy, Stranger, and OSError where the file or its journal cannot be opened.
    """

    def __init__(self, path: Path, journal: Path, create: bool = False) -> None:
        self.path, self.journal = path, journal
        self.error: OSError | None = None
        self.written_again = 0
        self._part = part_path(Path(os.path.realpath(path))) if create else None  # until the first commit
        self._lock = open_locked(journal)
        try:
            self.recovered = _put_right(path, self._lock) if path.exists() else _emptied(self._lock)
            self._file = os.open(path, os.O_RDWR | os.O_CLOEXEC) if self._part is None else open_new(self._part)
        except BaseException:
            release(self._lock, journal)
            raise
        self._size = self._end = os.fstat(self._file).st_size  # at the last commit; now
        self._pages: dict[int, bytearray] = {}  # changed since, below _size
        self._at = 0

    @property
    def begun(self) -> bool:
        """Whether it stands in its place."""
        return self._part is None

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
        try:
            data = os.pread(self._file, max(0, min(len(view), self._end - start)), start)
        except OSError as error:  # HDF5 will say no more than that something went wrong
            self.error = self.error or error
            raise
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
                held = self._pages[page] = bytearray(self._committed(page))
            count = min(below - done, len(held) - offset)
            held[offset : offset + count] = view[done : done + count]
            done += count
        write_all(self._file, view[below:], start + below)

    def _committed(self, page: int) -> bytes:
        """A page as at the last commit. Raises OSError where another program has cut the file short since."""
        length = min(PAGE, self._size - page * PAGE)
        found = read_all(self._file, page * PAGE, length)
        if len(found) < length:
            raise OSError(errno.EIO, "it was cut short by another program while it was being written")
        return found

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
            with contextlib.suppress(OSError):  # of a disk that stays bad; the journal is there for who comes next
                if not _put_back(self._file, self._lock):
                    os.ftruncate(self._file, self._size)
            raise self.error
        self._pages.clear()
        self._size = self._end

    def _apply(self, pages: list[int]) -> None:
        if self._part is None:
            self._look()
        body = bytearray()
        for page in pages:
            body += page.to_bytes(8, "little")
            body += self._committed(page).ljust(PAGE, b"\0")
        head = _HEADER.pack(MAGIC, self._size, len(pages), zlib.crc32(body))
        write_all(self._lock, memoryview(head + body), 0)
        os.fsync(self._lock)
        for page, held in self._pages.items():
            write_all(self._file, memoryview(held), page * PAGE)
        os.ftruncate(self._file, self._end)
        os.fsync(self._file)
        if self._part is not None:
            os.replace(self._part, os.path.realpath(self.path))
            self._part = None
            sync_folder(self.path.parent)
        os.ftruncate(self._lock, 0)
        with contextlib.suppress(OSError):  # the commit is made; this only keeps a power cut from undoing it
            os.fsync(self._lock)

    def _look(self) -> None:
        """Write the file again where it was removed; OSError where another one is in its place."""
        held = os.fstat(self._file)
        try:
            there = os.stat(self.path)
        except FileNotFoundError:
            self._write_again()
            return
        if (there.st_dev, there.st_ino) != (held.st_dev, held.st_ino):
            raise OSError(errno.ESTALE, "another file was put in its place while it was being written")

    def _write_again(self) -> None:
        """The committed bytes, which this process still holds open, under the file's name; its journal likewise."""
        part = part_path(Path(os.path.realpath(self.path)))
        copy = open_new(part)
        try:
            for start in range(0, self._size, _BLOCK):
                length = min(_BLOCK, self._size - start)
                write_all(copy, memoryview(read_all(self._file, start, length)), start)
            os.fsync(copy)
            os.replace(part, os.path.realpath(self.path))
            sync_folder(self.path.parent)
            write_all(copy, memoryview(read_all(self._file, self._size, self._end - self._size)), self._size)
            os.dup2(copy, self._file, inheritable=False)
        finally:
            os.close(copy)
            part.unlink(missing_ok=True)
        if not self.journal.exists():
            lock, self._lock = self._lock, open_locked(self.journal)
            os.close(lock)
        self.written_again += 1

    def close(self) -> None:
        """Let go of the file and the lock; changes that were not committed are lost. Twice is once. Never raises."""
        if self._file < 0:
            return
        file, self._file = self._file, -1
        with contextlib.suppress(OSError):
            if self._part is not None:
                self._part.unlink(missing_ok=True)
            elif self._end > self._size or self._pages:
                os.ftruncate(file, self._size)
        with contextlib.suppress(OSError):
            os.close(file)
        release(self._lock, self.journal)


def recover(path: Path, journal: Path) -> bool:
    """Put a file back to its last commit if a dead writer left it between two; True where that was needed.

    A living writer is left alone (False). Raises OSError where the file may not be written.
    """
    try:
        if os.lstat(journal).st_size == 0 or is_being_written(journal):
            return False
        file = JournaledFile(path, journal)
    except (FileNotFoundError, Busy, Stranger):
        return False
    file.close()
    return file.recovered


def _put_right(path: Path, journal: int) -> bool:
    """Put a file back to its last commit; whether that was needed."""
    if os.fstat(journal).st_size == 0:
        return False
    file = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    try:
        return _put_back(file, journal)
    finally:
        os.close(file)


def _emptied(journal: int) -> bool:
    """Empty the journal of a file that is gone."""
    os.ftruncate(journal, 0)
    return False


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
        claimed = count * (8 + PAGE)
        if magic == MAGIC and _HEADER.size + claimed <= os.fstat(journal).st_size:
            body = read_all(journal, _HEADER.size, claimed)
            whole = zlib.crc32(body) == crc
    if whole:
        for start in range(0, len(body), 8 + PAGE):
            page = int.from_bytes(body[start : start + 8], "little")
            length = min(PAGE, size - page * PAGE)
            write_all(file, memoryview(body)[start + 8 : start + 8 + length], page * PAGE)
        os.ftruncate(file, size)
        os.fsync(file)
    os.ftruncate(journal, 0)
    os.fsync(journal)
    return whole
