"""Cases that are wrong: every key of the schema, and combinations that do not go together."""

from __future__ import annotations

import copy
import re
import types
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import pytest
import tomli_w
from pydantic import BaseModel

from ibfil.case import parse_case
from ibfil.case_schema import Scene
from ibfil.case_values import Formula, Kind, Listed, Number, Place, Whole
from ibfil.errors import CaseError

SCENE: dict[str, Any] = {
    "filament": {"rod": {"length": 1.0, "nodes": 41, "bending": 1.0, "stretching": 1e4}},
    "fluid": {"model": "rft", "viscosity": 1.0},
    "time": {"end": 1.0},
    "output": {"every": 0.1},
}


def fault_lines(scene: dict[str, Any], *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        parse_case(tomli_w.dumps(scene), "bad.toml", overrides)
    assert str(caught.value).splitlines() == caught.value.faults, "one line each"
    return caught.value.faults


# --- every key of the schema, found by walking its models --------------------------------------------


class Key(NamedTuple):
    """A key: its path, its hint and metadata, and a scene in which its table stands with all it needs."""

    path: tuple[str, ...]
    hint: Any
    metadata: tuple[Any, ...]
    scene: dict[str, Any]


def bare(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """A hint without Annotated and None, and what Annotated said."""
    if get_origin(hint) is Annotated:
        inner, said = bare(get_args(hint)[0])
        return inner, (*said, *get_args(hint)[1:])
    if get_origin(hint) in (Union, types.UnionType):
        members = [m for m in get_args(hint) if m is not types.NoneType]
        if len(members) == 1:
            return bare(members[0])
    return hint, ()


def tables(hint: Any) -> list[type[BaseModel]]:
    """The tables a hint may be."""
    hint, _ = bare(hint)
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return [hint]
    if get_origin(hint) in (Union, types.UnionType):
        return [table for member in get_args(hint) for table in tables(member)]
    return []


def needed(table: type[BaseModel]) -> dict[str, Any]:
    """A table with its required keys, from the examples that stand in the schema."""
    content = {info.alias or n: info.examples[0] for n, info in table.model_fields.items() if info.is_required()}
    kind = table.model_fields.get("kind")
    return content if kind is None or kind.is_required() else {"kind": kind.default, **content}


def put(scene: dict[str, Any], path: tuple[str, ...], value: Any) -> dict[str, Any]:
    """A copy of the scene with the key set."""
    scene = copy.deepcopy(scene)
    place: Any = scene
    for part in path[:-1]:
        place = place[int(part)] if isinstance(place, list) else place.setdefault(part, {})
    place[path[-1]] = value
    return scene


def walk(table: type[BaseModel], path: tuple[str, ...], scene: dict[str, Any]):
    """All keys from ``table`` on, which stands at ``path`` in ``scene``."""
    for name, info in table.model_fields.items():
        key = (*path, info.alias or name)
        hint, said = bare(info.annotation)
        inner = tables(hint)
        if get_origin(hint) is dict and tables(get_args(hint)[1]):
            entry = "rod" if name == "filaments" else "x"
            (model,) = tables(get_args(hint)[1])
            start = scene if entry == "rod" else put(scene, (*key, entry), needed(model))
            yield from walk(model, (*key, entry), start)
        elif get_origin(hint) is tuple and tables(get_args(hint)[0]):
            (model,) = tables(get_args(hint)[0])
            yield from walk(model, (*key, "0"), put(scene, key, [needed(model)]))
        else:
            if name != "parameters":
                yield Key(key, hint, (*said, *info.metadata), scene)
            for model in inner:
                given = SCENE[key[0]] if key[-1:] == key and key[0] in SCENE else needed(model)
                yield from walk(model, key, put(scene, key, given))


KEYS = {".".join(key.path) + f" {i}": key for i, key in enumerate(walk(Scene, (), SCENE))}
each_key = pytest.mark.parametrize("key", KEYS.values(), ids=KEYS)


def kind_of(key: Key) -> Kind | None:
    return next((item for item in key.metadata if isinstance(item, Kind)), None)


def literals(hint: Any) -> tuple[Any, ...]:
    hint, _ = bare(hint)
    if get_origin(hint) in (Union, types.UnionType):
        return tuple(word for member in get_args(hint) for word in literals(member))
    return get_args(hint) if get_origin(hint) is Literal else ()


def wrong_types(key: Key) -> list[Any]:
    """Values of types the key does not take, those among them that a lax reader would convert."""
    kind = kind_of(key)
    if isinstance(kind, Whole):
        return [True, 41.0, 5.5, [], {}]
    if isinstance(kind, Place):
        return [True, {}, [1], [1, 2, 3], [1, True]]
    if isinstance(kind, Number | Formula):
        return [True, False, [1.0], {"a": 1}]
    if tables(key.hint) or get_origin(key.hint) is dict:
        return [3, True, [1], *([] if literals(key.hint) else ["word"])]
    if get_origin(key.hint) is tuple:
        repeat = any(isinstance(item, Listed) and item.repeat for item in key.metadata)
        length = next(item for item in key.metadata if isinstance(item, Listed)).length
        return [True, {"a": 1}, *([] if repeat else [1, "1"]), *([[1] * (length + 1)] if length else [])]
    if literals(key.hint):
        return [1, True, ["x"], {}]
    return {str: [1, 1.5, True, ["x"], {}], bool: [1, 0, "true", []]}[key.hint]


def out_of_range(key: Key) -> list[Any]:
    """Values of the right type that are not allowed."""
    kind = kind_of(key)
    if isinstance(kind, Number):
        over = [float("inf"), float("nan"), 10**400]
        low = kind.low
        return over if low is None else [*over, low - 1.0, f"{low} - 1", *([low, f"{low}*1"] if kind.open else [])]
    if isinstance(kind, Whole):
        return [7, -1, "7"] if kind.choices else [kind.low - 1, f"{kind.low} - 1", "5.5"]
    if isinstance(kind, Formula):
        return [float("inf"), float("nan")]
    if isinstance(kind, Place):
        return [-1, [2, 1], [-1, 1], [1, 1]]
    if tables(key.hint):
        return []
    return ["no such word", ""] if literals(key.hint) else []


def bad_expressions(key: Key) -> list[str]:
    if kind_of(key) is None:
        return []
    return ["1 +", "nosuchname", "sin", "9**9**9", "1/0", "__import__('os')", "(1).real", "", "w*2"]


def found_line(lines: list[str], path: tuple[str, ...], value: Any) -> str:
    """The line of the fault at ``path``; it must say what was found and what is allowed."""
    name = ".".join(path)
    where = rf"bad\.toml: {re.escape(name)}(\.\w+)?: found "
    found = [line for line in lines if re.match(where, line)]
    assert found, (path, value, lines)
    (what, allowed) = found[0].split("; allowed: ", 1)
    assert len(what) > len(f"bad.toml: {name}: found ")
    assert len(allowed) > 3
    return found[0]


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


# --- what does not go together ------------------------------------------------------------------------------

ROD = "filament.rod"
TWISTED = [f"{ROD}.twisting=1", f"{ROD}.radius=0.01"]
STOKES = ["fluid.model=stokes", "fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 40]"]
NAVIER = ["fluid.model=navier-stokes", "fluid.density=1", *STOKES[1:]]
SPEED = ["observe.v.kind=speed"]
THERMAL = ["thermal.energy=1"]
EXPECT = [*SPEED, "expect.e.observe=v"]

# Overrides of a sound case, the key that is then at fault, and words of the sentence.
COMBINATIONS = [
    # the rod
    ([f"{ROD}.nodes=7"], f"{ROD}.nodes", "at least 8 with derivative = 6"),
    ([f"{ROD}.bending=0"], f"{ROD}.bending", "> 0"),
    ([f"{ROD}.bending=[1, -1]"], f"{ROD}.bending.1", "> 0"),
    ([f"{ROD}.bending=1 - s"], f"{ROD}.bending", "0 at s = 1"),
    ([f"{ROD}.stretching=s - 0.5"], f"{ROD}.stretching", "-0.5 at s = 0"),
    ([f"{ROD}.twisting=0", f"{ROD}.radius=1"], f"{ROD}.twisting", "> 0"),
    ([f"{ROD}.radius=-0.1"], f"{ROD}.radius", "> 0"),
    ([f"{ROD}.radius=sqrt(0.5 - s)"], f"{ROD}.radius", "sqrt(-"),
    ([f"{ROD}.curvature=['1/s', 0]"], f"{ROD}.curvature.0", "at s = 0"),
    ([f"{ROD}.shape.perturb=[0, 'log(s)', 0]"], f"{ROD}.shape.perturb.1", "at s = 0"),
    ([f"{ROD}.spacing=q + 0.1"], f"{ROD}.spacing", "0 at q = 0"),
    ([f"{ROD}.spacing=q + sin(2*pi*q)"], f"{ROD}.spacing", "increases"),
    ([f"{ROD}.spacing=1/q"], f"{ROD}.spacing", "no finite value"),
    ([f"{ROD}.direction=[0, 0, 0]"], f"{ROD}.direction", "not zero"),
    ([f"{ROD}.normal=[0, 0, 0]"], f"{ROD}.normal", "not zero"),
    ([f"{ROD}.direction=[0, 0, -2]"], f"{ROD}.normal", "parallel to direction"),
    ([f"{ROD}.direction=[1, 1, 1]", f"{ROD}.normal=[-3, -3, -3]"], f"{ROD}.normal", "parallel"),
    ([f"{ROD}.copies.seed=1"], f"{ROD}.copies", "neither count nor file"),
    ([f"{ROD}.copies={{count=1, file='a'}}"], f"{ROD}.copies", "count and file"),
    ([f"{ROD}.copies.count=1"], f"{ROD}.copies.region", "two corners"),
    ([f"{ROD}.copies={{file='a', seed=2}}"], f"{ROD}.copies", "file alone"),
    ([f"{ROD}.copies={{count=1, region=[[0, 1, 0], [1, 0, 1]]}}"], f"{ROD}.copies.region", "lower corner"),
    # its shape
    ([f"{ROD}.shape.kind=helix"], f"{ROD}.shape", "radius and pitch"),
    ([f"{ROD}.shape={{kind='helix', radius=1, torsion=1}}"], f"{ROD}.shape", "radius and torsion"),
    ([f"{ROD}.shape={{kind='circle', curvature=6.3}}"], f"{ROD}.shape.curvature", "more than one turn"),
    ([f"{ROD}.shape={{kind='circle', radius=1}}"], f"{ROD}.shape.radius", "belongs to another kind"),
    # its ends
    ([f"{ROD}.start.twist=held"], f"{ROD}.start.twist", "clamped"),
    ([f"{ROD}.start.tangent=[1, 0, 0]"], f"{ROD}.start.tangent", "only at a clamped end"),
    ([f"{ROD}.start={{end='clamped', tangent=[0, 0, 0]}}"], f"{ROD}.start.tangent", "not zero"),
    ([f"{ROD}.start.moves=[0, 0, 0]"], f"{ROD}.start.moves", "only at a hinged or clamped end"),
    ([f"{ROD}.start={{end='hinged', force=[1, 0, 0]}}"], f"{ROD}.start.force", "only at a free end"),
    ([f"{ROD}.finish={{end='clamped', follower=1}}"], f"{ROD}.finish.follower", "only at a free end"),
    ([f"{ROD}.finish={{end='hinged', spring={{stiffness=1}}}}"], f"{ROD}.finish.spring", "only at a free"),
    ([f"{ROD}.finish={{end='clamped', moment=[0, 0, 1]}}"], f"{ROD}.finish.moment", "only at a free or hinged"),
    ([f"{ROD}.finish.frame=body"], f"{ROD}.finish.frame", "only with moment"),
    ([*TWISTED, f"{ROD}.start.spin=1"], f"{ROD}.start.spin", "only at a clamped end"),
    ([*TWISTED, f"{ROD}.start={{end='clamped', spin=1, angle=1}}"], f"{ROD}.start.angle", "one of them"),
    ([*TWISTED, f"{ROD}.start={{end='clamped', spin=1, twist='free'}}"], f"{ROD}.start.spin", "held"),
    # without twisting
    ([f"{ROD}.start={{end='clamped', spin=1}}"], f"{ROD}.start.spin", "only with twisting"),
    ([f"{ROD}.start={{end='clamped', angle=0}}"], f"{ROD}.start.angle", "only with twisting"),
    ([f"{ROD}.start={{end='clamped', twist='free'}}"], f"{ROD}.start.twist", "only with twisting"),
    ([f"{ROD}.twist_rate=1"], f"{ROD}.twist_rate", "only with twisting"),
    ([f"{ROD}.twist_rate=0*s"], f"{ROD}.twist_rate", "only with twisting"),
    ([f"{ROD}.shape.twist=s"], f"{ROD}.shape.twist", "only with twisting"),
    ([f"{ROD}.loads.moment=[0, 0, 's']"], f"{ROD}.loads.moment.2", "only with twisting"),
    ([f"{ROD}.curvature=[1, 't']"], f"{ROD}.curvature", "3-D curvature only with twisting"),
    # without twisting, out of the plane
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.shape.perturb=[0, 0, 's']"], f"{ROD}.shape.perturb", "plane"),
    ([f"{ROD}.curvature=[0, 1]", f"{ROD}.shape.perturb=[0, 's', 0]"], f"{ROD}.shape.perturb", "plane"),
    ([f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, 'x']"], "fluid.flow", "plane"),
    ([f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, '1 - z']"], "fluid.flow", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.force=[0, 0, 't']"], f"{ROD}.finish.force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.moment=[0, 1, 0]"], f"{ROD}.finish.moment", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish={{moment=[0, 1, 0], frame='body'}}"], f"{ROD}.finish.moment", "plane"),
    (
        [f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.spring={{stiffness=1, to=[0, 0, 1]}}"],
        f"{ROD}.finish.spring.to",
        "plane",
    ),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.weight=[0, 0, 1]"], f"{ROD}.loads.weight", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.force=['x', 'y', 's*t']"], f"{ROD}.loads.force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.body_force=[1, 0, 0]"], f"{ROD}.loads.body_force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.internal_moment=[0, 1]"], f"{ROD}.loads.internal_moment", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.shape={{kind='helix', radius=1, pitch=1}}"], f"{ROD}.shape.kind", "plane"),
    ([f"{ROD}.curvature=[0, 1]", f"{ROD}.shape={{kind='circle', curvature=1}}"], f"{ROD}.shape.kind", "plane"),
    ([f"{ROD}.curvature=[1, 0]", *THERMAL], "thermal.directions", "plane"),
    ([f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[0, 1, 1]"], f"{ROD}.loads.weight", "A1 != A2"),
    ([f"{ROD}.bending=[1, 2]", "fluid.flow=[0, 'z', 'y']"], "fluid.flow", "A1 != A2"),
    ([f"{ROD}.bending=[1, 2]", *THERMAL], "thermal.directions", "A1 != A2"),
    # contact
    (["contact.action=stop"], "contact.distance", "a distance, or a radius"),
    (["contact={distance=1, strength=1}"], "contact.strength", "only with action"),
    # the fluid
    (["fluid.model=stokes"], "fluid.box", "this fluid has a grid"),
    (["fluid.model=stokes", "fluid.box=[4, 4, 4]"], "fluid.cells", "cells or thickness"),
    (["fluid.drag={matched=1}"], "fluid.box", "grid"),
    ([*STOKES, "fluid.thickness=0.1"], "fluid.thickness", "one of them"),
    ([*STOKES, "fluid.cells=[40, 40, 41]"], "fluid.cells", "cells = [40, 40, 40]"),
    ([*STOKES, "fluid.box=[4, 2, 6]"], "fluid.cells", "cells = [34, 17, 51]"),
    ([*STOKES, "fluid.box=[3.2, 4.8, 1.6]", "fluid.cells=[64, 64, 64]"], "fluid.cells", "cells = [54, 81, 27]"),
    ([*STOKES, "fluid.box=[4, 4, 'sqrt(13)']"], "fluid.cells", "box = [4.0, 4.0, 4.0]"),
    (["fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 41]"], "fluid.cells", "one h on all axes"),
    ([*STOKES, "fluid.cells=[3, 3, 3]"], "fluid.cells", "width of peskin4"),
    ([*STOKES, "fluid.cells=[5, 5, 5]", "fluid.kernel=bkp6"], "fluid.cells", "at least 6"),
    ([*STOKES, "fluid.model=navier-stokes"], "fluid.density", "navier-stokes"),
    ([*NAVIER, "fluid.flow=['y', 0, 0]"], "fluid.flow", "box-periodic"),
    ([*NAVIER, "fluid.flow=['sin(2*pi*y/3)', 0, 0]"], "fluid.flow", "box-periodic"),
    ([*STOKES, "fluid.rotation=local"], "fluid.rotation", "has twisting"),
    ([*STOKES, "fluid.rotation=grid"], "fluid.rotation", "has twisting"),
    (["fluid.drag=slender"], f"{ROD}.radius", "slender"),
    (["fluid.drag=slender", f"{ROD}.radius=0.31"], f"{ROD}.radius", "below L/(2 sqrt(e)) = 0.303265"),
    ([f"{ROD}.twisting=1"], f"{ROD}.radius", "with twisting"),
    ([f"{ROD}.twisting=1", "fluid.drag={perp=2, par=1}"], f"{ROD}.radius", "with twisting"),
    # noise and time
    ([*THERMAL, *STOKES], "thermal", 'fluid.model = "rft"'),
    ([*THERMAL, *NAVIER], "thermal", 'fluid.model = "rft"'),
    ([*THERMAL, "thermal.twist=true"], "thermal.twist", "no filament has twisting"),
    ([*THERMAL, "time.scheme=implicit"], "time.scheme", "semi-implicit"),
    ([*THERMAL, "time.scheme=explicit"], "time.scheme", "semi-implicit"),
    ([*THERMAL, "time.order=2"], "time.order", "implicit"),
    (["time.scheme=explicit", "time.order=2"], "time.order", "implicit"),
    (["time.scheme=semi-implicit", "time.order=2"], "time.order", "implicit"),
    (["time.step=1e-12"], "time.step", "min_step"),
    # output
    (["output={}"], "output.every", "a list of times"),
    (["output.times=[0, 1]"], "output.every", "every and times"),
    (["output={times=[]}"], "output.times", "at least one"),
    (["output={times=[0, 0.5, 0.5]}"], "output.times", "above the one before"),
    (["output={times=[0, 2]}"], "output.times", "time.end = 1"),
    ([*STOKES, "output.fields=['velocity']"], "output.fields", "grid_every"),
    ([*STOKES, "output.grid_stride=2"], "output.grid_stride", "grid_every"),
    # what is looked at
    ([*SPEED, "observe.v.filament=rd"], "observe.v.filament", 'did you mean "rod"?'),
    ([*SPEED, "observe.v.at=1.5"], "observe.v.at", "at most length = 1"),
    ([*SPEED, "observe.v.at=[0.5, 1.5]"], "observe.v.at", "at most length = 1"),
    ([*SPEED, "observe.v.over=[1, 0]"], "observe.v.over", "t1 < t2"),
    ([*SPEED, "observe.v.over=[-1, 1]"], "observe.v.over", "0 <= t1"),
    ([*SPEED, "observe.v.along=[0, 0, 0]"], "observe.v.along", "not zero"),
    ([*SPEED, "observe.v.interval=1"], "observe.v.interval", "diffusion_ratio"),
    (["observe.v.kind=diffusion_ratio"], "observe.v.interval", "> 0 with diffusion_ratio"),
    ([*EXPECT, "expect.e.observe=w", "expect.e.value=1"], "expect.e.observe", "v"),
    (EXPECT, "expect.e.value", "a value, or a range"),
    ([*EXPECT, "expect.e.value=1", "expect.e.range=[0, 1]"], "expect.e.value", "value and range"),
    ([*EXPECT, "expect.e.range=[1, 0]"], "expect.e.range", "lo < hi"),
    ([*EXPECT, "expect.e.range=[0, 1]", "expect.e.tolerance=1"], "expect.e.tolerance", "only with value"),
    ([*EXPECT, "expect.e.value=1", "expect.e.tolerance=1", "expect.e.absolute=1"], "expect.e.tolerance", "one of"),
    ([*EXPECT, "expect.e.value=0"], "expect.e.tolerance", "absolute"),
    ([*EXPECT, "expect.e.value=1", "observe.v.kind=position"], "expect.e.observe", "three numbers"),
    ([*EXPECT, "expect.e.value=1", f"{ROD}.copies.file=a"], "expect.e.observe", "copies"),
]


@pytest.mark.parametrize(
    ("overrides", "key", "words"), COMBINATIONS, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_what_does_not_go_together(overrides, key, words):
    lines = fault_lines(SCENE, *overrides)
    told = [line for line in lines if line.startswith(f"bad.toml: {key}: found ")]
    assert told, lines
    assert any(words in line for line in told), told
    assert all("; allowed: " in line for line in lines)


@pytest.mark.parametrize(
    ("stop", "key", "words"),
    [
        ({"observe": "v"}, "stop.0", "one of below, above, steady"),
        ({"observe": "v", "below": 1, "above": 2}, "stop.0", "below and above"),
        ({"observe": "w", "below": 1}, "stop.0.observe", "v, p"),
        ({"observe": "p", "below": 1}, "stop.0.observe", "observe.p.along"),
    ],
)
def test_stops_that_cannot_be(stop, key, words):
    scene = {**SCENE, "stop": [stop], "observe": {"v": {"kind": "speed"}, "p": {"kind": "position"}}}
    (line,) = fault_lines(scene)
    assert line.startswith(f"bad.toml: {key}: found ")
    assert words in line


def test_with_several_filaments_an_observable_says_which():
    scene = {**SCENE, "filament": dict.fromkeys(("a", "b"), SCENE["filament"]["rod"])}
    (line,) = fault_lines(scene, *SPEED)
    assert line.startswith("bad.toml: observe.v.filament: found nothing; allowed: one of a, b")


# Near the combinations above, and sound.
SOUND = [
    [f"{ROD}.nodes=5", f"{ROD}.derivative=2"],
    [f"{ROD}.bending=1.001 - s"],
    [f"{ROD}.spacing=q**2"],
    [f"{ROD}.shape={{kind='circle', curvature='-2*pi'}}"],
    [*TWISTED, f"{ROD}.start={{end='clamped', spin='sin(t)'}}", f"{ROD}.curvature=[1, 1]", f"{ROD}.twist_rate=1"],
    [f"{ROD}.twist_rate=0.0", f"{ROD}.start={{end='clamped', twist='held'}}"],
    [f"{ROD}.curvature=['sin(s - t)', 0]", f"{ROD}.shape.perturb=['s', 's**2', 0]"],
    [f"{ROD}.curvature=[0, 1]", f"{ROD}.shape.perturb=['s', 0, 's']", "fluid.flow=['z', 0, 'x*t']"],
    [f"{ROD}.curvature=[1, 0]", "fluid.flow=['-x', '3*y', '-2*z']", f"{ROD}.shape={{kind='circle', curvature=1}}"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.position=[0, 0, 1]", "fluid.flow=[1, 0, '1 - z']"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.finish={{moment=[0, 0, 1], force=[1, 1, 0]}}"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.loads={{moment=[1, 0, 0], internal_moment=[1, 0], body_force=[0, 1, 0]}}"],
    [f"{ROD}.curvature=[1, 0]", *THERMAL, "thermal.directions=xy"],
    [
        f"{ROD}.direction=[1, 1, 0]",
        f"{ROD}.normal=[1, -1, 0]",
        f"{ROD}.curvature=[1, 0]",
        f"{ROD}.loads.weight=[2, 2, 5]",
    ],
    [f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[1, 0, 1]"],
    [f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[1, 1, 0]"],
    [f"{ROD}.shape={{kind='helix', radius=1, pitch=1}}", "fluid.flow=['z', 'x', 'y']"],
    THERMAL,
    [*STOKES, "fluid.box=[4, 2, 6]", "fluid.cells=[40, 20, 60]"],
    [*STOKES, "fluid.box=[3.2, 0.3, 0.3]", "fluid.cells=[32, 3, 3]", "fluid.kernel=roma3"],
    [*NAVIER, "fluid.flow=['sin(2*pi*y/4)*cos(t)', 'cos(pi*x)', 1]"],
    [*STOKES, "fluid.flow=['y', 0, 0]"],
    ["fluid.rotation=grid"],
    [*STOKES, *TWISTED, "fluid.rotation=grid"],
    [f"{ROD}.twisting=1", "fluid.drag={perp=2, par=1, spin=1}"],
    ["fluid.drag=slender", f"{ROD}.radius=0.3"],
    ["fluid.drag=slender", *STOKES],
    ["fluid.density=1", "output.fields=['pressure']", "output.grid_stride=2"],
    ["contact={distance=1, action='repel', strength=2}"],
    ["contact.action=warn", f"{ROD}.radius=0.1"],
    ["output={times=[0, 0.5, 1]}"],
    [*SPEED, "observe.v={kind='speed', at=[0, 1], space='max', over=[0, 99]}"],
    [*EXPECT, "expect.e.range=[0, 1]"],
    [*EXPECT, "expect.e.value=1", "observe.v={kind='position', along=[0, 1, 0]}"],
]


@pytest.mark.parametrize("overrides", SOUND, ids=" ".join)
def test_what_goes_together(overrides):
    parse_case(tomli_w.dumps(SCENE), "good.toml", overrides)
