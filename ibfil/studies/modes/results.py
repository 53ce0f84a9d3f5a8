"""The modes of a scene at rest, and the thresholds of what grows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..estimates import Estimate
from .kinds import Kind

if TYPE_CHECKING:
    import numpy as np

    from ...timestepping.equilibrium import Rest


@dataclass(frozen=True)
class Mode:
    """One mode, or two that are alike: eigenvalue at the case's own nodes, and what three levels of nodes make of it.

    ``vector`` (n, m) has a largest entry of one; ``count`` is 2 for a double mode; ``growth`` and ``frequency`` are the
    estimates of the errors of the real and imaginary parts, None where the mode could not be followed.
    """

    value: complex
    vector: np.ndarray
    count: int
    kind: Kind
    growth: Estimate | None
    frequency: Estimate | None
    seen: Mapping[str, complex]  # growth and frequency that a run shows, by scheme

    @property
    def corrected(self) -> complex:
        """The eigenvalue less the errors that are known."""
        errors = [0.0 if part is None else part.error for part in (self.growth, self.frequency)]
        return complex(self.value.real - errors[0], self.value.imag - errors[1])


@dataclass(frozen=True)
class Threshold:
    """The value of a key at which growth changes its sign, with the bar that three levels of nodes give it."""

    key: str
    value: float  # corrected
    bar: float
    estimate: Estimate | None
    nodes: tuple[int, ...]
    frequency: float
    grows_above: bool
    kind: Kind
    scan: tuple[tuple[float, float], ...]  # values of the key, and the leading growth

    @property
    def word(self) -> str:
        """Flutter where the mode oscillates, else divergence."""
        return "a complex pair: flutter" if self.frequency > 0 else "a real mode: divergence"


@dataclass(frozen=True)
class Found:
    """The modes of a scene: its rest, whether that is stable, the modes worth printing, and how many are left out."""

    title: str
    rest: Rest
    round_off: float  # of the residual of the rest
    nodes: tuple[int, ...]  # of each level, all filaments together
    modes: tuple[Mode, ...]
    zeros: int
    left_out: int  # out of plane, of rods that have no torsion
    step: float
    schemes: tuple[str, ...]
    threshold: Threshold | None
    notes: tuple[str, ...]
    about: Mapping[str, Any]

    @property
    def unstable(self) -> bool:
        """Whether a mode grows."""
        return any(mode.value.real > 0 for mode in self.modes)
