"""The interfaces of the rods' parts, a constitutive law, a load, prescribed ends; and the step a tangent forbids."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ..errors import StepFailed
from .geometry import Configuration
from .linearization import Linearization


class Law(Protocol):
    """A constitutive law of all n nodes: strains in, moments out, with their derivatives.

    The caller puts zeros into what is returned at ends that carry no moment. ``nonlocal_twist`` (n, 2) are dM3/dO3 at a
    half node by the twist of the half nodes before and after it, or None where M3 is a matter of its own half node.
    """

    @property
    def nonlocal_twist(self) -> np.ndarray | None:
        """Constant in time, zero where there is no such half node."""

    def bending(self, bend: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M1, M2 (n, 2) and dM_a/dO_b (n, 2, 2) of the curvatures (n, 2)."""

    def twisting(self, twist: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """M3 (n,) and dM3/dO3 (n,) of the twist at half nodes (n,)."""


class Load(Protocol):
    """An external force: one verb for what it is, one for how it changes; and what others need to know of it."""

    drives: bool

    def end_moment(self, configuration: Configuration, time: float) -> tuple[int, np.ndarray] | None:
        """The node of a free end that it gives a moment, and that moment (3,), in the lab; None where it does not."""

    def add_force(self, configuration: Configuration, time: float, force: np.ndarray) -> None:
        """Adds the force on each node, (n, m)."""

    def add_stiffness(self, time: float, linearization: Linearization) -> None:
        """Adds its derivative to the stiffness being filled."""


class Ends(Protocol):
    """The prescribed motion of held ends."""

    index: np.ndarray

    def motion(self, before: float, after: float) -> np.ndarray:
        """Displacements (k,) of the held unknowns between two times."""


class NoContact:
    """No contact: rods may pass through each other."""

    repulsion = None

    def watch(self, before: np.ndarray, after: np.ndarray, start: float, end: float) -> str:
        """Nothing is looked for."""
        return ""

    def refuse_passing(self, before: np.ndarray, after: np.ndarray) -> None:
        """Nothing is refused."""

    def loads(self) -> list[Load]:
        """None."""
        return []

    def diagnostics(self, r: np.ndarray) -> dict[str, float]:
        """Nothing."""
        return {}

    def state(self) -> dict[str, float | np.ndarray]:
        """Nothing."""
        return {}

    def restore(self, state: Mapping[str, float | np.ndarray]) -> None:
        """Nothing."""


REVERSED = 0.02  # of 1 + e3.e3', 2 where a tangent keeps its direction: below, Eq. 41 does not know which way it went


class TangentReversed(StepFailed):
    """A tangent turned by nearly 180 degrees within one step, or is no number; ``node`` says which.

    ``least`` is 1 + e3.e3' there.
    """

    def __init__(self, node: int, least: float) -> None:
        turned = f"the tangent at a node reversed within a step: 1 + e3.e3' = {least:.2g} (allowed {REVERSED})"
        diverged = "the run diverged: a position is no finite number any more"
        super().__init__(turned if np.isfinite(least) else diverged, node)
