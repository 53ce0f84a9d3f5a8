"""The checkpoint beside a run file: all that is needed to go on bit for bit. It is replaced as a whole."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..errors import RunFileError
from .disk import sync_folder, write_all
from .opening import open_hdf5
from .ownership import open_new
from .paths import part_path
from .vetting import FLOATS, look_over

FORMAT = "ibfil-checkpoint"
FORMAT_VERSION = 2

_KINDS = FLOATS + "ciubS"  # of what is in it
State = Mapping[str, "np.ndarray | float | int | str"]


@dataclass(frozen=True)
class Checkpoint:
    """``state`` as the simulation gave it, and where the run and its file stood then."""

    state: State
    time: float
    steps: int
    outputs: int  # rows of the run file
    fields: int  # rows of its /grid
    wall_time: float  # seconds
    case: str  # TOML, as the run began
    file: str  # that TOML's name
    wisdom: str
    created: str  # of the run file: tells which run this belongs to

    def copied(self) -> Checkpoint:
        """Return the same in memory of its own: it stays as it is while the simulation goes on."""
        return replace(self, state={k: np.copy(v) if isinstance(v, np.ndarray) else v for k, v in self.state.items()})


_SCALARS = ("time", "steps", "outputs", "fields", "wall_time", "case", "file", "wisdom", "created")


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Replace ``path``; on return it is on the disk. Raises OSError and Stranger, and then the old one is still there.

    The file is made in memory, because HDF5 cannot be trusted to survive a disk that is full.
    """
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
        for name in _SCALARS:
            file.attrs[name] = getattr(checkpoint, name)
        group = file.create_group("state")
        for key, value in checkpoint.state.items():
            _put(group, key, value)
    part = part_path(path)
    handle = open_new(part)
    try:
        write_all(handle, image.getbuffer(), 0)
        os.fsync(handle)
        os.replace(part, path)
    except OSError:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise
    finally:
        os.close(handle)
    sync_folder(path.parent)


def read(path: Path) -> Checkpoint:
    """Read a checkpoint. Raises RunFileError, with one line, where it is not one."""
    if not path.is_file():
        raise RunFileError(f"{path}: there is no such checkpoint")
    try:
        opened = open_hdf5(path)
        with closing(opened):
            file = opened.h5
            if file.attrs["format"] != FORMAT:
                raise ValueError(FORMAT)
            if file.attrs["format_version"] != FORMAT_VERSION:
                found = f"is a checkpoint of format {int(file.attrs['format_version'])}"
                remedy = "go on with the ibfil that `ibfil show` says the run was written by"
                raise RunFileError(f"{path}: {found}; this ibfil goes on from format {FORMAT_VERSION}: {remedy}")
            look_over(file, path, opened.size, _KINDS)
            state: dict[str, Any] = {}
            file["state"].visititems(lambda key, item: _get(state, key, item))
            scalars = {name: file.attrs[name] for name in _SCALARS}
    except PermissionError as error:
        raise RunFileError(f"{path}: cannot be read ({error.strerror})") from None
    except (OSError, KeyError, ValueError, TypeError, RuntimeError):
        raise RunFileError(f"{path}: is not a checkpoint of ibfil, or is damaged") from None
    kinds = {"time": float, "wall_time": float, "steps": int, "outputs": int, "fields": int}
    return Checkpoint(state=state, **{name: kinds.get(name, str)(value) for name, value in scalars.items()})


def _put(group: h5py.Group, key: str, value: np.ndarray | float | int | str) -> None:
    """Write an entry of the state; ``kind`` says what to make of it. Integers may be longer than 64 bits."""
    if isinstance(value, np.ndarray):
        dataset = group.create_dataset(key, data=value)
        fortran = value.flags.f_contiguous and not value.flags.c_contiguous
        dataset.attrs["kind"] = "columns" if fortran else "rows"  # BLAS rounds differently on the two
    elif isinstance(value, str):
        group.create_dataset(key, data=value).attrs["kind"] = "str"
    elif isinstance(value, (int, np.integer)):
        group.create_dataset(key, data=str(int(value))).attrs["kind"] = "int"
    else:
        group.create_dataset(key, data=float(value)).attrs["kind"] = "float"


def _get(state: dict[str, Any], key: str, item: Any) -> None:
    if not isinstance(item, h5py.Dataset):
        return
    value, kind = item[()], item.attrs["kind"]
    if kind in ("rows", "columns"):
        state[key] = np.array(value, order="F" if kind == "columns" else "C")
    elif kind == "float":
        state[key] = float(value)
    else:
        text = value.decode()
        state[key] = int(text) if kind == "int" else text
