"""Inconsistencies of bodies and of what is in them: ends of filaments, and motors."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from ..bodies.body import Body
from ..bodies.end import End
from ..bodies.motor import Motor
from ..bodies.shapes import Joint
from ..expressions import suggestion
from ..faults import Fault, shown
from ..filament import Filament
from ..schema import Scene
from ..shape import RunShape
from .vectors import parallel

SIDES = ("start", "finish")


def check_bodies(case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together in [body.NAME] and at the ends in bodies."""
    for name, filament in case.filaments.items():
        for side in SIDES:
            yield from _end(f"filament.{name}.{side}", getattr(filament, side), filament, case)
        if any(getattr(filament, side).attached for side in SIDES):
            yield from _filament(f"filament.{name}", filament)
    for name, body in case.bodies.items():
        yield from _body(f"body.{name}", body, [end for _, _, end in ends_in(case, name)])
    if case.bodies:
        yield from _copied(case)
        yield from _scene(case)


def ends_in(case: Scene, body: str) -> list[tuple[str, Filament, End]]:
    """The ends in a body, with the key and the filament of each."""
    return [
        (f"filament.{name}.{side}", filament, end)
        for name, filament in case.filaments.items()
        for side in SIDES
        for end in (getattr(filament, side),)
        if end.attached and end.body == body
    ]


# --- an end ----------------------------------------------------------------------------------------------------------


def _end(key: str, end: End, filament: Filament, case: Scene) -> Iterator[Fault]:
    reads = (f"{key}.end",)
    if not end.attached:
        for name in ("body", "hinged", "motor"):
            if name in end.model_fields_set:
                yield Fault(f"{key}.{name}", f'{name} with end = "{end.end}"', 'only with end = "body"', reads)
        return
    if end.body not in case.bodies:
        found = shown(end.body) + suggestion(end.body, case.bodies) if end.body else "nothing"
        known = ", ".join(case.bodies) or "the name of a [body.NAME], of which there is none"
        yield Fault(f"{key}.body", found, f"one of {known}" if case.bodies else known, (*reads, "body"))
    if end.moves is not None:
        yield Fault(f"{key}.moves", 'moves with end = "body"', "body.NAME.motion, which moves the body", reads)
    if end.moment is not None:
        yield Fault(f"{key}.moment", 'moment with end = "body"', "body.NAME.torque, or a motor", reads)
    if end.motor is not None:
        yield from _motor(f"{key}.motor", end.motor, end, filament)


def _motor(key: str, motor: Motor, end: End, filament: Filament) -> Iterator[Fault]:
    if filament.twisting is None:
        yield Fault(key, "a motor and no twisting", "only with twisting, the twist modulus C", (key,))
    if end.hinged:
        yield Fault(key, "a motor at a hinged end, which it could not turn", "hinged = false")
    given = [name for name in ("spin", "angle", "torque", "stall") if getattr(motor, name) is not None]
    if len(given) != 1:
        yield Fault(key, " and ".join(given) or "nothing", "one of spin, angle, torque, or stall with free")
    if (motor.stall is None) != (motor.free is None):
        present, absent = ("free", "stall") if motor.stall is None else ("stall", "free")
        yield Fault(f"{key}.{absent}", "nothing", f"a number > 0 with {present}")
    if motor.through is not None and isinstance(motor.axis, str):
        found = f'{shown(motor.through)} with axis = "{motor.axis}"'
        yield Fault(f"{key}.through", found, "only with axis = [x, y, z]")
    if not isinstance(motor.axis, str) and not any(motor.axis):
        yield Fault(f"{key}.axis", shown(motor.axis), "a vector that is not zero")


def _filament(key: str, filament: Filament) -> Iterator[Fault]:
    """A filament in a body: begun by the case itself."""
    first, last, reads = filament.start, filament.finish, (f"{key}.start", f"{key}.finish")
    if first.attached and last.attached and first.body == last.body and (first.motor or last.motor):
        found = f"{shown(last.body)}, as the start has, and a motor, which would turn it against itself"
        yield Fault(f"{key}.finish.body", found, "another body, or no motor", reads)
    if filament.copies is not None and filament.copies.file is not None:
        yield Fault(f"{key}.copies.file", "a file for copies of a filament in a body", "count with region or at", reads)
    if isinstance(filament.shape, RunShape):
        found = '"run" for a filament in a body, whose pose it does not tell'
        yield Fault(f"{key}.shape.kind", found, "another kind of shape; a run goes on with ibfil run --resume", reads)


