"""A case that is played: its controls, its run, which is that of `ibfil run`, and the orders of a session."""

from __future__ import annotations

import json
import threading

import numpy as np
import pytest
from helpers.made_run import BENT

import ibfil
from ibfil.visualization.live import server
from ibfil.visualization.live.controls import controls
from ibfil.visualization.live.played import Played
from ibfil.visualization.live.session import Session
from ibfil.visualization.live.viewers import Viewer, Viewers

SEEN = '[observe.tip]\nkind = "position"\nat = "finish"\n'
THERMAL = '[thermal]\nenergy = 0.01\nseed = 3\n[observe.far]\nkind = "end_to_end"\n'


def bent(more: str = SEEN, **changes: object) -> ibfil.Case:
    return ibfil.parse_case(BENT + more, "bent.toml", {key.replace("__", "."): value for key, value in changes.items()})


# --- controls ---------------------------------------------------------------------------------------------------------


def test_numbers_formulas_words_and_switches_of_a_case_have_controls():
    overrides = {"time.end": "6*pi/10", "filament.swimmer.twisting": 1.0, "filament.swimmer.radius": 0.01}
    case = ibfil.read_case("swimmer_rft", overrides)
    found = {one.path: one for one in controls(case)}
    assert found["time.end"][2:4] == ("number", pytest.approx(0.6 * np.pi))
    assert found["filament.swimmer.nodes"][2:4] == ("whole", 64)
    assert found["filament.swimmer.curvature.0"][2:4] == ("formula", "8*sin(4*pi*s - 10*t)")
    assert found["filament.swimmer.curvature.1"][2:4] == ("number", 0.0)
    assert found["fluid.model"].kind == "word"
    assert set(found["fluid.model"].words) >= {"rft", "stokes"}
    assert found["observe.speed.over.1"].group == "observe.speed"
    assert "viscosity eta" in found["fluid.viscosity"].help
    assert not [path for path in found if path.split(".")[0] in ("title", "source", "expect") or path.endswith("kind")]


def test_what_names_a_parameter_stays_a_formula_and_parameters_come_first():
    every = controls(ibfil.read_case("cilia_row"))
    assert every[0].path.startswith("parameters.")
    found = {one.path: one for one in every}
    assert found["filament.cilium.copies.at.0"][2:4] == ("formula", "apart*i")
    assert found["fluid.box"].kind == "formula"


@pytest.mark.parametrize("name", ["bacterium_free", "nine_rods", "brownian_ring", "swimmer_re_10"])
def test_every_control_gives_its_value_back(name):
    """All controls at once, set to what they show, leave the case as it is."""
    case = ibfil.read_case(name)
    same = ibfil.read_case(case, {one.path: one.value for one in controls(case)})
    assert [one[:4] for one in controls(same)] == [one[:4] for one in controls(case)]


# --- the run that is played -------------------------------------------------------------------------------------------


class Cut(Exception):
    """Between two steps."""


@pytest.mark.parametrize("more", [SEEN, THERMAL], ids=["bent", "thermal"])
def test_a_played_run_is_the_run_to_the_bit_however_often_it_is_looked_at(more):
    case = bent(more)
    result = ibfil.run(case, progress=False, log=lambda line: None)
    played, rows, count = Played(case, "tension"), [], 0

    def after_step() -> None:
        nonlocal count
        count += 1
        played.picture()
        if count % 3 == 0:
            raise Cut

    while not played.done:
        try:
            row, reason = played.go_on(after_step)
        except Cut:
            continue
        assert reason == ""
        rows.append(row)
    assert [row["time"] for row in rows] == result.times.tolist()
    for name in rows[0]["values"]:
        np.testing.assert_array_equal([row["values"][name] for row in rows], result.series(name))
    for one in played.numbers():
        np.testing.assert_array_equal(one["value"], result.summaries[one["name"]].value)


def test_a_picture_has_places_strokes_and_quantities_of_the_present():
    case = ibfil.read_case("bacterium_free")
    played = Played(case, "speed")
    facts, picture = played.scene(), played.picture()
    time, steps = np.frombuffer(picture[:16], "<f8")
    numbers = np.frombuffer(picture[16:], "<f4")
    n, strokes = sum(facts["counts"]), facts["links"]
    assert (time, steps) == (0.0, 0.0)
    np.testing.assert_allclose(numbers[: 3 * n].reshape(n, 3), played.simulation.configuration.r[:n], atol=1e-6)
    ring = numbers[3 * n : 3 * n + 6 * strokes].reshape(strokes, 2, 3)
    radius = case.bodies["head"].shape.semi_axes[0]
    centre = played.simulation.snapshot().bodies["head"].position
    np.testing.assert_allclose(np.linalg.norm(ring - centre, axis=-1), radius, rtol=1e-5)
    names = [one["words"] for one in facts["quantities"]]
    assert names[0].startswith("speed")
    speed = np.linalg.norm(next(iter(played.simulation.snapshot().filaments.values())).velocity, axis=1)
    np.testing.assert_allclose(numbers[3 * n + 6 * strokes :].reshape(len(names), n)[0], speed, rtol=1e-5)


HEADS = """
[filament.tail]
length = 0.8
nodes = 9
bending = 1.0
twisting = 1.0
stretching = 1e3
radius = 0.02
position = [0.4, 0, 0]
anchor = "start"
start = { end = "body", body = "head" }
copies = { count = 5, at = [0.4, "0.7*i - 1.4", 0] }
[body.head]
shape = { kind = "file", path = "markers.csv" }
position = [0, 0, 0]
[fluid]
model = "stokes"
box = [4, 4, 4]
cells = [40, 40, 40]
viscosity = 1.3
[time]
end = 0.06
step = 0.02
[output]
every = 0.02
copies_every = 2
"""


