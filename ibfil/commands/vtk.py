"""`ibfil vtk`: files for ParaView."""

from __future__ import annotations

import argparse
from shlex import quote
from typing import Any

from ..errors import CaseError
from ..screen import tell
from .arguments import DONE, count, digit, seconds

NAME, HELP = "vtk", "write ParaView files: a .pvd collection of filaments and fields"


def add(command: argparse.ArgumentParser) -> None:
    """Add its arguments."""
    command.add_argument("run", metavar="RUN.h5")
    command.add_argument("-o", dest="folder", metavar="DIR", help="the folder (default: the run's name)")
    command.add_argument(
        "--wrap", action="store_true", help="bring all into the box: filaments cut at its faces, links and bodies whole"
    )
    command.add_argument("--images", type=digit, default=0, metavar="N", help="periodic images in N boxes on each side")
    command.add_argument("--every", type=count, default=1, metavar="N", help="every N-th output only; all fields")
    command.add_argument("--hdf", action="store_true", help="as VTKHDF: one file for all times of filaments, of fields")
    command.add_argument(
        "--watch", type=seconds, nargs="?", const=5.0, metavar="SECONDS", help="follow a run until it ends (5 s)"
    )


def do(arguments: argparse.Namespace) -> int:
    """Do it; returns the exit status."""
    more: dict[str, Any] = {"wrap": arguments.wrap, "images": arguments.images, "every": arguments.every}
    if arguments.hdf:
        from ..visualization.vtkhdf import write_vtkhdf

        if arguments.watch is not None:
            raise CaseError(["--watch: found with --hdf; allowed: without it, or --hdf again when the run has ended"])
        for path in write_vtkhdf(arguments.run, arguments.folder, **more):
            tell(f"open {path} in ParaView")
        return DONE
    from ..visualization.vtk_files import write_vtk

    more |= {"watch": arguments.watch, "log": tell}
    path = write_vtk(arguments.run, arguments.folder, **more)
    scene = quote(str(path.with_name(path.stem + "_paraview.py")))
    tell(f"open {path} in ParaView, or a ready scene: paraview --state={scene}")
    alone = path.with_stem(f"{path.stem}_filaments")
    if alone.exists():
        tell(f"for filters of lines, such as Tube: {alone}, of the filaments alone")
    return DONE
