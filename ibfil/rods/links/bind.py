"""Rods bound along their length: they slide past each other against shear, and are kept at a distance.

An element joins the middle of a segment of rod a to the point of rod b beside it. With d between the points and
c = c_a/ds_a + c_b/ds_b the sum of the two segments, each over its rest length,

    n = |c|,   t = c/n,   sig = d.t,   e = d - sig t,   rho = |e|,   q = e/rho
    U = ds [ kt (sig - x0)^2/2 - f sig + kn (rho - D)^2/2 ]

sig is the slide, x0 the preferred one, f the active shear force per length: b is pulled along +t and a along -t where
f > 0. Of middles, not of nodes: bound at nodes the rods are of first order in the spacing.

    dsig = t.dd + e/n.dc,      drho = q.dd - sig/n q.dc,      P = 1 - t t
    Hess sig = [ 0, P/n; P/n, (-sig P - t e - e t)/n^2 ]
    rho Hess rho = [ 1, 0; 0, 0 ] - grad sig grad sig - sig Hess sig - grad rho grad rho
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from ..geometry import Configuration
from ..rates import Accepted, Memory, Rate, Remembering
from .base import Elements, Link, Seen, across, length, outer

OfTime = Callable[[float], np.ndarray]  # of time, values (l,) of the elements


class Binding(NamedTuple):
    """The constants of l elements of two bound rods, shear and normal stiffness per length squared."""

    ds: np.ndarray  # (l,) the length that each stands for
    shear: np.ndarray  # (l,) kt
    normal: np.ndarray  # (l,) kn
    distance: np.ndarray  # (l,) D
    slide: OfTime  # x0
    force: OfTime  # f


class _Slide(NamedTuple):
    """The kinematics of l elements: each vector (l, 3), each number (l,)."""

    t: np.ndarray
    q: np.ndarray
    e: np.ndarray
    n: np.ndarray
    sig: np.ndarray
    rho: np.ndarray

    @classmethod
    def of(cls, vectors: np.ndarray) -> _Slide:
        """That of vectors d, c (l, 2, 3)."""
        d, c = vectors[:, 0], vectors[:, 1]
        n = length(c)
        t = c / n[:, None]
        sig = np.sum(d * t, axis=1)
        e = d - sig[:, None] * t
        rho = length(e)
        return cls(t, e / np.where(rho > 0.0, rho, 1.0)[:, None], e, n, sig, rho)

    @property
    def on_sig(self) -> np.ndarray:
        """The gradient of sig by d and c (l, 2, 3)."""
        return np.stack([self.t, self.e / self.n[:, None]], axis=1)

    @property
    def on_rho(self) -> np.ndarray:
        """The gradient of rho by d and c (l, 2, 3)."""
        return np.stack([self.q, -(self.sig / self.n)[:, None] * self.q], axis=1)

    def bent(self) -> tuple[np.ndarray, np.ndarray]:
        """The second derivatives of sig, and rho times those of rho (l, 2, 3, 2, 3)."""
        n, sig = self.n[:, None, None], self.sig[:, None, None]
        p, te = across(self.t), outer(self.t, self.e)
        of_sig = np.zeros((len(self.n), 2, 3, 2, 3))
        of_sig[:, 0, :, 1] = of_sig[:, 1, :, 0] = p / n
        of_sig[:, 1, :, 1] = -(sig * p + te + te.transpose(0, 2, 1)) / n**2
        of_rho = -_square(self.on_sig) - self.sig[:, None, None, None, None] * of_sig - _square(self.on_rho)
        of_rho[:, 0, :, 0] += np.eye(3)
        return of_sig, of_rho


def _square(gradient: np.ndarray) -> np.ndarray:
    """The products of a gradient (l, 2, 3) with itself (l, 2, 3, 2, 3)."""
    return gradient[:, :, :, None, None] * gradient[:, None, None, :, :]


class Bound(Link):
    """Two rods bound along their length."""

    def __init__(self, name: str, filaments: tuple[int, ...], elements: Elements, binding: Binding) -> None:
        super().__init__(name, filaments, elements)
        self.binding = binding

    def _active(self, sig: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray | float]:
        """The active shear force per length (l,), and its slope by the slide ``sig`` (l,)."""
        return self.binding.force(time), 0.0

    def shear(self, sig: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """dU/dsig per length (l,), and its slope: kt (sig - x0) - f."""
        active, slope = self._active(sig, time)
        return self.binding.shear * (sig - self.binding.slide(time)) - active, self.binding.shear - slope

    def _normal(self, rho: np.ndarray) -> np.ndarray:
        """dU/drho per length (l,)."""
        return self.binding.normal * (rho - self.binding.distance)

    def gradient(self, vectors: np.ndarray, time: float) -> np.ndarray:
        """ds [ dU/dsig grad sig + dU/drho grad rho ]."""
        it, ds = _Slide.of(vectors), self.binding.ds
        sheared, _ = self.shear(it.sig, time)
        normal = self._normal(it.rho)
        return (ds * sheared)[:, None, None] * it.on_sig + (ds * normal)[:, None, None] * it.on_rho

    def jacobian(self, vectors: np.ndarray, time: float, definite: bool) -> np.ndarray:
        """Of both by both; ``definite``: without the second derivatives of sig and rho."""
        it, ds = _Slide.of(vectors), self.binding.ds
        sheared, slope = self.shear(it.sig, time)
        slope = np.maximum(slope, 0.0) if definite else slope
        out = (ds * slope)[:, None, None, None, None] * _square(it.on_sig)
        out += (ds * self.binding.normal)[:, None, None, None, None] * _square(it.on_rho)
        if not definite:
            of_sig, of_rho = it.bent()
            bent = self._normal(it.rho) / np.where(it.rho > 0.0, it.rho, 1.0)
            out += (ds * sheared)[:, None, None, None, None] * of_sig + (ds * bent)[:, None, None, None, None] * of_rho
        return out

    @property
    def stiffest(self) -> float:
        """The larger of kt and kn, times the length of an element."""
        return float(np.max(self.binding.ds * np.maximum(self.binding.shear, self.binding.normal)))

    @property
    def unit(self) -> float:  # type: ignore[override]
        """The length of an element."""
        return float(np.max(self.binding.ds))

    def strained(self, configuration: Configuration) -> float:
        """The slide away from the preferred one, or the distance from D."""
        it, binding = _Slide.of(self.elements.vectors(configuration.r)), self.binding
        slid = np.where(binding.shear > 0.0, np.abs(it.sig - binding.slide(0.0)), 0.0)
        return float(max(np.max(slid), np.max(np.abs(it.rho - binding.distance))))

    def seen(self, configuration: Configuration, time: float) -> Seen:
        """The slide, and per length the shear force on b along +t, what of it is active, and the tension across."""
        vectors = self.elements.vectors(configuration.r)
        it = _Slide.of(vectors)
        sheared, active, normal = self.shear(it.sig, time)[0], self._active(it.sig, time)[0], self._normal(it.rho)
        nodes, weights = self.elements.nodes, self.elements.weights
        first = -(weights[:, 0, :2, None] * configuration.r[nodes[:, :2]]).sum(axis=1)
        force = -self.binding.ds[:, None] * (sheared[:, None] * it.t + normal[:, None] * it.q)
        parts = {"slide": it.sig, "shear": -sheared, "active": active, "tension": normal}
        return Seen(first, first + vectors[:, 0], force, parts)


class Motors(NamedTuple):
    """Motors that push along the motion, with a lag: T df/dt + f = F(dsig/dt), F = gamma x or S tanh(gamma x/S)."""

    friction: float  # gamma
    lag: float  # T
    stall: float  # S; infinite: F grows without bound

    def drive(self, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F (l,), and its slope by the rate (l,)."""
        if np.isinf(self.stall):
            return self.friction * rate, np.full_like(rate, self.friction)
        level = np.tanh(self.friction * rate / self.stall)
        return self.stall * level, self.friction * (1.0 - level**2)


