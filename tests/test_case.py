"""What becomes of a case: values, defaults, overrides, comparison, listings, what is not built yet."""

from __future__ import annotations

import json
import math
import pickle
import subprocess
import sys
import tomllib

import pytest

from ibfil.case import (
    Case,
    differences,
    idle_keys,
    parse_case,
    quick_case,
    read_case,
)
from ibfil.case_listing import schema_json, schema_text
from ibfil.case_schema import Coefficients, Helix, Matched
from ibfil.errors import CaseError
from ibfil.expressions import parse

SHORT = """
[filament.rod]
length = 1.0
nodes = 41
bending = 2
stretching = 1e4
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1
[output]
every = 0.1
"""

BROWNIAN_HELIX = """
units = { length = "um", force = "pN", time = "s" }
[parameters]
theta = 0.7853981633974483
seed = 3
[filament.helix]
length = 10
nodes = 500
bending = 1
twisting = 1
stretching = 2000
radius = 0.1
curvature = ["1/tan(theta)", 0]
twist_rate = 1
direction = [0, 0, 1]
align = "axis"
normal = [1, 0, 0]
anchor = "centroid"
shape = { kind = "relaxed" }
[fluid]
model = "rft"
viscosity = 0.1
drag = "paper"
[thermal]
energy = 0.004114
seed = "seed"
directions = "xyz"
twist = true
[time]
end = 1.5
step = 1e-5
[output]
every = 1e-3
[observe.ratio]
kind = "diffusion_ratio"
at = "centroid"
interval = 1e-3
[expect.ratio]
observe = "ratio"
value = 0.779
tolerance = 0.135
source = "linearised elastic rod, 1 ms"
"""

FLAILING = """
[parameters]
F0 = 43.6
k = 1.8751040687119611
c = "(cos(k) + cosh(k))/(sin(k) - sinh(k))"
[filament.rod]
length = 1
nodes = 128
bending = 1
twisting = 1
stretching = 2e4
radius = 0.1
anchor = "start"
normal = [0, 1, 0]
[filament.rod.shape]
perturb = ["0", "0", "0.02*(sin(k*s) - sinh(k*s) + c*(cos(k*s) - cosh(k*s)))"]
twist = "0.1*cos(pi*s/2)"
[filament.rod.start]
end = "clamped"
[filament.rod.finish]
follower = "-F0"
[fluid]
model = "rft"
viscosity = 1
[time]
end = 20
step = 1e-4
[output]
every = 0.01
[observe.tip]
kind = "position"
at = "finish"
"""

HELIX_IN_FLOW = """
[parameters]
A = 1.0
u = 0.01
[filament.helix]
length = 5.0
nodes  = 201
bending = "A"
twisting = "A"
stretching = 4000
radius = 0.1
curvature = [3, 0]
twist_rate = 1
anchor = "start"
align = "axis"
shape = { kind = "relaxed" }
start = { end = "clamped", twist = "held" }
[fluid]
model = "rft"
viscosity = 0.1
flow  = ["u", "0", "0"]
[time]
end = 60
step = 2e-3
[[stop]]
observe = "tip_speed"
below = 1e-5
after = 0.1
[output]
every = 0.05
[observe.tip_speed]
kind = "speed"
at = "finish"
[observe.extension]
kind = "displacement"
at = "finish"
along = [1, 0, 0]
[expect.small_u]
observe = "extension"
value = "1.029 * 0.2*pi * u * 0.3**2 * 25 / A"
tolerance = 0.01
"""

RIBBON = """
[parameters]
gamma = 40
eta = 0.01
A = 0.5
[filament.actin]
length = 4
nodes = 129
bending = ["A", "A/20"]
twisting = 1e-4
stretching = 3000
radius = 0.004
[fluid]
model = "rft"
viscosity = "eta"
flow = ["-gamma*x", "gamma*y", "0"]
drag = "slender"
[thermal]
energy = 0.004114
[contact]
distance = 0.008
[time]
end = 0.15
step = 1e-5
scheme = "semi-implicit"
order = 1
[output]
every = 1e-3
[observe.r_eff]
kind = "radius"
along = [1, 0, 0]
at = [1.0, 3.0]
space = "mean"
summary = "max"
"""

