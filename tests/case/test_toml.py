"""A case as text: faults of TOML in words, keys as they are called elsewhere, and a time that grows with its length."""

from __future__ import annotations

import time

import pytest
from helpers.made_run import BENT

from ibfil.case.reading import MAX_FAULTS, parse_case, read_case
from ibfil.case.toml import load
from ibfil.errors import CaseError


def faults(text: str, *overrides: str) -> list[str]:
    """The lines that a case gives."""
    with pytest.raises(CaseError) as caught:
        parse_case(text, "rod.toml", overrides)
    return caught.value.faults


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("model = rft", 'Invalid value: model = rft; a word or a formula stands in quotes: "rft"'),
        ("x = [4*sin(a, b), 0]", 'x = [4*sin(a, b), 0]; a word or a formula stands in quotes: "4*sin(a, b)"'),
        ("x = 2*pi  # a turn", 'a word or a formula stands in quotes: "2*pi"'),
        ("x = .5", "a number has digits on both sides of its point: 0.5"),
        ("x = [1, 2.]", "a number has digits on both sides of its point: 2.0"),
        ("x = 0,5", "a number has a point, not a comma"),
        ("x = True", "write true"),
        ("x = 1 2", "Expected newline or end of document after a statement: x = 1 2"),
        ("x = 2026-13-45", "x = 2026-13-45"),
    ],
)
def test_a_fault_of_toml_has_its_line_its_column_and_what_to_write(line, told):
    text = BENT.replace("[fluid]", f"{line}\n[fluid]")
    (fault,) = faults(text)
    number = text.split("\n").index(line) + 1
    assert fault.startswith(f"rod.toml: not TOML: line {number}, column ")
    assert fault.endswith(told)


@pytest.mark.parametrize(
    ("was", "named", "told"),
    [
        ("[filament.rod]", "[filament]", "filament: found length, nodes, derivative ... in [filament] itself"),
        ("[observe.span]", "[observe]", "observe: found kind in [observe] itself; allowed: a name of yours for each"),
        ("[expect.span]", "[expect]", "expect: found observe, range in [expect] itself"),
    ],
)
def test_a_table_without_its_name_is_one_line(was, named, told):
    (fault,) = faults(BENT.replace(was, named))
    assert told in fault


@pytest.mark.parametrize(
    ("was", "called", "told"),
    [
        ("step = 1e-3", "dt = 1e-3", 'time.dt: found an unknown key; did you mean "step"?'),
        ("bending = 1.0", "EI = 1.0", 'filament.rod.EI: found an unknown key; did you mean "bending"?'),
        ("bending = 1.0", "E = 1.0", 'filament.rod.E: found an unknown key; did you mean "bending"?'),
        ("viscosity = 1.0", "eta = 1.0", 'fluid.eta: found an unknown key; did you mean "viscosity"?'),
        (
            "length = 1.0",
            'length = 1.0\nbase = { end = "clamped" }',
            'rod.base: found an unknown key; did you mean "start"?',
        ),
        ("end = 0.02", "end = 0.02\nmu = 1", "time.mu: found an unknown key; viscosity belongs in [fluid]"),
    ],
)
def test_a_key_called_as_elsewhere_is_one_line_with_its_name_here(was, called, told):
    assert was in BENT
    (fault,) = faults(BENT.replace(was, called))
    assert told in fault


def test_an_unknown_name_in_a_formula_is_told_with_those_there_are():
    text = BENT + "[parameters]\nomega = 3\nkappa = 2\n"
    (fault,) = faults(text, "filament.rod.curvature=['K*sin(s)', 0]")
    assert "unknown name 'K'; there are s, t, pi, omega, kappa" in fault
    (fault,) = faults(text, "filament.rod.curvature=['omeg*sin(s)', 0]")
    assert "unknown name 'omeg'; did you mean \"omega\"?" in fault


def test_a_run_file_in_the_place_of_a_case_is_told(tmp_path):
    path = tmp_path / "run.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n\0\0")
    with pytest.raises(CaseError, match="is an HDF5 file, not a case: `ibfil show`"):
        read_case(path)


def test_prose_with_dots_is_no_long_key():
    dots = "a." * 40
    text = BENT.replace('title = "', f'# {dots}\nsource = """{dots}\n{dots}"""\ntitle = "{dots} ')
    assert load(text)["title"].startswith(dots)
    assert load(f"'{dots}' = 1\n\"{dots}b\" = '''{dots}'''")
    for key in (dots + "a", "a. " * 20 + "a", '"a".' * 20 + "a", "x = { " + dots + "a"):
        with pytest.raises(ValueError, match="a key of more than 16 parts"):
            load(f"b = 1\n{key} = 1\n")


LENGTH = 200_000
HUGE = {
    "a text": BENT.replace("A bent rod", "a" * LENGTH),
    "a key": BENT + "a" * LENGTH + " = 1\n",
    "a name": BENT + f"[observe.{'a' * LENGTH}]\nkind = 'speed'\n",
    "a dotted key": BENT + "a." * LENGTH + "a = 1\n",
    "texts without end": BENT + 'x = """' + '\\"""' * LENGTH,
    "unknown keys": BENT + "".join(f"k{i} = 1\n" for i in range(LENGTH // 10)),
    "unknown names": BENT + "[parameters]\n" + "".join(f"p{i} = 'z{i}'\n" for i in range(LENGTH // 10)),
    "quick forms": BENT
    + "".join(f"[expect.o{i}]\nobserve='span'\nvalue=1\nquick={{'time.end'=1}}\n" for i in range(1000)),
}


@pytest.mark.parametrize("kind", HUGE)
def test_reading_takes_a_time_that_grows_with_the_length_of_the_file(kind):
    """So many seconds of the processor are allowed that no load of a machine uses them up: before, it took minutes."""
    began, lines = time.process_time(), []
    try:
        parse_case(HUGE[kind], "huge.toml")
    except CaseError as error:
        lines = error.faults
    assert time.process_time() - began < 20
    assert len(lines) <= MAX_FAULTS + 1
    assert all(len(line) < 2000 for line in lines)
