"""Rods that come into contact, as tests of that share them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.rods.neighbour_search import Segments
from ibfil.running import run as running_run
from ibfil.running.result import Result

ROD: dict[str, Any] = {"length": 1.0, "bending": 1.0, "stretching": 1000.0, "nodes": 12, "derivative": 2}
GRID = {"model": "stokes", "box": [2.0, 2.0, 1.0], "cells": [32, 32, 16]}


def case(rods: dict[str, Any], contact: dict[str, Any] | None, fluid=None, every: float = 0.1, **time: Any) -> Case:
    """Rods in RFT (or ``fluid``), with or without contact."""
    text = {
        "filament": {name: {**ROD, **rod} for name, rod in rods.items()},
        **({} if contact is None else {"contact": contact}),
        "fluid": {"model": "rft", "drag": "paper", "viscosity": 1.0, **(fluid or {})},
        "time": {"end": 1.0, "step": 0.01, **time},
        "output": {"every": every},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def crossed(gap: float, weight: float, **more: Any) -> dict[str, Any]:
    """Two rods, one along x and one along y, that cross in the middle, drawn towards each other along z."""
    upper = {"direction": [1, 0, 0], "position": [0, 0, gap / 2], "loads": {"weight": [0, 0, -weight]}}
    lower = {"direction": [0, 1, 0], "position": [0, 0, -gap / 2], "loads": {"weight": [0, 0, weight]}}
    return {"upper": {**upper, **more}, "lower": {**lower, **more}}


def ran(scene: Case, output: Path | None = None, **more: Any) -> tuple[Result, list[str]]:
    """The result of a run, and what was said."""
    said: list[str] = []
    return running_run.run(scene, output, progress=False, log=said.append, **more), said


def suspension(seed, count, nodes, side, radius=0.02, length=0.5, wander=0.3):
    """Crooked rods of two thicknesses at random in a cube and beyond it, and their segments."""
    rng = np.random.default_rng(seed)
    step = rng.standard_normal((count, 1, 3)) + wander * rng.standard_normal((count, nodes - 1, 3))
    step *= length / (nodes - 1) / np.linalg.norm(step, axis=2, keepdims=True)
    start = rng.uniform(-side / 2, side / 2, (count, 1, 3))
    start[::7] += 3 * side  # together, so that they meet without a box too
    r = np.concatenate([start, start + np.cumsum(step, axis=1)], axis=1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * nodes + np.arange(nodes - 1)).ravel()
    s = np.tile(np.arange(nodes - 1), count) * length / (nodes - 1)
    rod = np.repeat(np.arange(count), nodes - 1)
    return r, Segments(first, s, s + length / (nodes - 1), rod, radius * (1 + rod % 2), np.zeros(len(first)))
