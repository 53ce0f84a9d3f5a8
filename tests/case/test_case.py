"""What becomes of a case: values, defaults, files that are not cases, comparison, the cost of reading one."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys

import pytest
from helpers.example_cases import BROWNIAN_HELIX, EXAMPLES, FLAILING, HELIX_IN_FLOW, SHORT, SWIMMER, WHIRLING, case, rod
from helpers.made_run import BENT

from ibfil.case.expressions import parse
from ibfil.case.fluid import Coefficients, Matched
from ibfil.case.reading import differences, parse_case, read_case
from ibfil.case.shape import Helix
from ibfil.errors import CaseError

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
    assert (short.fluid.drag, short.fluid.kernel, short.fluid.slip) == ("auto", "peskin4", 0.01)
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
        with pytest.raises(CaseError, match=r"is a folder|no such file, and no shipped case"):
            read_case(missing)


# --- comparing ----------------------------------------------------------------------


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


# --- cost of importing ----------------------------------------------------------------------------


def test_reading_a_case_imports_no_numpy(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(FLAILING)
    code = f"import sys; from ibfil.case.reading import read_case; read_case({str(path)!r}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pydantic" in done.stdout.split()
    assert not {"numpy", "scipy", "numba", "h5py"} & set(done.stdout.split())


def test_a_word_of_an_older_version_is_read_as_the_one_that_stands_for_it_and_that_is_told():
    text = BENT.replace('model = "rft"', 'model = "stokes"\nmethod = "averaged"\nbox = [2, 2, 2]\ncells = [16, 16, 16]')
    old = parse_case(text, "old.toml")
    assert old.fluid.method == "table"
    (line,) = old.deprecated
    assert line.startswith('fluid.method: "averaged" is gone')
    assert 'method = "table"' in old.text
    assert parse_case(BENT, "new.toml").deprecated == ()
