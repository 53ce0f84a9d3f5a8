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
    command.add_argument(
        "--colour", default="tension", metavar="WHAT", help="tension, curvature, speed, filament, force.x ..."
    )
    command.add_argument("--range", default="run", metavar="LOW,HIGH", help="of the colours; or run (default), or last")
    command.add_argument("--view", metavar="X,Y,Z", help="from where it is looked at: x, -z ..., or three numbers")
    command.add_argument("--up", metavar="X,Y,Z", help="upwards in the picture (default: off a wall, against weight)")
    command.add_argument("--zoom", type=float, default=1.0, metavar="N", help="nearer, above 1")
    command.add_argument("--box", action="store_true", help="draw the periodic box")
    command.add_argument(
        "--wrap", action="store_true", help="bring all into the box: filaments cut at its faces, links and bodies whole"
    )
    command.add_argument("--follow", metavar="NAME", help="keep this filament in the middle")
    command.add_argument("--flow", default="none", metavar="HOW", help="none, slice, glyphs or streamlines")
    command.add_argument("--montage", type=int, default=0, metavar="N", help="N shapes over the run in one picture")
    command.add_argument("--time", type=float, metavar="T", help="of a picture (default: the last)")
    command.add_argument("--size", type=pixels, default=(1280, 960), metavar="WxH", help="in pixels (1280x960)")
    command.add_argument("--fps", type=float, default=25.0, metavar="N", help="pictures a second of a film (25)")
    command.add_argument("--every", type=int, default=1, metavar="N", help="show every N-th output only")


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..visualization.pictures import Wish
    from ..visualization.render import render

    a = arguments
    wish = Wish(a.colour, a.flow, a.montage, a.time, a.size, a.fps, a.every)
    wish = wish._replace(view=a.view, up=a.up, zoom=a.zoom, box=a.box, wrap=a.wrap, follow=a.follow, range=a.range)
    tell(render(a.run, a.output, wish, tell, overwrite=a.force))
    return DONE
