"""Keys of a case that do nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from .fluid import Coefficients, Matched
from .schema import Case
from .toml import load


def idle_keys(case: Case) -> list[str]:
    """The keys of the file that do nothing under its fluid and start shapes, and the parameters that nothing uses."""
    raw = load(case.text)
    fluid = case.fluid
    idle: dict[str, list[str]] = {"fluid": [] if fluid.model == "navier-stokes" else ["density"], "output": []}
    if fluid.model == "rft":
        grid = [] if isinstance(fluid.drag, Matched) else ["box", "cells", "thickness", "spacing", "kernel", "slip"]
        wall = [] if any(entry.pumps for entry in case.observe.values()) else ["wall"]
        idle["fluid"] += [*grid, *wall, "method", "precision"]
        spins = isinstance(fluid.drag, Matched) and fluid.rotation == "grid"
        idle["fluid"] += [] if spins and any(f.twisting for f in case.filaments.values()) else ["rotation"]
        idle |= {f"body.{name}": ["fit"] for name in case.bodies}
        idle["output"] += ["grid_every", "fields", "grid_stride", "window", "window_at", "probes"]
    else:
        idle |= {f"body.{name}": ["resistance"] for name in case.bodies}
        turns = fluid.rotation == "local" and any(f.twisting for f in case.filaments.values())
        spin = isinstance(fluid.drag, Coefficients) and fluid.drag.spin is not None
        idle["fluid"] += [] if turns and spin else ["drag"]
    idle["output"] += [] if any(f.copies for f in case.filaments.values()) else ["copies_every"]
    placing = ["position", "anchor", "direction", "align", "normal"]
    idle |= {f"filament.{name}": placing for name, f in case.filaments.items() if f.shape.kind == "run"}
    written = [f"{table}.{key}" for table, names in idle.items() for key in names if key in _table(raw, table)]
    used = set(re.findall(r"[A-Za-z_]\w*", " ".join(_texts(raw))))
    return written + [f"parameters.{key}" for key in raw.get("parameters", {}) if key not in used]


def _table(raw: dict[str, Any], path: str) -> dict[str, Any]:
    """The table of that path; empty where the file has none."""
    for part in path.split("."):
        raw = raw.get(part, {})
    return raw


def _texts(value: Any) -> Iterator[str]:
    """The texts in the file's content in which a parameter may stand."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, list):
        for item in value:
            yield from _texts(item)
    elif isinstance(value, dict):
        for key, item in value.items():
            if key not in ("title", "source", "units", "path", "file"):
                yield from _texts(item)
