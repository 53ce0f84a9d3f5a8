"""Band matrices by node against full ones."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scenes import bare

from ibfil.linalg import banded
from ibfil.rods.mesh import Segmented

TANGENT = np.array([0.0, 0.6, 0.8])
S = np.linspace(0.0, 1.0, 11) ** 1.1
SCENES = {
    "one": [Segmented(S, 6, None, None)],
    "order 2": [Segmented(S, 2, None, None)],
    "clamped": [Segmented(S, 6, TANGENT, None)],
    "three": [
        Segmented(S, 2, None, TANGENT),
        Segmented(S[:9], 6, None, None),
        Segmented(S[:8], 6, TANGENT, None),
    ],
}
ANY_SCENE = pytest.mark.parametrize("parts", SCENES.values(), ids=SCENES)
ANY_UNKNOWNS = pytest.mark.parametrize("m", [3, 4])


def stiffness(parts: list[Segmented], m: int) -> tuple[np.ndarray, banded.Profile]:
    """The stiffness of stretched, bent and twisted rods, as a band matrix by node."""
    rods = bare(parts, unknowns=m, strains=lambda s: np.stack([np.sin(3 * s), 0.4 + s, 0.5 - s], axis=1))
    s = np.concatenate([part.s + 2 * k for k, part in enumerate(parts)])
    r = np.stack([s, 0.2 * np.sin(3 * s), 0.3 * np.cos(4 * s)], axis=1)
    shape = rods.start(r, np.tile([0.1, 1.0, 0.2], (len(s), 1)))
    _, moment = rods.forces(shape, 0.0)
    return rods.stiffness(shape, shape, moment, 0.0).band, rods.profile


def randomly(matrix: np.ndarray, seed: int) -> np.ndarray:
    """Random numbers wherever the matrix has any, and a heavy diagonal; the same band."""
    rng = np.random.default_rng(seed)
    m = matrix.shape[1]
    w = (matrix.shape[2] // m - 1) // 2
    out = np.where(matrix != 0.0, rng.uniform(-1.0, 1.0, matrix.shape), 0.0)
    for a in range(m):
        out[:, a, w * m + a] = 20.0
    return out


def assert_solved(matrix: np.ndarray, right: np.ndarray, where: banded.Profile) -> None:
    n, m = right.shape
    full = banded.dense(matrix).reshape(n * m, n * m)
    expected = np.linalg.solve(full, right.ravel()).reshape(n, m)
    found = banded.solve(matrix.copy(), right.copy(), where)
    # Elimination in another order: round-off times the condition number, whatever the matrix.
    rounding = 100 * np.finfo(float).eps * np.linalg.cond(full)
    assert rounding < 1e-5
    assert np.abs(found - expected).max() <= rounding * np.abs(expected).max()


@ANY_SCENE
@pytest.mark.parametrize(("m", "through"), [(3, 3), (4, 3), (4, 4)])
def test_transposed_products_are_those_of_the_full_matrix(parts: list[Segmented], m: int, through: int) -> None:
    matrix, _ = stiffness(parts, m)
    matrix = randomly(matrix, 5)
    n = len(matrix)
    full = np.random.default_rng(2).standard_normal((n, through, 2 * n + 1))
    exact = np.einsum("iajb,ial->jbl", banded.dense(matrix)[:, :through], full)
    found = banded.transposed_product(matrix, full.reshape(through * n, -1), -0.3)
    assert np.abs(found + 0.3 * exact).max() < 1e-13 * np.abs(exact).max()


@ANY_SCENE
@ANY_UNKNOWNS
def test_products_are_those_of_the_full_matrix(parts: list[Segmented], m: int) -> None:
    matrix, _ = stiffness(parts, m)
    x = np.random.default_rng(1).standard_normal(matrix.shape[:2])
    full = banded.dense(matrix)
    exact = np.einsum("iajb,jb->ia", full, x)
    size = np.einsum("iajb,jb->ia", np.abs(full), np.abs(x))
    assert np.all(np.abs(banded.multiply(matrix, x) - exact) <= 1e-14 * size + 1e-300)


@ANY_SCENE
@ANY_UNKNOWNS
def test_random_matrices_of_the_rods_profile_are_solved(parts: list[Segmented], m: int) -> None:
    pattern, where = stiffness(parts, m)
    for seed in range(3):
        matrix = randomly(pattern, seed)
        right = np.random.default_rng(seed).standard_normal(matrix.shape[:2])
        assert_solved(matrix, right, where)


@ANY_SCENE
@ANY_UNKNOWNS
@pytest.mark.parametrize("drag", [1e-1, 1e1, 1e4])
def test_drag_plus_stiffness_is_solved_at_short_and_long_steps(parts: list[Segmented], m: int, drag: float) -> None:
    matrix, where = stiffness(parts, m)
    w = (matrix.shape[2] // m - 1) // 2
    for a in range(m):
        matrix[:, a, w * m + a] -= drag
    assert_solved(matrix, np.random.default_rng(2).standard_normal(matrix.shape[:2]), where)


@ANY_UNKNOWNS
def test_a_singular_diagonal_block_is_left_to_a_solver_that_pivots(m: int) -> None:
    """Nodes 0 and 1 coupled only crosswise: block elimination meets a zero block, the matrix is regular."""
    pattern, where = stiffness(SCENES["one"], m)
    matrix = randomly(pattern, 0)
    w = (matrix.shape[2] // m - 1) // 2
    here, right_of, left_of = (slice((w + k) * m, (w + k + 1) * m) for k in (0, 1, -1))
    matrix[0, :, here] = 0.0
    matrix[1, :, here] = 0.0
    matrix[0, :, right_of] = 20 * np.eye(m)
    matrix[1, :, left_of] = 20 * np.eye(m)
    assert_solved(matrix, np.random.default_rng(3).standard_normal(matrix.shape[:2]), where)


@ANY_UNKNOWNS
def test_a_singular_matrix_is_refused(m: int) -> None:
    pattern, where = stiffness(SCENES["one"], m)
    matrix = randomly(pattern, 0)
    matrix[4] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        banded.solve(matrix, np.ones(matrix.shape[:2]), where)


@ANY_UNKNOWNS
def test_the_form_for_lapack_is_the_same_matrix(m: int) -> None:
    matrix, _ = stiffness(SCENES["three"], m)
    n = matrix.shape[0]
    full = banded.dense(matrix).reshape(n * m, n * m)
    upper, diagonals = banded.lapack_form(matrix)
    assert diagonals.shape == (2 * upper + 1, n * m)
    rows, columns = np.nonzero(full)
    assert np.array_equal(diagonals[upper + rows - columns, columns], full[rows, columns])
    assert np.abs(diagonals).sum() == pytest.approx(np.abs(full).sum(), rel=1e-12)
