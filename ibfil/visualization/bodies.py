"""Bodies in pictures: as surfaces with their axes, and as outlines in a plane."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.body_meshes import body_surfaces
from ..analysis.meshes import PLAIN, View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

    from ..analysis.run import Run
    from ..io.reader import RunFile

SURFACE = "#b9c4cf"
AXES = ("#d55e00", "#009e73", "#0072b2")  # which colour-blind readers can tell apart
LEGEND = "axes of bodies: first red, second green, third blue"
CORNERS = 60  # of an outline


def add_bodies(show: Callable[..., object], run: Run, output: int, view: View = PLAIN) -> None:
    """Adds the bodies of an output to a picture by ``show``, in place of those of another one."""
    import pyvista

    if not run.bodies:
        return
    whole = pyvista.wrap(body_surfaces(run, run.snapshot(output), view))
    surface = whole.copy()
    surface.lines = np.zeros(0, int)
    show(surface, color=SURFACE, smooth_shading=True, specular=0.2, name="bodies")
    for k, colour in enumerate(AXES, 1):
        tips = whole.points[whole["axis"] == k].reshape(-1, 2, 3)
        if len(tips):
            lines = pyvista.line_segments_from_points(tips.reshape(-1, 3))
            show(lines, color=colour, line_width=4, lighting=False, name=f"axis {k}")


def add_outlines(
    axes: Axes,
    run: RunFile,
    plane: tuple[int, int],
    picked: np.ndarray,
    colours: Colormap,
    span: tuple[float, float],
    origin: np.ndarray | float = 0.0,
) -> None:
    """Adds the outlines of bodies, seen along the normal of a plane of two lab axes, coloured by time as rods are.

    ``origin``: of the picture at each picked output (K, 3).
    """
    from matplotlib.collections import LineCollection

    each = run.case.each_body
    for name, columns in run.bodies.items():
        size = np.array(each[name].shape.semi_axes)
        if "markers" in columns:
            clouds = np.asarray(columns["markers"])[picked] - (np.ndim(origin) and np.asarray(origin)[:, None])
            rings = [hull(cloud) for cloud in clouds[:, :, list(plane)]]
        elif size.any():
            centre = np.asarray(columns["position"])[picked] - origin
            turned = np.stack([np.asarray(columns[key])[picked] for key in ("e1", "e2", "e3")], axis=1)
            seen = (centre[:, list(plane)], size[:, None] * turned[:, :, list(plane)])
            rings = [middle + outline(arms) for middle, arms in zip(*seen, strict=True)]
        else:
            continue
        lines = LineCollection(rings, cmap=colours, linewidths=1.2)
        lines.set_array(np.asarray(run.time)[picked])
        lines.set_clim(*span)
        axes.add_collection(lines)


def hull(points: np.ndarray) -> np.ndarray:
    """The outline (k, 2) of points in a plane, closed; of those along a line this line."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = ConvexHull(points).vertices
    except QhullError:
        along = points @ np.linalg.svd(points - points.mean(axis=0))[2][0]
        corners = np.array([along.argmin(), along.argmax()])
    out: np.ndarray = points[np.append(corners, corners[0])]
    return out


def outline(arms: np.ndarray) -> np.ndarray:
    """The outline (k, 2) of an ellipsoid whose semi-axes are seen as ``arms`` (3, 2): points u, u.(A^T A)^-1 u = 1."""
    values, vectors = np.linalg.eigh(arms.T @ arms)
    angle = np.linspace(0.0, 2 * np.pi, CORNERS + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.sqrt(np.maximum(values, 0.0))
    out: np.ndarray = ring @ vectors.T
    return out
