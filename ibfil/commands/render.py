"""`ibfil render`: pictures and films of a run."""

from __future__ import annotations

import argparse

from ..screen import tell
from .arguments import DONE, pixels

NAME, HELP = "render", "draw a run without a display: a picture (png) or a film (mp4, gif)"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("-o", dest="output", metavar="FILE", required=True, help="film.mp4, film.gif or picture.png")
    command.add_argument("--force", action="store_true", help="write over a picture or film that is there already")
    command.add_argument("--colour", default="tension", metavar="WHAT", help="tension, moment, curvature, speed ...")
    command.add_argument("--flow", default="none", metavar="HOW", help="none, slice, glyphs or streamlines")
    command.add_argument("--montage", type=int, default=0, metavar="N", help="N shapes over the run in one picture")
    command.add_argument("--time", type=float, metavar="T", help="of a picture (default: the last)")
    command.add_argument("--size", type=pixels, default=(1280, 960), metavar="WxH", help="in pixels (1280x960)")
    command.add_argument("--fps", type=float, default=25.0, metavar="N", help="pictures a second of a film (25)")
    command.add_argument("--every", type=int, default=1, metavar="N", help="show every N-th output only")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..visualization.render import Wish, render

    a = arguments
    wish = Wish(a.colour, a.flow, a.montage, a.time, a.size, a.fps, a.every)
    tell(render(a.run, a.output, wish, tell, overwrite=a.force))
    return DONE
