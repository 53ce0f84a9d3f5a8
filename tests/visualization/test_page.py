"""The page of a run: one file, nothing from outside, hostile words as text; a browser shows it."""

from __future__ import annotations

import base64
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import BROWSER
from helpers.linked_scenes import ASKEW, LINKS, linked
from helpers.made_run import BENT, make_run

import ibfil
from ibfil.analysis.run import open_run
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.visualization.web.page import write_page

browses = pytest.mark.skipif(BROWSER is None, reason="no Chromium here: pages are parsed, and opened in no browser")
HOSTILE = '</script><script>document.title="owned"</script><img src=x onerror=alert(1)> & "quotes"'


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return make_run(tmp_path_factory.mktemp("made") / "made.h5")


def data_of(page: Path) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.read_text(), re.S)
    return json.loads(found.group(1))


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


# --- what is in it ----------------------------------------------------------------------------------------------------


def test_places_radii_and_times_are_those_of_the_run(run, tmp_path):
    page = write_page(run, tmp_path / "a.html", log=str)
    data = data_of(page)
    with open_run(run) as opened:
        every = np.concatenate([np.asarray(c["position"]) for c in opened.filaments.values()], axis=1)
        np.testing.assert_array_equal(data["times"], opened.time)
        radius = opened.mesh()["tube_radius"]
    share = unpacked(data["positions"], "<u2").reshape(every.shape) / 65535
    places = np.array(data["low"]) + share * np.array(data["span"])
    np.testing.assert_allclose(places, every, atol=0.51 / 65535 * np.max(data["span"]))
    np.testing.assert_allclose(unpacked(data["radius"], "<f4"), radius)
    assert data["counts"] == [9, 7]
    assert data["lengthunit"] == " um"


def test_the_flow_is_the_recorded_field_where_it_lies(run, tmp_path):
    data = data_of(write_page(run, tmp_path / "a.html", log=str))["flow"]
    with open_run(run) as opened:
        grid = opened.grid
        n, m = data["shape"]
        speed = unpacked(data["speed"], "u1").reshape(len(data["times"]), m, n)
        k = round((data["origin"][2] - grid.origin[2]) / grid.spacing[2])
        u = grid.fields["velocity"][-1][:, :, k]
        np.testing.assert_array_equal(data["times"], np.asarray(grid.time))
        np.testing.assert_allclose(data["first"][0] / n, grid.spacing[0])
        np.testing.assert_allclose(np.array(data["origin"][:2]) + 0.5 * grid.spacing[:2], grid.origin[:2])
    size = np.linalg.norm(u, axis=-1).T
    most = float(re.search(r"up to ([\d.e+-]+)", data["words"]).group(1))
    np.testing.assert_allclose(speed[-1] / 255 * most, size, atol=0.01 * most)
    arrows = unpacked(data["arrows"], "i1").reshape(-1, m, n, 2)[-1] / 127
    flat = np.linalg.norm(u[..., :2], axis=-1).T[..., None]
    np.testing.assert_allclose(arrows * flat, u[..., :2].swapaxes(0, 1), atol=0.01 * most)


def test_links_are_in_it_from_end_to_end(tmp_path):
    text = linked(ASKEW, {"spring": LINKS["spring"]}, end=0.04, every=0.02).text
    ibfil.run(ibfil.parse_case(text, "linked"), tmp_path / "linked.h5")
    data = data_of(write_page(tmp_path / "linked.h5", tmp_path / "a.html", log=str))
    with open_run(tmp_path / "linked.h5") as opened:
        link = opened.links["spring"]
        ends = np.stack([np.asarray(link["first"]), np.asarray(link["second"])], axis=2)
    assert data["links"] == ends.shape[1]
    assert data["linewords"] == "lines: links"
    share = unpacked(data["linked"], "<u2").reshape(ends.shape) / 65535
    places = np.array(data["low"]) + share * np.array(data["span"])
    np.testing.assert_allclose(places, ends, atol=0.51 / 65535 * np.max(data["span"]))


def test_its_size_is_bounded_and_told(tmp_path):
    """1001 outputs of 9 nodes: all by themselves, and evenly some of them, from first to last, below a bound."""
    text = BENT.replace("every = 0.005", "every = 2e-5").replace("step = 1e-3", "step = 2e-5")
    ibfil.run(ibfil.parse_case(text, "many"), tmp_path / "many.h5")
    told: list[str] = []
    whole = write_page(tmp_path / "many.h5", tmp_path / "whole.html", log=told.append)
    small = write_page(tmp_path / "many.h5", tmp_path / "small.html", most=0.1, log=told.append)
    assert "1001 of 1001 outputs, 0." in told[0]
    assert re.search(r"small.html: \d+ of 1001 outputs, evenly; --most MB for more, 0.1 MB", told[1])
    assert small.stat().st_size < 0.1e6 < whole.stat().st_size
    times = data_of(small)["times"]
    assert (times[0], times[-1]) == (0.0, 0.02)
    assert np.ptp(np.diff(times)) < 3e-5


def test_nothing_comes_from_outside_and_words_are_no_markup(tmp_path):
    case = BENT.replace('"A bent rod straightens"', f"'''{HOSTILE}'''")
    ibfil.run(ibfil.parse_case(case, "hostile"), tmp_path / "hostile.h5")
    page = write_page(tmp_path / "hostile.h5", tmp_path / "hostile.html", log=str)
    text = page.read_text()
    assert data_of(page)["title"] == HOSTILE
    assert text.count("<script") == text.count("</script>") == 2
    assert "<img" not in text
    text = text.replace(json.dumps(HOSTILE)[1:-1], "").replace("img src=x", "")  # which stands there as text
    assert not re.search(r"(src|href)\s*=|https?:|//[a-z]+\.|@import|url\(|fetch\(|XMLHttp|innerHTML", text)
    assert "default-src 'none'" in text


