"""The ways in which a run fails: what was found, the limit, the likely cause, the key to change. Each in one place.

The README lists these with what `ibfil check` warns of (check/warnings.py) and refusals of cases
(case/consistency/scene.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit
from ..rods.geometry import Configuration
from ..rods.mesh import Mesh

LONGEST, SHORTEST = 2.0, 0.2  # of the rest length: beyond this a segment is no rod any more
LARGEST_TWIST = 2.8  # radians from node to node: beyond pi the twist comes back from the other side
UNBOUNDED = "a load, a law or a flow that grows without bound, or has no value, where the rod has come to"


class Failure(NamedTuple):
    """A step that led out of bounds: what was found and allowed, at which node if one is to blame, why, the cure."""

    message: str
    node: int | None
    cause: str
    remedy: str


class Step(NamedTuple):
    """The facts of a step: its length, the scheme's limit (infinite where it has none), thermal kicks."""

    dt: float
    limit: float
    kicked: bool = False

    def cause(self, otherwise: str) -> str:
        """The likely cause: a step above the limit where there is one."""
        if self.dt > self.limit:
            return f"dt = {self.dt:.3g} is above the explicit scheme's limit, {self.limit:.3g} at the start shape"
        if self.kicked:
            return f"thermal kicks turn segments further within dt = {self.dt:.3g} than the linearised step follows"
        return otherwise

    def remedy(self, otherwise: str) -> str:
        """The key to change then."""
        if self.dt > self.limit:
            return f"time.step below {self.limit:.3g}, or time.scheme=implicit"
        if self.kicked:
            return 'a tenth of time.step, or "auto"; fewer nodes; what `ibfil check` says of the moduli'
        return otherwise


@njit(cache=True)
def _survey(joined, twisting, ds, r, length, twist):
    """The largest and smallest |d|/ds, the largest |O3 ds|, the node of each; and the first node that is not finite."""
    high, low, turn = 0.0, np.inf, 0.0
    longest = shortest = twisted = 0
    for i in range(joined.size):
        if not np.isfinite(r[i, 0] + r[i, 1] + r[i, 2]):
            return high, low, turn, longest, shortest, twisted, i
        if joined[i]:
            q = length[i] / ds[i]
            if q > high:
                high, longest = q, i
            if q < low:
                low, shortest = q, i
            if twisting[i] and abs(twist[i] * ds[i]) > turn:
                turn, twisted = abs(twist[i] * ds[i]), i
    return high, low, turn, longest, shortest, twisted, -1


class Diverged(NamedTuple):
    """A position is no finite number at ``node``."""

    node: int

    def trouble(self, step: Step) -> Failure:
        """The failure, for the user."""
        message = f"the run diverged: a position is no finite number any more (dt = {step.dt:.3g})"
        return Failure(message, self.node, step.cause(UNBOUNDED), step.remedy("the loads, law or fluid.flow"))


class OverStretched(NamedTuple):
    """The segment after ``node``, of axial stiffness EA = ``stretching``, is ``ratio`` times its rest length."""

    node: int
    ratio: float
    stretching: float

    def trouble(self, step: Step) -> Failure:
        """The failure, for the user."""
        message = f"a segment is {self.ratio:.3g} times its rest length (allowed {SHORTEST} to {LONGEST})"
        pull = f"about {abs(self.ratio - 1.0) * self.stretching:.3g}, more than its EA = {self.stretching:.3g} bears"
        cause = step.cause(f"the rod is pulled or pressed with {pull}")
        remedy = step.remedy("a larger stretching, smaller loads, or a shorter time.step")
        return Failure(message, self.node, cause, remedy)


class OverTwisted(NamedTuple):
    """The twist O3 ds of the segment after ``node``, an ``angle`` in radians, is near half a turn."""

    node: int
    angle: float

    def trouble(self, step: Step) -> Failure:
        """The failure, for the user."""
        message = f"the twist between two nodes nears half a turn: {self.angle:.3g} rad (allowed {LARGEST_TWIST})"
        cause = step.cause(
            "the rod is wound up faster than it unwinds, until nodes cannot tell the turn from its opposite"
        )
        return Failure(message, self.node, cause, step.remedy("more nodes, a slower spin, a larger twisting"))


def out_of_bounds(
    mesh: Mesh, twisting: np.ndarray, stretching: np.ndarray, configuration: Configuration
) -> Diverged | OverStretched | OverTwisted | None:
    """The bound that the configuration is beyond; None within all of them.

    ``twisting`` (n,) is True at nodes of filaments that twist, ``stretching`` (n,) is EA at half nodes.
    """
    high, low, turn, longest, shortest, twisted, bad = _survey(
        mesh.joined, twisting, mesh.ds, configuration.r, configuration.length, configuration.twist
    )
    if bad >= 0:
        return Diverged(bad)
    if high > LONGEST:
        return OverStretched(longest, high, float(stretching[longest]))
    if low < SHORTEST:
        return OverStretched(shortest, low, float(stretching[shortest]))
    return OverTwisted(twisted, turn) if turn > LARGEST_TWIST else None


def too_many(steps: int, most: int, end: float, dt: float) -> Failure:
    """More steps than the case allows."""
    message = f"{steps} steps are taken (allowed: time.max_steps = {most})"
    cause = f"steps of {dt:.3g} for a time.end of {end:g}"
    return Failure(message, None, cause, "a larger time.max_steps, a longer time.step, or a larger time.tolerance")


def unsolved(reason: str, dt: float, smallest: float, node: int | None, step: Step) -> Failure:
    """A step that Newton's iteration or the linear solve did not find, however short."""
    message = f"{reason} (dt = {dt:.3g}; time.min_step = {smallest:.3g} ends the halving)"
    if "diverged" in reason:
        return Failure(
            message, node, step.cause(UNBOUNDED), step.remedy("the loads, law or fluid.flow, or a shorter time.step")
        )
    if "wall" in reason:
        cause = "what drives or loads the rod presses it on the wall, where no force of contact holds it off"
        return Failure(message, node, cause, "filament.NAME.position, direction, or the loads; a smaller fluid.spacing")
    cause = "a rod that snaps, or loads, a law or contact stiffer than any step: no shorter one helped"
    return Failure(
        message,
        node,
        step.cause(cause),
        step.remedy("softer loads or law, more nodes, or a smaller time.step and time.min_step"),
    )
