"""A ready scene for ParaView, beside a collection: a small Python script, bound to no version as a .pvsm is.

File > Load State opens it, and so do ``paraview --state=NAME_paraview.py`` and ``pvpython NAME_paraview.py
picture.png``.
"""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..assembly.fluids.models import fluid_model
from ..io.overwriting import replacing

if TYPE_CHECKING:
    from ..io.reader import RunFile


_MARK = "# As written, to be told from one that was changed, which is kept: "  # and the sum of all before
_HEAD = '''# {title}
# A scene for ParaView 5.11 and later: rods as tubes to scale, coloured by tension{more}.
# File > Load State ..., or `paraview --state={name}`, or `pvpython {name} picture.png` for a picture of the last time.
import os
import sys

from paraview.simple import *

FOLDER = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else {folder!r}
if not os.path.exists(os.path.join(FOLDER, {pvd!r})):
    FOLDER = {folder!r}
CENTRE, NORMAL, UP, SIZE = {centre}, {normal}, {up}, {size}

run = PVDReader(registrationName={pvd!r}, FileName=os.path.join(FOLDER, {pvd!r}))
run.UpdatePipelineInformation()
last = list(run.TimestepValues)[-1]
run.UpdatePipeline(last)
view = GetActiveViewOrCreate("RenderView")
view.ViewSize = [1280, 960]
view.UseColorPaletteForBackground = 0
view.Background = [1.0, 1.0, 1.0]
view.OrientationAxesLabelColor = [0.2, 0.2, 0.2]


def bar(source, shown, title, x):
    """A colour bar with dark letters at the foot of the view, ``x`` of its width from the left."""
    shown.RescaleTransferFunctionToDataRange(False, True)
    found = GetScalarBar(GetColorTransferFunction(shown.ColorArrayName[1]), view)
    found.Title, found.ComponentTitle = title, ""
    found.TitleColor = found.LabelColor = [0.1, 0.1, 0.1]
    found.WindowLocation, found.Orientation = "Any Location", "Horizontal"
    found.Position, found.ScalarBarLength = [x, 0.03], 0.3
    shown.SetScalarBarVisibility(view, True)

'''
_RODS = """
tubes = Tube(registrationName="tubes", Input=rods)
tubes.Scalars, tubes.VaryRadius = ["POINTS", "tube_radius"], "By Absolute Scalar"
tubes.NumberofSides = 16
shown = Show(tubes, view)
ColorBy(shown, ("POINTS", "tension"))
bar(tubes, shown, {tension!r}, 0.05)
"""
_WALL = """
wall = XMLPolyDataReader(registrationName="wall", FileName=[os.path.join(FOLDER, {wall!r})])
below = Show(wall, view)
ColorBy(below, None)
below.AmbientColor = below.DiffuseColor = [0.69, 0.66, 0.6]
below.Opacity, below.Representation = 0.5, "Surface With Edges"
"""
_LINKS = """
links = ExtractBlock(registrationName="links", Input=run, Selectors=["/Root/Block1"])
joined = Show(links, view)
joined.LineWidth = 2.0
ColorBy(joined, ("POINTS", "link_force"))
GetColorTransferFunction("link_force").ApplyPreset("Inferno (matplotlib)", True)
bar(links, joined, {link!r}, 0.35)
"""
_BODIES = """
bodies = ExtractBlock(registrationName="bodies", Input=run, Selectors=["/Root/Block{block}"])
solid = Show(bodies, view)
ColorBy(solid, None)
solid.AmbientColor = solid.DiffuseColor = [0.7, 0.75, 0.8]
solid.LineWidth = 3.0
"""
_FLOW = """
flow = ExtractBlock(registrationName="flow", Input=run, Selectors=["/Root/Block{block}"])
slice1 = Slice(registrationName="slice", Input=flow, SliceType="Plane")
slice1.SliceType.Origin, slice1.SliceType.Normal = CENTRE, NORMAL
sheet = Show(slice1, view)
ColorBy(sheet, ("POINTS", "velocity", "Magnitude"))
GetColorTransferFunction("velocity").ApplyPreset("Linear Green (Gr4L)", True)
GetColorTransferFunction("velocity").InvertTransferFunction()
sheet.Opacity = 0.8
bar(slice1, sheet, {speed!r}, 0.6)
arrows = Glyph(registrationName="arrows", Input=slice1, GlyphType="Arrow")
arrows.OrientationArray, arrows.ScaleArray = ["POINTS", "velocity"], ["POINTS", "No scale array"]
arrows.ScaleFactor, arrows.GlyphMode = 0.07 * SIZE, "Uniform Spatial Distribution (Bounds Based)"
arrows.MaximumNumberOfSamplePoints = 600
arrows.GlyphType.TipRadius, arrows.GlyphType.ShaftRadius = 0.2, 0.06
arrow = Show(arrows, view)
ColorBy(arrow, None)
arrow.AmbientColor = arrow.DiffuseColor = [0.35, 0.35, 0.35]
"""
_TAIL = """
clock = AnnotateTimeFilter(registrationName="time", Input=run)
clock.Format = {clock}
letters = Show(clock, view)
letters.Color = [0.1, 0.1, 0.1]
letters.FontSize = 18

scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
scene.AnimationTime = last
view.CameraParallelProjection, view.CameraParallelScale = 1, 0.6 * SIZE
view.CameraFocalPoint = CENTRE
view.CameraPosition = [c + 3.0 * SIZE * n for c, n in zip(CENTRE, NORMAL)]
view.CameraViewUp = UP
Render()
if len(sys.argv) > 1 and sys.argv[-1].endswith(".png"):
    SaveScreenshot(sys.argv[-1], view, ImageResolution=[1280, 960])
"""


