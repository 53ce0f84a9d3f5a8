"""Bodies at an output as surfaces for ParaView and pictures, with their axes as lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .meshes import PLAIN, View, add_array, box_of, known_box

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkDataSet

    from ..io.reader import RunFile
    from ..io.snapshots import BodySnapshot, Snapshot

ROUND, UP = 32, 16  # facets of an ellipsoid about its third axis, and along it
BEYOND = 1.35  # of a semi-axis: how far its line goes


def extents(run: RunFile) -> list[np.ndarray]:
    """The ends of the axes (T, 6, 3) of each body of a run that has a size: what a picture has to have in it."""
    out, each = [], run.case.each_body
    for name, columns in run.bodies.items():
        size = each[name].shape.semi_axes
        if any(size):
            centre = np.asarray(columns["position"])
            arms = [a * np.asarray(columns[key]) for a, key in zip(size, ("e1", "e2", "e3"), strict=True)]
            out.append(np.stack([centre + sign * arm for arm in arms for sign in (1, -1)], axis=1))
    return out


def body_surfaces(run: RunFile, snapshot: Snapshot, view: View = PLAIN) -> vtkDataSet:
    """All bodies at one time as vtkPolyData: ellipsoids and, as lines from the centre, their axes.

    At points: ``velocity`` of the body there, the number of the ``body``, and ``axis``: 1, 2, 3 on the lines, else 0.
    Wrapped ones are whole, with their centre in the periodic box; images carry which box they are in (``image``).
    Joints have no size, and are left out. Raises ValueError where ``view`` asks for a box and there is none.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    tables = run.case.each_body
    sizes = [np.array(tables[name].shape.semi_axes) for name in snapshot.bodies]
    every = zip(snapshot.bodies.values(), sizes, strict=True)
    solid = [(k, body, size) for k, (body, size) in enumerate(every) if size.any()]
    each, shifts = len(_SPHERE) + 6, view.shifts
    away = np.array([_arms(body, size) for _, body, size in solid]).reshape(-1, each, 3)
    centre, velocity, spin = (
        np.array([getattr(body, key) for _, body, _ in solid]).reshape(-1, 1, 3)
        for key in ("position", "velocity", "spin")
    )
    box = known_box(box_of(run), view)
    places = view.brought(centre, box) + away + (shifts * box)[:, None, None]
    count = len(shifts) * len(solid)
    arrays = {
        "velocity": np.broadcast_to(velocity + np.cross(spin, away), places.shape).reshape(-1, 3),
        "body": np.tile(np.repeat([k for k, _, _ in solid], each), len(shifts)).astype(np.int32),
        "axis": np.tile(_WHICH, count),
    }
    if view.images:
        arrays["image"] = np.repeat(shifts, len(solid) * each, axis=0).astype(np.int32)
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(places.reshape(-1, 3)), deep=True))
    data.SetPoints(points)
    data.SetPolys(_cells(_FACES, each, count))
    data.SetLines(_cells(len(_SPHERE) + np.arange(6).reshape(3, 2), each, count))
    for key, values in arrays.items():
        add_array(data.GetPointData(), key, values)
    add_array(data.GetFieldData(), "TimeValue", np.array([snapshot.time]))
    return data


def _cells(corners: np.ndarray, each: int, count: int) -> vtkCellArray:
    """The cells of a body by the numbers (f, k) of its points, for ``count`` bodies of ``each`` points."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    whole = (corners + each * np.arange(count)[:, None, None]).reshape(-1).astype(np.int64)
    offsets = np.arange(0, len(whole) + 1, corners.shape[1], dtype=np.int64)
    cells = vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(whole, deep=True))
    return cells


def _arms(body: BodySnapshot, size: np.ndarray) -> np.ndarray:
    """The points of a body (k, 3) from its centre: of its surface, then of its axes."""
    axes = np.stack([body.e1, body.e2, body.e3])
    tips = BEYOND * size[:, None] * axes
    lines = np.stack([np.zeros_like(tips), tips], axis=1).reshape(6, 3)
    return np.concatenate([_SPHERE * size @ axes, lines])


def _sphere() -> tuple[np.ndarray, np.ndarray]:
    """The points (k, 3) of a sphere of radius one, and its facets (f, 4) as their numbers."""
    theta = np.linspace(0.0, np.pi, UP + 1)[:, None]
    phi = 2 * np.pi * np.arange(ROUND)[None] / ROUND
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)
    i, j = (part.ravel() for part in np.meshgrid(np.arange(UP), np.arange(ROUND), indexing="ij"))
    right = (j + 1) % ROUND
    faces = np.column_stack([i * ROUND + j, (i + 1) * ROUND + j, (i + 1) * ROUND + right, i * ROUND + right])
    return points.reshape(-1, 3), faces


_SPHERE, _FACES = _sphere()
_WHICH = np.concatenate([np.zeros(len(_SPHERE)), np.repeat([1, 2, 3], 2)]).astype(np.int32)  # axis each point is on
