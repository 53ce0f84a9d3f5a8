"""Cases and runs from Python: what the command line takes, dicts, and what a notebook shows."""

from __future__ import annotations

import io
import pickle
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.fake_simulation import CASE, case
from helpers.runs import run

import ibfil
from ibfil.case.reading import differences
from ibfil.case.toml import load
from ibfil.observables.observers import Summary
from ibfil.running.progress import Progress


def test_a_dict_with_arrays_is_the_case_its_file_is():
    content = load(CASE)
    content["filament"]["rod"] |= {"nodes": np.int64(9), "position": np.array([0.5, 0.0, 0.0]), "radius": None}
    made = ibfil.read_case(content)
    text = CASE.replace("nodes = 9", "nodes = 9\nposition = [0.5, 0.0, 0.0]")
    assert differences(made, ibfil.parse_case(text, "x")) == {}
    assert ibfil.parse_case(made.text, made.file) == made


def test_overrides_from_python_are_those_of_the_command_line_and_are_recorded(tmp_path):
    words = ["time.end=0.5", "output.every=0.25", "filament.rod.length=2", "observe.moved=absent"]
    keys = {"time.end": np.float64(0.5), "output.every": 0.25, "filament.rod.length": 2, "observe.moved": None}
    assert ibfil.read_case(case(), keys).text == ibfil.read_case(case(), words).text
    path = tmp_path / "run.h5"
    result = run(case(), path, overrides=keys)
    with ibfil.open(path) as opened:
        assert (opened.case.time.end, opened.time[-1]) == (0.5, 0.5) == (result.case.time.end, result.times[-1])
    run(case(), path, overrides={"time.end": 1.0, **keys, "output.every": 0.5} | {"time.end": 1.0}, resume=True)
    with ibfil.open(path) as opened:
        assert np.array_equal(opened.time, [0.0, 0.25, 0.5, 1.0])


def test_a_case_with_other_values_has_them_in_its_text_and_the_old_one_stays(tmp_path):
    old = case()
    new = old.with_({"time.end": 0.5, "output.every": 0.25, "observe.moved": None})
    assert new.text == ibfil.read_case(old, ["time.end=0.5", "output.every=0.25", "observe.moved=absent"]).text
    assert (old.time.end, new.time.end, new.file) == (1.0, 0.5, old.file)
    run(new, tmp_path / "run.h5")
    with ibfil.open(tmp_path / "run.h5") as opened:
        assert differences(opened.case, new) == {}
        assert opened.time[-1] == 0.5
    assert pickle.loads(pickle.dumps(new)) == new
    with pytest.raises(ibfil.CaseError, match=r"time\.end: found -1"):
        old.with_({"time.end": -1})


def test_no_other_way_changes_what_runs_and_not_what_is_recorded():
    old = case()
    told = r"case\.with_\("
    for change in (lambda: old.model_copy(update={"title": "x"}), lambda: old.copy(update={"title": "x"})):
        with pytest.raises(TypeError, match=told):
            change()
    for table, key in ((old, "title"), (old.time, "end"), (old.filaments["rod"], "length")):
        with pytest.raises(AttributeError, match=told):
            setattr(table, key, 2.0)
    assert old.model_copy() == old


def test_shipped_names_are_cases():
    assert ibfil.read_case("swimmer_rft", {"time.end": 0.5}).time.end == 0.5
    with pytest.raises(ibfil.CaseError, match="no shipped case of that name; did you mean 'swimmer_rft'"):
        ibfil.read_case("swimmer_rtf")


@pytest.mark.parametrize(
    ("source", "keys", "told"),
    [
        (None, {"time.end": -1}, "time.end: found -1"),
        (None, {"time..end": 1}, 'found "time..end"; allowed: a dotted path'),
        (None, {"time.ed": 1}, 'did you mean "end"'),
        ({"title": object()}, {}, "case from Python: "),
        ({}, {}, "case from Python: filament: found nothing"),
    ],
)
def test_faults_are_lines(source, keys, told):
    with pytest.raises(ibfil.CaseError) as caught:
        ibfil.read_case(case() if source is None else source, keys)
    assert told in str(caught.value)


def test_what_is_there_is_kept_in_the_words_of_python(tmp_path):
    path = tmp_path / "run.h5"
    run(case(), path)
    with pytest.raises(ibfil.CaseError, match="exists already; overwrite=True writes over it"):
        run(case(), path)


def test_a_notebook_is_shown_lines_and_tables(tmp_path):
    path = tmp_path / "run.h5"
    result = run(case("", "title=a <b>"), path)
    assert repr(result.case) == "<Case fake.toml: a <b>; rod; fluid rft; t = 1>"
    for shown, word in ((result.case, "a &lt;b&gt;"), (result, "<td>moved</td>")):
        assert word in shown._repr_html_()
        assert "<b>" not in shown._repr_html_()
    assert repr(Summary(0.25, "seen until 1", error=0.1)) == "<0.25 +- 0.1; seen until 1>"
    with ibfil.open(path) as opened:
        assert repr(opened.summaries["moved"]).startswith("<")
        assert "moved" in opened._repr_html_()
        assert "<b>" not in opened._repr_html_()
        assert opened.plot().png.startswith(b"\x89PNG")
        assert opened.plot(tmp_path / "a.svg") == tmp_path / "a.svg"
        with pytest.raises(ibfil.CaseError, match=r"a\.svg: exists already; overwrite=True"):
            opened.plot(tmp_path / "a.svg")
        with pytest.raises(ibfil.CaseError, match=r"^color: found a wish of that name; allowed: colour"):
            opened.render(color="tension")
        with pytest.raises(ibfil.CaseError, match=r"^colour: found red; allowed: tension"):
            opened.render(colour="red")


def test_a_notebook_has_a_bar(monkeypatch):
    shell = type("ZMQInteractiveShell", (), {})()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    lines: list[str] = []
    bar = Progress(0.0, 2.0, lines.append, True)
    bar._bar.mininterval = 0.0
    bar.tell(1.0, 10)
    bar.close()
    assert " 50% |" in sys.stdout.getvalue()
    assert "t = 1 of 2" in sys.stdout.getvalue()
    assert lines == []
