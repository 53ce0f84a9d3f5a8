"""Pictures and films without a display: what is in the pixels, where the camera stands, and what is refused."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import BENT, make_run

import ibfil
from ibfil.analysis.run import open_run
from ibfil.case.reading import parse_case
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.visualization import annotations, render
from ibfil.visualization.annotations import Words, bands, lettered
from ibfil.visualization.camera import direction, turned, upwards, viewpoint
from ibfil.visualization.pictures import Pictures, Wish
from ibfil.visualization.quantities import Scale
from ibfil.visualization.stage import frame_for

SIZE = (320, 240)
draws = pytest.mark.skipif(
    not render.can_render(), reason=f"no off-screen rendering here ({render.PACKAGES}): pictures are not tested"
)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return make_run(tmp_path_factory.mktemp("made") / "made.h5")


def pixels(path: Path) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def coloured(picture: np.ndarray) -> np.ndarray:
    """Where the view (between the bands) is neither grey nor white, and not the axes at the lower left."""
    top, foot = bands(picture.shape[0])
    view = picture[top : picture.shape[0] - foot].copy()
    view[int(0.75 * len(view)) :, : view.shape[1] // 5] = 255
    return np.ptp(view, axis=-1) > 40


# --- where the camera stands ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_flat_motion_is_looked_at_across_its_plane(axis):
    r = np.random.default_rng(1).uniform(-1, 1, (4, 9, 3)) * [3.0, 1.5, 2.0]
    r[:, :, axis] = 0.7
    look = viewpoint([r])
    assert look.flat
    assert abs(look.towards[axis]) == 1.0
    assert look.centre[axis] == pytest.approx(0.7)
    right = np.cross(look.up, look.towards)
    assert np.ptp(r @ right) > np.ptp(r @ look.up)  # the longer reach lies across


def test_a_motion_in_space_is_looked_at_from_a_corner():
    look = viewpoint([np.random.default_rng(2).uniform(-1, 1, (4, 9, 3))])
    assert not look.flat
    assert np.all(np.abs(look.towards) > 0.1)
    basis = np.stack([np.cross(look.up, look.towards), look.up, look.towards])
    np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(basis), 1.0)


@pytest.mark.parametrize("size", [(400, 100), (100, 400)])
def test_all_positions_are_in_the_picture(size):
    r = np.random.default_rng(3).uniform(-1, 1, (4, 9, 3)) * [3, 1, 2]
    snapshot = frame_for(viewpoint([r]), [r], 0.2, size)
    away = r.reshape(-1, 3) - snapshot.look.centre
    assert np.abs(away @ snapshot.look.up).max() + 0.2 < snapshot.half
    assert np.abs(away @ snapshot.right).max() + 0.2 < snapshot.half * snapshot.aspect


# --- what is written --------------------------------------------------------------------------------------------------


def test_letters_stand_in_bands_of_their_own():
    view = np.full((192, 320, 3), 128, np.uint8)
    bars = (Scale("", "tension (pN)", "coolwarm", -1.0, 1.0), Scale("", "speed", "Greys", 0.0, 2.0))
    page = lettered(view, 240, Words("A title that is far too long for one line of the picture", bars, "um", 0.01), "t")
    top, foot = bands(240)
    assert page.shape == (240, 320, 3)
    assert np.all(page[top : 240 - foot] == 128)
    assert (page[:top] < 100).any()
    assert (page[240 - foot :] < 100).any()


def test_a_note_that_is_too_long_goes_on_in_a_line_above():
    view, heights = np.full((192, 320, 3), 128, np.uint8), []
    parts = ["links: the darker the larger", "axes of bodies: first red", "drawn wider"]
    for note in (parts[0], "; ".join(3 * parts)):
        page = lettered(view, 240, Words("", (), "um", 0.01, note), "t")
        inked = (page[bands(240)[0] : -bands(240)[1]] != 128).any(axis=2)
        assert not inked[:, :4].any()
        heights.append(np.count_nonzero(inked.any(axis=1)))
    assert heights[1] > 1.5 * heights[0]


# --- pictures ---------------------------------------------------------------------------------------------------------


@draws
def test_a_picture_shows_two_tubes_where_they_are(run, tmp_path):
    """Two rods along x that glide along y, 1 apart along z; the camera has seen all times, and looks from a corner."""
    seen = []
    for time in (0.0, 1.0):
        path = render.render(run, tmp_path / f"at_{time}.png", Wish("arclength", time=time, size=SIZE))
        picture = pixels(path)
        assert picture.shape == (240, 320, 3)
        rows, columns = np.nonzero(coloured(picture))
        assert len(rows) > 300
        seen.append((rows.mean(), columns.mean()))
    with open_run(run) as opened:
        positions = [np.asarray(c["position"]) for c in opened.filaments.values()]
        top, foot = bands(240)
        snapshot = frame_for(viewpoint(positions), positions, 0.28, (320, 240 - top - foot))
    # 3 along y is so many pixels right and up; the tubes' pixels have moved by that.
    scale = (240 - top - foot) / (2 * snapshot.half)
    moved = np.array([0.0, 3.0, 0.0])
    expected = -scale * (moved @ snapshot.look.up), scale * (moved @ snapshot.right)
    found = seen[1][0] - seen[0][0], seen[1][1] - seen[0][1]
    np.testing.assert_allclose(found, expected, atol=12)


@draws
@pytest.mark.parametrize("flow", ["slice", "glyphs", "streamlines"])
def test_the_flow_is_drawn(run, tmp_path, flow, monkeypatch):
    """The made run has no forces that make its made flow, so the recorded field is read here."""
    from ibfil.analysis import flow as flows

    monkeypatch.setattr(flows, "FlowOfForces", lambda opened, fluid: flows.FlowOfField(opened, opened.grid))
    bare, full = tmp_path / "bare.png", tmp_path / "full.png"
    render.render(run, bare, Wish(time=0.5, size=SIZE))
    render.render(run, full, Wish(flow=flow, time=0.5, size=SIZE))
    differing = np.any(pixels(bare) != pixels(full), axis=-1)
    top, foot = bands(240)
    assert differing[top:-foot].mean() > 0.02


@draws
def test_a_montage_has_the_colours_of_its_times(run, tmp_path):
    picture = pixels(render.render(run, tmp_path / "m.png", Wish(montage=5, size=SIZE)))
    shown = picture[bands(240)[0] : -bands(240)[1]][coloured(picture)]
    assert (shown[:, 2] > shown[:, 1] + 30).any()  # viridis: dark violet at first ...
    assert (shown[:, 1] > shown[:, 2] + 30).any()  # ... yellow green at last


@draws
@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_film_has_a_picture_for_each_output(run, tmp_path, ending):
    imageio = pytest.importorskip("imageio.v2", reason="imageio is not installed: films are not tested")
    path = tmp_path / f"film.{ending}"
    render.render(run, path, Wish(size=SIZE, fps=5.0), log=str)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    snapshots = list(imageio.get_reader(path).iter_data())
    assert len(snapshots) == 5
    assert snapshots[0].shape[:2] == (240, 320)
    assert np.abs(snapshots[0].astype(int) - snapshots[-1]).max() > 100


def made_pictures(run: Path, wish: Wish, shown: list[int]) -> Pictures:
    render.can_render()
    return Pictures(open_run(run), wish._replace(size=SIZE), shown)


@draws
def test_colours_of_the_flow_are_those_of_the_field_that_is_shown(tmp_path, monkeypatch):
    """A held rod in a uniform stream: it does not move, and all is one grey, black by the rods' own speed."""
    from ibfil.analysis.run import Run

    path = make_run(tmp_path / "held.h5")
    monkeypatch.setattr(Run, "velocity_at", lambda self, points, time=None: np.tile([0.0, 0.0, 7.0], (len(points), 1)))
    pictures = made_pictures(path, Wish(flow="slice"), [4])
    assert pictures.fastest == 7.0
    assert (pictures.words.bars[1].low, pictures.words.bars[1].high) == (0.0, 7.0)
    pictures.close()