def write_scene(collection: Path, run: RunFile) -> Path:
    """Write NAME_paraview.py beside NAME.pvd, looking along the direction of least motion; returns its path.

    One that is there and was changed, or is somebody's own, is left as it is.
    """
    from .camera import viewpoint

    path = collection.with_name(f"{collection.stem}_paraview.py")
    look = viewpoint([np.asarray(columns["position"]) for columns in run.filaments.values()])
    units, flow = run.case.units, run.grid is not None and "velocity" in run.grid.fields
    words = {
        "title": " ".join((run.case.title or collection.stem).split()),
        "more": ", and a slice through the flow with arrows along it" if flow else "",
        "name": path.name,
        "pvd": collection.name,
        "folder": str(collection.parent.resolve()),
        "centre": look.centre.round(12).tolist(),
        "normal": look.towards.tolist(),
        "up": look.up.tolist(),
        "size": float(f"{look.size:.6g}"),
    }
    rods = (
        'rods = ExtractBlock(registrationName="rods", Input=run, Selectors=["/Root/Block0"])'
        if run.grid or run.links or run.bodies
        else "rods = run"
    )
    time = "time {time:.6g}" + ("" if units.time == "1" else f" {units.time}")
    text = _HEAD.format(**words) + rods
    text += _RODS.format(tension=_labelled("tension", units.force))
    if fluid_model(run.case).wall is not None:
        text += _WALL.format(wall=f"{collection.stem}_wall.vtp")
    if run.links:
        text += _LINKS.format(link=_labelled("force of links", units.force))
    if run.bodies:
        text += _BODIES.format(block=1 + bool(run.links))
    if flow:
        block = 1 + bool(run.links) + bool(run.bodies)
        text += _FLOW.format(speed=_labelled("speed", run.units("grid/velocity")), block=block)
    text += _TAIL.replace("{clock}", repr(time))
    text += f"{_MARK}{zlib.crc32(text.encode()):08x}\n"
    if path.exists() and (path.read_bytes() == text.encode() or not _is_as_written(path)):
        return path
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def _is_as_written(path: Path) -> bool:
    """Whether a scene is as it was written, which its last line tells: one that a user has changed is left alone."""
    text, mark, sum_ = path.read_text(encoding="utf-8", errors="replace").rpartition(_MARK)
    return mark != "" and sum_.strip() == f"{zlib.crc32(text.encode()):08x}"


def _labelled(name: str, units: str) -> str:
    return name if units == "1" else f"{name} ({units})"
