"""Words of physics, and what each changes in the scene of a swimmer: overrides, as of the command line."""

from __future__ import annotations

from typing import Any, NamedTuple


class Physics(NamedTuple):
    """One kind of physics: what it is, and the keys it sets; None takes one out."""

    words: str
    keys: dict[str, Any]


START: dict[str, Any] = {
    "title": "what it shows",
    "filament": {
        "rod": {
            "length": 1.0,
            "nodes": 41,
            "bending": 1.0,
            "stretching": 400.0,
            "curvature": ["8*sin(4*pi*s - 10*t)", 0],
        }
    },
    "fluid": {"model": "stokes", "viscosity": 1.0, "box": [3.2, 3.2, 3.2], "cells": [64, 64, 64]},
    "time": {"end": 1.0, "step": "auto"},
    "output": {"every": 0.05},
    "observe": {"speed": {"kind": "speed", "filament": "rod"}},
}
_STILL = {"filament.rod.curvature": None}
_NO_BOX = {"fluid.box": "free", "fluid.cells": None, "fluid.spacing": 0.05}

PHYSICS: dict[str, Physics] = {
    "rft": Physics(
        "resistive-force theory in place of a grid", {"fluid.model": "rft", "fluid.box": None, "fluid.cells": None}
    ),
    "free": Physics("Stokes flow in free space, no box", _NO_BOX),
    "wall": Physics(
        "a no-slip wall at z = 0, in free space",
        {**_NO_BOX, "fluid.wall": "no-slip", "filament.rod.position": [0, 0, 2]},
    ),
    "inertia": Physics("a fluid with inertia", {"fluid.model": "navier-stokes", "fluid.density": 1.0}),
    "flow": Physics("a background flow", {"fluid.flow": ["sin(2*pi*y/3.2)", 0, 0]}),
    "twist": Physics("a rod that twists", {"filament.rod.twisting": 1.0, "filament.rod.radius": 0.05}),
    "clamped": Physics(
        "an end that is held, and a force on the other",
        {
            **_STILL,
            "filament.rod.start": {"end": "clamped"},
            "filament.rod.finish": {"force": [0, 0.5, 0]},
            "filament.rod.normal": [0, 0, 1],
        },
    ),
    "loads": Physics("loads along the rod", {"filament.rod.loads": {"force": ["sin(pi*s)*cos(5*t)", 0, 0]}}),
    "closed": Physics(
        "a ring",
        {
            **_STILL,
            "filament.rod.closed": True,
            "filament.rod.shape": {"kind": "circle", "curvature": "2*pi"},
        },
    ),
    "mass": Physics("a rod with mass", {"filament.rod.mass": 0.01}),
    "copies": Physics(
        "copies of the rod in a row, each a phase behind",
        {
            "filament.rod.copies": {"count": 3, "at": [0, "0.4*i", 0], "phase": "-pi/2*i"},
            "filament.rod.curvature": ["8*sin(4*pi*s - 10*t + phase)", 0],
            "observe.speed": {"kind": "speed", "filament": "rod", "copies": "mean"},
        },
    ),
    "contact": Physics(
        "filaments that do not pass through each other", {"contact": {"action": "repel", "distance": 0.1}}
    ),
    "link": Physics(
        "a spring that holds an end",
        {
            "link": {
                "spring": {
                    "kind": "spring",
                    "between": [{"filament": "rod", "at": "start"}, {"point": [0, 1, 0]}],
                    "stiffness": 1.0,
                }
            },
        },
    ),
    "body": Physics(
        "a sphere that the rod begins in",
        {
            "body": {"head": {"shape": {"kind": "sphere", "radius": 0.2}}},
            "filament.rod.start": {"end": "body", "body": "head"},
        },
    ),
    "thermal": Physics("thermal forces", {**_STILL, "thermal": {"energy": 0.01, "seed": 1}, "output.every": 0.01}),
    "fields": Physics("the flow on a grid, written", {"output.grid_every": 0.25}),
    "stop": Physics("a rule that ends the run", {"stop": [{"observe": "speed", "above": 100.0}]}),
    "expect": Physics(
        "a number that `ibfil verify` holds the run against",
        {
            "expect": {"speed": {"observe": "speed", "range": [0.0, 100.0], "source": "where it comes from"}},
        },
    ),
}
