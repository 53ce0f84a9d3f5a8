"""Starting a run from a frame of another: shape = { kind = "run" }."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ibfil
from ibfil.case.idle import idle_keys
from ibfil.errors import CaseError, Interrupted
from ibfil.simulation.simulation import Simulation

HERE = Path(__file__).parents[1]
BENT = """
[filament.rod]
length = 1.0
nodes = 21
bending = 1.0
stretching = 400.0
shape = { kind = "circle", curvature = 1.5 }
direction = [0, 1, 0]
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 2e-5
step = 1e-6
scheme = "explicit"
[output]
every = 1e-5
"""


def quietly(case, path: Path, *overrides: str):
    return ibfil.run(ibfil.parse_case(case, str(path.with_suffix(".toml")), overrides), path, log=lambda line: None)


def from_run(path: str, time: str = '"last"') -> str:
    return f'filament.rod.shape={{kind="run", path="{path}", time={time}}}'


def test_it_goes_on_where_the_other_stood(tmp_path):
    """The explicit scheme remembers nothing: two halves of a run are the whole, to the rounding of e1's normality."""
    whole, second = tmp_path / "whole.h5", tmp_path / "second.h5"
    quietly(BENT, whole)
    quietly(BENT, second, from_run("whole.h5", "1e-5"), "time.end=1e-5")
    with ibfil.open(whole) as a, ibfil.open(second) as b:
        moved = np.abs(a.position()[2] - a.position()[1]).max()
        assert moved > 1e-6
        assert np.array_equal(b.position()[0], a.position()[1])
        assert np.abs(b.position()[1] - a.position()[2]).max() < 1e-9 * moved
        assert np.abs(b.filaments["rod"]["force"][0] - a.filaments["rod"]["force"][1]).max() > 0


def test_the_last_output_is_the_default_and_the_key_that_place_are_idle(tmp_path):
    quietly(BENT, tmp_path / "whole.h5")
    case = ibfil.parse_case(BENT, str(tmp_path / "next.toml"), ['filament.rod.shape={kind="run", path="whole.h5"}'])
    assert idle_keys(case) == ["filament.rod.direction"]
    with ibfil.open(tmp_path / "whole.h5") as run:
        assert np.array_equal(Simulation(case).configuration.r, run.position()[-1])


@pytest.mark.parametrize("scheme", [[], ["thermal={energy=1e-4}", "time.step=1e-4"]], ids=["still", "thermal"])
def test_clamps_hold_the_tangents_of_the_other_run(tmp_path, scheme):
    """A rod clamped at both ends, twisted and bent out of the plane; the tangents are in no dataset of the file."""
    clamps = [
        "filament.rod.twisting=1",
        "filament.rod.radius=0.02",
        'filament.rod.shape={kind="helix", radius=0.1, pitch=0.6}',
        'filament.rod.start={end="clamped", spin=3}',
        'filament.rod.finish={end="clamped"}',
        "time={end=0.01, step=1e-3}",
        "output.every=0.01",
    ]
    quietly(BENT, tmp_path / "a.h5", *clamps, *scheme)
    before = Simulation(ibfil.parse_case(BENT, "a.toml", [*clamps, *scheme]))
    more = [*clamps[:2], *clamps[3:], *scheme, from_run("a.h5")]
    taken = Simulation(ibfil.parse_case(BENT, str(tmp_path / "b.toml"), more))
    np.testing.assert_allclose(taken.configuration.e3[[0, -1]], before.configuration.e3[[0, -1]], atol=1e-9)
    with ibfil.open(tmp_path / "a.h5") as run:
        np.testing.assert_allclose(taken.configuration.e1, run.filaments["rod"]["e1"][-1], atol=1e-9)
        np.testing.assert_allclose(taken.configuration.bend, run.filaments["rod"]["strain"][-1, :, :2], atol=1e-6)


