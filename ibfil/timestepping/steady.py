"""A scene that stands still in a frame of its own: rods and fluid of one moment, seen from where they are at rest.

Nothing depends on time here: loads, strains and flows are those of one moment, held ends are at rest. A rod that spins
at a clamp is at rest to one who turns its e1 back as fast (``Frame.spin``), if it is the same all around, else to one
who turns with the clamp (``Frame.rate``):

    v(shape) = u0 - Omega x (r - c) + M (f + R),       turn: spin mobility times torque - Omega.e3 - spin

The steppers take such rods and fluids like any other, so equilibria and modes need no scheme of their own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import StepFailed
from ..fluids.base import Fluid, Memoryless, Response, Solution
from ..linalg.constraints import Prescribed
from ..linalg.normal_numbers import Draw
from ..linalg.stiffness import Stiffness
from ..rods.geometry import Configuration, measure
from ..rods.system import RodSystem

_UNLIKE, _ASIDE = 0.01, 0.1  # of a velocity: a fluid that is not; of the length: shapes for which that is asked
ALIKE = 1e-8  # of forces before and after a turn of e1: the rod is the same all around
_TURN = 0.7  # radians, in no symmetry of a ribbon
_STIR = 1e-3  # of the length, of a displacement that asks how a scene answers


class NoRest(StepFailed):
    """A scene that has no state of rest; the text says why, ``node`` where."""


class Frame(NamedTuple):
    """The motion taken out: the spin of e1 (n,), and a rotation at ``rate`` (3,), rad/time, about ``centre`` (3,).

    All zero: the lab.
    """

    spin: np.ndarray
    rate: np.ndarray
    centre: np.ndarray

    @property
    def still(self) -> bool:
        """Whether it is the lab."""
        return not (self.spin.any() or self.rate.any())

    @property
    def turns(self) -> bool:
        """Whether places turn, not e1 alone."""
        return bool(self.rate.any())

    def motion(self, r: np.ndarray, e3: np.ndarray, m: int) -> np.ndarray:
        """The motion (n, m) of the frame at nodes r (n, 3) with tangents e3 (n, 3)."""
        out = np.zeros((len(r), m))
        out[:, :3] = np.cross(self.rate, r - self.centre)
        if m == 4:
            out[:, 3] = self.spin + e3 @ self.rate
        return out


class _SteadyResponse:
    """A response in a frame: what the frame moves by in tau is taken off the target."""

    def __init__(self, inner: Response, moved: np.ndarray) -> None:
        self._inner, self._moved, self.keeps = inner, moved, inner.keeps

    def forced(self, force: np.ndarray, held: Prescribed, target: np.ndarray) -> Solution:
        return self._inner.forced(force, held, target - self._moved)

    def implicit(
        self,
        force: np.ndarray,
        stiffness: Stiffness,
        held: Prescribed,
        y: np.ndarray,
        target: np.ndarray,
        error: float = 0.0,
    ) -> Solution:
        return self._inner.implicit(force, stiffness, held, y, target - self._moved, error)

    def fluctuation(self, draw: Draw, shape: tuple[int, int]) -> np.ndarray:
        return self._inner.fluctuation(draw, shape)


class SteadyFluid(Memoryless):
    """A fluid without a past at one time, seen from a frame."""

    def __init__(self, fluid: Fluid, frame: Frame, unknowns: int, time: float) -> None:
        self.fluid, self.frame, self.time, self._m = fluid, frame, time, unknowns

    def response(self, r: np.ndarray, e3: np.ndarray, time: float, tau: float, w: float = 0.0) -> Response:
        """The fluid's own response less the motion of the frame; ``time`` does not count."""
        inner = self.fluid.response(r, e3, self.time, tau)
        return inner if self.frame.still else _SteadyResponse(inner, tau * self.frame.motion(r, e3, self._m))

    def velocity_at(
        self, points: np.ndarray, r: np.ndarray, e3: np.ndarray, force: np.ndarray, time: float
    ) -> np.ndarray:
        """The fluid's own velocity (k, 3), in the lab."""
        return self.fluid.velocity_at(points, r, e3, force, self.time)


class SteadyRods:
    """Rods at one time whose held ends stand still; what steppers ask of rods, and no more."""

    def __init__(self, system: RodSystem, time: float) -> None:
        self.system, self.time, self.length = system, time, system.length
        self._held = Prescribed(system.ends.index, np.zeros(system.ends.index.size))
        self.move, self.turned, self.complete = system.move, system.turned, system.complete

    def forces(self, configuration: Configuration, time: float):
        """Nodal forces (n, m), and what ``stiffness`` needs to go with them."""
        return self.system.forces(configuration, self.time)

    def stiffness(self, configuration: Configuration, start: Configuration, moment, time: float) -> Stiffness:
        """The Jacobian of the forces."""
        return self.system.stiffness(configuration, start, moment, self.time)

    def begin(self, tau: float, w: float) -> None:
        """Nothing: where rods are at rest in their frame nothing has a rate."""

    def definite_stiffness(self, configuration: Configuration, start: Configuration, moment, time: float) -> Stiffness:
        """The same without compressive geometric stiffness."""
        return self.system.definite_stiffness(configuration, start, moment, self.time)

    def held(self, before: float, after: float) -> Prescribed:
        """Held unknowns do not move."""
        return self._held

    def bodies(self, there: Configuration) -> None:
        """None: scenes with bodies are not asked for their rest."""


