"""`ibfil sweep`: combinations of any keys, a table of all observables, a job array; and what studies share."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.made_run import BENT

from ibfil.case.reading import parse_case
from ibfil.commands import main
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.studies import sweep_figure
from ibfil.studies.member import Member, Outcome
from ibfil.studies.replicas import means
from ibfil.studies.settings import Setting, axis, axis_of, combinations
from ibfil.studies.sweep import Swept, sweep
from ibfil.studies.tables import write_csv, write_json


def test_an_axis_reads_values_with_commas_of_their_own():
    lists = axis("fluid.box=[2, 2,2],[4,4,4]")
    assert lists.keys == ("fluid.box",)
    assert lists.values == (("[2, 2,2]",), ("[4,4,4]",))
    formulas = axis("""filament.rod.curvature=["atan2(s,1)",0],['2,5',"x"]""")
    assert formulas.values == (("""["atan2(s,1)",0]""",), ("""['2,5',"x"]""",))
    tied = axis("time.scheme=explicit,implicit & time.order=1,2")
    assert tied.keys == ("time.scheme", "time.order")
    assert tied.values == (("explicit", "1"), ("implicit", "2"))
    assert axis_of("fluid.cells", [[8, 8, 8], [16, 16, 16]]).values == (("[8, 8, 8]",), ("[16, 16, 16]",))


@pytest.mark.parametrize("text", ["", "time.step", "=1", "time.step=", "time.step=1,,2", "a=1,2&b=1,2,3", "a=1&"])
def test_what_is_no_axis_is_refused(text):
    with pytest.raises(CaseError, match="allowed"):
        axis(text)


def test_combinations_have_names_that_files_can_have_and_that_differ():
    settings = combinations([axis('a.b=1,"x/y"'), axis("c.b=[1,2],[1 2]"), axis("d=7")])
    assert len({one.name for one in settings}) == len(settings) == 4
    assert settings[0].name == "a.b=1,c.b=1x2,d=7"
    assert all("/" not in one.name for one in settings)
    assert settings[0].overrides == ("a.b=1", "c.b=[1,2]", "d=7")
    long = combinations([axis(f"{'k' * 30}{i}={'9' * 30}") for i in range(9)])[0]
    assert len(long.name) <= 120
    with pytest.raises(CaseError, match=r"a\.b: found twice"):
        combinations([axis("a.b=1"), axis("a.b=2")])
    assert [one.name for one in combinations([])] == ["as_it_is"]


VARY = ["--vary", "fluid.viscosity=1,2", "--vary", "filament.rod.bending=1,-1"]


def test_a_sweep_makes_a_table_of_all_observables_and_tells_what_failed(here, capsys):
    assert main.main(["sweep", "bent.toml", "time.end=0.01", *VARY]) == 1
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == "bent-sweep/sweep.csv"
    with open("bent-sweep/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["fluid.viscosity"], row["filament.rod.bending"]) for row in rows] == [
        ("1", "1"),
        ("1", "-1"),
        ("2", "1"),
        ("2", "-1"),
    ]
    assert [row["status"] for row in rows] == ["finished", "failed", "finished", "failed"]
    assert "bending" in rows[1]["message"]
    assert rows[1]["span"] == ""
    for row in (rows[0], rows[2]):
        with RunFile(f"bent-sweep/{row['run']}.h5") as run:
            assert run.case.fluid.viscosity == float(row["fluid.viscosity"])
            assert run.case.time.end == 0.01
            assert float(row["span"]) == float(run.observables["span"][-1])
    assert rows[0]["span"] != rows[2]["span"]
    message = json.loads((here / "bent-sweep/sweep.json").read_text())
    assert message["machine"]
    assert [one["status"] for one in message["runs"]] == [row["status"] for row in rows]


def test_as_a_job_array_each_index_is_one_run_and_the_table_comes_after(here, capsys):
    command = ["sweep", "bent.toml", "--vary", "fluid.viscosity=1,2", "-o", "out"]
    assert main.main([*command, "--list"]) == 0
    assert capsys.readouterr().out.splitlines() == ["0  viscosity=1", "1  viscosity=2"]
    assert not (here / "out").exists()
    assert main.main([*command, "--index", "1"]) == 0
    assert [path.name for path in (here / "out").iterdir()] == ["viscosity=2.h5"]
    assert main.main([*command, "--index", "2"]) == 2
    assert "allowed: 0 to 1" in capsys.readouterr().err
    assert main.main([*command, "--index", "0"]) == 0
    times = {path: path.stat().st_mtime_ns for path in (here / "out").glob("*.h5")}
    assert main.main(command) == 0
    assert {path: path.stat().st_mtime_ns for path in (here / "out").glob("*.h5")} == times


def test_a_sweep_whose_case_is_at_fault_in_every_form_writes_nothing(here, capsys):
    assert main.main(["sweep", "bent.toml", "--vary", "fluid.viscosty=1,2"]) == 2
    assert main.main(["sweep", "bent.toml", "fluid.viscosity=-1", "--vary", "time.end=1,2"]) == 2
    assert main.main(["sweep", "nothing.toml", "--vary", "time.end=1,2"]) == 2
    assert capsys.readouterr().err.count("\n") == 3
    assert [path.name for path in here.iterdir()] == ["bent.toml"]


def test_members_of_another_case_are_computed_over_when_asked_only(here, capsys, monkeypatch):
    command = ["sweep", "bent.toml", "--vary", "fluid.viscosity=1,2", "-o", "out"]
    assert main.main([*command, "time.end=0.01"]) == 0
    kept = {path.name: path.read_bytes() for path in (here / "out").iterdir()}
    capsys.readouterr()
    for more in ([], ["--index", "0"]):
        assert main.main([*command, *more, "time.end=0.005"]) == 2
        told = capsys.readouterr().err
        assert "runs are of another case; viscosity=1 differs in time.end; allowed: another folder, or --force" in told
        assert {path.name: path.read_bytes() for path in (here / "out").iterdir()} == kept
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: True))
    for answer, status in (("n", 2), ("y", 0)):
        monkeypatch.setattr("builtins.input", lambda question, answer=answer: answer)
        assert main.main([*command, "time.end=0.005"]) == status
    with RunFile("out/viscosity=1.h5") as run:
        assert run.case.time.end == 0.005
    monkeypatch.setattr("sys.stdin", None)
    assert main.main([*command, "time.end=0.01", "--force"]) == 0


def rows_of(numbers: dict[tuple[str, ...], float], keys: tuple[str, ...], error: float = 0.0) -> list[Swept]:
    return [
        Swept(
            Setting("_".join(values), dict(zip(keys, values, strict=True))),
            Outcome(Member("m", "", ()), "finished", Path("m.h5"), "", 0.0),
            {"speed": number} if number == number else {},
            {"speed": error} if error else {},
            {},
        )
        for values, number in numbers.items()
    ]


def figure_of(monkeypatch, tmp_path, rows, keys):
    """The figure as it is saved, and its path."""
    saved = []
    monkeypatch.setattr(sweep_figure, "_labelled", lambda row, name: name)
    monkeypatch.setattr(sweep_figure, "save", lambda fig, path: saved.append(fig))
    sweep_figure.draw(rows, "speed", keys, "case", tmp_path)
    return saved[0]


def test_against_one_key_lines_go_through_the_means_of_the_others(monkeypatch, tmp_path):
    numbers = {("1", "a"): 1.0, ("1", "b"): 3.0, ("100", "a"): 5.0, ("100", "b"): 9.0, ("10", "a"): np.nan}
    fig = figure_of(monkeypatch, tmp_path, rows_of(numbers, ("x", "seed"), 0.5), ["x"])
    axes = fig.axes[0]
    line = axes.get_lines()[0]
    np.testing.assert_allclose(line.get_xydata(), [[1, 2], [100, 7]])
    assert axes.get_xscale() == "log"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x", "speed")
    assert "means over seed; 1 of 5 runs have no number" in axes.get_title(loc="left")
    assert len(axes.collections) == 1  # the bars


def test_a_second_key_has_lines_and_many_values_of_it_a_map(monkeypatch, tmp_path):
    lines = rows_of({(str(x), w): x * k for x in (1, 2) for k, w in ((1, "rft"), (10, "stokes"))}, ("x", "model"))
    axes = figure_of(monkeypatch, tmp_path, lines, ["x", "model"]).axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["rft", "stokes"]
    many = rows_of(
        {(str(x), str(y)): x + 10.0 * y for x in range(1, 4) for y in range(9) if (x, y) != (2, 2)}, ("x", "y")
    )
    fig = figure_of(monkeypatch, tmp_path, many, ["x", "y"])
    table = fig.axes[0].collections[0].get_array().reshape(9, 3)
    assert np.ma.getmaskarray(np.ma.masked_invalid(table)).sum() == 1
    assert table[8, 2] == 83.0


@pytest.mark.parametrize("values", [[1.0, 2.0, 4.0], [0.1, 1.0, 10.0]])
def test_a_cell_of_a_map_has_its_value_in_its_middle_as_the_axis_shows_it(values):
    edges = sweep_figure._edges(np.array(values), [])
    middles = np.sqrt(edges[1:] * edges[:-1]) if values[2] == 10 else None
    if middles is not None:
        np.testing.assert_allclose(middles, values)
    assert np.all((edges[:-1] < values) & (values < edges[1:]))


def test_words_stand_at_their_places(monkeypatch, tmp_path):
    axes = figure_of(monkeypatch, tmp_path, rows_of({("rft",): 1.0, ("stokes",): 2.0}, ("model",)), ["model"]).axes[0]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["rft", "stokes"]


def test_a_sweep_draws_its_observable(here, capsys):
    command = ["sweep", "bent.toml", "time.end=0.01", "--vary", "fluid.viscosity=1,2", "-o", "out"]
    assert main.main([*command, "--figure", "span", "--against", "fluid.viscosity"]) == 0
    assert "out/sweep_span.png, and as pdf" in capsys.readouterr().out
    assert (here / "out/sweep_span.png").read_bytes().startswith(b"\x89PNG")
    assert main.main([*command, "--figure", "taste"]) == 2
    assert "--figure: found taste; allowed: span" in capsys.readouterr().err
    assert main.main([*command, "--figure", "span", "--against", "time.end"]) == 2
    assert "--against: found time.end; allowed: fluid.viscosity" in capsys.readouterr().err


def test_a_figure_has_the_units_of_the_runs(tmp_path):
    text = "\n".join(["units = { length = 'um' }", BENT.strip()])
    rows = sweep(text, [axis_of("fluid.viscosity", [1.0])], tmp_path, ["time.end=0.01"], log=lambda line: None)
    assert sweep_figure._labelled(rows[0], "span") == "span (um)"


def test_from_python(tmp_path):
    rows = sweep(BENT, [axis_of("fluid.viscosity", [1.0, 2.0])], tmp_path, ["time.end=0.01"], log=lambda line: None)
    assert [row.setting.values["fluid.viscosity"] for row in rows] == ["1.0", "2.0"]
    assert all(row.outcome.done and row.numbers["span"] > 0 for row in rows)


def test_a_sweep_over_seeds_ends_with_means_and_their_standard_errors(here, capsys):
    """Of each viscosity over its two seeds; without heat a seed is nothing to average over."""
    vary = ["--vary", "fluid.viscosity=1,2", "--vary", "thermal.seed=1,2"]
    heat = ["thermal.energy=1e-4", "filament.rod.derivative=2", "time.end=0.01", "time.step=0.001"]
    assert main.main(["sweep", "bent.toml", *heat, *vary]) == 0
    with open("bent-sweep/sweep.csv", newline="") as file:
        spans = [float(row["span"]) for row in csv.DictReader(file)]
    with open("bent-sweep/sweep_means.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["fluid.viscosity"], row["seeds"]) for row in rows] == [("1", "2"), ("2", "2")]
    for row, pair in zip(rows, (spans[:2], spans[2:]), strict=True):
        assert float(row["span"]) == pytest.approx(np.mean(pair), rel=1e-9)
        assert float(row["span +-"]) == pytest.approx(abs(pair[1] - pair[0]) / 2, rel=1e-6)


def test_tables_keep_all_digits_and_json_has_no_nan(tmp_path):
    write_csv(tmp_path / "t.csv", [{"a": 0.1 + 0.2}, {"b": "x,y", "a": None}])
    assert (tmp_path / "t.csv").read_text() == 'a,b\n0.30000000000000004,\n,"x,y"\n'
    write_json(tmp_path / "t.json", {"a": [float("nan"), 1.0]})
    assert "null" in (tmp_path / "t.json").read_text()


def test_ranges_and_tables_of_points(tmp_path):
    assert axis("a=1:2:5,7").values == (("1",), ("1.25",), ("1.5",), ("1.75",), ("2",), ("7",))
    assert axis("a=0.1:0.3:3").values == (("0.1",), ("0.2",), ("0.3",))
    assert axis("a=1e-3:1e1:5:log").values == (("0.001",), ("0.01",), ("0.1",), ("1",), ("10",))
    assert axis("nodes=81:21:4 & b=1:2:4").values[1] == ("61", "1.333333333")
    table = tmp_path / "points.csv"
    table.write_text('fluid.viscosity, time.step\n1,0.1\n"2", 0.2\n\n')
    points = axis(f"@{table}")
    assert points.keys == ("fluid.viscosity", "time.step")
    assert points.values == (("1", "0.1"), ("2", "0.2"))
    assert [one.name for one in combinations([points])] == ["viscosity=1,step=0.1", "viscosity=2,step=0.2"]
    table.write_text('a,b\n"[1,2]",x\n')
    assert axis(f"@{table}").values == (("[1,2]", "x"),)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a=1:2:1", "N from 2 to 10000"),
        ("a=1:1:3", "two ends"),
        ("a=0:2:3:log", "with log, ends above 0"),
        ("a=1:2:2.5", "numbers, START:STOP:N"),
        ("@no.csv", "no.csv cannot be read (No such file or directory)"),
    ],
)
def test_faults_of_ranges_are_one_line(text, told):
    with pytest.raises(CaseError) as caught:
        axis(text)
    assert f"--vary {text}: " in caught.value.faults[0]
    assert told in caught.value.faults[0]


@pytest.mark.parametrize(
    ("content", "told"),
    [("a,b\n", "found 1 rows"), ("a,b\n1\n", "found 1 values in row 2; allowed: 2"), ("a,a\n1,2\n", "the key a twice")],
)
def test_faults_of_tables_of_points_are_one_line(tmp_path, content, told):
    table = tmp_path / "points.csv"
    table.write_text(content)
    with pytest.raises(CaseError) as caught:
        axis(f"@{table}")
    assert told in caught.value.faults[0]


def test_runs_of_several_seeds_are_summed_up():
    """Three of one scene, one of another temperature; a seed by its key, or by a parameter."""
    key = BENT + "[thermal]\nenergy = 0.01\n"
    named = BENT + "[parameters]\nmine = 1\n" + '[thermal]\nenergy = 0.01\nseed = "mine"\n'
    for text, path in ((key, "thermal.seed"), (named, "parameters.mine")):
        case = parse_case(text, "hot.toml")
        runs = [
            (case.with_({path: k}), {path: k, "x": 7}, {"far": value}) for k, value in ((1, 1.0), (2, 2.0), (3, 4.0))
        ]
        runs.append((case.with_({path: 1, "thermal.energy": 0.02}), {path: 1, "x": 8}, {"far": 100.0}))
        (mean,) = means(runs)
        assert mean.values == {"x": 7}
        error = np.std([1.0, 2.0, 4.0], ddof=1) / np.sqrt(3)
        assert mean.row() == {"x": 7, "seeds": 3, "far": pytest.approx(7 / 3), "far +-": pytest.approx(error)}
