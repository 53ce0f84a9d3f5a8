"""Reading a run file: what `ibfil run` wrote, as lazy arrays. The writing is in writer.py.

    /            format, format_version, ibfil_version, case, created, finished, versions, method, wisdom, groups,
                 status, reason, steps, wall_time, pace_seconds, pace_processor, pace_time
    /time (T,)   /filaments/NAME/...   /observables/NAME   /diagnostics/NAME   /grid/time, /grid/FIELD

A file may be read while its run goes on: it is opened without a lock, and shows whole outputs only.
"""

from __future__ import annotations

import json
import time as clock
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np

from ..errors import CaseError
from . import journal
from .pace import pace_of
from .snapshots import FilamentSnapshot, Snapshot

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case


FORMAT = "ibfil-run"
FORMAT_VERSION = 1
# Of FilamentFrame: there where that end is held, and where the filament twists.
_OPTIONAL = ("reaction_start", "reaction_finish", "torque", "spin")
_KEYS = ("position", "velocity", "force", "e1", "moment", "strain", "tension", *_OPTIONAL)
_BLOCK = 256  # outputs read at once by `frames`


class RunFileError(CaseError):
    """A run file that cannot be read, or not be written as asked: one line (exit status 2)."""

    def __init__(self, line: str) -> None:
        super().__init__([line])


def checkpoint_path(path: Path) -> Path:
    """RUN.ckpt.h5, where RUN.h5 can be gone on from."""
    return path.with_name(path.name.removesuffix(".h5") + ".ckpt.h5")


def journal_path(path: Path) -> Path:
    """RUN.journal, which is there while RUN.h5 is being written (journal.py)."""
    return path.with_name(path.name.removesuffix(".h5") + ".journal")


class Column:
    """A dataset (T, ...) of which the first ``rows`` count; indexing reads, ``np.asarray`` reads it all."""

    def __init__(self, dataset: h5py.Dataset, rows: int) -> None:
        self._dataset = dataset
        self.shape: tuple[int, ...] = (rows, *dataset.shape[1:])
        self.dtype = dataset.dtype

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        return f"<Column {self.shape} {self.dtype}; [...] reads>"

    def __getitem__(self, key: Any) -> np.ndarray:
        first, *rest = key if isinstance(key, tuple) else (key,)
        if isinstance(first, slice):
            start, stop, step = first.indices(len(self))
            if step < 0:  # which h5py does not do
                return self[(slice(None), *rest)][first]
            first = slice(start, max(start, stop), step)
        elif first is not Ellipsis:
            number = int(first)
            if not -len(self) <= number < len(self):
                raise IndexError(f"output {number} of {len(self)}")
            first = number % len(self)
        else:
            return np.asarray(self)[key]
        return self._dataset[(first, *rest)]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        values = self._dataset[: len(self)]
        return values if dtype is None else values.astype(dtype)


class GridRecord(NamedTuple):
    """The fields that were written: value [g, i, j, k] lies at origin + spacing (i, j, k), at time[g]."""

    time: Column
    fields: dict[str, Column]  # (G, nx, ny, nz) or (G, nx, ny, nz, 3)
    origin: np.ndarray  # (3,)
    spacing: np.ndarray  # (3,)


