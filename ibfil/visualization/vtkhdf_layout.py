"""The layout of Kitware's file format VTKHDF 2.0: its groups, datasets that grow, cells and times of a PolyData."""

from __future__ import annotations

import h5py
import numpy as np

KINDS = ("Vertices", "Lines", "Polygons", "Strips")  # of cells, in the order of the offsets
BLOCK = 2**24  # bytes gathered before they are written


def new_root(file: h5py.File, kind: str) -> h5py.Group:
    """The group of a file that all of a PolyData or ImageData (``kind``) is in."""
    root = file.create_group("VTKHDF")
    root.attrs.create("Type", kind.encode("ascii"), dtype=h5py.string_dtype("ascii", len(kind)))
    root.attrs["Version"] = np.array([2, 0], np.int64)
    return root


class Rows:
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


def add_cells(rows: Rows, points: int, topology: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """A part: its cells of each kind."""
    rows.add("NumberOfPoints", np.array([points]))
    for kind, (offsets, each) in zip(KINDS, topology, strict=True):
        rows.add(f"{kind}/Offsets", offsets)
        rows.add(f"{kind}/NumberOfCells", np.array([len(offsets) - 1]))
        rows.add(f"{kind}/NumberOfConnectivityIds", np.array([len(each)]))
        rows.add(f"{kind}/Connectivity", each)


def add_time(rows: Rows, time: float, part: int, points: int, cells: np.ndarray, ids: np.ndarray) -> None:
    """A time: the part that it shows, and where its points begin, and its cells of each kind (4,)."""
    rows.add("Steps/Values", np.array([time]))
    rows.add("Steps/NumberOfParts", np.array([1]))
    rows.add("Steps/PartOffsets", np.array([part]))
    rows.add("Steps/PointOffsets", np.array([points]))
    for name, begin in (("CellOffsets", cells), ("ConnectivityIdOffsets", ids)):
        rows.add(f"Steps/{name}", begin[None])