# --- a body ----------------------------------------------------------------------------------------------------------


def _body(key: str, body: Body, ends: list[End]) -> Iterator[Fault]:
    if any(not any(axis) for axis in body.axes) or parallel(*body.axes):
        yield Fault(f"{key}.axes", shown(body.axes), "two directions at an angle to each other")
    if body.own_axes and body.force is None and body.torque is None:
        yield Fault(f"{key}.frame", '"body" and neither force nor torque', "only with one of them")
    if body.shape.file is not None and body.meets_rotation:
        yield Fault(f"{key}.fit", "a fit of markers of a file, which are as they are", "no fit", (f"{key}.shape",))
    if not isinstance(body.shape, Joint):
        return
    if body.resistance is not None:
        yield Fault(f"{key}.resistance", "a resistance of a joint", "another shape, or none", (f"{key}.shape",))
    if len(ends) < 2:
        found = f"a joint with {len(ends) or 'no'} end{'s' if not ends else ''} of filaments in it"
        yield Fault(f"{key}.shape", found, "at least two ends", ("filament",))
    elif body.torque is not None and all(end.hinged for end in ends):
        yield Fault(f"{key}.torque", "a torque on a joint of hinged ends", "an end in it that is not hinged", (key,))


def _copied(case: Scene) -> Iterator[Fault]:
    """Filaments that bodies join, some of which have copies: all go to the same places."""
    for body in case.bodies:
        ends = ends_in(case, body)
        for (first, one, _), (key, other, _) in pairwise(ends):
            where, reads = f"{key.rsplit('.', 1)[0]}.copies", (first.rsplit(".", 1)[0], f"{key}.body")
            if one.copies != other.copies:
                yield Fault(where, f"other copies than at {first}, in the same body {body}", "the same copies", reads)
            elif other is not one and other.copies is not None and other.copies.apart is not None:
                found = f"apart with several filaments in body {body}"
                yield Fault(f"{where}.apart", found, "one filament in it, or no apart", reads)


# --- the scene -------------------------------------------------------------------------------------------------------


def _scene(case: Scene) -> Iterator[Fault]:
    """Fluids, schemes and rods that bodies are not modelled with."""
    key = f"body.{next(iter(case.bodies))}"
    yield from _fluid(case, key)
    for name, body in case.bodies.items():
        if body.shape.file is not None and body.resistance is None and not case.fluid.on_grid:
            own, found = f"body.{name}.resistance", f"nothing, of markers of a file in {case.fluid.model}"
            yield Fault(
                own, found, "translation and rotation, or a fluid on a grid", ("fluid.model", f"body.{name}.shape")
            )
    if case.thermal is not None:
        yield Fault(key, "a body with [thermal]", "no bodies with [thermal]", ("thermal",))
    if case.time.scheme != "implicit":
        found = f'a body with time.scheme = "{case.time.scheme}"'
        yield Fault(key, found, 'bodies with scheme = "implicit"', ("time.scheme",))
    if case.fluid.thick:
        yield Fault("fluid.thick", "true in a scene with bodies", "false", (key,))
    for name, filament in case.filaments.items():
        own = f"filament.{name}"
        if filament.force == "torque-free":
            yield Fault(f"{own}.force", '"torque-free" in a scene with bodies', '"eq44"')
        if filament.mass is not None:
            yield Fault(f"{own}.mass", "a mass in a scene with bodies, which have none", "no mass", ("body",))
        if filament.closed:
            yield Fault(f"{own}.closed", "true in a scene with bodies", "false", ("body",))


def _fluid(case: Scene, key: str) -> Iterator[Fault]:
    """Fluids, and ways to solve them, that bodies are not modelled with."""
    fluid = case.fluid
    if not fluid.on_grid:
        return
    if fluid.single:
        yield Fault("fluid.precision", f"{shown(fluid.precision)} in a scene with bodies", '"double"', (key,))
    if fluid.thin_axis is not None:
        yield Fault(
            "fluid.cells", f"{shown(fluid.cells)}, a plane flow, with bodies", "a box in three dimensions", (key,)
        )
