"""The run of linked rods: what its file, its observables, its tables and its ParaView files have of the links."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.linked_scenes import ASKEW, LINKS, linked
from vtkmodules.util.numpy_support import vtk_to_numpy

from ibfil.analysis.meshes import View, link_lines
from ibfil.analysis.run import open_run
from ibfil.case.reading import parse_case
from ibfil.check.report import report
from ibfil.errors import CaseError
from ibfil.observables.factory import observers
from ibfil.running.run import run
from ibfil.simulation.simulation import Simulation
from ibfil.visualization.vtk_files import write_vtk

KINDS = {"spring": LINKS["damped spring"], "hinge": LINKS["hinge"], "pair": LINKS["motors"]}
OBSERVED = """
[observe.pull]
kind = "link_tension"
link = "spring"
[observe.across]
kind = "link_tension"
link = "pair"
space = "max"
[observe.slid]
kind = "link_slide"
link = "pair"
[observe.sheared]
kind = "link_shear"
link = "pair"
space = "min"
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The path of a run, and the snapshots that were taken while it ran."""
    path = tmp_path_factory.mktemp("linked") / "run.h5"
    case = parse_case(linked(ASKEW, KINDS, end=0.1, every=0.05).text + OBSERVED, "linked.toml")
    seen = []

    class Kept(Simulation):
        def snapshot(self, fields=()):
            seen.append(super().snapshot(fields))
            return seen[-1]

    run(case, path, progress=False, log=lambda line: None, build=lambda case, wisdom: Kept(case, wisdom))
    return path, {snapshot.time: snapshot for snapshot in seen}


def test_the_file_has_every_link_as_it_was(done):
    path, seen = done
    with open_run(path) as file:
        assert set(file.links) == set(KINDS)
        for snapshot in file.snapshots():
            for name, link in seen[snapshot.time].links.items():
                for part, value in vars(link).items():
                    found = getattr(snapshot.links[name], part)
                    assert found is None if value is None else np.array_equal(found, value), (name, part)
        assert file.links["pair"]["slide"].shape == (3, 10)
        assert file.units("links/pair/shear") == "1"
        whole = file.to_xarray()
        assert whole["pair_force"].dims == ("time", "pair_element", "xyz")
        assert np.array_equal(whole["spring_tension"], file.links["spring"]["tension"])


def test_observables_are_those_numbers(done):
    path, _ = done
    with open_run(path) as file:
        links, found = file.links, file.observables
        assert np.array_equal(found["pull"], np.asarray(links["spring"]["tension"])[:, 0])
        assert np.asarray(found["across"]) == pytest.approx(np.asarray(links["pair"]["tension"]).max(axis=1))
        assert np.asarray(found["slid"]) == pytest.approx(np.asarray(links["pair"]["slide"]).mean(axis=1))
        assert np.asarray(found["sheared"]) == pytest.approx(np.asarray(links["pair"]["shear"]).min(axis=1))
        assert np.abs(np.asarray(found["slid"])[1:]).min() > 1e-4
        assert file.description("observables/across") == 'tension of pair, space = "max"'


def test_an_observable_of_what_a_link_has_not_is_refused():
    case = linked(ASKEW, KINDS)
    bad = parse_case(case.text + '[observe.v]\nkind = "link_slide"\nlink = "hinge"\n', "linked.toml")
    with pytest.raises(CaseError, match=r'observe\.v\.link: found "hinge"; allowed: a link that has a slide: pair'):
        observers(bad)


def test_paraview_files_have_a_line_an_element(done, tmp_path):
    path, seen = done
    collection = write_vtk(path, tmp_path / "vtk")
    text = collection.read_text()
    assert text.count("_links_") == text.count("_filaments_") == 3
    assert 'part="1" file="run_links_000000.vtp"' in text
    assert (tmp_path / "vtk" / "run_links.pvd").exists()
    assert 'Selectors=["/Root/Block1"]' in (tmp_path / "vtk" / "run_paraview.py").read_text()
    lines = link_lines(seen[0.1])
    assert lines.GetNumberOfLines() == 12
    pair, points = seen[0.1].links["pair"], lines.GetPointData()
    assert lines.GetPoint(4) == pytest.approx(pair.first[0], rel=1e-6)
    assert lines.GetPoint(5) == pytest.approx(pair.second[0], rel=1e-6)
    force = [points.GetArray("force").GetTuple3(k) for k in (4, 5)]
    assert force[1] == pytest.approx(pair.force[0], rel=1e-6)
    assert force[0] == pytest.approx(-pair.force[0], rel=1e-6)
    assert points.GetArray("link_force").GetValue(5) == pytest.approx(np.linalg.norm(pair.force[0]), rel=1e-6)


def test_check_tells_of_links_of_strain_and_of_stiffness():
    text = report(linked(ASKEW, {**KINDS, "stiff": {**LINKS["spring"], "stiffness": 1e9}}))
    assert "link spring: spring between a at 0.71 and b at 0.31, stiffness 30, at rest its length at the start" in text
    assert "link hinge: hinge between a at 0.2 and b at 0.4, stiffness 3" in text
    assert "link pair: a and b bound side by side, motors with friction 5, lag 0.2" in text
    assert "link.stiff: strained by" in text
    assert "link.stiff: its stiffness times the step is" in text
    assert "links between filaments" in report(linked(ASKEW, {}))


def test_in_a_box_lines_are_shown_whole_where_their_middle_is(done):
    _, seen = done
    box = np.array([0.3, 0.25, 0.2])
    plain, wrapped = (vtk_to_numpy(link_lines(seen[0.1], box, View(wrap)).GetPoints().GetData()) for wrap in (0, 1))
    by = (plain - wrapped).reshape(-1, 2, 3)
    np.testing.assert_allclose(by / box, np.round(by / box), atol=1e-6)
    np.testing.assert_array_equal(np.round(by[:, 0] / box), np.round(by[:, 1] / box))
    assert np.abs(by).max() > 0.1
    assert np.all(np.abs(wrapped.reshape(-1, 2, 3).mean(axis=1)) <= 0.5 * box + 1e-6)
