"""Lines of `ibfil check` on bodies and motors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..case.bodies.shapes import Joint
from ..case.consistency.bodies import ends_in

if TYPE_CHECKING:
    from ..case.bodies.body import Body
    from ..case.bodies.end import End
    from ..case.bodies.motor import Motor
    from ..case.schema import Case

UNWATCHED = ["how fast disturbances of the rods grow is not looked at with bodies: try a shorter time.step"]
ABSENT_OF_BODIES = ["contact of bodies, with each other and with rods", "mass of bodies"]


def of_given_motion(case: Case) -> list[str]:
    """Warnings about motions that are not zero as the run begins, and so do not move at once."""
    out = []
    for name, body in case.bodies.items():
        motion = body.given_motion
        for key, given in () if motion is None else (("moves", motion.moves), ("turns", motion.turns)):
            begins = [float(part.bind("t")(0.0)) for part in given]
            if any(begins):
                out.append(
                    f"body.{name}.motion.{key}: {begins} at t = 0, when the body stands as position and axes put it: "
                    "only the change from there moves it; begin at 0"
                )
    return out


def in_body(side: str, end: End) -> str:
    """How an end is in a body, and what turns it there."""
    words = f"{side} {'hinged to' if end.hinged else 'clamped into'} body {end.body}"
    return words if end.motor is None else f"{words}, a motor of {_of_motor(end.motor)} between them"


def _of_motor(motor: Motor) -> str:
    for key, words in (("spin", "given rate"), ("angle", "given angle"), ("torque", "given torque")):
        if getattr(motor, key) is not None:
            return words
    return f"torque {motor.stall:g} at rest, none at the rate {motor.free:g}"


def of_body(case: Case, name: str) -> str:
    """Its shape, how it moves, and what pushes it."""
    body, copies = case.bodies[name], sum(own is case.bodies[name] for own in case.each_body.values())
    terms, given = [_shape(body)], body.given_motion
    hinges = isinstance(body.shape, Joint) and all(end.hinged for _, _, end in ends_in(case, name))
    if given is None:
        terms.append("free to move, while its rods turn about it" if hinges else "free to move and turn")
    else:
        still = all(part.constant == 0.0 for part in (*given.moves, *given.turns))
        terms.append("held" if still else "moved as given")
    axes = "its own axes" if body.own_axes else "the lab"
    pushed = [f"external {key} in {axes}" for key in ("force", "torque") if getattr(body, key) is not None]
    if given is None and not pushed:
        pushed = ["nothing pushes it from outside"]
    outside = "pushes them from outside" if given is None else "pushes them from outside and what holds or moves it"
    total = f"the force and torque of body and rods on the fluid sum to what {outside}, to round-off"
    return f"body {name}{f', {copies} copies' if copies > 1 else ''}: " + ", ".join([*terms, *pushed]) + f"; {total}"


def _shape(body: Body) -> str:
    """Its size."""
    if isinstance(body.shape, Joint):
        return "a joint without size or drag"
    if body.shape.file is not None:
        return f"the markers of {body.shape.file}"
    first, *others = body.shape.semi_axes
    if others == [first, first]:
        return f"a sphere of radius {first:g}"
    return "an ellipsoid of semi-axes " + ", ".join(f"{a:g}" for a in body.shape.semi_axes)
