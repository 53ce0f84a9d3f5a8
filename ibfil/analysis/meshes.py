"""Outputs of a run as vtk's own datasets: filaments as polylines, fields as images. vtk is imported only then."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..assembly.fluids.models import fluid_model
from .periodic_images import Pieces, unwrapped, wrapped

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet

    from ..case.filament import Filament
    from ..case.schema import Case
    from ..io.reader import RunFile
    from ..io.snapshots import FilamentSnapshot, Snapshot


class View(NamedTuple):
    """How a scene is shown: brought into the periodic box, and its images in so many boxes on each side."""

    wrap: bool = False
    images: int = 0

    @property
    def shifts(self) -> np.ndarray:
        """Which boxes (k, 3) are shown, that of the scene itself first."""
        every = product(range(-self.images, self.images + 1), repeat=3)
        return np.array(sorted(every, key=lambda shift: shift != (0, 0, 0)))

    def brought(self, centre: np.ndarray, box: np.ndarray) -> np.ndarray:
        """The places (.., 3), in the box (3,) about the origin where the scene is wrapped."""
        return centre - box * np.floor(centre / box + 0.5) if self.wrap else centre


PLAIN = View()


class Rod(NamedTuple):
    """The constants of a filament in a run: arclength (N,), and the radius (N,) of the tube it is shown as."""

    s: np.ndarray
    radius: np.ndarray


def rods_of(run: RunFile) -> dict[str, Rod]:
    """All filaments of a run by name."""
    return {name: rod_of(run.case, run.filament(name), run.arclength(name)) for name in run.filaments}


def rod_of(case: Case, filament: Filament, s: np.ndarray) -> Rod:
    """A filament with nodes at the arclengths ``s`` (N,).

    The tube is the material radius where the case gives one; else the hydrodynamic radius that the grid gives a line;
    else, under rft, a hundredth of the length.
    """
    if filament.radius is not None:
        return Rod(s, np.broadcast_to(np.asarray(filament.radius.bind("s")(s), float), s.shape))
    radius = fluid_model(case).line_radius
    return Rod(s, np.full(s.shape, 0.01 * filament.length if radius is None else radius))


def filament_data(run: RunFile, output: int, view: View = PLAIN) -> vtkDataSet:
    """All filaments at output number ``output`` as vtkPolyData (`polylines`).

    Raises ValueError where ``view`` asks for a periodic box and the case has none.
    """
    return polylines(run.snapshot(output), rods_of(run), box_of(run), view)


def field_data(run: RunFile, number: int) -> vtkDataSet:
    """The fields written at ``grid.time[number]`` as vtkImageData, with the Q-criterion where there is a velocity."""
    grid = run.grid
    assert grid is not None
    fields = {name: column[number] for name, column in grid.fields.items()}
    if "velocity" in fields:
        fields["q_criterion"] = q_criterion(fields["velocity"], grid.spacing)
    return image(fields, grid.origin, grid.spacing, float(grid.time[number]))


def box_of(run: RunFile) -> np.ndarray | None:
    """The periodic box (3,), centred on the origin; None where the fluid has none."""
    return fluid_model(run.case).box


def directors(position: np.ndarray, e1: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """e2 and e3 (..., N, 3) of a filament: e3 is its tangent by central differences, made normal to e1 (..., N, 3)."""
    tangent = np.gradient(position, s, axis=-2, edge_order=2)
    tangent = tangent - np.sum(tangent * e1, axis=-1, keepdims=True) * e1
    e3 = tangent / np.linalg.norm(tangent, axis=-1, keepdims=True)
    return np.cross(e3, e1), e3


def q_criterion(velocity: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Q = (|W|^2 - |S|^2)/2 (nx, ny, nz) of a velocity (nx, ny, nz, 3), the excess of rotation over strain.

    -tr(G G)/2 + tr(G)^2/2 of the gradient G by central differences of second order, one-sided at the faces: a
    background flow need not be periodic; along an axis with one point zero. Hunt, Wray and Moin, Center for Turbulence
    Research report S88, 1988.
    """
    u = np.moveaxis(velocity.astype(float), -1, 0)
    gradient = np.stack([_derivative(u, axis, spacing[axis - 1]) for axis in (1, 2, 3)], axis=1)
    trace = np.einsum("aa...->...", gradient)
    return 0.5 * (trace**2 - np.einsum("ab...,ba...->...", gradient, gradient))