# --- the frame of a scene ---------------------------------------------------------------------------------------------


def frame_of(system: RodSystem, fluid: Fluid, configuration: Configuration, time: float) -> Frame:
    """The frame in which held ends are at rest. Raises NoRest where there is none.

    The lab where nothing spins; where rods that spin are the same all around, the lab but for the turn of their e1;
    else the frame that turns with their clamps, which must agree, and in which the fluid must be the same all around.
    """
    n, m = len(configuration.r), system.unknowns
    spins, clamps = _spins(system, time)
    still = Frame(np.zeros(n), np.zeros(3), np.zeros(3))
    if not clamps.size:
        return still
    spin = np.zeros(n)
    for rod in rods(system):
        at = clamps[(clamps >= rod.start) & (clamps < rod.stop)]
        rates = np.unique(spins[at])
        if rates.size > 1:
            raise NoRest(f"the ends of a rod spin at {rates[0]:g} and {rates[-1]:g}: its twist grows", int(at[0]))
        spin[rod] = rates[0] if at.size else 0.0
    if _same_all_around(system, configuration, spin != 0, time):
        return still._replace(spin=spin)
    node = int(clamps[np.argmax(np.abs(spins[clamps]))])
    rate, centre = spins[node] * configuration.e3[node], configuration.r[node].copy()
    turning = Frame(np.zeros(n), rate, centre)
    off = turning.motion(configuration.r, configuration.e3, m) - np.column_stack([np.zeros((n, 3)), spins])
    worst = int(np.argmax(np.abs(off.ravel()[system.ends.index])))
    if np.abs(off.ravel()[system.ends.index]).max() > ALIKE * abs(spins[node]) * (1 + system.length):
        held = int(system.ends.index[worst]) // m
        raise NoRest("rods that are not round are at rest in a frame that turns with one clamp; others move", held)
    _refuse_fluid_unlike(system, fluid, configuration, turning, time)
    return turning


def rods(system: RodSystem) -> list[slice]:
    """The node range of each rod in the stack."""
    ends = np.nonzero(~system.mesh.joined)[0] + 1
    return [slice(int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def _spins(system: RodSystem, time: float) -> tuple[np.ndarray, np.ndarray]:
    """The rates (n,) at which held ends spin, and the nodes of those whose e1 is held, where any of them spins.

    Raises NoRest where a held end moves along.
    """
    n, m, index = len(system.mesh.joined), system.unknowns, system.ends.index
    rate = system.ends.motion(time, time + 1.0)
    turns = index % m == 3
    if np.any(rate[~turns]):
        node = int(index[~turns][np.argmax(np.abs(rate[~turns]))]) // m
        raise NoRest("a held end moves", node)
    spins = np.zeros(n)
    spins[index[turns] // m] = rate[turns]
    return spins, index[turns] // m if spins.any() else np.zeros(0, np.int64)


def _same_all_around(system: RodSystem, configuration: Configuration, spun: np.ndarray, time: float) -> bool:
    """Whether the forces on the rods that are spun (n,) stay as they are when all their e1 turn by one angle."""
    rng = np.random.default_rng(0)
    y = _STIR * system.length * rng.standard_normal((len(configuration.r), system.unknowns))
    y.ravel()[system.ends.index] = 0.0
    bent = system.move(configuration, y)
    turn = np.where(spun, _TURN, 0.0)[:, None]
    e1 = np.cos(turn) * bent.e1 + np.sin(turn) * bent.e2
    turned = measure(system.mesh, np.ascontiguousarray(bent.r), e1)
    before, after = system.forces(bent, time)[0], system.forces(turned, time)[0]
    return bool(np.abs(after - before).max() <= ALIKE * np.abs(before).max())


def _refuse_fluid_unlike(
    system: RodSystem, fluid: Fluid, configuration: Configuration, frame: Frame, time: float
) -> None:
    """Raises NoRest where the fluid moves the turned rods otherwise than it moves the rods, turned."""
    from scipy.spatial.transform import Rotation

    axis = frame.rate / np.linalg.norm(frame.rate)
    turn = Rotation.from_rotvec(_TURN * axis).as_matrix()
    rng, held = np.random.default_rng(0), Prescribed(np.zeros(0, np.int64), np.zeros(0))
    # A shape and forces that are smooth along the rods, off the axis: a flow may vanish on it.
    smooth = rng.standard_normal((2, len(configuration.r), system.unknowns)).cumsum(axis=1)
    force, aside = smooth[0], smooth[1] * (_ASIDE * system.length / np.abs(smooth[1]).max())
    there = configuration.r + aside[:, :3] - frame.centre
    moves = []
    for way in (np.eye(3), turn):
        pushed = force.copy()
        pushed[:, :3] = force[:, :3] @ way.T
        response = fluid.response(there @ way.T + frame.centre, configuration.e3 @ way.T, time, 1.0)
        still = response.forced(np.zeros_like(force), held, np.zeros_like(force)).move
        moved = response.forced(pushed, held, np.zeros_like(force)).move
        moves.append([part[:, :3] @ way for part in (still, moved - still)])
    off = max(float(np.abs(a - b).max() / max(np.abs(a).max(), 1e-300)) for a, b in zip(*moves, strict=True))
    if off > _UNLIKE:
        raise NoRest(
            f"a rod that is not round spins, and the fluid (box, flow) is not the same all around: {off:.2g} of "
            f"a velocity (allowed {_UNLIKE:g})",
            0,
        )
