"""The work of one process of many on its share of a grid, measured by a process alone, and of a step from it.

The share is that of process 0 of P in everything but what the others would send: they send nothing, and messages are
counted apart, by bandwidth and latency. So shares of 64 are measured on one core.

    T(P) = T_0 + sum over calls of the share's seconds + exchanges [bytes (P - 1)/P^2 / bandwidth + (P - 1) latency]

T_0 is what process 0 does besides; bytes are those of a component's modes, in an exchange each way. Nodes are taken to
touch all planes: where they do not, there is less to do and to send.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..fluids.history import weights
from ..grid.kernels import KERNELS
from ..parallel.inertia import InertialPart
from ..parallel.part import GridPart
from ..parallel.ranks import Ranks

BOX = (3.2, 3.2, 3.2)


class Network(NamedTuple):
    """Bytes a second, and seconds a message, of one process of many."""

    bandwidth: float
    latency: float

    def exchange(self, cells: int, processes: int) -> float:
        """Seconds in which the modes of a component go from planes to rows, or back."""
        size = 16.0 * cells * cells * (cells // 2 + 1)
        return size * (processes - 1) / processes**2 / self.bandwidth + (processes - 1) * self.latency


class Absent:
    """The communicator of process 0 of ``size`` whose others are not there: they send nothing."""

    rank = 0

    def __init__(self, size: int) -> None:
        self.size = size

    def bcast(self, value: Any) -> Any:
        """The value."""
        return value

    def allgather(self, value: Any) -> list[Any]:
        """The value, of this process alone."""
        return [value]

    def Scatterv(self, sent: list[Any], come: np.ndarray) -> None:
        """The part that it sends itself."""
        come.ravel()[:] = sent[0].ravel()[: come.size]

    def Gatherv(self, sent: np.ndarray, come: list[Any]) -> None:
        """The same."""
        come[0].ravel()[: sent.size] = sent.ravel()

    def Alltoallv(self, sent: list[Any], come: list[Any]) -> None:
        """The same: the first of what is sent, to the first of what comes."""
        mine = sent[1][0]
        come[0].ravel()[:mine] = sent[0].ravel()[:mine]


class Timed(Ranks):
    """Processes, the seconds of work in calls since they were last looked at, and how many there were of each."""

    def __init__(self, comm: Any) -> None:
        super().__init__(comm)
        self.seconds = 0.0
        self.calls: Counter[str] = Counter()

    def look(self) -> tuple[float, Counter[str]]:
        """The seconds and the calls, which begin anew."""
        found = self.seconds, self.calls
        self.seconds, self.calls = 0.0, Counter()
        return found

    def call(self, shared: Any, method: str, *given: Any) -> Any:
        """That of Ranks."""
        began = time.process_time()
        out = super().call(shared, method, *given)
        self.seconds += time.process_time() - began
        self.calls[method] += 1
        return out


class Seconds(NamedTuple):
    """By the clock on the wall, and of work on a core: the same for one process on a machine that has nothing else."""

    wall: float
    work: float


def timed(work: Callable[[], object]) -> Seconds:
    """Those of a call."""
    wall, worked = time.perf_counter(), time.process_time()
    work()
    return Seconds(time.perf_counter() - wall, time.process_time() - worked)


def least(work: Callable[[], object], turns: int) -> Seconds:
    """The least of each."""
    walls, works = zip(*(timed(work) for _ in range(turns)), strict=True)
    return Seconds(min(walls), min(works))


EXCHANGES = {"velocity": 6, "coast": 3, "push": 3 + 6 + 3, "place": 0}  # of components


def share(cells: int, processes: int, turns: int) -> dict[str, float]:
    """Seconds of work of each kind of call for one of so many processes, where nodes touch all planes."""
    comm = Absent(processes)
    grid = GridPart(comm, BOX, (cells,) * 3)
    r = np.zeros((cells // 2, 3))
    r[:, 0] = np.linspace(-0.5, 0.5, len(r)) * BOX[0]
    stencil, force = KERNELS["peskin4"].stencil(grid.grid.coordinates(r)), np.cos(np.arange(3.0 * len(r)))
    force = force.reshape(-1, 3)
    grid.place(stencil)
    found = {"velocity": least(lambda: grid.velocity(1.0, 0.0, force), turns).work}
    found["place"] = least(lambda: grid.place(stencil), turns).work
    fluid = InertialPart(comm, BOX, (cells,) * 3, 1, 1, float, 10.0, 1.0)
    fluid.place(stencil)
    past = weights(10.0 / 0.0125, 0.0125, 0.0, 0.0)
    found["coast"] = least(lambda: fluid.coast(past), turns).work
    found["push"] = least(lambda: fluid.push(past, (), force), turns).work
    return found


def of_step(
    alone: float, calls: Counter[str], shares: dict[str, float], network: Network, cells: int, processes: int
) -> float:
    """Seconds of a step that makes such calls, of such ``shares``, and takes process 0 ``alone`` besides."""
    exchanges = sum(EXCHANGES[kind] * count for kind, count in calls.items())
    work = sum(shares[kind] * count for kind, count in calls.items())
    return alone + work + exchanges * network.exchange(cells, processes)
