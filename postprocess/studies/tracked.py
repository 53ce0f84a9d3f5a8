"""The points of whip.toml as a camera would see them, with noise: python tracked.py writes them into tracked.csv.

25 frames, 8 ms apart, of 13 points along the fibre; each coordinate is off by a normal error of 0.12 um, 1 % of the
length, independent of all others.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import ibfil

NOISE, EVERY, SEED = 0.12, 2, 1


def lines() -> Iterator[str]:
    """The lines of the table."""
    noise = np.random.default_rng(SEED)
    with tempfile.TemporaryDirectory() as folder:
        ibfil.run(Path(__file__).with_name("whip.toml"), Path(folder) / "truth.h5")
        with ibfil.open(Path(folder) / "truth.h5") as run:
            some = run.arclength("fibre")[::EVERY]
            yield "t_ms,s_um,x_um,y_um"
            for time, shape in zip(run.time[1:], run.position("fibre")[1:, ::EVERY, :2], strict=True):
                for s, (x, y) in zip(some, shape + noise.normal(0, NOISE, shape.shape), strict=True):
                    yield f"{1e3 * time:.0f},{s:.1f},{x:.4f},{y:.4f}"


if __name__ == "__main__":
    Path(__file__).with_suffix(".csv").write_text("\n".join(lines()) + "\n")
