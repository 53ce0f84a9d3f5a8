"""A run as VTKHDF: `ibfil vtk --hdf`, a file for all times of the filaments, of links, of bodies, of the fields.

    /VTKHDF                 Type, Version; of an image WholeExtent, Origin, Spacing, Direction
    /VTKHDF/Steps           NSteps, Values (the times), and where each time begins in the arrays
    /VTKHDF/Points, Lines   places; cells, which are kept once for as long as they stay the same
    /VTKHDF/PointData/...   (points of all times one after the other, ...) of lines; (time, z, y, x, ...) of images

ParaView 5.12 and later open it. The layout is of Kitware's file format VTKHDF 2.0; arrays are those of the .vtp and
.vti files, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..analysis.body_meshes import body_surfaces
from ..analysis.meshes import PLAIN, View, box_of, field_data, link_lines, polylines, rods_of
from ..errors import CaseError
from ..io.overwriting import Kind, refuse, replacing
from ..io.reader import RunFile

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet


VTKHDF = Kind("a file of VTKHDF", lambda path, head: head.startswith(b"\x89HDF") and b"VTKHDF" in head)
BLOCK = 2**24  # bytes gathered before they are written
_KINDS = ("Vertices", "Lines", "Polygons", "Strips")  # of cells, in the order of the offsets


def write_vtkhdf(
    run: str | Path, folder: str | Path | None = None, *, wrap: bool = False, images: int = 0, every: int = 1
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
        _write(paths[0], lambda file: _write_meshes(file, ((s.time, polylines(s, rods, box, view)) for s in shown())))
        if opened.links:
            paths.append(_place(folder, run, "links"))
            _write(paths[-1], lambda file: _write_meshes(file, ((s.time, link_lines(s)) for s in shown())))
        if opened.bodies:
            paths.append(_place(folder, run, "bodies"))
            _write(paths[-1], lambda file: _write_meshes(file, ((s.time, body_surfaces(opened, s)) for s in shown())))
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


def _root(file: h5py.File, kind: str) -> h5py.Group:
    root = file.create_group("VTKHDF")
    root.attrs.create("Type", kind.encode("ascii"), dtype=h5py.string_dtype("ascii", len(kind)))
    root.attrs["Version"] = np.array([2, 0], np.int64)
    return root


class _Rows:
    """Rows of datasets in a group, gathered and written in blocks: HDF5 takes as long for one row as for many."""

    def __init__(self, root: h5py.Group) -> None:
        self._root, self._kept = root, 0
        self._rows: dict[str, list[np.ndarray]] = {}

    def add(self, name: str, rows: np.ndarray) -> None:
        """More rows (n, ...) of the dataset ``name``, which is made for the first ones."""
        self._rows.setdefault(name, []).append(rows.copy())
        self._kept += rows.nbytes
        if self._kept > BLOCK:
            self.write()

    def write(self) -> None:
        """Write all that is gathered."""
        for name, gathered in self._rows.items():
            rows = np.concatenate(gathered)
            if name in self._root:
                dataset = self._root[name]
                dataset.resize(len(dataset) + len(rows), axis=0)
                dataset[len(dataset) - len(rows) :] = rows
                continue
            chunk = max(1, min(len(rows), 2**18 // max(rows[:1].nbytes, 1)))
            shape = {"maxshape": (None, *rows.shape[1:]), "chunks": (chunk, *rows.shape[1:])}
            self._root.create_dataset(name, data=rows, **shape)
        self._rows, self._kept = {}, 0


def _cells(mesh: vtkDataSet, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Where each cell of a kind begins, and the points of all of them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    get = {"Vertices": "GetVerts", "Lines": "GetLines", "Polygons": "GetPolys", "Strips": "GetStrips"}[kind]
    cells = getattr(mesh, get)()
    return vtk_to_numpy(cells.GetOffsetsArray()), vtk_to_numpy(cells.GetConnectivityArray())


def _write_meshes(file: h5py.File, meshes: Iterator[tuple[float, vtkDataSet]]) -> None:
    """A temporal PolyData: points of all times, and cells where they differ from those before."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    root = _root(file, "PolyData")
    rows = _Rows(root)
    last: list[np.ndarray] = []
    part, points, cells, ids = -1, 0, np.zeros(4, np.int64), np.zeros(4, np.int64)
    new_cells, new_ids = np.zeros(4, np.int64), np.zeros(4, np.int64)
    for time, mesh in meshes:
        topology = [_cells(mesh, kind) for kind in _KINDS]
        arrays = [array for pair in topology for array in pair]
        if not last or not all(np.array_equal(one, other) for one, other in zip(arrays, last, strict=True)):
            part, cells, ids, last = part + 1, cells + new_cells, ids + new_ids, [array.copy() for array in arrays]
            new_cells = np.array([len(offsets) - 1 for offsets, _ in topology])
            new_ids = np.array([len(each) for _, each in topology])
            _append_topology(rows, mesh.GetNumberOfPoints(), topology)
        values = mesh.GetPointData()
        for i in range(values.GetNumberOfArrays()):
            array = values.GetArray(i)
            rows.add(f"PointData/{array.GetName()}", vtk_to_numpy(array))
            rows.add(f"Steps/PointDataOffsets/{array.GetName()}", np.array([points]))
        rows.add("Points", vtk_to_numpy(mesh.GetPoints().GetData()))
        _append_step(rows, time, part, points, cells, ids)
        points += mesh.GetNumberOfPoints()
    rows.write()
    root["Steps"].attrs["NSteps"] = len(root["Steps/Values"])


def _append_topology(rows: _Rows, points: int, topology: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """A part: its cells of each kind."""
    rows.add("NumberOfPoints", np.array([points]))
    for kind, (offsets, each) in zip(_KINDS, topology, strict=True):
        rows.add(f"{kind}/Offsets", offsets)
        rows.add(f"{kind}/NumberOfCells", np.array([len(offsets) - 1]))
        rows.add(f"{kind}/NumberOfConnectivityIds", np.array([len(each)]))
        rows.add(f"{kind}/Connectivity", each)


def _append_step(rows: _Rows, time: float, part: int, points: int, cells: np.ndarray, ids: np.ndarray) -> None:
    """A time: the part that it shows, and where its points begin, and its cells of each kind (4,)."""
    rows.add("Steps/Values", np.array([time]))
    rows.add("Steps/NumberOfParts", np.array([1]))
    rows.add("Steps/PartOffsets", np.array([part]))
    rows.add("Steps/PointOffsets", np.array([points]))
    for name, begin in (("CellOffsets", cells), ("ConnectivityIdOffsets", ids)):
        rows.add(f"Steps/{name}", begin[None])


def _write_fields(file: h5py.File, run: RunFile) -> None:
    """A temporal ImageData of the fields, of which every time has a slice."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = run.grid
    assert grid is not None
    root = _root(file, "ImageData")
    rows = _Rows(root)
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
