"""A run opened from Python: the flow at any point, meshes, a dataset."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import CELLS, ORIGIN, SPACING, flow, make_run
from helpers.scenes import slopes

import ibfil
from ibfil.errors import CaseError
from ibfil.grid.kernels import KERNELS

PROBES = [[0.1, 0.31, 0.05], [0.93, -0.2, 0.0], [-0.4, 0.02, -0.77]]
BENT = f"""
[filament.rod]
length = 1.0
nodes = 17
bending = 1.0
stretching = 100.0
radius = 0.03
shape = {{ kind = "circle", curvature = 2.0 }}
copies = {{ count = 2, region = [[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]] }}
[fluid]
model = "stokes"
viscosity = 0.7
box = [2.0, 2.0, 2.0]
cells = [20, 20, 20]
flow = ["0.3*y", "0.1*t", 0]
[time]
end = 0.02
step = 2e-3
[output]
every = 0.01
probes = {PROBES}
"""


@pytest.fixture(scope="module")
def bent(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("bent") / "bent.h5"
    ibfil.run(ibfil.parse_case(BENT, "bent.toml"), path, log=lambda line: None)
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    return make_run(tmp_path_factory.mktemp("made") / "made.h5")


def test_the_flow_is_that_of_the_probes(bent):
    """Probes come from the exact table while the run lasts, this from one FFT solve afterwards."""
    with ibfil.open(bent) as run:
        for i, time in enumerate(run.time):
            u = run.velocity_at(PROBES, time)
            assert np.max(np.abs(u)) > 0.05
            np.testing.assert_allclose(u, run.diagnostics["probe_velocity"][i], rtol=0, atol=1e-12)
        assert np.array_equal(run.velocity_at(PROBES), run.velocity_at(PROBES, run.time[-1]))


def test_a_node_moves_with_the_flow_there_but_for_its_slip(tmp_path):
    """Without slip, u at a node is its own velocity: here slip is 1 % of its own mobility times its force.

    The velocity that a step has is by the mobility where it was going, and the flow asked for by that of where it came
    to: they differ by second order in the step.
    """
    h, volume, left = 0.1, np.array([0.5, *np.ones(15), 0.5])[:, None] / 16, []
    slip = 0.01 * (h / (2 * volume)) / (6 * np.pi * 0.7 * KERNELS["peskin4"].point_radius * h)
    for step in (2e-3, 1e-3, 5e-4):
        path = tmp_path / "run.h5"
        case = ibfil.parse_case(BENT, "bent.toml", [f"time.step={step}"])
        ibfil.run(case, path, overwrite=True, log=lambda line: None)
        with ibfil.open(path) as run:
            rod = run.filaments["rod_001"]
            found = run.velocity_at(rod["position"][-1])
            left.append(float(np.abs(rod["velocity"][-1] - slip * rod["force"][-1] - found).max()))
    assert min(slopes(left)) > 1.9


def test_the_flow_between_two_outputs_lies_between(bent):
    """Forces and places change evenly, and u by both: what is left is a quarter of the product of the changes."""
    with ibfil.open(bent) as run:
        before, middle, after = (run.velocity_at(PROBES, t) for t in (0.01, 0.015, 0.02))
        force = [run.filaments[name]["force"] for name in run.filaments]
        part = max(np.abs(f[2] - f[1]).max() / np.abs(f[1]).max() for f in force)
        np.testing.assert_allclose(middle, 0.5 * (before + after), atol=0.25 * part * np.abs(after - before).max())


def test_the_flow_is_periodic_but_for_the_background(bent):
    with ibfil.open(bent) as run:
        shift = run.velocity_at(np.add(PROBES, [2.0, 0.0, -4.0])) - run.velocity_at(PROBES)
        np.testing.assert_allclose(shift, 0, atol=1e-12)


def test_flow_that_is_not_known_is_refused(bent, tmp_path):
    rft = tmp_path / "rft.h5"
    ibfil.run(ibfil.parse_case(BENT, "bent.toml", ["fluid.model=rft"]), rft, log=lambda line: None)
    with ibfil.open(rft) as run, pytest.raises(CaseError, match=r'fluid\.model: found "rft"'):
        run.velocity_at(PROBES)
    with ibfil.open(bent) as run:
        with pytest.raises(CaseError, match=r"time: found 0\.03; allowed: 0 to 0\.02"):
            run.velocity_at(PROBES, 0.03)
        for points in ([[0.0, 1.0]], [[0, 0, np.nan]], np.zeros((2, 2, 3))):
            with pytest.raises(CaseError, match="points: found shape"):
                run.velocity_at(points)


def test_a_recorded_field_is_interpolated(made):
    """The made flow is linear in space but for x y, and linear in time: exact at grid points and along axes."""
    from ibfil.analysis.flow import FlowOfField

    points = ORIGIN + SPACING * np.array([[1.0, 2.0, 3.0], [1.5, 2.0, 1.0], [4.0, 2.25, 0.5]])
    with ibfil.open(made) as run:
        of_field = FlowOfField(run, run.grid)
        for time in (0.0, 0.3, 1.0):
            np.testing.assert_allclose(of_field.velocity_at(points, time), flow(*points.T, time), rtol=1e-6, atol=1e-5)
        box = SPACING * np.array(CELLS)
        np.testing.assert_allclose(
            of_field.velocity_at(points + box, 0.5), of_field.velocity_at(points, 0.5), rtol=1e-12, atol=1e-12
        )


def test_meshes(made, bent):
    with ibfil.open(made) as run:
        mesh = run.mesh(0.75)
        assert mesh.n_lines == 2
        np.testing.assert_allclose(mesh.points[:, 1], 3.0 * 0.75)
        field = run.field(0.5)
        np.testing.assert_allclose(field["velocity"], flow(*field.points.T, 0.5), rtol=1e-6, atol=1e-6)
    with ibfil.open(bent) as run:
        assert run.mesh().n_lines == 2  # copies
        with pytest.raises(CaseError, match="found no fields"):
            run.field()


def test_a_dataset_for_xarray(made):
    xarray = pytest.importorskip("xarray", reason="xarray is not installed: to_xarray is not tested")
    with ibfil.open(made) as run:
        data = run.to_xarray()
        assert isinstance(data, xarray.Dataset)
        assert data["long_position"].dims == ("time", "long_node", "xyz")
        assert data["long_tension"].dims == ("time", "long_segment")
        assert data["long_force"].attrs["units"] == "pN"
        half = 0.5 * float(data["long_arclength"][-1])
        np.testing.assert_array_equal(
            data["long_position"].sel(long_arclength=half, method="nearest"), run.filaments["long"]["position"][:, 4]
        )
        np.testing.assert_array_equal(data["short_position"].sel(time=0.75), run.filaments["short"]["position"][3])
        np.testing.assert_array_equal(data["tip"].sel(xyz="y"), run.observables["tip"][:, 1])
        assert data["long_moment"].dims == ("time", "long_node", "frame")
        np.testing.assert_array_equal(data["long_strain"].sel(frame="e3"), run.filaments["long"]["strain"][:, :, 2])
        position = run.filaments["long"]["position"]
    for read in (lambda: position[-1], lambda: np.asarray(position), lambda: run.status):
        with pytest.raises(ValueError, match=r"the run file is closed; ibfil\.open opens it again"):
            read()


def test_a_run_says_what_it_is_where_it_is_printed(made):
    with ibfil.open(made) as run:
        assert repr(run).startswith(f"<Run {made}: finished, 5 outputs, t = 0 to 1; long (9 nodes), short (7 nodes)")
        assert repr(run.filaments["long"]["position"]).startswith("<Column (5, 9, 3) float64")
