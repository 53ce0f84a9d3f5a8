"""A run as VTKHDF: `ibfil vtk --hdf`, a file for all times of the filaments, of links, of bodies, of the fields.

    /VTKHDF                 Type, Version; of an image WholeExtent, Origin, Spacing, Direction
    /VTKHDF/Steps           NSteps, Values (the times), and where each time begins in the arrays
    /VTKHDF/Points, Lines   places; cells, which are kept once for as long as they stay the same
    /VTKHDF/PointData/...   (points of all times one after the other, ...) of lines; (time, z, y, x, ...) of images

ParaView 5.12 and later open it. The layout is of Kitware's file format VTKHDF 2.0; arrays are those of the .vtp and
.vti files, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..analysis.body_meshes import body_surfaces
from ..analysis.meshes import PLAIN, Rod, View, box_of, field_data, link_lines, node_arrays, polylines, rods_of
from ..errors import CaseError
from ..io.overwriting import Kind, refuse, replacing
from ..io.reader import RunFile
from ..io.snapshots import FilamentSnapshot
from .vtkhdf_layout import KINDS, Rows, add_cells, add_time, new_root

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet


TOGETHER = 2**19  # nodes of all times whose arrays are made at once, some 60 MB
VTKHDF = Kind("a file of VTKHDF", lambda path, head: head.startswith(b"\x89HDF") and b"VTKHDF" in head)


def write_vtkhdf(
    run: str | Path,
    folder: str | Path | None = None,
    *,
    wrap: bool = False,
    images: int = 0,
    every: int = 1,
) -> list[Path]:
    """Write the run file ``run`` into ``folder``, by default the run's name, as VTKHDF; returns the paths.

    RUN_filaments.vtkhdf, and of links, bodies and the grid where there are any; ``wrap`` and ``images`` as of
    `ibfil.write_vtk`; every ``every``-th output, and all fields. A file is whole or not there. Raises CaseError for
    wrapping or images without a box, RunFileError where another kind of file stands in the place, and as `ibfil.open`.
    """
    run, view = Path(run), View(wrap, images)
    folder = run.with_suffix("") if folder is None else Path(folder)
    with RunFile(run) as opened:
        rods, box = rods_of(opened), box_of(opened)
        if view != PLAIN and box is None:
            allowed = "a run in a periodic box, which rft and free space have not"
            raise CaseError([f"{run}: found --wrap or --images; allowed: {allowed}"])
        folder.mkdir(parents=True, exist_ok=True)

        def shown() -> Iterator[Any]:
            return (snapshot for i, snapshot in enumerate(opened.snapshots()) if i % every == 0)

        paths = [_place(folder, run, "filaments")]
        if view == PLAIN:
            _write(paths[0], lambda file: _write_filaments(file, opened, rods, every))
        else:
            lines = ((s.time, polylines(s, rods, box, view)) for s in shown())
            _write(paths[0], lambda file: _write_meshes(file, lines))
        if opened.links:
            paths.append(_place(folder, run, "links"))
            _write(paths[-1], lambda file: _write_meshes(file, ((s.time, link_lines(s, box, view)) for s in shown())))
        if opened.bodies:
            paths.append(_place(folder, run, "bodies"))
            meshes = ((s.time, body_surfaces(opened, s, view)) for s in shown())
            _write(paths[-1], lambda file: _write_meshes(file, meshes))
        if opened.grid is not None and len(opened.grid.time):
            paths.append(_place(folder, run, "grid"))
            _write(paths[-1], lambda file: _write_fields(file, opened))
    return paths


def _place(folder: Path, run: Path, kind: str) -> Path:
    path = folder / f"{run.stem}_{kind}.vtkhdf"
    refuse(path, VTKHDF, True, [run])
    return path


def _write(path: Path, fill: Callable[[h5py.File], None]) -> None:
    with replacing(path) as part, h5py.File(part, "w", libver=("v108", "v108")) as file:
        fill(file)


def _write_filaments(file: h5py.File, run: RunFile, rods: dict[str, Rod], every: int) -> None:
    """The same as `_write_meshes` of their polylines, by many times of a filament at once."""
    root = new_root(file, "PolyData")
    offsets, times, rows = np.cumsum([0, *(len(rod.s) for rod in rods.values())]), run.time[::every], Rows(root)
    count, none = int(offsets[-1]), np.zeros(4, np.int64)
    empty = (np.zeros(1, np.int64), np.zeros(0, np.int64))
    add_cells(rows, count, [(offsets, np.arange(count)) if kind == "Lines" else empty for kind in KINDS])
    for number, time in enumerate(times):
        add_time(rows, float(time), 0, number * count, none, none)
    block = max(1, TOGETHER // count)
    for first in range(0, len(times), block):
        part = slice(first * every, min(first + block, len(times)) * every, every)
        shown = [_shown(run.filaments[name], rod, part) for name, rod in rods.items()]
        filament = np.repeat(np.arange(len(rods), dtype=np.int32), np.diff(offsets))
        for name in shown[0]:
            values = np.concatenate([arrays[name] for arrays in shown], axis=1)
            rows.add(name, values.reshape(-1, *values.shape[2:]))
        rows.add("PointData/filament", np.tile(filament, len(times[first : first + block])))
    rows.write()
    for name in root["PointData"]:
        rows.add(f"Steps/PointDataOffsets/{name}", count * np.arange(len(times)))
    rows.write()
    root["Steps"].attrs["NSteps"] = len(times)


def _shown(columns: Mapping[str, Any], rod: Rod, part: slice) -> dict[str, np.ndarray]:
    """Points and arrays (T, N, ...) of a filament at some of its outputs, by the names of their datasets."""
    found = {key: column[part] for key, column in columns.items() if not key.startswith("reaction")}
    arrays = node_arrays(FilamentSnapshot(**found, reaction_start=None, reaction_finish=None), rod)
    points, shape = found["position"], found["position"].shape[:2]
    wide = {k: np.broadcast_to(v, shape) if v.ndim == 1 else v for k, v in arrays.items()}
    return {"Points": points} | {f"PointData/{k}": v.astype(np.float32) for k, v in wide.items()}


def _cells(mesh: vtkDataSet, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Where each cell of a kind begins, and the points of all of them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    get = {"Vertices": "GetVerts", "Lines": "GetLines", "Polygons": "GetPolys", "Strips": "GetStrips"}[kind]
    cells = getattr(mesh, get)()
    return vtk_to_numpy(cells.GetOffsetsArray()), vtk_to_numpy(cells.GetConnectivityArray())


def _write_meshes(file: h5py.File, meshes: Iterator[tuple[float, vtkDataSet]]) -> None:
    """A temporal PolyData: points of all times, and cells where they differ from those before."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    root = new_root(file, "PolyData")
    rows = Rows(root)
    last: list[np.ndarray] = []
    part, points, cells, ids = -1, 0, np.zeros(4, np.int64), np.zeros(4, np.int64)
    new_cells, new_ids = np.zeros(4, np.int64), np.zeros(4, np.int64)
    for time, mesh in meshes:
        topology = [_cells(mesh, kind) for kind in KINDS]
        arrays = [array for pair in topology for array in pair]
        if not last or not all(np.array_equal(one, other) for one, other in zip(arrays, last, strict=True)):
            part, cells, ids, last = part + 1, cells + new_cells, ids + new_ids, [array.copy() for array in arrays]
            new_cells = np.array([len(offsets) - 1 for offsets, _ in topology])
            new_ids = np.array([len(each) for _, each in topology])
            add_cells(rows, mesh.GetNumberOfPoints(), topology)
        values = mesh.GetPointData()
        for i in range(values.GetNumberOfArrays()):
            array = values.GetArray(i)
            rows.add(f"PointData/{array.GetName()}", vtk_to_numpy(array))
            rows.add(f"Steps/PointDataOffsets/{array.GetName()}", np.array([points]))
        rows.add("Points", vtk_to_numpy(mesh.GetPoints().GetData()))
        add_time(rows, time, part, points, cells, ids)
        points += mesh.GetNumberOfPoints()
    rows.write()
    root["Steps"].attrs["NSteps"] = len(root["Steps/Values"])


def _write_fields(file: h5py.File, run: RunFile) -> None:
    """A temporal ImageData of the fields, of which every time has a slice."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = run.grid
    assert grid is not None
    root = new_root(file, "ImageData")
    rows = Rows(root)
    for number, time in enumerate(np.asarray(grid.time)):
        image = field_data(run, number)
        if not number:
            root.attrs["WholeExtent"] = np.array(image.GetExtent(), np.int32)
            root.attrs["Origin"], root.attrs["Spacing"] = np.array(image.GetOrigin()), np.array(image.GetSpacing())
            root.attrs["Direction"] = np.eye(3).ravel()
        shape, arrays = image.GetDimensions()[::-1], image.GetPointData()
        for i in range(arrays.GetNumberOfArrays()):
            array = arrays.GetArray(i)
            values = vtk_to_numpy(array)
            rows.add(f"PointData/{array.GetName()}", values.reshape(1, *shape, *values.shape[1:]))
            rows.add(f"Steps/PointDataOffsets/{array.GetName()}", np.array([number]))
        rows.add("Steps/Values", np.array([float(time)]))
    rows.write()
    root["Steps"].attrs["NSteps"] = len(grid.time)
