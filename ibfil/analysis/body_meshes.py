"""Bodies at an output as surfaces for ParaView and pictures, with their axes as lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet

    from ..io.column import Column
    from ..io.reader import RunFile
    from ..io.snapshots import BodySnapshot, Snapshot

ROUND, UP = 32, 16  # facets of an ellipsoid about its third axis, and along it
BEYOND = 1.35  # of a semi-axis: how far its line goes
GRAIN = 0.4  # of the distance of neighbours: how large a marker is drawn
_OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
_SIDES = [np.array([i, j, k]) for i in (0, 3) for j in (1, 4) for k in (2, 5)]


def drawn(run: RunFile) -> list[dict[str, Column]]:
    """The columns of those bodies of a run that are to be seen: all but joints."""
    return [
        columns
        for name, columns in run.bodies.items()
        if any(run.case.bodies[name].shape.semi_axes) or "markers" in columns
    ]


def grain(markers: np.ndarray) -> float:
    """How far a marker (k, 3) is drawn to reach."""
    apart = np.linalg.norm(markers[:, None] - markers, axis=2)
    np.fill_diagonal(apart, np.inf)
    return GRAIN * float(np.median(apart.min(axis=1)))


def extents(run: RunFile) -> list[np.ndarray]:
    """The ends of the axes (T, 6, 3) of each body of a run that has a size: what a picture has to have in it."""
    out = []
    for name, columns in run.bodies.items():
        size = run.case.bodies[name].shape.semi_axes
        centre, axes = np.asarray(columns["position"]), [np.asarray(columns[key]) for key in ("e1", "e2", "e3")]
        if "markers" in columns:
            first = np.asarray(columns["markers"])[0] - centre[0]
            reach = [(float(np.max(first @ e[0])), float(np.min(first @ e[0]))) for e in axes]
            out.append(
                np.stack([centre + far * e for e, both in zip(axes, reach, strict=True) for far in both], axis=1)
            )
        elif any(size):
            arms = [a * e for a, e in zip(size, axes, strict=True)]
            out.append(np.stack([centre + sign * arm for arm in arms for sign in (1, -1)], axis=1))
    return out


def body_surfaces(run: RunFile, snapshot: Snapshot) -> vtkDataSet:
    """All bodies at one time as vtkPolyData: ellipsoids and, as lines from the centre, their axes; unwrapped.

    Markers of a file are small octahedra.
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
        if body.markers is not None:
            surface, cells, size = _markers(body)
        elif size.any():
            surface, cells = _SPHERE * size @ np.stack([body.e1, body.e2, body.e3]), _FACES
        else:
            continue
        tips, which = _arms(body, size)
        away, which = np.concatenate([surface, tips]), np.concatenate([np.zeros(len(surface), np.int32), which])
        for face in cells:
            _cell(faces, count + face)
        for i in range(3):
            _cell(lines, count + len(surface) + np.array([2 * i, 2 * i + 1]))
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
    """The ends of a body's axes (6, 3) from its centre, two a line; and which axis each is on (6,)."""
    tips = BEYOND * size[:, None] * np.stack([body.e1, body.e2, body.e3])
    return np.stack([np.zeros_like(tips), tips], axis=1).reshape(6, 3), np.repeat([1, 2, 3], 2).astype(np.int32)


def _markers(body: BodySnapshot) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """The corners (k, 3) of octahedra at its markers, from its centre, their sides, and half its extents (3,)."""
    axes, away = np.stack([body.e1, body.e2, body.e3]), np.asarray(body.markers) - body.position
    corners = away[:, None] + grain(away) * _OCTAHEDRON @ axes
    sides = [6 * k + side for k in range(len(away)) for side in _SIDES]
    return corners.reshape(-1, 3), sides, np.abs(away @ axes.T).max(axis=0)


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
