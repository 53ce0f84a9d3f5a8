"""Constitutive laws: from strains to moments. Eq. 9 of the paper is the linear one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Field = Callable[[float], np.ndarray]  # of time, values at the nodes


def gather(parts: Sequence[tuple[slice, Callable, np.ndarray]], shape: tuple[int, ...]) -> Field:
    """A field over all nodes from one function of (s, t) a filament: (nodes, function, arclength) each.

    A function that is the same for several filaments in a row should come as one part.
    """
    if len(parts) == 1:
        _, only, s = parts[0]
        return lambda t: only(s, t)
    out = np.empty(shape)

    def evaluate(t: float) -> np.ndarray:
        for nodes, function, s in parts:
            out[nodes] = function(s, t)
        return out

    return evaluate


class Linear:
    """Eq. 9: M1 = A1 (O1 - k1), M2 = A2 (O2 - k2), M3 = C (O3 - tau0).

    ``bending`` (n, 2) are A1, A2, ``torsion`` (n,) is C at half nodes (zero where nothing twists); ``curvature`` gives
    k1 and k2 (n,) each, ``rate`` gives tau0 (n,) at nodes, averaged to half nodes; both of time.
    """

    def __init__(
        self, bending: np.ndarray, torsion: np.ndarray, curvature: tuple[Field, Field], rate: Field
    ) -> None:
        self._a1, self._a2 = np.ascontiguousarray(bending[:, 0]), np.ascontiguousarray(bending[:, 1])
        self._torsion, self._curvature, self._rate = torsion, curvature, rate
        self._slope = np.zeros((len(bending), 2, 2))
        self._slope[:, 0, 0], self._slope[:, 1, 1] = self._a1, self._a2

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment = np.empty_like(bend)
        k1, k2 = self._curvature
        np.multiply(self._a1, bend[:, 0] - k1(time), out=moment[:, 0])
        np.multiply(self._a2, bend[:, 1] - k2(time), out=moment[:, 1])
        return moment, self._slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        rate = self._rate(time)
        half = np.append(0.5 * (rate[1:] + rate[:-1]), 0.0)
        return self._torsion * (twist - half), self._torsion


class Driven:
    """Another law with an internal moment (an axoneme's) added to M1 and M2, as -A k is in the linear law (Sec. 7.2)."""

    def __init__(self, law, internal: tuple[Field, Field]) -> None:
        self._law, self._internal = law, internal

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment, slope = self._law.bending(bend, time)
        for part in (0, 1):
            moment[:, part] += self._internal[part](time)
        return moment, slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,): the inner law's."""
        return self._law.twisting(twist, time)