def test_of_copies_with_heads_of_markers_those_that_are_written_are_shown_with_all_heads(tmp_path):
    markers = np.array([[0.2, 0, 0], [-0.2, 0, 0], [0, 0.2, 0], [0, -0.2, 0], [0, 0, 0.2], [0, 0, -0.2]])
    np.savetxt(tmp_path / "markers.csv", markers, delimiter=",", header="x,y,z", comments="")
    (tmp_path / "heads.toml").write_text(HEADS)
    played = Played(ibfil.read_case(tmp_path / "heads.toml"), "tension")
    facts = played.scene()
    assert facts["counts"] == [9, 9, 9]
    assert facts["quantities"][-1]["low"] == "tail_000"
    assert facts["quantities"][-1]["high"] == "tail_004"
    numbers = np.frombuffer(played.picture()[16:], "<f4")
    places, crosses = numbers[:81].reshape(3, 9, 3), numbers[81 : 81 + 6 * facts["links"]].reshape(-1, 2, 3)
    np.testing.assert_allclose(places[:, 0], [[0.4, 1.4 * k - 1.4, 0] for k in range(3)], atol=1e-6)
    middles = crosses.mean(axis=1).reshape(5, 3, 6, 3)
    for copy, arms in enumerate(middles):
        np.testing.assert_allclose(arms, [markers + np.array([0, 0.7 * copy - 1.4, 0])] * 3, atol=1e-6)
    while not played.done:
        played.go_on(lambda: None)
    assert len(played.picture()) == 16 + 4 * (81 + 6 * facts["links"] + 27 * (len(facts["quantities"]) - 1))


# --- a session --------------------------------------------------------------------------------------------------------


class Page:
    """A page without a browser: it keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[dict] = []
        self.pictures = 0

    def send(self, message: str | bytes) -> None:
        if isinstance(message, str):
            self.told.append(json.loads(message))
        else:
            self.pictures += 1

    def of(self, word: str) -> list:
        return [told[word] for told in self.told if word in told]


def play(case: ibfil.Case, *orders: dict) -> Page:
    """The page of a session that was asked these things, one after the other, and then played to its end."""
    page, viewers = Page(), Viewers()
    viewer = Viewer(page)
    session = Session(case, viewers, "tension")
    viewers.join(viewer)
    viewers.ask({"pace": 0})
    for order in orders:
        viewers.ask(order)
    looks = 0

    def stop() -> bool:
        nonlocal looks
        looks += 1
        return looks > 3 + len(orders) and session._ended != "" and not viewers.asked

    session.play(stop)
    viewer.tell('{"last": true}')
    sender = threading.Thread(target=viewer.serve)
    sender.start()
    while not page.of("last"):
        viewer.drawn()
    viewer.leave()
    sender.join()
    return page


def test_a_new_value_begins_again_and_its_case_is_what_runs():
    page = play(bent(), {"set": {"fluid.viscosity": 2.0}})
    scene = page.of("scene")[-1]
    result = ibfil.run(ibfil.parse_case(scene["casetext"], "played"), progress=False, log=lambda line: None)
    assert result.case.fluid.viscosity == 2.0
    assert page.of("ended") == ["finished"]
    rows = page.of("row")
    last = rows[-len(result.times) :]
    assert [row["time"] for row in last] == result.times.tolist()
    np.testing.assert_array_equal([row["values"]["tip"] for row in last], result.series("tip"))
    assert page.pictures > 0


@pytest.mark.parametrize(
    ("order", "told"),
    [
        ({"set": {"fluid.viscosity": -1}}, "fluid.viscosity: found -1; allowed: a number"),
        ({"key": "fluid.viscosty=2"}, "fluid.viscosty: found an unknown key"),
        ({"key": "time.end=__import__('os').system('touch owned')"}, "time.end: found"),
        ({"set": {"filament.rod.nodes": [1]}}, "filament.rod.nodes: found [1]"),
        ({"set": {"title": json.loads("[" * 900 + "]" * 900)}}, "maximum recursion depth"),
    ],
)
def test_a_bad_value_is_a_line_and_the_run_goes_on_as_it_was(order, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = play(bent(), order)
    faults = page.of("faults")
    assert len(faults) == 1
    assert faults[0][0].startswith(told)
    assert len(page.of("scene")) == 1
    assert page.of("ended") == ["finished"]
    assert not list(tmp_path.iterdir())


def test_a_run_that_fails_says_so_and_another_value_begins_again():
    page = play(bent(time__max_steps=3))
    failed = page.of("ended")[0]
    assert failed.startswith("failed\n")
    assert "time.max_steps" in failed
    page = play(bent(time__max_steps=3), {"set": {"time.max_steps": 1000}})
    assert page.of("ended")[-1] == "finished"


def test_strange_orders_do_nothing():
    strange = [{"set": 3}, {"pace": "x"}, {"pace": -1}, {"pace": 10**400}, {"run": 1}, {"key": 7}, {"again": 0}, {}]
    page = play(bent(), *strange)
    assert page.of("ended") == ["finished"]
    assert len(page.of("scene")) == 1
    assert server._order("[1]") == server._order("{") == server._order(b"\xff") == {}


def test_a_run_stands_still_while_nobody_looks():
    viewers = Viewers()
    session, looks = Session(bent(), viewers, "tension"), iter(range(5))
    session.play(lambda: next(looks) > 3)
    assert session._played.simulation.steps == 0
