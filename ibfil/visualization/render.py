"""Pictures and films of a run: `ibfil render RUN.h5 -o FILE`. Without a display; solving never comes here."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from ..analysis.body_meshes import extents
from ..analysis.meshes import filament_data, rods_of
from ..analysis.run import Run, open_run
from ..assembly.fluids.models import fluid_model
from ..errors import CaseError
from ..io.overwriting import BY_ENDING, refuse, replacing
from ..io.units import label
from ..screen import tell
from .annotations import Words, bands, lettered
from .bodies import LEGEND
from .camera import viewpoint
from .stage import FLOW, QUANTITIES, TIMES, Frame, Scale, Stage, frame_for, quantity

if TYPE_CHECKING:
    Flow = Literal["none", "slice", "glyphs", "streamlines"]


PICTURES, FILMS = (".png",), (".mp4", ".gif")
FLOWS = ("none", "slice", "glyphs", "streamlines")
SMALLEST, LARGEST = 160, 7680
_TELL_EVERY = 5.0  # seconds between two lines of a film's progress
PACKAGES = "libegl1 and libgl1-mesa-dri"
_PROBE = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=[64, 64]); p.add_mesh(pyvista.Sphere()); "
    "raise SystemExit(int(p.screenshot(return_img=True).std() == 0))"
)


_TURN = threading.Lock()  # vtk draws in one thread at a time


class Wish(NamedTuple):
    """How a picture or film is wanted.

    ``colour`` one of stage.QUANTITIES; ``flow`` one of FLOWS; ``montage`` so many shapes over the run in one picture;
    ``time`` of a picture (default the last); ``size`` in pixels; a film shows every ``every``-th output at ``fps``.
    """

    colour: str = "tension"
    flow: Flow = "none"
    montage: int = 0
    time: float | None = None
    size: tuple[int, int] = (1280, 960)
    fps: float = 25.0
    every: int = 1


def render(
    run: str | Path,
    output: str | Path,
    wish: Wish | None = None,
    log: Callable[[str], object] = tell,
    overwrite: bool = False,
) -> Path:
    """Draw the run file ``run`` into ``output``: .png a picture, .mp4 or .gif a film; returns its path.

    Tubes are to scale and coloured by a quantity, the camera stands still, the time is written on each picture. The
    file is whole or not there. Raises CaseError where it exists and ``overwrite`` is not set, for wishes that cannot be
    had, where nothing can be rendered here (it names the packages to install) or no film encoded, and as `ibfil.open`.
    """
    wish, path = wish or Wish(), Path(output)
    _check(wish, path)
    refuse(path, BY_ENDING[path.suffix], overwrite, [Path(run)])
    if not can_render():
        line = f"pictures cannot be rendered here; install the Debian packages {PACKAGES}"
        raise CaseError([f"{path}: {line} (apt-get install libegl1 libgl1-mesa-dri)"])
    with _TURN, open_run(run) as opened:
        if wish.flow != "none":
            opened.velocity_at(np.zeros((1, 3)))  # where there is no flow it says so
        pictures = _Pictures(opened, wish)
        try:
            if path.suffix in PICTURES:
                _save_picture(path, pictures.montage() if wish.montage else pictures.one(opened.output_at(wish.time)))
            else:
                outputs = range(0, len(opened), wish.every)
                _save_film(path, (pictures.one(i) for i in outputs), wish.fps, len(outputs), log)
        finally:
            pictures.close()
    return path


def _check(wish: Wish, path: Path) -> None:
    faults = []
    if path.suffix not in (*PICTURES, *FILMS):
        faults.append(f"{path}: found a name that ends in {path.suffix or 'nothing'}; allowed: .png, .mp4, .gif")
    if wish.colour not in QUANTITIES:
        faults.append(f"--colour: found {wish.colour}; allowed: {', '.join(QUANTITIES)}")
    if wish.flow not in FLOWS:
        faults.append(f"--flow: found {wish.flow}; allowed: {', '.join(FLOWS)}")
    if not all(SMALLEST <= side <= LARGEST and side % 2 == 0 for side in wish.size):
        shown = f"{wish.size[0]}x{wish.size[1]}"
        faults.append(f"--size: found {shown}; allowed: WIDTHxHEIGHT, even numbers from {SMALLEST} to {LARGEST}")
    if path.suffix in FILMS and (wish.montage or wish.time is not None):
        faults.append("--montage, --time: found with a film; allowed: with a .png")
    if wish.montage < 0 or wish.montage > 1000:
        faults.append(f"--montage: found {wish.montage}; allowed: 1 to 1000")
    if not 0.1 <= wish.fps <= 240 or wish.every < 1:
        faults.append(f"--fps, --every: found {wish.fps:g}, {wish.every}; allowed: 0.1 to 240, and 1 or more")
    if faults:
        raise CaseError(faults)


def can_render() -> bool:
    """Whether vtk can draw here; tried in a process of its own, since without the libraries it ends in a crash."""
    if not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # else vtk warns that it has none
    return _runs(_PROBE)


@cache
def _runs(code: str) -> bool:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, timeout=300).returncode == 0


class _Pictures:
    """The pictures of one run, with one camera and one scale of colours for all its times."""

    def __init__(self, run: Run, wish: Wish) -> None:
        self.run, self.wish = run, wish
        top, foot = bands(wish.size[1])
        size = wish.size[0], wish.size[1] - top - foot
        positions = [np.asarray(columns["position"]) for columns in run.filaments.values()] + extents(run)
        thick = max(float(rod.radius.max()) for rod in rods_of(run).values())
        self.frame: Frame = frame_for(viewpoint(positions), positions, thick, size)
        self.scale = _scale(run, wish)
        self.fastest = _fastest(run)
        bars = [self.scale]
        if wish.flow in ("slice", "streamlines"):
            bars.append(Scale("", _words("speed of the fluid", "length/time", run), FLOW, 0.0, self.fastest))
        note = {
            "slice": "flow in the plane through the middle",
            "glyphs": f"longest arrow: {self.fastest:.3g}, length as the root of the speed",
            "streamlines": "flow along the plane through the middle",
        }.get(wish.flow, _of_thickness(run))
        strongest = _strongest(run)
        note = "; ".join(word for word in (note, _of_links(run, strongest), LEGEND if run.bodies else "") if word)
        title = " ".join(run.case.title.split()) or run.path.stem
        pixel = 2 * self.frame.half / size[1]
        self.words = Words(title, tuple(bars), run.case.units.length, pixel, note)
        self.stage = Stage(run, self.frame, size, strongest)
        height = fluid_model(run.case).wall
        if height is not None:
            self.stage.wall(height)

    def one(self, output: int) -> np.ndarray:
        """The picture (height, width, 3) of an output."""
        time = float(self.run.time[output])
        self.stage.tubes(output, self.scale)
        self._flow(time)
        return self._page(_time(time, self.run))

    def montage(self) -> np.ndarray:
        """Shapes at times evenly spaced over the run, in one picture, coloured by time."""
        times = self.run.time
        picked = np.unique([self.run.output_at(t) for t in np.linspace(times[0], times[-1], self.wish.montage)])
        to_scale = [self.stage.shape(int(output), self.scale) for output in picked]
        if not all(to_scale):
            self.words = self.words._replace(note="rods drawn thinner than they are")
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


def _of_thickness(run: Run) -> str:
    """The note on rods that have no thickness to show: no radius in the case, and no grid that gives them one."""
    bare = not run.case.fluid.on_grid and any(run.filament(name).radius is None for name in run.filaments)
    return "no radius given: drawn L/100 thick" if bare else ""


def _time(time: float, run: Run) -> str:
    unit = run.case.units.time
    return f"time {time:.4g}" + ("" if unit == "1" else f" {unit}")


def _words(words: str, dimension: str, run: Run) -> str:
    unit = label(run.case.units, dimension)
    return words if unit == "1" else f"{words} ({unit})"


def _scale(run: Run, wish: Wish) -> Scale:
    """The colours of the quantity over the run, but for the outermost hundredths; with a sign, zero in the middle."""
    if wish.montage:
        return Scale("time", _words("time", "time", run), TIMES, float(run.time[0]), float(run.time[-1]))
    import pyvista

    words, dimension, signed = QUANTITIES[wish.colour]
    picked = np.unique(np.linspace(0, len(run) - 1, 100).astype(int))
    every = [quantity(pyvista.wrap(filament_data(run, int(i))), wish.colour) for i in picked]
    low, high = np.nanpercentile(np.concatenate(every), (1, 99))
    if signed:
        high = max(abs(low), abs(high))
        low = -high
    if not high - low > 1e-12 * max(abs(low), abs(high)):
        low, high = low - 1.0, high + 1.0
    return Scale(wish.colour, _words(words, dimension, run), "coolwarm" if signed else TIMES, float(low), float(high))


def _fastest(run: Run) -> float:
    """The speed that is darkest, or has the longest arrow: of the rods' nodes, but for the fastest hundredth."""
    speeds = [np.linalg.norm(np.asarray(columns["velocity"]), axis=-1).ravel() for columns in run.filaments.values()]
    return max(float(np.nanpercentile(np.concatenate(speeds), 99)), 1e-300)


def _save_picture(path: Path, picture: np.ndarray) -> None:
    from PIL import Image

    with replacing(path) as part:
        Image.fromarray(picture).save(part)


def _save_film(
    path: Path, pictures: Iterator[np.ndarray], fps: float, count: int, log: Callable[[str], object]
) -> None:
    """By imageio: H.264 in mp4 through ffmpeg, or gif."""
    try:
        import imageio

        if path.suffix == ".mp4":
            import imageio_ffmpeg

            imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise CaseError([f"{path}: films need imageio and imageio-ffmpeg: pip install 'ibfil[film]'"]) from None
    more = {"duration": 1000 / fps, "loop": 0}
    if path.suffix == ".mp4":
        more = {"fps": fps, "macro_block_size": 2, "quality": 8}
    with replacing(path) as part, imageio.get_writer(part, **more) as film:
        told = clock.monotonic()
        for i, picture in enumerate(pictures, 1):
            film.append_data(picture)
            if i == 1 or i == count or clock.monotonic() - told > _TELL_EVERY:
                told = clock.monotonic()
                log(f"{path}: {i} of {count} pictures")
