"""Physics gone wrong is named: each provoked here, and each with the number found, the limit, the cause and the key.

The README lists them; the last test reads that list.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import ibfil
from ibfil.check.report import report
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError, RunFailed
from ibfil.simulation.simulation import Simulation

ROD = """
[filament.rod]
length = 1.0
nodes = 21
bending = 1.0
stretching = 400.0
shape = { kind = "circle", curvature = 1.0 }
[fluid]
model = "rft"
viscosity = 1.0
box = [2.0, 2.0, 2.0]
cells = [32, 32, 32]
[time]
end = 1.0
step = 1e-3
[output]
every = 0.5
"""
NUMBER = r"[-+0-9.e]+"


def failed(*overrides: str) -> RunFailed:
    with pytest.raises(RunFailed) as caught:
        ibfil.run(ibfil.parse_case(ROD, "rod.toml", overrides), progress=False, log=str)
    return caught.value


def warned(*overrides: str) -> list[str]:
    return warnings(Simulation(ibfil.parse_case(ROD, "rod.toml", ["fluid.model=stokes", *overrides])))


def test_diverged_or_over_stretched_by_a_step_above_the_explicit_limit():
    failure = failed("time.scheme=explicit", "time.step=1e-3")
    told = str(failure).splitlines()
    assert re.search(rf"a segment is {NUMBER} times its rest length \(allowed 0\.2 to 2\.0\)$", told[0])
    found = re.fullmatch(
        rf"likely cause: dt = 0\.001 is above the explicit scheme's limit, ({NUMBER}) at the start shape", told[1]
    )
    limit = Simulation(ibfil.parse_case(ROD, "rod.toml", ["time.scheme=explicit"])).explicit_limit()
    assert float(found[1]) == pytest.approx(limit, rel=0.01)
    assert told[2].startswith(f"what to change: time.step below {limit:.3g}"[:-1])
    assert "time.scheme=implicit" in told[2]


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "key",
    ["filament.rod.loads.force=['0*x', '1 + 1e-9/(s - 0.5)', 0]", "fluid.flow=[0, 'where(abs(x) < 1e-3, 1/x, 0)', 0]"],
)
@pytest.mark.parametrize("scheme", ["explicit", "semi-implicit", "implicit"])
def test_the_node_where_a_load_or_a_flow_has_no_value_is_told(key, scheme):
    """A correction has no value anywhere then, and node 0 was blamed."""
    straight = ["filament.rod.curvature=[0, 0]", "filament.rod.shape={kind='straight'}", "filament.rod.nodes=21"]
    step = "1e-5" if scheme == "explicit" else "1e-3"
    assert "on filament rod, node 10: " in str(failed(key, *straight, f"time.scheme={scheme}", f"time.step={step}"))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("step", ["1e-3", "auto"])
def test_where_a_force_has_no_value_the_limit_of_explicit_steps_is_not_sought_for_ever(step):
    key = "filament.rod.loads.force=['0*x', '1 + 1e-9/(s - 0.5)', 0]"
    straight = ["filament.rod.curvature=[0, 0]", "filament.rod.shape={kind='straight'}", "filament.rod.nodes=21"]
    told = str(failed(key, *straight, "time.scheme=explicit", f"time.step={step}"))
    assert "no finite number" in told
    assert "limit" not in told
    lines = report(ibfil.parse_case(ROD, "rod.toml", [key, *straight]))
    assert "explicit scheme: no limit found: at the start shape" in lines
    assert "dt = inf" not in lines


@pytest.mark.parametrize("scheme", ["explicit", "semi-implicit", "implicit"])
def test_diverged(scheme):
    """A load that has no value from a moment on: 1/0 is no force."""
    load = "filament.rod.loads.force=[0, '1/(1 - step(t - 0.0105))', 0]"
    step = "1e-6" if scheme == "explicit" else "5e-5"
    told = str(failed(load, f"time.scheme={scheme}", f"time.step={step}")).splitlines()
    assert re.match(r"the run stopped at t = 0\.010\d* on filament rod, node \d+: the run diverged: ", told[0])
    assert "is no finite number" in told[0]
    assert "(dt = " in told[0]
    assert (
        told[1]
        == "likely cause: a load, a law or a flow that grows without bound, or has no value, where the rod has come to"
    )
    assert "loads" in told[2]


def test_over_stretched_by_a_load():
    failure = failed(
        "filament.rod.stretching=1", "filament.rod.start.force=[-5, 0, 0]", "filament.rod.finish.force=[5,0,0]"
    )
    told = str(failure).splitlines()
    found = re.search(rf"a segment is ({NUMBER}) times its rest length \(allowed 0\.2 to 2\.0\)", told[0])
    assert float(found[1]) > 2
    assert re.search(rf"pulled or pressed with about {NUMBER}, more than its EA = 1 bears", told[1])
    assert "stretching" in told[2]


def test_twisted_to_half_a_turn():
    failure = failed(
        "filament.rod.twisting=0.01",
        "filament.rod.radius=0.05",
        "filament.rod.start={end='clamped', spin=100}",
        "filament.rod.shape={kind='straight'}",
    )
    told = str(failure).splitlines()
    found = re.search(rf"nears half a turn: ({NUMBER}) rad \(allowed 2\.8\)", told[0])
    assert float(found[1]) >= 2.8
    assert "wound up faster" in told[1]
    assert "spin" in told[2]


def test_newton_failed(monkeypatch):
    """One iteration is never enough for a bent rod: the step is halved down to time.min_step, and that is told."""
    from ibfil.assembly import scheme
    from ibfil.timestepping import implicit

    monkeypatch.setattr(scheme, "stepper", lambda case, noise: implicit.Implicit(most=1))
    told = str(failed("time.min_step=1e-4")).splitlines()
    assert re.search(
        rf"Newton's correction is still {NUMBER} of the length \(allowed 1e-08\) after 1 iterations", told[0]
    )
    assert "(dt = 0.000125; time.min_step = 0.0001 ends the halving)" in told[0]
    assert told[1].startswith("likely cause: a rod that snaps")
    assert told[2].startswith("what to change: softer loads")


def test_too_many_steps():
    told = str(failed("time.max_steps=5")).splitlines()
    assert "6 steps are taken (allowed: time.max_steps = 5)" in told[0]
    assert told[1] == "likely cause: steps of 0.001 for a time.end of 1"


def test_locked():
    (line,) = warned("filament.rod.nodes=41", "fluid.slip=0")
    assert re.match(rf"filament\.rod: nodes are {NUMBER} cells apart and fluid\.slip = 0: below 0\.8 .* locks", line)
    assert "set fluid.slip = 0.01, or take fewer nodes or more fluid.cells" in line
    assert warned("filament.rod.nodes=41") == []
    assert warned("filament.rod.nodes=11", "fluid.slip=0", "filament.rod.shape={kind='straight'}") == []


def test_longer_than_the_box():
    assert warned("filament.rod.length=2.5") == []  # curled up
    (line,) = warned("filament.rod.length=2.5", "filament.rod.shape={kind='straight'}")
    assert "spans 2.5 along x, more than the box, 2: " in line
    assert "take a larger fluid.box" in line


def test_too_few_cells_a_wavelength():
    waves, line = sorted(warned("filament.rod.curvature=['sin(16*pi*s)', 0]", "filament.rod.stretching=100"))
    found = re.search(rf"({NUMBER}) cells a wavelength \(wavelength/h\): below 15 the rod is as thick", line)
    assert float(found[1]) == pytest.approx(0.125 * 16, rel=0.02)
    assert "take more fluid.cells" in line
    assert re.match(rf"filament\.rod\.nodes: {NUMBER} segments a wavelength .*take more nodes", waves)


def test_net_force_on_a_periodic_box():
    (line,) = warned("filament.rod.loads.weight=[0, 0, -3]", "filament.rod.loads.force=[4, 0, 0]")
    found = re.search(rf"net force of ({NUMBER}) at the start \(0 where nothing outside", line)
    assert float(found[1]) == pytest.approx(5.0, rel=1e-6)
    gradient = [float(x) for x in re.search(r"gradient \((.*?)\)", line)[1].split(", ")]
    np.testing.assert_allclose(gradient, [0.5, 0, -0.375], atol=1e-6)
    assert line.startswith("fluid.box: ")


def test_a_flow_that_is_not_periodic():
    (line,) = warned("fluid.flow=['3*y', 0, 0]")
    assert "fluid.flow: not periodic: it changes by 6 from a face of the box" in line
    assert "take a larger fluid.box" in line
    assert warned("fluid.flow=['3*sin(pi*y)', 1, 0]") == []
    with pytest.raises(CaseError) as caught:
        ibfil.parse_case(ROD, "rod.toml", ["fluid.model=navier-stokes", "fluid.density=1", "fluid.flow=['3*y', 0, 0]"])
    assert "fluid.flow: found a flow that changes by 6 from a face" in caught.value.faults[0]


def test_contact():
    other = (
        ROD.partition("[fluid]")[0].replace("rod", "other") + "position = [0, 0, 0.02]\n[contact]\ndistance = 0.05\n"
    )
    result = ibfil.run(ibfil.parse_case(ROD + other, "rod.toml"), progress=False, log=str)
    assert result.status == "stopped"
    found = re.search(rf"axes ({NUMBER}) apart, contact below 0\.05 \(contact\.distance", result.reason)
    assert float(found[1]) == pytest.approx(0.02, rel=1e-6)


def test_the_readme_lists_them():
    text = (Path(__file__).parents[2] / "README.md").read_text()
    rows = [line for line in text.partition("## When physics goes wrong")[2].splitlines() if line.startswith("| ")][1:]
    named = {row.split("|")[1].strip() for row in rows}
    assert named == {
        "diverged",
        "over-stretched",
        "twisted to half a turn",
        "Newton failed",
        "too many steps",
        "locked",
        "longer than the box",
        "wavelength/h below 15",
        "net force on the box",
        "flow not periodic",
        "contact",
    }
    for row in rows:
        assert "`" in row.split("|")[4], row  # the key to change
