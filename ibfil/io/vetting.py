"""A file of HDF5 looked over before anything in it is followed or read: it may come from anyone.

HDF5 can point elsewhere: a link or a dataset may name another file, which a reader would open, or wait for. It can
claim more than it holds: terabytes of fill values, or one block of bytes under a million names. Files of ibfil do
neither, so either is refused by its name, before memory is taken.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import h5py

from ..errors import RunFileError

FLOATS = "f"  # the numbers of a run file, by the letters of NumPy's kinds
_DEFLATE = 1100  # times that its compression may shorten at the most
_FILTERS = {h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32}
_DEEPEST = 3  # names in a row: filaments/NAME/position
_LINKS = {h5py.h5l.TYPE_SOFT: "a soft link", h5py.h5l.TYPE_EXTERNAL: "a link to another file"}


def look_over(file: h5py.File, path: Path, size: int, kinds: str = FLOATS) -> dict[str, int]:
    """The rows of every dataset, by name, of a file of ``size`` bytes, once nothing in it points out of it.

    ``kinds`` are those of the numbers that datasets may hold, S for texts. Raises RunFileError, with one line, where
    the file has what no file of ibfil has.
    """
    rows, held = {}, 0
    for name, item in _datasets(file.id, path, "", set()):
        held += _look_at(item, path, name, kinds)
        rows[name] = item.shape[0] if item.shape else 1
    if held > size:
        raise RunFileError(f"{path}: claims to hold {_bytes(held)}, and has {_bytes(size)}: it is not read")
    return rows


def _datasets(
    group: h5py.h5g.GroupID, path: Path, above: str, seen: set[int]
) -> Iterator[tuple[str, h5py.h5d.DatasetID]]:
    """Every dataset below a group, by its name; ``seen`` are the addresses of objects met so far."""
    links: list[tuple[bytes, int, int]] = []
    group.links.iterate(lambda name, link: links.append((name, link.type, link.u)), info=True)
    for name, kind, address in links:
        whole = above + name.decode(errors="backslashreplace")
        if kind != h5py.h5l.TYPE_HARD:
            raise _refused(path, whole, _LINKS.get(kind, "a link of an unknown kind"))
        if address in seen:
            raise _refused(path, whole, "a second link to the same object")
        seen.add(address)
        item = h5py.h5o.open(group, name)
        if isinstance(item, h5py.h5g.GroupID):
            if whole.count("/") + 1 >= _DEEPEST:
                raise _refused(path, whole, "a group in groups in groups")
            yield from _datasets(item, path, f"{whole}/", seen)
        elif isinstance(item, h5py.h5d.DatasetID):
            yield whole, item
        else:
            raise _refused(path, whole, "neither a group nor a dataset")


def _look_at(item: h5py.h5d.DatasetID, path: Path, name: str, kinds: str) -> int:
    """The bytes that a dataset takes in the file. Raises RunFileError for one that ibfil does not write."""
    made, number = item.get_create_plist(), item.get_type()
    if made.get_layout() == h5py.h5d.VIRTUAL:
        raise _refused(path, name, "a virtual dataset, whose numbers are in other files")
    if made.get_external_count():
        raise _refused(path, name, "a dataset whose numbers are in another file")
    kind = "S" if number.get_class() == h5py.h5t.STRING else item.dtype.kind
    if kind not in kinds:
        raise _refused(path, name, f"a dataset of {item.dtype}")
    filters = [made.get_filter(i)[0] for i in range(made.get_nfilters())]
    if not set(filters) <= _FILTERS or len(set(filters)) < len(filters):
        raise _refused(path, name, f"filters {filters}")
    held = int(item.get_storage_size())
    claimed = math.prod(item.shape) * number.get_size()
    if claimed > held * (_DEFLATE if h5py.h5z.FILTER_DEFLATE in filters else 1):
        words = f"claims to hold {_bytes(claimed)}, and has {_bytes(held)}"
        raise RunFileError(f"{path}: {name} {words}: it is not read")
    return held


def _refused(path: Path, name: str, found: str) -> RunFileError:
    return RunFileError(f"{path}: {name}: found {found}, which ibfil does not write: it is not followed, nor read")


def _bytes(size: int) -> str:
    return f"{size / 2**20:.3g} MiB" if size >= 2**17 else f"{size} bytes"
