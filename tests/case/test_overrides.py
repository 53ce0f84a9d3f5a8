"""What changes a case from outside its tables: overrides of the command line, and the quick forms of expectations."""

from __future__ import annotations

import math
import tomllib

import pytest
from helpers.example_cases import SHORT, SWIMMER, case, faults

from ibfil.case.reading import differences, quick_case
from ibfil.errors import CaseError


def test_overrides_change_the_case_and_its_text():
    text = (
        "[parameters]\nu = 1\nv = '2*u'\n" + SHORT + "[[stop]]\nobserve = 'w'\nbelow = 1\n[observe.w]\nkind = 'speed'\n"
    )
    changed = case(
        text,
        "parameters.u=0.6",
        "fluid.model=stokes",
        "fluid.box=[4, 4, 4]",
        "fluid.cells=[40, 40, 40]",
        " time.end = 3*v ",
        "stop.0.below=0.25",
        "filament.rod.curvature=['sin(s)', 0]",
        "filament.rod.curvature.1=0",
        'title=a "quoted" title',
        "compute.threads=2",
    )
    assert changed.parameters == {"u": 0.6, "v": 1.2}
    assert changed.time.end == pytest.approx(3.6)
    assert (changed.fluid.model, changed.stops[0].below, changed.compute.threads) == ("stokes", 0.25, 2)
    assert changed.title == 'a "quoted" title'
    raw = tomllib.loads(changed.text)
    assert raw["time"]["end"] == "3*v"
    assert raw["fluid"]["box"] == [4, 4, 4]
    assert case(text).time.end == 1.0


def test_absent_takes_a_key_out():
    changed = case(SHORT, "fluid.model=stokes", "fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 40]")
    back = case(changed.text, "fluid.cells=absent", "fluid.thickness=0.2", "fluid.kernel=absent")
    assert (back.fluid.cells, back.fluid.thickness) == (None, 0.2)
    assert "cells" not in tomllib.loads(back.text)["fluid"]
    with pytest.raises(CaseError, match=r"fluid\.viscosity"):
        case(SHORT, "fluid.viscosity=absent")
    with pytest.raises(CaseError, match=r"fluid\.viscocity"):
        case(SHORT, "fluid.viscocity=absent")


def test_a_deep_override_is_a_text():
    deep = "[" * 50 + "]" * 50
    assert case(SHORT, f"title={deep}").title == deep


def test_an_override_cannot_smuggle_in_another_key():
    changed = case(SHORT, "title=x\nsource = 'y'")
    assert (changed.title, changed.source) == ("x\nsource = 'y'", "")


@pytest.mark.parametrize(
    ("override", "key", "words"),
    [
        ("fluid.viscocity=1", "fluid.viscocity", 'did you mean "viscosity"?'),
        ("fluit.viscosity=1", "fluit", 'did you mean "fluid"?'),
        ("parameters.v=1", "parameters.v", "no such parameter"),
        ("parameters.uu=1", "parameters.uu", 'did you mean "u"?'),
        ("stop.1.below=1", "stop.1", "from 0 to 0"),
        ("stop.-1.below=1", "stop.-1", "from 0 to 0"),
        ("stop.x.below=1", "stop.x", "from 0 to 0"),
        ("stop.99999999999999999999.below=1", "stop.99999999999999999999", "from 0 to 0"),
        ("fluid.box.0=1", "fluid.box.0", "no such list"),
        ("fluid.viscosity.x=1", "fluid.viscosity.x", "fluid.viscosity = 1.0"),
        ("fluid.drag.perp.x=1", "fluid.drag.perp.x", "unknown key"),
        ("filament.rod.bending.0=1", "filament.rod.bending.0", "filament.rod.bending = 2"),
        ("viscosity=1", "viscosity", "belongs in [fluid]"),
        ("filament.rid.length=1", "filament.rid", 'no such filament; did you mean "rod"?'),
        ("fluid.viscosity", "command line", "KEY=VALUE"),
        ("=1", "command line", "KEY=VALUE"),
        ("fluid..viscosity=1", "command line", "KEY=VALUE"),
        ("fluid.viscosity=", "fluid.viscosity", "(empty)"),
    ],
)
def test_faults_of_overrides(override, key, words):
    text = "[parameters]\nu = 1\n" + SHORT + "[[stop]]\nobserve = 'w'\nbelow = 1\n[observe.w]\nkind = 'speed'\n"
    lines = faults(text, override)
    assert any(line.startswith(f"case.toml: {key}: found ") and words in line for line in lines), lines


def test_a_misspelt_override_leaves_no_other_faults():
    assert len(faults(SHORT, "thermal.enrgy=1")) == 1


# --- quick forms ----------------------------------------------------------------------------------


def test_quick_form():
    whole = case(SWIMMER)
    quick = quick_case(whole, "speed")
    assert quick.time.end == 3 * math.pi / 10
    assert quick.fluid.cells == (32, 32, 32)
    assert quick.observe["speed"].over == (math.pi / 10, 3 * math.pi / 10)
    expect = quick.expect["speed"]
    assert (expect.value, expect.tolerance, expect.absolute, expect.quick) == (-0.0186, None, 1e-3, {})
    assert whole.expect["speed"].value == -0.01857
    assert sorted(key for key in differences(whole, quick) if not key.startswith("expect")) == [
        "fluid.cells.0",
        "fluid.cells.1",
        "fluid.cells.2",
        "observe.speed.over.0",
        "observe.speed.over.1",
        "time.end",
    ]


@pytest.mark.parametrize(
    ("quick", "words"),
    [
        ("{ 'time.ende' = 1 }", 'time.ende: an unknown key; did you mean "end"?'),
        ("{ time = { end = -1 } }", "time.end: -1"),
        ("{ fluid.cells = [32, 32, 31] }", "fluid.cells: [32, 32, 31]"),
        ("{ range = [2, 1] }", "expect.speed.range: [2.0, 1.0]"),
        ("{ value = 0, tolerance = 0.1 }", "expect.speed.tolerance: a relative tolerance of value = 0"),
    ],
)
def test_faults_of_a_quick_form(quick, words):
    (line,) = faults(SWIMMER.split("[expect.speed.quick]")[0] + f"quick = {quick}\n")
    assert line.startswith("case.toml: expect.speed.quick: found an override with ")
    assert words in line
