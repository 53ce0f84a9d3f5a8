"""The page of a played case: it is for who has the token on this machine; a browser plays it."""

from __future__ import annotations

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import BROWSER, Tab
from helpers.made_run import BENT
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import ibfil
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation
from ibfil.visualization.live.live import live

browses = pytest.mark.skipif(BROWSER is None, reason="no Chromium here: the page is served, and opened in no browser")
BENT_BY = "filament.swimmer.curvature.0"
HOSTILE = '</script><script>document.title="owned"</script><img src=x onerror=alert(1)> & "quotes"'


def bent(**changes: object) -> ibfil.Case:
    return ibfil.parse_case(BENT, "bent.toml", changes)


# --- its server -------------------------------------------------------------------------------------------------------


@contextmanager
def served(case: ibfil.Case):
    """The address of a case that is played."""
    said, end = queue.Queue(), threading.Event()
    thread = threading.Thread(target=live, args=(case,), kwargs={"log": said.put, "stop": end.is_set})
    thread.start()
    try:
        yield re.search(r"open (\S+)", said.get(timeout=120)).group(1)
    finally:
        end.set()
        thread.join(30)
    assert not thread.is_alive()
    assert said.get() == "ended; nothing was written"


def test_the_page_and_the_line_are_for_who_has_the_token_on_this_machine():
    with served(bent()) as address:
        base, token = address.split("?token=")
        assert base.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(address) as answer:
            page = answer.read().decode()
            assert "text/html" in answer.headers["Content-Type"]
        assert token not in page
        for path, status in (("", 403), ("?token=x", 403), ("line", 403), (f"else?token={token}", 404)):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(base + path)
            assert refused.value.code == status
            refused.value.close()
        line = base.replace("http", "ws") + "line"
        with pytest.raises(InvalidStatus):
            connect(line)
        with pytest.raises(InvalidStatus):
            connect(f"{line}?token={token}", origin="https://example.org")
        with connect(f"{line}?token={token}", origin="http://localhost:9999") as mine:
            assert "scene" in json.loads(mine.recv(timeout=30))


def test_words_of_a_case_are_no_markup_and_nothing_comes_from_outside():
    with served(bent(title=HOSTILE)) as address, urllib.request.urlopen(address) as answer:
        page = answer.read().decode()
    assert page.count("<script") == page.count("</script>") == 2
    assert "<img" not in page
    page = page.replace("img src=x", "")  # which stands there as text
    assert not re.search(r"(src|href)\s*=|https?://|//[a-z]+\.|@import|url\(|fetch\(|XMLHttp|innerHTML|eval\(", page)
    assert "default-src 'none'" in page


def test_another_colour_a_taken_port_and_a_missing_library_are_one_line(monkeypatch):
    with pytest.raises(CaseError, match="--colour: found taste; allowed: tension"):
        live(bent(), colour="taste")
    with served(bent()) as address, pytest.raises(CaseError, match=r"--port: found \d+, which is taken; allowed"):
        live(bent(), port=int(re.search(r":(\d+)/", address).group(1)), log=str)
    monkeypatch.setitem(sys.modules, "websockets.sync.server", None)
    with pytest.raises(CaseError, match=r"pip install 'ibfil\[web\]'"):
        live(bent(), log=str)