SWIMMER = """
[parameters]
rho = 10
[filament.swimmer]
length = 1
nodes = 41
bending = 1
stretching = 400
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
anchor = "centroid"
[fluid]
model = "navier-stokes"
viscosity = 1
density = "rho"
box = [3.2, 3.2, 3.2]
cells = [64, 64, 64]
[time]
end = "6*pi/10"
step = "pi/500"
[output]
every = "pi/250"
grid_every = "pi/5"
fields = ["velocity", "vorticity"]
[observe.speed]
kind = "drift"
at = "centroid"
along = [1, 0, 0]
over = ["2*pi/10", "6*pi/10"]
[expect.speed]
observe = "speed"
value = -0.01857
[expect.speed.quick]
value = -0.0186
absolute = 1e-3
"time.end" = "3*pi/10"
fluid.cells = [32, 32, 32]
observe.speed.over = ["pi/10", "3*pi/10"]
"""

WHIRLING = """
[parameters]
a = 0.1
ratio = 5.0
[filament.rod]
length = 1
nodes = 200
bending = [1, 0.05]
twisting = 1
stretching = 1.6e4
radius = "a"
normal = [0, 1, 0]
shape = { kind = "straight", perturb = ["0", "1e-3*s**2", "1e-3*s**2*(1-s/3)"] }
[filament.rod.start]
end = "clamped"
twist = "held"
spin = "ratio/(4*pi*a**2)"
[fluid]
model = "rft"
viscosity = 1
[contact]
action = "warn"
[time]
end = 400
[[stop]]
observe = "amplitude"
steady = { over = 5.0, change = 1e-3 }
after = 20
[output]
every = 0.05
[observe.amplitude]
kind = "amplitude"
along = [1, 0, 0]
"""

EXAMPLES = [BROWNIAN_HELIX, FLAILING, HELIX_IN_FLOW, RIBBON, SWIMMER, WHIRLING]


def case(text: str, *overrides: str) -> Case:
    return parse_case(text, "case.toml", overrides)


def rod(case: Case):
    return case.filaments["rod"]


