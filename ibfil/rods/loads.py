"""External forces and moments on the rods. Each is one class: what it adds to the force, and to the stiffness.

All are external and act on the rod; the fluid feels them through it. Forces per length are taken times the control
volume Lc of each node (Eq. 16 of the paper prints ds, which gives a rod of N nodes N/(N - 1) times the force).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .geometry import Configuration
from .linearization import Linearization, cross, force_rows
from .mesh import Mesh

OfTime = Callable[[float], np.ndarray]


class ExternalLoad:
    """A load by default: one that does not push without end, and gives no moment to an end."""

    drives = False  # whether it pushes rods along for as long as it acts, as a spring does not

    def end_moment(self, configuration: Configuration, time: float) -> tuple[int, np.ndarray] | None:
        """The node of a free end that it gives a moment, and that moment (3,), in the lab; None where it does not."""
        return None


class Follower(ExternalLoad):
    """A force along +e3 of one node, of size ``size(t)``: external, so negative compresses at s = L.

    The paper's Sec. 7.7 has F0 e3 where -F0 e3 is meant: +F0 e3 stretches, and nothing flutters.
    """

    drives = True

    def __init__(self, node: int, size: Callable[[float], float]) -> None:
        self.node, self.size = np.array([node]), size

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f = size e3 on the node."""
        force[self.node, :3] += self.size(time) * configuration.e3[self.node]

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df = size de3."""
        linearization.tangent(self.node, force_rows(self.size(time) * np.eye(3)[None], linearization.m))


class DeadForce(ExternalLoad):
    """A force given in the lab, ``force(t)`` (k, 3), on the nodes ``nodes`` (k,): an end force, a weight."""

    drives = True

    def __init__(self, nodes: np.ndarray, force: OfTime) -> None:
        self.nodes, self.force = nodes, force

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f, whatever the rod does."""
        force[self.nodes, :3] += self.force(time)

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """Nothing: it does not follow."""


class ForceField(ExternalLoad):
    """A force that depends on where the nodes are, ``force(r, t)`` (k, 3) on nodes (k,)."""

    drives = True

    def __init__(self, nodes: np.ndarray, force: Callable[[np.ndarray, float], np.ndarray], reach: float) -> None:
        """``reach``: the length over which the force is differenced for its stiffness."""
        self.nodes, self.force, self._h = nodes, force, reach

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f at the nodes' places."""
        force[self.nodes, :3] += self.force(configuration.r[self.nodes], time)

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df = (df/dr) dr, by central differences of the expression."""
        r = linearization.configuration.r[self.nodes]
        rows = np.empty((len(r), 3, 3))
        for c in range(3):
            step = np.zeros(3)
            step[c] = self._h
            with np.errstate(invalid="ignore"):  # a force without a value ends the step, which tells its node
                rows[:, :, c] = (self.force(r + step, time) - self.force(r - step, time)) / (2 * self._h)
        linearization.position(self.nodes, force_rows(rows, linearization.m))


class Tether(ExternalLoad):
    """Springs -k (r - r0) on nodes (k,): ``stiffness`` (k,) a force per length, ``to(t)`` (k, 3)."""

    def __init__(self, nodes: np.ndarray, stiffness: np.ndarray, to: OfTime) -> None:
        self.nodes, self.stiffness, self.to = nodes, stiffness[:, None], to

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f = -k (r - r0)."""
        force[self.nodes, :3] -= self.stiffness * (configuration.r[self.nodes] - self.to(time))

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df = -k dr."""
        linearization.position(self.nodes, force_rows(-self.stiffness[:, :, None] * np.eye(3), linearization.m))


class BodyForce(ExternalLoad):
    """A force along the rod's own directors: ``parts(t)`` (k, 3) along e1, e2, e3, on nodes (k,)."""

    drives = True

    def __init__(self, nodes: np.ndarray, parts: OfTime) -> None:
        self.nodes, self.parts = nodes, parts

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """f = b1 e1 + b2 e2 + b3 e3."""
        force[self.nodes, :3] += vector(configuration, self.nodes, self.parts(time))

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """df = b_a de_a."""
        rows = np.broadcast_to(np.eye(3), (len(self.nodes), 3, 3))
        linearization.directors(self.nodes, self.parts(time), force_rows(rows, linearization.m))


class ActiveMoment(ExternalLoad):
    """A moment per length along e1, e2, e3, ``parts(t)`` (n, 3) at all nodes; zero where there is none.

    It enters the force of Eq. 13 as e3 x m, at half nodes by the mean of the nodes, AND the spin of Eq. 36 as Lc m3.
    The rod gets the moment m to second order in ds and first in the stretch, also where it is "torque-free".
    """

    def __init__(self, mesh: Mesh, parts: OfTime) -> None:
        self.mesh, self.parts = mesh, parts
        right, left = 0.5 * mesh.joined, 0.5 * np.append(False, mesh.joined[:-1])
        self._into = ((right - left, 0, 1.0), (right, 1, -1.0), (left, -1, 1.0))

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """Fluxes (q_i + q_{i+1})/2, q = e3 x m = m1 e2 - m2 e1, and the torque Lc m3."""
        m = self.parts(time)
        q = m[:, :1] * configuration.e2 - m[:, 1:2] * configuration.e1
        flux = np.where(self.mesh.joined[:-1, None], 0.5 * (q[:-1] + q[1:]), 0.0)
        force[:-1, :3] += flux
        force[1:, :3] -= flux
        if force.shape[1] == 4:
            force[:, 3] += self.mesh.volume * m[:, 2]

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """dq = m1 de2 - m2 de1, into the rows on either side of both segments of a node."""
        m = self.parts(time)
        crossed = np.column_stack([-m[:, 1], m[:, 0], np.zeros(len(m))])
        # Of a node's two fluxes, one on either side: in its own row they cancel but at an end.
        for sides, shift, sign in self._into:
            nodes = np.nonzero(sides)[0]
            rows = force_rows((sign * sides)[nodes, None, None] * np.eye(3), linearization.m)
            linearization.directors(nodes, crossed[nodes], rows, shift)


