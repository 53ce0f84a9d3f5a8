"""Writing a run file. Reading is in reader.py; what makes each write whole or not at all, in journal.py.

Outputs are gathered and written together, at once if the last write was a second ago: a run with many outputs
spends little on them, and a reader of the growing file is a second behind at most (as long as `settle` is
called).
"""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields as fields_of
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np

from ..errors import RunFailed
from .journal import Busy, JournaledFile
from .pace import pace_of
from .provenance import about, now
from .reader import RunFileError, checkpoint_path, journal_path
from .snapshots import Snapshot
from .units import label

if TYPE_CHECKING:
    from ..case.schema import Case, Units


_CHUNK = 32768  # bytes: the part of a dataset that an append rewrites
_PAUSE = 1.0  # seconds between two writes, or _SHARE times what the last one took
_SHARE = 50

# Dataset -> its dimension (units.py) and description.
_FILAMENT = {
    "position": ("length", "positions of the nodes, unwrapped"),
    "velocity": ("length/time", "velocities of the nodes"),
    "force": ("force", "force of each node on the fluid, reactions of supports included"),
    "e1": ("1", "first material director at the nodes"),
    "moment": ("force length", "internal moment at the nodes along e1, e2, e3"),
    "strain": ("1/length", "strains Omega_1, Omega_2, Omega_3 at the nodes"),
    "tension": ("force", "tension of the segments between nodes, positive when stretched"),
    "reaction_start": ("force", "force of the support on the node at s = 0"),
    "reaction_finish": ("force", "force of the support on the node at s = L"),
    "torque": ("force length", "twist torque of each node on the fluid, along the tangent"),
    "spin": ("1/time", "rate at which the first material director turns about the tangent, along it"),
}
_DIAGNOSTICS = {
    "net_force": ("force", "total force on the fluid"),
    "net_torque": ("force length", "total torque on the fluid"),
    "stretch_max": ("1", "largest stretch of a segment, length over rest length minus 1"),
    "stretch_min": ("1", "smallest stretch of a segment, length over rest length minus 1"),
    "power": ("force length/time", "power of the nodal forces and twist torques on the fluid"),
    "dissipation": ("force length/time", "power that the fluid turns into heat: eta int |grad u|^2, or of the drag"),
    "couple_dissipation": ("force length/time", "the part of it by the couple of flows across the rods' thickness"),
    "grid_power": ("force length/time", "power of the nodal forces upon the grid's own flow"),
    "slip_power": ("force length/time", "power lost between nodes and grid: the slip's share"),
    "contacts": ("1", "pairs of segments in contact"),
    "first_contact": ("time", "time of the first contact that was warned of; NaN before"),
    "newton_iterations": ("1", "Newton iterations of the last step"),
    "steps_shortened": ("1", "steps so far that had to be tried again with a shorter one"),
    "probe_velocity": ("length/time", "velocity at output.probes"),
}
_FIELDS = {
    "velocity": ("length/time", "velocity of the fluid"),
    "vorticity": ("1/time", "vorticity of the fluid"),
    "pressure": ("force/length/length", "pressure of the fluid"),
}


class Meaning(NamedTuple):
    """The meaning of a dataset: its dimension as in units.py, and words."""

    dimension: str
    description: str


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

        ``series`` holds the observables' values, ``meanings`` what they are, ``groups`` the dimensionless numbers of
        the scene. Raises RunFileError where the file exists and ``overwrite`` is not set, or another process is
        writing it.
        """
        refuse_existing(path, overwrite)
        new = not path.exists()
        with _writing(path), _owned(path):
            file = JournaledFile(path, journal_path(path), create=True)
        self = cls(path, file, case.units, grid)
        with _begun(path, new), _closing(self), _writing(path, file):
            checkpoint_path(path).unlink(missing_ok=True)  # before the run it belongs to
            file.clear()
            self._h5 = h5py.File(file, "w")
            self._h5.attrs.update(about(case, method, wisdom, groups))
            for group in ("filaments", "observables", "diagnostics"):
                self._h5.create_group(group)
            for name, value in _rows(snapshot, series).items():
                shape = np.asarray(value, float).shape
                self._columns[name] = self._add(name, shape, _meaning(name, meanings), expected)
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
        rows = _rows(snapshot, series)
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
        self._file.commit()

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
        self._describe(dataset, Meaning(*_FIELDS.get(name, ("1", name))))
        dataset.attrs["origin"] = np.asarray(self._grid.origin, float)
        dataset.attrs["spacing"] = np.full(3, self._grid.spacing * self._grid.stride)
        dataset.attrs["index"] = "value[g, i, j, k] lies at origin + spacing*(i, j, k), at time grid/time[g]"

    def _describe(self, dataset: h5py.Dataset, meaning: Meaning) -> None:
        dataset.attrs["units"] = label(self._units, meaning.dimension)
        dataset.attrs["description"] = meaning.description


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Raise RunFileError where ``path`` exists and may not be written over."""
    if not path.exists():
        return
    if not overwrite:
        raise RunFileError(f"{path}: exists already; --force writes over it, --resume goes on with it")
    if not path.is_file():
        raise RunFileError(f"{path}: is not a file")


def record_end(path: Path, status: str, reason: str) -> None:
    """Note how a run ended whose file could not be written any more; in silence where even that cannot."""
    with contextlib.suppress(OSError, RuntimeError, KeyError, Busy):
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
    except (RunFailed, RunFileError):
        raise
    except Exception as error:
        cause = (file and file.error) or error
        if not isinstance(cause, OSError):
            raise
        advice = "write elsewhere with -o" if file is None else "free some space; what was written before is whole"
        raise RunFailed(f"{path} cannot be written ({cause.strerror or cause})", advice=advice) from error


@contextlib.contextmanager
def _closing(recorder: Recorder) -> Iterator[None]:
    """Close it if it does not come to life."""
    try:
        yield
    except BaseException:
        recorder.close()
        raise


@contextlib.contextmanager
def _begun(path: Path, new: bool) -> Iterator[None]:
    """Leave nothing behind of a ``new`` file that could not be begun."""
    try:
        yield
    except RunFailed as failure:
        if new:
            path.unlink(missing_ok=True)
            journal_path(path).unlink(missing_ok=True)
            failure.advice = "free some space, or write elsewhere with -o; nothing was written"
        raise


@contextlib.contextmanager
def _owned(path: Path) -> Iterator[None]:
    try:
        yield
    except Busy:
        raise RunFileError(f"{path}: is being written by another ibfil that is still running") from None


def _rows(snapshot: Snapshot, series: Mapping[str, Any]) -> dict[str, Any]:
    """Dataset -> value of one output."""
    rows: dict[str, Any] = {"time": snapshot.time}
    for name, filament in snapshot.filaments.items():
        for field in fields_of(filament):
            value = getattr(filament, field.name)
            if value is not None:
                rows[f"filaments/{name}/{field.name}"] = value
    rows |= {f"observables/{name}": value for name, value in series.items()}
    return rows | {f"diagnostics/{name}": value for name, value in snapshot.diagnostics.items()}


def _meaning(name: str, observables: Mapping[str, Meaning]) -> Meaning:
    group, _, last = name.rpartition("/")
    if name == "time":
        return Meaning("time", "times of the outputs")
    if group == "observables":
        return observables[last]
    if group == "diagnostics":
        return Meaning(*_DIAGNOSTICS.get(last, ("1", last.replace("_", " "))))
    return Meaning(*_FILAMENT[last])
