"""The figure of the flutter study: the threshold of a clamped rod against its thickness, in three fluids.

`python postprocess/studies/flutter.py` draws results/flutter.png from the thresholds that run.sh found.
"""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from ibfil.visualization.style import COLOURS, STYLE, save

RESULTS = Path(__file__).parent / "results"
FLUIDS = (("free", "grid, free space", "s"), ("box", "grid, periodic box of 3.2 L", "^"))


def threshold(name: str) -> tuple[float, float]:
    """The threshold of a study, A/L^2, and its bar."""
    details = json.loads((RESULTS / f"flutter_{name}.json").read_text(encoding="utf-8"))
    found = details["threshold"]
    return found["value"], found["bar"]


def main() -> None:
    """Draw it."""
    with matplotlib.rc_context(STYLE):
        fig = Figure(figsize=(5.2, 3.4), layout="constrained")
        axes = fig.subplots()
        value, _ = threshold("rft")
        axes.axhline(value, color=COLOURS[6], ls="--", label=f"resistive-force theory, {value:.2f} at any thickness")
        for (name, label, mark), colour in zip(FLUIDS, COLOURS, strict=False):
            inverse = sorted(int(path.stem.split("_")[-1]) for path in RESULTS.glob(f"flutter_{name}_*.json"))
            values, bars = zip(*(threshold(f"{name}_{n}") for n in inverse), strict=True)
            shift = 1.01 if name == "box" else 1.0  # so that bars do not hide each other
            axes.errorbar(
                [shift / n for n in inverse], values, yerr=bars, fmt=mark, color=colour, capsize=3, label=label
            )
        axes.set_xscale("log")
        ticks = [1 / 36, 1 / 27, 1 / 18]
        axes.set_xticks(ticks, [f"1/{round(1 / tick)}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlim(1 / 45, 1 / 15)
        axes.set_ylim(24, 40)
        axes.set_xlabel("hydrodynamic radius / length, a/L")
        axes.set_ylabel("threshold of flutter, F L^2/A")
        axes.legend(loc="lower left")
        save(fig, RESULTS / "flutter.png")


if __name__ == "__main__":
    main()
