"""Thermal forces in resistive-force theory (Sec. 7.4 and 7.5 of the paper), and the scheme that keeps their statistics.

Over a step the fluid kicks a node with an impulse of mean zero and covariance 2 kT dt Z (Eq. 53, which is right where
Eq. 50-52 print 2 zeta kT/(ds dt): lambda^2 = 2 zeta kT), and turns it about the tangent by one of variance
2 kT dt Lc zeta_r, with a normal number of its own (the paper's Sec. 7.5 prints none):

    Z = Lc [zeta_perp (1 - e3 e3) + zeta_par e3 e3],   Lc half a segment at an end; nothing on held unknowns

Z turns with the rod, and is taken where the step begins. Boltzmann's law then asks for kT div Z^-1 (Ito), the force

    (d - 1) kT (1 - zeta_par/zeta_perp) W1_ii/|r'| e3

with W1_ii the weight of a node in its own tangent, and d = 3, or 2 in a plane. It is zero but at the ends, and where
spacing is uneven; without it a free rod is under a compression of 1.5 kT/ds, the more the finer it is.

Of a mode of rate lam, backward Euler leaves kT/k/(1 + lam dt/2), and BDF2 less; the trapezoid kT/k at every dt. Its
price: it forgets the stiffest modes in lam dt/4 steps (timestepping/README.md).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..fluids.base import Fluid
from ..linalg.constraints import Prescribed
from ..rods.geometry import Configuration
from ..rods.mesh import Mesh
from .base import State, Step, System

if TYPE_CHECKING:
    from ..fluids.resistive_force import Drag


def own_weight(mesh: Mesh) -> np.ndarray:
    """W1_ii (n,): how much of its own position is in the derivative r' of each node, per length."""
    rows = np.arange(len(mesh.ds))
    return mesh.w1[rows, rows - mesh.first]


class Noise:
    """The thermal force on n nodes over a step, from a seeded stream of normal numbers.

    ``drag`` holds drag coefficients times control volumes, ``held`` (k,) the flat indices of held unknowns,
    ``energy`` is kT. ``planar`` leaves out the lab's z component, for rods in a plane z = const; ``twist``: whether
    nodes are turned as well.
    """

    def __init__(
        self,
        drag: Drag,
        mesh: Mesh,
        held: np.ndarray,
        unknowns: int,
        energy: float,
        seed: int,
        planar: bool,
        twist: bool,
    ) -> None:
        self._random = np.random.Generator(np.random.PCG64(seed))
        self._across, self._along = (np.sqrt(2 * energy * z)[:, None] for z in (drag.perp, drag.par))
        self._spin = np.sqrt(2 * energy * drag.spin) if twist else np.zeros(len(drag.spin))
        kicked = np.ones((len(drag.perp), unknowns))
        if planar:
            kicked[:, 2] = 0.0
        kicked.ravel()[held] = 0.0
        self._kicked = kicked
        self._drift = ((1 if planar else 2) * energy * (1 - drag.par / drag.perp) * own_weight(mesh))[:, None]

    def force(self, configuration: Configuration, dt: float) -> np.ndarray:
        """The mean force (n, m) of the next kicks, over a step ``dt`` from ``configuration``, Ito's drift included."""
        normal = self._random.standard_normal(self._kicked.shape)
        out = np.empty_like(normal)
        along = np.sum(normal[:, :3] * configuration.e3, axis=1)[:, None] * configuration.e3
        out[:, :3] = self._across * normal[:, :3] + (self._along - self._across) * along
        if out.shape[1] == 4:
            out[:, 3] = self._spin * normal[:, 3]
        out /= np.sqrt(dt)
        out[:, :3] += self._drift / configuration.metric[:, None] * configuration.e3
        return out * self._kicked

    def state(self) -> str:
        """Where the stream of random numbers stands, as JSON."""
        return json.dumps(self._random.bit_generator.state)

    def restore(self, state: str) -> None:
        """Goes on from where ``state`` says."""
        self._random.bit_generator.state = json.loads(state)


@dataclass(frozen=True)
class Trapezoid:
    """The linearised trapezoid: (Z - dt/2 K) y = dt (f + Z u0) + xi, loads and flow those of the middle of the step.

    A fluid's implicit answer over tau = dt/2 to the force f + xi/dt is h with (Z - dt/2 K) h = dt/2 (Z u0 + f) + xi/2:
    half of y, so the rods go to twice of it. Held unknowns go half their way likewise. K is exact: a part left
    out would make stiff what is soft, and variances too small.
    """

    noise: Noise
    order: int = 1

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """One force, one stiffness, one linear solve.

        The force of the step is what the rods do to the fluid: f + K y/2 and reactions, the fluid's kicks not in it.
        """
        middle = state.time + 0.5 * dt
        system.begin(0.5 * dt, 0.0)
        force, inner = system.forces(state.configuration, middle)
        matrix = system.stiffness(state.configuration, state.configuration, inner, middle)
        kicks = self.noise.force(state.configuration, dt)
        index, value = system.held(state.time, state.time + dt)
        zero = np.zeros_like(force)
        response = fluid.response(state.configuration.r, state.configuration.e3, middle, 0.5 * dt)
        half = response.implicit(force + kicks, matrix, Prescribed(index, 0.5 * value), zero, zero)
        y = 2 * half.move
        new = State(state.time + dt, system.move(state.configuration, y), y, dt)
        return Step(new, y / dt, half.force - kicks, half.reaction, 1, response)

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The factor by which a step takes a mode exp(lam t), z = lam dt: that of the trapezoid."""
        return (1.0 + 0.5 * z) / (1.0 - 0.5 * z)
