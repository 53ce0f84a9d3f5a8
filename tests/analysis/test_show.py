"""What `ibfil show` tells of a made run, whose numbers are known."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.made_run import SPEED, make_run

from ibfil.analysis import summary
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.visualization import run_figure, run_panels, run_series, style


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_run(tmp_path_factory.mktemp("show") / "made.h5")


@pytest.fixture
def run(path):
    with RunFile(path) as run:
        yield run


def test_digest_has_the_summaries_with_their_units(run):
    told = summary.digest(run)
    # The drift of a filament that glides along y; the tip's last place.
    assert told["observables"]["speed"]["value"] == pytest.approx(SPEED, rel=1e-12)
    assert told["observables"]["speed"]["units"] == "um/s"
    assert told["observables"]["tip"]["value"] == pytest.approx([1.0, SPEED, 1.0])
    assert told["observables"]["tip"]["units"] == "um"


def test_digest_holds_the_expectations(run):
    held = {one["name"]: one for one in summary.digest(run)["expected"]}
    assert held["right"]["passed"]
    assert not held["wrong"]["passed"]
    assert held["wrong"]["error"] == pytest.approx(0.25)


def test_digest_gives_the_size_of_a_vector_diagnostic(run):
    told = summary.digest(run)["diagnostics"]
    assert told["net_force"] == {"min": 5.0, "max": 5.0, "units": "pN"}
    assert told["stretch_min"] == {"min": -1.0, "max": 0.0, "units": "1"}


def test_text_tells_what_a_user_asks_first(run):
    assert summary.digest(run)["groups"] == run.groups == {"sperm number": 4.5}
    text = summary.as_text(summary.digest(run))
    assert "sperm number = 4.5" in text
    for part in (
        "Two made filaments",
        "by hand",
        "finished",
        "0 to 1 s, 5 outputs",
        "4 in 1 min 15 s",
        "stokes, method made",
        "long (9 nodes), short (7 nodes)",
        "velocity at 3 times",
        "numpy",
    ):
        assert part in text
    lines = text.splitlines()
    assert any(line.split()[:3] == ["speed", "=", "3"] and "um/s" in line for line in lines)
    assert any(line.split()[:2] == ["ok", "right"] for line in lines)
    assert any(line.split()[:2] == ["differs", "wrong"] for line in lines)


def test_the_number_1_is_shown_and_the_unit_1_is_not(run):
    told = summary.digest(run)
    told["observables"]["speed"] |= {"value": 1.0, "units": "1"}
    told["diagnostics"] = {"stretch": {"min": 1.0, "max": 1.0, "units": "1"}}
    lines = summary.as_text(told).splitlines()
    assert any(line.split()[:4] == ["speed", "=", "1", "drift"] for line in lines)
    assert any(line.split() == ["stretch", "1", "to", "1"] for line in lines)


def test_the_summary_says_how_its_number_was_made(run):
    told = summary.digest(run)["observables"]
    assert told["speed"]["description"].startswith("drift (displacement over time) of short, ")
    assert told["tip"]["description"].startswith("position of short, at")


def test_json_is_json_also_with_numbers_that_are_none(run):
    told = summary.digest(run)
    assert json.loads(summary.as_json(told)) == told
    assert summary._plain(np.nan) is None
    assert summary._plain(np.array([1.0, np.inf, -2.0])) == [1.0, None, -2.0]


def test_csv_has_every_value_to_the_last_bit(run, tmp_path):
    summary.write_csv(run, tmp_path / "made.csv")
    with (tmp_path / "made.csv").open(newline="") as file:
        names, *rows = csv.reader(file)
    table = np.array(rows, float)
    # A drift is one number of the run: what is kept at each output is the position that it is of.
    assert names == ["time (s)", "speed.position (um)", "tip_x (um)", "tip_y (um)", "tip_z (um)"]
    np.testing.assert_array_equal(table[:, 0], run.time)
    for i, axis in enumerate("xyz"):
        tip = np.asarray(run.observables["tip"])[:, i]
        np.testing.assert_array_equal(table[:, names.index(f"tip_{axis} (um)")], tip)


def test_table_is_flush_and_drops_empty_columns():
    assert summary.table([("a", "", "bb"), ("ccc", "", "d")]) == ["  a    bb", "  ccc  d"]


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.1234, "0.12 s"), (12.3, "12 s"), (200, "3 min 20 s"), (7500, "2 h 5 min")]
)
def test_durations(seconds, words):
    assert summary.duration(seconds) == words


# --- the figure


def test_figure_shows_all_there_is(run):
    fig = run_figure.figure(run)
    titles = " | ".join(axes.get_title(loc="left") for axes in fig.axes)
    for part in (
        "Shapes",
        "Centroid",
        "Flow at z",
        "tip: position of short at finish (um)",
        "speed (drift): position of short at centroid along y (um)",
        "Curvature of long",
        "speed of the centroid (um/s)",
        "elastic energy (pN um)",
        "power on the fluid (pN um/s)",
    ):
        assert part in titles
    shapes = fig.axes[0]
    assert (shapes.get_xlabel(), shapes.get_ylabel()) == ("x (um)", "y (um)")
    assert shapes.get_aspect() == 1.0
    assert fig.axes[-1].get_xlabel() == "time (s)"
    first, second = (lines.get_segments() for lines in shapes.collections)
    assert len(first) == len(second) == 5
    np.testing.assert_allclose(first[-1][:, 0], np.linspace(0, 2, 9))
    np.testing.assert_allclose(first[-1][:, 1], SPEED)


def test_figure_of_a_run_cut_at_its_start(tmp_path):
    with RunFile(make_run(tmp_path / "made.h5", until=0.0)) as run:
        run_figure.draw(run, tmp_path / "made.png")
    assert (tmp_path / "made.png").read_bytes().startswith(b"\x89PNG")


def test_flow_panel_has_the_flow_of_the_plane_of_the_filaments(run):
    """The mean of the filaments' wrapped z decides the plane; the speed on it is that of all three components."""
    axes = next(a for a in run_figure.figure(run).axes if a.get_title(loc="left").startswith("Flow"))
    mesh = axes.collections[0]
    z = float(axes.get_title(loc="left").split("=")[1].split()[0])
    k = round((z + 0.5) / 0.25)
    velocity = run.grid.fields["velocity"][-1]
    np.testing.assert_allclose(mesh.get_array().reshape(8, 12), np.linalg.norm(velocity[:, :, k], axis=-1).T)