class Driven(Bound, Remembering):
    """Bound rods with motors, whose force is eliminated where it is, by the step's own difference:

    f = [ tau F(x) + T (f_n + c (f_n - f_{n-1})) ]/(tau + T),    x = dsig/dt,    df/dsig = F'(x)/(tau + T)
    """

    def __init__(
        self,
        name: str,
        filaments: tuple[int, ...],
        elements: Elements,
        binding: Binding,
        motors: Motors,
        start: np.ndarray,
    ) -> None:
        """``start`` (n, 3) are the nodes at t = 0."""
        super().__init__(name, filaments, elements, binding)
        self.key, self.motors = f"link_{name}", motors
        self._slide, self._pushed = Rate(self._slides(start)), Rate(np.zeros(len(elements.nodes)))

    def _slides(self, r: np.ndarray) -> np.ndarray:
        return _Slide.of(self.elements.vectors(r)).sig

    def _push(self, sig: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The motors' force per length (l,), and its slope by the slide; before the first step none."""
        if self._slide.inverse == 0.0:
            return self._pushed.base, np.zeros_like(sig)
        driven, slope = self.motors.drive(self._slide.of(sig))
        tau, lag = 1.0 / self._slide.inverse, self.motors.lag
        return (tau * driven + lag * self._pushed.base) / (tau + lag), slope / (tau + lag)

    def _active(self, sig: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray | float]:
        pushed, slope = self._push(sig)
        return self.binding.force(time) + pushed, slope

    def begin(self, tau: float, w: float) -> None:
        """A step begins."""
        self._slide.begin(tau, w)
        self._pushed.begin(tau, w)

    def advance(self, step: Accepted) -> None:
        """The step is taken."""
        sig = self._slides(step.configuration.r)
        pushed, _ = self._push(sig)
        self._slide.advance(sig)
        self._pushed.advance(pushed)

    def memory(self) -> Memory:
        """Slides and the motors' forces."""
        return self._slide.memory("slide") | self._pushed.memory("pushed")

    def recall(self, memory: Mapping[str, np.ndarray | float]) -> None:
        """Takes up what ``memory`` gave."""
        self._slide.recall("slide", memory)
        self._pushed.recall("pushed", memory)
