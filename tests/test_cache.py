"""Tables kept in the user's cache: the same bits, made again where a file is not whole, bounded, two writers."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from ibfil import cache
from ibfil.fluids import coupling as coupling_module
from ibfil.fluids.coupling import TRANSLATION
from ibfil.fluids.spaces import periodic
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.grid import free_space

ROOT = Path(__file__).parents[1]
KEY = {"name": "a table", "size": 7}


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    """A cache folder of this test's own."""
    monkeypatch.setattr("platformdirs.user_cache_path", lambda name: tmp_path / name)
    return tmp_path / "ibfil" / "tables"


class Maker:
    """Makes an array of 7 x 3 numbers and counts how often."""

    def __init__(self, scale: float = 1.0) -> None:
        self.made, self.scale = 0, scale

    def __call__(self) -> np.ndarray:
        self.made += 1
        return self.scale * np.random.default_rng(1).normal(size=(7, 3))


def test_a_table_is_made_once_and_read_with_the_same_bits(own):
    make = Maker()
    first, second = cache.table(KEY, make), cache.table(KEY, make)
    assert make.made == 1
    assert first.tobytes() == second.tobytes()
    assert (first.shape, first.dtype, first.strides) == (second.shape, second.dtype, second.strides)
    assert second.flags.writeable
    assert second.flags.aligned  # what compiled kernels are compiled for
    other = Maker()
    cache.table({**KEY, "size": 8}, other)
    assert other.made == 1
    assert len(list(own.iterdir())) == 2


def signed(rest: bytes) -> bytes:
    """A file whose checksum is right."""
    return f"{zlib.crc32(rest):08x}\n".encode() + rest


def damaged(content: bytes) -> dict[str, bytes]:
    at = len(content) - 20
    rest = content.split(b"\n", 1)[1]
    return {
        "empty": b"",
        "cut in its checksum": content[:4],
        "cut in its key": content[:14],
        "cut in its numbers": content[:-8],
        "one bit": content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :],
        "of another shape": content.replace(b"[7, 3]", b"[3, 7]"),
        "of another key": signed(rest.replace(b'"size": 7', b'"size": 9')),
        "that claims too much": signed(rest.replace(b"[7, 3]", b"[700000000000, 3]")),
        "of another number": signed(rest.replace(b"<f8", b"<f0")),
        "of objects": signed(rest.replace(b"<f8", b"|O8")),
        "of no shape": signed(rest.replace(b"[7, 3]", b'{"a": 1}')),
        "pickled": signed(rest.split(b"\n")[0] + b"\n" + pickle.dumps(np.ones((7, 3)))),
        "no text": b"\xff\xfe" * 400,
        "endless line": b"x" * 2**18,
    }


@pytest.mark.parametrize("what", list(damaged(b"a\nb\n" + bytes(40))))
def test_a_file_that_is_not_whole_is_made_again(own, what):
    right = cache.table(KEY, Maker())
    (path,) = own.iterdir()
    content = path.read_bytes()
    bad = damaged(content)[what]
    assert bad != content
    path.write_bytes(bad)
    make = Maker()
    got = cache.table(KEY, make)
    assert make.made == 1
    assert got.tobytes() == right.tobytes()
    assert path.read_bytes() == content  # and is whole again


@pytest.mark.parametrize("where", ["ibfil", "ibfil/tables"])
def test_no_cache_is_no_fault(tmp_path, where):
    (tmp_path / where).parent.mkdir(exist_ok=True)
    (tmp_path / where).write_text("in the way")
    make = Maker()
    assert cache.table(KEY, make).tobytes() == cache.table(KEY, make).tobytes()
    assert make.made == 2


def test_what_was_not_used_for_longest_goes_first_and_what_is_too_large_is_not_kept(own, monkeypatch):
    size = 0
    for k in range(4):
        cache.table({"k": k}, Maker())
        size = max(path.stat().st_size for path in own.iterdir())
        for path in own.iterdir():  # an hour later
            os.utime(path, (path.stat().st_mtime - 3600,) * 2)
    cache.table({"k": 0}, Maker())  # used
    monkeypatch.setattr(cache, "TABLES", 4 * size)
    cache.table({"k": 4}, Maker())
    kept = {k: Maker() for k in range(5)}
    assert len(list(own.iterdir())) == 4
    for k in (0, 2, 3, 4):
        cache.table({"k": k}, kept[k])
    assert [kept[k].made for k in (0, 2, 3, 4)] == [0, 0, 0, 0]
    monkeypatch.setattr(cache, "TABLES", size)
    large = Maker()
    cache.table({"k": 9}, large)
    cache.table({"k": 9}, large)
    assert large.made == 2


