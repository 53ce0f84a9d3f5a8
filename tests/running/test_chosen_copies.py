"""Runs of which every so many-th copy is written: what is there is as in a whole run, and nothing takes it for all."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.analysis import summary
from ibfil.analysis.flow import flow_of
from ibfil.analysis.run import Run
from ibfil.case.reading import parse_case
from ibfil.check.budget import disk
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.observables.copies import series_parts
from ibfil.running.run import resume_run, run
from ibfil.simulation.simulation import Simulation

SCENE = """
[filament.rod]
length = 1.0
nodes = 9
bending = 1.0
stretching = 400
direction = [1, 0, 0]
loads = { force = [0, 0, "-1 - 0.1*i"] }
copies = { count = 7, at = ["0", "0.5*i", "0"] }
[filament.other]
length = 1.0
nodes = 9
bending = 1.0
stretching = 400
position = [0, 0, 1]
[fluid]
model = "stokes"
viscosity = 1.0
box = [4, 4, 4]
cells = [16, 16, 16]
[time]
end = 0.2
step = 0.05
[observe.fall]
filament = "rod"
kind = "velocity"
at = "centroid"
along = [0, 0, 1]
copies = "all"
[observe.mean]
filament = "rod"
kind = "drift"
at = "centroid"
along = [0, 0, 1]
copies = "mean"
over = [0, 0.2]
[output]
every = 0.05
"""
SOME = ("output.copies_every=3",)


def case(*overrides: str):
    return parse_case(SCENE, "scene.toml", overrides)


def made(path, *overrides: str) -> Run:
    run(case(*overrides), path, progress=False, log=lambda line: None)
    return Run(path)


def test_every_third_copy_is_written_and_observed_as_in_a_whole_run(tmp_path):
    alone = [
        f"observe.d{k}={{kind='drift', filament='rod_{k:03d}', at='centroid', along=[0, 0, 1]}}" for k in (0, 3, 6)
    ]
    whole, some = made(tmp_path / "whole.h5", *alone), made(tmp_path / "some.h5", *SOME)
    assert sorted(some.filaments) == ["other", "rod_000", "rod_003", "rod_006"]
    for name, columns in some.filaments.items():
        for key, column in columns.items():
            assert np.asarray(column).tobytes() == np.asarray(whole.filaments[name][key]).tobytes()
    every = np.asarray(whole.observables["fall"])
    assert every.shape[1] == 7
    assert np.array_equal(np.asarray(some.observables["fall"]), every[:, ::3])
    drifts = [whole.summaries[f"d{k}"].value for k in (0, 3, 6)]
    assert some.summaries["mean"].value == pytest.approx(np.mean(drifts), rel=1e-9)
    assert some.summaries["mean"].value != pytest.approx(whole.summaries["mean"].value, rel=1e-3)
    assert np.array_equal(np.asarray(some.diagnostics["power"]), np.asarray(whole.diagnostics["power"]))
    assert list(series_parts(some.case, "fall", np.asarray(some.observables["fall"]))) == ["000", "003", "006"]
    assert disk(Simulation(case(*SOME))) == pytest.approx(disk(Simulation(case())) * 4 / 8)


def test_such_a_run_goes_on_to_the_same_bits(tmp_path):
    made(tmp_path / "whole.h5", *SOME)
    made(tmp_path / "part.h5", *SOME, "time.end=0.1")
    resume_run(tmp_path / "part.h5", case(*SOME), progress=False, log=lambda line: None)
    with RunFile(tmp_path / "whole.h5") as one, RunFile(tmp_path / "part.h5") as other:
        assert np.array_equal(one.position("rod_006"), other.position("rod_006"))
        for name, column in one.observables.items():
            assert np.array_equal(column, other.observables[name])


@pytest.mark.parametrize(
    "other", ["copies_every=1", "copies_every=6", "probes=[[0.1,0,0]]", "grid_stride=2", "fields=['vorticity']"]
)
def test_no_run_goes_on_with_other_datasets(tmp_path, other):
    path, key = tmp_path / "part.h5", "output." + other.partition("=")[0]
    made(path, *SOME, "output.grid_every=0.1", "time.end=0.1")
    before = path.read_bytes()
    with pytest.raises(CaseError, match=rf"{key}\S*: found .* only time.end and times of output may change"):
        resume_run(path, case(*SOME, "output.grid_every=0.1", f"output.{other}"), progress=False)
    assert path.read_bytes() == before


def test_a_run_may_go_on_with_fields_where_it_had_none(tmp_path):
    path, fields = tmp_path / "part.h5", ("output.grid_every=0.1", "output.fields=['vorticity']")
    made(path, *SOME, "time.end=0.1")
    resume_run(path, case(*SOME, *fields), progress=False, log=lambda line: None)
    with RunFile(path) as run_file:
        assert np.asarray(run_file.grid.time) == pytest.approx([0.1, 0.2])
        assert list(run_file.grid.fields) == ["vorticity"]


def test_a_digest_tells_that_copies_are_missing(tmp_path):
    told = summary.as_text(summary.digest(made(tmp_path / "some.h5", *SOME)))
    assert "rod_006 (9 nodes); of copies one in 3 is written, and observed (output.copies_every)" in told
    assert "copies_every" not in summary.as_text(summary.digest(made(tmp_path / "whole.h5")))


def test_no_flow_is_made_of_forces_that_are_not_there(tmp_path):
    made(tmp_path / "some.h5", *SOME)
    with RunFile(tmp_path / "some.h5") as some, pytest.raises(CaseError, match=r"copies_every leaves forces out"):
        flow_of(some)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["observe.mean={kind='velocity', filament='rod_004', at='centroid'}"], "one in 3: rod_003"),
        (["output.copies_every=0"], "output.copies_every"),
    ],
)
def test_what_looks_at_copies_that_are_not_written_is_refused(overrides, words):
    with pytest.raises(CaseError, match=words):
        case(*SOME, *overrides)
