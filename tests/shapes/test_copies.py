"""Copies of a filament: where they stand, how they are turned, what may be observed of one."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil import parse_case, run
from ibfil.errors import CaseError
from ibfil.simulation.simulation import Simulation

SCENE = """
[filament.hair]
length = 1.0
nodes = 9
bending = 1.0
stretching = 100
direction = [0, 0, 1]
normal = [0, 1, 0]
anchor = "start"
copies = {copies}
start = {{ end = "clamped" }}
finish = {{ force = [0.1, 0, 0] }}
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 0.01
[output]
every = 0.005
{more}
"""
TIP = '[observe.tip]\nkind = "position"\nfilament = "{name}"\nat = "finish"'
PLACES = [[-1.0, 0.0, 0.0], [0.5, 0.25, 0.0], [2.0, 0.0, -0.5]]
ROWS = "".join(", ".join(map(str, row)) + "\n" for row in PLACES)


def scene(tmp_path, copies: str, more: str = ""):
    return parse_case(SCENE.format(copies=copies, more=more), str(tmp_path / "hair.toml"))


@pytest.mark.parametrize("heading", ["", "x,y,z\n", "X, Y, Z\n", "# where they stand\n\n"])
def test_a_row_of_places_all_the_same_way(tmp_path, heading):
    (tmp_path / "places.csv").write_text(heading + ROWS)
    case = scene(tmp_path, '{ file = "places.csv", orientation = "same" }')
    snapshot = Simulation(case).snapshot()
    assert list(snapshot.filaments) == ["hair_000", "hair_001", "hair_002"]
    for filament, place in zip(snapshot.filaments.values(), PLACES, strict=True):
        along = np.linspace(0.0, 1.0, 9)[:, None] * [0.0, 0.0, 1.0]
        assert np.allclose(filament.position, place + along, atol=1e-14)
        assert np.allclose(filament.e1, [0.0, 1.0, 0.0], atol=1e-14)


def test_random_places_all_the_same_way(tmp_path):
    copies = "{{ count = 5, seed = 4, region = [[-1, -1, -1], [1, 1, 1]]{} }}"
    same = Simulation(scene(tmp_path, copies.format(', orientation = "same"'))).snapshot().filaments
    turned = Simulation(scene(tmp_path, copies.format(""))).snapshot().filaments
    for name, filament in same.items():
        assert np.allclose(filament.position[-1] - filament.position[0], [0, 0, 1], atol=1e-14)
        assert np.array_equal(filament.position[0], turned[name].position[0])  # the same seed, the same places
    assert max(abs(f.position[-1] - f.position[0])[2] for f in turned.values()) < 0.999


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot be read (No such file or directory)"),
        ("1, 2\n", "has 2 columns; allowed: x, y, z, or x, y, z and a quaternion"),
        ("a,b,c\n1,2,3\n", "line 1 is not numbers divided by commas: 'a,b,c'"),
        ("1,2,3\n1,2\n", "line 2 has 2 columns where the first row has 3"),
        ("1,2,nan\n", "numbers that are not finite"),
        ("1,2,3,0,0,0,0\n", "a quaternion of zero length"),
    ],
)
def test_places_that_are_none(tmp_path, text, said):
    if text is not None:
        (tmp_path / "places.csv").write_text(text)
    with pytest.raises(CaseError) as refused:
        Simulation(scene(tmp_path, '{ file = "places.csv" }'))
    (line,) = refused.value.faults
    assert "filament.hair.copies.file: places.csv " in line
    assert said in line


def test_one_copy_is_observed_by_its_name(tmp_path):
    (tmp_path / "places.csv").write_text(ROWS)
    case = scene(tmp_path, '{ file = "places.csv", orientation = "same" }', TIP.format(name="hair_001"))
    result = run(case, progress=False, log=lambda line: None)
    last = result.snapshot.filaments["hair_001"].position[-1]
    assert repr(result).startswith("<Result finished: ")
    assert "t = 0.01; tip = [" in repr(result)
    assert np.array_equal(result.summaries["tip"].value, last)
    assert last[0] > 0.5  # the force has moved it
    assert last[1] == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["hair_003", "hair_01", "hair_", "hair_-01", "hair_1e1"])
def test_a_copy_there_is_none_of(tmp_path, name):
    with pytest.raises(CaseError, match=r"observe\.tip\.filament: found"):
        scene(tmp_path, "{ count = 3, region = [[-1, -1, -1], [1, 1, 1]] }", TIP.format(name=name))


def test_a_copy_beyond_those_of_the_file(tmp_path):
    (tmp_path / "places.csv").write_text(ROWS)
    case = scene(tmp_path, '{ file = "places.csv" }', TIP.format(name="hair_007"))
    with pytest.raises(CaseError, match=r'found "hair_007"; allowed: hair_000 to hair_002'):
        run(case, progress=False, log=lambda line: None)


def test_all_copies_at_once_are_no_observable(tmp_path):
    copies = "{ count = 3, region = [[-1, -1, -1], [1, 1, 1]] }"
    with pytest.raises(CaseError, match=r'found "hair", which has copies; allowed: .*"hair_000" being the first'):
        scene(tmp_path, copies, TIP.format(name="hair"))
    case = scene(tmp_path, copies, '[observe.heat]\nkind = "dissipation"')  # of all together
    result = run(case, progress=False, log=lambda line: None)
    assert result.summaries["heat"].value > 0


@pytest.mark.parametrize(("name", "clashes"), [("hair_001", True), ("hair_01", False), ("hair_003", False)])
def test_another_filament_has_another_name(tmp_path, name, clashes):
    """Of two filaments of one name only the last would be written."""
    more = f"[filament.{name}]\nlength = 1\nnodes = 9\nbending = 1\nstretching = 100"
    copies = "{ count = 3, region = [[-1, -1, -1], [1, 1, 1]] }"
    if clashes:
        with pytest.raises(CaseError, match=r"filament\.hair_001: found the name of a copy of hair; allowed: another"):
            scene(tmp_path, copies, more)
    else:
        assert len(Simulation(scene(tmp_path, copies, more)).snapshot().filaments) == 4
