"""Hostile and broken input: no traceback, no crash, no hang, no memory taken, no code run, no file made.

Each try is a process of its own, forked, with limits on its processor time and memory; a crash shows as its signal.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.fake_simulation import case
from helpers.runs import interrupted, run

from ibfil.commands.main import main
from ibfil.io.paths import checkpoint_path

SECONDS, BYTES = 60, 8 * 2**30
CASE = """
title = "A rod"
[parameters]
u = 0.3
[filament.rod]
length = 1.0
nodes = 9
derivative = 2
bending = [1.0, "1 + s"]
stretching = 100.0
radius = 0.02
twisting = 1.0
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = { kind = "helix", radius = 0.1, pitch = "2*u" }
start = { end = "clamped", spin = 3.0 }
finish = { force = ["u", 0, "cos(t)"] }
[fluid]
model = "stokes"
viscosity = 1.0
box = [2.0, 2.0, 2.0]
cells = [16, 16, 16]
flow = ["u*y", 0, 0]
[time]
end = 0.01
step = 1e-3
[observe.tip]
kind = "position"
at = "finish"
along = [1, 0, 0]
[[stop]]
observe = "tip"
above = 10
[output]
every = 5e-3
"""
NASTY = [
    *("0", "-1", "1e308", "1e-308", "nan", "-inf", "1e9", "100000000000000000000000", "true", "[]", "{}", "''", '""'),
    *("1e59", "1e-59"),
    *('"9**9**9"', '"9**9**9**9"', '"1/0"', '"sqrt(-1)"', '"(" * 1000', '"s" ', '"x"', '"t*t*t"', '"u"', '"rft"'),
    *("\"__import__('os').system('touch pwned')\"", '"().__class__"', '"exec(1)"', "\"open('pwned', 'w')\""),
    *('"../../pwned"', '"/dev/zero"', '"/etc/passwd"', '"\\u0000"', '"nodes"', "[1, 2]", "[[[[1]]]]", "{ kind = 1 }"),
    '"' + "(" * 500 + "1" + ")" * 500 + '"',
    '"' + "+".join("s" * 3000) + '"',
    "[" + "1," * 5000 + "1]",
    '{ kind = "run", path = "." }',
    '{ kind = "file", path = "/dev/stdin" }',
    '{ kind = "expression", r = ["1e300*s", "exp(1e3*s)", "s"] }',
    "{ count = 1000000000, region = [[0, 0, 0], [1, 1, 1]] }",
    '"navier-stokes"',
    '"grid"',
]


def spawned(work: Callable[[], int], folder: Path) -> tuple[int, str]:
    """The exit status of the work in a forked process, and what it wrote to standard error; 99 for a traceback."""
    told = folder / "stderr"
    child = os.fork()
    if child == 0:
        status = 99
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
            with told.open("w") as err, open(os.devnull, "w") as out:
                os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
                os.dup2(err.fileno(), 2)
                sys.stdout, sys.stderr = out, err
                try:
                    status = work()
                except SystemExit as gone:
                    status = int(gone.code or 0)
                except BaseException:
                    import traceback

                    traceback.print_exc(file=err)
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), told.read_text(errors="replace")


def mutated(text: str, rng: random.Random) -> str:
    """The case with one or two changes: a value, a line gone or twice, a key misspelt, bytes of any kind."""
    for _ in range(rng.randint(1, 2)):
        lines = text.split("\n")
        i = rng.randrange(len(lines))
        kind = rng.random()
        if kind < 0.7 and "=" in lines[i]:
            lines[i] = lines[i].partition("=")[0] + "= " + rng.choice(NASTY)
        elif kind < 0.8:
            del lines[i]
        elif kind < 0.85:
            lines.insert(i, lines[rng.randrange(len(lines))])
        elif lines[i]:
            j = rng.randrange(len(lines[i]))
            lines[i] = (
                lines[i][:j] + chr(rng.choice([0, 9, 34, 91, 93, 123, 233, 0x1F600, *range(32, 127)])) + lines[i][j:]
            )
        text = "\n".join(lines)
    return text


def tried_cases(folder: Path, count: int, seed: int) -> dict[int, int]:
    """So many mutated cases given to `ibfil check`; how often each exit status came."""
    rng, seen = random.Random(seed), {}
    path = folder / "case.toml"
    for number in range(count):
        text = mutated(CASE, rng)
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        status, told = spawned(lambda: main(["check", str(path)]), folder)
        assert status in (0, 1, 2), f"try {number} of seed {seed}: {status}\n{told[-2000:]}\n{text}"
        assert status == 0 or told.startswith("ibfil: "), told
        assert {entry.name for entry in folder.iterdir()} <= {"case.toml", "stderr"}, text
        seen[status] = seen.get(status, 0) + 1
    return seen


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASE)
    assert main(["check", "case.toml"]) == 0  # compiled here, not in each of the processes to come
    return tmp_path


def test_mutated_cases_are_refused_or_checked(here):
    seen = tried_cases(here, 60, seed=1)
    assert seen[2] > 20
    assert seen.get(0, 0) > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_many_mutated_cases(here, seed):
    tried_cases(here, 300, seed)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("filament.rod.nodes=1000000000", "filament.rod.nodes: found 1000000000; allowed: at most 100000"),
        ("fluid.cells=[100000,100000,100000]", "for 1e+15 cells and 2.24e+07 GiB at least; allowed: what fits into"),
        ("fluid={model='stokes', viscosity=1, box=[2,2,2], thickness=1e-9}", "fluid.thickness: found 1e-09, for "),
        ("fluid={model='rft', viscosity=1, box=[2,2,2], cells=[99999,99999,99999], drag={matched=1}}", "fluid.cells: "),
        ("filament.rod.copies={count=1000000000, region=[[0,0,0],[1,1,1]]}", "copies.count: found 1000000000, for 9e"),
        ("filament.rod.shape.noise={amplitude=1e-3, modes=1000000000}", "noise.modes: found 1000000000"),
        ("output.every=1e-50", "output.every: found 1e-50, for 1e+48 outputs until time.end = 0.01; allowed: at"),
        ("time.end=1e50", "output.every: found 0.005, for 2e+52 outputs"),
        ("compute.threads=1000000000", "compute.threads: found 1000000000; allowed: at most 1024"),
        ("parameters.u='9**9**9'", "parameters.u"),
    ],
)
def test_too_much_is_refused_with_its_number_before_it_is_taken(here, change, told):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    status, said = spawned(lambda: main(["check", "case.toml", change]), here)
    assert status == 2, said
    assert told.replace("9e", "90000") in said or told in said
    assert before < BYTES / 1024


# --- damaged run files ------------------------------------------------------------------------------------------------


def tried_files(folder: Path, count: int, seed: int, words: Callable[[Path], list[list[str]]]) -> None:
    """A run file and its checkpoint, damaged in so many ways, given to commands that read them."""
    whole = folder / "whole.h5"
    interrupted(whole, 100, case(grid=True))
    kept = checkpoint_path(whole)
    data, state, rng = whole.read_bytes(), kept.read_bytes(), random.Random(seed)
    path, beside = folder / "run.h5", folder / "run.ckpt.h5"
    for number in range(count):
        path.write_bytes(damaged(data, rng))
        beside.write_bytes(damaged(state, rng) if number % 2 else state)
        for command in words(path):
            status, told = spawned(lambda command=command: main(command), folder)
            place = f"try {number} of seed {seed}, {command[0]}: {status}\n{told[-3000:]}"
            assert status in (0, 1, 2), place
            assert status == 0 or "ibfil: " in told, place
        for made in folder.glob("out*"):
            shutil.rmtree(made) if made.is_dir() else made.unlink()
        allowed = {
            "stderr",
            "case.toml",
            *(f"{stem}{end}" for stem in ("whole", "run") for end in (".h5", ".ckpt.h5", ".journal")),
        }
        assert {entry.name for entry in folder.iterdir()} <= allowed


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Bytes turned, zeroed or cut off."""
    out = bytearray(data)
    kind = rng.random()
    if kind < 0.2:
        return bytes(out[: rng.randrange(len(out))])
    if kind < 0.5:
        start = rng.randrange(len(out))
        length = min(len(out) - start, rng.choice([8, 64, 512, 4096]))
        out[start : start + length] = bytes(length)
    for _ in range(rng.choice([1, 4, 16, 64])):
        # Where HDF5 keeps its own tables, mostly: what they point to is numbers.
        at = rng.randrange(min(len(out), 60_000) if rng.random() < 0.7 else len(out))
        out[at] = rng.randrange(256)
    return bytes(out)


