"""Bodies whose markers are of a file: the numbers of a sphere of these markers; what is told, recorded and refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ibfil
from ibfil.analysis.body_meshes import body_surfaces, extents
from ibfil.analysis.run import open_run
from ibfil.bodies.resistance import ellipsoid
from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.fluids.shells.calibration import fitted
from ibfil.simulation.simulation import Simulation
from ibfil.visualization.web.page import write_page

SPHERE = '{ kind = "sphere", radius = 0.2 }'
CLOUD = '{ kind = "file", path = "markers.csv" }'
GRID = 'model = "stokes"\nbox = "free"\nspacing = 0.05\nkernel = "bspline4"'
BOX = 'model = "stokes"\nbox = [2.4, 2.4, 2.4]\ncells = [48, 48, 48]\nkernel = "bspline4"'
CASE = """
[filament.tail]
length = 0.8
nodes = 9
bending = 1.0
twisting = 1.0
stretching = 1e3
radius = 0.02
curvature = ["4*(1 - cos(3*t))*s", 0]
position = [0.2, 0, 0]
anchor = "start"
start = {{ end = "body", body = "head" }}
[body.head]
shape = {shape}
position = {at}
{more}
[fluid]
{fluid}
viscosity = 1.3
[time]
end = 0.06
step = 0.02
[output]
every = 0.02
"""


def shell() -> np.ndarray:
    """The markers of the sphere, in the case's units."""
    return 0.05 * fitted((4.0, 4.0, 4.0), "bspline4", 1.75, False).markers


def written(folder, shape: str, points: np.ndarray | None = None, fluid: str = GRID, more: str = "", at=(0, 0, 0)):
    """The file of the case, markers beside it."""
    if points is not None:
        np.savetxt(folder / "markers.csv", points, delimiter=",", header="x,y,z", comments="", fmt="%.17g")
    path = folder / "cell.toml"
    path.write_text(CASE.format(shape=shape, fluid=fluid, more=more, at=[float(x) for x in at]))
    return ibfil.read_case(path)


def moved(case) -> np.ndarray:
    """How the head moves, and what pushes it, after a beat."""
    sim = Simulation(case)
    sim.advance(0.06, lambda: None)
    head = sim.snapshot().bodies["head"]
    return np.concatenate([head.velocity, head.spin, head.force, head.torque, head.e1])


@pytest.mark.parametrize("fluid", [GRID, BOX + '\nmethod = "krylov"'], ids=["free", "box"])
def test_the_markers_of_a_sphere_are_the_sphere(tmp_path, monkeypatch, fluid):
    """Its shell may be turned, to keep off the rod: here it stays as the file has it."""
    monkeypatch.setattr("ibfil.assembly.fluids.shells._TURNS", 1)
    known = moved(written(tmp_path, SPHERE, fluid=fluid))
    found = moved(written(tmp_path, CLOUD, shell(), fluid))
    np.testing.assert_allclose(found, known, atol=1e-9 * np.abs(known).max())


def test_they_drag_as_the_sphere_wherever_they_are_seen_from(tmp_path):
    """Shifted and turned in the file, and put back: the same places, and motion to Newton's tolerance."""
    first, second = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    axes, shift = np.column_stack([first, second, np.cross(first, second)]), np.array([0.03, -0.02, 0.05])
    points = (shell() + shift) @ axes
    one = Simulation(written(tmp_path, CLOUD, shell()))
    pose = "axes = [[0.6, 0.8, 0], [0, 0, 1]]"
    other = Simulation(written(tmp_path, CLOUD, points, more=pose, at=-shift))
    for sim in (one, other):
        sim.advance(0.06, lambda: None)
    here, there = (sim.snapshot().bodies["head"] for sim in (one, other))
    np.testing.assert_allclose(there.markers, here.markers, atol=1e-8)
    np.testing.assert_allclose(there.spin, here.spin, atol=1e-5 * np.linalg.norm(here.spin))
    np.testing.assert_allclose(there.force, here.force, atol=1e-4 * np.abs(here.force).max())


def test_in_rft_they_have_the_resistance_that_is_given(tmp_path):
    """That of the sphere makes it the sphere."""
    rft = 'model = "rft"'
    known = moved(written(tmp_path, SPHERE, fluid=rft))
    drags = ellipsoid(np.full(3, 0.2), 1.3)
    own = f"resistance = {{ translation = {drags.translation.tolist()}, rotation = {drags.rotation.tolist()} }}"
    found = moved(written(tmp_path, CLOUD, shell(), rft, own))
    np.testing.assert_allclose(found, known, atol=1e-10 * np.abs(known).max())


