"""The figure of a run: which moments it shows, how many filaments are drawn; the README's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import BENT, make_run
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

import ibfil
from ibfil.case.reading import parse_case
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.visualization import run_figure, run_series
from ibfil.visualization.moments import Look, moments
from ibfil.visualization.style import save

SHOWN = Path(__file__).parents[2] / "postprocess/pictures/swimmer_stokes.png"
FLAT = 'shape = { kind = "circle", curvature = 1.0 }'
BEAT = BENT.replace(FLAT, 'curvature = ["4*sin(4*pi*s - 2*pi*t/8e-3)", 0]').replace("every = 0.005", "every = 1e-3")


def run_of(text: str, path: Path) -> RunFile:
    ibfil.run(parse_case(text, "scene"), path)
    return RunFile(path)


def titles(run: RunFile, look: Look | None = None) -> list[str]:
    return run_figure.told_of(run_figure.figure(run, look)).split("\n")


@pytest.fixture(scope="module")
def beating(tmp_path_factory):
    with run_of(BEAT, tmp_path_factory.mktemp("beat") / "beat.h5") as run:
        yield run


def test_a_beat_is_shown_over_its_last_period_and_not_over_the_run(beating):
    """Period 8e-3 in a run of 20e-3: eight outputs end with the last one, and none has the phase of another."""
    seen = moments(beating, Look())
    np.testing.assert_allclose(np.asarray(beating.time)[seen.shapes], np.arange(13, 21) * 1e-3, atol=1e-12)
    assert seen.words == "over the last period of 0.008"
    np.testing.assert_allclose(
        np.asarray(beating.time)[moments(beating, Look(end=0.012, shapes=4)).shapes], [6e-3, 8e-3, 10e-3, 12e-3]
    )


def test_a_window_shorter_than_the_period_shows_itself(beating):
    seen = moments(beating, Look(0.0, 4e-3, 3))
    np.testing.assert_allclose(np.asarray(beating.time)[seen.shapes], [0, 2e-3, 4e-3])
    assert (seen.span, seen.words) == (slice(0, 5), "3 over the window")


def test_the_window_is_that_of_every_panel(beating):
    fig = run_figure.figure(beating, Look(2e-3, 12e-3))
    lines = [line.get_xdata() for axes in fig.axes for line in axes.get_lines() if len(line.get_xdata()) > 1]
    assert lines
    for times in lines:
        np.testing.assert_allclose([times[0], times[-1]], [2e-3, 12e-3])


@pytest.mark.parametrize("look", [Look(1.0, 2.0), Look(0.01, 0.005), Look(shapes=0)])
def test_a_window_without_an_output_is_one_line(beating, look):
    with pytest.raises(CaseError, match=r"^--(from, --to|shapes): found .*; allowed: "):
        run_figure.figure(beating, look)


def test_shapes_seen_from_their_centroid_have_it_at_zero(beating):
    segments = np.array(run_figure.figure(beating, Look(co_moving=True)).axes[0].collections[0].get_segments())
    np.testing.assert_allclose(segments.mean(axis=1), 0, atol=1e-12)
    assert np.ptp(segments, axis=1).max() > 0.5


def test_thermal_runs_show_no_velocity_and_no_power(tmp_path):
    hot = BENT.replace("[time]", "[thermal]\nenergy = 1e-3\nseed = 1\n[time]")
    with run_of(hot, tmp_path / "hot.h5") as run:
        found = titles(run)
        assert not any("speed" in title or "power" in title for title in found)
        assert "distance of the centroid from its start" in found
    with run_of(BENT, tmp_path / "cold.h5") as run:
        assert {"speed of the centroid", "power on the fluid"} <= set(titles(run))


def test_many_filaments_are_a_mean_and_a_band(tmp_path):
    lines = {str(k): np.array([k, 2.0 * k]) for k in range(1, 12)}
    panel = run_series._of_many("energy", "J", lines)
    np.testing.assert_allclose(panel.lines[""], [6, 12])
    np.testing.assert_allclose(panel.band, [[2, 4], [10, 20]])
    assert "mean of 11" in panel.title
    few = run_series._of_many("energy", "J", dict(list(lines.items())[:3]))
    assert (list(few.lines), few.band) == (["1", "2", "3"], None)


def test_many_copies_are_a_mean_and_a_band_and_their_vectors_a_mean(tmp_path, recwarn):
    of_all = {"kind": "position", "filament": "rod", "copies": "all", "along": [0, 1, 0], "at": "start"}
    keys = {
        "filament.rod.copies": {"count": 5, "at": [0, "0.4*i", 0], "phase": 0},
        "expect": {},
        "observe": {"where": of_all, "moved": {"kind": "drift", "filament": "rod", "copies": "mean"}},
    }
    ibfil.run(parse_case(BENT, "scene", keys), tmp_path / "run.h5")
    with RunFile(tmp_path / "run.h5") as run:
        place, moved = sorted(run_series.panels(run)[:2], key=lambda panel: panel.band is None)
        every, each = np.asarray(run.observables["where"]), np.asarray(run.observables["moved.position"])
        run_figure.draw(run, tmp_path / "run.png")  # whose panels do not shrink to nothing under a legend of all
    np.testing.assert_allclose(place.lines[""], every.mean(axis=1))
    np.testing.assert_allclose(place.band, np.percentile(every, run_series.BAND, axis=1))
    assert place.title.startswith("where: ")
    assert place.title.endswith(", mean of 5, band 10 to 90 %")
    assert len(place.title) <= run_series.WIDEST
    assert each.shape[1:] == (5, 3)
    for k, axis in enumerate("xyz"):
        np.testing.assert_allclose(moved.lines[axis], each[:, :, k].mean(axis=1))
    assert "constrained_layout" not in "".join(str(one.message) for one in recwarn)


@pytest.mark.parametrize("flow", [True, False])
@pytest.mark.parametrize("share", [0.05, 0.5, 1.0, 3.0])
def test_a_row_is_as_high_as_what_is_in_it(flow, share):
    rows, heights = run_figure._rows((2.0, 2.0 * share), flow, True)
    assert sorted(sum(rows, ())) == sorted(["shapes", "path", "curvature", *(["flow"] if flow else [])])
    assert len(rows) == len(heights)
    wide = run_figure.LEFT / len(rows[0])
    assert run_figure.LOWEST <= heights[0] <= run_figure.HIGHEST
    if share == 0.5:
        assert heights[0] == pytest.approx(wide * share)


def test_options_of_the_plot_need_it(tmp_path, capsys):
    path = make_run(tmp_path / "made.h5")
    assert main(["show", str(path), "--shapes", "3"]) == 2
    assert "found without --plot" in capsys.readouterr().err
    assert main(["show", str(path), "--plot", str(tmp_path / "a.png"), "--from", "0.2", "--to", "0.8"]) == 0


def test_python_has_the_same_figure(tmp_path):
    with ibfil.open(make_run(tmp_path / "made.h5")) as run:
        assert run.plot(shapes=2, co_moving=True).png.startswith(b"\x89PNG")
        with pytest.raises(CaseError, match="colour: found a wish of that name; allowed: begin, end"):
            run.plot(colour="red")


# --- the README's first picture


def described(path: Path) -> str:
    from PIL import Image

    with Image.open(path) as picture:
        return str(picture.info.get("Description"))


def test_the_readmes_picture_has_the_panels_that_are_drawn_today(tmp_path):
    """On a coarse grid: the same times, panels, titles; the pixels are compared by the slow one."""
    case = ibfil.read_case("swimmer_stokes", ["fluid.cells=[32, 32, 32]", "time.step=2*pi/10/20"])
    ibfil.run(case, tmp_path / "coarse.h5")
    with RunFile(tmp_path / "coarse.h5") as run:
        assert described(SHOWN) == run_figure.told_of(run_figure.figure(run))


@pytest.mark.slow
def test_the_readmes_picture_is_drawn_by_the_present_code(tmp_path):
    from PIL import Image

    ibfil.run(ibfil.read_case("swimmer_stokes"), tmp_path / "swimmer.h5")
    with RunFile(tmp_path / "swimmer.h5") as run:
        run_figure.draw(run, tmp_path / "swimmer.png")
    now, kept = (np.asarray(Image.open(path).convert("L"), float) for path in (tmp_path / "swimmer.png", SHOWN))
    assert now.shape == kept.shape
    assert np.abs(now - kept).mean() < 1.0  # of 255: other versions of the letters' renderer, not other lines


def test_a_figure_is_laid_out_once_for_picture_and_pdf(tmp_path, monkeypatch):
    laid: list[object] = []
    real = ConstrainedLayoutEngine.execute
    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", lambda self, fig: laid.append(fig) or real(self, fig))
    fig = Figure(layout="constrained")
    axes = fig.subplots()
    axes.set_ylabel("a label\nthat needs room")
    save(fig, tmp_path / "a.png")
    assert len(laid) == 1
    assert axes.get_position().y1 > 0.95  # as by the engine, not 0.88 as without one
    assert {path.name for path in tmp_path.iterdir()} == {"a.png", "a.pdf"}
