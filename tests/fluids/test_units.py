"""The unit of length is the user's: a case in micrometres and one in metres are one."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.case.reading import parse_case
from ibfil.running.run import run

SCENE = """
[parameters]
L = 1.0
f = 1.0
[filament.rod]
length = "L"
nodes = 17
bending = "f*L**2"
twisting = "f*L**2"
stretching = "1000*f"
radius = "0.02*L"
twist_rate = "3/L"
shape = { kind = "circle", curvature = "2/L" }
start = { end = "clamped", spin = 20.0 }
[fluid]
model = "stokes"
viscosity = "f/L**2"
box = ["2*L", "2*L", "1.5*L"]
cells = [32, 32, 24]
rotation = "grid"
[time]
end = 0.01
step = 2e-3
[output]
every = 0.01
"""


@pytest.mark.parametrize("method", ["table", "fft", "krylov"])
def test_twist_torques_on_the_grid_keep_their_digits_in_any_unit(method):
    """Powers of two: the same bits. Rows of turns, left in radians beside moves of 1e-6, cost four to ten digits."""
    found = []
    for length, force in ((1.0, 1.0), (2.0**-20, 2.0**-40)):
        keys = [f"parameters.L={length!r}", f"parameters.f={force!r}", f"fluid.method={method}"]
        rod = run(parse_case(SCENE, "scene.toml", keys), progress=False, log=lambda line: None).snapshot.filaments[
            "rod"
        ]
        found.append((rod.position / length, rod.force / force, rod.torque / (force * length), rod.e1))
    for one, other in zip(*found, strict=True):
        assert np.array_equal(one, other)
