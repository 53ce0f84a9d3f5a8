"""The schema as users see it: its listing and its JSON form hold every key; and which keys of a case are idle."""

from __future__ import annotations

import json

import pytest
from helpers.example_cases import SHORT, case

from ibfil.case.idle import idle_keys
from ibfil.case.listing import schema_json, schema_text


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
