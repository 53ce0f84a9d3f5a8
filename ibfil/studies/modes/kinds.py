"""The kind of a mode: rigid motion, or what it strains; in which plane.

A mode is rigid where it strains nothing: its elastic energy is below 0.01 of A/L^3 times the square of its largest
displacement. Else it is named by where most of that energy is: bending, twist, stretch. Planes are told where all
filaments lie in one and are not straight.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...timestepping.steady import rods

if TYPE_CHECKING:
    from ...rods.geometry import Configuration
    from ...simulation.at_rest import SceneAtRest

RIGID = 0.01  # elastic energy in units of A/L^3 times the square of the largest displacement
OUT, IN = 0.95, 0.05  # shares across a plane
FLAT = 1e-6  # of the length: a rod straight, a scene planar
_STIR = 1e-6  # of the length: a move that asks for strains


@dataclass(frozen=True)
class Kind:
    """The kind of a mode: its word, whether it is rigid, its share across the plane of the rest (None: there is none).

    ``energy`` are the shares of bending, twist and stretch in its elastic energy.
    """

    word: str
    rigid: bool
    across: float | None
    energy: tuple[float, float, float]


class Shape:
    """A configuration of rest: straight, planar (its normal), or in space."""

    def __init__(self, scene: SceneAtRest, configuration: Configuration) -> None:
        self.scene, self.configuration = scene, configuration
        r, length = configuration.r, scene.system.length
        parts = [r[rod] - r[rod].mean(axis=0) for rod in rods(scene.system)]
        self.straight = all(np.linalg.svd(part, compute_uv=False)[1] < FLAT * length for part in parts)
        _, sizes, axes = np.linalg.svd(r - r.mean(axis=0), full_matrices=True)
        planar = len(sizes) < 3 or sizes[2] < FLAT * length
        self.normal = axes[2] if planar and sizes[1] > FLAT * length else None

    def kind(self, vector: np.ndarray) -> Kind:
        """That of a mode (n, m), complex or real."""
        total, shares = self._energy(vector)
        moved, turned = vector[:, :3], vector[:, 3:]
        size, turn = float(np.abs(moved).max()), self.scene.system.length * float(np.abs(turned).max(initial=0.0))
        rigid = total < RIGID * self._softest * max(size, turn) ** 2
        across = None
        if self.normal is not None and not self.straight and size > 0.1 * turn:
            across = float(np.linalg.norm(moved @ self.normal) / np.linalg.norm(moved)) ** 2
        word = "rigid motion" if rigid else ("bending", "twist", "stretch")[int(np.argmax(shares))]
        if across is not None:
            word += ", out of plane" if across > OUT else ", in plane" if across < IN else ""
        return Kind(word, rigid, across, shares)

    @cached_property
    def _softest(self) -> float:
        """A/L^3 of the softest filament."""
        from ...simulation.timescales import softest

        return min(softest(f) / f.length**3 for f in self.scene.simulation.case.filaments.values())

    def _energy(self, vector: np.ndarray) -> tuple[float, tuple[float, float, float]]:
        """The elastic energy of a mode, to second order and without the half; the shares of bending, twist, stretch."""
        system, fluid = self.scene.system, self.scene.fluid
        moment = system.moment(self.configuration, fluid.time)
        total = np.zeros(3)
        for part in (vector.real, vector.imag):
            size = float(np.abs(part).max())
            if size == 0.0:
                continue
            h = _STIR * system.length / size
            sides = [system.move(self.configuration, sign * h * part) for sign in (1.0, -1.0)]
            bend, twist, length = (
                (getattr(sides[0], key) - getattr(sides[1], key)) / (2 * h) for key in ("bend", "twist", "length")
            )
            mesh = system.mesh
            total[0] += np.einsum("i,ia,iab,ib->", mesh.volume, bend, moment.bend_slope, bend)
            if system.unknowns == 4:
                total[1] += np.sum(mesh.ds * moment.twist_slope * twist**2)
            total[2] += np.sum((system.stretching * length**2 / mesh.ds)[mesh.joined])
        total = np.maximum(total, 0.0)
        shares = total / total.sum() if total.sum() > 0 else total
        return float(total.sum()), (float(shares[0]), float(shares[1]), float(shares[2]))

    @property
    def unphysical_across(self) -> bool:
        """Whether modes out of its plane are none of a real rod: it is bent and does not twist, so has no torsion."""
        return self.normal is not None and not self.straight and self.scene.system.unknowns == 3