def faults(text: str, *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        case(text, *overrides)
    return caught.value.faults


# --- the paper's cases ----------------------------------------------------------------------------


@pytest.mark.parametrize("text", EXAMPLES)
def test_examples_parse_and_come_back_from_their_own_text(text):
    first = case(text)
    again = parse_case(first.text, first.file)
    assert again == first
    assert again.text == first.text
    assert differences(first, again) == {}
    assert pickle.loads(pickle.dumps(first)) == first


def test_values_of_the_examples():
    helix = case(BROWNIAN_HELIX)
    assert helix.parameters == {"theta": 0.7853981633974483, "seed": 3.0}
    assert helix.units.length == "um"
    assert helix.thermal.seed == 3
    assert isinstance(helix.thermal.seed, int)
    rod = helix.filaments["helix"]
    assert rod.curvature[0].constant == pytest.approx(1.0, rel=1e-15)
    assert rod.bending == (parse(1), parse(1))
    assert (rod.shape.kind, rod.anchor, rod.direction) == ("relaxed", "centroid", (0.0, 0.0, 1.0))

    flail = case(FLAILING)
    k = 1.8751040687119611
    assert flail.parameters["c"] == (math.cos(k) + math.cosh(k)) / (math.sin(k) - math.sinh(k))
    assert flail.filaments["rod"].finish.follower.constant == -43.6
    assert flail.filaments["rod"].shape.twist.at(s=1.0) == pytest.approx(0.0, abs=1e-15)

    flow = case(HELIX_IN_FLOW)
    assert [component.constant for component in flow.fluid.flow] == [0.01, 0.0, 0.0]
    assert flow.expect["small_u"].value == pytest.approx(1.029 * 0.2 * math.pi * 0.01 * 0.09 * 25)
    (stop,) = flow.stops
    assert (stop.observe, stop.below, stop.above, stop.steady, stop.after, stop.hold) == (
        "tip_speed",
        1e-5,
        None,
        None,
        0.1,
        0.0,
    )

    swimmer = case(SWIMMER)
    assert swimmer.time.end == 6 * math.pi / 10
    assert swimmer.fluid.cells == (64, 64, 64)
    assert all(isinstance(count, int) for count in swimmer.fluid.cells)
    assert swimmer.observe["speed"].over == (2 * math.pi / 10, 6 * math.pi / 10)
    assert swimmer.output.fields == ("velocity", "vorticity")

    whirl = case(WHIRLING)
    assert [modulus.constant for modulus in whirl.filaments["rod"].bending] == [1.0, 0.05]
    assert whirl.stops[0].steady.change == 1e-3
    assert whirl.contact.distance is None


# --- defaults that depend on other tables ---------------------------------------------------------


def test_defaults_of_the_shortest_case():
    short = case(SHORT)
    rod = short.filaments["rod"]
    assert (rod.derivative, rod.spacing, rod.force, rod.align, rod.normal) == (
        6,
        "even",
        "eq44",
        "auto",
        (0.0, 0.0, 1.0),
    )
    assert (rod.twisting, rod.radius, rod.loads, rod.copies) == (None, None, None, None)
    assert (rod.start.end, rod.start.twist, rod.shape.kind, rod.law.kind) == (
        "free",
        "free",
        "straight",
        "linear",
    )
    assert (short.contact, short.thermal, short.stops, short.observe) == (None, None, (), {})
    assert (short.fluid.drag, short.fluid.kernel, short.fluid.slip) == ("paper", "peskin4", 0.01)
    assert (short.time.step, short.time.scheme, short.time.order) == ("auto", "implicit", 2)
    assert (short.compute.threads, short.output.checkpoint_every) == (1, 60.0)


@pytest.mark.parametrize(
    ("overrides", "value", "wanted"),
    [
        (["thermal.energy=0"], lambda c: c.filaments["rod"].derivative, 2),
        (["thermal.energy=0", "filament.rod.derivative=6"], lambda c: c.filaments["rod"].derivative, 6),
        (["thermal.energy=0"], lambda c: (c.time.scheme, c.time.order), ("semi-implicit", 1)),
        (["thermal.energy=0"], lambda c: c.thermal.twist, False),
        (
            ["thermal.energy=0", "filament.rod.twisting=1", "filament.rod.radius=0.1"],
            lambda c: c.thermal.twist,
            True,
        ),
        (["time.scheme=explicit"], lambda c: c.time.order, 1),
        (["time.scheme=implicit", "time.order=1"], lambda c: c.time.order, 1),
        (["filament.rod.start.end=clamped"], lambda c: c.filaments["rod"].start.twist, "held"),
        (["filament.rod.start.end=hinged"], lambda c: c.filaments["rod"].start.twist, "free"),
        (["observe.v.kind=speed"], lambda c: c.observe["v"].filament, "rod"),
        (
            ["observe.v.kind=speed", "expect.v.observe=v", "expect.v.value=1"],
            lambda c: (c.expect["v"].tolerance, c.expect["v"].absolute),
            (0.01, None),
        ),
        (
            ["observe.v.kind=speed", "expect.v.observe=v", "expect.v.value=0", "expect.v.absolute=1"],
            lambda c: (c.expect["v"].tolerance, c.expect["v"].absolute),
            (None, 1.0),
        ),
    ],
)
def test_defaults_that_depend_on_other_tables(overrides, value, wanted):
    assert value(case(SHORT, *overrides)) == wanted


# --- numbers, expressions, unions -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "value", "wanted"),
    [
        ("time.end=3*n", lambda c: c.time.end, 6.0),
        ("time.end=2", lambda c: c.time.end, 2.0),
        ("filament.rod.nodes=20*n + 1", lambda c: rod(c).nodes, 41),
        ("filament.rod.bending=[1, 's + n']", lambda c: rod(c).bending[1], parse("s + 2.0", ("s",))),
        ("filament.rod.bending=s + n", lambda c: rod(c).bending[0], parse("s + 2.0", ("s",))),
        ("filament.rod.derivative=n", lambda c: rod(c).derivative, 2),
        ("filament.rod.spacing=q**n", lambda c: rod(c).spacing, parse("q**2.0", ("q",))),
        ("filament.rod.position=[1, '1/n', 0.5]", lambda c: rod(c).position, (1.0, 0.5, 0.5)),
        ("fluid.drag.matched=n", lambda c: c.fluid.drag, Matched(matched=2.0)),
        ("fluid.drag={perp=4, par=2}", lambda c: c.fluid.drag, Coefficients(perp=4.0, par=2.0, spin=None)),
        ("fluid.drag=slender", lambda c: c.fluid.drag, "slender"),
        ("observe.v={kind='speed', at='0.1*n'}", lambda c: c.observe["v"].at, 0.2),
        ("observe.v={kind='speed', at=[0, 0.5]}", lambda c: c.observe["v"].at, (0.0, 0.5)),
        ("observe.v={kind='speed', at='middle'}", lambda c: c.observe["v"].at, "middle"),
        ("output={times=[0, 0.5]}", lambda c: c.output.times, (0.0, 0.5)),
        ("output.probes=[[0, 0, 'n']]", lambda c: c.output.probes, ((0.0, 0.0, 2.0),)),
        (
            "filament.rod.law={kind='stiffening', coefficient='-n', exponent=2}",
            lambda c: rod(c).law.coefficient,
            -2.0,
        ),
        ("filament.rod.loads.tether.stiffness=1", lambda c: rod(c).loads.tether.to, "initial"),
        (
            "filament.rod.loads.tether={stiffness=1, to=['s', 't', 0]}",
            lambda c: rod(c).loads.tether.to[1],
            parse("t", ("t",)),
        ),
        ("filament.rod.shape={kind='run', path='a.h5', time=1}", lambda c: rod(c).shape.time, 1.0),
        (
            "filament.rod.copies={count=2, region=[[0, 0, 0], [1, 1, 1]]}",
            lambda c: rod(c).copies.region,
            ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
        ),
    ],
)
def test_values_in_all_their_forms(override, value, wanted):
    text = "[parameters]\nn = 2\n" + SHORT + "\n[filament.rod.finish]\n"
    overrides = [override, "filament.rod.radius=0.1", "fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 40]"]
    assert value(case(text, *overrides)) == wanted


