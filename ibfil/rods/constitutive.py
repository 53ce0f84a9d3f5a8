"""Constitutive laws: from strains to moments. Eq. 9 of the paper is the linear one.

A law of your own is an object with the two methods of `MomentLaw`, given by the name of its filament:

>>> import numpy as np
>>> import ibfil
>>> class Locking:
...     "Round, and ever stiffer as the curvature nears ``most``: M = A O/(1 - |O|^2/most^2)."
...     def __init__(self, modulus, most):
...         self.modulus, self.most = modulus, most
...     def bending(self, strain, s, time):
...         room = 1 - np.sum(strain**2, axis=1)[:, None] / self.most**2
...         moment = self.modulus * strain / room
...         outer = strain[:, :, None] * strain[:, None, :] * 2 / self.most**2
...         slope = self.modulus * (np.eye(2) / room[:, :, None] + outer / room[:, :, None]**2)
...         return moment, slope
>>> case = ibfil.parse_case('''
... [filament.rod]
... length = 1.0
... nodes = 21
... bending = 1.0
... stretching = 1e4
... [filament.rod.start]
... end = "clamped"
... [filament.rod.finish]
... moment = [0, 0, 2]
... [fluid]
... model = "rft"
... viscosity = 1.0
... [time]
... end = 20.0
... step = 0.2
... [output]
... every = 20.0
... ''', "rod.toml")
>>> result = ibfil.run(case, laws={"rod": Locking(1.0, 2.0)}, progress=False, log=lambda line: None)
>>> strain = result.snapshot.filaments["rod"].strain[:-1, 0]     # of 2 = O/(1 - O^2/4): O = sqrt(5) - 1
>>> bool(np.allclose(strain, np.sqrt(5) - 1, atol=1e-5))
True
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from .base import Law
    from .mesh import Mesh


Field = Callable[[float], np.ndarray]  # of time, values at the nodes


class MomentLaw(Protocol):
    """The law of one filament of k nodes, as a user gives it: strains, arclength and time in, moments out.

    It stands in the place of ``bending``, ``curvature`` (and ``twisting``, ``twist_rate``) of the case, which then only
    set time scales. Derivatives have to be exact: Newton's matrix is made of them. It need not care for ends that
    carry no moment.
    """

    def bending(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (k, 2) and dM_a/dO_b (k, 2, 2) of the curvatures O1, O2 (k, 2) at the nodes s (k,)."""

    def twisting(self, strain: np.ndarray, s: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 and dM3/dO3 (k - 1,) of the twist O3 (k - 1,) at the half nodes s (k - 1,).

        Asked only of filaments that have ``twisting`` in their case; the others need no such method.
        """


def gather(parts: Sequence[tuple[slice, Callable, np.ndarray]], configuration: tuple[int, ...]) -> Field:
    """A field over all nodes from one function of (s, t) a filament: (nodes, function, arclength) each.

    A function that is the same for several filaments in a row should come as one part. The values at a time are found
    once: a step asks for them in every iteration.
    """
    out, known = np.empty(configuration), np.nan

    def evaluate(t: float) -> np.ndarray:
        nonlocal known, out
        if t == known:
            return out
        known = np.nan  # a function may fail half way
        if len(parts) == 1:
            out = parts[0][1](parts[0][2], t)
        else:
            for nodes, function, s in parts:
                out[nodes] = function(s, t)
        known = t
        return out

    return evaluate


def to_half(values: np.ndarray) -> np.ndarray:
    """Values (n,) at half nodes, by the mean of the nodes; zero after the last node."""
    return np.append(0.5 * (values[1:] + values[:-1]), 0.0)


class Linear:
    """Eq. 9: M1 = A1 (O1 - k1), M2 = A2 (O2 - k2), M3 = C (O3 - tau0).

    ``bending`` (n, 2) are A1, A2, ``torsion`` (n,) is C at half nodes (zero where nothing twists); ``curvature`` gives
    k1 and k2 (n,) each, ``rate`` gives tau0 (n,) at nodes, averaged to half nodes; both of time.
    """

    nonlocal_twist = None

    def __init__(self, bending: np.ndarray, torsion: np.ndarray, curvature: tuple[Field, Field], rate: Field) -> None:
        self._bending, self._torsion, self._curvature, self._rate = bending.copy(), torsion, curvature, rate
        self._slope = np.zeros((len(bending), 2, 2))
        self._slope[:, 0, 0], self._slope[:, 1, 1] = bending[:, 0], bending[:, 1]

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment = np.empty(bend.shape)
        for a, k in enumerate(self._curvature):
            np.subtract(bend[:, a], k(time), out=moment[:, a])
        moment *= self._bending
        return moment, self._slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        return self._torsion * (twist - to_half(self._rate(time))), self._torsion


class Stiffening:
    """Moments that grow faster than the strain, from an energy: with the excess strains e_a = O_a - k_a,

        M_a = A_a e_a (1 + c q^p),   q^2 = (A1 e1^2 + A2 e2^2)/A+,   A+ = (A1 + A2)/2
        M3  = C e3 (1 + c |e3|^p)

    c the ``coefficient``, p the ``exponent``. M_a = dW/dO_a of W = A+ (q^2/2 + c q^(p+2)/(p+2)); for a round rod q is
    the size of the excess curvature, in whatever direction. ``linear`` is the law it stiffens, ``bending`` (n, 2) and
    ``torsion`` (n,) its moduli.
    """

    nonlocal_twist = None

    def __init__(
        self, linear: Linear, bending: np.ndarray, torsion: np.ndarray, coefficient: float, exponent: float
    ) -> None:
        self._linear, self._bending, self._torsion = linear, bending, torsion
        self._c, self._p = coefficient, exponent
        self._mean = bending.mean(axis=1)

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment, slope = self._linear.bending(bend, time)
        square = np.sum(moment**2 / self._bending, axis=1) / self._mean
        growth = self._c * square ** (0.5 * self._p)
        # dq^p/dO_b = p q^(p-2) A_b e_b/A+, which goes to zero like q^(p-1) times a unit vector, and M with it.
        turn = self._p * growth / (self._mean * np.where(square > 0.0, square, 1.0))
        slope = slope * (1.0 + growth)[:, None, None]
        slope += turn[:, None, None] * moment[:, :, None] * moment[:, None, :]
        return moment * (1.0 + growth)[:, None], slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        moment, slope = self._linear.twisting(twist, time)
        strain = moment / np.where(self._torsion > 0.0, self._torsion, 1.0)
        growth = self._c * np.abs(strain) ** self._p
        return moment * (1.0 + growth), slope * (1.0 + (1.0 + self._p) * growth)


class TwoWell:
    """Two preferred twists w1, w2, added to tau0, with the energy per length b between them; bending is linear.

        V(e) = 16 b [(e - w1)(e - w2)]^2/(w2 - w1)^4,   e = O3 - tau0,   M3 = dV/de

    A double well in the twist, between helices of opposite hand, after Goldstein, Goriely, Huber & Wolgemuth, "Bistable
    helices", Phys. Rev. Lett. 84, 1631 (2000), and Coombs, Huber, Kessler & Goldstein, "Periodic chirality
    transformations propagating on bacterial flagella", Phys. Rev. Lett. 89, 118102 (2002). That it is the quartic of
    wells and barrier above is this package's choice. The cost of a change along s is `DomainWalls`.
    """

    nonlocal_twist = None

    def __init__(self, linear: Linear, rate: Field, wells: tuple[float, float], barrier: float) -> None:
        self.bending = linear.bending
        self._rate, (self._w1, self._w2) = rate, wells
        self._scale = 16.0 * barrier / (self._w2 - self._w1) ** 4

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        strain = twist - to_half(self._rate(time))
        product, sum_ = (strain - self._w1) * (strain - self._w2), 2.0 * strain - self._w1 - self._w2
        return 2.0 * self._scale * product * sum_, 2.0 * self._scale * (sum_**2 + 2.0 * product)


class Given:
    """A user's law of one filament, of nodes ``s`` (k,); ``twists``: whether the case gives it a twist modulus."""

    nonlocal_twist = None

    def __init__(self, law: MomentLaw, s: np.ndarray, twists: bool) -> None:
        self._law, self._s, self._half, self._twists = law, s, 0.5 * (s[1:] + s[:-1]), twists

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (k, 2) and their derivatives (k, 2, 2). Raises TypeError where the law gives other shapes."""
        k = len(self._s)
        moment, slope = self._law.bending(bend, self._s, time)
        return self._checked(moment, (k, 2)), self._checked(slope, (k, 2, 2))

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (k,) at half nodes and its derivative (k,), the last of no meaning. Raises TypeError likewise."""
        if not self._twists:
            return np.zeros_like(twist), np.zeros_like(twist)
        k = len(self._half)
        moment, slope = self._law.twisting(twist[:-1], self._half, time)
        return np.append(self._checked(moment, (k,)), 0.0), np.append(self._checked(slope, (k,)), 0.0)

    def _checked(self, values: np.ndarray, configuration: tuple[int, ...]) -> np.ndarray:
        if np.shape(values) != configuration:
            name = type(self._law).__name__
            raise TypeError(f"law {name}: found an array {np.shape(values)}; wanted {configuration}")
        return np.asarray(values, float)


class Mixed:
    """Filaments with laws of their own among others: ``base`` for all n nodes, ``others`` for ranges of nodes."""

    nonlocal_twist = None

    def __init__(self, base: Law, others: Sequence[tuple[slice, Law]]) -> None:
        self._base, self._others = base, others

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and their derivatives (n, 2, 2)."""
        moment, slope = (part.copy() for part in self._base.bending(bend, time))
        for nodes, law in self._others:
            moment[nodes], slope[nodes] = law.bending(bend[nodes], time)
        return moment, slope

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,)."""
        moment, slope = (part.copy() for part in self._base.twisting(twist, time))
        for nodes, law in self._others:
            moment[nodes], slope[nodes] = law.twisting(twist[nodes], time)
        return moment, slope


class Driven:
    """Another law with an internal moment (an axoneme's) added to M1 and M2, like -A k in the linear law (Sec. 7.2)."""

    nonlocal_twist = None

    def __init__(self, law: Law, internal: tuple[Field, Field]) -> None:
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


class DomainWalls:
    """Another law with the energy g/2 (de3/ds)^2 of a change of the excess twist e3 = O3 - tau0 along s.

    M3 gains -d/ds(g de3/ds), by the derivative of the sum of g/2 (e_{i+1/2} - e_{i-1/2})^2/Lc over the inner nodes, so
    that de3/ds = 0 at the ends. The moment then feels the twist of the half nodes beside: ``nonlocal_twist`` (n, 2) are
    dM3_h/dO3_{h-1} and dM3_h/dO3_{h+1}. ``gradient`` (n,) is g at nodes, ``rate`` gives tau0.
    """

    def __init__(self, law: Law, mesh: Mesh, gradient: np.ndarray, rate: Field) -> None:
        self._law, self._rate = law, rate
        self.bending = law.bending
        inner = mesh.joined & np.append(False, mesh.joined[:-1])
        before = np.where(inner, gradient / mesh.volume, 0.0)
        after = np.append(before[1:], 0.0)
        self._own = (before + after) / mesh.ds
        self.nonlocal_twist = -np.stack([before, after], axis=1) / mesh.ds[:, None]

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) at half nodes and its derivative (n,) by the twist of the same half node."""
        moment, slope = self._law.twisting(twist, time)
        strain = twist - to_half(self._rate(time))
        moment = moment + self._own * strain
        moment[1:] += self.nonlocal_twist[1:, 0] * strain[:-1]
        moment[:-1] += self.nonlocal_twist[:-1, 1] * strain[1:]
        return moment, slope + self._own
