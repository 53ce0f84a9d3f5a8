"""How rods diffuse as rigid bodies in the fluid of a grid, from the mobility that thermal runs draw their motion from.

D = (X^T M^-1 X)^-1 by kT, X the motions of a rigid body. The periodic box takes 2.837297/(6 pi eta L) off each D along
a line (Hasimoto 1959).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import scene

from ibfil.assembly import rods as assembly_rods
from ibfil.assembly.fluids.models import fluid_model
from ibfil.fluids.resistive_force import resist

GENERIC: dict[str, Any] = {"position": [0.013, 0.027, 0.041], "direction": [1, 0.37, 0.21], "anchor": "centroid"}
ROD: dict[str, Any] = {"length": 1.0, "nodes": 11, "bending": 1.0, "stretching": 300.0, **GENERIC}


def hasimoto(box: float) -> float:
    """What a periodic box takes off a diffusivity, eta = kT = 1."""
    return 2.837297 / (6 * np.pi * box)


def motions(r: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """X (3 n, 6): translations, and turns about ``centre``."""
    columns = [np.tile(axis, len(r)) for axis in np.eye(3)]
    return np.array(columns + [np.cross(axis, r - centre).ravel() for axis in np.eye(3)]).T


def rigid(resistance: np.ndarray, r: np.ndarray, axis: np.ndarray) -> tuple[float, float]:
    """D along ``axis`` and the mean of both across it, of the centroid, turning as it likes; kT = 1."""
    weights = np.ones(len(r))
    weights[[0, -1]] = 0.5
    centroid = weights @ r / weights.sum()
    d = np.linalg.pinv(motions(r, centroid).T @ resistance @ motions(r, centroid), rcond=1e-8)[:3, :3]
    along = float(axis @ d @ axis)
    return along, 0.5 * (float(np.trace(d)) - along)


def on_grid(
    rod: dict[str, Any], box: float | str, other: dict[str, Any] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """M^-1 (3 n, 3 n) of a rod's nodes on a grid of spacing 0.1, or of two rods', and their places."""
    sides = (
        {"box": [box] * 3, "cells": [round(10 * box)] * 3} if isinstance(box, float) else {"box": box, "spacing": 0.1}
    )
    rods = {"rod": rod} if other is None else {"rod": rod, "other": other}
    case = scene(rods, {"model": "stokes", "method": "table", "slip": 0.01, **sides})
    stacked = assembly_rods.rods(case)
    response = fluid_model(case).build(stacked).response(stacked.start.r, stacked.start.e3, 0.0, 1.0)
    return np.linalg.inv(response.matrix), stacked.start.r


def test_a_straight_rod_diffuses_as_a_cylinder_of_its_hydrodynamic_radius():
    """Tirado, Martinez & Garcia de la Torre 1984, trace of D/3: kT/(3 pi eta L) (ln p + 0.312 + 0.565/p - 0.1/p^2).

    L + 2 a for the length, a = 1.1 h (peskin4). In two boxes, which agree once what a box takes off is put back.
    """
    means = []
    for box in (3.2, 6.4):
        resistance, r = on_grid(ROD, box)
        axis = (r[-1] - r[0]) / np.linalg.norm(r[-1] - r[0])
        along, across = rigid(resistance, r, axis)
        means.append((along + 2 * across) / 3 + hasimoto(box))
        assert along > 1.3 * across
    assert means[0] == pytest.approx(means[1], rel=0.01)
    length, radius = 1.22, 0.11
    p = length / (2 * radius)
    cylinder = (np.log(p) + 0.312 + 0.565 / p - 0.1 / p**2) / (3 * np.pi * length)
    assert means[1] == pytest.approx(cylinder, rel=0.02)


@pytest.mark.parametrize(
    ("box", "along", "across", "turning"),
    [(3.2, 0.168624, (0.120338 + 0.119827) / 2, 0.671988), (6.4, 0.190855, 0.142587, 0.678132)],
)
def test_a_stiff_rod_has_the_diffusivities_that_other_code_found(box, along, across, turning):
    """Means of both directions across; from the matrix of mobilities of 11 nodes."""
    resistance, r = on_grid(ROD, box)
    axis = (r[-1] - r[0]) / np.linalg.norm(r[-1] - r[0])
    x = motions(r, r[5])
    d = np.linalg.pinv(x.T @ resistance @ x, rcond=1e-8)
    line, turn = d[:3, :3], d[3:, 3:]
    found = [axis @ line @ axis, (np.trace(line) - axis @ line @ axis) / 2, np.trace(turn) / 2]
    np.testing.assert_allclose(found, [along, across, turning], rtol=1e-5)


def together(resistance: np.ndarray, rods: list[np.ndarray]) -> np.ndarray:
    """D (6, 6) of the lines that two rigid straight rods move along, each turning as it likes; kT = 1."""
    x = np.zeros((3 * sum(len(r) for r in rods), 12))
    at = 0
    for k, r in enumerate(rods):
        x[at : at + 3 * len(r), 6 * k : 6 * k + 6] = motions(r, r[len(r) // 2])
        at += 3 * len(r)
    lines = [0, 1, 2, 6, 7, 8]
    return np.linalg.pinv(x.T @ resistance @ x, rcond=1e-8)[np.ix_(lines, lines)]


def test_two_parallel_rods_diffuse_together_as_rods_of_beads_do():
    """0.3 apart: D of one, and of one with the other; along, towards each other, and across both.

    In free space against beads of a node's own radius, 1.313 h; in a box of 3.2 as other code found.
    """
    axis, towards = np.array([1, 0.37, 0.21]), np.array([0.37, -1, 0])
    axis, towards = axis / np.linalg.norm(axis), towards / np.linalg.norm(towards)
    other = {**ROD, "position": (np.array(GENERIC["position"]) + 0.3 * towards).tolist()}

    def found(resistance: np.ndarray, r: np.ndarray) -> np.ndarray:
        d = together(resistance, [r[:11], r[11:]])
        return np.array([(e @ d[:3, :3] @ e, e @ d[:3, 3:] @ e) for e in (axis, towards, np.cross(axis, towards))])

    resistance, r = on_grid(ROD, "free", other)
    np.testing.assert_allclose(found(resistance, r), found(beads(r, 0.1313), r), rtol=0.03)
    own, both = found(*on_grid(ROD, 3.2, other)).T
    np.testing.assert_allclose(own, [0.167527, 0.117519, 0.119414], rtol=1e-5)
    np.testing.assert_allclose(both / own, [0.4196, 0.6739, 0.3563], rtol=2e-4)


def helix(theta: float, nodes: int) -> dict[str, Any]:
    """That of Sec. 7.4: length 10, twist 1, curvature cot theta, theta in degrees."""
    kappa = 1 / np.tan(np.radians(theta))
    shape = {"curvature": [kappa, 0], "twist_rate": 1.0, "shape": {"kind": "relaxed"}}
    rod = {"length": 10.0, "nodes": nodes, "bending": 1.0, "twisting": 1.0, "stretching": 300.0, "radius": 0.1}
    return {**rod, **shape, "position": [0, 0, 0], "direction": [0, 0, 1], "normal": [1, 0, 0], "anchor": "centroid"}


def beads(r: np.ndarray, a: float) -> np.ndarray:
    """The resistance of beads of radius a in free space by Rotne & Prager 1969 and Yamakawa 1970, eta = 1."""
    n, out = len(r), np.zeros((len(r), 3, len(r), 3))
    for i in range(n):
        for j in range(n):
            d = r[i] - r[j]
            size = np.linalg.norm(d)
            if i == j:
                out[i, :, j] = np.eye(3) / (6 * np.pi * a)
                continue
            e = np.outer(d, d) / size**2
            if size >= 2 * a:
                ratio = (a / size) ** 2
                out[i, :, j] = ((1 + 2 * ratio / 3) * np.eye(3) + (1 - 2 * ratio) * e) / (8 * np.pi * size)
            else:
                out[i, :, j] = ((1 - 9 * size / (32 * a)) * np.eye(3) + 3 * size / (32 * a) * e) / (6 * np.pi * a)
    return np.linalg.inv(out.reshape(3 * n, 3 * n))


def test_a_tight_helix_diffuses_along_its_axis_where_resistive_force_theory_says_across():
    """Pitch angle 20 degrees: D_perp/D_par above 1 without hydrodynamic interaction, below 0.9 with it.

    In the grid's box, with the first order of what a box takes off put back, as beads in free space that are as thick
    as the grid makes the rod (in a box of 12.8 the two are within 1.6 %).
    """
    axis, box, nodes = np.array([0, 0, 1.0]), 6.4, 101
    resistance, r = on_grid(helix(20, nodes), box)
    drag_only = assembly_rods.rods(scene({"rod": helix(20, nodes)}, {"model": "rft", "drag": "paper"}))
    fluid = fluid_model(scene({"rod": helix(20, nodes)}, {"model": "rft", "drag": "paper"})).build(drag_only)
    unit = np.eye(3 * nodes).reshape(3 * nodes, nodes, 3)
    pad = np.zeros((nodes, 1))
    rft = np.array([resist(fluid.drag, drag_only.start.e3, np.hstack([u, pad]))[:, :3].ravel() for u in unit])
    ratios = {}
    for name, one, back in (("rft", rft, 0.0), ("grid", resistance, hasimoto(box)), ("beads", beads(r, 0.1), 0.0)):
        along, across = rigid(one, r, axis)
        ratios[name] = (across + back) / (along + back)
    assert ratios["rft"] == pytest.approx(1.151, abs=0.02)
    assert ratios["grid"] == pytest.approx(ratios["beads"], rel=0.05)
    assert ratios["grid"] < 0.9