def test_a_helix_by_either_pair():
    for keys in ("radius=0.3, pitch=1, hand='left'", "curvature=3, torsion=1"):
        shape = case(SHORT, f"filament.rod.shape={{kind='helix', {keys}}}").filaments["rod"].shape
        assert isinstance(shape, Helix)
        assert (shape.radius is None) == (shape.torsion is not None)


# --- overrides ------------------------------------------------------------------------------------


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
        ("filament.rid.length=1", "filament.rid.nodes", "found nothing"),
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


# --- files that are not cases ---------------------------------------------------------------------


def test_reading_files(tmp_path):
    path = tmp_path / "my case.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SHORT.encode())
    assert read_case(path, ["time.end=2"]).time.end == 2.0
    assert read_case(str(path)).file == str(path)
    for data in (
        b"\xff\xfe\x00",
        b"x = ",
        b"x = 1\nx = 2",
        b"[" * 5000,
        b"x = " + b"9" * 9000,
        b"a" * 2_000_000,
        b"a" + b".a" * 200_000 + b" = 1",
        b"'a'" + b" . 'a'" * 50_000 + b" = 1",
        b"x = " + b"[" * 50 + b"]" * 50,
        b"x = " + b"{a = " * 30 + b"1" + b"}" * 30,
    ):
        path.write_bytes(data)
        with pytest.raises(CaseError) as caught:
            read_case(path)
        (line,) = caught.value.faults
        assert line.startswith(f"{path}: ")
    for missing in (tmp_path, tmp_path / "no.toml"):
        with pytest.raises(CaseError, match="cannot be read"):
            read_case(missing)


# --- comparing, idle keys, quick forms ------------------------------------------------------------


def test_differences_name_the_keys():
    a = case(SHORT)
    b = case(
        SHORT,
        "time.end=2",
        "output.every=0.2",
        "filament.rod.bending=[2, '2 + s']",
        "filament.rod.position=[0, 1, 0]",
        "filament.rod.shape={kind='circle', curvature=1}",
        "observe.v.kind=speed",
        "compute.threads=2",
    )
    assert sorted(differences(a, b)) == [
        "compute.threads",
        "filament.rod.bending.1",
        "filament.rod.position.1",
        "filament.rod.shape",
        "observe.v",
        "output.every",
        "time.end",
    ]
    assert differences(a, case(SHORT, "filament.rod.bending=[2.0, '1+1']", "time.scheme=implicit")) == {}
    assert differences(a, parse_case(SHORT, "another name")) == {}