@draws
def test_a_scale_is_of_the_run_of_the_last_picture_or_given_and_marks_what_is_beyond(run):
    """Positions along y go from 0 to 3 in the run, of which the last picture has the end."""
    found = {}
    for limits in ("run", "last", (1.0, 2.0)):
        pictures = made_pictures(run, Wish("position.y", range=limits), [2])
        found[limits] = pictures.scale
        pictures.close()
    assert found["run"].low < 0.2
    assert found["run"].high > 2.8
    assert found["last"][3:7] == (0.5, 2.5, False, False)  # all at 1.5: a range about it
    assert found[1.0, 2.0][3:7] == (1.0, 2.0, True, True)
    assert [text for _, text in annotations._marks(found[1.0, 2.0])] == ["\u2264 1", "1.5", "\u2265 2"]


@draws
def test_filaments_have_their_own_colours_and_names(run, tmp_path):
    pictures = made_pictures(run, Wish("filament"), [0])
    assert [text for _, text in annotations._marks(pictures.scale)] == ["long", "short"]
    picture = pictures.one(0).astype(int)
    for red, green, blue in ((0, 114, 178), (213, 94, 0)):  # of Okabe and Ito, under lights
        near = np.abs(picture - [red, green, blue]).max(axis=-1) < 50
        assert near[20:-40].sum() > 100
    pictures.close()