def _derivative(values: np.ndarray, axis: int, spacing: float) -> np.ndarray:
    """By central differences, at the ends of the second order that so many points allow; of one point zero."""
    points = values.shape[axis]
    if points == 1:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, spacing, axis=axis, edge_order=min(2, points - 1)))


def polylines(
    snapshot: Snapshot, rods: dict[str, Rod], box: np.ndarray | None = None, view: View = PLAIN
) -> vtkDataSet:
    """All filaments at one time as vtkPolyData: a polyline a filament, arrays at the nodes in float32.

    Wrapped ones are cut at the faces of the box, with points there; images carry which box they are in (``image``).
    """
    box = known_box(box, view)
    points: list[np.ndarray] = []
    arrays: list[dict[str, np.ndarray]] = []
    lengths: list[int] = []
    for number, (name, rod) in enumerate(rods.items()):
        filament = snapshot.filaments[name]
        pieces = wrapped(filament.position, -0.5 * box, box) if view.wrap else unwrapped(len(rod.s))
        own = pieces.take(filament.position) - pieces.image * box
        shown = _on(pieces, node_arrays(filament, rod))
        shown["filament"] = np.full(len(own), number, np.int32)
        for shift in view.shifts:
            points.append(own + shift * box)
            more = {"image": np.tile(shift.astype(np.int32), (len(own), 1))} if view.images else {}
            arrays.append(shown | more)
            lengths += pieces.lengths
    return _poly_data(np.concatenate(points), lengths, arrays, snapshot.time)


def known_box(box: np.ndarray | None, view: View) -> np.ndarray:
    """The periodic box (3,), zero where there is none. Raises ValueError where ``view`` asks for one."""
    if box is None and view != PLAIN:
        raise ValueError("periodic images and wrapping need a box, and this run has none")
    return np.zeros(3) if box is None else box


def wall_plane(run: RunFile) -> vtkDataSet | None:
    """The wall as a rectangle, wider than the rods' way over the run by as much on each side; None where none is."""
    height = fluid_model(run.case).wall
    if height is None:
        return None
    from vtkmodules.vtkFiltersSources import vtkPlaneSource

    paths = [np.asarray(columns["position"])[:, :, :2].reshape(-1, 2) for columns in run.filaments.values()]
    low, high = np.min([p.min(axis=0) for p in paths], axis=0), np.max([p.max(axis=0) for p in paths], axis=0)
    wide = max(float(np.max(high - low)), *(filament.length for filament in run.case.filaments.values()))
    (x, y), (far_x, far_y) = low - wide, high + wide
    plane = vtkPlaneSource()
    plane.SetOrigin(x, y, height)
    plane.SetPoint1(far_x, y, height)
    plane.SetPoint2(x, far_y, height)
    plane.Update()
    return plane.GetOutput()


