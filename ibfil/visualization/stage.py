"""The rods and the flow of a run as pixels: pyvista, no display, a fixed camera. Letters are in annotations.py."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..analysis.meshes import PLAIN, View, box_of, filament_data, link_lines
from .bodies import add_bodies
from .camera import Viewpoint
from .quantities import QUANTITIES, Scale, colours
from .streamlines import evenly_spaced

if TYPE_CHECKING:
    import pyvista

    from ..analysis.run import Run


SIDES = 24  # of a tube
LEAST = 2.5  # pixels: the least width of a tube
SAMPLES = 8  # of a pixel
MARGIN = 1.12  # of what the filaments reach
FLOW = "Greys"
LINKS = "Greys"
ARROWS = 26  # along the width of a picture
SHEET = 160  # points along the width of a slice
LINES_APART = 7  # of these points, between two streamlines

THIN = 0.012  # of half the picture's height: the radius of tubes of which many are shown at once


class Frame(NamedTuple):
    """The view of the camera: half its height, its width over its height, and the unit vector to the right."""

    look: Viewpoint
    half: float
    aspect: float
    right: np.ndarray

    def at(self, across: np.ndarray, up: np.ndarray) -> np.ndarray:
        """Places (..., 3) in the plane of the picture through its centre."""
        return self.look.centre + across[..., None] * self.right + up[..., None] * self.look.up


def frame_for(look: Viewpoint, positions: Sequence[np.ndarray], radius: float, size: tuple[int, int]) -> Frame:
    """The camera that has all positions (T, N, 3), with tubes of that radius, in a picture of ``size`` pixels."""
    right = np.cross(look.up, look.towards)
    every = np.concatenate([p.reshape(-1, 3) for p in positions]) - look.centre
    aspect = size[0] / size[1]
    half = max(np.nanmax(np.abs(every @ look.up)), np.nanmax(np.abs(every @ right)) / aspect) + radius
    return Frame(look, MARGIN * float(half), aspect, right)


class Stage:
    """A plotter that shows one moment after the other."""

    def __init__(self, run: Run, frame: Frame, size: tuple[int, int], strongest: float, view: View = PLAIN) -> None:
        """``strongest``: the force of links that is black; ``view``: whether filaments are cut at the periodic box."""
        import pyvista

        self._run, self._frame, self._strongest, self._view = run, frame, strongest, view
        self.least = 0.5 * LEAST * 2 * frame.half / size[1]
        plotter: Any = pyvista.Plotter  # whose types mypy cannot follow
        self._plotter = plotter(off_screen=True, window_size=list(size), lighting="three lights")
        self._plotter.set_background("white")
        # Where a processor draws, msaa takes a third of the time of ssaa, and looks as well at this many samples.
        self._plotter.enable_anti_aliasing("msaa", multi_samples=SAMPLES)
        self._plotter.add_axes(color="black", line_width=3, viewport=(0.0, 0.0, 0.14, 0.14 * frame.aspect))
        self.aim(frame.look.centre)
        # Behind all rods, so that it hides none of them; seen from afar nothing else changes.
        self._behind = -2.0 * (frame.look.size + frame.half) * frame.look.towards

    def aim(self, centre: np.ndarray) -> None:
        """Turn the camera to another centre (3,)."""
        self._frame = self._frame._replace(look=self._frame.look._replace(centre=centre))
        camera, look = self._plotter.camera, self._frame.look
        camera.parallel_projection, camera.parallel_scale = True, self._frame.half
        camera.focal_point = look.centre
        camera.position = look.centre + 10 * look.size * look.towards
        camera.up = look.up

    def box(self, box: np.ndarray) -> None:
        """The edges of the periodic box (3,), which is centred on the origin."""
        import pyvista

        edges = pyvista.Box([side * half for half in 0.5 * box for side in (-1, 1)]).extract_all_edges()
        self._show(edges, color="#808080", line_width=2, lighting=False, name="box")

    def _show(self, mesh: Any, **more: Any) -> None:
        self._plotter.add_mesh(mesh, reset_camera=False, render=False, **more)

    def wall(self, height: float) -> None:
        """A wall below the fluid, as wide as the picture, with an edge that is seen from the side too."""
        import pyvista

        centre, wide = np.array(self._frame.look.centre), 2 * self._frame.half * max(1.0, self._frame.aspect)
        sheet = pyvista.Plane(
            center=(centre[0], centre[1], height),
            direction=(0, 0, 1),
            i_size=wide,
            j_size=wide,
            i_resolution=1,
            j_resolution=1,
        )
        self._show(sheet, color="#b0a898", opacity=0.5, lighting=False, name="wall")
        edges = sheet.extract_feature_edges()
        self._show(edges, color="#807868", line_width=3, name="edge of the wall")

    def tubes(self, output: int, scale: Scale) -> None:
        """The filaments at an output as tubes to scale, coloured by a quantity."""
        mesh = self._mesh(output)
        mesh["shown"] = QUANTITIES[scale.name].values(mesh)
        self._add(mesh, scale, "rods")
        self._links(output)
        add_bodies(self._show, self._run, output, self._view)

    def shape(self, output: int, scale: Scale) -> bool:
        """One of many shapes in the same picture, coloured by its time, later ones in front; whether it is to scale."""
        mesh = self._mesh(output)
        mesh["shown"] = np.full(mesh.n_points, self._run.time[output])
        thin = max(THIN * self._frame.half, self.least)
        to_scale = bool(mesh["tube_radius"].max() <= thin)
        mesh["tube_radius"] = np.minimum(mesh["tube_radius"], thin)
        mesh.points += 3 * thin * output * self._frame.look.towards
        self._add(mesh, scale, f"shape {output}")
        return to_scale

    def _links(self, output: int) -> None:
        """The links as lines, the darker the larger their force."""
        import pyvista

        if not self._run.links:
            return
        lines = pyvista.wrap(link_lines(self._run.snapshot(output), box_of(self._run), self._view))
        largest = max(self._strongest, 1e-300)
        self._show(
            lines,
            scalars="link_force",
            cmap=LINKS,
            clim=(-0.4 * largest, largest),  # so that a link without force is seen on white
            show_scalar_bar=False,
            line_width=2.5,
            lighting=False,
            name="links",
        )

    def _add(self, mesh: pyvista.PolyData, scale: Scale, name: str) -> None:
        self._show(
            mesh.tube(scalars="tube_radius", absolute=True, n_sides=SIDES, capping=True),
            scalars="shown",
            cmap=colours(scale.colours),
            clim=(scale.low, scale.high),
            show_scalar_bar=False,
            smooth_shading=True,
            specular=0.2,
            name=name,
        )

    def _mesh(self, output: int) -> pyvista.PolyData:
        import pyvista

        mesh = pyvista.wrap(filament_data(self._run, output, self._view))
        mesh["tube_radius"] = np.maximum(mesh["tube_radius"], self.least)
        return mesh

    def slice(self, time: float, fastest: float) -> None:
        """The speed in the plane of the picture, light to dark."""
        import pyvista

        across, up, u = self._sample(time, SHEET)
        places = self._frame.at(across, up) + self._behind
        sheet = pyvista.StructuredGrid(*(places[..., i][..., None] for i in range(3)))
        sheet["speed"] = np.linalg.norm(u, axis=-1).ravel(order="F")
        self._show(
            sheet,
            scalars="speed",
            cmap=colours(FLOW),
            clim=(0.0, fastest),
            show_scalar_bar=False,
            lighting=False,
            name="slice",
        )

    def glyphs(self, time: float, fastest: float) -> None:
        """Arrows in the plane of the picture, as long as the square root of the speed in it."""
        import pyvista

        across, up, u = self._sample(time, ARROWS)
        arrows = pyvista.PolyData((self._frame.at(across, up) + 0.98 * self._behind).reshape(-1, 3))
        flat = u - (u @ self._frame.look.towards)[..., None] * self._frame.look.towards
        speed = np.linalg.norm(flat, axis=-1).ravel()
        arrows["flow"] = flat.reshape(-1, 3)
        arrows["long"] = np.sqrt(speed / fastest)
        gap = 2.0 * self._frame.half * self._frame.aspect / ARROWS
        shape = pyvista.Arrow(tip_radius=0.16, shaft_radius=0.05, tip_length=0.35)
        shown = arrows.glyph(orient="flow", scale="long", factor=1.6 * gap, geom=shape)
        self._show(shown, color="#303030", lighting=False, name="glyphs")

    def streamlines(self, time: float, fastest: float) -> None:
        """Lines along the flow in the plane of the picture, evenly apart, over the speed there."""
        import pyvista

        self.slice(time, fastest)
        across, up, u = self._sample(time, SHEET)
        x, y = across[:, 0], up[0]
        gap = LINES_APART * (x[1] - x[0])
        found = evenly_spaced(x, y, u @ self._frame.right, u @ self._frame.look.up, gap)
        lines = [self._frame.at(line[:, 0], line[:, 1]) + 0.98 * self._behind for line in found if len(line) > 2]
        if not lines:
            return
        starts = np.cumsum([0, *map(len, lines)])
        cells = [[len(line), *range(start, start + len(line))] for line, start in zip(lines, starts, strict=False)]
        drawn = pyvista.PolyData(np.vstack(lines), lines=np.hstack(cells))
        self._show(drawn, color="#505050", line_width=1.5, lighting=False, name="streamlines")
        long = [line for line in lines if np.linalg.norm(np.diff(line, axis=0), axis=1).sum() > 1.5 * gap]
        middles = [len(line) // 2 for line in long]
        heads = pyvista.PolyData(np.reshape([line[k] for line, k in zip(long, middles, strict=True)], (-1, 3)))
        heads["flow"] = np.reshape([line[k] - line[k - 1] for line, k in zip(long, middles, strict=True)], (-1, 3))
        size = 0.035 * self._frame.half
        cones = heads.glyph(orient="flow", scale=False, factor=size, geom=pyvista.Cone(radius=0.35, height=1.0))
        self._show(cones, color="#505050", lighting=False, name="heads")

    def fastest(self, time: float) -> float:
        """The largest speed of the fluid in the plane of the picture."""
        return float(np.nanmax(np.linalg.norm(self._sample(time, SHEET)[2], axis=-1)))

    def _sample(self, time: float, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places across and up (n, m) over the picture, and the velocity (n, m, 3) there."""
        half, aspect = self._frame.half, self._frame.aspect
        x = np.linspace(-half * aspect, half * aspect, width)
        y = np.linspace(-half, half, max(2, round(width / aspect)))
        across, up = np.meshgrid(x, y, indexing="ij")
        u = self._run.velocity_at(self._frame.at(across, up).reshape(-1, 3), time)
        return across, up, u.reshape(*across.shape, 3)

    def pixels(self) -> np.ndarray:
        """The picture (height, width, 3)."""
        # The camera's range is that of what is there, which each moment changes.
        self._plotter.renderer.reset_camera_clipping_range()
        return np.asarray(self._plotter.screenshot(return_img=True))[..., :3]

    def close(self) -> None:
        """Give the window back."""
        self._plotter.close()
