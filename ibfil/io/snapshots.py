"""The content of one output. simulation/diagnostics.py makes it; run files, observables and pictures read them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class FilamentSnapshot:
    """One filament of N nodes at one time, in the case's units; lab frame unless said otherwise."""

    position: np.ndarray  # (N, 3), unwrapped
    velocity: np.ndarray  # (N, 3)
    force: np.ndarray  # (N, 3) on the fluid, per node, reactions included
    e1: np.ndarray  # (N, 3) first material director
    moment: np.ndarray  # (N, 3) components along e1, e2, e3
    strain: np.ndarray  # (N, 3) Omega_1, Omega_2, Omega_3
    tension: np.ndarray  # (N - 1,) EA (|d|/ds - 1), positive when stretched
    reaction_start: np.ndarray | None  # (3,) force of the support on the node at s = 0, where it is held
    reaction_finish: np.ndarray | None  # (3,) the same at s = L
    torque: np.ndarray | None = None  # (N, 3) twist torque on the fluid, per node; None where it does not twist
    spin: np.ndarray | None = None  # (N, 3) rate at which e1 turns about the tangent, along it; likewise

    @property
    def power(self) -> np.ndarray:
        """Power (N,) of each node on the fluid: of its force, and of its twist torque."""
        power: np.ndarray = (self.force * self.velocity).sum(axis=1)
        return power if self.torque is None or self.spin is None else power + (self.torque * self.spin).sum(axis=1)


@dataclass(frozen=True)
class LinkSnapshot:
    """One link of K elements at one time: a spring and a hinge have one, two bound filaments one a segment."""

    first: np.ndarray  # (K, 3) the points that it joins
    second: np.ndarray  # (K, 3)
    force: np.ndarray  # (K, 3) on the second; on the first the opposite
    length: np.ndarray | None = None  # (K,) of a spring
    tension: np.ndarray | None = None  # (K,) positive where it draws them together; of a bound pair per length
    angle: np.ndarray | None = None  # (K,) of a hinge
    moment: np.ndarray | None = None  # (K,) of a hinge
    slide: np.ndarray | None = None  # (K,) of a bound pair, the second along the first
    shear: np.ndarray | None = None  # (K,) of a bound pair, force per length along it on the second
    active: np.ndarray | None = None  # (K,) what of that is active


@dataclass(frozen=True)
class BodySnapshot:
    """One body at one time, in the case's units and the lab frame."""

    position: np.ndarray  # (3,) of its centre, unwrapped
    e1: np.ndarray  # (3,) its axes
    e2: np.ndarray  # (3,)
    e3: np.ndarray  # (3,)
    velocity: np.ndarray  # (3,) of its centre
    spin: np.ndarray  # (3,) rate at which it turns
    force: np.ndarray  # (3,) of the body itself on the fluid
    torque: np.ndarray  # (3,) the same about its centre
    reaction: np.ndarray | None = None  # (3,) force that holds or moves it; None where it is free
    reaction_torque: np.ndarray | None = None  # (3,) the same, about its centre
    markers: np.ndarray | None = None  # (k, 3) of a body whose markers are of a file

    @property
    def power(self) -> float:
        """Power of the body itself on the fluid."""
        return float(self.force @ self.velocity + self.torque @ self.spin)


@dataclass(frozen=True)
class MotorSnapshot:
    """One motor at one time."""

    angle: float  # turned since the start, the rod against the body
    rate: float
    torque: float  # of the body on the rod, about the axis
    power: float  # torque times rate


@dataclass(frozen=True)
class Snapshot:
    """All filaments at one time, with the diagnostics taken at outputs and the fields where they were asked for.

    Bodies go by their names; motors by the filament that they turn, NAME_start or NAME_finish.
    """

    time: float
    filaments: dict[str, FilamentSnapshot]
    diagnostics: dict[str, float | np.ndarray]
    grid: dict[str, np.ndarray] | None = None
    links: dict[str, LinkSnapshot] = field(default_factory=dict)
    bodies: dict[str, BodySnapshot] = field(default_factory=dict)
    motors: dict[str, MotorSnapshot] = field(default_factory=dict)