@draws
def test_a_thin_rod_is_as_wide_as_can_be_seen_and_a_note_says_so(tmp_path):
    """Radius 1e-4 of the length: by itself less than a tenth of a pixel."""
    text = BENT.replace("nodes = 9", "nodes = 9\nradius = 1e-4").replace("end = 0.02", "end = 0.005")
    ibfil.run(parse_case(text, "thin"), tmp_path / "thin.h5")
    pictures = made_pictures(tmp_path / "thin.h5", Wish("arclength"), [1])
    assert "rods drawn 2.5 pixels wide where they are thinner" in pictures.words.note
    shown = coloured(pictures.one(1).astype(int))
    pictures.close()
    columns = shown.any(axis=0)
    assert columns.mean() > 0.6  # an unbroken line across the picture
    assert 1.2 < shown.sum() / columns.sum() < 5.0


@draws
def test_the_camera_follows_a_filament(run):
    """`short` glides 3 along y, and stays where it is in the picture."""
    pictures = made_pictures(run, Wish("filament", follow="short"), [0, 4])
    middles = []
    for output in (0, 4):
        picture = pictures.one(output).astype(int)
        own = np.abs(picture - [213, 94, 0]).max(axis=-1) < 60
        own[-40:] = False
        middles.append(np.argwhere(own).mean(axis=0))
    pictures.close()
    np.testing.assert_allclose(middles[0], middles[1], atol=3)


@draws
def test_the_box_and_what_is_brought_into_it(run):
    """Wrapped ones lie within the box, whose corners the camera has: the view does not depend on how far they went."""
    wrapped, plain = made_pictures(run, Wish(wrap=True, box=True), [4]), made_pictures(run, Wish(), [4])
    assert wrapped.stage._mesh(4).points[:, 1].max() <= 1.0 + 1e-6
    assert plain.stage._mesh(4).points[:, 1].max() > 2.0
    assert {"box"} <= set(wrapped.stage._plotter.actors)
    for pictures in (wrapped, plain):
        pictures.close()


def test_up_is_off_a_wall_and_against_weight():
    rod = BENT.replace("[fluid]", "[filament.rod.loads]\nweight = [0, -2.0, 0]\n[fluid]")
    np.testing.assert_allclose(upwards(parse_case(rod, "heavy")), [0, 1, 0])
    np.testing.assert_allclose(upwards(ibfil.read_case("cilia_row")), [0, 0, 1])
    assert upwards(parse_case(BENT, "bent")) is None


@pytest.mark.parametrize(("view", "up"), [("x", "y"), ("-z", "x"), ("1,1,1", "z"), ((0, 2, 0), (1, 0, 0))])
def test_the_camera_is_put_where_it_is_asked_to_be(view, up):
    look = viewpoint([np.random.default_rng(2).uniform(-1, 1, (4, 9, 3))])
    a, b = direction("--view", view), direction("--up", up)
    got = turned(look, a, b, None)
    np.testing.assert_allclose(got.towards, a)
    assert got.up @ b > 0.5
    assert abs(got.up @ got.towards) < 1e-12