WRITER = """
import sys
import numpy as np
import platformdirs
from pathlib import Path
platformdirs.user_cache_path = lambda name: Path(sys.argv[1]) / name
from ibfil import cache
for k in range(150):
    got = cache.table({"k": k % 3}, lambda: np.full((500, 40), float(k % 3)))
    assert got.shape == (500, 40) and (got == k % 3).all()
    if k % 5 == 0:
        for path in (Path(sys.argv[1]) / "ibfil" / "tables").glob("*.table"):
            path.unlink(missing_ok=True)
"""


def test_writers_and_readers_side_by_side_see_whole_tables_only(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", WRITER, str(tmp_path)]
    processes = [subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    assert [process.communicate(timeout=100)[1] for process in processes] == ["", "", ""]
    assert {path.suffix for path in (tmp_path / "ibfil" / "tables").iterdir()} <= {".table"}


def counted(monkeypatch) -> list[float]:
    calls: list[float] = []
    original = coupling_module.point_response

    def response(grid, viscosity, alpha=0.0):
        calls.append(viscosity)
        return original(grid, viscosity, alpha)

    monkeypatch.setattr(coupling_module, "point_response", response)
    monkeypatch.setattr(periodic, "_LARGE", 100)
    return calls


def test_the_octant_of_a_grid_is_kept_by_all_that_it_depends_on(own, monkeypatch):
    calls = counted(monkeypatch)
    space = PeriodicSpace((1.0, 1.0, 1.5), (8, 8, 12))
    many = [
        (space, 4, 1.0, np.float64),
        (space, 6, 1.0, np.float64),
        (space, 4, 1.0, np.float32),
        (PeriodicSpace((2.0, 2.0, 3.0), (8, 8, 12)), 4, 1.0, np.float64),
        (PeriodicSpace((1.0, 1.0, 2.0), (8, 8, 16)), 4, 1.0, np.float64),
    ]
    made = [where.mobility(TRANSLATION, points, eta, number=number)._octant for where, points, eta, number in many]
    assert len(calls) == len(many)
    again = [where.mobility(TRANSLATION, points, eta, number=number)._octant for where, points, eta, number in many]
    assert len(calls) == len(many)
    for one, other in zip(made, again, strict=True):
        assert one.values.tobytes() == other.values.tobytes()
        assert one.values.dtype == other.values.dtype
        np.testing.assert_array_equal(one.cells, other.cells)
    for eta in (3.0, 3.0):  # one table for all viscosities, with the bits of one that is not kept
        third = space.mobility(TRANSLATION, 4, eta)._octant.values
        assert len(calls) == len(many)
        with monkeypatch.context() as small:
            small.setattr(periodic, "_LARGE", 2**17)
            np.testing.assert_array_equal(third, space.mobility(TRANSLATION, 4, eta)._octant.values)
        calls.pop()
    monkeypatch.setattr(periodic, "_code", lambda: "changed")
    space.mobility(TRANSLATION, 4, 1.0)
    assert len(calls) == len(many) + 1


def test_small_grids_and_steps_with_inertia_leave_nothing(own, monkeypatch):
    calls = counted(monkeypatch)
    space = PeriodicSpace((1.0, 1.0, 1.0), (8, 8, 8))
    space.mobility(TRANSLATION, 4, 1.0, 3.0)
    monkeypatch.setattr(periodic, "_LARGE", 2**17)
    space.mobility(TRANSLATION, 4, 1.0)
    assert len(calls) == 2
    assert not own.exists()


def test_the_octant_of_free_space_is_made_once_for_all_scenes(own, monkeypatch):
    calls = []
    original = free_space.response

    def response(parts, sizes):
        calls.append(parts)
        return original(parts, sizes)

    monkeypatch.setattr(free_space, "response", response)
    made = []
    for _ in range(2):
        free_space._cube.cache_clear()
        made.append(free_space.octant(6, 3))
    free_space._cube.cache_clear()
    assert calls == [6]
    assert made[0].tobytes() == made[1].tobytes()


def test_the_code_is_part_of_a_key(tmp_path):
    (tmp_path / "a.py").write_text("x = 1")
    before = cache.code(tmp_path)
    assert before == cache.code(tmp_path)
    (tmp_path / "a.py").write_text("x = 2")
    assert cache.code(tmp_path) != before


def test_fftw_loads_nothing_of_dask():
    """Where Dask is installed pyfftw would load it; and it may be loaded after, or before."""
    told = (
        "import sys; from ibfil.grid.fftw import pyfftw; assert pyfftw.FFTW; "
        "assert not [name for name in sys.modules if name.startswith('dask')]; print('well')"
    )
    done = subprocess.run(
        [sys.executable, "-c", told], env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.stdout == "well\n", done.stderr