class RunFile:
    """A run file, open for reading; close it or use it in a ``with``. ``len(run)`` is the number of outputs.

    Raises RunFileError, with one line, for what is not there, is no run file, is of another format or is
    damaged.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        # Looked at first: a writer that ends after this has said in the file how.
        self._was_written = journal.is_being_written(journal_path(self.path))
        self._file = _open(self.path)
        try:
            _check_format(self._file, self.path)
            self._rows = self._whole_outputs()
        except BaseException as error:
            self._file.close()
            if isinstance(error, Exception) and not isinstance(error, CaseError):  # HDF5 on bytes it did not write
                raise RunFileError(damaged(self.path)) from error
            raise

    def _whole_outputs(self) -> int:
        """Count the outputs that every dataset has; a writer may be at work on the last one."""
        lengths = [len(self._file["time"])]
        lengths += [len(d) for group in self._file["filaments"].values() for d in group.values()]
        for name in ("observables", "diagnostics"):
            lengths += [len(d) for d in self._file[name].values()]
        return min(lengths)

    def close(self) -> None:
        """Close the file; arrays not read by now are lost."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return self._rows

    def _columns(self, group: str) -> dict[str, Column]:
        return {name: Column(dataset, self._rows) for name, dataset in self._file[group].items()}

    @cached_property
    def time(self) -> np.ndarray:
        """Times of the outputs (T,)."""
        return self._file["time"][: self._rows]

    @cached_property
    def filaments(self) -> dict[str, dict[str, Column]]:
        """Filament -> name -> Column.

        position, velocity, force, e1, moment, strain (T, N, 3), tension (T, N-1), and reaction_start,
        reaction_finish (T, 3) where that end is held; torque, spin (T, N, 3) where the filament twists.
        """
        return {name: self._columns(f"filaments/{name}") for name in self._file["filaments"]}

    @cached_property
    def observables(self) -> dict[str, Column]:
        """Observable -> Column (T,) or (T, 3)."""
        return self._columns("observables")

    @cached_property
    def diagnostics(self) -> dict[str, Column]:
        """Diagnostic -> Column (T,) or (T, 3)."""
        return self._columns("diagnostics")

    @cached_property
    def grid(self) -> GridRecord | None:
        """The fields, None where none were written."""
        if "grid" not in self._file:
            return None
        group = self._file["grid"]
        rows = min(len(dataset) for dataset in group.values())
        fields = {name: Column(dataset, rows) for name, dataset in group.items() if name != "time"}
        some = group[next(iter(fields))].attrs
        return GridRecord(Column(group["time"], rows), fields, some["origin"], some["spacing"])

    def position(self, name: str | None = None) -> np.ndarray:
        """Positions (T, N, 3) of a filament, by default of the only one."""
        if name is None:
            (name,) = self.filaments
        return np.asarray(self.filaments[name]["position"])

    def arclength(self, name: str) -> np.ndarray:
        """Arclength (N,) of a filament's nodes at rest."""
        from ..case.spacing import node_arclength

        return node_arclength(self.filament(name))

    def filament(self, name: str) -> Filament:
        """The case's table of a filament; a copy NAME_000 has that of NAME."""
        tables = self.case.filaments
        return tables[name] if name in tables else tables[name.rpartition("_")[0]]

    @cached_property
    def case(self) -> Case:
        """The case that was run, overrides included."""
        from ..case.reading import parse_case

        return parse_case(self.case_text, self.path.name)

    @property
    def case_text(self) -> str:
        """The same as TOML."""
        return self._attribute("case")

    @property
    def status(self) -> str:
        """How the run was when the file was opened: one word.

        running | finished | stopped (by a stop rule) | failed | interrupted (Ctrl-C) | cut (killed)
        """
        status = self._attribute("status")
        if status == "running" and not self._was_written:
            return "running" if journal.is_being_written(journal_path(self.path)) else "cut"
        return status

    @property
    def reason(self) -> str:
        """Which rule stopped it, or what went wrong; "" otherwise."""
        return self._attribute("reason")

    @property
    def created(self) -> str:
        """When it began, ISO 8601."""
        return self._attribute("created")

    @property
    def finished(self) -> str:
        """When it ended, ISO 8601; "" while it runs."""
        return self._attribute("finished")

    @property
    def method(self) -> str:
        """The fluid method chosen."""
        return self._attribute("method")

    @property
    def wisdom(self) -> str:
        """The FFTW wisdom its plans came from; "" where there are none."""
        return self._attribute("wisdom")

    @property
    def groups(self) -> dict[str, float]:
        """The dimensionless groups of the scene (sperm number, EA L^2/A ...), as `ibfil run` began with."""
        return json.loads(str(self._file.attrs.get("groups", "{}")))

    @property
    def versions(self) -> dict[str, str]:
        """Versions of ibfil, Python and the libraries it ran with."""
        return json.loads(self._attribute("versions"))

    @property
    def steps(self) -> int:
        """Time steps taken by the last output written."""
        return int(self._file.attrs["steps"])

    @property
    def wall_time(self) -> float:
        """Seconds spent by the last output written, over all parts of a run that was cut."""
        return float(self._file.attrs["wall_time"])

    @property
    def pace(self) -> tuple[float, float, float]:
        """Seconds, processor seconds and simulated time, without start-up and first step (running/progress.py)."""
        return pace_of(self._file)

    def _attribute(self, name: str) -> str:
        return str(self._file.attrs[name])

    def units(self, path: str) -> str:
        """Return the label of a dataset's unit, as in ``run.units("filaments/rod/velocity")``."""
        return str(self._file[path].attrs["units"])

    def description(self, path: str) -> str:
        """Return what a dataset is, in words."""
        return str(self._file[path].attrs["description"])

    def visit(self, look: Callable[[str, h5py.Dataset | h5py.Group], None]) -> None:
        """Shows every group and dataset of the file."""
        self._file.visititems(look)

    def snapshot(self, i: int) -> Snapshot:
        """Output ``i`` as the simulation gave it (without fields)."""
        return next(self.snapshots(i % self._rows))

    def snapshots(self, start: int = 0, stop: int | None = None) -> Iterator[Snapshot]:
        """Yield outputs ``start`` to ``stop``, read in blocks."""
        stop = self._rows if stop is None else min(stop, self._rows)
        for low in range(start, stop, _BLOCK):
            block = slice(low, min(low + _BLOCK, stop))
            filaments = {n: {k: c[block] for k, c in columns.items()} for n, columns in self.filaments.items()}
            diagnostics = {name: column[block] for name, column in self.diagnostics.items()}
            for i, time in enumerate(self.time[block]):
                yield Snapshot(
                    time=float(time),
                    filaments={name: _filament_snapshot(arrays, i) for name, arrays in filaments.items()},
                    diagnostics={k: float(v[i]) if v.ndim == 1 else v[i] for k, v in diagnostics.items()},
                )


