"""A run as ParaView files.

One .pvd collection with the real times, a .vtp of all filaments for each output and one of all links where there are
any, a .vti for each grid field time, where there are several of these a .pvd of each alone, a .vtp of a wall, and a
ready scene (paraview_scene.py).

Written with vtk's own XML writers (appended raw data, 64-bit header, no compressor), which are imported when the first
file is written: a run never loads them. A step's file is complete before the collection names it, files that would not
change are left alone, and numbers follow the run's outputs, so that writing a run again after it has been resumed
extends the collection and never doubles a time.
"""

from __future__ import annotations

import bisect
import errno
import filecmp
import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from ..analysis.body_meshes import body_surfaces
from ..analysis.meshes import PLAIN, View, box_of, field_data, link_lines, polylines, rods_of, wall_plane
from ..errors import CaseError
from ..io.overwriting import VTK, refuse, replacing
from ..io.reader import RunFile
from ..screen import tell
from .paraview_scene import write_scene

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkDataSet


Entries = list[tuple[float, str]]  # time and file


def write_vtk(
    run: str | Path,
    folder: str | Path | None = None,
    *,
    wrap: bool = False,
    images: int = 0,
    every: int = 1,
    watch: float | None = None,
    log: Callable[[str], object] = tell,
) -> Path:
    """Write the run file ``run`` into ``folder``, by default the run's name; returns the path of the .pvd.

    ``wrap`` brings filaments into the periodic box, cut at its faces; ``images`` adds their periodic images in so many
    boxes on each side; every ``every``-th output is written, and all fields. With ``watch`` it goes on, looking every
    so many seconds, until the run is no longer running. A time at which only filaments or only fields were written
    shows the last of the other before it, which is what ParaView itself does with two sources. Raises what `ibfil.open`
    raises for a file that is no run, CaseError where wrapping or images are asked of a run without a box, OSError where
    a file cannot be written.
    """
    run = Path(run)
    collection = Collection(run, run.with_suffix("") if folder is None else Path(folder), View(wrap, images), every)
    going_on = collection.update()
    while watch is not None and going_on:
        before = len(collection.filaments)
        clock.sleep(watch)
        going_on = collection.update()
        if len(collection.filaments) != before:
            log(f"{collection.path}: {len(collection.filaments)} times, until t = {collection.filaments[-1][0]:.6g}")
    return collection.path


class Collection:
    """The .pvd of a run and the files it names. ``update`` writes what is new in the run."""

    def __init__(self, run: Path, folder: Path, view: View = PLAIN, every: int = 1) -> None:
        self.run, self.folder, self.view, self.every = run, folder, view, every
        self.path = folder / f"{run.stem}.pvd"
        self.filaments: Entries = []
        self.links: Entries = []
        self.bodies: Entries = []
        self.fields: Entries = []
        self._created = ""

    def update(self) -> bool:
        """Have every output of the run so far in the collection; whether the run is still running."""
        with RunFile(self.run) as run:
            if self.view != PLAIN and box_of(run) is None:
                allowed = "a run in a periodic box, which rft and free space have not"
                raise CaseError([f"{self.run}: found --wrap or --images; allowed: {allowed}"])
            if run.created != self._created:
                self.filaments, self.links, self.bodies, self.fields, self._created = [], [], [], [], run.created
            self.folder.mkdir(parents=True, exist_ok=True)
            self._add_filaments(run)
            self._add_fields(run)
            kinds = {"filaments": self.filaments, "links": self.links, "bodies": self.bodies, "grid": self.fields}
            there = {name: entries for name, entries in kinds.items() if entries}
            _write_collection(self.path, list(there.values()))
            if len(there) > 1:  # each kind alone too: filters of lines, such as Tube, may crash ParaView upon a grid
                for name, entries in there.items():
                    _write_collection(self._alone(name), [entries])
            wall = wall_plane(run)
            if wall is not None:
                _save(wall, self._alone("wall").with_suffix(".vtp"))
            write_scene(self.path, run)
            return run.status == "running"

    def _alone(self, kind: str) -> Path:
        return self.path.with_stem(f"{self.path.stem}_{kind}")

    def _add_filaments(self, run: RunFile) -> None:
        """A .vtp for each output that is not there yet, and one of its links, and of its bodies."""
        for entries in (self.filaments, self.links, self.bodies):
            _keep_common(entries, run.time[:: self.every])
        rods, box = rods_of(run), box_of(run)
        done = len(self.filaments) * self.every
        for i, frame in enumerate(run.snapshots(done), done):
            if i % self.every:
                continue
            file = f"{self.run.stem}_filaments_{i:06d}.vtp"
            _save(polylines(frame, rods, box, self.view), self.folder / file)
            self.filaments.append((frame.time, file))
            if frame.links:
                file = f"{self.run.stem}_links_{i:06d}.vtp"
                _save(link_lines(frame, box, self.view), self.folder / file)
                self.links.append((frame.time, file))
            if frame.bodies:
                file = f"{self.run.stem}_bodies_{i:06d}.vtp"
                _save(body_surfaces(run, frame, self.view), self.folder / file)
                self.bodies.append((frame.time, file))

    def _add_fields(self, run: RunFile) -> None:
        """A .vti for each time at which fields were written."""
        times = np.empty(0) if run.grid is None else np.asarray(run.grid.time)
        _keep_common(self.fields, times)
        for i in range(len(self.fields), len(times)):
            file = f"{self.run.stem}_grid_{i:06d}.vti"
            _save(field_data(run, i), self.folder / file)
            self.fields.append((float(times[i]), file))


def _keep_common(entries: Entries, times: np.ndarray) -> None:
    """Forget what a run that was cut back to its checkpoint written at other times since."""
    same = [time == now for (time, _), now in zip(entries, times, strict=False)]
    del entries[same.index(False) if False in same else len(same) :]


def _save(data: vtkDataSet, path: Path) -> None:
    """Write one dataset; a file that holds the same bytes already is left untouched."""
    from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter() if path.suffix == ".vtp" else vtkXMLImageDataWriter()
    writer.SetInputData(data)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetHeaderTypeToUInt64()
    writer.SetCompressorTypeToNone()
    with _replacing(path) as part:
        writer.SetFileName(str(part))
        if not writer.Write():
            raise OSError(errno.EIO, "could not be written; is the disk full?", str(path))


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A name to write a file of VTK to. Raises CaseError where there is one of another kind; the same is left alone."""
    refuse(path, VTK, True)
    with suppress(_Same), replacing(path) as part:
        yield part
        if path.exists() and filecmp.cmp(part, path, shallow=False):
            raise _Same


class _Same(Exception):
    """The file is there already."""


def _write_collection(path: Path, sources: Sequence[Entries]) -> None:
    """The .pvd: at every time of any source, the file of each source that is the last at or before it."""
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="1.0">', "<Collection>"]
    for time in sorted({t for source in sources for t, _ in source}):
        for part, source in enumerate(sources):
            last = bisect.bisect_right(source, time, key=lambda entry: entry[0]) - 1
            if last >= 0:
                lines.append(f'<DataSet timestep="{time!r}" part="{part}" file={quoteattr(source[last][1])}/>')
    lines += ["</Collection>", "</VTKFile>", ""]
    with _replacing(path) as whole:
        whole.write_text("\n".join(lines), encoding="utf-8")
