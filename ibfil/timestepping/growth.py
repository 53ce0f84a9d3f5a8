"""How fast disturbances of the rods grow: the leading modes of the linearised motion dy/dt = M K y.

The Jacobian J = M K has huge negative eigenvalues (a stiff rod goes to rest fast) and, where a rod buckles, flutters or
whirls, few with a positive real part. Those are found by Arnoldi's iteration on the step (1 - tau J)^-1: an eigenvalue
lambda of J is one of 1/(1 - tau lambda) there, which stands out where tau |lambda| is about one and stable modes lie
within [0, 1]. M is the drag of each node: of a fluid on a grid growth rates are then right to the factor by which its
drag differs, and found at the cost of some steps of resistive-force theory.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np


class Propagator(Protocol):
    """A linear step: displacements (n, m) -> those a step later."""

    def __call__(self, y: np.ndarray, /) -> np.ndarray:
        """The displacements a step later."""


VECTORS = 24  # of Arnoldi's iteration
CERTAIN = 0.05  # relative error of an eigenvalue that counts
LEAST = 1e-3  # of 1/tau: growth below it is none
FAINTEST = 1e-6  # eigenvalue of the step below which it is rounding: growth of so many times 1/tau is another tau's


class Mode(NamedTuple):
    """A mode of the linearised motion: its eigenvalue (growth, angular frequency) and shape (n, m), the real part."""

    eigenvalue: complex
    shape: np.ndarray


def growing(step: Propagator, begin: np.ndarray, tau: float) -> Mode | None:
    """The mode that grows fastest by a ``step`` y -> (1 - tau J)^-1 y; None where none grows within some 1/tau.

    ``begin`` (n, m) is the first vector: the last mode found, or anything that is not orthogonal to it.
    """
    basis, hessenberg = _arnoldi(step, begin)
    k = hessenberg.shape[1]
    values, vectors = np.linalg.eig(hessenberg[:k])
    errors = np.abs(hessenberg[k, k - 1] * vectors[-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = (1.0 - 1.0 / values) / tau
    # lambda = (1 - 1/mu)/tau: an error of mu is one of mu (mu - 1) in lambda, relative to it.
    good = (errors < CERTAIN * np.abs(values * (values - 1.0))) & (rates.real * tau > LEAST)
    good &= np.abs(values) > FAINTEST
    if not good.any():
        return None
    best = int(np.argmax(np.where(good, rates.real, -np.inf)))
    shape = (basis[:, :k] @ vectors[:, best]).real.reshape(begin.shape)
    return Mode(complex(rates[best]), shape)


def _arnoldi(step: Propagator, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """An orthonormal basis (n m, k + 1) of the Krylov space, and the step in it (k + 1, k)."""
    count = min(VECTORS, begin.size)
    basis, hessenberg = np.zeros((begin.size, count + 1)), np.zeros((count + 1, count))
    basis[:, 0] = begin.ravel() / np.linalg.norm(begin)
    for k in range(count):
        y = step(basis[:, k].reshape(begin.shape)).ravel()
        for _ in range(2):  # once more: rounding
            part = basis[:, : k + 1].T @ y
            y = y - basis[:, : k + 1] @ part
            hessenberg[: k + 1, k] += part
        size = float(np.linalg.norm(y))
        hessenberg[k + 1, k] = size
        if size < 1e-13:
            return basis[:, : k + 2], hessenberg[: k + 2, : k + 1]
        basis[:, k + 1] = y / size
    return basis, hessenberg
