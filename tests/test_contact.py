"""Contact in runs: what stops, warns and repels, when and where; the force between segments against its formula."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from test_segments import suspension

from ibfil import running
from ibfil.case import Case, parse_case
from ibfil.contact import Contact
from ibfil.errors import CaseError, RunFailed
from ibfil.groups import warnings
from ibfil.loop import Result
from ibfil.report import absent, modelled
from ibfil.segments import Segments
from ibfil.simulation import Simulation

ROD: dict[str, Any] = {"length": 1.0, "bending": 1.0, "stretching": 1000.0, "nodes": 12, "derivative": 2}
GRID = {"model": "stokes", "box": [2.0, 2.0, 1.0], "cells": [32, 32, 16]}
ROOT = Path(__file__).parent.parent


def case(rods: dict[str, Any], contact: dict[str, Any] | None, fluid=None, every: float = 0.1, **time: Any) -> Case:
    """Rods in RFT (or ``fluid``), with or without contact."""
    text = {
        "filament": {name: {**ROD, **rod} for name, rod in rods.items()},
        **({} if contact is None else {"contact": contact}),
        "fluid": {"model": "rft", "viscosity": 1.0, **(fluid or {})},
        "time": {"end": 1.0, "step": 0.01, **time},
        "output": {"every": every},
    }
    return parse_case(tomli_w.dumps(text), "test.toml")


def crossed(gap: float, weight: float, **more: Any) -> dict[str, Any]:
    """Two rods, one along x and one along y, that cross in the middle, drawn towards each other along z."""
    upper = {"direction": [1, 0, 0], "position": [0, 0, gap / 2], "loads": {"weight": [0, 0, -weight]}}
    lower = {"direction": [0, 1, 0], "position": [0, 0, -gap / 2], "loads": {"weight": [0, 0, weight]}}
    return {"upper": {**upper, **more}, "lower": {**lower, **more}}


def ran(scene: Case, output: Path | None = None, **more: Any) -> tuple[Result, list[str]]:
    """The result of a run, and what was said."""
    said: list[str] = []
    return running.run(scene, output, progress=False, log=said.append, **more), said


# --- stop and warn --------------------------------------------------------------------------------------------------

SPEED = 4 * np.pi / (4 * np.pi)  # of each rod under a weight of 4 pi per length, across


def test_stop_ends_the_run_at_the_first_contact_and_says_where():
    """Each falls at speed 1 across 0.2: axes are 0.05 apart at t = 0.175."""
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}))
    assert result.status == "stopped"
    match = re.fullmatch(r"contact between (\w+) node (\d+) and (\w+) node (\d+), .*, at t = (.*)", result.reason)
    assert match is not None
    assert {match[1], match[3]} == {"upper", "lower"}
    assert {match[2], match[4]} <= {"5", "6"}  # they cross between these
    assert float(match[5]) == pytest.approx(0.18)  # the first step's end after it
    assert result.frame.time == result.times[-1] == pytest.approx(0.18)
    assert result.times == pytest.approx([0, 0.1, 0.18])
    assert result.frame.diagnostics["contacts"] == 1


def test_a_run_that_never_touches_finishes():
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}, end=0.17))
    assert (result.status, result.frame.diagnostics["contacts"]) == ("finished", 0)


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
    z = [frame.position[:, 2] for frame in result.frame.filaments.values()]
    assert np.max(z[0]) < np.min(z[1])
    assert result.reason.startswith("contact between")
    assert 0.1 < float(result.reason.split("= ")[1]) < 0.15
    assert result.frame.time == pytest.approx(0.2)


def test_stop_is_written_into_the_run_file(tmp_path):
    result, _ = ran(case(crossed(0.4, 4 * np.pi), {"distance": 0.05}), tmp_path / "run.h5")
    from ibfil.record import RunFile

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
    assert (result.status, result.frame.time) == ("finished", 0.3)
    assert result.frame.diagnostics["first_contact"] == pytest.approx(0.18)
    assert result.frame.diagnostics["contacts"] == 0  # they have gone through each other, as said


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
    assert other.frame().diagnostics["first_contact"] == one.frame().diagnostics["first_contact"]


def test_the_distance_is_the_sum_of_radii_where_none_is_given():
    thick, thin = {"radius": 0.06}, {"radius": "0.01 + 0*s"}
    rods = crossed(0.4, 4 * np.pi)
    result, _ = ran(case({"upper": {**rods["upper"], **thick}, "lower": {**rods["lower"], **thin}}, {}))
    assert result.frame.time == pytest.approx(0.17)  # (0.4 - 0.07)/2 = 0.165
    with pytest.raises(CaseError, match=r"contact\.distance: .*no filament\.lower\.radius"):
        case({"upper": {**rods["upper"], **thick}, "lower": rods["lower"]}, {})


def test_a_cone_touches_where_it_is_thick():
    simulation = Simulation(case({"cone": {"radius": "0.02*(1 + s)"}}, {}))
    contact = simulation._rods.contact
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
    upper, lower = (rod.position[5:7, 2].mean() for rod in result.frame.filaments.values())
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


# --- repulsion ------------------------------------------------------------------------------------------------------


def cross(ds: float, gap: float, distance: float = 1.0, offset: float = 0.0) -> tuple[Contact, np.ndarray]:
    """Two straight rods at right angles ``gap`` apart, long as seen from where they cross, and their contact."""
    half = int(np.ceil(6 * distance / ds))
    s = ds * (np.arange(-half, half + 1) + offset)
    zero, k = 0 * s, np.arange(2 * half)
    r = np.concatenate([np.column_stack([s, zero, zero + gap]), np.column_stack([zero, s, zero])])
    begin, first = np.tile(s[:-1], 2), np.concatenate([k, k + len(s)])
    segments = Segments(first, begin, begin + ds, np.repeat([0, 1], len(k)), np.full(2 * len(k), distance / 2))
    return Contact(segments, ["one", "other"], [0, len(s)], np.zeros(3), "repel", 3.0), r


def repulsion(contact: Contact, r: np.ndarray) -> np.ndarray:
    """The forces (n, 3)."""
    (load,) = contact.loads()
    force = np.zeros_like(r)
    load.add_force(Shape(r), 0.0, force)
    return force


class Shape:
    """What a repulsion asks of a configuration."""

    def __init__(self, r: np.ndarray) -> None:
        self.r = r


@pytest.mark.parametrize(("gap", "expected"), [(1.0, 1.0), (0.5, 1.5), (1.9, 0.1), (2.0, 0.0), (2.5, 0.0)])
def test_two_segments_repel_by_the_formula(gap, expected):
    """Long segments that cross in their middles: one pair. F at contact, nothing at twice its distance."""
    contact, r = cross(10.0, gap, offset=0.5)
    force = repulsion(contact, r)
    count = len(r) // 2
    assert force[:count].sum(axis=0) == pytest.approx([0, 0, 3.0 * expected], abs=1e-12)
    assert np.count_nonzero(force[:, 2]) == (4 if expected else 0)
    loaded = force[force[:, 2] > 0]
    assert loaded == pytest.approx(np.tile(force[:count].sum(axis=0) / 2, (len(loaded), 1)))  # the lever rule


def test_fine_rods_that_cross_and_touch_repel_with_the_strength_whatever_their_nodes():
    """The error is first order in the spacing: closest points of segments for points of rods."""
    errors = []
    for ds in (0.2, 0.1, 0.05):
        contact, r = cross(ds, 1.0, offset=0.3)
        errors.append(repulsion(contact, r)[: len(r) // 2, 2].sum() / 3.0 - 1.0)
    assert errors[-1] < 0.06
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx([1, 1], abs=0.1)


@pytest.mark.parametrize("ds", [0.1, 0.5, 1.0, 1.77, 3.0, 10.0])
def test_rods_of_any_spacing_repel_with_one_to_some_four_times_the_strength(ds):
    for offset in (0.0, 0.2, 0.5):
        contact, r = cross(ds, 1.0, offset=offset)
        assert 0.99 < repulsion(contact, r)[: len(r) // 2, 2].sum() / 3.0 < 4.2


@pytest.mark.parametrize("box", [0.0, 1.0])
def test_repulsion_adds_no_force_and_no_torque(box):
    """In a box the torque is about each pair's own image, so it is looked at without."""
    r, segments = suspension(7, 40, 9, 0.8)
    contact = Contact(segments, [], [], np.full(3, box), "repel", 2.0)
    force = repulsion(contact, r)
    scale = np.abs(force).sum()
    assert np.count_nonzero(force[:, 0]) > 50
    assert np.abs(force.sum(axis=0)).max() < 1e-14 * scale
    if not box:
        assert np.abs(np.cross(r, force).sum(axis=0)).max() < 1e-14 * scale * np.abs(r).max()


