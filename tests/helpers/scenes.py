"""Scenes that several tests share, in units of the rod, so that its size and the viscosity drop out.

Lengths are in units of L, times in units of T = eta L^4/A, forces in units of A/L^2. ``smooth`` scenes start
straight and at rest, and what drives them grows like t^3: orders of convergence can be read off only there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.rods.constitutive import Linear
from ibfil.rods.loads import Follower
from ibfil.rods.mesh import Segmented, stack
from ibfil.rods.system import RodSystem
from ibfil.simulation.simulation import Simulation

# A grid small enough for tests: nodes further apart than cells, so nothing locks (fluids/README.md).
STOKES: Mapping[str, Any] = {"model": "stokes", "box": [2.0, 2.0, 2.0], "cells": [32, 32, 32], "slip": 0.01}
RFT: Mapping[str, Any] = {"model": "rft", "drag": "paper"}  # 4 pi eta across, 2 pi eta along: round numbers
# Every unknown at work: bent and twisted in space by strains of its own, and spun at a clamp.
RIBBON: Mapping[str, Any] = {
    "length": 1.0,
    "nodes": 11,
    "bending": [1.0, 0.5],
    "twisting": 0.7,
    "stretching": 400.0,
    "radius": 0.05,
    "curvature": ["6*sin(2*pi*s - 10*t)", "3*cos(10*t)"],
    "twist_rate": "5*sin(10*t)",
    "shape": {"kind": "relaxed"},
    "normal": [0, 1, 0],
    "start": {"end": "clamped", "spin": 15.0},
}


def scene(
    rods: Mapping[str, Mapping[str, Any]],
    fluid: Mapping[str, Any] = RFT,
    *,
    viscosity: float = 1.0,
    end: float = 1.0,
    **time: Any,
) -> Case:
    """Any filaments (one table each) in a fluid, in the case's own units; ``time`` holds keys of [time]."""
    text = {
        "filament": {name: dict(table) for name, table in rods.items()},
        "fluid": {**fluid, "viscosity": viscosity},
        "time": {"end": end, **time},
        "output": {"every": end},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def _scaled(
    rod: dict[str, Any],
    fluid: Mapping[str, Any],
    length: float,
    viscosity: float,
    bending: float,
    end: float,
    time: Mapping[str, Any],
) -> Case:
    """A rod and a fluid in units of L, T, A as a case."""
    unit = viscosity * length**4 / bending
    fluid = dict(fluid)
    if "box" in fluid:
        fluid["box"] = [length * side for side in fluid["box"]]
    scaled = {key for key in ("step", "min_step") if time.get(key, "auto") != "auto"}
    time = {key: unit * value if key in scaled else value for key, value in time.items()}
    text = {
        "parameters": {"L": length, "T": unit, "A": bending},
        "filament": {"rod": {"length": length, **rod}},
        "fluid": {**fluid, "viscosity": viscosity},
        "time": {"end": unit * end, **time},
        "output": {"every": unit * end},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def swimmer(
    fluid: Mapping[str, Any] = RFT,
    *,
    length: float = 1.0,
    viscosity: float = 1.0,
    bending: float = 1.0,
    rate: float = 10.0,
    stretching: float = 1.6e4,
    smooth: bool = False,
    end: float = 1.0,
    rod: Mapping[str, Any] | None = None,
    **time: Any,
) -> Case:
    """The paper's swimmer of Sec. 7.1: a travelling wave of preferred curvature; ``rate`` is omega T.

    ``rod`` holds further keys of the filament, ``time`` keys of [time], step and end in units of T.
    """
    wave = f"8/L*sin(4*pi*s/L - {rate}*t/T)"
    table: dict[str, Any] = {
        "nodes": 41,
        "bending": "A",
        "stretching": f"{stretching}*A/L**2",
        "curvature": [f"20*(t/T)**3*{wave}" if smooth else wave, 0],
        "shape": {"kind": "straight" if smooth else "relaxed"},
        **(rod or {}),
    }
    return _scaled(table, fluid, length, viscosity, bending, end, time)


def twisting_rod(
    fluid: Mapping[str, Any] = RFT,
    *,
    length: float = 1.0,
    viscosity: float = 1.0,
    bending: float = 1.0,
    stretching: float = 400.0,
    end: float = 1.0,
    rod: Mapping[str, Any] | None = None,
    **time: Any,
) -> Case:
    """A ribbon in three dimensions, spun at a clamp, with preferred curvatures and twist that grow (smooth).

    A2 = A1/2, C = 0.7 A1, radius L/20; preferred strains fade out towards the free end.
    """
    grow, fade = "(t/T)**3", "(1 - s/L)**2"
    table: dict[str, Any] = {
        "nodes": 13,
        "bending": ["A", "A/2"],
        "twisting": "0.7*A",
        "stretching": f"{stretching}*A/L**2",
        "radius": "L/20",
        "curvature": [f"300/L*{grow}*{fade}*s/L", f"150/L*{grow}*{fade}"],
        "twist_rate": f"60/L*{grow}*{fade}",
        "anchor": "start",
        "direction": [1, 0, 0],
        "normal": [0, 1, 0],
        "start": {"end": "clamped", "spin": f"200/T*{grow}"},
        **(rod or {}),
    }
    return _scaled(table, fluid, length, viscosity, bending, end, time)


class NoEnds:
    """Nothing is held."""

    index = np.zeros(0, np.int64)

    def motion(self, before: float, after: float) -> np.ndarray:
        return np.zeros(0)


def bare(
    parts: Sequence[Segmented],
    *,
    kind: type[RodSystem] = RodSystem,
    unknowns: int = 4,
    bending: tuple[float, float] = (1.0, 0.3),
    torsion: float = 0.7,
    stretching: float = 50.0,
    strains: Callable[[np.ndarray], np.ndarray] = lambda s: np.zeros((len(s), 3)),
    followers: Mapping[int, float] | None = None,
) -> RodSystem:
    """Mechanics without a case: spacing as it pleases, nothing held, no moment at ends that are not clamped.

    ``strains`` (of s) gives kappa1, kappa2, tau0 (n, 3); ``followers`` forces along e3 by node.
    """
    mesh = stack(parts)
    n = len(mesh.ds)
    preferred = np.concatenate([strains(part.s) for part in parts])
    law = Linear(
        np.tile(bending, (n, 1)),
        np.where(mesh.joined, torsion, 0.0) if unknowns == 4 else np.zeros(n),
        (lambda t: preferred[:, 0], lambda t: preferred[:, 1]),
        lambda t: preferred[:, 2],
    )
    last = np.cumsum([len(part.s) for part in parts]) - 1
    first = np.append(0, last[:-1] + 1)
    free = np.zeros(n, bool)
    free[[i for i, part in zip(first, parts, strict=True) if part.start_tangent is None]] = True
    free[[i for i, part in zip(last, parts, strict=True) if part.finish_tangent is None]] = True
    loads = [Follower(i, lambda t, f=f: f) for i, f in (followers or {}).items()]  # type: ignore[misc]
    length = min(float(part.s[-1]) for part in parts)
    return kind(mesh, law, np.full(n, stretching), free, NoEnds(), loads, unknowns, length)


def run(case: Case, until: float | None = None) -> Simulation:
    """The simulation of a case, advanced to ``until`` (the case's unit) or to its end."""
    simulation = Simulation(case)
    simulation.advance(case.time.end if until is None else until, lambda: None)
    return simulation


def rms(difference: np.ndarray) -> float:
    """Root mean square over nodes of vectors (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


def slopes(errors: list[float], ratio: float = 2.0) -> np.ndarray:
    """Orders of convergence between successive errors, at steps or spacings in the given ratio."""
    return np.log(np.array(errors[:-1]) / np.array(errors[1:])) / np.log(ratio)
