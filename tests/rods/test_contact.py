"""Contact in runs: what stops and what warns, when and where; and nothing of it where a case does not name it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from helpers.contact_scenes import GRID, case, crossed, ran

from ibfil.assembly.contact import strength
from ibfil.case.reading import parse_case
from ibfil.check.report import absent, modelled
from ibfil.check.warnings import warnings
from ibfil.errors import CaseError
from ibfil.rods.base import NoContact
from ibfil.rods.contact import Contact
from ibfil.simulation.simulation import Simulation

ROOT = Path(__file__).parents[2]

# --- stop and warn: a weight of 4 pi per length moves a rod across itself at speed 1 ---------------------------------


def test_stop_ends_the_run_at_the_first_contact_and_says_where():
    """Each falls at speed 1 across 0.2: axes are 0.05 apart at t = 0.175."""
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}))
    assert result.status == "stopped"
    match = re.fullmatch(r"contact between (\w+) node (\d+) and (\w+) node (\d+), .*, at t = (.*)", result.reason)
    assert match is not None
    assert {match[1], match[3]} == {"upper", "lower"}
    assert {match[2], match[4]} <= {"5", "6"}  # they cross between these
    assert float(match[5]) == pytest.approx(0.18)  # the first step's end after it
    assert result.snapshot.time == result.times[-1] == pytest.approx(0.18)
    assert result.times == pytest.approx([0, 0.1, 0.18])
    assert result.snapshot.diagnostics["contacts"] == 1


def test_a_run_that_never_touches_finishes():
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}, end=0.17))
    assert (result.status, result.snapshot.diagnostics["contacts"]) == ("finished", 0)


def test_rods_that_touch_to_begin_with_stop_at_once():
    scene = case(crossed(0.04, 0.0), {"distance": 0.05})
    result, _ = ran(scene)
    assert result.status == "stopped"
    assert result.reason.endswith("at t = 0")
    assert list(result.times) == [0.0]
    assert result.steps == 0
    assert "contact: 1 pairs of segments touch at the start" in warnings(Simulation(scene))


def test_no_step_is_so_long_that_a_contact_slips_through():
    """In one step of 0.1 each rod moves by two distances, and the rods change sides."""
    scene = case(crossed(0.29, 4 * np.pi), {"distance": 0.05}, step=0.1, every=0.2, end=0.2)
    result, _ = ran(scene)
    z = [snapshot.position[:, 2] for snapshot in result.snapshot.filaments.values()]
    assert np.max(z[0]) < np.min(z[1])
    assert result.reason.startswith("contact between")
    assert 0.1 < float(result.reason.split("= ")[1]) < 0.15
    assert result.snapshot.time == pytest.approx(0.2)


def test_stop_is_written_into_the_run_file(tmp_path):
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}), tmp_path / "run.h5")
    from ibfil.io.reader import RunFile

    with RunFile(tmp_path / "run.h5") as run_file:
        assert run_file.status == "stopped"
        assert len(run_file) == 3
        assert run_file.reason == result.reason


def test_warn_tells_the_first_contact_once_and_goes_on():
    result, said = ran(case(crossed(0.4, 4 * np.pi), {"action": "warn", "distance": 0.05}, end=0.3))
    told = [line for line in said if "contact" in line]
    assert told == [line for line in told if line.startswith("warning: contact between")]
    assert len(told) == 1
    assert told[0].endswith("at t = 0.18")
    assert (result.status, result.snapshot.time) == ("finished", 0.3)
    assert result.snapshot.diagnostics["first_contact"] == pytest.approx(0.18)
    assert result.snapshot.diagnostics["contacts"] == 0  # they have gone through each other, as said


def test_warn_has_its_time_and_its_counts_in_the_run_file(tmp_path):
    import h5py

    scene = case(crossed(0.4, 4 * np.pi), {"action": "warn", "distance": 0.05}, every=0.05, end=0.3)
    ran(scene, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        contacts, first = file["diagnostics/contacts"][:], file["diagnostics/first_contact"][:]
    # 0.05 apart from 0.175 to 0.225. At 0.2 they cross, and the segments beside that are half a length away, 0.045.
    assert list(contacts) == [0, 0, 0, 0, 5, 0, 0]
    assert np.isnan(first[:4]).all()
    assert first[4:] == pytest.approx(0.18)


def test_a_first_contact_is_remembered_by_a_run_that_goes_on():
    scene = case(crossed(0.4, 4 * np.pi), {"action": "warn", "distance": 0.05})
    one, other = Simulation(scene), Simulation(scene)
    one.advance(0.2, lambda: None)
    other.restore(one.state())
    other.advance(0.3, lambda: None)
    assert len(one.notices) == 1
    assert other.notices == []
    assert other.snapshot().diagnostics["first_contact"] == one.snapshot().diagnostics["first_contact"]


def test_the_distance_is_the_sum_of_radii_where_none_is_given():
    thick, thin = {"radius": 0.06}, {"radius": "0.01 + 0*s"}
    rods = crossed(0.4, 4 * np.pi)
    result, _ = ran(case({"upper": {**rods["upper"], **thick}, "lower": {**rods["lower"], **thin}}, {}))
    assert result.snapshot.time == pytest.approx(0.17)  # (0.4 - 0.07)/2 = 0.165
    with pytest.raises(CaseError, match=r"contact\.distance: .*no filament\.lower\.radius"):
        case({"upper": {**rods["upper"], **thick}, "lower": rods["lower"]}, {})


def test_a_cone_touches_where_it_is_thick():
    simulation = Simulation(case({"cone": {"radius": "0.02*(1 + s)"}}, {}))
    contact = simulation.rods.contact
    assert contact is not None
    s = (np.arange(11) + 0.5) / 11
    assert contact.segments.radius == pytest.approx(0.02 * (1 + s))


@pytest.mark.parametrize(("angle", "status"), [(0.99, "stopped"), (0.97, "finished")])
def test_a_rod_touches_itself(angle, status):
    """An open ring, its ends 0.01 and 0.03 apart; neighbours are nearer than the distance too, and do not count."""
    ring = {"nodes": 60, "shape": {"kind": "circle", "curvature": 2 * np.pi * angle}}
    result, _ = ran(case({"ring": ring}, {"distance": 0.02}, step=1e-5, end=1e-5, every=1e-5))
    assert result.status == status
    assert result.reason.partition(",")[0] in ("", "contact between ring node 0 and ring node 59")


def test_images_touch_where_the_fluid_is_a_box():
    """Rods near two opposite faces of the box, drawn out of it: 0.2 apart through the faces, 0.8 within."""
    rods = crossed(0.8, -4 * np.pi)
    result, _ = ran(case(rods, {"distance": 0.05}, GRID, every=0.02, step=0.005))
    upper, lower = (rod.position[5:7, 2].mean() for rod in result.snapshot.filaments.values())
    assert result.status == "stopped"
    assert 0.95 < upper - lower < 0.96  # a step moves them by 0.01
    assert ran(case(rods, {"distance": 0.05}, end=0.2))[0].status == "finished"  # no box, no images


def test_far_apart_rods_are_not_looked_at_each_step(monkeypatch):
    """Where two are known to be 0.35 apart, nothing can touch before they have come so much nearer."""
    searched = []
    near = Contact.near
    monkeypatch.setattr(Contact, "near", lambda self, *more: searched.append(1) or near(self, *more))
    simulation = Simulation(case(crossed(0.4, 4 * np.pi), {"action": "warn", "distance": 0.1}, step=0.001))
    simulation.advance(0.15, lambda: None)  # 150 steps of 0.001 by each; they touch at 0.15
    assert len(searched) < 30
    simulation.advance(0.152, lambda: None)
    assert len(simulation.notices) == 1


# --- only where it stands -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("contact", "loaded"), [("", False), ("[contact]\ndistance = 0.01\n", True)])
def test_nothing_of_contact_is_loaded_without_it(tmp_path, contact, loaded):
    text = (
        contact + "[filament.rod]\nlength = 1.0\nnodes = 9\nderivative = 2\nbending = 1.0\nstretching = 100.0\n"
        "[fluid]\nmodel = 'rft'\nviscosity = 1.0\n[time]\nend = 0.002\nstep = 1e-3\n[output]\nevery = 0.001\n"
    )
    (tmp_path / "rod.toml").write_text(text)
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from ibfil.commands.main import main\n"
        "assert main(['run', 'rod.toml']) == 0\n"
        "print('loaded:', {'ibfil.rods.contact', 'ibfil.rods.neighbour_search'} & set(sys.modules))\n"
        "assert 'ibfil.linalg.block_sparse' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert ("ibfil.rods.contact" in done.stdout) == loaded
    assert ("ibfil.rods.neighbour_search" in done.stdout) == loaded


def test_without_it_there_is_nothing_of_it_in_the_results():
    simulation = Simulation(case(crossed(0.01, 0.0), None))
    assert isinstance(simulation.rods.contact, NoContact)
    assert not {"contacts", "first_contact"} & set(simulation.snapshot().diagnostics)
    assert "first_contact" not in simulation.state()
    assert not any("contact" in line for line in warnings(simulation))


def test_check_says_what_is_looked_for():
    scene = case(crossed(0.2, 0.0), {"action": "repel", "distance": 0.05, "strength": 2.0})
    assert "contact of axes nearer than 0.05, looked for each step: repulsion of 2 at that distance" in "\n".join(
        modelled(scene)
    )
    assert not any("contact" in line for line in absent(scene))
    assert any("contact" in line for line in absent(case(crossed(0.2, 0.0), None)))


@pytest.mark.parametrize(("apart", "refused"), [(0.0, True), (5e-5, False)])
def test_rods_laid_through_each_other_have_no_side_to_part_to(apart: float, refused: bool) -> None:
    """They would stay crossed, in steps as short as round-off asks for; a thousandth apart they part."""
    scene = case(crossed(apart, 0.0), {"action": "repel", "distance": 0.05, "strength": 5.0})
    if refused:
        with pytest.raises(CaseError, match=r"found laid through \w+ at s = .*allowed: axes apart, by 5e-05"):
            Simulation(scene)
        return
    simulation = Simulation(scene)
    simulation.advance(0.3, lambda: None)
    low, high = (simulation.configuration.r[simulation.nodes(name), 2] for name in simulation.rods.names)
    middle = len(low) // 2
    assert abs(low[middle] - high[middle]) > 0.02


def test_a_box_too_small_for_nearest_images_is_refused():
    scene = case(crossed(0.2, 0.0), {"distance": 0.45}, GRID)
    with pytest.raises(CaseError, match=r"contact\.distance: found 0\.45; allowed: .* half of fluid\.box"):
        Simulation(scene)


def test_the_default_strength_is_in_the_units_of_the_rods() -> None:
    """10 A/L^2 of the filament that has the most: 1 in whatever units pushed soft rods a thousandfold too hard."""
    for bending, length in ((1.0, 1.0), (2e-3, 1.0), (0.07, 10.0)):
        rod = {"length": length, "nodes": 11, "bending": bending, "stretching": 1e3, "position": [0, 0, 0]}
        other = {**rod, "bending": 0.1 * bending, "position": [0, 0, length]}
        text = {
            "filament": {"one": rod, "other": other},
            "fluid": {"model": "rft", "viscosity": 1.0},
            "contact": {"action": "repel", "distance": 0.05 * length},
            "time": {"end": 1.0},
            "output": {"every": 1.0},
        }
        assert strength(parse_case(tomli_w.dumps(text), "test.toml")) == pytest.approx(10 * bending / length**2)
