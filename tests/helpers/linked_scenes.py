"""Rods that are linked, as tests of that share them."""

from __future__ import annotations

from typing import Any

import numpy as np
import tomli_w
from scipy.optimize import fsolve

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case

RFT: dict[str, Any] = {"model": "rft", "viscosity": 1.0}
GRID: dict[str, Any] = {"model": "stokes", "viscosity": 1.0, "box": [2.0, 2.0, 2.0], "cells": [32, 32, 32]}
ROD: dict[str, Any] = {"length": 1.0, "nodes": 11, "bending": 1.0, "stretching": 200.0}
CURVED: dict[str, Any] = {**ROD, "twisting": 0.7, "radius": 0.02, "curvature": ["2*s", 1.0]}
# Two rods askew beside each other, of different nodes, and every kind of link between them.
ASKEW: dict[str, Any] = {
    "a": CURVED,
    "b": {**CURVED, "nodes": 13, "position": [0.02, 0.1, 0.03], "direction": [1.0, 0.1, 0.05]},
}
BOUND: dict[str, Any] = {"kind": "bind", "filaments": ["a", "b"], "shear": "20 + s", "normal": 100.0, "offset": 0.03}
LINKS: dict[str, dict[str, Any]] = {
    "spring": {
        "between": [{"filament": "a", "at": 0.33}, {"filament": "b", "at": "finish"}],
        "stiffness": 40.0,
        "rest": 0.05,
    },
    "spring of no rest length": {
        "between": [{"filament": "a", "at": "start"}, {"filament": "b", "at": 0.2}],
        "stiffness": 40.0,
        "rest": 0,
    },
    "compressed spring": {
        "between": [{"filament": "a"}, {"filament": "b", "at": 0.47}],
        "stiffness": 20.0,
        "rest": 0.4,
    },
    "damped spring": {
        "between": [{"filament": "a", "at": 0.71}, {"filament": "b", "at": 0.31}],
        "stiffness": 30.0,
        "damping": 0.7,
    },
    "spring of one rod": {
        "between": [{"filament": "a", "at": "start"}, {"filament": "a", "at": "finish"}],
        "stiffness": 5.0,
        "rest": 0.5,
    },
    "spring to the lab": {
        "between": [{"point": [0.1, 0.4, 0.2]}, {"filament": "b", "at": 0.1}],
        "stiffness": 30.0,
        "rest": 0.1,
    },
    "hinge": {
        "kind": "hinge",
        "between": [{"filament": "a", "at": 0.2}, {"filament": "b", "at": 0.4}],
        "stiffness": 3.0,
    },
    "bound": {**BOUND, "slide": "0.02*s*cos(t)", "force": "3*sin(t + s)", "distance": 0.12},
    "bound in part": {**BOUND, "range": [0.2, 0.7], "shear": 0},
    "motors": {**BOUND, "motor": {"friction": 5.0, "lag": 0.2}},
    "motors that stall": {**BOUND, "motor": {"friction": 5.0, "lag": 0.2, "stall": 1.5}},
    "viscous": {**BOUND, "motor": {"friction": -3.0, "lag": 0.0}},
}


def linked(
    rods: dict[str, Any], links: dict[str, Any], fluid: dict[str, Any] = RFT, every: float = 0.1, **time: Any
) -> Case:
    """Rods with links in a fluid."""
    text = {
        "filament": rods,
        "link": {name.replace(" ", "_"): link for name, link in links.items()},
        "fluid": fluid,
        "time": {"end": 1.0, "step": 0.01, **time},
        "output": {"every": every},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


# A pair of clamped rods bound at a distance D by shear kt, with motors: eta = 1, so zeta_perp = 4 pi; A = L = 1.
DISTANCE, SHEAR, LAG, DRAG = 0.05, 4e3, 0.5, 4 * np.pi


def pair(
    nodes: int, *, force: float = 0.0, friction: float = 0.0, perturb: float = 0.0, stretching: float = 1e7, **time: Any
) -> Case:
    """The bound pair, along x; a force along y on both tips, motors of that friction."""
    rod = {
        "length": 1.0,
        "nodes": nodes,
        "bending": 1.0,
        "stretching": stretching,
        "start": {"end": "clamped"},
        "finish": {"force": [0, force / 2, 0]},
        "shape": {"kind": "straight", "perturb": [0, f"{perturb}*s**2", 0]},
    }
    link: dict[str, Any] = {"kind": "bind", "filaments": ["a", "b"], "shear": SHEAR, "normal": 1e6}
    if friction:
        link["motor"] = {"friction": friction, "lag": LAG}
    rods = {"a": {**rod, "position": [0, -DISTANCE / 2, 0]}, "b": {**rod, "position": [0, DISTANCE / 2, 0]}}
    return linked(rods, {"pair": link}, **time)


def pair_mode(friction: float, near: complex) -> complex:
    """The growth rate of the pair with motors, near a guess: from the determinant of its four boundary conditions.

    2 zeta lam y = -2 A y'''' + K y'',  K = D^2 (kt - gamma lam/(1 + lam T)): y = y' = 0 at the clamp, y'' = 0 and
    -2 A y''' + K y' = 0 at the tip.
    """

    def determinant(lam: complex) -> complex:
        k = DISTANCE**2 * (SHEAR - friction * lam / (1 + lam * LAG))
        r = np.roots([2.0, 0.0, -k, 0.0, 2 * DRAG * lam])
        rows = np.array([r**0, r, r**2 * np.exp(r), (k * r - 2 * r**3) * np.exp(r)])
        rows /= np.abs(rows).max(axis=1)[:, None]
        distinct = np.prod([r[i] - r[j] for i in range(4) for j in range(i)])
        return np.linalg.det(rows) / distinct

    def parts(x):
        value = determinant(complex(*x))
        return [value.real, value.imag]

    found, _, ok, _ = fsolve(parts, [near.real, near.imag], full_output=True, xtol=1e-13)
    assert ok == 1
    return complex(*found)
