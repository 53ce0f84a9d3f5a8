"""Whether a run file is whole: asked when reading it has failed in a way that no whole one explains."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from ..errors import CaseError, RunFileError
from .opening import damaged
from .reader import RunFile

_ROWS = 4096  # read at once


def examine(path: Path) -> list[str]:
    """The damages of a run file, in lines; none where all that a reader may ask for is there and can be read."""
    try:
        with RunFile(path) as run:
            _look_at_all(run)
    except CaseError as error:
        return error.faults
    except Exception as error:  # whatever HDF5 makes of bytes that it did not write
        return [f"{damaged(path)} ({type(error).__name__}: {' '.join(str(error).split())[:120]})"]
    return []


def _look_at_all(run: RunFile) -> None:
    """Raises where something is missing, has another shape or cannot be read."""
    names = set(run.filaments)
    expected = {name for name in run.case.filaments if run.case.filaments[name].copies is None}
    if not names or not expected <= names:
        raise RunFileError(f"{damaged(run.path)} (it lacks filaments of its case)")
    for name, columns in run.filaments.items():
        n = len(run.arclength(name))
        for key in ("position", "velocity", "force", "e1", "moment", "strain", "tension"):
            wanted = (n - 1,) if key == "tension" else (n, 3)
            if columns[key].shape[1:] != wanted:
                raise RunFileError(f"{damaged(run.path)} ({name}/{key} has shape {columns[key].shape})")
    if not np.all(np.diff(run.time) > 0) or len(run) == 0:
        raise RunFileError(f"{damaged(run.path)} (its times do not increase)")
    for text in (run.status, run.reason, run.created, run.finished, run.method, run.wisdom):
        text.encode()
    found = (run.versions, run.steps, run.wall_time, run.grid, run.observables, run.diagnostics)
    assert len(found) == 6
    run.visit(_read)


def _read(name: str, item: h5py.Dataset | h5py.Group) -> None:
    if isinstance(item, h5py.Dataset):
        rows = _ROWS if item.ndim < 4 else 1
        for low in range(0, len(item), rows):
            item[low : low + rows]
        str(item.attrs["units"]), str(item.attrs["description"])
