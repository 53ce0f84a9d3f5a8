"""The pictures of one run: one camera and one scale of colours for all its times, notes on what is drawn otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from ..analysis.body_meshes import extents
from ..analysis.meshes import View, box_of, rods_of
from ..analysis.run import Run
from ..assembly.fluids.models import fluid_model
from ..errors import CaseError
from .annotations import Words, bands, lettered
from .bodies import LEGEND
from .camera import direction, turned, upwards, viewpoint
from .quantities import TIMES, Scale, limits_of, scale_of, words_with_unit
from .stage import FLOW, LEAST, Frame, Stage, frame_for

if TYPE_CHECKING:
    Flow = Literal["none", "slice", "glyphs", "streamlines"]


FOLLOWED = 1.6  # of the reach of a filament that is followed: how far is seen around it


class Wish(NamedTuple):
    """How a picture or film is wanted.

    ``colour`` one of quantities.QUANTITIES; ``flow`` one of render.FLOWS; ``montage`` so many shapes over the run in
    one picture; ``time`` of a picture (default the last); ``size`` in pixels; a film shows every ``every``-th output at
    ``fps``. ``view`` towards the camera and ``up``: x, -z, or three numbers; ``zoom`` above 1 nearer; ``box`` draws the
    periodic box; ``wrap`` cuts filaments at it; ``follow`` a filament's centroid; ``range`` of the colours: "run",
    "last" for the last that is shown, or two numbers.
    """

    colour: str = "tension"
    flow: Flow = "none"
    montage: int = 0
    time: float | None = None
    size: tuple[int, int] = (1280, 960)
    fps: float = 25.0
    every: int = 1
    view: str | Sequence[float] | None = None
    up: str | Sequence[float] | None = None
    zoom: float = 1.0
    box: bool = False
    wrap: bool = False
    follow: str | None = None
    range: str | tuple[float, float] = "run"


class Pictures:
    """The pictures of the outputs ``shown`` of a run."""

    def __init__(self, run: Run, wish: Wish, shown: Sequence[int]) -> None:
        self.run, self.wish, self.shown = run, wish, shown
        self._check()
        top, foot = bands(wish.size[1])
        size = wish.size[0], wish.size[1] - top - foot
        thick = [rod.radius for rod in rods_of(run).values()]
        self.frame = self._camera(max(float(radius.max()) for radius in thick), size)
        strongest = _strongest(run)
        self.stage = Stage(run, self.frame, size, strongest, View(wish.wrap))
        self.fastest = self._fastest()
        self.scale = self._scale()
        bars = [self.scale]
        if wish.flow in ("slice", "streamlines"):
            most = words_with_unit("speed of the fluid", "length/time", run.case.units)
            bars.append(Scale("", most, FLOW, 0.0, self.fastest, above=len(shown) > 1))
        notes = [_NOTES.get(wish.flow, "").format(self.fastest), _of_thickness(run)]
        notes += [_left_out(run)] if wish.montage else [_of_links(run, strongest), LEGEND if extents(run) else ""]
        if min(float(radius.min()) for radius in thick) < self.stage.least:
            notes.append(f"rods drawn {LEAST:g} pixels wide where they are thinner")
        title = " ".join(run.case.title.split()) or run.path.stem
        pixel = 2 * self.frame.half / size[1]
        self.words = Words(title, tuple(bars), run.case.units.length, pixel, "; ".join(filter(None, notes)))
        self._place()

    def _check(self) -> None:
        """Raise CaseError for what this run has not."""
        wish, path, faults = self.wish, self.run.path, []
        if (wish.box or wish.wrap) and box_of(self.run) is None:
            faults.append(
                f"{path}: found --box or --wrap; allowed: a run in a periodic box, which rft and free space lack"
            )
        if wish.follow is not None and wish.follow not in self.run.filaments:
            faults.append(f"--follow: found {wish.follow}; allowed: {', '.join(list(self.run.filaments)[:20])}")
        if faults:
            raise CaseError(faults)

    def _camera(self, thick: float, size: tuple[int, int]) -> Frame:
        """The camera that has all that is shown, at all times."""
        wish, seen = self.wish, [np.asarray(columns["position"]) for columns in self.run.filaments.values()]
        seen += extents(self.run)
        if wish.follow is not None:
            own = np.asarray(self.run.filaments[wish.follow]["position"])
            seen = [FOLLOWED * (own - own.mean(axis=1, keepdims=True))]
        box = box_of(self.run)
        if box is not None and (wish.box or wish.wrap):
            corners = np.stack(np.meshgrid(*[(-0.5 * side, 0.5 * side) for side in box]), axis=-1)
            seen = [corners.reshape(1, 8, 3)] if wish.wrap else [*seen, corners.reshape(1, 8, 3)]
        towards, up = (
            None if wanted is None else direction(name, wanted)
            for name, wanted in (("--view", wish.view), ("--up", wish.up))
        )
        look = turned(viewpoint(seen), towards, up, upwards(self.run.case))
        frame = frame_for(look, seen, thick, size)
        return frame._replace(half=frame.half / wish.zoom)

    def _place(self) -> None:
        """Place the wall and the box, which stand where they are."""
        height, box = fluid_model(self.run.case).wall, box_of(self.run)
        if height is not None:
            self.stage.wall(height)
        if self.wish.box and box is not None:
            self.stage.box(box)

    def _fastest(self) -> float:
        """The largest speed in the plane of the picture, at the first, middle and last moment that is shown."""
        if self.wish.flow == "none":
            return 1.0
        picked = {self.shown[0], self.shown[len(self.shown) // 2], self.shown[-1]}
        found = []
        for output in sorted(picked):
            self._aim(output)
            found.append(self.stage.fastest(float(self.run.time[output])))
        return max(*found, 1e-300, 0.0)

    def _scale(self) -> Scale:
        if self.wish.montage:
            times, words = self.run.time, words_with_unit("time", "time", self.run.case.units)
            return Scale("time", words, TIMES, float(times[0]), float(times[-1]))
        return scale_of(self.run, self.wish.colour, limits_of(self.wish.range), self.shown[-1])

    def _aim(self, output: int) -> None:
        if self.wish.follow is not None:
            self.stage.aim(np.asarray(self.run.filaments[self.wish.follow]["position"][output]).mean(axis=0))
            self._place()

    def one(self, output: int) -> np.ndarray:
        """The picture (height, width, 3) of an output."""
        time = float(self.run.time[output])
        self._aim(output)
        self.stage.tubes(output, self.scale)
        self._flow(time)
        return self._page(_time(time, self.run))

    def montage(self) -> np.ndarray:
        """Shapes at times evenly spaced over the run, in one picture, coloured by time."""
        times = self.run.time
        picked = np.unique([self.run.output_at(t) for t in np.linspace(times[0], times[-1], self.wish.montage)])
        to_scale = [self.stage.shape(int(output), self.scale) for output in picked]
        if not all(to_scale):
            notes = filter(None, (self.words.note, "rods drawn thinner than they are"))
            self.words = self.words._replace(note="; ".join(notes))
        self._flow(float(times[picked[-1]]))
        return self._page(f"{len(picked)} shapes, {_time(times[0], self.run)} to {times[-1]:.4g}")

    def _flow(self, time: float) -> None:
        if self.wish.flow != "none":
            getattr(self.stage, self.wish.flow)(time, self.fastest)

    def _page(self, time: str) -> np.ndarray:
        return lettered(self.stage.pixels(), self.wish.size[1], self.words, time)

    def close(self) -> None:
        """Give the window back."""
        self.stage.close()


_NOTES = {
    "slice": "flow in the plane through the middle",
    "glyphs": "longest arrow: {:.3g}, length as the root of the speed",
    "streamlines": "flow along the plane through the middle",
}


def _strongest(run: Run) -> float:
    """The largest force of an element of any link in the run; 0 where there is none."""
    forces = (np.asarray(columns["force"]) for columns in run.links.values())
    return max((float(np.max(np.linalg.norm(force, axis=2))) for force in forces), default=0.0)


def _of_links(run: Run, strongest: float) -> str:
    """The note on the colour of links."""
    if not run.links:
        return ""
    units = "" if run.case.units.force == "1" else f" {run.case.units.force}"
    return f"links: the darker the larger their force, black at {strongest:.3g}{units}"


def _left_out(run: Run) -> str:
    """The note on what many shapes in one picture go without."""
    found = [word for word, there in (("links", run.links), ("bodies", extents(run))) if there]
    return f"without {' and '.join(found)}" if found else ""


def _of_thickness(run: Run) -> str:
    """The note on rods that have no thickness to show: no radius in the case, and no grid that gives them one."""
    bare = not run.case.fluid.on_grid and any(run.filament(name).radius is None for name in run.filaments)
    return "no radius given: drawn L/100 thick" if bare else ""


def _time(time: float, run: Run) -> str:
    unit = run.case.units.time
    return f"time {time:.4g}" + ("" if unit == "1" else f" {unit}")
