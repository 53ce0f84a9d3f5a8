"""Filaments for the tests of start shapes, and a helix by its closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from ibfil.case.filament import Filament
from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.shapes.initial import initial_shape

X, Y, Z = np.eye(3)
KEY = "filament.rod"
SPATIAL = {"twisting": 1.0, "radius": 0.01}
ARC = {"kind": "circle", "curvature": 2.0}


def rod(**keys: Any) -> Filament:
    """Parse a filament of length 1 and 41 nodes, with these keys of its table."""
    table = {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 1e4} | keys
    case = {
        "filament": {"rod": table},
        "fluid": {"model": "rft", "viscosity": 1.0},
        "time": {"end": 1.0},
        "output": {"every": 1.0},
    }
    return parse_case(tomli_w.dumps(case), "test.toml").filaments["rod"]


def helix(s: np.ndarray, k: float, t: float) -> np.ndarray:
    """Nodes of the helix (curvature k, torsion t) along x from the origin, e1(0) across x being along z."""
    rate = np.hypot(k, t)
    turn, radius = rate * s, k / rate**2
    sense = -np.copysign(radius, t)
    return np.stack((abs(t) / rate * s, radius * (1.0 - np.cos(turn)), sense * np.sin(turn)), axis=1)


def fault(filament: Filament, folder: Path = Path()) -> str:
    """Take the one line with which the shape of this filament is refused."""
    with pytest.raises(CaseError) as caught:
        initial_shape(filament, KEY, folder)
    assert len(caught.value.faults) == 1
    assert "\n" not in caught.value.faults[0]
    return caught.value.faults[0]
