"""Hinges: two segments that are turned into line."""

from __future__ import annotations

import numpy as np

from ..geometry import Configuration
from .base import Elements, Link, Seen, across, length, outer


class Hinge(Link):
    """The energy k (1 - u.v) of the directions u and v of two segments a and b, which are drawn into line.

    The vectors are the segments, u = a/|a|; with P = 1 - u u, Q = 1 - v v,

        g_a = -k P v/|a|,     J_aa = k [u.v P + (P v) u + u (P v)]/|a|^2,     J_ab = -k P Q/(|a| |b|)

    ``definite`` has k |du - dv|^2/2 instead. The moment is k sin of the angle between them.
    """

    def __init__(
        self, name: str, filaments: tuple[int, ...], elements: Elements, stiffness: np.ndarray, shortest: float
    ) -> None:
        """``shortest``: the rest length of the shorter segment."""
        super().__init__(name, filaments, elements)
        self._stiffness, self._shortest, self.unit = stiffness, shortest, shortest**-2

    def _directions(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """u, v (l, 3), |a| and |b| (l, 1)."""
        a, b = vectors[:, 0], vectors[:, 1]
        long_a, long_b = length(a)[:, None], length(b)[:, None]
        return a / long_a, b / long_b, long_a, long_b

    def gradient(self, vectors: np.ndarray, time: float) -> np.ndarray:
        """-k P v/|a| and -k Q u/|b|."""
        u, v, long_a, long_b = self._directions(vectors)
        along, k = np.sum(u * v, axis=1)[:, None], self._stiffness[:, None]
        return np.stack([-k * (v - along * u) / long_a, -k * (u - along * v) / long_b], axis=1)

    def jacobian(self, vectors: np.ndarray, time: float, definite: bool) -> np.ndarray:
        """Of both by both."""
        u, v, long_a, long_b = self._directions(vectors)
        pu, pv, k = across(u), across(v), self._stiffness[:, None, None]
        out = np.empty((len(u), 2, 3, 2, 3))
        if definite:
            on = np.stack([pu / long_a[:, :, None], -pv / long_b[:, :, None]], axis=1)
            return k[:, :, :, None, None] * np.einsum("lica,ljcb->liajb", on, on)
        along = np.sum(u * v, axis=1)[:, None]
        for i, unit, p, other, size in ((0, u, pu, v - along * u, long_a), (1, v, pv, u - along * v, long_b)):
            bent = outer(other, unit)
            out[:, i, :, i] = k * (along[:, :, None] * p + bent + bent.transpose(0, 2, 1)) / size[:, :, None] ** 2
        cross = -k * (pu @ pv) / (long_a * long_b)[:, :, None]
        out[:, 0, :, 1], out[:, 1, :, 0] = cross, cross.transpose(0, 2, 1)
        return out

    @property
    def stiffest(self) -> float:
        """k over the product of the segments' lengths, of which the shorter is taken twice."""
        return float(np.max(self._stiffness)) / self._shortest**2

    def strained(self, configuration: Configuration) -> float:
        """None: it may be laid at any angle."""
        return 0.0

    def seen(self, configuration: Configuration, time: float) -> Seen:
        """The angle and the moment; it joins the middles of the segments."""
        r = configuration.r[self.elements.nodes]
        u, v, _, _ = self._directions(self.elements.vectors(configuration.r))
        turned = length(np.cross(u, v))
        parts = {"angle": np.arctan2(turned, np.sum(u * v, axis=1)), "moment": self._stiffness * turned}
        return Seen(r[:, :2].mean(axis=1), r[:, 2:].mean(axis=1), np.zeros_like(u), parts)