def test_ctrl_c_ends_it(tmp_path):
    (tmp_path / "bent.toml").write_text(BENT)
    words = [sys.executable, "-m", "ibfil", "live", "bent.toml", "time.end=9"]
    environment = os.environ | {"PYTHONPATH": str(Path(ibfil.__file__).parents[1]), "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True)
    address = next(line.split()[1] for line in process.stdout if line.startswith("open "))
    with connect(address.replace("http", "ws").replace("/?", "/line?"), origin="http://127.0.0.1") as line:
        assert "scene" in json.loads(line.recv(timeout=30))
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0
    assert process.stdout.read().endswith("ended; nothing was written\n")
    process.stdout.close()
    assert [path.name for path in tmp_path.iterdir()] == ["bent.toml"]


# --- in a browser -----------------------------------------------------------------------------------------------------


def slide(tab: Tab, name: str, share: float) -> None:
    """Move the slider of that name to a share of its way."""
    tab.value(
        f"""(() => {{ const one = document.querySelector('[aria-label="{name}"]');
        one.value = {share} * one.max; one.dispatchEvent(new Event("input")); }})()"""
    )


@browses
def test_a_browser_plays_the_swimmer_and_a_slider_bends_it(tmp_path):
    with served(ibfil.read_case("swimmer_rft")) as address, Tab(tmp_path / "profile") as tab:
        tab.go(address)
        tab.until("Number(canvas.dataset.pictures) >= 10")
        assert tab.value("now.time") > 0
        tab.value('part("play").click(); part("again").click()')  # from the start, where it then is told to run
        tab.until("canvas.dataset.time > 0")
        tab.value('part("play").click()')
        tab.until('part("play").textContent === "Run"')
        tab.value('send({key: "filament.swimmer.nodes=65"})')  # a new scene stands at its start, for it is paused
        tab.until("run.counts[0] === 65 && now !== null && now.time === 0")
        before = (tab.until("Array.from(now.places)"), tab.picture())
        assert tab.value('part("status").textContent') == ""
        slide(tab, f"{BENT_BY}, number 1", 0.5)  # 8 -> 12: of the 24 at its end
        tab.until('run.casetext.includes("12*sin(4*pi*s - 10*t)") && now !== null')
        after = (tab.until("Array.from(now.places)"), tab.picture())
        case = ibfil.parse_case(tab.value("run.casetext"), "played")
        for places, one in ((before[0], ibfil.read_case(case, {BENT_BY: "8*sin(4*pi*s - 10*t)"})), (after[0], case)):
            np.testing.assert_allclose(np.reshape(places, (-1, 3)), Simulation(one).configuration.r, atol=1e-6)
        assert np.ptp(np.reshape(after[0], (-1, 3))[:, 1]) > 1.2 * np.ptp(np.reshape(before[0], (-1, 3))[:, 1])
        assert before[1] != after[1]
        tab.value("send({set: {'fluid.viscosity': 0}})")
        assert "fluid.viscosity: found 0; allowed" in tab.until('part("fault").textContent')
        assert tab.value('document.querySelectorAll(".bad").length') == 1
        tab.value('part("play").click()')
        tab.until("now.time > 0")
        assert tab.faults == []


@browses
def test_a_browser_takes_hostile_words_as_text(tmp_path):
    with served(bent(title=HOSTILE)) as address, Tab(tmp_path / "profile") as tab:
        tab.go(address)
        tab.until("Number(canvas.dataset.pictures) >= 1")
        assert "owned" in tab.value("document.title")
        assert tab.value("document.title") != "owned"
        assert tab.value('part("title").textContent') == HOSTILE
        assert tab.value('document.querySelectorAll("img").length') == 0


@browses
def test_a_scene_that_begins_before_a_picture_is_drawn_gets_its_own_pictures(tmp_path):
    """The page says that it has drawn a picture in any case: the next one waits for that."""
    with served(ibfil.read_case("swimmer_rft")) as address, Tab(tmp_path / "profile") as tab:
        tab.go(address)
        tab.until("Number(canvas.dataset.pictures) >= 1")
        tab.value('part("play").click()')
        tab.until("now !== null && !waiting")
        tab.value("picture(now.places.buffer); scene(run)")
        tab.until("!waiting")
        tab.value('part("play").click()')
        tab.until("now !== null && canvas.dataset.pictures > 1 && !waiting")
        assert tab.faults == []


@browses
def test_the_scale_of_colours_is_what_has_been_shown(tmp_path):
    """Nothing before there is a finite value; one end twice where all are equal, in the middle of the colours."""
    with served(bent()) as address, Tab(tmp_path / "profile") as tab:
        tab.go(address)
        tab.until("Number(canvas.dataset.pictures) >= 1")
        ends = "(signed, ...all) => { const q = { signed }; all.forEach((one) => widen(q, one)); return q.ends; }"
        for signed, pictures, found in (
            ("false", "[NaN]", None),
            ("false", "[NaN], [2, 3], [1, NaN]", [1, 3]),
            ("false", "[0, 0]", [0, 0]),
            ("false", "[0, 0], [1, 2]", [0, 2]),
            ("true", "[1, -3], [2]", [-3, 3]),
        ):
            assert tab.value(f"({ends})({signed}, {pictures})") == found
        tab.value('part("play").click()')
        same = "run.quantities[state.quantity].ends = [5, 5], now.values[state.quantity].fill(5), share(0)"
        assert tab.value(same) == 128
        assert tab.faults == []
