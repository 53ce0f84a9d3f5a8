"""A run as ParaView files.

One .pvd collection with the real times, a .vtp of all filaments for each output, a .vti for
each grid field time.

Written with vtk's own XML writers (appended raw data, 64-bit header, no compressor), which are imported when
the first file is written: a run never loads them. A step's file is complete before the collection names it,
files that would not change are left alone, and numbers follow the run's outputs, so that writing a run again
after it has been resumed extends the collection and never doubles a time.
"""

from __future__ import annotations

import bisect
import filecmp
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from .record import RunFile

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet

    from .frames import FilamentFrame, Frame


def write_vtk(run: str | Path, folder: str | Path | None = None) -> Path:
    """Write the run file ``run`` into ``folder``, by default the run's name; returns the path of the .pvd.

    A time at which only filaments or only fields were put out shows the last of the other before it, which is
    what ParaView itself does with two sources. Raises what RunFile raises for a file that is no run, OSError
    where a file cannot be written.
    """
    run = Path(run)
    folder = run.with_suffix("") if folder is None else Path(folder)
    with RunFile(run) as record:
        folder.mkdir(parents=True, exist_ok=True)
        filaments = list(_write_filaments(record, folder, run.stem))
        fields = list(_write_fields(record, folder, run.stem))
    return _write_collection(folder / f"{run.stem}.pvd", [filaments, fields])


def _write_filaments(record: RunFile, folder: Path, stem: str) -> Iterator[tuple[float, str]]:
    """One .vtp for each output; yields its time and name."""
    rods = {name: _rod(record, name) for name in record.filaments}
    for i, frame in enumerate(record.frames()):
        file = f"{stem}_filaments_{i:06d}.vtp"
        _save(polylines(frame, rods), folder / file)
        yield frame.time, file


def _write_fields(record: RunFile, folder: Path, stem: str) -> Iterator[tuple[float, str]]:
    """One .vti for each time at which fields were put out; yields its time and name."""
    grid = record.grid
    if grid is None:
        return
    for i, time in enumerate(np.asarray(grid.time).tolist()):
        fields = {name: column[i] for name, column in grid.fields.items()}
        file = f"{stem}_grid_{i:06d}.vti"
        _save(image(fields, grid.origin, grid.spacing, time), folder / file)
        yield time, file


class Rod(NamedTuple):
    """What a filament keeps through a run: arclength (N,), and material radius (N,) or None."""

    s: np.ndarray
    radius: np.ndarray | None


def _rod(record: RunFile, name: str) -> Rod:
    s, radius = record.arclength(name), record.case.filaments[name].radius
    return Rod(s, None if radius is None else np.broadcast_to(radius.bind("s")(s), s.shape))


def directors(position: np.ndarray, e1: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """e2 and e3 (N, 3) of a filament: e3 is its tangent by central differences, made normal to e1 (N, 3)."""
    tangent = np.gradient(position, s, axis=0, edge_order=2)
    tangent = tangent - np.sum(tangent * e1, axis=1, keepdims=True) * e1
    e3 = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.cross(e3, e1), e3


def polylines(frame: Frame, rods: Mapping[str, Rod]) -> vtkDataSet:
    """All filaments at one time as vtkPolyData: a polyline each, arrays at the nodes in float32.

    ``radius`` is left out where no filament has one, and is 0 on a filament that has none beside one that
    has.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    filaments = [(frame.filaments[name], rods[name]) for name in rods]
    shown = [_node_arrays(filament, rod, number) for number, (filament, rod) in enumerate(filaments)]
    if all(rod.radius is None for _, rod in filaments):
        for arrays in shown:
            del arrays["radius"]

    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.concatenate([filament.position for filament, _ in filaments]), deep=True))
    offsets = np.cumsum([0, *(len(rod.s) for _, rod in filaments)], dtype=np.int64)
    nodes = np.arange(offsets[-1], dtype=np.int64)
    lines = vtkCellArray()
    lines.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(nodes, deep=True))
    data = vtkPolyData()
    data.SetPoints(points)
    data.SetLines(lines)
    for key in shown[0]:
        _add(data.GetPointData(), key, np.concatenate([arrays[key] for arrays in shown]))
    _add(data.GetFieldData(), "TimeValue", np.array([frame.time]))
    return data


def _node_arrays(filament: FilamentFrame, rod: Rod, number: int) -> dict[str, np.ndarray]:
    """The arrays of one filament as they appear in ParaView, all with N rows.

    Tension lives on segments: a node shows the mean of its two, an end its only one.
    """
    e2, e3 = directors(filament.position, filament.e1, rod.s)
    tension = filament.tension
    shown = {
        "velocity": filament.velocity,
        "force": filament.force,
        "moment": filament.moment,
        "strain": filament.strain,
        "e1": filament.e1,
        "e2": e2,
        "e3": e3,
        "tension": 0.5 * (np.append(tension[0], tension) + np.append(tension, tension[-1])),
        "radius": np.zeros(len(rod.s)) if rod.radius is None else rod.radius,
        "arclength": rod.s,
    }
    numbers = np.full(len(rod.s), number, np.int32)
    return {key: values.astype(np.float32) for key, values in shown.items()} | {"filament": numbers}


def image(fields: Mapping[str, np.ndarray], origin: np.ndarray, spacing: np.ndarray, time: float) -> vtkDataSet:
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
        _add(data.GetPointData(), name, ordered.reshape(-1, *values.shape[3:]).astype(np.float32))
    _add(data.GetFieldData(), "TimeValue", np.array([time]))
    return data


def _add(attributes: Any, name: str, values: np.ndarray) -> None:
    """Put an array (n,) or (n, 3) into point or field data, under a name that ParaView can take."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name.replace("/", "_").replace(".", "_"))
    attributes.AddArray(array)


def _save(data: vtkDataSet, path: Path) -> None:
    """Write one dataset by a temporary name; a file that holds the same bytes already is left untouched."""
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter() if path.suffix == ".vtp" else vtkXMLImageDataWriter()
    temporary = path.with_name(path.name + ".part")
    writer.SetFileName(str(temporary))
    writer.SetInputData(data)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetHeaderTypeToUInt64()
    writer.SetCompressorTypeToNone()
    if not writer.Write():
        temporary.unlink(missing_ok=True)
        raise OSError(f"{path}: could not be written; is the disk full?")
    if path.exists() and filecmp.cmp(temporary, path, shallow=False):
        temporary.unlink()
    else:
        os.replace(temporary, path)


def _write_collection(path: Path, sources: list[list[tuple[float, str]]]) -> Path:
    """The .pvd: at every time of any source, the file of each source that is the last at or before it."""
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="1.0">', "<Collection>"]
    for time in sorted({t for source in sources for t, _ in source}):
        for part, source in enumerate(sources):
            last = bisect.bisect_right(source, time, key=lambda entry: entry[0]) - 1
            if last >= 0:
                lines.append(f'<DataSet timestep="{time!r}" part="{part}" file={quoteattr(source[last][1])}/>')
    lines += ["</Collection>", "</VTKFile>", ""]
    temporary = path.with_name(path.name + ".part")
    temporary.write_text("\n".join(lines), encoding="utf-8")
    os.replace(temporary, path)
    return path
