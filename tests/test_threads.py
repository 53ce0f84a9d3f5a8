"""Every public entry from several threads at the same time: the same bits as alone, or a sentence that refuses."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from helpers.made_run import make_run
from helpers.runs import rod

import ibfil
from ibfil.threads import one_thread_of_blas

FLUIDS = {
    "rft": ["fluid.drag=slender"],
    "table": ["fluid.model=stokes", "fluid.method=table"],
    "pruned": ["fluid.model=stokes", "fluid.method=pruned"],
    "navier-stokes": ["fluid.model=navier-stokes"],
}
TIMES = (0.0, 0.25, 0.4, 1.0)


def in_threads(do, count: int, threads: int = 4) -> list:
    """What ``do`` gives for 0, 1, ... count - 1, in so many threads."""
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(do, range(count)))


@pytest.mark.parametrize("fluid", FLUIDS)
def test_runs_side_by_side_have_the_bits_of_runs_alone(fluid, tmp_path):
    def ends(number: int) -> tuple[bytes, bytes]:
        case = rod(*FLUIDS[fluid], f"fluid.viscosity={1 + number % 3}")()
        result = ibfil.run(case, tmp_path / f"{threading.get_ident()}_{number}.h5", progress=False, log=len)
        with ibfil.open(result.path) as opened:
            return result.snapshot.filaments["rod"].position.tobytes(), opened.position().tobytes()

    alone = [ends(number) for number in range(3)]
    assert in_threads(ends, 6) == [alone[number % 3] for number in range(6)]


def test_one_opened_run_may_be_asked_by_several_threads(tmp_path):
    make_run(tmp_path / "made.h5")
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3))
    with ibfil.open(tmp_path / "made.h5") as run:

        def asked(number: int) -> bytes:
            time = TIMES[number % 4]
            flow, mesh = run.velocity_at(points, time), run.mesh(time)
            position = run.filaments["long"]["position"][number % len(run)]
            return flow.tobytes() + mesh.points.tobytes() + position.tobytes()

        alone = [asked(number) for number in range(20)]
        assert in_threads(asked, 60) == [alone[number % 20] for number in range(60)]


def test_files_for_paraview_by_several_threads(tmp_path):
    make_run(tmp_path / "made.h5")
    alone = ibfil.write_vtk(tmp_path / "made.h5", tmp_path / "alone", log=len)
    paths = in_threads(lambda k: ibfil.write_vtk(tmp_path / "made.h5", tmp_path / f"folder{k % 2}", log=len), 4)
    for path in paths:
        names = {one.name for one in alone.parent.iterdir()}
        assert {one.name for one in path.parent.iterdir()} == names
        for name in names - {"made_paraview.py"}:  # which names its folder
            assert (path.parent / name).read_bytes() == (alone.parent / name).read_bytes()


def test_members_by_several_threads(tmp_path):
    def members(number: int) -> list[str]:
        made = [
            ibfil.Member(f"m{k}", Path(tmp_path / "rod.toml").as_posix(), (f"fluid.viscosity={k + 1}",)) for k in (0, 1)
        ]
        return [one.status for one in ibfil.run_members(made, tmp_path / f"folder{number}", log=len)]

    (tmp_path / "rod.toml").write_text(rod()().text)
    assert in_threads(members, 3) == [["finished", "finished"]] * 3


def test_a_simulation_in_use_by_another_thread_refuses_with_a_sentence():
    simulation, begun, done = ibfil.Simulation(rod()()), threading.Event(), threading.Event()

    def wait() -> None:
        begun.set()
        done.wait(60)

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(simulation.advance, 1e-3, wait)
        begun.wait(60)
        for use in (lambda: simulation.advance(2e-3, len), simulation.snapshot, simulation.state):
            with pytest.raises(RuntimeError, match="in use by another thread; make one for each thread"):
                use()
        done.set()
        other.result(60)
    simulation.advance(2e-3, lambda: simulation.snapshot())
    assert simulation.time == 2e-3


def test_blas_keeps_to_one_thread_until_the_last_run_is_done():
    from threadpoolctl import threadpool_info

    def most() -> int:
        return max((one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"), default=1)

    before = most()
    first, second = one_thread_of_blas(), one_thread_of_blas()
    first.__enter__(), second.__enter__()
    first.__exit__(None, None, None)
    assert most() == 1
    second.__exit__(None, None, None)
    assert most() == before
