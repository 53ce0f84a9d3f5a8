"""Reading a run file: what `ibfil run` wrote, as lazy arrays. The writing is in writer.py.

    /            format, format_version, ibfil_version, case, created, finished, versions, method, wisdom, groups,
                 status, reason, steps, wall_time, pace_seconds, pace_processor, pace_time
    /time (T,)   /filaments/NAME/...   /observables/NAME   /diagnostics/NAME   /grid/time, /grid/FIELD

A file may be read while its run goes on: it is opened without a lock, and shows whole outputs only.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import h5py
import numpy as np

from ..errors import RunFileError
from .column import CLOSED, Column
from .opening import damaged, open_run_file
from .ownership import is_being_written
from .pace import pace_of
from .paths import journal_path
from .snapshots import BodySnapshot, FilamentSnapshot, LinkSnapshot, MotorSnapshot, Snapshot

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..case.schema import Case


_PARTS = {"filaments": FilamentSnapshot, "links": LinkSnapshot, "bodies": BodySnapshot, "motors": MotorSnapshot}
_GROUPS = ("filaments", "observables", "diagnostics")
_BLOCK = 256  # outputs read at once by `frames`


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
        self._was_written = is_being_written(journal_path(self.path))
        self._opened, found = open_run_file(self.path)
        # The outputs that every dataset has; a writer may be at work on the last one.
        self._rows = min((rows for name, rows in found.items() if not name.startswith("grid/")), default=0)
        if not {"time", *_GROUPS} <= set(self._file):
            self.close()
            raise RunFileError(damaged(self.path))

    @property
    def _file(self) -> h5py.File:
        """The file. Raises ValueError where it has been closed."""
        if not self._opened.h5:
            raise ValueError(CLOSED)
        return self._opened.h5

    def close(self) -> None:
        """Close the file; arrays not read by now are lost."""
        self._opened.close()

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
    def links(self) -> dict[str, dict[str, Column]]:
        """Link -> name -> Column (T, K, 3) or (T, K): the attributes of a LinkSnapshot that its kind has."""
        return {name: self._columns(f"links/{name}") for name in self._file.get("links", {})}

    @cached_property
    def bodies(self) -> dict[str, dict[str, Column]]:
        """Body -> name -> Column (T, 3): position, e1, e2, e3, velocity, spin, force, torque, and reactions if held.

        Markers (T, k, 3) where these are of a file.
        """
        return {name: self._columns(f"bodies/{name}") for name in self._file.get("bodies", {})}

    @cached_property
    def motors(self) -> dict[str, dict[str, Column]]:
        """Motor, FILAMENT_start or FILAMENT_finish -> angle, rate, torque, power -> Column (T,)."""
        return {name: self._columns(f"motors/{name}") for name in self._file.get("motors", {})}

    @cached_property
    def observables(self) -> dict[str, Column]:
        """Series -> Column (T,) or (T, 3): of an observable by its name, of one fitted to a series as NAME.SERIES."""
        observe, found = self.case.observe, self._columns("observables").items()
        return {observe[name].recorded(name) if name in observe else name: column for name, column in found}

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
        """The case's table of a filament; a copy NAME_003 has that of NAME at i = 3, phase left open."""
        tables = self.case.filaments
        stem, _, number = name.rpartition("_")
        return tables[name] if name in tables else tables[stem].of_copy({"i": float(number)})

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
            return "running" if is_being_written(journal_path(self.path)) else "cut"
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
        return str(self._file[self._kept(path)].attrs["units"])

    def description(self, path: str) -> str:
        """Return what a dataset is, in words."""
        return str(self._file[self._kept(path)].attrs["description"])

    def _kept(self, path: str) -> str:
        """The path of a dataset in the file: before 0.2 a fit's series had the name of the fit."""
        return path if path in self._file else path.rpartition(".")[0] or path

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
            parts = {
                kind: {n: {k: c[block] for k, c in columns.items()} for n, columns in getattr(self, kind).items()}
                for kind in _PARTS
            }
            diagnostics = {name: column[block] for name, column in self.diagnostics.items()}
            for i, time in enumerate(self.time[block]):
                yield Snapshot(
                    time=float(time),
                    **{
                        kind: {name: _at(of, arrays, i) for name, arrays in parts[kind].items()}
                        for kind, of in _PARTS.items()
                    },
                    diagnostics={k: float(v[i]) if v.ndim == 1 else v[i] for k, v in diagnostics.items()},
                )


def _at(kind: Any, arrays: dict[str, np.ndarray], i: int) -> Any:
    """Output ``i`` of a filament or a link, None where it has no such part."""
    return kind(**{part.name: arrays[part.name][i] if part.name in arrays else None for part in fields(kind)})
