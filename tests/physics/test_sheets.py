"""A grid one cell deep: its flow is plane, and filaments are sheets.

Sheets in phase, D = 2 H apart, that wave as y = b sin(k x - omega t), their points moving across only, swim at

    U = (omega k b^2/2) (sinh H cosh H - H)/(sinh H cosh H + H)     (k = 1)

to second order in k b (g = A cosh y + B y sinh y with g = 1 and g' = 0 at the sheets; no mean flow, no net force);
Taylor's omega k b^2/2 alone. Moved along themselves they feel 12 eta U/D to an area, as their fluid flows back between
them. Kernels blur a sheet, an error of first order in h that is extrapolated away.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import run, scene

from ibfil.case.reading import parse_case
from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

AMPLITUDE = 0.05
ROD: dict[str, Any] = {"length": 1.0, "nodes": 11, "bending": 0.1, "stretching": 30.0, "curvature": ["6*cos(7*s)", 0]}


def stack(cells: int, gap: float, kernel: str) -> tuple[np.ndarray, np.ndarray]:
    """The mobility (2 n, 2 n) of a wavelength of a sheet in y, z, a node a cell, and its nodes' y."""
    h = 2 * np.pi / cells
    fluid = {"model": "stokes", "method": "table", "kernel": kernel, "slip": 0}
    fluid |= {"box": [h, 2 * np.pi, gap], "cells": [1, cells, round(gap / h)]}
    rod = {"length": 1.0, "nodes": 9, "bending": 1.0, "stretching": 1.0, "direction": [0, 1, 0]}
    made = Simulation(scene({"rod": rod}, fluid)).model.inner
    y, out = h * np.arange(cells), []
    for offset in (0.0, 0.25, 0.5, 0.75):
        r = np.stack([0 * y, y, offset * h + AMPLITUDE * np.sin(y)], axis=1)
        nodes = made.immersed.nodes(r, np.zeros_like(r))
        whole = made.immersed.mobility().matrix(nodes, np.zeros((cells, 3)))
        out.append(whole.reshape(cells, 3, cells, 3)[:, 1:, :, 1:].reshape(2 * cells, 2 * cells))
    return np.array(out), y


def swum(cells: int, gap: float, kernel: str = "peskin4") -> tuple[float, float]:
    """U over Taylor's at one moment, and the drag along over 12 eta/D to an area: means of four places in a cell."""
    mobilities, y = stack(cells, gap, kernel)
    wave = np.stack([0 * y, -AMPLITUDE * np.cos(y)], axis=1).ravel()
    along = np.stack([0 * y + 1, 0 * y], axis=1).ravel()
    speeds, drags = [], []
    for mobility in mobilities:
        waving, towed = np.linalg.solve(mobility, np.stack([wave, along], axis=1)).T
        speeds.append((along @ waving) / (along @ towed))  # of the fluid past a sheet that is held
        drags.append((along @ towed) / (2 * np.pi * 2 * np.pi / cells) / (12 / gap))
    return float(np.mean(speeds)) / (0.5 * AMPLITUDE**2), float(np.mean(drags))


def theory(gap: float) -> float:
    h = 0.5 * gap
    return float((np.sinh(h) * np.cosh(h) - h) / (np.sinh(h) * np.cosh(h) + h))


def test_the_theory():
    assert theory(np.pi) == pytest.approx(0.5722, abs=1e-4)
    assert theory(2 * np.pi) == pytest.approx(0.9541, abs=5e-5)
    assert theory(40.0) == pytest.approx(1.0)


@pytest.mark.parametrize("gap", [np.pi, 2 * np.pi])
def test_sheets_in_a_stack_swim_and_feel_drag(gap):
    """Extrapolated from 32 and 64 cells a wavelength, which are 15 and 27 % below at D = 2 pi."""
    coarse, fine = swum(32, gap), swum(64, gap)
    assert fine[0] < 0.87 * theory(gap)
    assert 2 * fine[0] - coarse[0] == pytest.approx(theory(gap), rel=0.04)
    assert fine[1] == pytest.approx(1.0, abs=0.2)
    assert abs(2 * fine[1] - coarse[1] - 1.0) < 0.3 * abs(fine[1] - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("kernel", "found"), [("peskin4", (0.569, 0.9495)), ("roma3", (0.5699, 0.9505))])
def test_the_finer_the_better(kernel, found):
    """Within 0.5 % of theory, of which the finite amplitude has 0.3 %; the numbers of an independent trial."""
    for gap, number in zip((np.pi, 2 * np.pi), found, strict=True):
        speed = 2 * swum(256, gap, kernel)[0] - swum(128, gap, kernel)[0]
        assert speed == pytest.approx(number, abs=1e-3)
        assert speed == pytest.approx(theory(gap), rel=0.006)


def placed(axis: int, vector: tuple[Any, Any], zero: Any = 0) -> list[Any]:
    """A vector of the plane across an axis: (y, z), (z, x) or (x, y)."""
    out = [zero] * 3
    out[(axis + 1) % 3], out[(axis + 2) % 3] = vector
    return out