def reading(path: Path) -> list[list[str]]:
    return [["show", str(path), "--csv", str(path.with_name("out.csv"))]]


def test_damaged_run_files_are_read_or_refused(here):
    tried_files(here, 40, 1, reading)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 6))
def test_many_damaged_run_files(here, seed):
    def all_of(path: Path) -> list[list[str]]:
        return [*reading(path), ["vtk", str(path), "-o", str(path.with_name("out"))], ["run", "--resume", str(path)]]

    tried_files(here, 25, seed, all_of)


def test_a_hostile_case_inside_a_run_file_does_nothing(here):
    """The case is text in an attribute: it is parsed as any other, and its title is no path."""
    import h5py

    run(case("", "time.end=0.1"), here / "run.h5")
    assert main(["vtk", "run.h5", "-o", "out"]) == 0  # loaded here, not in each of the processes to come
    for text in (
        "",
        "title = 1",
        "[filament.'../../x']\n",
        '[time]\nend = "9**9**9"',
        CASE.replace("A rod", "../../x"),
    ):
        with h5py.File(here / "run.h5", "r+") as file:
            file.attrs["case"] = text
        for command in (["show", "run.h5"], ["vtk", "run.h5", "-o", "out"], ["run", "--resume", "run.h5"]):
            status, told = spawned(lambda command=command: main(command), here)
            assert status in (0, 2), told
        assert not list(here.parent.glob("x*"))
