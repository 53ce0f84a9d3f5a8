"""The figure of the study of heads: what a head costs a sperm cell, by its radius, in four fluids.

`python postprocess/studies/heads.py` draws results/heads.png from the comparisons that run.sh made.
"""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from ibfil.visualization.style import COLOURS, MARKS, STYLE, save

RESULTS = Path(__file__).parent / "results"
FLUIDS = {
    "rft": "RFT, drag of the paper",
    "matched": "RFT, drag of a rod on the grid",
    "free": "grid, free space",
    "stokes": "grid, box of 2 x 1.2 x 1.2",
}
LINES = ("-", "--", "-", ":")
RADII = ("none", "0.075", "0.1", "0.15", "0.2")


def numbers(fluid: str, quantity: str) -> list[float]:
    """Those of each radius, in order."""
    out = []
    for radius in RADII:
        details = json.loads((RESULTS / f"head_{radius}.json").read_text(encoding="utf-8"))
        found = {one["fluid"]: one["numbers"] for one in details["fluids"]}
        out.append(found[fluid][quantity]["value"])
    return out


def main() -> None:
    """Draw it."""
    with matplotlib.rc_context(STYLE):
        fig = Figure(figsize=(7.6, 3.3), layout="constrained")
        left, right = fig.subplots(1, 2)
        radii = [0.0 if radius == "none" else float(radius) for radius in RADII]
        for (fluid, label), colour, mark, line in zip(FLUIDS.items(), COLOURS, MARKS, LINES, strict=False):
            for axes, quantity in ((left, "speed"), (right, "power of the nodes")):
                values = numbers(fluid, quantity)
                over = [value / values[0] for value in values]
                axes.plot(radii, over, line, marker=mark, ms=5, color=colour, label=label)
        for axes, name in ((left, "speed"), (right, "power")):
            axes.axhline(1.0, color="0.75", lw=0.8, zorder=0)
            axes.set_xlabel("radius of the head / length of the tail (0: no head)")
            axes.set_ylabel(f"{name} / {name} without a head")
            axes.set_ylim(bottom=0)
        left.legend(loc="lower left")
        save(fig, RESULTS / "heads.png")


if __name__ == "__main__":
    main()
