"""What a row of cilia pumps over the phase between neighbours: python flux_over_phase.py sweep.csv figure.png."""

from __future__ import annotations

import csv
import sys

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt


def main(table: str, picture: str) -> None:
    """Draw the sweep of parameters.lag."""
    with open(table, encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    phase = np.array([float(row["parameters.lag"]) for row in rows]) / np.pi
    flux = np.array([float(row["flux"]) for row in rows])
    order = np.argsort(phase)
    fig, axes = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    axes.plot(phase[order], flux[order], "o-", color="#0072b2")
    together = float(flux[np.argmin(np.abs(phase))])
    axes.axhline(together, color="0.5", lw=1, ls="--")
    axes.annotate("in unison", (-0.98, together), xytext=(0, 4), textcoords="offset points", color="0.35")
    axes.set_xlabel(r"phase of a cilium behind the one before it, in $\pi$   (above 0 waves go with the flow)")
    axes.set_ylabel(r"mean flux along the wall, $L^3 \omega$/10")
    axes.set_title("Four cilia, one length apart", loc="left")
    axes.spines[["top", "right"]].set_visible(False)
    fig.savefig(picture, dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
