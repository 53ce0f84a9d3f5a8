"""The errors of step and nodes in fitted parameters, against fits of twins that were run much finer."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.swung import BOUNDS, SWUNG, TRUTH, table

import ibfil
from ibfil.io.reader import RunFile
from ibfil.studies.fit.intervals import moved
from ibfil.studies.fit.study import fit


def test_how_far_the_least_squares_moves_is_that_of_the_changed_residuals():
    rng = np.random.default_rng(0)
    jacobian, residuals, change = rng.normal(size=(30, 3)), rng.normal(size=30), rng.normal(size=30)
    best, other = (np.linalg.lstsq(jacobian, -r, rcond=None)[0] for r in (residuals, residuals + change))
    np.testing.assert_allclose(moved(jacobian, change), other - best, rtol=1e-10)


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "swung.toml"
    path.write_text(SWUNG)
    return path


def twin(case, **changes):
    """Nodes (frames, nodes, 3), times and arclengths of a run of the truth."""
    path = ibfil.run(case, case.with_suffix(".h5"), overrides={**TRUTH, **changes}, overwrite=True).path
    with RunFile(path) as run:
        return np.asarray(run.position("rod"))[1:], run.time[1:], run.arclength("rod")


@pytest.mark.parametrize(
    ("name", "finer", "coarser"),
    [("step", {"time.step": 0.05 / 8}, {"filament.rod.nodes": 11}), ("nodes", {"filament.rod.nodes": 81}, {})],
)
def test_a_fit_is_off_by_what_is_told(case, tmp_path, name, finer, coarser):
    """Data of a run 8 times finer in one direction: the fit is off by the error of that direction."""
    same = {"time.step": 0.05, **coarser}
    data = tmp_path / "tracked.csv"
    data.write_text(table(twin(case, **(same | finer))))
    result = fit(str(case), BOUNDS, tmp_path / "out", data, [f"{k}={v}" for k, v in same.items()], log=str)
    off = [np.log(one.value / TRUTH[one.parameter.key]) for one in result.parameters]
    np.testing.assert_allclose(result.numerical[name], off, rtol=0.15)
    told = [abs(e) > one.half_width / 3 for e, one in zip(off, result.parameters, strict=True)]
    assert [
        any(line.startswith(f"{key}: off by") and f"from the {name}" in line for line in result.notes) for key in BOUNDS
    ] == told


def test_steps_that_frames_cut_are_not_told_to_be_short_enough(case, tmp_path):
    data = tmp_path / "tracked.csv"
    data.write_text(table(twin(case)))
    result = fit(str(case), BOUNDS, tmp_path / "out", data, ["time.step=0.4"], log=str)
    assert "no finer" in result.numerical["step"]
    assert any(
        line.startswith("the error of the step in the parameters is not known: half of it") for line in result.notes
    )