def scenes(axis: int, **fluid: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """A bent sheet that waves, in a box that is thin along an axis."""
    box = placed(axis, (2.0, 1.5), 0.125)
    cells = placed(axis, (16, 12), 1)
    normal = placed(axis, (0, 0), 1)
    rod = {**ROD, "direction": placed(axis, (1.0, 0.3)), "normal": normal, "position": placed(axis, (0.11, -0.2))}
    return rod, {"model": "stokes", "box": box, "cells": cells, **fluid}


@pytest.mark.parametrize("inertia", [{}, {"model": "navier-stokes", "density": 4.0}], ids=["stokes", "navier-stokes"])
def test_it_is_one_scene_whichever_way_it_is_thin_and_by_whatever_method(inertia):
    ends = []
    for axis in range(3):
        for method in ("table", "fft", "krylov") + (() if inertia else ("pruned",)):
            rod, fluid = scenes(axis, method=method, **inertia)
            r = run(scene({"rod": rod}, fluid, end=0.1, step=0.01)).configuration.r
            assert not r[:, axis].any()
            ends.append(r[:, [(axis + 1) % 3, (axis + 2) % 3]])
    assert np.abs(ends[0] - ends[0][0]).max() > 0.1
    for end in ends[1:]:
        assert end == pytest.approx(ends[0], abs=1e-7)


def test_deeper_by_copies_side_by_side_it_is_the_same():
    """As many sheets a cell apart as the grid is deep, each with the moduli of one cell: the flow stays plane."""
    rod, fluid = scenes(2)
    thin = run(scene({"rod": rod}, fluid, end=0.1, step=0.01)).configuration.r
    deep = {**fluid, "box": [2.0, 1.5, 0.5], "cells": [16, 12, 4]}
    rods = {f"rod{k}": {**rod, "position": [*rod["position"][:2], 0.125 * k]} for k in range(4)}
    assert run(scene(rods, deep, end=0.1, step=0.01)).configuration.r[:11, :2] == pytest.approx(thin[:, :2], abs=1e-9)


BENT = {**ROD, "nodes": 17, "curvature": [0, 0], "shape": {"kind": "circle", "curvature": 2.0}}
THIN = {"model": "stokes", "box": [2, 2, 0.0625], "cells": [32, 32, 1]}
CASE = scene({"rod": BENT}, THIN, end=0.1, step=0.01).text


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        (["fluid.box=[2, 0.0625, 0.0625]", "fluid.cells=[32, 1, 1]"], "fluid.cells: found [32, 1, 1]"),
        (["fluid.box=[2, 2, 0.125]", "fluid.cells=[32, 32, 2]"], "fluid.cells: found [32, 32, 2]"),
        (["fluid.box=[2, 2, 0.1]"], "fluid.cells: found [32, 32, 1], which makes h"),
        (["fluid.thick=true"], "fluid.thick: found rods with a thickness, and one cell along z"),
        (
            ["filament.rod.twisting=1", "filament.rod.radius=0.1"],
            "filament.rod.twisting: found a twist modulus, and one",
        ),
        (["fluid.model=rft", "fluid.drag={matched=0.5}"], "fluid.drag: found drag matched to a grid with one cell"),
    ],
)
def test_what_a_sheet_has_not_is_refused(changes, fault):
    with pytest.raises(CaseError) as caught:
        parse_case(CASE, "s.toml", changes)
    assert any(line.startswith(f"s.toml: {fault}") for line in caught.value.faults), caught.value.faults


def test_a_thickness_makes_no_sheet():
    thick = {"model": "stokes", "box": [2, 2, 0.0625], "thickness": 0.0691}
    with pytest.raises(CaseError, match=r"fluid.thickness: found 0.0691, for which .* cells = \[32, 32, 1\]"):
        Simulation(scene({"rod": BENT}, thick))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([], ""),
        (["filament.rod.direction=[1, 0, 0.1]"], "filament.rod: spans 0.0"),
        (["filament.rod.loads.force=[0, 0, 's']"], "filament.rod: is pushed along z, where the grid is one cell deep"),
        (["fluid.flow=['sin(pi*y)', 0, 0]"], ""),
        (["fluid.flow=[0, 0, 'sin(pi*y)']"], "fluid.flow: flows along z"),
        (["fluid.flow=['z', 0, 0]"], "fluid.flow: changes along z"),
        (["fluid.flow=['y', 0, 0]"], "fluid.flow: not periodic"),
        (["fluid.model=rft"], "fluid.cells: one cell along z makes filaments sheets on a grid; the drag here"),
    ],
)
def test_what_leaves_the_plane_is_told(changes, said):
    told = [line for line in warnings(Simulation(parse_case(CASE, "s.toml", changes))) if "net force" not in line]
    assert bool(told) == bool(said), told
    # A flow along z pushes the rod there too, within the first step.
    assert any(line.startswith(said) for line in told) == bool(said), told


def test_check_says_that_it_is_a_sheet():
    text = report(parse_case(CASE, "s.toml"))
    assert "a plane flow: the grid is one cell deep along z, and a filament is a sheet" in text
    assert "moduli, mass, loads and forces are of a depth of one cell, 0.0625" in text
    assert "Stokes' paradox" in text
    assert "a/L" not in text
    assert "take half the time: lay the scene in y, z" in text
