"""Time steps: Euler (explicit, linearly implicit, implicit) and BDF2. They know the contract of fluids, and no fluid.

Over a step every scheme is y = target + tau (u0 + M (f(y) + R)) for the displacements y since its start, with M frozen:
    Euler   target = 0,                             tau = dt
    BDF2    target = w^2/(1 + 2 w) y_old,           tau = dt (1 + w)/(1 + 2 w),     w = dt/dt_old
where y_old are the displacements of the step before. The turn of e1 about the tangent is one more component of y,
measured from the frame carried along (Eq. 41), so it advances to the same order as the positions; the paper's split
of Eq. 38 is first order whatever the positions do. w = 0 is Euler: the first step, and after any jump.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..errors import StepFailed
from ..fluids.base import Fluid, Response, Solution
from ..linalg.constraints import Prescribed
from ..linalg.stiffness import Stiffness
from ..rods.geometry import Configuration


class State(NamedTuple):
    """Where the rods are, the step that led there (y_old (n, m), dt_old; dt_old = 0 before the first), their number."""

    time: float
    configuration: Configuration
    y_old: np.ndarray
    dt_old: float
    steps: int = 0


class Step(NamedTuple):
    """A finished step: the new state, the nodes' velocities, the force the fluid felt, reactions, iterations.

    ``response`` is the fluid's that it was solved with: what a fluid that remembers is told when the step is taken.
    ``there`` is the geometry at which it was asked, where bodies balance; None where there are none.
    """

    state: State
    velocity: np.ndarray  # (n, m)
    force: np.ndarray  # (n, m), reactions included
    reaction: np.ndarray  # (n, m)
    iterations: int
    response: Response
    there: Configuration | None = None


class Bodies(Protocol):
    """The bodies of a scene over a step."""

    def carried(
        self,
        held: Prescribed,
        start: Configuration,
        configuration: Configuration,
        moment: Any,
        time: float,
        y: np.ndarray,
    ) -> Prescribed:
        """``held`` with what bodies carry at ``configuration``, y from ``start``, ``moment`` as ``forces`` gave it."""


class System(Protocol):
    """The rods, as a stepper needs them."""

    length: float

    def move(self, start: Configuration, y: np.ndarray) -> Configuration:
        """The configuration displaced by y from ``start``."""

    def turned(self, start: Configuration, y: np.ndarray) -> np.ndarray:
        """Displacements that turn every segment as y does and do not stretch it."""

    def forces(self, configuration: Configuration, time: float) -> tuple[np.ndarray, Any]:
        """Nodal forces (n, m), and what ``stiffness`` needs to go with them."""

    def stiffness(self, configuration: Configuration, start: Configuration, moment: Any, time: float) -> Stiffness:
        """The Jacobian of the forces with respect to y."""

    def definite_stiffness(
        self, configuration: Configuration, start: Configuration, moment: Any, time: float
    ) -> Stiffness:
        """The same without compressive geometric stiffness, the part that may make it indefinite."""

    def complete(self, y: np.ndarray) -> np.ndarray:
        """y with the nodes that are copies of others as these are."""

    def begin(self, tau: float, w: float) -> None:
        """A step of effective length tau begins: what answers to rates is told."""

    def held(self, before: float, after: float) -> Prescribed:
        """The prescribed displacements between two times."""

    def bodies(self, there: Configuration) -> Bodies | None:
        """The bodies over a step whose fluid is asked at the geometry ``there``; None where there are none."""


StiffnessOf = Callable[[Configuration, Configuration, Any, float], Stiffness]  # one of the two of the rods


class NotConverged(StepFailed):
    """Newton's iteration did not converge, least at ``node``."""


FAILURES = (StepFailed, np.linalg.LinAlgError)  # of a step: it may be tried again


def valueless(force: np.ndarray, response: Response, held: Prescribed) -> int | None:
    """The first node at which a force (n, m), or else the flow, has no value: a move then has none anywhere."""
    zero = np.zeros_like(force)
    for values in (force, response.forced(zero, held, zero).move):
        bad = np.nonzero(~np.isfinite(values).all(axis=1))[0]
        if 0 < len(bad) < len(values):
            return int(bad[0])
    return None


def require_values(move: np.ndarray, force: np.ndarray, response: Response, held: Prescribed) -> None:
    """Raises NotConverged, and tells where, if a ``move`` (n, m) has no value by what it was found from."""
    bad = ~np.isfinite(move).all(axis=1)
    if bad.any():
        where = valueless(force, response, held)
        still = "the run diverged: a position is no finite number any more"
        raise NotConverged(still, int(np.argmax(bad)) if where is None else where)


class Stepper(Protocol):
    """One scheme."""

    @property
    def order(self) -> int:
        """Order of accuracy in time."""

    def step(self, system: System, fluid: Fluid, state: State, dt: float) -> Step:
        """From ``state`` to ``state.time + dt``. Raises NotConverged."""

    def amplification(self, z: np.ndarray) -> np.ndarray:
        """The factor by which a step of length dt takes a mode exp(lam t), z = lam dt; no number where none is known.

        So the growth and the frequency that a run shows are the logarithm of it over dt.
        """


def _finish(
    system: System, state: State, dt: float, y: np.ndarray, velocity: np.ndarray, answer: Solution, count: int, response
) -> Step:
    y = system.complete(y)
    new = State(state.time + dt, system.move(state.configuration, y), y, dt, state.steps + 1)
    return Step(new, system.complete(velocity), answer.force, answer.reaction, count, response)
