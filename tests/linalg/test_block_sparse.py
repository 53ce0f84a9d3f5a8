"""Sparse matrices by node: products and solutions against the dense matrix, and patterns that are kept."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.linalg import block_sparse
from ibfil.linalg.block_sparse import BlockSparse
from ibfil.linalg.stiffness import Pairs, Stiffness, no_pairs
from ibfil.rods.mesh import Segmented, profile, stack

S = np.linspace(0.0, 1.0, 12)
ANY_UNKNOWNS = pytest.mark.parametrize("m", [3, 4])
# Which nodes of three rods of 12 are coupled.
COUPLED = {
    "nothing": [],
    "a ring": [(0, 11), (11, 0), (1, 11), (11, 1)],
    "a ladder": [pair for i in range(12) for pair in ((i, 12 + i), (12 + i, i), (12 + i, 24 + i), (24 + i, 12 + i))],
    "anywhere": [(0, 30), (17, 3), (35, 12), (35, 12), (8, 4), (20, 1)],  # one twice, some one way only
}
ANY_COUPLING = pytest.mark.parametrize("coupled", COUPLED.values(), ids=COUPLED)


def rods() -> tuple[list[Segmented], int]:
    return [Segmented(S, 6, None, None), Segmented(S, 2, None, None), Segmented(S, 6, None, None)], 36


def matrix(m: int, coupled: list[tuple[int, int]], seed: int = 0) -> tuple[Stiffness, BlockSparse]:
    """Random numbers in the profile of three rods and at the coupled pairs, and a heavy diagonal."""
    parts, n = rods()
    where, rng = profile(stack(parts)), np.random.default_rng(seed)
    w = where.width
    band = np.zeros((n, m, 2 * w + 1, m))
    for i in range(n):
        for j in range(where.first[i], where.last[i] + 1):
            band[i, :, j - i + w] = rng.standard_normal((m, m))
        band[i, :, w] += 20 * np.eye(m)
    pairs = no_pairs(m)
    if coupled:
        rows, columns = np.array(coupled).T
        pairs = Pairs(rows, columns, rng.standard_normal((len(rows), m, m)))
    return Stiffness(band.reshape(n, m, -1), pairs), BlockSparse(where)


@ANY_UNKNOWNS
@ANY_COUPLING
def test_products_are_those_of_the_full_matrix(coupled, m):
    k, _ = matrix(m, coupled)
    full, n, rng = k.dense(), len(k.band), np.random.default_rng(1)
    x = rng.standard_normal((n, m))
    assert k.times(x) == pytest.approx(np.einsum("iajb,jb->ia", full, x), abs=1e-12)
    for through in (3, m):
        a = rng.standard_normal((through * n, 5))
        exact = -0.3 * np.einsum("iajb,ial->jbl", full[:, :through], a.reshape(n, through, 5))
        assert k.transposed_product(a, -0.3) == pytest.approx(exact, abs=1e-12)
    for ranges in ((slice(0, 12),), (slice(0, 12), slice(24, 36))):
        at = np.concatenate([np.arange(r.start, r.stop) for r in ranges])
        assert np.array_equal(k.of(ranges).dense(), full[np.ix_(at, range(m), at, range(m))])


@ANY_UNKNOWNS
@ANY_COUPLING
def test_solutions_are_those_of_the_full_matrix(coupled, m):
    k, solver = matrix(m, coupled)
    n, right = len(k.band), np.random.default_rng(2).standard_normal((2, len(k.band), m))
    solve = solver.factored(k)
    for one in right:
        exact = np.linalg.solve(k.dense().reshape(n * m, n * m), one.ravel()).reshape(n, m)
        assert solve(one) == pytest.approx(exact, rel=1e-12, abs=1e-13)


def test_a_pattern_is_made_again_only_where_other_nodes_are_coupled():
    k, solver = matrix(3, COUPLED["a ladder"])
    other, _ = matrix(3, COUPLED["a ladder"], seed=9)
    right = np.ones((36, 3))
    for one in (k, other, k):
        assert one.times(solver.factored(one)(right)) == pytest.approx(right, abs=1e-11)
    assert solver.made == 1
    ring, _ = matrix(3, COUPLED["a ring"])
    assert ring.times(solver.factored(ring)(right)) == pytest.approx(right, abs=1e-11)
    assert solver.made == 2


@ANY_UNKNOWNS
def test_a_block_that_is_nearly_singular_is_pivoted(m, monkeypatch):
    """The diagonal block of one node is of rank one, and coupled to its neighbour by large numbers."""
    pivoted, calls = block_sparse._pivoted, []
    monkeypatch.setattr(block_sparse, "_pivoted", lambda *asked: (calls.append(1), pivoted(*asked))[1])
    k, solver = matrix(m, COUPLED["a ladder"])
    w = k.band.shape[2] // m // 2
    k.band[5, :, w * m : (w + 1) * m] = 1.0
    k.band[5, :, (w + 1) * m : (w + 2) * m] = 30 * np.eye(m)
    k.band[6, :, (w - 1) * m : w * m] = 30 * np.eye(m)
    zeroed = Stiffness(k.band.copy(), k.pairs)
    zeroed.band[5, :, : w * m] = 0.0
    zeroed.pairs.blocks[(k.pairs.rows == 5) | (k.pairs.columns == 5)] = 0.0
    for node in range(12):
        if node not in (5, 6):
            zeroed.band[node, :, (5 - node + w) * m : (6 - node + w) * m] = 0.0
            zeroed.band[5, :, (node - 5 + w) * m : (node - 5 + w + 1) * m] = 0.0
    right = np.random.default_rng(3).standard_normal((36, m))
    exact = np.linalg.solve(zeroed.dense().reshape(36 * m, 36 * m), right.ravel()).reshape(36, m)
    assert solver.factored(zeroed)(right) == pytest.approx(exact, rel=1e-9, abs=1e-10)
    assert calls


def test_a_singular_matrix_is_told():
    k, solver = matrix(3, COUPLED["a ladder"])
    k.band[5], k.pairs.blocks[k.pairs.rows == 5] = 0.0, 0.0
    with pytest.raises(np.linalg.LinAlgError, match="Singular"):
        solver.factored(k)
