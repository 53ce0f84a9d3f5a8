"""The programs that tests of parallel/ run under mpiexec: `mpiexec -n P python on_processes.py WORD`."""

from __future__ import annotations

import hashlib
import sys

import numpy as np
from mpi4py import MPI

from ibfil.fluids.coupling import TRANSLATION
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.stokes import StokesSolve
from ibfil.fluids.torque_coupling import TorqueCoupling, TorqueStokesSolve
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.parallel import table
from ibfil.parallel.ranks import Ranks, serve
from ibfil.parallel.stokes import Placed, SharedStokesSolve, share
from ibfil.parallel.table import SharedSpace

CELLS = (20, 25, 18)  # none of which 3 divides but the last, which is not shared


def solves(ranks: Ranks) -> None:
    """For each kernel and solve a line: its largest relative difference from one process, and a digest of its bits."""
    grid, rng = Grid((2.0, 2.5, 1.8), CELLS), np.random.default_rng(1)
    r = rng.uniform(-3, 3, (60, 3))  # beyond the box too, and so across all borders
    few = r[:2] * (0.1, 1.0, 1.0)  # and such as leave planes of most processes alone
    for kernel, places in (("roma3", r), ("bkp6", r), ("peskin4", few)):
        stencil = KERNELS[kernel].stencil(grid.coordinates(places))
        for vectors, alone in ((1, StokesSolve), (2, TorqueStokesSolve)):
            force = rng.standard_normal((len(places), 3 * vectors))
            shared = share(ranks, grid, vectors, 1)
            placed = Placed(shared)
            for alpha in (0.0, 3.0):
                found = SharedStokesSolve(shared, placed, 1.3, alpha).velocity(*stencil, force)
                known = alone(grid, 1.3, alpha=alpha).velocity(*stencil, force)
                print(np.abs(found - known).max() / np.abs(known).max(), hashlib.md5(found.tobytes()).hexdigest())


def tables(ranks: Ranks) -> None:
    """For each coupling, and a fluid with inertia or without, the same of tables."""
    box = (2.0, 2.5, 1.8)
    twisted = TorqueCoupling(np.ones(1), np.ones(1))
    for coupling, alpha in ((TRANSLATION, 0.0), (twisted, 0.0), (twisted, 3.0)):
        known = PeriodicSpace(box, CELLS).mobility(coupling, 4, 1.3, alpha)._octant.values
        found = SharedSpace(box, CELLS, ranks).mobility(coupling, 4, 1.3, alpha)._octant.values
        print(np.abs(found - known).max() / np.abs(known).max(), hashlib.md5(found.tobytes()).hexdigest())


class Fails:
    """A part that fails on one process, amid what the others wait for."""

    def __init__(self, comm: MPI.Comm, where: int) -> None:
        self._comm, self._where = comm, where

    def work(self) -> None:
        """Fails there."""
        if self._comm.rank == self._where:
            raise MemoryError
        self._comm.barrier()


def fails(ranks: Ranks, where: int) -> None:
    """A call that fails on the process ``where``."""
    ranks.make(Fails, where).call("work")


if __name__ == "__main__":
    if MPI.COMM_WORLD.rank:
        serve(MPI.COMM_WORLD)
    else:
        with Ranks(MPI.COMM_WORLD) as together:
            if sys.argv[1] == "solves":
                solves(together)
                table.LARGE = 0
                tables(together)
            else:
                fails(together, int(sys.argv[2]))