@pytest.mark.parametrize(
    ("model", "overrides", "idle"),
    [
        (
            "rft",
            [],
            "density box cells kernel slip method precision rotation grid_every fields grid_stride probes",
        ),
        (
            "rft",
            ["fluid.drag={matched=1}"],
            "density method precision rotation grid_every fields grid_stride probes",
        ),
        ("stokes", [], "density drag"),
        ("navier-stokes", [], "drag"),
        ("stokes", ["fluid.drag={perp=2, par=1, spin=3}"], "density"),
        ("stokes", ["fluid.drag={perp=2, par=1, spin=3}", "fluid.rotation=grid"], "density drag"),
        ("stokes", ["fluid.drag={perp=2, par=1}"], "density drag"),
    ],
)
def test_keys_of_the_fluids_not_chosen_are_idle(model, overrides, idle):
    text = f"""
    [parameters]
    used = 1
    unused = 2
    also_used = 3
    [filament.rod]
    length = "used"
    nodes = 41
    bending = 1
    twisting = "also_used + s"
    stretching = 1e4
    radius = 0.01
    [fluid]
    model = "{model}"
    viscosity = 1
    density = 1
    flow = [1, 0, 0]
    drag = "paper"
    box = [4, 4, 4]
    cells = [40, 40, 40]
    kernel = "roma3"
    slip = 0
    method = "table"
    precision = "single"
    rotation = "local"
    [time]
    end = 1
    [output]
    every = 0.1
    grid_every = 0.2
    fields = ["pressure"]
    grid_stride = 2
    probes = [[0, 0, 0]]
    """
    assert [key.split(".")[1] for key in idle_keys(case(text, *overrides))] == [*idle.split(), "unused"]


def test_a_case_without_idle_keys_has_none():
    assert idle_keys(case(SHORT)) == []


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


# --- the listing ----------------------------------------------------------------------------------


def _json_keys(schema: dict, node: dict) -> set[str]:
    """All keys that a JSON Schema knows."""
    if "$ref" in node:
        return _json_keys(schema, schema["$defs"][node["$ref"].rsplit("/", 1)[1]])
    inner = [*node.get("properties", {}).values(), *node.get("anyOf", []), *node.get("oneOf", [])]
    inner += [part for part in (node.get("items"), node.get("additionalProperties")) if isinstance(part, dict)]
    return set(node.get("properties", {})).union(*(_json_keys(schema, part) for part in inner))


def test_the_listing_and_the_json_schema_hold_every_key():
    schema = schema_json()
    json.dumps(schema)
    assert schema["additionalProperties"] is False
    assert set(schema["required"]) == {"filament", "fluid", "time", "output"}
    keys = _json_keys(schema, schema)
    assert {
        "filament",
        "stop",
        "checkpoint_every",
        "wells",
        "stiffness",
        "perp",
        "matched",
        "torsion",
    } <= keys
    text = schema_text()
    tables = {"[units]", "[filament.NAME]", "[filament.NAME.start]", "[fluid]", "[[stop]]", "[expect.NAME]"}
    assert all(table in text for table in tables)
    for key in keys:
        assert f"  {key}: " in text or f"{key}]" in text or f"{key}.NAME]" in text or key == "kind", key


def test_every_key_is_described():
    schema = schema_json()
    for table in [schema, *schema["$defs"].values()]:
        for key, entry in table.get("properties", {}).items():
            assert len(entry.get("description", "")) > 2, (table.get("title"), key)


def test_idle_keys_ask_for_nothing():
    grid = ["fluid.kernel=es6", "fluid.method=krylov", "fluid.precision=single", "output.fields=['pressure']"]
    assert case(SHORT, *grid, "fluid.density=1", "output.probes=[[0, 0, 0]]").fluid.model == "rft"


# --- cost of importing ----------------------------------------------------------------------------


def test_reading_a_case_imports_no_numpy(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(FLAILING)
    code = f"import sys; from ibfil.case import read_case; read_case({str(path)!r}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pydantic" in done.stdout.split()
    assert not {"numpy", "numexpr", "scipy", "numba", "h5py"} & set(done.stdout.split())
