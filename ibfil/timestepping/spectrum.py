"""Growth rates and modes of a linearised motion: eigenvalues of A, dy/dt = v + A y (linear_motion.py).

`all_modes` makes A and finds all of them. `leading_modes` finds those that grow fastest, of any number of nodes, by
Arnoldi's method on (1 - tau A)^-1, an implicit step of the fluid: its largest eigenvalues 1/(1 - tau lam) are those of
the lam next to 1/tau. Where A_G is not zero the step is solved by GMRES, preconditioned with that of A_K.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .linear_motion import LinearMotion

_TOLERANCE = (1e-10, 1e-7)  # of Arnoldi's eigenvalues: where A_G is zero, and where it comes from differences
_SOLVED = 1e-9  # residual of the inner GMRES, which differences may keep from falling further
_DENSE, _DENSE_STILL = 800, 250  # unknowns up to which the whole matrix is made; where the fluid is at rest
_INVERSE, _OFF = 8, 1e-9  # inverse iterations; how far off an eigenvalue they are shifted, of it
_APART = 0.01  # of a vector of length one: what must be left of it for another mode
_RUNG, _RUNGS = 3.0, 3  # ratio of two shifts, and how many of them beyond the fastest growth


class Modes(NamedTuple):
    """Eigenvalues (k,), e-foldings and radians per time, fastest growth first; vectors (n, m, k), largest entry one."""

    values: np.ndarray
    vectors: np.ndarray


def modes(motion: LinearMotion, count: int, rate: float) -> Modes:
    """All modes of few nodes, else at least the ``count`` that grow fastest, given a ``rate`` > 0 of the scene."""
    few = motion.free.size <= (_DENSE if motion.carried else _DENSE_STILL)
    return all_modes(motion) if few else leading_modes(motion, count, rate)


def all_modes(motion: LinearMotion) -> Modes:
    """Every mode."""
    from scipy.linalg import eig

    values, vectors = eig(motion.matrix, check_finite=True)
    return _sorted(motion, values, vectors)


def leading_modes(motion: LinearMotion, count: int, rate: float) -> Modes:
    """At least ``count`` modes next to the growth rate ``rate`` > 0, and all that grow faster.

    Shifts go up by _RUNG from ``rate`` until _RUNGS of them beyond the fastest growth found nothing that grows faster.
    Between two shifts a real rate is next to one of them; one that oscillates much faster may be missed.
    """
    found = _near(motion, count, rate)
    shift, top = rate, rate
    while shift < top * _RUNG**_RUNGS:
        shift *= _RUNG
        found = found.joined(_near(motion, count, shift))
        top = max(top, float(found.values.real.max()))
    return _sorted(motion, found.values, found.vectors)


def followed(motion: LinearMotion, value: complex, vector: np.ndarray) -> tuple[complex, np.ndarray, float]:
    """The mode next to a ``value`` and a ``vector`` (n, m) of a motion that differs little: value, vector, overlap.

    By inverse iteration from the vector. The overlap of two modes is one where they are the same.
    """
    from scipy.linalg import lu_factor, lu_solve

    start = vector.ravel()[motion.free]
    start = x = start / np.linalg.norm(start)
    shift = value.real if abs(value.imag) <= 1e-9 * abs(value) else value
    factors = lu_factor(motion.matrix - (shift * (1 + _OFF) + 1e-300) * np.eye(len(x)))
    for _ in range(_INVERSE):
        x = lu_solve(factors, x)
        x = x / np.linalg.norm(x)
    found = complex(np.vdot(x, motion.matrix @ x))
    whole = motion.whole(x)
    return found, whole / whole.ravel()[np.argmax(np.abs(whole))], float(abs(np.vdot(x, start)))


class _Found(NamedTuple):
    """Eigenvalues (k,), vectors (K, k) of length one, and how well each value is known."""

    values: np.ndarray
    vectors: np.ndarray
    doubt: np.ndarray

    def joined(self, other: _Found) -> _Found:
        """Both, without the vectors of the second that the first has at the same eigenvalue."""
        found = self
        for value, vector, doubt in zip(other.values, other.vectors.T, other.doubt, strict=True):
            same = found.vectors[:, np.abs(found.values - value) <= found.doubt + doubt]
            left = vector - same @ np.linalg.lstsq(same, vector, rcond=None)[0] if same.shape[1] else vector
            if np.linalg.norm(left) > _APART:
                found = _Found(
                    np.append(found.values, value),
                    np.column_stack([found.vectors, vector]),
                    np.append(found.doubt, doubt),
                )
        return found


def _near(motion: LinearMotion, count: int, shift: float) -> _Found:
    """The ``count`` modes next to ``shift``."""
    from scipy.sparse.linalg import LinearOperator, eigs

    k = motion.free.size
    operator = LinearOperator((k, k), matvec=_step(motion, 1.0 / shift), dtype=float)
    start, size = np.random.default_rng(0).standard_normal(k), min(count, k - 2)
    tolerance = _TOLERANCE[motion.carried]
    theta, vectors = eigs(operator, size, which="LM", v0=start, tol=tolerance, ncv=min(k, max(3 * size, 20)))
    # A doubt of theta is one of (lam - shift)^2/shift as much in lam.
    return _Found((1 - 1 / theta) * shift, vectors, 100 * tolerance * shift / np.abs(theta) ** 2)


def _step(motion: LinearMotion, tau: float) -> Callable[[np.ndarray], np.ndarray]:
    """x -> (1 - tau A)^-1 x."""
    relaxed = motion.relaxation(tau)
    if not motion.carried:
        return relaxed
    from scipy.sparse.linalg import LinearOperator, gmres

    k = motion.free.size
    # (1 - tau A_K)^-1 (1 - tau A) = 1 - tau (1 - tau A_K)^-1 A_G, near one for a short tau.
    product = LinearOperator((k, k), matvec=lambda x: x - tau * relaxed(motion.geometric(x)), dtype=float)

    def solved(x: np.ndarray) -> np.ndarray:
        right = relaxed(x)
        out, failed = gmres(product, right, rtol=_SOLVED, restart=min(k, 40), maxiter=2)
        if failed and not np.linalg.norm(product @ out - right) < 1e3 * _SOLVED * np.linalg.norm(right):
            raise np.linalg.LinAlgError("an implicit step with the moving fluid was not solved")
        return out

    return solved


def _sorted(motion: LinearMotion, values: np.ndarray, vectors: np.ndarray) -> Modes:
    """By growth, then by frequency, those that turn forwards before those that turn back."""
    order = np.lexsort((-values.imag, np.abs(values.imag), -values.real))
    whole = np.zeros((*motion.shape, len(order)), complex)
    whole.reshape(-1, len(order))[motion.free] = vectors[:, order]
    flat = whole.reshape(-1, len(order))
    largest = flat[np.argmax(np.abs(flat), axis=0), np.arange(len(order))]
    return Modes(values[order], whole / largest)
