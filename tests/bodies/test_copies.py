"""Copies of filaments in bodies: each has its own bodies and motors, placed and turned with it."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.runs import real
from scipy.spatial.transform import Rotation

from ibfil.analysis.run import open_run
from ibfil.case.reading import parse_case
from ibfil.check.report import report
from ibfil.errors import CaseError
from ibfil.running.run import run
from ibfil.simulation.simulation import Simulation

REST = """
[fluid]
model = "rft"
drag = "paper"
viscosity = 1.0
[time]
end = 0.2
step = 0.02
[output]
every = 0.1
"""
FREE = {"fluid.model": "stokes", "fluid.drag": "absent", "fluid.box": "free", "fluid.spacing": 0.05}
SHIFTS = np.array([[0.0, 0.0, 0.0], [0.3, 1.5, 0.2]])
COPIES = 'copies = { count = 2, at = ["0.3*i", "1.5*i", "0.2*i"] }'


def flagellum(name: str, body: str, more: str, place=(0.0, 0.0, 0.0), axis: str = "[1, 0, 0]") -> str:
    """A helix in a body, with a motor."""
    return f"""
[filament.{name}]
length = 1.0
nodes = 17
bending = 1.0
twisting = 1.0
stretching = 1e3
radius = 0.02
shape = {{ kind = "relaxed" }}
curvature = [4.0, 0]
twist_rate = 4.0
align = "tangent"
anchor = "start"
position = {list(place)}
start = {{ end = "body", body = "{body}", motor = {{ spin = 5.0, axis = {axis} }} }}
{more}
"""


def body(name: str, more: str = "") -> str:
    return f"""
[body.{name}]
shape = {{ kind = "ellipsoid", axes = [0.2, 0.15, 0.15] }}
{more}
"""


@pytest.mark.parametrize("fluid", [{}, FREE], ids=["rft", "free"])
@pytest.mark.parametrize("position", [None, (-0.21, 0.01, 0.0)])
def test_copies_are_as_tables_of_their_own(fluid, position):
    at = "" if position is None else f"position = {list(position)}"
    many = parse_case(flagellum("tail", "head", COPIES) + body("head", at) + REST, "many.toml", fluid)
    text = ""
    for k, shift in enumerate(SHIFTS):
        own = "" if position is None else f"position = {(np.array(position) + shift).tolist()}"
        text += flagellum(f"t{k}", f"h{k}", "", shift.tolist()) + body(f"h{k}", own)
    each = parse_case(text + REST, "each.toml", fluid)
    found, known = Simulation(many), Simulation(each)
    assert many.joined["body"] == ("head_000", "head_001")
    assert many.joined["motor"] == ("tail_000_start", "tail_001_start")
    for simulation in (found, known):
        simulation.advance(0.1, lambda: None)
    np.testing.assert_allclose(found.configuration.r, known.configuration.r, atol=1e-12)
    one, other = found.snapshot(), known.snapshot()
    for k in range(2):
        np.testing.assert_allclose(one.bodies[f"head_00{k}"].spin, other.bodies[f"h{k}"].spin, atol=1e-9)


def test_a_copy_that_is_turned_swims_as_the_first_in_its_own_axes():
    """In resistive-force theory, where no direction is special and none feels the others."""
    turned = "copies = { count = 4, region = [[0, 0, 0], [5, 5, 5]], seed = 3 }"
    case = parse_case(flagellum("tail", "head", turned) + body("head", "position = [-0.21, 0.01, 0]") + REST, "t.toml")
    simulation = Simulation(case)
    before = simulation.snapshot().bodies
    simulation.advance(0.2, lambda: None)
    after = simulation.snapshot().bodies
    axes = {name: np.stack([one.e1, one.e2, one.e3]) for name, one in before.items()}
    moved = np.array([axes[name] @ (after[name].position - one.position) for name, one in before.items()])
    assert np.linalg.norm(moved[0]) > 1e-3
    np.testing.assert_allclose(moved, np.tile(moved[0], (4, 1)), atol=1e-9)
    others = [Rotation.from_matrix(axes[name] @ axes["head_000"].T).magnitude() for name in list(axes)[1:]]
    assert min(others) > 0.1


def test_two_flagella_of_one_body_are_copied_about_one_point():
    two = flagellum("left", "head", COPIES, (0, 0.1, 0)) + flagellum("right", "head", COPIES, (0, -0.1, 0))
    start = Simulation(parse_case(two + body("head", "position = [-0.2, 0, 0]") + REST, "two.toml")).snapshot()
    for part in ("left", "right"):
        one, other = (start.filaments[f"{part}_00{k}"].position for k in range(2))
        np.testing.assert_allclose(other - one, np.tile(SHIFTS[1], (17, 1)), atol=1e-12)
    np.testing.assert_allclose(start.bodies["head_001"].position - start.bodies["head_000"].position, SHIFTS[1])


def test_check_and_the_run_file_know_each_copy(tmp_path):
    more = '[observe.spin]\nkind = "body_spin"\nbody = "head_001"\nalong = [1, 0, 0]\n'
    case = parse_case(flagellum("tail", "head", COPIES) + body("head") + REST + more, "many.toml")
    lines = report(case)
    assert "body head, 2 copies: an ellipsoid of semi-axes 0.2, 0.15, 0.15, free to move and turn" in lines
    assert lines.count("drag of head: ") == 1
    run(case, tmp_path / "run.h5", build=real, progress=False, log=str)
    with open_run(tmp_path / "run.h5") as done:
        assert list(done.bodies) == ["head_000", "head_001"]
        assert list(done.motors) == ["tail_000_start", "tail_001_start"]
        assert np.abs(done.observables["spin"][-1]) > 0.1


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            flagellum("left", "head", COPIES) + flagellum("right", "head", ""),
            r"filament\.right\.copies: found other copies than at filament\.left\.start, in the same body head; "
            "allowed: the same copies",
        ),
        (
            "".join(flagellum(name, "head", COPIES[:-2] + ", apart = 0.1 }") for name in ("left", "right")),
            r"filament\.right\.copies\.apart: found apart with several filaments in body head",
        ),
        (
            flagellum("tail", "head", 'copies = { file = "places.csv" }'),
            r"filament\.tail\.copies\.file: found a file for copies of a filament in a body; "
            "allowed: count with region or at",
        ),
    ],
)
def test_what_cannot_be_copied_is_refused(text, told):
    with pytest.raises(CaseError, match=told):
        parse_case(text + body("head") + REST, "bad.toml")