def test_check_tells_their_radii_and_how_far_they_are_apart(tmp_path):
    model = Simulation(written(tmp_path, CLOUD, shell())).model.fluid_model
    told = next(line for line in model.modelled() if "of its file" in line)
    assert "50 markers of its file, as they are, neighbours 1.74 to 1.82 cells apart" in told
    assert "as a sphere of radius 0.2 when moved, of 0.195" in told
    for points, words in ((shell()[::3], "fluid passes between them; take more"), (0.65 * shell(), "take fewer")):
        sim = Simulation(written(tmp_path, CLOUD, points))
        assert any(words in line for line in sim.model.fluid_model.warnings(sim))


def test_a_run_records_them_and_draws_them(tmp_path):
    """Rigid in every output; octahedra in place of a surface; a run goes on without its first part."""
    case = written(tmp_path, CLOUD, shell())
    ibfil.run(case, tmp_path / "cell.h5")
    (tmp_path / "markers.csv").unlink()
    with open_run(tmp_path / "cell.h5") as run:
        columns = run.bodies["head"]
        axes = np.stack([np.asarray(columns[key]) for key in ("e1", "e2", "e3")], axis=1)
        seen = np.einsum(
            "tki,tai->tka", np.asarray(columns["markers"]) - np.asarray(columns["position"])[:, None], axes
        )
        np.testing.assert_allclose(seen, np.broadcast_to(shell(), seen.shape), atol=1e-12)
        surface = body_surfaces(run, run.snapshot(-1))
        assert surface.GetNumberOfPolys() == 8 * 50
        assert surface.GetNumberOfLines() == 3
        assert np.ptp(extents(run)[0][0], axis=0) == pytest.approx(np.ptp(shell(), axis=0), rel=1e-9)
        assert run.to_xarray()["head_markers"].dims == ("time", "head_marker", "xyz")
    page = write_page(tmp_path / "cell.h5", tmp_path / "cell.html", log=str).read_text()
    assert '"linewords": "crosses: markers"' in page
    assert '"links": 150,' in page


COPIES = 'copies = { count = 2, at = [0, "1.5*i", 0] }\n[body.head]'


def test_a_run_goes_on_only_with_the_markers_it_began_with(tmp_path):
    """Bit for bit with the same file; with another the key of the table is told, also of copies."""
    points = shell()
    path = written(tmp_path, CLOUD, points).file
    case = parse_case(Path(path).read_text().replace("[body.head]", COPIES), path)
    first, again = Simulation(case), Simulation(case)
    first.advance(0.02, lambda: None)
    again.restore(first.state())
    for sim in (first, again):
        sim.accept(sim.attempt(0.02), 0.04)
    np.testing.assert_array_equal(again.configuration.table, first.configuration.table)
    for others in (points[:-1], 0.99 * points):
        written(tmp_path, CLOUD, others)
        with pytest.raises(CaseError, match=r"cell\.toml: body\.head\.shape\.path: found other markers in its file"):
            Simulation(case).restore(first.state())
    (tmp_path / "markers.csv").unlink()
    with pytest.raises(CaseError, match=r"cell\.toml: body\.head\.shape\.path: markers\.csv: cannot be read"):
        Simulation(case)


FAULTS = {
    "cell.toml: body.head.shape.path: markers.csv: cannot be read (No such file or directory)": None,
    "body.head.shape.path: markers.csv: holds 3 points; at least 4 markers are needed": np.eye(3),
    "body.head.shape.path: markers.csv: holds points along one line": np.outer(np.arange(5.0), [1.0, 2.0, 0.0]),
    "body.head.shape.path: markers.csv: point 2 is not finite": np.array(
        [[0, 0, 1.0], [0, np.nan, 0], [1, 0, 0], [0, 1, 0]]
    ),
    "body.head.shape.path: found markers 0.2 cells apart, which lock against each other; allowed: 0.4": np.concatenate(
        [shell(), shell()[:1] + np.array([0.01, 0.0, 0.0])]
    ),
    "filament.tail.start.body: found an end 0.5": shell() - [0.51, 0.0, 0.0],
}


@pytest.mark.parametrize("fault", list(FAULTS))
def test_a_file_that_will_not_do_is_one_line(tmp_path, fault):
    with pytest.raises(CaseError) as caught:
        Simulation(written(tmp_path, CLOUD, FAULTS[fault]))
    assert fault in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("fluid", "more", "fault"),
    [
        ('model = "rft"', "", "body.head.resistance: found nothing, of markers of a file in rft; allowed: translation"),
        (GRID, 'fit = "rotation"', "body.head.fit: found a fit of markers of a file, which are as they are"),
    ],
)
def test_what_does_not_go_with_a_file_is_one_line(tmp_path, fluid, more, fault):
    with pytest.raises(CaseError) as caught:
        written(tmp_path, CLOUD, shell(), fluid, more)
    assert fault in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
