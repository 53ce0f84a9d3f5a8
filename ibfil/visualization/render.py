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

import numpy as np

from ..analysis.run import open_run
from ..analysis.summary import duration
from ..errors import CaseError
from ..io.overwriting import BY_ENDING, refuse, replacing
from ..screen import tell
from .pictures import Pictures, Wish
from .quantities import QUANTITIES, limits_of

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
        outputs = range(0, len(opened), wish.every)
        picture = path.suffix in PICTURES
        pictures = Pictures(opened, wish, [opened.output_at(wish.time)] if picture else outputs)
        try:
            if picture:
                _save_picture(path, pictures.montage() if wish.montage else pictures.one(pictures.shown[0]))
            else:
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
    if not 0.01 <= wish.zoom <= 1000:
        faults.append(f"--zoom: found {wish.zoom:g}; allowed: 0.01 to 1000, 2 is twice as near")
    if wish.follow is not None and wish.wrap:
        faults.append("--follow: found with --wrap; allowed: one of them")
    if faults:
        raise CaseError(faults)
    limits_of(wish.range)


def can_render() -> bool:
    """Whether vtk can draw here; tried in a process of its own, since without the libraries it ends in a crash."""
    if not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # else vtk warns that it has none
    return _runs(_PROBE)


@cache
def _runs(code: str) -> bool:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, check=False, timeout=300).returncode == 0


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
        begun = told = clock.monotonic()
        for i, picture in enumerate(pictures, 1):
            film.append_data(picture)
            if i == 1 or i == count or clock.monotonic() - told > _TELL_EVERY:
                told = clock.monotonic()
                left = (told - begun) / i * (count - i)
                log(f"{path}: {i} of {count} pictures" + (f", {duration(left)} left" if i < count else ""))
