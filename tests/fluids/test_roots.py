"""Random motions of nodes have the covariance of the mobility, exactly: every random number is probed with one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.scenes import scene
from helpers.thermal_scenes import Unit, moved_by_units

from ibfil.assembly import rods as assembly_rods
from ibfil.assembly.fluids.models import fluid_model
from ibfil.fluids.base import Response
from ibfil.fluids.roots import NoRoot
from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.normal_numbers import Draw, NormalNumbers, Purpose

ROD: dict[str, Any] = {
    "length": 0.7,
    "nodes": 7,
    "bending": 1.0,
    "stretching": 300.0,
    "derivative": 2,
    "position": [0.03, -0.11, 0.07],
    "direction": [1, 0.37, 0.21],
}
TWISTING = {**ROD, "twisting": 0.7, "radius": 0.05, "twist_rate": 1.0, "curvature": [2.0, 0]}


def response_of(fluid: dict[str, Any], rod: dict[str, Any]) -> tuple[Response, tuple[int, int]]:
    """The response at the start of one rod, and the shape (n, m) of its unknowns."""
    case = scene({"rod": rod}, {"model": "stokes", "slip": 0.01, **fluid})
    stacked = assembly_rods.rods(case)
    shape = (len(stacked.s), stacked.system.unknowns)
    return fluid_model(case).build(stacked).response(stacked.start.r, stacked.start.e3, 0.0, 0.3), shape


def mobility(response: Response, shape: tuple[int, int]) -> np.ndarray:
    """M in full, column by column, of all unknowns."""
    none, zero = Prescribed(np.zeros(0, np.int64), np.zeros(0)), np.zeros(shape)
    columns = []
    for k in range(zero.size):
        unit = np.zeros(shape)
        unit.ravel()[k] = 1.0
        columns.append(response.forced(unit, none, zero).move.ravel() / 0.3)
    return np.array(columns).T


BOXES = {"8 8 8": [8, 8, 8], "8 10 9": [8, 10, 9], "9 8 12": [9, 8, 12]}


@pytest.mark.parametrize(
    ("method", "kernel", "cells", "rod", "rotation"),
    [
        ("krylov", "peskin4", "8 8 8", ROD, None),
        ("krylov", "roma3", "8 10 9", ROD, None),
        ("krylov", "bkp6", "9 8 12", ROD, None),
        ("krylov", "peskin4", "8 8 8", TWISTING, "grid"),
        ("krylov", "es5", "8 10 9", TWISTING, "grid"),
        ("krylov", "es5", "8 10 9", TWISTING, "local"),
        ("table", "peskin4", "8 10 9", TWISTING, "grid"),
        ("table", "roma3", "8 10 9", TWISTING, "local"),
        ("fft", "bkp6", "9 8 12", TWISTING, "grid"),
        ("pruned", "peskin4", "8 10 9", ROD, None),
    ],
)
def test_the_covariance_is_the_mobility(method, kernel, cells, rod, rotation):
    """B B^T = M, with B column by column from a random number that is one where all others are zero."""
    fluid = {"method": method, "kernel": kernel, "cells": BOXES[cells], "box": [0.15 * n for n in BOXES[cells]]}
    response, shape = response_of(fluid | ({} if rotation is None else {"rotation": rotation}), rod)
    exact = mobility(response, shape)
    found = moved_by_units(lambda draw: response.fluctuation(draw, shape))
    np.testing.assert_allclose(found @ found.T, exact, atol=1e-12 * np.max(np.abs(exact)))


def test_methods_that_know_the_matrix_move_alike_for_the_same_numbers():
    cells = {"cells": [16, 18, 20], "box": [1.6, 1.8, 2.0]}
    moved = []
    for method in ("table", "fft", "pruned"):
        response, shape = response_of({**cells, "method": method}, ROD)
        moved.append(response.fluctuation(Draw(NormalNumbers(3), 5), shape))
    for other in moved[1:]:
        np.testing.assert_allclose(other, moved[0], rtol=1e-11, atol=1e-11 * np.max(np.abs(moved[0])))


def test_a_mobility_that_is_not_positive_has_no_root_and_that_is_said():
    rod = {**ROD, "nodes": 120}
    response, shape = response_of({"cells": [8, 8, 8], "box": [1.2, 1.2, 1.2], "method": "table", "slip": 0.0}, rod)
    with pytest.raises(NoRoot, match="not positive"):
        response.fluctuation(Draw(NormalNumbers(1), 0), shape)


def test_each_purpose_and_step_has_numbers_of_its_own_and_nothing_else_moves_them():
    numbers, shape = NormalNumbers(7), (50, 3)
    first = numbers.draw(Purpose.MOTION, 3, shape)
    streams = [first, *(numbers.draw(purpose, 3, shape) for purpose in list(Purpose)[1:])]
    streams += [numbers.draw(Purpose.MOTION, 4, shape), NormalNumbers(8).draw(Purpose.MOTION, 3, shape)]
    streams += [NormalNumbers(7, trial=True).draw(Purpose.MOTION, 3, shape)]
    assert np.array_equal(numbers.draw(Purpose.MOTION, 3, shape), first)
    assert np.array_equal(NormalNumbers(7).draw(Purpose.MOTION, 3, (50, 4)).ravel()[:150], first.ravel())
    related = np.corrcoef([stream.ravel() for stream in streams])
    assert np.max(np.abs(related - np.eye(len(streams)))) < 4 / np.sqrt(150)


def test_a_probe_is_one_number():
    unit = Unit(4)
    assert unit(Purpose.MOTION, (2, 3)).tolist() == [[0, 0, 0], [0, 1, 0]]
    assert unit(Purpose.OWN, (2,)).tolist() == [0, 0]
    assert unit.asked == 8