def test_figure_refuses_an_ending_it_cannot_draw(run, tmp_path):
    with pytest.raises(CaseError, match=r"\.png, \.pdf, \.svg"):
        run_figure.draw(run, tmp_path / "made.xyz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("flat", "seen"), [(0, (1, 2)), (1, (0, 2)), (2, (0, 1))])
def test_plane_of_motion_drops_the_axis_of_least_reach(flat, seen):
    positions = np.random.default_rng(1).normal(size=(5, 9, 3))
    positions[..., flat] *= 0.01
    assert style.plane_of_motion([positions, positions + 0.001]) == seen


def test_a_straight_rod_along_x_is_seen_from_z():
    positions = np.zeros((3, 5, 3))
    positions[..., 0] = np.linspace(0, 1, 5)
    assert style.plane_of_motion([positions]) == (0, 1)


def test_wrapped_breaks_the_line_where_it_leaves_the_box():
    r = np.column_stack([np.array([0.5, 0.9, 1.1, 1.5]), np.zeros(4), np.full(4, -0.25)])
    got = run_panels.wrapped(r, origin=np.array([-1.0, -0.5, 0.0]), box=np.array([2.0, 1.0, 0.5]))
    assert np.isnan(got[3]).all()
    np.testing.assert_allclose(np.delete(got, 3, axis=0)[:, 0], [0.5, 0.9, 1.0, -1.0, -0.9, -0.5])
    np.testing.assert_allclose(np.delete(got, 3, axis=0)[:, 2], 0.25)


def test_a_start_that_dwarfs_the_rest_is_left_out_of_the_scale():
    rest = np.array([1.0, 2.0, 1.5])
    low, high = run_series.limits_without_start([np.append(500.0, rest)])
    assert 0.5 < low < 1.0
    assert 2.0 < high < 2.5
    assert run_series.limits_without_start([np.append(4.0, rest)]) is None
    assert run_series.limits_without_start([np.append(500.0, [1.0, 1.0, 1.0])]) is None
    assert run_series.limits_without_start([np.append(np.nan, rest)]) is None


@pytest.mark.parametrize(("units", "label"), [("1", "time"), ("", "time"), ("s", "time (s)")])
def test_labels_have_units_where_there_are_any(units, label):
    assert style.with_units("time", units) == label


def test_a_run_without_observables_fields_or_stretch_is_drawn_too(run):
    bare = SimpleNamespace(
        case=run.case,
        path=run.path,
        time=run.time,
        filaments=run.filaments,
        bodies={},
        grid=None,
        observables={},
        diagnostics={"power": run.diagnostics["power"]},
        units=run.units,
        arclength=run.arclength,
        filament=run.filament,
    )
    titles = {axes.get_title(loc="left") for axes in run_figure.figure(bare).axes}
    motion = {"speed of the centroid (um/s)", "elastic energy (pN um)"}
    assert titles - {""} - motion == {
        "Shapes, 5 over the run",
        "Centroid, ring to dot; axes of two scales",
        "Curvature of long",
        "power on the fluid (pN um/s)",
    }


def test_of_many_names_some_are_listed():
    assert summary.listed(["a", "b", "c", "d"]) == "a, b, c, d"
    assert summary.listed([f"f{i}" for i in range(200)]) == "f0, f1, ..., f199; 200 in all"
