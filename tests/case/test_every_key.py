"""Every key of the schema: misspelt, of a wrong type, out of range, with a bad expression, each is refused and told."""

from __future__ import annotations

import re

import tomli_w
from helpers.schema_keys import (
    bad_expressions,
    each_key,
    fault_lines,
    found_line,
    kind_of,
    out_of_range,
    put,
    wrong_types,
)

from ibfil.case.reading import parse_case
from ibfil.errors import CaseError


@each_key
def test_every_key_alone_is_known(key):
    """The walk's scenes are sound: with the table of the key and nothing else wrong, the key is not a fault."""
    try:
        parse_case(tomli_w.dumps(key.scene), "bad.toml")
        lines = []
    except CaseError as error:
        lines = error.faults  # examples of several tables in one scene do not always go together
    assert not [line for line in lines if "unknown" in line]


@each_key
def test_a_misspelt_neighbour_is_refused_with_the_right_name(key):
    *table, name = key.path
    wrong = name + name[-1]
    line = found_line(fault_lines(put(key.scene, (*table, wrong), 1)), (*table, wrong), 1)
    assert ": found an unknown key" in line
    assert re.search(rf"\b{name}\b", line.split("; allowed: ")[1])
    if len(name) > 2:
        assert "did you mean" in line


@each_key
def test_wrong_types_are_refused(key):
    for value in wrong_types(key):
        line = found_line(fault_lines(put(key.scene, key.path, value)), key.path, value)
        if value is True:
            assert ": found true" in line


@each_key
def test_values_out_of_range_are_refused(key):
    for value in out_of_range(key):
        line = found_line(fault_lines(put(key.scene, key.path, value)), key.path, value)
        if isinstance(value, str):
            assert f'"{value}"' in line


@each_key
def test_bad_expressions_are_refused_and_shown(key):
    for value in bad_expressions(key):
        line = found_line(fault_lines(put(key.scene, key.path, value)), key.path, value)
        assert f': found "{value}" (' in line
        if value == "nosuchname":
            assert "unknown name 'nosuchname'" in line


@each_key
def test_a_misspelt_parameter_is_named_with_the_right_one(key):
    if kind_of(key) is None:
        return
    scene = {**put(key.scene, key.path, "2*thta"), "parameters": {"theta": 1.0}}
    line = found_line(fault_lines(scene), key.path, "2*thta")
    assert "unknown name 'thta'; did you mean \"theta\"?" in line