def link_lines(snapshot: Snapshot, box: np.ndarray | None = None, view: View = PLAIN) -> vtkDataSet:
    """All links at one time as vtkPolyData: a line an element, from point to point.

    At both points: the size of its force (``link_force``), the force on that point (``force``), the number of the link
    and ``tension``, ``slide`` and ``shear``, no number where its kind has none. Wrapped lines are whole, with their
    middle in the periodic box; images carry which box they are in (``image``).
    """
    box = known_box(box, view)
    points: list[np.ndarray] = []
    arrays: list[dict[str, np.ndarray]] = []
    for number, link in enumerate(snapshot.links.values()):
        middle = 0.5 * (link.first + link.second)
        ends = np.stack([link.first, link.second], axis=1) + (view.brought(middle, box) - middle)[:, None]
        count, vectors = len(link.first), np.stack([-link.force, link.force], axis=1).reshape(-1, 3)
        size = np.linalg.norm(vectors, axis=1)
        shown = {"link_force": size, "force": vectors, "link": np.full(2 * count, number, np.int32)}
        for name in ("tension", "slide", "shear"):
            values = getattr(link, name)
            shown[name] = np.repeat(np.full(count, np.nan) if values is None else values, 2)
        shown = {k: v if v.dtype == np.int32 else v.astype(np.float32) for k, v in shown.items()}
        for shift in view.shifts:
            points.append(ends.reshape(-1, 3) + shift * box)
            more = {"image": np.tile(shift.astype(np.int32), (2 * count, 1))} if view.images else {}
            arrays.append(shown | more)
    whole = np.concatenate(points)
    return _poly_data(whole, [2] * (len(whole) // 2), arrays, snapshot.time)


def _on(pieces: Pieces, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {key: pieces.take(values).astype(np.float32) for key, values in arrays.items()}


def _poly_data(
    points: np.ndarray, lengths: Sequence[int], arrays: Sequence[dict[str, np.ndarray]], time: float
) -> vtkDataSet:
    """Polylines of so many points each, one after the other."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    nodes = vtkPoints()
    nodes.SetData(numpy_to_vtk(points, deep=True))
    offsets = np.cumsum([0, *lengths], dtype=np.int64)
    lines = vtkCellArray()
    each = np.arange(offsets[-1], dtype=np.int64)
    lines.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(each, deep=True))
    data = vtkPolyData()
    data.SetPoints(nodes)
    data.SetLines(lines)
    for key in arrays[0]:
        add_array(data.GetPointData(), key, np.concatenate([shown[key] for shown in arrays]))
    add_array(data.GetFieldData(), "TimeValue", np.array([time]))
    return data


def node_arrays(filament: FilamentSnapshot, rod: Rod) -> dict[str, np.ndarray]:
    """The arrays of one filament as they appear in ParaView, all with N rows; over several times (T, N, ...)."""
    e2, e3 = directors(filament.position, filament.e1, rod.s)
    return {
        "velocity": filament.velocity,
        "force": filament.force,
        "moment": filament.moment,
        "strain": filament.strain,
        "e1": filament.e1,
        "e2": e2,
        "e3": e3,
        "tension": at_nodes(filament.tension),
        "tube_radius": rod.radius,
        "arclength": rod.s,
    }


def at_nodes(tension: np.ndarray) -> np.ndarray:
    """The tension (..., N) of nodes from that of segments (..., N - 1): the mean of its two, of an end its only one."""
    return 0.5 * (np.append(tension[..., :1], tension, axis=-1) + np.append(tension, tension[..., -1:], axis=-1))


def image(fields: dict[str, np.ndarray], origin: np.ndarray, spacing: np.ndarray, time: float) -> vtkDataSet:
    """Fields (nx, ny, nz) or (nx, ny, nz, 3) at one time as vtkImageData, float32.

    Point (i, j, k) lies at origin + spacing (i, j, k). VTK counts x fastest and the run file z, hence the
    transpose.
    """
    from vtkmodules.vtkCommonDataModel import vtkImageData

    data = vtkImageData()
    data.SetOrigin(*map(float, origin))
    data.SetSpacing(*map(float, spacing))
    for name, values in fields.items():
        data.SetDimensions(*values.shape[:3])
        ordered = values.transpose(2, 1, 0, *range(3, values.ndim))
        add_array(data.GetPointData(), name, ordered.reshape(-1, *values.shape[3:]).astype(np.float32))
    add_array(data.GetFieldData(), "TimeValue", np.array([time]))
    return data


def add_array(attributes: Any, name: str, values: np.ndarray) -> None:
    """Puts an array (n,) or (n, 3) into point or field data, under a name that ParaView can take."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name.replace("/", "_").replace(".", "_"))
    attributes.AddArray(array)