def test_repulsion_is_what_its_energy_gives_up():
    """f = -grad of F (2 D - d)^2/(2 D), for one pair that crosses inside; within what the pull costs."""
    contact, r = cross(10.0, 0.7, offset=0.4)
    force, step = repulsion(contact, r), 1e-5

    def energy(r: np.ndarray) -> float:
        d = contact.near(r, 2.0).distance
        return float(np.sum(3.0 * (2.0 - d) ** 2 / 2.0))

    for node, c in zip(*np.nonzero(np.abs(force) > 1e-9), strict=True):
        ahead, behind = r.copy(), r.copy()
        ahead[node, c] += step
        behind[node, c] -= step
        expected = (energy(behind) - energy(ahead)) / (2 * step)
        assert force[node, c] == pytest.approx(expected, abs=0.02 * np.abs(force).max())


def test_rods_laid_through_each_other_have_no_direction_to_part_in():
    contact, r = cross(10.0, 0.0, offset=0.5)
    assert np.all(repulsion(contact, r) == 0.0)


def test_the_stiffness_of_a_segment_on_itself_is_exact_along_the_gap():
    """One rod moved along the gap: its force changes by its own blocks. What couples the rods is left out."""
    scene = case(crossed(0.03, 0.0), {"action": "repel", "distance": 0.02, "strength": 2.0})
    simulation = Simulation(scene)
    rods, shape = simulation.mechanics, simulation.shape
    upper = simulation.nodes("upper")

    def matrix(mechanics) -> np.ndarray:
        _, moment = mechanics.forces(shape, 0.0)
        return mechanics.stiffness(shape, shape, moment, 0.0, False)

    without = Simulation(case(crossed(0.03, 0.0), None)).mechanics
    from ibfil import banded

    move, step = np.zeros_like(shape.r), 1e-6
    move[upper, 2] = 1.0
    change = banded.multiply(matrix(rods) - matrix(without), move)
    (load,) = [load for load in rods.loads if type(load).__name__ == "Repulsion"]
    forces = []
    for sign in (1, -1):
        force = np.zeros_like(shape.r)
        load.add_force(Shape(shape.r + sign * step * move), 0.0, force)
        forces.append(force)
    expected = (forces[0] - forces[1]) / (2 * step)
    assert np.abs(expected[upper]).max() > 10
    assert change[upper] == pytest.approx(expected[upper], abs=1e-6)
    assert np.all(change[simulation.nodes("lower")] == 0)


