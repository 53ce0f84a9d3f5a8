"""`ibfil verify`: which cases it runs, which numbers it holds them against, and its exit status."""

from __future__ import annotations

from helpers.made_run import BENT

from ibfil.commands import main
from ibfil.running import run as running_run
from ibfil.studies.tables import with_bar
from ibfil.studies.uncertainty.study import uncertainty

TWO = (
    BENT
    + """
[expect.later]
observe = "span"
value = 5.0
quick = { "time.end" = 0.01, range = [0.5, 1.5] }
[expect.also]
observe = "span"
range = [0.5, 1.5]
quick = { "time.end" = 0.01 }
"""
)


def test_verify_tells_a_number_that_is_not_found(here, capsys):
    (here / "two.toml").write_text(TWO)
    assert main.main(["verify", "two.toml"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:3] for line in lines[:3]] == [
        ["ok", "two.toml", "span"],
        ["FAIL", "two.toml", "later"],
        ["ok", "two.toml", "also"],
    ]
    assert lines[3] == "2 of 3 expected numbers found"


def test_verify_quick_takes_the_numbers_of_the_quick_form_and_shares_runs(here, capsys, monkeypatch):
    ends = []
    run = running_run.run
    monkeypatch.setattr(running_run, "run", lambda case, **more: ends.append(case.time.end) or run(case, **more))
    (here / "two.toml").write_text(TWO)
    assert main.main(["verify", "two.toml", "--quick"]) == 0
    assert sorted(ends) == [0.01, 0.02]
    assert "3 of 3 expected numbers found" in capsys.readouterr().out
    assert {path.name for path in here.iterdir()} == {"bent.toml", "two.toml"}


def test_verify_goes_on_after_a_run_that_failed(here, capsys):
    (here / "bad.toml").write_text(
        BENT.replace("step = 1e-3", 'step = 0.005\nscheme = "explicit"').replace("100.0", "1e5")
    )
    assert main.main(["verify", "bad.toml", "bent.toml"]) == 1
    first, second, last = capsys.readouterr().out.splitlines()
    assert first.startswith("FAIL  bad.toml span")
    assert "the run stopped at t = " in first
    assert second.startswith("ok    bent.toml span")
    assert last == "1 of 2 expected numbers found"


def test_verify_refuses_all_bad_cases_before_it_runs_one(here, capsys):
    (here / "mute.toml").write_text(BENT.split("[expect")[0])
    (here / "odd.toml").write_text(BENT.replace("viscosity", "viscosty"))
    assert main.main(["verify", "bent.toml", "mute.toml", "odd.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "mute.toml: found no [expect] table" in err
    assert "viscosty" in err


SWAYS = """
[filament.rod]
length = 1.0
nodes = 11
bending = 1.0
stretching = 2e3
start = { end = "clamped" }
loads = { force = [0, 0, "4*cos(6*t)"] }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 0.2
step = 0.02
[output]
every = 0.1
[observe.tip]
kind = "position"
at = "finish"
along = [0, 0, 1]
[expect.wide]
observe = "tip"
value = VALUE
tolerance = 0.3
[expect.narrow]
observe = "tip"
value = VALUE
absolute = 1e-5
[expect.off]
observe = "tip"
range = [1.0, 2.0]
"""


def test_verify_with_bars_tells_what_ibfil_uncertainty_does_and_where_a_bar_is_wider_than_what_is_allowed(here, capsys):
    (here / "sways.toml").write_text(SWAYS.replace("VALUE", "0.02"))
    bar = uncertainty(str(here / "sways.toml"), here / "out", log=lambda line: None).bars[0]
    (here / "sways.toml").write_text(SWAYS.replace("VALUE", repr(bar.value)))
    assert main.main(["verify", "sways.toml", "--bars"]) == 1
    wide, narrow, off, last = capsys.readouterr().out.splitlines()
    found = f"found {with_bar(bar.value, bar.bar)}"
    assert bar.bar > 1e-5
    for line in (wide, narrow, off):
        assert found in line
    assert wide.startswith("ok ")
    assert "wider" not in wide
    assert narrow.startswith("ok ")
    assert "the error bar is wider than the 1e-05 that is allowed" in narrow
    assert off.startswith("FAIL")
    assert last == "2 of 3 expected numbers found"
    assert main.main(["verify", "sways.toml"]) == 1
    assert f"found {bar.value:.6g}  " in capsys.readouterr().out