def test_a_scene_is_not_looked_at_from_below():
    look = viewpoint([np.random.default_rng(2).uniform(-1, 1, (4, 9, 3))])
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        got = turned(look, None, None, way)
        assert got.towards @ way > 0
        assert got.up @ way > 0


def test_a_film_tells_how_long_it_will_take(tmp_path):
    pytest.importorskip("imageio.v2", reason="imageio is not installed: films are not tested")
    told: list[str] = []
    still = (np.zeros((160, 160, 3), np.uint8) for _ in range(3))
    render._save_film(tmp_path / "a.gif", still, 5.0, 3, told.append)
    assert re.search(r"1 of 3 pictures, .* left$", told[0])
    assert told[-1].endswith("3 of 3 pictures")


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "wish", "told"),
    [
        ("film.avi", Wish(), "found a name that ends in .avi; allowed: .png, .mp4, .gif"),
        ("film", Wish(), "ends in nothing"),
        ("a.png", Wish(colour="taste"), "--colour: found taste; allowed: tension, moment"),
        ("a.png", Wish(flow="smoke"), "--flow: found smoke"),  # type: ignore[arg-type]
        ("a.png", Wish(size=(321, 240)), "--size: found 321x240"),
        ("a.png", Wish(size=(32000, 24000)), "--size: found 32000x24000"),
        ("a.mp4", Wish(montage=5), "--montage, --time: found with a film"),
        ("a.png", Wish(montage=-1), "--montage: found -1"),
        ("a.png", Wish(view="up"), "--view: found up; allowed: x, y, z, -x"),
        ("a.png", Wish(up=(0, 0, 0)), "--up: found"),
        ("a.png", Wish(view="z", up="-z"), "--view, --up: found directions along one line"),
        ("a.png", Wish(zoom=0.0), "--zoom: found 0"),
        ("a.png", Wish(follow="tall"), "--follow: found tall; allowed: long, short"),
        ("a.png", Wish(follow="long", wrap=True), "--follow: found with --wrap"),
        ("a.png", Wish(range="2,1"), "--range: found 2,1; allowed: run, last, or LOW,HIGH"),
        ("a.gif", Wish(fps=0.0), "--fps, --every: found 0, 1"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(run, tmp_path, name, wish, told):
    with pytest.raises(CaseError) as caught:
        render.render(run, tmp_path / name, wish)
    (line,) = caught.value.faults
    assert told in line
    assert not list(tmp_path.iterdir())


def test_where_rendering_crashes_the_packages_are_named(run, tmp_path, monkeypatch, capsys):
    """The probe dies as vtk does without its libraries; this process does not."""
    monkeypatch.setattr(render, "_PROBE", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    assert main(["render", str(run), "-o", str(tmp_path / "a.png")]) == 2
    told = capsys.readouterr().err
    assert len(told.splitlines()) == 1
    assert "install the Debian packages libegl1 and libgl1-mesa-dri" in told
    assert not list(tmp_path.iterdir())


@draws
def test_a_film_without_its_encoder_says_what_to_install(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio", None)
    with pytest.raises(CaseError, match=r"films need imageio and imageio-ffmpeg: pip install 'ibfil\[film\]'"):
        render.render(run, tmp_path / "film.mp4", Wish(size=SIZE))
    assert not list(tmp_path.iterdir())


@draws
def test_there_is_no_flow_under_rft(tmp_path):
    from helpers.fake_simulation import case
    from helpers.runs import run as run_fake

    run_fake(case("", "time.end=0.1"), tmp_path / "rft.h5")
    with pytest.raises(CaseError, match=r'fluid\.model: found "rft"'):
        render.render(tmp_path / "rft.h5", tmp_path / "a.png", Wish(flow="slice"))


@draws
def test_the_command_draws(run, tmp_path):
    command = [sys.executable, "-m", "ibfil", "render", run, "-o", "a.png", "--size", "320x240", "--colour", "speed"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=300, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "a.png\n", "")
    assert (tmp_path / "a.png").is_file()
