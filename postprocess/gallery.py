"""A gallery of the shipped cases: python -m postprocess.gallery [NAME ...] writes cases/README.md and its pictures.

Each case is run in its quick form, as `ibfil verify --quick` does; of those not named the entries stay as they are. A
case is a picture (its shapes, from light to dark as time goes on, in the plane in which it moves most), what it shows,
the number that is expected, with how far it may be off, the number found, and the time that took.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

import ibfil
from ibfil.analysis.summary import duration
from ibfil.case import library
from ibfil.case.reading import quick_case
from ibfil.visualization.bodies import add_outlines
from ibfil.visualization.style import plane_of_motion

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURES = ROOT / "cases" / "README.md", ROOT / "postprocess" / "pictures" / "cases"
SHAPES = 12
DARK = (0.0, 0.27, 0.53)
HEAD = """# The shipped cases

`ibfil run NAME` runs one, `ibfil new NAME mine.toml` copies it. Pictures show its shapes from light to dark as
time goes on; the number is that of its first `[expect]` table, and the time that of its quick form beside other
work. Written by `python -m postprocess.gallery`; a test holds it against the cases.
"""


def picture(run: ibfil.Run, path: Path) -> None:
    """Draw some of the shapes of a run, 300 x 200 points."""
    positions = [np.asarray(columns["position"]) for columns in run.filaments.values()]
    across, up = plane_of_motion(positions)
    fig = Figure(figsize=(3.0, 2.0), dpi=100, layout="constrained")
    axes = fig.subplots()
    some = np.unique(np.linspace(0, len(run) - 1, SHAPES).astype(int))
    for shade, output in zip(np.linspace(0.25, 1.0, len(some)), some, strict=True):
        for r in positions:
            axes.plot(r[output, :, across], r[output, :, up], color=DARK, alpha=shade, lw=1.2)
    fading = ListedColormap(1 - np.linspace(0.25, 1.0, 64)[:, None] * (1 - np.array(DARK)))
    add_outlines(axes, run, (across, up), some, fading, (0.0, float(run.time[-1])))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("xyz"[across], fontsize=8)
    axes.set_ylabel("xyz"[up], fontsize=8)
    axes.tick_params(labelsize=7)
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(fig).print_png(path, metadata={"Software": ""}, pil_kwargs={"optimize": True})


def entry(shipped: library.Shipped) -> str:
    """Run one case in its quick form, draw it, and return what is told of it."""
    case = ibfil.read_case(shipped.name)
    first = next(iter(case.expect))
    with tempfile.TemporaryDirectory() as folder:
        result = ibfil.run(quick_case(case, first), Path(folder) / "run.h5")
        picture(ibfil.open(Path(folder) / "run.h5"), PICTURES / f"{shipped.name}.png")
    check = next(one for one in result.checks if one.name == first)
    verdict = "" if check.passed else " (**differs**)"
    took = duration(result.wall_time)
    lines = [
        f"### {shipped.name}",
        "",
        f"![{shipped.name}](../postprocess/pictures/cases/{shipped.name}.png)",
        "",
        f"{shipped.title}.",
        f"Source: {shipped.source}.",
        f"`{first}`: expected {check.expected}, found {float(check.found):.6g}{verdict}, in {took}.",
        "",
    ]
    return "\n".join(lines)


def entries(text: str) -> dict[str, str]:
    """The entries of a page by name."""
    found = re.findall(r"^### (\S+)\n.*?(?=^##|\Z)", text, re.MULTILINE | re.DOTALL)
    parts = re.findall(r"^### \S+\n.*?(?=^##|\Z)", text, re.MULTILINE | re.DOTALL)
    return {name: part.rstrip() + "\n" for name, part in zip(found, parts, strict=True)}


def main(names: list[str]) -> None:
    """Run the cases of these names, or all, and write the page."""
    known = entries(PAGE.read_text()) if PAGE.exists() else {}
    listing = library.listing()
    for shipped in listing:
        if shipped.name in names or not names:
            known[shipped.name] = entry(shipped)
            print(shipped.name, flush=True)
            write(listing, known)


def write(listing: list[library.Shipped], known: dict[str, str]) -> None:
    """Write the page: the entries that there are, group after group."""
    groups = dict.fromkeys(shipped.group for shipped in listing)
    parts = [HEAD]
    for group in groups:
        mine = [known[one.name] for one in listing if one.group == group and one.name in known]
        parts += [f"## {group}\n", *mine] if mine else []
    PAGE.write_text("\n".join(parts).rstrip() + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