def test_rods_pressed_together_rest_where_the_repulsion_carries_the_load():
    """A weight of 1.2 on each of two rods, F = 2, segments so long that one pair meets: d = D (2 - 1.2/2)."""
    scene = case(
        crossed(0.2, 1.2), {"action": "repel", "distance": 0.02, "strength": 2.0}, end=8.0, every=8.0, step=0.05
    )
    result, _ = ran(scene)
    upper, lower = (rod.position for rod in result.frame.filaments.values())
    assert np.mean(upper[5:7, 2]) - np.mean(lower[5:7, 2]) == pytest.approx(1.4 * 0.02, rel=1e-5)
    assert result.frame.diagnostics["contacts"] == 0
    assert np.abs(result.frame.filaments["upper"].velocity).max() < 1e-4


@pytest.mark.parametrize("scheme", ["implicit", "semi-implicit"])
@pytest.mark.parametrize("strength", [2.0, 50.0])
@pytest.mark.parametrize("askew", [0.0, 0.02])
def test_rods_side_by_side_do_not_pass_through_each_other(scheme, strength, askew):
    """Nearly parallel, where closest points jump from end to end; the weights would take each past the other by 0.4."""
    upper = {"direction": [1, askew, 0], "position": [0, 0.005, 0.05], "loads": {"weight": [0, 0, -4.0]}}
    lower = {"direction": [1, 0, askew], "position": [0.1, 0, -0.05], "loads": {"weight": [0, 0, 4.0]}}
    contact = {"action": "repel", "distance": 0.04, "strength": strength}
    simulation = Simulation(case({"upper": upper, "lower": lower}, contact, scheme=scheme))
    nearest = []

    def look() -> None:
        pairs = simulation._rods.contact.near(simulation.shape.r, 3.0)
        nearest.append(pairs.distance.min(initial=1.0))
        assert np.min(pairs.gap[:, 2] * (pairs.i - pairs.j), initial=0.0) <= 0.0  # the lower one comes second

    simulation.advance(0.25, look)
    assert min(nearest) > 0.5 * 0.04
    assert (
        simulation.shape.r[simulation.nodes("upper"), 2].mean()
        > simulation.shape.r[simulation.nodes("lower"), 2].mean()
    )


