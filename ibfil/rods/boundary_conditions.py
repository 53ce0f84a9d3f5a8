"""The ends of the rods as data: which unknowns are held, how held ones move, where no moment is carried.

free      M = 0 (Q, M3, P and the twist source are zero there); nothing held
hinged    r held, M = 0: a ball joint
clamped   r and e3 held (the tangent stands in the stencils, mesh.py); e1 held, spun or free
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

Turn = Callable[[float, float], float]  # the angle turned between two times


class PrescribedEnd(NamedTuple):
    """One held end: its node in the stack, its turn if e1 is held there, its place over time if it moves."""

    node: int
    turn: Turn | None
    moves: Callable[[float], np.ndarray] | None = None


def steady(rate: float) -> Turn:
    """The turn of an end that spins at ``rate`` (rad per time); zero holds it."""
    return lambda before, after: rate * (after - before)


def spinning(rate: Callable[[float], float]) -> Turn:
    """The turn of an end that spins at rate(t), by Gauss-Legendre quadrature of 8 points over each step."""
    nodes, weights = np.polynomial.legendre.leggauss(8)

    def turn(before: float, after: float) -> float:
        half = 0.5 * (after - before)
        return half * sum(w * rate(before + half * (1 + x)) for x, w in zip(nodes, weights, strict=True))

    return turn


def turned(angle: Callable[[float], float]) -> Turn:
    """The turn of an end whose angle is prescribed."""
    return lambda before, after: angle(after) - angle(before)


class PrescribedEnds:
    """All held unknowns of a scene: flat indices node * m + component, and their displacements over a step."""

    def __init__(self, ends: Sequence[PrescribedEnd], unknowns: int, idle: np.ndarray) -> None:
        """``idle``: nodes of filaments that do not twist in a scene where others do; their turn is held at zero."""
        index: list[int] = []
        self._turns: list[tuple[int, Turn]] = []
        self._moves: list[tuple[int, Callable[[float], np.ndarray]]] = []
        for end in ends:
            if end.moves is not None:
                self._moves.append((len(index), end.moves))
            index += [end.node * unknowns + c for c in range(3)]
            if end.turn is not None and unknowns == 4:
                self._turns.append((len(index), end.turn))
                index.append(end.node * unknowns + 3)
        index += [int(node) * unknowns + 3 for node in idle if int(node) * unknowns + 3 not in index]
        self.index = np.array(index, np.int64)

    def motion(self, before: float, after: float) -> np.ndarray:
        """Displacements (k,) of the held unknowns between two times."""
        value = np.zeros(self.index.size)
        for k, turn in self._turns:
            value[k] = turn(before, after)
        for k, place in self._moves:
            value[k : k + 3] = place(after) - place(before)
        return value
