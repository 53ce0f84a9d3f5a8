"""A twin for fits: a clamped rod that is swung, its parameters, and tables of its points."""

from __future__ import annotations

import numpy as np

SWUNG = """
title = "A clamped rod swung to and fro"
source = "a twin"
units = { length = "um", time = "s" }
[parameters]
A = 1.3
zeta = 12.0
amplitude = 0.16
[filament.rod]
length = 1.0
nodes = 11
bending = "A"
stretching = "500*A"
direction = [1, 0, 0]
[filament.rod.start]
end = "clamped"
moves = [0, "amplitude*sin(2*pi*t)", 0]
[fluid]
model = "rft"
viscosity = 1.0
drag = { perp = "zeta", par = "zeta/1.8" }
[time]
end = 1
step = 0.02
[output]
every = 0.1
[observe.tip]
kind = "position"
at = "finish"
"""
TRUTH = {"parameters.A": 1.0, "parameters.zeta": 12.0, "parameters.amplitude": 0.2}
BOUNDS = {"parameters.A": (0.2, 5.0), "parameters.amplitude": (0.02, 1.0)}


def table(track, noise=0.0, seed=0, turn=0.0):
    """Every second node in nanometres and milliseconds, turned and noisy."""
    position, time, s = track
    rng = np.random.default_rng(seed)
    c, d = np.cos(turn), np.sin(turn)
    rows = ["t_ms,s_um,x_nm,y_nm"]
    for points, t in zip(position, time, strict=True):
        for (x, y, _), at in zip(points[::2].tolist(), s[::2].tolist(), strict=True):
            x, y = 1e3 * (np.array([c * x - d * y, d * x + c * y + turn]) + noise * rng.normal(size=2))
            rows.append(f"{1e3 * float(t)!r},{at!r},{float(x)!r},{float(y)!r}")
    return "\n".join(rows) + "\n"
