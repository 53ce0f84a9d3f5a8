"""The part of one swimmer, rods and bodies that are joined, in the arrays of a scene."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...linalg.constraints import Carried, Clamps, Prescribed
from ...linalg.stiffness import Stiffness, no_pairs, nodes_of
from .shell import Shells


class Swimmer(NamedTuple):
    """The node ranges of its rods, and the numbers of its bodies and motors, each ascending."""

    rods: tuple[slice, ...]
    bodies: tuple[int, ...]
    motors: tuple[int, ...]

    def __or__(self, other: Swimmer) -> Swimmer:
        """Both in one."""
        rods = sorted((*self.rods, *other.rods), key=lambda rod: rod.start)
        bodies, motors = sorted(self.bodies + other.bodies), sorted(self.motors + other.motors)
        return Swimmer(tuple(rods), tuple(bodies), tuple(motors))


class Statement(NamedTuple):
    """All that a linear step is asked with (fluids/base.py)."""

    force: np.ndarray
    stiffness: Stiffness
    held: Prescribed
    y: np.ndarray
    target: np.ndarray

    def still(self) -> Statement:
        """The same where nothing moves but by what comes from elsewhere: corrections are linear in that."""
        carried, zero = self.held.carried, np.zeros_like(self.y)
        assert carried is not None
        clamps = carried.clamps
        if clamps is not None:
            clamps = clamps._replace(moment=np.zeros_like(clamps.moment))
        carried = carried._replace(
            value=np.zeros_like(carried.value),
            external=np.zeros_like(carried.external),
            want=np.zeros_like(carried.want),
            clamps=clamps,
        )
        held = Prescribed(self.held.at, np.zeros_like(self.held.value), carried)
        return Statement(zero, self.stiffness, held, zero, zero)


class Part:
    """A swimmer's own rows, markers and unknowns, in arrays of N rows and lists of all nodes and markers."""

    def __init__(self, swimmer: Swimmer, shells: Shells, rows: int) -> None:
        self.rods = swimmer.rods
        self.nodes = nodes_of(swimmer.rods) if swimmer.rods else np.zeros(0, np.int64)
        bodies, motors = np.array(swimmer.bodies, np.int64), np.array(swimmer.motors, np.int64)
        both = (shells.nodes + 2 * bodies[:, None] + np.arange(2)).ravel()
        self.rows = np.concatenate([self.nodes, both, shells.end + motors])
        turned = 6 * len(shells.markers) + motors
        self.q = np.concatenate([(6 * bodies[:, None] + np.arange(6)).ravel(), turned])
        first = np.concatenate([[0], np.cumsum([len(cloud) for cloud in shells.markers])]).astype(np.int64)
        own = [np.arange(first[b], first[b + 1]) for b in swimmer.bodies]
        self.markers = np.concatenate([np.zeros(0, np.int64), *own])
        self.points = np.concatenate([self.nodes, shells.nodes + self.markers])
        self.shells = Shells(len(self.nodes), tuple(shells.markers[b] for b in swimmer.bodies), shells.length)
        self._n, self._place = shells.nodes, np.full(rows, -1)
        self._place[self.rows] = np.arange(len(self.rows))
        self._stiffness: tuple[Stiffness, Stiffness] | None = None  # the last one of the scene, and its part

    def statement(self, whole: Statement) -> Statement:
        """Its part of a linear step."""
        rows, m, carried = self.rows, whole.y.shape[1], whole.held.carried
        assert carried is not None
        here, at = self._inside(whole.held.at, m)
        held = Prescribed(at, whole.held.value[here], self._carried(carried, m))
        return Statement(whole.force[rows], self._part(whole.stiffness), held, whole.y[rows], whole.target[rows])

    def _part(self, whole: Stiffness) -> Stiffness:
        """Of the same stiffness the same part, whose factors serve."""
        if self._stiffness is None or self._stiffness[0] is not whole:
            self._stiffness = whole, _stiffness(whole, self.rods)
        return self._stiffness[1]

    def _inside(self, at: np.ndarray, m: int) -> tuple[np.ndarray, np.ndarray]:
        """Which of flat indices (k,) are of its rows, and where these are among them."""
        place = self._place[at // m]
        here = np.nonzero(place >= 0)[0]
        return here, place[here] * m + at[here] % m

    def _carried(self, whole: Carried, m: int) -> Carried:
        q, nodes, loads = self.q, self.nodes, whole.external_stiffness
        here, at = self._inside(whole.at, m)
        return Carried(
            at=at,
            value=whole.value[here],
            lever=whole.lever[here][:, q],
            by=self._inside(whole.by, m)[1],
            columns=whole.columns[nodes][:, :, q],
            balance=self._of_nodes(whole.balance, m),
            external=whole.external[nodes],
            external_stiffness=None if loads is None else _stiffness(loads, self.rods),
            external_columns=whole.external_columns[nodes][:, :, q],
            want=whole.want[q],
            slope=whole.slope[np.ix_(q, q)],
            drag=whole.drag[q],
            clamps=None if whole.clamps is None else self._clamps(whole.clamps, m),
        )

    def _clamps(self, whole: Clamps, m: int) -> Clamps | None:
        place, q = self._place[whole.nodes], self.q
        here = np.nonzero(place >= 0)[0]
        if not here.size:
            return None
        by_nodes, by_tangents = self._of_nodes(whole.by_nodes, m), whole.by_tangents[np.ix_(q, q)]
        return Clamps(place[here], whole.sums[np.ix_(q, here)], whole.moment[q], by_nodes, by_tangents)

    def _of_nodes(self, rows: np.ndarray, m: int) -> np.ndarray:
        """Its part (p, n m) of rows by all nodes."""
        return rows[self.q].reshape(len(self.q), self._n, m)[:, self.nodes].reshape(len(self.q), -1)


def _stiffness(whole: Stiffness, rods: tuple[slice, ...]) -> Stiffness:
    """That of some rods; there may be none."""
    return whole.of(rods) if rods else Stiffness(whole.band[:0], no_pairs(whole.band.shape[1]))
