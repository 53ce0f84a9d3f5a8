"""Newton's iteration of an implicit step: where it begins, how often it goes round, what error it leaves."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import RFT, STOKES, swimmer

from ibfil.rods.geometry import measure, turned
from ibfil.rods.mesh import Segmented, stack
from ibfil.simulation.simulation import Simulation
from ibfil.timestepping.implicit import Implicit, _Equation, _size

FLUIDS = pytest.mark.parametrize("fluid", [RFT, STOKES], ids=["rft", "stokes"])


def helix(n: int) -> np.ndarray:
    s = np.linspace(0.0, 1.0, n)
    return np.stack([s, 0.1 * np.sin(8 * s), 0.1 * np.cos(8 * s)], axis=1)


@pytest.mark.parametrize("held", [(), (0,), (10,), (0, 10)], ids=["free", "first", "last", "both"])
def test_segments_turn_with_displacements_and_keep_their_length(held: tuple[int, ...]) -> None:
    """Two rods, the ends of the first held; displacements that stretch by some per cent."""
    part = Segmented(np.linspace(0.0, 1.0, 11), 2, None, None)
    mesh = stack([part, part])
    r = np.concatenate([helix(11), helix(11) + 2.0])
    start = measure(mesh, r, np.tile([0.0, 0.0, 1.0], (22, 1)))
    y = 0.05 * np.random.default_rng(1).standard_normal((22, 4))
    fixed = np.zeros(22, bool)
    fixed[list(held)] = True
    found = turned(mesh, start, fixed, y)
    assert np.array_equal(found[:, 3], y[:, 3])
    for rod in (slice(0, 11), slice(11, 22)):
        gaps, wanted = (np.diff((r + z[:, :3])[rod], axis=0) for z in (found, y))
        lengths, before = np.linalg.norm(gaps, axis=1), start.length[rod][:-1]
        if rod.start == 0 and held == (0, 10):  # between two places that it cannot leave it has to stretch
            rest = gaps - before[:, None] * wanted / np.linalg.norm(wanted, axis=1)[:, None]
            assert np.allclose(rest, rest[0], atol=1e-14)
        else:
            assert np.allclose(lengths, before, rtol=1e-14)
            assert np.allclose(gaps / lengths[:, None], wanted / np.linalg.norm(wanted, axis=1)[:, None], atol=1e-13)
    for node in held:
        assert np.allclose(found[node], y[node], atol=1e-15)
    if not held:
        assert np.allclose(found[:11].mean(axis=0), y[:11].mean(axis=0), atol=1e-15)
    assert np.allclose(found[11:].mean(axis=0), y[11:].mean(axis=0), atol=1e-15)


@FLUIDS
@pytest.mark.parametrize("stretching", [400.0, 1.6e4])
@pytest.mark.parametrize("step", [0.05, 0.03, 0.01])
def test_what_is_left_of_the_error_is_below_the_tolerance(fluid, stretching: float, step: float, monkeypatch) -> None:
    """Answers from extrapolated beginnings, against two more corrections with exact matrices."""
    left = []
    solve = Implicit._quickly

    def watched(self: Implicit, equation: _Equation, *start):
        answer = solve(self, equation, *start)
        y = answer[0]
        for _ in range(2):
            shape = equation.system.move(equation.start, y)
            y = y + equation.correction(y, shape, equation.system.stiffness)[0].move
        left.append(_size(y - answer[0], equation.system.length))
        return answer

    monkeypatch.setattr(Implicit, "_quickly", watched)
    simulation = Simulation(swimmer(fluid, stretching=stretching, step=step, end=8 * step))
    simulation.advance(8 * step, lambda: None)
    assert max(left) < Implicit.tolerance


@FLUIDS
def test_a_rod_that_hardly_stretches_takes_few_iterations(fluid) -> None:
    """From linearly extrapolated nodes, whose segments are stretched, it took twice as many."""
    step, steps = 0.01, 20
    simulation = Simulation(swimmer(fluid, stretching=1.6e4, step=step, end=steps * step))
    simulation.advance(2 * step, lambda: None)
    forces, counted = simulation.system.forces, []

    def counting(*arguments):
        counted.append(1)
        return forces(*arguments)

    simulation.system.forces = counting  # type: ignore[method-assign]
    simulation.advance(steps * step, lambda: None)
    assert len(counted) <= 4 * (steps - 2)
