"""A fluid around a fluid tells the one inside what it must know, and keeps its own memory apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ibfil.fluids.base import Memoryless, Solution
from ibfil.fluids.wrapped.fluid import Wrapped
from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.stiffness import Stiffness, no_pairs

N, M = 5, 3
FREE = Prescribed(np.zeros(0, np.int64), np.zeros(0))
ZERO = np.zeros((N, M))


class Inside(Memoryless):
    """A fluid that writes down what it is asked and told; its response keeps the stiffness or uses it up."""

    def __init__(self, keeps: bool) -> None:
        self.keeps, self.asked, self.told, self.recalled = keeps, [], [], None

    def response(self, *given: Any) -> Inside:
        return self

    def implicit(self, force, stiffness, held, y, target, error=0.0) -> Solution:
        self.asked.append(stiffness)
        move, pushed = 0.5 * force, force.copy()
        if not self.keeps:
            stiffness.band[:] = np.nan
        return Solution(move, pushed, ZERO)

    def advance(self, response: Inside, velocity: np.ndarray, force: np.ndarray) -> None:
        self.told.append((response, velocity, force))

    def memory(self) -> dict[str, np.ndarray | float]:
        return {"inside": 1.0}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        self.recalled = memory


class Pull:
    """2 - 3 u on every unknown, done by the fluid or by the rods."""

    def __init__(self, by_fluid: bool) -> None:
        self.by_fluid, self.velocity, self.tau = by_fluid, 0.0, 1.0

    def frozen(self, r, e3, time, tau, w) -> Pull:
        self.tau = tau
        return self

    def add(self, constant: np.ndarray, matrix: np.ndarray) -> None:
        constant += 2.0
        for a in range(M):
            matrix[:, a, M + a] += 3.0 / self.tau

    def from_fluid(self, u: np.ndarray) -> np.ndarray | None:
        return 2.0 - 3.0 * u if self.by_fluid else None

    def advance(self, velocity: np.ndarray) -> None:
        self.velocity = float(velocity[0, 0])

    def memory(self) -> dict[str, np.ndarray | float]:
        return {"pull": self.velocity}

    def recall(self, memory: dict[str, np.ndarray | float]) -> None:
        self.velocity = float(memory["pull"])


@pytest.mark.parametrize("by_fluid", [True, False])
def test_the_fluid_inside_is_told_all_that_pushes_it(by_fluid):
    inside, force, velocity = Inside(True), np.full((N, M), 7.0), np.full((N, M), 0.5)
    fluid = Wrapped(inside, [Pull(by_fluid)], 1)
    fluid.advance(fluid.response(ZERO, ZERO, 0.0, 0.1), velocity, force)
    ((response, u, pushed),) = inside.told
    assert response is inside
    assert u is velocity
    assert pushed == pytest.approx(force + (0.5 if by_fluid else 0.0))


@pytest.mark.parametrize("by_fluid", [True, False])
def test_the_force_of_an_answer_is_that_of_the_rods(by_fluid):
    """Inside it is f + 2 - 3 u at u = (y + d - target)/tau; the fluid's own part of it is no rod's."""
    inside, force, target = Inside(True), np.full((N, M), 7.0), np.full((N, M), 0.2)
    response = Wrapped(inside, [Pull(by_fluid)], 1).response(ZERO, ZERO, 0.0, 0.1)
    answer = response.forced(force, FREE, target)
    felt = 7.0 + 2.0 + 3.0 * 0.2 / 0.1
    assert answer.move == pytest.approx(0.5 * felt)
    of_fluid = 2.0 - 3.0 * (0.5 * felt - 0.2) / 0.1 if by_fluid else 0.0
    assert answer.force == pytest.approx(felt - of_fluid)


@pytest.mark.parametrize("keeps", [True, False])
def test_one_matrix_for_one_stiffness_where_the_fluid_keeps_factors(keeps):
    inside, stiffness = Inside(keeps), Stiffness(np.ones((N, M, 3 * M)), no_pairs(M))
    response = Wrapped(inside, [Pull(True)], 1).response(ZERO, ZERO, 0.0, 0.1)
    for _ in range(2):
        response.implicit(ZERO, stiffness if keeps else stiffness.copy(), FREE, ZERO, ZERO)
        response.forced(ZERO, FREE, ZERO)
    first, alone, second, again = inside.asked
    assert (first is second) == (alone is again) == keeps
    if keeps:
        assert first.band[:, 0, M] == pytest.approx(1.0 - 30.0)
        assert alone.band[:, 0, M] == pytest.approx(-30.0)
        assert np.all(stiffness.band == 1.0)
        response.forced(ZERO, Prescribed(np.array([0]), np.zeros(1)), ZERO)  # others are held: factors of its own
        assert inside.asked[-1] is not alone


def test_each_recalls_its_own():
    inside, pull = Inside(True), Pull(True)
    fluid = Wrapped(inside, [pull], 1)
    assert fluid.memory() == {"inside": 1.0, "pull": 0.0}
    fluid.recall({"inside": 5.0, "pull": 4.0})
    assert inside.recalled == {"inside": 5.0}
    assert pull.velocity == 4.0
    inside.recalled = None
    fluid.recall({"pull": 3.0})
    assert inside.recalled is None  # a fluid is not asked to recall nothing
