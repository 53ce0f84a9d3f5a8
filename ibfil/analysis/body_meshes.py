"""Bodies at an output as surfaces for ParaView and pictures, with their axes as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet

    from ..case.schema import Case
    from ..io.reader import RunFile
    from ..io.snapshots import BodySnapshot, Snapshot

ROUND, UP = 32, 16  # facets of an ellipsoid about its third axis, and along it
BEYOND = 1.35  # of a semi-axis: how far its line goes


def extents(run: RunFile) -> list[np.ndarray]:
    """The ends of the axes (T, 6, 3) of each body of a run that has a size: what a picture has to have in it."""
    return ends_of_axes(run.case, run.bodies)


def ends_of_axes(case: Case, bodies: Mapping[str, Mapping[str, Any]]) -> list[np.ndarray]:
    """The same of ``bodies`` as columns (T, 3) of position, e1, e2, e3 by name."""
    out = []
    for name, columns in bodies.items():
        size = case.bodies[name].shape.semi_axes
        if any(size):
            centre = np.asarray(columns["position"])
            arms = [a * np.asarray(columns[key]) for a, key in zip(size, ("e1", "e2", "e3"), strict=True)]
            out.append(np.stack([centre + sign * arm for arm in arms for sign in (1, -1)], axis=1))
    return out


def body_surfaces(run: RunFile, snapshot: Snapshot) -> vtkDataSet:
    """All bodies at one time as vtkPolyData: ellipsoids and, as lines from the centre, their axes; unwrapped.

    At points: ``velocity`` of the body there, the number of the ``body``, and ``axis``: 1, 2, 3 on the lines, else 0.
    Joints have no size, and are left out.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    points: list[np.ndarray] = [np.zeros((0, 3))]
    velocity: list[np.ndarray] = [np.zeros((0, 3))]
    number, axis = [np.zeros(0, np.int32)], [np.zeros(0, np.int32)]
    faces, lines = vtkCellArray(), vtkCellArray()
    count = 0
    for k, (name, body) in enumerate(snapshot.bodies.items()):
        size = np.array(run.case.bodies[name].shape.semi_axes)
        if not size.any():
            continue
        away, which = _arms(body, size)
        for face in _FACES:
            _cell(faces, count + face)
        for i in range(3):
            _cell(lines, count + len(_SPHERE) + np.array([2 * i, 2 * i + 1]))
        points.append(body.position + away)
        velocity.append(body.velocity + np.cross(body.spin, away))
        number.append(np.full(len(away), k, np.int32))
        axis.append(which)
        count += len(away)
    data, places = vtkPolyData(), vtkPoints()
    places.SetData(numpy_to_vtk(np.concatenate(points), deep=True))
    data.SetPoints(places)
    data.SetPolys(faces)
    data.SetLines(lines)
    for key, values in (("velocity", velocity), ("body", number), ("axis", axis)):
        array = numpy_to_vtk(np.concatenate(values), deep=True)
        array.SetName(key)
        data.GetPointData().AddArray(array)
    stamp = numpy_to_vtk(np.array([snapshot.time]), deep=True)
    stamp.SetName("TimeValue")
    data.GetFieldData().AddArray(stamp)
    return data


def _arms(body: BodySnapshot, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points of a body (k, 3) from its centre: of its surface, then of its axes; and which axis each is on (k,)."""
    axes = np.stack([body.e1, body.e2, body.e3])
    tips = BEYOND * size[:, None] * axes
    lines = np.stack([np.zeros_like(tips), tips], axis=1).reshape(6, 3)
    which = np.concatenate([np.zeros(len(_SPHERE)), np.repeat([1, 2, 3], 2)]).astype(np.int32)
    return np.concatenate([_SPHERE * size @ axes, lines]), which


def _sphere() -> tuple[np.ndarray, list[np.ndarray]]:
    """The points (k, 3) of a sphere of radius one, and its facets as their numbers."""
    theta = np.linspace(0.0, np.pi, UP + 1)[:, None]
    phi = 2 * np.pi * np.arange(ROUND)[None] / ROUND
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1)
    faces = []
    for i in range(UP):
        for j in range(ROUND):
            right = (j + 1) % ROUND
            corners = [i * ROUND + j, (i + 1) * ROUND + j, (i + 1) * ROUND + right, i * ROUND + right]
            faces.append(np.array(corners))
    return points.reshape(-1, 3), faces


_SPHERE, _FACES = _sphere()


def _cell(cells, points: np.ndarray) -> None:
    cells.InsertNextCell(len(points))
    for point in points:
        cells.InsertCellPoint(int(point))