def test_rods_do_not_pass_through_each_other_in_one_long_step():
    """The step would take each past the other: it is halved until it does not, and the rods end as they began."""
    contact = {"action": "repel", "distance": 0.05, "strength": 40.0}
    scene = case(crossed(0.12, 4 * np.pi), contact, step=0.2, end=0.4, every=0.4)
    result, _ = ran(scene)
    upper, lower = (rod.position[:, 2] for rod in result.frame.filaments.values())
    assert np.min(upper[5:7]) > np.max(lower[5:7])
    assert result.frame.diagnostics["steps_shortened"] > 0


def test_a_load_that_would_press_rods_through_each_other_fails_the_run():
    with pytest.raises(RunFailed, match="pressed through") as failure:
        ran(case(crossed(0.2, 10.0), {"action": "repel", "distance": 0.05, "strength": 0.1}, min_step=1e-6))
    assert failure.value.filament in ("upper", "lower")
    assert failure.value.node in (5, 6)
    assert "contact.strength" in str(failure.value)


def test_rods_repel_in_a_grid_fluid_too():
    """The stiffness that couples them is missing in every fluid's matrix alike."""
    contact = {"action": "repel", "distance": 0.05, "strength": 20.0}
    scene = case(crossed(0.12, 4.0), contact, GRID, step=0.01, end=0.3, every=0.3)
    result, _ = ran(scene)
    upper, lower = (rod.position[5:7, 2] for rod in result.frame.filaments.values())
    assert np.mean(upper) - np.mean(lower) > 0.05
    scale = np.abs(result.frame.filaments["upper"].force).sum()
    assert np.abs(result.frame.diagnostics["net_force"]).max() < 1e-6 * scale


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
        "from ibfil.cli import main\n"
        "assert main(['run', 'rod.toml']) == 0\n"
        "print('loaded:', {'ibfil.contact', 'ibfil.segments'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert ("ibfil.contact" in done.stdout) == loaded
    assert ("ibfil.segments" in done.stdout) == loaded


def test_without_it_there_is_nothing_of_it_in_the_results():
    simulation = Simulation(case(crossed(0.01, 0.0), None))
    assert simulation._rods.contact is None
    assert not {"contacts", "first_contact"} & set(simulation.frame().diagnostics)
    assert "first_contact" not in simulation.state()
    assert not any("contact" in line for line in warnings(simulation))


def test_check_says_what_is_looked_for():
    scene = case(crossed(0.2, 0.0), {"action": "repel", "distance": 0.05, "strength": 2.0})
    assert "contact of axes nearer than 0.05, looked for each step: repulsion of 2 at that distance" in "\n".join(
        modelled(scene)
    )
    assert not any("contact" in line for line in absent(scene))
    assert any("contact" in line for line in absent(case(crossed(0.2, 0.0), None)))


def test_a_box_too_small_for_nearest_images_is_refused():
    scene = case(crossed(0.2, 0.0), {"distance": 0.45}, GRID)
    with pytest.raises(CaseError, match=r"contact\.distance: found 0\.45; allowed: .* half of fluid\.box"):
        Simulation(scene)
