"""A link: elements between points of rods, each with a few vectors v that are sums over nodes, v_j = sum_k W_jk r_k.

Its force and stiffness follow from how it answers these vectors, g_j = dU/dv_j and J_ij = dg_i/dv_j:

    f_k = - sum_j W_jk g_j,     df_k/dr_l = - sum_ij W_ik J_ij W_jl

Vectors between points of rods do not change as all is moved alike, and energies do not as all is turned alike: forces
and torques of a link add up to zero, to round-off, and J is symmetric but where something resists rates.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from ...linalg.compiled import njit
from ..geometry import Configuration
from ..linearization import Linearization
from ..loads import ExternalLoad


class Elements(NamedTuple):
    """l elements of q vectors each, of four nodes: those of two points, or of two segments."""

    nodes: np.ndarray  # (l, 4)
    weights: np.ndarray  # (l, q, 4) W
    offset: np.ndarray  # (l, q, 3) what a vector has beside its sum: a place in the lab

    def vectors(self, r: np.ndarray) -> np.ndarray:
        """The vectors (l, q, 3) at nodes r (n, 3)."""
        return self.offset + self.weights @ r[self.nodes]


class Seen(NamedTuple):
    """A link of l elements as an output has it."""

    first: np.ndarray  # (l, 3) the points it joins
    second: np.ndarray  # (l, 3)
    force: np.ndarray  # (l, 3) on the second; on the first the opposite
    parts: dict[str, np.ndarray]  # further numbers of each element (l,), by name


@njit(cache=True)
def _add_forces(nodes, weights, gradient, force):
    """f_k = - sum_j W_jk g_j"""
    for e in range(nodes.shape[0]):
        for k in range(nodes.shape[1]):
            for j in range(weights.shape[1]):
                for c in range(3):
                    force[nodes[e, k], c] -= weights[e, j, k] * gradient[e, j, c]


@njit(cache=True)
def _blocks(weights, jacobian, out):
    """- sum_ij W_ik J_ij W_jl into ``out`` (l, 4, 4, 3, 3), for J (l, q, 3, q, 3)."""
    count, q, nodes = weights.shape
    for e in range(count):
        for k in range(nodes):
            for n in range(nodes):
                for c in range(3):
                    for d in range(3):
                        total = 0.0
                        for i in range(q):
                            for j in range(q):
                                total -= weights[e, i, k] * jacobian[e, i, c, j, d] * weights[e, j, n]
                        out[e, k, n, c, d] = total


class Link(ExternalLoad):
    """A link ``name`` of some elements; kinds say how it answers, and what is seen of it.

    ``filaments`` are the numbers of those that it joins: two, or one where it joins one to the lab or to itself.
    """

    def __init__(self, name: str, filaments: tuple[int, ...], elements: Elements) -> None:
        self.name, self.filaments, self.elements = name, filaments, elements
        acts = np.abs(elements.weights).sum(axis=1) > 0.0  # (l, 4): a point on a node has no other
        nodes = elements.nodes
        self._kept = np.nonzero((acts[:, :, None] & acts[:, None, :]).ravel())[0]
        self._rows = np.repeat(nodes, 4, axis=1).ravel()[self._kept]
        self._columns = np.tile(nodes, (1, 4)).ravel()[self._kept]

    @property
    def pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """The pairs of nodes (l,) that it couples; none with itself."""
        beside = self._rows != self._columns
        return self._rows[beside], self._columns[beside]

    @abstractmethod
    def gradient(self, vectors: np.ndarray, time: float) -> np.ndarray:
        """g (l, q, 3) of the vectors (l, q, 3)."""

    @abstractmethod
    def jacobian(self, vectors: np.ndarray, time: float, definite: bool) -> np.ndarray:
        """J (l, q, 3, q, 3); ``definite``: without what may have negative eigenvalues."""

    @property
    @abstractmethod
    def stiffest(self) -> float:
        """The largest stiffness of an element, force a length."""

    unit = 1.0  # length by which a stiffness of the case is multiplied to be one of an element

    @abstractmethod
    def strained(self, configuration: Configuration) -> float:
        """The largest length by which an element is away from where it rests."""

    @abstractmethod
    def seen(self, configuration: Configuration, time: float) -> Seen:
        """The link at an output."""

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f_k = - sum_j W_jk g_j"""
        gradient = self.gradient(self.elements.vectors(configuration.r), time)
        _add_forces(self.elements.nodes, self.elements.weights, gradient, force)

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df_k/dr_l = - sum_ij W_ik J_ij W_jl"""
        vectors = self.elements.vectors(linearization.configuration.r)
        blocks = np.empty((len(vectors), 4, 4, 3, 3))
        _blocks(self.elements.weights, self.jacobian(vectors, time, linearization.definite), blocks)
        linearization.couple(self._rows, self._columns, blocks.reshape(-1, 3, 3)[self._kept])


def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The matrices a b (l, 3, 3) of vectors (l, 3)."""
    return a[:, :, None] * b[:, None, :]


def across(unit: np.ndarray) -> np.ndarray:
    """The projections 1 - u u (l, 3, 3) of unit vectors (l, 3)."""
    return np.eye(3) - outer(unit, unit)


def length(vectors: np.ndarray) -> np.ndarray:
    """Lengths (l,) of vectors (l, 3)."""
    return np.sqrt(np.sum(vectors * vectors, axis=1))
