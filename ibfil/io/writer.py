"""Writing a run file. Reading is in reader.py; what makes each write whole or not at all, in journal.py.

Outputs are gathered and written together, at once if the last write was a second ago: a run with many outputs
spends little on them, and a reader of the growing file is a second behind at most (as long as `settle` is
called).
"""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np

from ..errors import RunFailed, RunFileError
from .datasets import FIELDS, Meaning, meaning_of, rows_of
from .disk import failed_write
from .journal import JournaledFile
from .overwriting import CHECKPOINT, RUN, refuse
from .ownership import Busy, Stranger, remove_part
from .pace import pace_of
from .paths import checkpoint_path, journal_path, part_path
from .provenance import about, now
from .snapshots import Snapshot
from .units import label

if TYPE_CHECKING:
    from ..case.schema import Case, Units


_CHUNK = 32768  # bytes: the part of a dataset that an append rewrites
_PAUSE = 1.0  # seconds between two writes, or _SHARE times what the last one took
_SHARE = 50


class GridPlace(NamedTuple):
    """Where grid index (0, 0, 0) lies, the distance of grid points, and every how many-th is written."""

    origin: np.ndarray
    spacing: float
    stride: int


class Recorder:
    """A run file being written, by one process only. Make one with `create` or `resume`.

    All methods raise RunFailed where the file cannot be written (disk full ...): it is then as after its last
    whole write.
    """

    def __init__(self, path: Path, file: JournaledFile, units: Units, grid: GridPlace | None) -> None:
        self.path, self._file, self._units, self._grid = path, file, units, grid
        self._h5: h5py.File | None = None
        self._columns: dict[str, h5py.Dataset] = {}  # what every output adds a row to
        self._pending: list[dict[str, Any]] = []
        self._next = 0.0
        self.notices: list[str] = []  # what has happened to the file and nobody was told yet
        self.outputs = self.fields = 0  # rows of the file, those still to be written included

    @classmethod
    def create(
        cls,
        path: Path,
        case: Case,
        snapshot: Snapshot,
        series: Mapping[str, Any],
        meanings: Mapping[str, Meaning],
        *,
        grid: GridPlace | None = None,
        method: str = "",
        wisdom: str = "",
        groups: Mapping[str, float] = MappingProxyType({}),
        expected: int = 1024,
        overwrite: bool = False,
    ) -> Recorder:
        """Begin a run file with its first output; ``expected`` outputs in all (sizes chunks, no limit).

        ``series`` holds the observables' values, ``meanings`` what they are, ``groups`` the dimensionless numbers.
        Raises RunFileError where the file exists and ``overwrite`` is not set, or another process is writing it.
        """
        refuse(path, RUN, overwrite)
        refuse(checkpoint_path(path), CHECKPOINT, True)
        with _writing(path), _owned(path):
            remove_part(part_path(checkpoint_path(path)))
            file = JournaledFile(path, journal_path(path), create=True)
        self = cls(path, file, case.units, grid)
        with _closing(self), _writing(path, file):
            checkpoint_path(path).unlink(missing_ok=True)  # before its run
            self._h5 = h5py.File(file, "w")
            self._h5.attrs.update(about(case, method, wisdom, groups))
            for group in ("filaments", "observables", "diagnostics"):
                self._h5.create_group(group)
            for name, value in rows_of(snapshot, series).items():
                shape = np.asarray(value, float).shape
                self._columns[name] = self._add(name, shape, meaning_of(name, meanings), expected)
            self.append(snapshot, series)
            self.write()
        return self

    @classmethod
    def resume(cls, path: Path, case: Case, outputs: int, fields: int, grid: GridPlace | None = None) -> Recorder:
        """Go on with a run file, cut back to so many ``outputs`` and ``fields``. Raises as `create`."""
        with _writing(path), _owned(path):
            file = JournaledFile(path, journal_path(path))
        self = cls(path, file, case.units, grid)
        with _closing(self), _writing(path, file):
            self._h5 = h5py.File(file, "r+")
            self._h5.visititems(self._cut_back(outputs, fields))
            self._h5.attrs.update(status="running", reason="", finished="", case=case.text)
            self._commit()
        self.outputs, self.fields = outputs, fields
        return self

    def _cut_back(self, outputs: int, fields: int) -> Callable[[str, Any], None]:
        def cut(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                of_grid = name.startswith("grid/")
                item.resize(fields if of_grid else outputs, axis=0)
                if not of_grid:
                    self._columns[name] = item

        return cut

    @property
    def created(self) -> str:
        """When the run began: with the path, its name."""
        return str(self._open.attrs["created"])

    @property
    def pace(self) -> tuple[float, float, float]:
        """The pace noted by earlier parts of the run: seconds, processor seconds, simulated time."""
        return pace_of(self._open)

    @property
    def _open(self) -> h5py.File:
        assert self._h5 is not None
        return self._h5

    def append(self, snapshot: Snapshot, series: Mapping[str, Any]) -> None:
        """One output. Arrays are copied: the simulation may go on in the same memory."""
        rows = rows_of(snapshot, series)
        strange = [name for name in rows if name not in self._columns]
        if strange:
            raise ValueError(f"{strange[0]} was not in the first output")
        self._pending.append({name: np.array(value, float) for name, value in rows.items()})
        self.outputs += 1
        self.settle()

    def append_fields(self, time: float, fields: Mapping[str, np.ndarray]) -> None:
        """Fields (nx, ny, nz[, 3]) of the whole grid at one time; every ``stride``-th point is written."""
        assert self._grid is not None
        step = self._grid.stride
        with _writing(self.path, self._file):
            if "grid" not in self._open:
                self._add("grid/time", (), Meaning("time", "times of the fields"), 256)
            for name, values in fields.items():
                values = np.asarray(values[::step, ::step, ::step], np.float32)
                if f"grid/{name}" not in self._open:
                    self._add_field(name, values.shape)
                dataset = self._open[f"grid/{name}"]
                dataset.resize(self.fields + 1, axis=0)
                dataset[self.fields] = values
            times = self._open["grid/time"]
            times.resize(self.fields + 1, axis=0)
            times[self.fields] = time
            self.fields += 1
        self.write()

    def settle(self) -> None:
        """Write what waits, if it is time to. Cheap; call it as often as you like."""
        if self._pending and clock.monotonic() >= self._next:
            self.write()

    def write(self, **attributes: Any) -> None:
        """Write what waits, and attributes of the run; on return it is on the disk."""
        began = clock.monotonic()
        with _writing(self.path, self._file):
            first = self.outputs - len(self._pending)
            for name, dataset in self._columns.items() if self._pending else ():
                missing = np.full(dataset.shape[1:], np.nan)
                dataset.resize(self.outputs, axis=0)
                dataset[first:] = np.stack([row.get(name, missing) for row in self._pending])
            self._open.attrs.update(attributes)
            self._commit()
        self._pending.clear()
        now = clock.monotonic()
        self._next = now + max(_PAUSE, _SHARE * (now - began))

    def finish(self, status: str, reason: str = "", **attributes: Any) -> None:
        """Write what waits and how the run ended, and close the file."""
        self.write(status=status, reason=reason, finished=now(), **attributes)
        self.close()

    def close(self) -> None:
        """Close the file. Rows that were not written are lost."""
        if self._h5 is not None:
            with contextlib.suppress(Exception):  # after a failed write HDF5 has lost the thread, and may
                self._h5.close()
        self._h5 = None
        self._file.close()

    def _commit(self) -> None:
        self._open.flush()
        before = self._file.written_again
        self._file.commit()
        if self._file.written_again > before:
            self.notices.append(f"{self.path} was removed or moved while it was being written; it was written again")

    def _add(self, name: str, shape: tuple[int, ...], meaning: Meaning, expected: int) -> h5py.Dataset:
        size = 8 * int(np.prod(shape, dtype=int))
        rows = max(1, min(expected, _CHUNK // size if size else 1, 1024))
        dataset = self._open.create_dataset(
            name, (0, *shape), np.float64, maxshape=(None, *shape), chunks=(rows, *shape)
        )
        self._describe(dataset, meaning)
        return dataset

    def _add_field(self, name: str, shape: tuple[int, ...]) -> None:
        assert self._grid is not None
        chunk = (1, *(min(n, 64) for n in shape[:3]), *shape[3:])
        dataset = self._open.create_dataset(
            f"grid/{name}",
            (0, *shape),
            np.float32,
            maxshape=(None, *shape),
            chunks=chunk,
            compression="gzip",
            compression_opts=1,
            shuffle=True,
        )
        self._describe(dataset, Meaning(*FIELDS.get(name, ("1", name))))
        dataset.attrs["origin"] = np.asarray(self._grid.origin, float)
        dataset.attrs["spacing"] = np.full(3, self._grid.spacing * self._grid.stride)
        dataset.attrs["index"] = "value[g, i, j, k] lies at origin + spacing*(i, j, k), at time grid/time[g]"

    def _describe(self, dataset: h5py.Dataset, meaning: Meaning) -> None:
        dataset.attrs["units"] = label(self._units, meaning.dimension)
        dataset.attrs["description"] = meaning.description


def record_end(path: Path, status: str, reason: str) -> None:
    """Note how a run ended whose file could not be written any more; in silence where even that cannot."""
    with contextlib.suppress(OSError, RuntimeError, KeyError, Busy, Stranger):
        file = JournaledFile(path, journal_path(path))
        try:
            h5 = h5py.File(file, "r+")
            h5.attrs.update(status=status, reason=reason, finished=now())
            h5.flush()
            file.commit()
            h5.close()
        finally:
            file.close()


@contextlib.contextmanager
def _writing(path: Path, file: JournaledFile | None = None) -> Iterator[None]:
    """Turn what goes wrong while writing into RunFailed; HDF5 may stumble over what the file hid from it."""
    try:
        yield
    except (RunFailed, RunFileError, Busy, Stranger):
        raise
    except Exception as error:
        cause = (file and file.error) or error
        if not isinstance(cause, OSError):
            raise
        raise failed_write(path, cause, file is not None and file.begun) from error


@contextlib.contextmanager
def _closing(recorder: Recorder) -> Iterator[None]:
    """Close it if it does not come to life."""
    try:
        yield
    except BaseException:
        recorder.close()
        raise


@contextlib.contextmanager
def _owned(path: Path) -> Iterator[None]:
    try:
        yield
    except Busy:
        raise RunFileError(f"{path}: is being written by another ibfil that is still running") from None
    except Stranger as stranger:
        raise RunFileError(str(stranger)) from None
