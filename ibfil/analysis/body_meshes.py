"""Bodies at an output as surfaces for ParaView and pictures, with their axes as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..assembly.fluids.shells import apart
from .meshes import PLAIN, View, add_array, box_of, known_box

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkDataSet

    from ..case.schema import Case
    from ..io.reader import RunFile
    from ..io.snapshots import BodySnapshot, Snapshot

Columns = Mapping[str, Mapping[str, Any]]

ROUND, UP = 32, 16  # facets of an ellipsoid about its third axis, and along it
BEYOND = 1.35  # of a semi-axis: how far its line goes
GRAIN = 0.4  # of the distance of neighbours: how large a marker is drawn
_OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])
_SIDES = np.array([[i, j, k] for i in (0, 3) for j in (1, 4) for k in (2, 5)])


def drawn(case: Case, bodies: Columns) -> list[tuple[Mapping[str, Any], tuple[float, float, float]]]:
    """The columns over time of those ``bodies`` that are to be seen, with their semi-axes: all but joints."""
    tables = case.each_body
    each = [(columns, tables[name].shape.semi_axes) for name, columns in bodies.items()]
    return [(columns, size) for columns, size in each if any(size) or "markers" in columns]


def grain(markers: np.ndarray) -> float:
    """How far a marker (k, 3) is drawn to reach."""
    return GRAIN * float(np.median(apart(markers)))


def extents(run: RunFile) -> list[np.ndarray]:
    """The ends of the axes (T, 6, 3) of each body of a run that has a size: what a picture has to have in it."""
    return ends_of_axes(run.case, run.bodies)


def ends_of_axes(case: Case, bodies: Columns) -> list[np.ndarray]:
    """The same of ``bodies`` as columns (T, 3) of position, e1, e2, e3 by name, and markers (T, k, 3) of a file."""
    out = []
    for columns, size in drawn(case, bodies):
        centre, axes = np.asarray(columns["position"]), [np.asarray(columns[key]) for key in ("e1", "e2", "e3")]
        if "markers" in columns:
            first = np.asarray(columns["markers"])[0] - centre[0]
            reach = [(float(np.max(first @ e[0])), float(np.min(first @ e[0]))) for e in axes]
            out.append(
                np.stack([centre + far * e for e, both in zip(axes, reach, strict=True) for far in both], axis=1)
            )
        else:
            arms = [a * e for a, e in zip(size, axes, strict=True)]
            out.append(np.stack([centre + sign * arm for arm in arms for sign in (1, -1)], axis=1))
    return out


def body_surfaces(run: RunFile, snapshot: Snapshot, view: View = PLAIN) -> vtkDataSet:
    """All bodies at one time as vtkPolyData: ellipsoids and, as lines from the centre, their axes.

    Markers of a file are small octahedra.
    At points: ``velocity`` of the body there, the number of the ``body``, and ``axis``: 1, 2, 3 on the lines, else 0.
    Wrapped ones are whole, with their centre in the periodic box; images carry which box they are in (``image``).
    Joints have no size, and are left out. Raises ValueError where ``view`` asks for a box and there is none.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    tables = run.case.each_body
    shapes = {name: np.array(tables[name].shape.semi_axes) for name in snapshot.bodies}
    solids = [one for k, (name, body) in enumerate(snapshot.bodies.items()) for one in _solid(k, body, shapes[name])]
    shifts, sizes, box = view.shifts, [len(solid.away) for solid in solids], known_box(box_of(run), view)
    centres = view.brought(np.array([solid.body.position for solid in solids]).reshape(-1, 1, 3), box)
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    whole = _joined([centre + solid.away for centre, solid in zip(centres, solids, strict=True)], (0, 3))
    places = whole + (shifts * box)[:, None]
    velocity = _joined([solid.body.velocity + np.cross(solid.body.spin, solid.away) for solid in solids], (0, 3))
    arrays = {
        "velocity": np.tile(velocity, (len(shifts), 1)),
        "body": np.tile(np.repeat([solid.number for solid in solids], sizes), len(shifts)).astype(np.int32),
        "axis": np.tile(_joined([solid.axis for solid in solids], (0,)), len(shifts)).astype(np.int32),
    }
    if view.images:
        arrays["image"] = np.repeat(shifts, first[-1], axis=0).astype(np.int32)
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(places.reshape(-1, 3)), deep=True))
    data.SetPoints(points)
    starts = [first[-1] * k + at for k in range(len(shifts)) for at in first[:-1]]
    data.SetPolys(_cells([solid.faces for solid in solids] * len(shifts), starts))
    data.SetLines(_cells([solid.lines for solid in solids] * len(shifts), starts))
    for key, values in arrays.items():
        add_array(data.GetPointData(), key, values)
    add_array(data.GetFieldData(), "TimeValue", np.array([snapshot.time]))
    return data


def _joined(parts: list[np.ndarray], none: tuple[int, ...]) -> np.ndarray:
    return np.concatenate([np.zeros(none), *parts])


def _cells(each: list[np.ndarray], starts: list[np.int64]) -> vtkCellArray:
    """The cells of bodies by the numbers (f, k) of their own points, which begin at ``starts``."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    none = [np.zeros(0, np.int64)]
    whole = np.concatenate(none + [(at + cells).ravel() for cells, at in zip(each, starts, strict=True)])
    corners = np.concatenate(none + [np.full(len(cells), cells.shape[1]) for cells in each])
    offsets = np.concatenate([[0], np.cumsum(corners)]).astype(np.int64)
    cells = vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(whole, deep=True))
    return cells


class _Solid(NamedTuple):
    """A body to be drawn: its points (k, 3) from its centre, facets and lines by these, the axis that each is on."""

    number: int
    body: BodySnapshot
    away: np.ndarray
    faces: np.ndarray
    lines: np.ndarray
    axis: np.ndarray


def _solid(number: int, body: BodySnapshot, size: np.ndarray) -> list[_Solid]:
    """A body of semi-axes ``size`` as an ellipsoid, or its markers, and its axes; a joint is none."""
    axes = np.stack([body.e1, body.e2, body.e3])
    if body.markers is not None:
        from_centre = np.asarray(body.markers) - body.position
        size = np.abs(from_centre @ axes.T).max(axis=0)
        surface = (from_centre[:, None] + grain(from_centre) * _OCTAHEDRON @ axes).reshape(-1, 3)
        faces = (6 * np.arange(len(from_centre))[:, None, None] + _SIDES).reshape(-1, 3)
    elif size.any():
        surface, faces = _SPHERE * size @ axes, _FACES
    else:
        return []
    tips = BEYOND * size[:, None] * axes
    lines = np.stack([np.zeros_like(tips), tips], axis=1).reshape(6, 3)
    which = np.concatenate([np.zeros(len(surface)), np.repeat([1, 2, 3], 2)])
    at = len(surface) + np.arange(6).reshape(3, 2)
    return [_Solid(number, body, np.concatenate([surface, lines]), faces, at, which)]


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