def test_other_nodes_lie_on_the_curve_through_its_nodes(tmp_path):
    quietly(BENT, tmp_path / "a.h5", 'filament.rod.shape={kind="circle", curvature=2.0}')
    arc = Simulation(
        ibfil.parse_case(BENT, "a.toml", ['filament.rod.shape={kind="circle", curvature=2.0}'])
    ).configuration
    centre = arc.r[0] + 0.5 * np.cross(arc.e1[0], arc.e3[0])
    assert np.abs(np.linalg.norm(arc.r - centre, axis=1) - 0.5).max() < 1e-7
    errors = []
    for nodes in (41, 33):
        more = [from_run("a.h5", "0"), f"filament.rod.nodes={nodes}"]
        shape = Simulation(ibfil.parse_case(BENT, str(tmp_path / "b.toml"), more)).configuration
        errors.append(np.abs(np.linalg.norm(shape.r - centre, axis=1) - 0.5).max())
    assert 1e-7 < max(errors) < 0.05**4  # of a cubic spline on nodes 0.05 apart: 2^3/24 h^4 at its ends


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ([from_run("no.h5")], "there is no such file"),
        ([from_run("a.h5", "1.5e-5")], "has no output at t = 1.5e-05; the nearest is at 1e-05"),
        ([from_run("a.h5"), "filament.rod.length=2"], "its filament rod has length 1; this one has 2"),
        ([from_run("a.toml")], "is a case, not a run file"),
    ],
)
def test_what_cannot_be_taken_up_is_one_line(tmp_path, changes, told):
    quietly(BENT, tmp_path / "a.h5")
    (tmp_path / "a.toml").write_text(BENT)
    with pytest.raises(CaseError) as caught:
        Simulation(ibfil.parse_case(BENT, str(tmp_path / "b.toml"), changes))
    (line,) = caught.value.faults
    assert "filament.rod.shape.path: " in line
    assert told in line


def test_another_name_or_copies_are_refused(tmp_path):
    quietly(BENT, tmp_path / "a.h5")
    other = BENT.replace("[filament.rod]", "[filament.other]")
    with pytest.raises(CaseError, match="has no filament other; it has rod"):
        Simulation(ibfil.parse_case(other, str(tmp_path / "b.toml"), [from_run("a.h5").replace("rod", "other")]))
    with pytest.raises(CaseError, match=r'filament\.rod\.copies: found copies with shape\.kind = "run"'):
        ibfil.parse_case(BENT, "b.toml", [from_run("a.h5"), "filament.rod.copies={count=1, region=[[0,0,0],[1,1,1]]}"])


def test_a_copy_can_be_taken_up(tmp_path):
    quietly(BENT, tmp_path / "a.h5", "filament.rod.copies={count=2, region=[[0,0,0],[1,1,1]]}")
    single = BENT.replace("[filament.rod]", "[filament.rod_001]")
    change = from_run("a.h5").replace("filament.rod", "filament.rod_001")
    taken = Simulation(ibfil.parse_case(single, str(tmp_path / "b.toml"), [change]))
    with ibfil.open(tmp_path / "a.h5") as run:
        assert np.array_equal(taken.configuration.r, run.position("rod_001")[-1])


def test_a_run_is_not_gone_on_with_when_its_start_has_changed(tmp_path):
    """Clamps and tethers hold the start shape; here the file it came from has another one when the run is resumed."""
    from helpers.runs import real, signalling

    from ibfil.running import run as running_run

    quietly(BENT, tmp_path / "a.h5")
    case = ibfil.parse_case(BENT, str(tmp_path / "b.toml"), [from_run("a.h5")])
    with pytest.raises(Interrupted):
        running_run.run(case, tmp_path / "b.h5", build=signalling(real, 5), progress=False, log=str)
    (tmp_path / "a.h5").unlink()
    quietly(BENT, tmp_path / "a.h5", 'filament.rod.shape={kind="circle", curvature=1.4}')
    with pytest.raises(CaseError, match=r"filament\.rod\.shape: found a start shape that differs by 0\.0"):
        running_run.resume_run(tmp_path / "b.h5", progress=False, log=str)
