"""`ibfil vtk`: files for ParaView."""

from __future__ import annotations

import argparse
from shlex import quote

from ..screen import tell
from .arguments import DONE, digit, seconds

NAME, HELP = "vtk", "write ParaView files: a .pvd collection of filaments and fields"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("-o", dest="folder", metavar="DIR", help="the folder (default: the run's name)")
    command.add_argument("--wrap", action="store_true", help="bring filaments into the periodic box, cut at its faces")
    command.add_argument("--images", type=digit, default=0, metavar="N", help="periodic images in N boxes on each side")
    command.add_argument(
        "--watch", type=seconds, nargs="?", const=5.0, metavar="SECONDS", help="follow a run until it ends (5 s)"
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    from ..visualization.vtk_files import write_vtk

    more = {"wrap": arguments.wrap, "images": arguments.images, "watch": arguments.watch, "log": tell}
    path = write_vtk(arguments.run, arguments.folder, **more)
    scene = quote(str(path.with_name(path.stem + "_paraview.py")))
    tell(f"open {path} in ParaView, or a ready scene: paraview --state={scene}")
    alone = path.with_stem(f"{path.stem}_filaments")
    if alone.exists():
        tell(f"for filters of lines, such as Tube: {alone}, of the filaments alone")
    return DONE
