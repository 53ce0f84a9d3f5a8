"""Flows that are sums of products of time and place: found, equal to the flow, and put on the grid once."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.inertial_fluid import fluid

from ibfil.assembly.flow import flow_parts
from ibfil.assembly.separation import products
from ibfil.case.expressions import parse
from ibfil.case.reading import read_case
from ibfil.check.budget import memory
from ibfil.check.report import report
from ibfil.simulation.simulation import Simulation

CASE = "cases/inertia/swimmer_re_10.toml"
K = "2*pi/3.2"
SUMS = [  # and how many products they are
    (["0", "0", "0"], 1),
    (["0.1*cos(2*y)", "0", "z"], 1),
    (["0.1*sin(3*t)", "0", "0"], 1),
    (["0.1*sin(3*t)*cos(2*y)", "-cos(x)*sin(3*t)/2", "0"], 1),
    (["(1 + 0.5*sin(3*t))*cos(2*y)", "0", "0"], 1),
    (["cos(y) + sin(t)", "0", "cos(x)"], 2),
    (["sin(2*y - 3*t)", "0", "0"], 2),
    (["sin(2*(y - 3*t))", "cos(2*(x - 3*t)) - x", "0"], 3),
    (["exp(-t)*exp(-(x**2))", "(2*exp(-t)*x)**2/(1 + t)", "-(y*t)"], 3),
    (["0", "(cos(y) - sin(t))*(x - exp(t))", "0"], 4),
    (["step(t - 1)*cos(y)", "min(t, 1)*max(x, y)", "0"], 2),
]
MIXED = [
    "sin(x*t)",
    "min(x, t)",
    "cos(y)/(2 + sin(x) + t)",
    "sqrt(x*t)",
    "(x + t)**2",
    "where(x < t, 1, 2)",
    "tan(x + t)",
    "exp(x - t)",
    "*".join(["(x + t)"] * 60),
]


def _expressions(texts):
    return [parse(text, ("x", "y", "z", "t")) for text in texts]


@pytest.mark.parametrize(("texts", "count"), SUMS, ids=str)
def test_products_add_up_to_the_flow(texts, count):
    flow = _expressions(texts)
    found = products(flow)
    assert found is not None
    assert len(found) == count
    x, y, z = np.random.default_rng(1).uniform(-1, 1, (3, 50))
    for t in (0.0, 0.7, 2.3):
        for k, component in enumerate(flow):
            parts = (one.factor.bind("t")(t) * one.place[k].bind("x", "y", "z")(x, y, z) for one in found)
            assert sum(parts) == pytest.approx(component.bind("x", "y", "z", "t")(x, y, z, t), abs=1e-14)
        assert all(one.factor.variables <= {"t"} and "t" not in one.place[0].variables for one in found)


@pytest.mark.parametrize("text", MIXED)
def test_what_mixes_time_and_place_is_left_whole(text):
    assert products(_expressions([text, "0", "cos(t)"])) is None


def test_more_products_than_fields_are_worth_are_left_whole():
    assert products(_expressions(["sin(x - t)", "sin(y - 2*t)", "sin(z - 3*t)"])) is None


def _case(flow):
    return read_case(CASE, [f"fluid.flow={flow}"])


@pytest.mark.parametrize(
    ("flow", "fields", "told"),
    [
        ([f"cos({K}*y)", "0", "0"], 1, False),
        ([f"cos({K}*y)*sin(t)", "0", "0"], 2, False),
        ([f"sin({K}*y - t)", "0", "0"], 3, False),
        ([f"sin({K}*y + sin({K}*y - t))", "0", "0"], 1, True),
    ],
)
def test_check_counts_the_fields_and_tells_where_a_flow_is_left_whole(flow, fields, told):
    simulation = Simulation(_case(flow))
    assert memory(simulation)["the background flow"] == fields * 6 * 8 * 64**3
    assert ("put on the grid each step" in report(simulation.case)) == told


@pytest.mark.parametrize("flow", [[f"sin({K}*y - 3*t)", f"cos(3*t)*cos({K}*x)", "0"], [f"cos({K}*y)", "0", "0"]])
def test_a_flow_by_its_parts_is_the_flow_on_the_grid(flow):
    case = _case(flow)
    velocity = [component.bind("x", "y", "z", "t") for component in case.fluid.flow]
    calls = []

    def whole(points, time):
        calls.append(time)
        return np.stack([component(*points.T, time) for component in velocity], axis=1)

    by_parts, by_steps = fluid(flow=whole, parts=flow_parts(case)), fluid(flow=whole)
    calls.clear()
    for time in (0.0, 0.3, 0.3, 1.1):
        by_parts.time = by_steps.time = time
        found = by_parts.background().copy()
        assert not calls
        assert found == pytest.approx(by_steps.background(), abs=1e-13)
        calls.clear()
