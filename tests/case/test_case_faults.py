"""Faults of whole cases: all at once, none that follows from another; parameters, names and what must be there."""

from __future__ import annotations

import copy

import pytest
from helpers.schema_keys import KEYS, SCENE, fault_lines, found_line, put, tables, wrong_types


def test_all_faults_at_once():
    """One wrong value in every key of the plain tables, in one file: each is told."""
    scene, wanted = copy.deepcopy(SCENE), []
    for key in KEYS.values():
        if "kind" in key.path or tables(key.hint) or len(key.path) > 3 or {"stop", "law", "shape"} & set(key.path):
            continue
        if key.path[:2] in (("observe", "x"), ("expect", "x"), ("filament", "rod")) or len(key.path) == 2:
            scene = put(scene, key.path, wrong_types(key)[0])
            wanted.append(key.path)
    lines = fault_lines(scene)
    assert len(wanted) > 60
    for path in wanted:
        found_line(lines, path, None)


def test_combinations_are_told_beside_single_faults():
    scene = copy.deepcopy(SCENE)
    scene["fluid"] |= {"model": "stokes", "kernel": "no", "slip": -1}
    scene["filament"]["rod"] |= {"twist_rate": 1, "lenght": 1, "nodes": 3}
    scene["time"] |= {"order": 2, "scheme": "explicit", "step": "fast"}
    lines = fault_lines(scene)
    for key in (
        "fluid.kernel",
        "fluid.slip",
        "fluid.box",
        "fluid.cells",
        "filament.rod.lenght",
        "filament.rod.nodes",
        "filament.rod.twist_rate",
        "time.order",
        "time.step",
    ):
        assert any(line.startswith(f"bad.toml: {key}: found ") for line in lines), key
    assert len(lines) == 9


def test_a_faulty_key_draws_no_faults_after_it():
    """What rests on a key that is itself at fault is not told."""
    scene = copy.deepcopy(SCENE)
    scene["filament"]["rod"] |= {"twisting": True, "twist_rate": 1, "start": {"end": "clamped", "spin": 1}}
    (line,) = fault_lines(scene)
    assert "filament.rod.twisting: found true" in line
    scene = copy.deepcopy(SCENE)
    scene["fluid"] = {"model": "stoks", "viscosity": 1}
    assert len(fault_lines(scene)) == 1
    scene = copy.deepcopy(SCENE)
    scene["parameters"] = {"a": "1/0", "b": "a + 1"}
    scene["filament"]["rod"] |= {"length": "a", "bending": ["b*s", 1], "position": [0, "b", 0]}
    (line,) = fault_lines(scene)
    assert "parameters.a" in line


# --- parameters and names -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sin", "where", "pi", "s", "t", "x", "y", "z", "q"])
def test_reserved_names_of_parameters(name):
    (line,) = fault_lines({**SCENE, "parameters": {name: 1.0}})
    assert line.startswith(f"bad.toml: parameters.{name}: found a parameter named like ")
    assert name in line.split("; allowed: ")[1]


@pytest.mark.parametrize("name", ["in", "lambda", "None", "1a", "a-b", "a b", "", "é"])
def test_names_of_parameters_that_no_expression_could_hold(name):
    (line,) = fault_lines({**SCENE, "parameters": {name: 1.0}})
    assert f'found the name "{name}"' in line


@pytest.mark.parametrize("value", [True, "later", "a", "1/0", "s", [1], {"b": 1}, float("nan"), "x.y", ""])
def test_values_of_parameters(value):
    lines = fault_lines({**SCENE, "parameters": {"a": value, "later": 2.0}})
    assert lines[0].startswith("bad.toml: parameters.a: found ")
    assert len(lines) == 1


def test_parameters_must_be_a_table():
    (line,) = fault_lines({**SCENE, "parameters": 3})
    assert line.startswith("bad.toml: parameters: found 3")


@pytest.mark.parametrize("table", ["filament", "observe", "expect"])
@pytest.mark.parametrize("name", ["a b", "a/b", "a.b", "", "é", "<helix>", "a\nb"])
def test_names_of_tables(table, name):
    content = {
        "filament": SCENE["filament"]["rod"],
        "observe": {"kind": "speed"},
        "expect": {"observe": "v", "value": 1},
    }
    scene = {**SCENE, "observe": {"v": {"kind": "speed"}}}
    scene[table] = {name: content[table]}
    lines = fault_lines(scene)
    assert any(f"bad.toml: {table}." in line and ": found the name " in line for line in lines)
    assert all("\n" not in line for line in lines)


@pytest.mark.parametrize("value", [{}, 3, []])
def test_there_must_be_a_filament(value):
    (line,) = fault_lines({**SCENE, "filament": value})
    assert line.startswith("bad.toml: filament: found ")


def test_an_empty_file():
    lines = fault_lines({})
    assert [line.split(":")[1].strip() for line in lines] == ["filament", "fluid", "time", "output"]
    assert lines[0].endswith("allowed: tables by names of yours, such as [filament.rod]")


def test_a_misspelt_name_on_the_command_line_is_no_new_filament():
    (line,) = fault_lines(SCENE, "filament.rood.nodes=21")
    assert line.endswith('filament.rood: found no such filament; did you mean "rod"?; allowed: rod')


def test_a_power_is_not_a_caret():
    (line,) = fault_lines(SCENE, 'filament.rod.curvature=["s^2", 0]')
    assert "the character '^' does not belong in an expression; a power is written **" in line
