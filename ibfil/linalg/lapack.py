"""LAPACK as scipy wraps it, without the rest of scipy.linalg: that takes a fifth of a second to import, for nothing.

The functions are those of `scipy.linalg.lapack`, from the extension module that it takes them from; where scipy keeps
them elsewhere, they come from there in the usual way. `import scipy.linalg`, before or after, gets the same module.
"""

from __future__ import annotations

import importlib.util
import sys
from contextlib import suppress
from importlib.machinery import PathFinder
from types import ModuleType

import numpy as np

_WHOLE, _PART = "scipy.linalg", "scipy.linalg._flapack"


def _functions() -> ModuleType:
    """The module that has the functions."""
    if _WHOLE not in sys.modules:
        with suppress(ImportError):
            return _part()
    from scipy.linalg import lapack

    return lapack


def _part() -> ModuleType:
    """The extension module, without its package. Raises ImportError where there is none."""
    if _PART in sys.modules:
        return sys.modules[_PART]
    package = importlib.util.find_spec(_WHOLE)
    found = PathFinder.find_spec(_PART, package.submodule_search_locations) if package else None
    if found is None or found.loader is None:
        raise ImportError(_PART)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    for name in _NAMES:
        if not hasattr(module, name):
            raise ImportError(name)
    sys.modules[_PART] = module
    return module


_NAMES = ("dgbsv", "dgbtrf", "dgbtrs", "dgetrf", "dgetrs", "dgtsv", "dpotrf")
_lapack = _functions()
dgbsv, dgbtrf, dgbtrs, dgetrf, dgetrs, dgtsv, dpotrf = (getattr(_lapack, name) for name in _NAMES)


def solve_banded(count: int, diagonals: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x, (n,) or (n, k) as ``right``, with a matrix of ``count`` diagonals to either side of the middle one.

    ``diagonals`` (2 count + 1, n) are as scipy.linalg.solve_banded takes them, and so are the bits of x. Raises
    numpy.linalg.LinAlgError where the matrix is singular.
    """
    if count == 1:
        upper, middle, lower = diagonals[0, 1:], diagonals[1], diagonals[2, :-1]
        _, _, _, x, fault = dgtsv(lower, middle, upper, right)
    else:
        room = np.zeros((count, diagonals.shape[1]))
        _, _, x, fault = dgbsv(count, count, np.vstack([room, diagonals]), right, overwrite_ab=True)
    if fault:
        raise np.linalg.LinAlgError("Singular matrix")
    return np.asarray(x)