class EndMoment(ExternalLoad):
    """A moment m(t) on the end of a rod that is free to turn: M(L) = +m, M(0) = -m (rods/README.md).

    ``parts(t)`` (3,) in the lab, or along e1, e2, e3 where ``body``. The moment at the end node gives the flux beside
    it Q = e3 x M and P = M1 O1 + M2 O2, and the node the torque m.e3 and its source. Rods that are ``torque_free`` have
    Q/|d| where Eq. 44 has Q/ds, and no source at an end, so that the rod gets the moment m and no other.
    """

    def __init__(
        self,
        mesh: Mesh,
        node: int,
        finish: bool,
        parts: Callable[[float], np.ndarray],
        body: bool,
        torque_free: bool = False,
    ) -> None:
        self.node, self.parts, self.body = np.array([node]), parts, body
        self.sign = 1.0 if finish else -1.0
        self.inner = -1 if finish else 1  # where the node beside it is
        self.half = node - 1 if finish else node
        self.ds = float(mesh.ds[self.half])
        self.torque_free, self.volume = torque_free, 0.0 if torque_free else float(mesh.volume[node])

    def end_moment(self, configuration: Configuration, time: float) -> tuple[int, np.ndarray]:
        """M at the node, in the lab."""
        return int(self.node[0]), self._moment(configuration, time)

    def _moment(self, configuration: Configuration, time: float) -> np.ndarray:
        parts = self.parts(time)
        given = vector(configuration, self.node, parts[None])[0] if self.body else parts
        return self.sign * given

    def _distance(self, configuration: Configuration) -> float:
        """The length by which Q is divided."""
        return float(configuration.length[self.half]) if self.torque_free else self.ds

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """The flux sign Q/ds - P d/(2 ds) between the node and its neighbour, and the torque on the node."""
        i = int(self.node[0])
        moment, edge = self._moment(configuration, time), configuration.edge[self.half]
        q, p = cross(configuration.e3[i], moment), moment @ cross(configuration.e3[i], configuration.r_ss[i])
        flux = self.sign * q / self._distance(configuration) - 0.5 * p * edge / self.ds
        force[i, :3] -= self.sign * flux
        force[i + self.inner, :3] += self.sign * flux
        if force.shape[1] == 4:
            along = moment @ configuration.e3[i]
            # O1 M2 - O2 M1 = -(M.r'' - (M.e3)(e3.r''))
            source = along * (configuration.e3[i] @ configuration.r_ss[i]) - moment @ configuration.r_ss[i]
            force[i, 3] += self.sign * along + self.volume * source

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """Of the flux and of the torque, through de3, dr'', the gap, and dM where it turns with the rod."""
        configuration, i, m = linearization.configuration, int(self.node[0]), linearization.m
        moment, edge, e3, r_ss = (
            self._moment(configuration, time),
            configuration.edge[self.half],
            configuration.e3[i],
            configuration.r_ss[i],
        )
        q, p, lever = self.sign / self._distance(configuration), moment @ cross(e3, r_ss), 0.5 * edge / self.ds
        # One matrix (4, 3) on each of de3, dr'', dd, dM: three rows of the flux, one of the node's torque.
        on_e3, on_r_ss, on_edge, on_m = np.zeros((4, 4, 3))
        on_e3[:3] = -q * cross_matrix(moment) - np.outer(lever, cross(r_ss, moment))
        on_r_ss[:3] = -np.outer(lever, cross(moment, e3))
        on_edge[:3] = -0.5 * p / self.ds * np.eye(3)
        if self.torque_free:
            on_edge[:3] -= q * np.outer(cross(e3, moment), edge) / configuration.length[self.half] ** 2
        on_m[:3] = q * cross_matrix(e3) - np.outer(lever, cross(e3, r_ss))
        along, bent = moment @ e3, e3 @ r_ss
        on_e3[3] = self.sign * moment + self.volume * (moment * bent + along * r_ss)
        on_r_ss[3] = self.volume * (along * e3 - moment)
        on_m[3] = self.sign * e3 + self.volume * (bent * e3 - r_ss)
        # Into the row of the node, and into that of the node beside it, which feels the opposite force and no torque.
        node, shift = self.node.repeat(2), np.array([0, self.inner])
        side = self.sign * np.array([[-1.0], [1.0]]) * np.ones(4)
        side[:, 3] = 1.0, 0.0
        side = side[:, :m, None]
        linearization.tangent(node, side * on_e3[:m], shift)
        linearization.curvature(node, side * on_r_ss[:m], shift)
        if self.body:
            linearization.directors(
                node, (self.sign * self.parts(time))[None].repeat(2, axis=0), side * on_m[:m], shift
            )
        for end, factor in ((self.half + 1, 1.0), (self.half, -1.0)):
            linearization.position(np.array([end, end]), factor * side * on_edge[:m], i + shift - end)


def vector(configuration: Configuration, nodes: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """p1 e1 + p2 e2 + p3 e3 (k, 3) at nodes (k,), from parts (k, 3)."""
    return (
        parts[:, :1] * configuration.e1[nodes]
        + parts[:, 1:2] * configuration.e2[nodes]
        + parts[:, 2:] * configuration.e3[nodes]
    )


def cross_matrix(v: np.ndarray) -> np.ndarray:
    """The matrix of v x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