# --- what is refused --------------------------------------------------------------------------------------------------


def test_what_cannot_be_had_is_one_line(run, tmp_path):
    for output, more, told in (
        ("a.htm", {}, "does not end in .html"),
        ("a.html", {"colour": "taste"}, "--colour: found taste; allowed: tension"),
        ("a.html", {"most": 0.0}, "--most: found 0; allowed"),
    ):
        with pytest.raises(CaseError, match=re.escape(told)):
            write_page(run, tmp_path / output, log=str, **more)
    assert not list(tmp_path.iterdir())


def test_a_page_is_written_over_with_force_only_and_another_file_never(run, tmp_path, capsys):
    own, other = tmp_path / "own.html", tmp_path / "other.html"
    other.write_text("<p>mine</p>")
    assert main(["page", str(run), "-o", str(own)]) == 0
    assert main(["page", str(run), "-o", str(own)]) == 2
    assert main(["page", str(run), "-o", str(own), "--force", "--colour", "filament"]) == 0
    assert main(["page", str(run), "-o", str(other), "--force"]) == 2
    assert other.read_text() == "<p>mine</p>"
    assert "--force" in capsys.readouterr().err


def test_python_has_pages(run, tmp_path):
    with ibfil.open(run) as opened:
        assert opened.page(tmp_path / "a.html", colour="speed") == tmp_path / "a.html"
    assert data_of(tmp_path / "a.html")["quantities"][0]["words"].startswith("speed")


# --- in a browser -----------------------------------------------------------------------------------------------------


def browse(page: Path, *more: str) -> subprocess.CompletedProcess:
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=800,600"]
    profile = f"--user-data-dir={page.parent / 'profile'}"
    words = [*command, profile, "--virtual-time-budget=2000", *more, page.as_uri()]
    return subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)


def done_by_hand(page: Path, script: str) -> str:
    """The document after a script of a user's hands has been played on the page."""
    played = page.with_name("played.html")
    played.write_text(page.read_text().replace("</body>", f"<script>{script}</script></body>"))
    return browse(played, "--dump-dom").stdout


@browses
def test_a_browser_turns_it_and_goes_through_its_times(run, tmp_path):
    page = write_page(run, tmp_path / "a.html", log=str)
    still = done_by_hand(page, "")
    assert 'data-output="4"' in still
    assert ">time 1 s<" in still
    hands = """
    const go = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, {clientX: x, clientY: y, bubbles: true}));
    go("pointerdown", 100, 100); go("pointermove", 200, 130); go("pointerup", 200, 130);
    canvas.dispatchEvent(new WheelEvent("wheel", {deltaY: -400, cancelable: true}));
    const slider = document.getElementById("slider");
    slider.value = 1; slider.dispatchEvent(new Event("input"));
    """
    moved = done_by_hand(page, hands)
    assert 'data-output="1"' in moved
    assert ">time 0.25 s<" in moved
    before, after = (
        [float(x) for x in re.search(r'data-towards="([^"]*)"', dom).group(1).split(",")] for dom in (still, moved)
    )
    angle = np.arccos(np.clip(np.dot(before, after), -1, 1))
    assert angle == pytest.approx(np.arccos(np.cos(0.8) * np.cos(0.24)), abs=0.01)  # 0.008 a pixel
    assert float(re.search(r'data-zoom="([^"]*)"', moved).group(1)) == pytest.approx(np.exp(0.6), abs=1e-3)


@browses
def test_a_browser_draws_the_rods_where_they_are(run, tmp_path):
    """The two filaments in their own colours, as far apart as their centroids are in the picture."""
    from PIL import Image

    page = write_page(run, tmp_path / "a.html", colour="filament", log=str)
    played = tmp_path / "front.html"
    hands = 'document.getElementById("flow").checked = false; view("x");'
    played.write_text(page.read_text().replace("</body>", f"<script>{hands}</script></body>"))
    browse(played, f"--screenshot={tmp_path / 'front.png'}")
    picture = np.asarray(Image.open(tmp_path / "front.png").convert("RGB")).astype(float)[60:480, 100:]
    hue = picture / np.maximum(np.linalg.norm(picture, axis=-1, keepdims=True), 1)
    middles = {}
    for number, colour in enumerate(((0, 114, 178), (213, 94, 0))):
        near = (hue @ (np.array(colour) / np.linalg.norm(colour)) > 0.995) & (np.ptp(picture, axis=-1) > 60)
        assert near.sum() > 100
        middles[number] = np.argwhere(near).mean(axis=0)
    with open_run(run) as opened:
        long, short = (np.asarray(c["position"][-1]).mean(axis=0) for c in opened.filaments.values())
    apart = middles[1] - middles[0]  # down, and right
    way = short - long  # from x: y to the right, z upwards
    assert np.linalg.norm(way[1:]) > 0.3
    cosine = (apart @ [-way[2], way[1]]) / np.linalg.norm(apart) / np.linalg.norm(way[1:])
    assert cosine > 0.98


@browses
def test_a_browser_takes_hostile_words_as_text(tmp_path):
    case = BENT.replace('"A bent rod straightens"', f"'''{HOSTILE}'''")
    ibfil.run(ibfil.parse_case(case, "hostile"), tmp_path / "hostile.h5")
    page = write_page(tmp_path / "hostile.h5", tmp_path / "hostile.html", log=str)
    dom = browse(page, "--dump-dom").stdout
    assert "<title>owned" not in dom
    assert '<header id="title">&lt;/script&gt;&lt;script&gt;' in dom
    assert "<img" not in dom
