"""The benchmark's pieces run and give numbers; how fast they are is never tested."""

import argparse
import json
import math
import subprocess
import sys

import pytest

from ibfil.bench import first_step, linked, many, members, parts, pieces, spaces, thermal, timing
from ibfil.commands import bench
from ibfil.errors import CaseError


@pytest.mark.parametrize(
    "rows",
    [
        lambda: [pieces.rft_step(16)],
        lambda: pieces.evaluations(16, (1.1, 0.5)),
        lambda: [pieces.table_pair("roma3", 1.0, 5)],
        lambda: [pieces.inertia(16), pieces.a_cell(pieces.inertia(16), 16), pieces.swimmer_step()],
        lambda: pieces.swimmers(end=1e-3),
        lambda: linked.linked(2, (1e9, None), nodes=8),
        lambda: [*spaces.tables(), *spaces.steps(11), spaces.wall_pairs("roma3", 3.0, 5)],
        lambda: spaces.transforms((9, 5, 4), 5),
        lambda: thermal.steps(9, 9),
    ],
)
def test_pieces_give_finite_positive_numbers(rows, monkeypatch):
    monkeypatch.setattr(timing, "_TURNS", 2)
    monkeypatch.setattr(timing, "_TOTAL", 0.0)
    for row in rows():
        assert math.isfinite(row.ratio)
        assert min(row.seconds, row.floor_seconds, row.ratio) > 0
        assert row.verdict in ("", "ok", "over")
        assert row.piece in timing.table([row])


def test_the_verdict_follows_the_bar():
    assert timing.Row("a", 2.0, "b", 1.0, 2.0, 1.9).verdict == "over"
    assert timing.Row("a", 2.0, "b", 1.0, 2.0, 2.1).verdict == "ok"
    assert timing.Row("a", 2.0, "b", 1.0, 2.0, None).verdict == ""


def test_many_filaments_and_threads_are_measured_in_processes_of_their_own(monkeypatch):
    told = {"seconds": 2e-6, "told": 3e8, "peak": 2.9e8, "products": 40.0, "halved": 0, "method": "krylov"}
    monkeypatch.setattr(many, "measured", lambda *scene: told)
    rows = parts.many(cells=(16,), steps=1)
    assert [row.bar for row in rows] == [3.0, 1.0, None] * 2
    assert rows[2].ratio == 2.9e8 / 3e8
    assert [row.bar for row in parts.million(1, ((2, 16), (4, 20)))] == [1.0, 1.0, 1.0]
    asked = [sys.executable, "-m", "ibfil.bench.many", "2", "8", "16", "1", "suspension"]
    found = json.loads(subprocess.run(asked, capture_output=True, check=True, text=True).stdout)
    assert 0 < found["seconds"] < found["peak"]
    assert found["method"] == "table"


def test_members_of_a_study_are_a_sweep_by_the_command(tmp_path):
    found = members.swept(2, 0.02, tmp_path / "sweep")
    assert found.steps == 4
    assert 0 < found.stepping < found.processor


def test_what_a_member_takes_is_told_beside_its_steps(monkeypatch):
    told = [members.Swept(9.0, 0.1, 5.0, 2), members.Swept(5.0, 0.1, 3.0, 2), members.Swept(115.0, 100.0, 60.0, 100000)]
    monkeypatch.setattr(members, "swept", lambda *scene: told.pop(0))
    whole, clock, _ = members.members(100)
    assert whole.ratio == pytest.approx((115 - 5) / 100 + 5 / 500)
    assert clock.ratio == pytest.approx(2 * 60 / 115)


def test_a_part_there_is_not_is_refused():
    with pytest.raises(CaseError, match=r"bench: found nope; allowed: pieces, spaces, start, thermal, swimmer"):
        parts.main(parts=["pieces", "nope"])


def test_json_is_json(monkeypatch, capsys):
    row = timing.Row("a", 2.0, "b", 1.0, 2.0, None)
    for name in ("rft_step", "table_pair", "table_of_a_swimmer", "inertia", "start_up"):
        monkeypatch.setattr(pieces, name, lambda *_, **__: row)
    monkeypatch.setattr(pieces, "evaluations", lambda *a: [row])
    monkeypatch.setattr(pieces, "swimmers", lambda: [row])
    assert parts.main(json=True) == 0
    assert json.loads(capsys.readouterr().out)[0]["ratio"] == 2.0


def test_help_names_every_part():
    command = argparse.ArgumentParser()
    bench.add(command)
    help_text = command.format_help()
    assert all(part in help_text for part in parts.PARTS)


def test_the_first_step_is_timed_in_processes_with_caches_of_their_own(monkeypatch):
    asked = []

    def run(words, cwd, env, **_):
        asked.append((tuple(words[2:4]), env["NUMBA_CACHE_DIR"], env["XDG_CACHE_HOME"]))
        assert env["NUMBA_CACHE_DIR"].startswith(cwd)

    monkeypatch.setattr(first_step.subprocess, "run", run)
    monkeypatch.setattr(first_step, "of_children", iter(range(22)).__next__)
    rows = first_step.first_step()
    assert [row.bar for row in rows] == [1.0, 1.0, None]
    assert [words for words, *_ in asked[:6]] == [("ibfil", "run")] * 6
    assert len({cache for _, *caches in asked for cache in caches}) == 1
