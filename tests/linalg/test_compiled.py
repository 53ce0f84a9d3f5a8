"""Kernels out of numba's cache, and LAPACK, without the rest of either."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy import linalg as whole

from ibfil.linalg import lapack

PROGRAM = """
import sys
import numpy as np
from ibfil.linalg.banded import multiply, solve_pivoted
matrix, x = np.arange(1.0, 5 * 3 * 9 + 1).reshape(5, 3, 9) % 7, np.arange(15.0).reshape(5, 3)
print(multiply(matrix, x).sum(), solve_pivoted(matrix, x).sum())
print(*sorted({"scipy.linalg", "numba.np.arraymath", "numba.np.linalg"} & set(sys.modules)))
from scipy.linalg import lapack, solve
print(lapack.dgbsv is sys.modules["ibfil.linalg.lapack"].dgbsv, solve([[2.0]], [1.0])[0])
"""


def test_a_kernel_that_is_kept_loads_without_the_compiler(tmp_path):
    """The first process compiles it; the second finds it, gives the same bits, and loads nothing to compile with."""
    surroundings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", PROGRAM]
    first, second = (
        subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True).stdout.splitlines()
        for _ in range(2)
    )
    assert "numba.np.arraymath" in first[1]
    assert second[1] == ""
    assert first[0] == second[0]
    assert first[2] == second[2] == "True 0.5"


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("shape", [(12,), (12, 2)])
def test_band_matrices_are_solved_as_scipy_does(count, shape):
    """The bits are those of scipy.linalg; a singular matrix is refused."""
    numbers = np.random.default_rng(1)
    diagonals, right = numbers.standard_normal((2 * count + 1, 12)), numbers.standard_normal(shape)
    assert np.array_equal(
        lapack.solve_banded(count, diagonals, right), whole.solve_banded((count,) * 2, diagonals, right)
    )
    with pytest.raises(np.linalg.LinAlgError):
        lapack.solve_banded(count, np.zeros_like(diagonals), right)
