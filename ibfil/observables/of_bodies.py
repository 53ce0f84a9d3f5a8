"""The kinds of observables that look at a body, or at a motor, read off each output."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..io.snapshots import BodySnapshot, MotorSnapshot, Snapshot
from . import time_series
from .base import ObservableBase, Value, plain

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


class OfBody(ObservableBase):
    """A vector of a body, or its component along `along`."""

    keys: ClassVar[tuple[str, ...]] = ("body", "along", "over", "summary")

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.body = observe.body

    @property
    def vector(self) -> bool:
        """Without `along`."""
        return self.axis is None

    def of(self, body: BodySnapshot) -> np.ndarray:
        """The vector (3,)."""
        raise NotImplementedError

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        value = self.of(snapshot.bodies[self.body])
        return np.asarray(value) if self.axis is None else float(value @ self.axis)


class BodyPosition(OfBody, kind="body_position"):
    """Position of a body's centre, or its component."""

    dimension = "length"
    description = "position"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """Of the centre."""
        return body.position


class BodyVelocity(OfBody, kind="body_velocity"):
    """Velocity of a body's centre, or its component, over the step that led to the output."""

    dimension = "length/time"
    description = "velocity"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """Of the centre."""
        return body.velocity


class BodySpin(OfBody, kind="body_spin"):
    """Rate at which a body turns, or its component: with a motor, the counter-rotation."""

    dimension = "1/time"
    description = "rate of turning"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """In the lab."""
        return body.spin


class BodyForce(OfBody, kind="body_force"):
    """Force of the body itself on the fluid, or its component."""

    dimension = "force"
    description = "force on the fluid"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """Of the body without its rods."""
        return body.force


class BodyTorque(OfBody, kind="body_torque"):
    """Torque of the body itself on the fluid, about its centre, or its component."""

    dimension = "force length"
    description = "torque on the fluid"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """About the centre."""
        return body.torque


class BodyAxis(OfBody, kind="body_axis"):
    """First axis of a body in the lab, or its component: where the body points."""

    description = "first axis"

    def of(self, body: BodySnapshot) -> np.ndarray:
        """Of length one."""
        return body.e1


class BodyDrift(BodyPosition, kind="body_drift"):
    """Displacement of a body's centre over `over`, per time, or its component. The series is the position."""

    keys: ClassVar[tuple[str, ...]] = ("body", "along", "over")
    fitted = True
    dimension = "length"
    summary_dimension = "length/time"
    number = "drift (displacement over time)"

    def summary(self, times: np.ndarray, samples: np.ndarray) -> Value:
        """Return the mean velocity over `over`."""
        start, end = self.window(times)
        return plain(time_series.drift(times, samples, start, end))


class OfMotor(ObservableBase):
    """A number of a motor."""

    keys: ClassVar[tuple[str, ...]] = ("motor", "over", "summary")

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.motor = observe.motor

    def of(self, motor: MotorSnapshot) -> float:
        """The number."""
        raise NotImplementedError

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return float(self.of(snapshot.motors[self.motor]))


class MotorAngle(OfMotor, kind="motor_angle"):
    """Angle by which a motor has turned its rod against the body since the start, rad."""

    description = "angle"

    def of(self, motor: MotorSnapshot) -> float:
        """Since t = 0."""
        return motor.angle


class MotorRate(OfMotor, kind="motor_rate"):
    """Rate at which a motor turns its rod against the body, rad/time."""

    dimension = "1/time"
    description = "rate"

    def of(self, motor: MotorSnapshot) -> float:
        """Over the step to the output."""
        return motor.rate


class MotorTorque(OfMotor, kind="motor_torque"):
    """Torque of a motor on its rod, about its axis; the body feels the opposite."""

    dimension = "force length"
    description = "torque"

    def of(self, motor: MotorSnapshot) -> float:
        """About the axis."""
        return motor.torque


class MotorPower(OfMotor, kind="motor_power"):
    """Power of a motor, its torque times its rate."""

    dimension = "force length/time"
    description = "power"

    def of(self, motor: MotorSnapshot) -> float:
        """Torque times rate."""
        return motor.power
