"""FFTs by FFTW, and its plans remembered as wisdom."""

from __future__ import annotations

import base64
import json

import numpy as np
import pyfftw
import pytest

from ibfil.case.reading import parse_case
from ibfil.grid import fft
from ibfil.grid.fft import VectorTransform
from ibfil.grid.padded_fft import PaddedTransform
from ibfil.running.run import run

CELLS = (10, 9, 14)


@pytest.fixture(autouse=True)
def _own_plans(tmp_path, monkeypatch):
    """A cache folder of this test's own, and no plans from elsewhere; those of before come back after it."""
    before = pyfftw.export_wisdom()
    pyfftw.forget_wisdom()
    monkeypatch.setattr("platformdirs.user_cache_path", lambda name: tmp_path / "cache" / name)
    yield
    pyfftw.forget_wisdom()
    pyfftw.import_wisdom(before)


def known(cells: tuple[int, int, int]) -> bool:
    """Whether FFTW has a measured plan of this transform."""
    real = pyfftw.empty_aligned(cells)
    modes = pyfftw.empty_aligned((*cells[:2], cells[2] // 2 + 1), dtype=complex)
    try:
        pyfftw.FFTW(real, modes, axes=(0, 1, 2), flags=("FFTW_MEASURE", "FFTW_WISDOM_ONLY"))
    except RuntimeError:
        return False
    return True


def plans(text: str) -> list[list[bytes]]:
    """The plans in a text; FFTW writes them in no order."""
    return [sorted(base64.b64decode(part).splitlines()) for part in json.loads(text)]


# --- transforms ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cells", [(8, 8, 8), (10, 9, 14), (5, 12, 7)])
@pytest.mark.parametrize("planning", ["FFTW_ESTIMATE", "FFTW_MEASURE"])
def test_transforms_are_those_of_numpy(cells, planning):
    transform = VectorTransform(cells, planning=planning)
    field = np.random.default_rng(0).standard_normal((3, *cells))
    assert not transform.real.any()
    transform.real[:] = field
    modes = transform.forward()
    expected = np.fft.rfftn(field, axes=(1, 2, 3))
    assert np.abs(modes - expected).max() < 1e-14 * np.abs(expected).max() * 10
    assert np.array_equal(transform.real, field)
    back = transform.backward()
    assert back is transform.real
    assert transform.size == np.prod(cells)
    assert np.abs(back / transform.size - field).max() < 1e-14


def test_two_threads_give_the_same_numbers():
    field = np.random.default_rng(1).standard_normal((3, *CELLS))
    modes = []
    for threads in (1, 2):
        transform = VectorTransform(CELLS, threads, "FFTW_ESTIMATE")
        transform.real[:] = field
        modes.append(transform.forward().copy())
    assert np.abs(modes[0] - modes[1]).max() < 1e-14 * np.abs(modes[0]).max() * 10


# --- wisdom ----------------------------------------------------------------------------------------------------------


def test_wisdom_of_a_run_file_comes_back():
    VectorTransform(CELLS)
    text = fft.wisdom()
    assert "\n" not in text
    pyfftw.forget_wisdom()
    assert not known(CELLS)
    fft.learn(text)
    assert known(CELLS)
    assert plans(fft.wisdom()) == plans(text)


def test_plans_are_remembered_between_runs_in_the_users_cache():
    VectorTransform(CELLS)
    file = fft.wisdom_file()
    assert {p.name for p in file.parent.iterdir()} == {file.name, "fftw-wisdom.lock"}  # the partial file is gone
    pyfftw.forget_wisdom()
    fft.learn()
    assert known(CELLS)


def test_a_plan_that_another_process_has_found_meanwhile_is_taken():
    VectorTransform(CELLS)
    pyfftw.forget_wisdom()
    before = fft.wisdom_file().read_bytes()
    VectorTransform(CELLS)
    assert plans(fft.wisdom()) == plans(before.decode())
    assert fft.wisdom_file().read_bytes() == before


RUN = """
[filament.rod]
length = 1.0
nodes = 25
bending = 1.0
twisting = 1.0
radius = 0.05
stretching = 400
curvature = ["6*sin(6*s - 200*t)", "4*s"]
shape = { kind = "relaxed" }
[fluid]
model = "stokes"
method = "pruned"
viscosity = 1.0
density = 1.0
box = [3, 3, 3]
cells = [30, 30, 30]
[time]
end = 0.02
step = 1e-3
[output]
every = 0.02
"""


def shape_after(*overrides: str) -> bytes:
    """The bits that a run ends with."""
    return (
        run(parse_case(RUN, "rod.toml", overrides), progress=False, log=len)
        .snapshot.filaments["rod"]
        .position.tobytes()
    )


NAVIER_STOKES = ("fluid.model=navier-stokes", "fluid.method=auto")


@pytest.mark.parametrize(
    "overrides", [(), ("fluid.method=fft",), NAVIER_STOKES], ids=["pruned", "fft", "navier-stokes"]
)
@pytest.mark.parametrize("cache", ["kept", "none"])
def test_equal_runs_have_equal_bits(tmp_path, overrides, cache):
    """Also where the first has measured its plans, the second knows those of other runs, or none can be kept."""
    if cache == "none":
        (tmp_path / "cache").write_text("in the way")
    first = shape_after(*overrides)
    pyfftw.forget_wisdom()
    second = shape_after(*overrides)
    for cells in ((30, 30, 30), (12, 30, 30), (30, 16, 30)):
        VectorTransform(cells)
    assert shape_after(*overrides) == second == first


def test_wisdom_given_is_taken_and_the_cache_is_not():
    VectorTransform((6, 6, 6))
    given = fft.wisdom()
    VectorTransform(CELLS)
    fft.remember()
    pyfftw.forget_wisdom()
    fft.learn(given)
    assert known((6, 6, 6))
    assert not known(CELLS)


def test_no_cache_is_no_fault():
    assert not fft.wisdom_file().exists()
    fft.learn()
    assert not known(CELLS)


def whole() -> str:
    VectorTransform(CELLS)
    return fft.wisdom()


DAMAGED = {
    "empty": b"",
    "not JSON": b"wisdom?",
    "a number": b"5",
    "a table": b'{"a": 1}',
    "null": b"null",
    "not base64": b'["!!", "??", "##"]',
    "not ASCII": '["ä", "ö", "ü"]'.encode(),
    "not text": b"\xff\xfe\x00\x9d",
    "too few": b'["aa=="]',
    "too many": b'["YQ==", "YQ==", "YQ==", "YQ=="]',
    "numbers": b"[1, 2, 3]",
    "another's words": json.dumps([base64.b64encode(b"(fftw-3.3 (x))").decode()] * 3).encode(),
    "zeros": json.dumps([base64.b64encode(bytes(40)).decode()] * 3).encode(),
    "nested": b"[" * 100_000,
}


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_cache_costs_planning_time_and_nothing_else(content):
    file = fft.wisdom_file()
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    fft.learn()
    VectorTransform(CELLS)
    fft.remember()  # and the damage is mended
    pyfftw.forget_wisdom()
    fft.learn()
    assert known(CELLS)


@pytest.mark.parametrize("cut", [0.3, 0.6, 0.95])
def test_a_cache_cut_short_is_no_fault(cut):
    text = whole()
    file = fft.wisdom_file()
    file.write_text(text[: int(cut * len(text))])
    fft.learn()
    words = [base64.b64decode(part) for part in json.loads(text)]
    file.write_text(json.dumps([base64.b64encode(w[: int(cut * len(w))]).decode() for w in words]))
    fft.learn()


@pytest.mark.parametrize("where", ["cache", "cache/ibfil"])
def test_a_cache_folder_that_cannot_be_made_is_no_fault(tmp_path, where):
    file = tmp_path / where  # a file where a folder should be: no user, not even root, can write below it
    file.parent.mkdir(exist_ok=True)
    file.write_text("in the way")
    fft.learn()
    VectorTransform(CELLS)
    fft.remember()
    assert file.read_text() == "in the way"


def test_a_cache_that_cannot_be_replaced_is_no_fault_and_leaves_nothing_behind():
    file = fft.wisdom_file()
    file.mkdir(parents=True)  # a folder where the file should be
    VectorTransform(CELLS)
    assert file.is_dir()
    fft.learn()
    assert {p.name for p in file.parent.iterdir()} == {file.name, "fftw-wisdom.lock"}


@pytest.mark.parametrize("cells", [(8, 12, 10), (2, 6, 4), (4, 96, 40)])
def test_a_padded_transform_is_the_whole_one_of_half_a_box(cells: tuple[int, int, int]) -> None:
    """Forth, and back from modes that fill the whole box; in one block and several; twice, for what is left behind."""
    whole, padded = VectorTransform(cells, fields=6), PaddedTransform(cells, fields=6)
    x, y, z = (n // 2 for n in cells)
    rng = np.random.default_rng(0)
    factors = rng.standard_normal((*cells[:2], cells[2] // 2 + 1))
    for _ in range(2):
        whole.real[:], padded.real[:] = 0.0, 0.0
        whole.real[:, :x, :y, :z] = padded.real[..., :z] = rng.standard_normal((6, x, y, z))
        seen = np.zeros_like(whole.modes)

        def work(modes: np.ndarray, first: int, seen: np.ndarray = seen) -> None:
            lines = slice(first, first + modes.shape[2])
            seen[:, :, lines] = modes
            modes *= factors[:, lines]

        felt = padded.through(work)[..., :z]
        assert seen == pytest.approx(whole.forward(6), abs=1e-11)
        whole.modes *= factors
        expected = whole.backward(6)[:, :x, :y, :z]
        assert felt == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