def _filament_snapshot(arrays: dict[str, np.ndarray], i: int) -> FilamentSnapshot:
    values: dict[str, Any] = {key: arrays[key][i] if key in arrays else None for key in _KEYS}
    return FilamentSnapshot(**values)


def _open(path: Path) -> h5py.File:
    """Open, put right what a killed writer left, and wait a moment for one that is at work."""
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such file")
    for _ in range(10):
        try:
            journal.recover(path, journal_path(path))
            return _open_unlocked(path)
        except PermissionError as error:
            raise RunFileError(f"{path}: cannot be read ({error.strerror})") from None
        except OSError:
            if not journal.is_being_written(journal_path(path)):
                break
            clock.sleep(0.05)
    with open(path, "rb") as file:
        if file.read(8) != b"\x89HDF\r\n\x1a\n" and not checkpoint_path(path).exists():
            raise RunFileError(f"{path}: is not a run file of ibfil")
    raise RunFileError(damaged(path))


def _open_unlocked(path: Path) -> h5py.File:
    """Open without a lock; with one where this process has it open so already, which HDF5 must have alike."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError:
        return h5py.File(path, "r")


def _check_format(file: h5py.File, path: Path) -> None:
    if str(file.attrs.get("format", "")) != FORMAT:
        raise RunFileError(f"{path}: is an HDF5 file, but not a run file of ibfil")
    version = int(file.attrs["format_version"])
    if version != FORMAT_VERSION:
        raise RunFileError(f"{path}: {other_format(version, str(file.attrs['ibfil_version']))}")


def other_format(version: int, written_by: str) -> str:
    """The error for a file of another format version."""
    if version > FORMAT_VERSION:
        remedy = f"read it with ibfil {written_by} or later (pip install -U ibfil)"
    else:
        remedy = f"read it with ibfil {written_by}, or run its case again (it is in the attribute `case`)"
    return f"has format {version}, written by ibfil {written_by}; this ibfil reads format {FORMAT_VERSION}: {remedy}"


def damaged(path: Path) -> str:
    """The error for a file that cannot be read."""
    line = f"{path}: is damaged or cut short"
    if checkpoint_path(path).exists():
        line += f"; `ibfil run --resume {path}` rebuilds it"
    return line
