"""One run on two processes against one, and its share of many, give numbers; how fast they are is never tested."""

import math
from collections import Counter

import numpy as np
import pytest
from parallel.test_shared import needs_mpi

from ibfil.bench import parts, processes, share
from ibfil.errors import CaseError
from ibfil.grid.kernels import KERNELS
from ibfil.parallel.part import GridPart


@needs_mpi
@pytest.mark.slow
def test_two_processes_are_measured_against_one():
    rows = processes.measured(cells=16, turns=2)
    assert [row.bar for row in rows] == [None, *[1.25, None, None, None, None] * 3]
    for row in rows:
        assert math.isfinite(row.ratio)
        assert min(row.seconds, row.floor_seconds, row.ratio) > 0


def test_without_mpi_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setattr(processes.shutil, "which", lambda name, path: None)
    with pytest.raises(CaseError, match=r"bench mpi: found no mpiexec.*pip install 'ibfil\[mpi\]' mpich"):
        parts.main(parts=["mpi"])


def test_a_step_is_foretold_of_its_calls_and_messages():
    """Twice the calls take twice the time but for what process 0 does alone; a slow network is told."""
    free, slow = share.Network(1e30, 0.0), share.Network(1e6, 0.0)
    shares = {"velocity": 2.0, "push": 3.0}
    calls = Counter(velocity=4, push=1)
    assert share.of_step(1.0, calls, shares, free, 16, 8) == pytest.approx(1.0 + 4 * 2.0 + 3.0)
    size = 16.0 * 16 * 16 * 9
    expected = 12.0 + (4 * 6 + 12) * size * 7 / 64 / 1e6
    assert share.of_step(1.0, calls, shares, slow, 16, 8) == pytest.approx(expected)


def test_a_share_by_itself_does_its_part_of_the_whole():
    """With no others the share of one of one is the whole solve."""
    part = GridPart(share.Absent(1), share.BOX, (12, 12, 12))
    stencil = KERNELS["peskin4"].stencil(part.grid.coordinates(np.zeros((1, 3))))
    part.place(stencil)
    force = np.array([[1.0, 0.0, 0.0]])
    found = part.velocity(1.0, 0.0, force)
    from ibfil.fluids.stokes import StokesSolve

    assert found == pytest.approx(StokesSolve(part.grid, 1.0).velocity(*stencil, force), rel=1e-12, abs=1e-14)
    assert set(share.share(8, 4, 1)) == {"velocity", "place", "coast", "push"}
