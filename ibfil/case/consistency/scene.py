"""Inconsistencies of a case whose single values are all allowed. Checks yield faults.

A fault names in ``reads`` the other keys it rests on: where one of them is at fault itself, this is not told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from ..expressions import ExpressionError
from ..faults import Fault, shown
from ..fluid import Coefficients, Fluid, Matched
from ..schema import Scene, Time
from .bodies import check_bodies
from .closed import check_closed
from .filament import check_filament
from .links import check_links
from .observed import check_observed
from .sheet import check_sheet
from .size import check_size
from .space import check_space
from .thermal import check_thermal
from .thickness import check_thickness

THINNEST = {"slender": (0.5 * math.exp(-0.5), "L/(2 sqrt(e))"), "cylinder": (0.25, "L/4")}  # of the length: the radius
COARSEST = 0.1  # of a step's own error: beyond it that of the solution would show
LONGEST = 500  # segments of the straight rod that drag is matched to: more would be a long wait


def check(case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together."""
    for name, filament in case.filaments.items():
        yield from check_filament(name, filament, case)
    for part in (
        check_size,
        _one_force,
        check_closed,
        check_bodies,
        check_links,
        _contact,
        _fluid,
        check_space,
        _drag,
        _matched,
        check_thickness,
        check_sheet,
        check_thermal,
        _time,
        _output,
        check_observed,
    ):
        yield from part(case)


def _one_force(case: Scene) -> Iterator[Fault]:
    """All filaments of a scene have the same discrete force."""
    (first, one), *others = case.filaments.items()
    for name, filament in others:
        if filament.force != one.force:
            key = f"filament.{first}.force"
            yield Fault(f"filament.{name}.force", shown(filament.force), f"{shown(one.force)}, as {key}", (key,))


def _contact(case: Scene) -> Iterator[Fault]:
    contact = case.contact
    if contact is None:
        return
    if "strength" in contact.model_fields_set and contact.action != "repel":
        yield Fault("contact.strength", f'a strength with action = "{contact.action}"', 'only with action = "repel"')
    for name, filament in case.filaments.items():
        if contact.distance is None and filament.radius is None:
            key = f"filament.{name}.radius"
            yield Fault("contact.distance", f"nothing, and no {key}", "a distance, or a radius for it", (key,))


def _fluid(case: Scene) -> Iterator[Fault]:
    fluid = case.fluid
    if fluid.model == "navier-stokes":
        if fluid.density is None:
            yield Fault("fluid.density", "nothing", "a number > 0 with navier-stokes", ("fluid.model",))
        jump = _jump(fluid)
        if jump:
            found = f"a flow that changes by {jump:.3g} from a face of the box to the one opposite"
            allowed = "with navier-stokes 0: a uniform or box-periodic flow"
            yield Fault("fluid.flow", found, allowed, ("fluid.box", "fluid.model"))
        if fluid.method == "pruned":
            found = f"{shown(fluid.method)} with navier-stokes, whose past fills the box"
            yield Fault("fluid.method", found, '"auto", "table", "fft" or "krylov"', ("fluid.model",))
    twisted = any(filament.twisting is not None for filament in case.filaments.values())
    if fluid.model != "rft" and "rotation" in fluid.model_fields_set and not twisted:
        yield Fault("fluid.rotation", shown(fluid.rotation), "only where a filament has twisting", ("filament",))
    if fluid.model != "rft" and fluid.rotation == "grid" and fluid.method == "pruned":
        found = f'{shown(fluid.method)} with rotation = "grid", whose torques it does not know'
        yield Fault("fluid.method", found, '"auto", "table", "fft" or "krylov"', ("fluid.rotation", "fluid.model"))


def _jump(fluid: Fluid) -> float:
    """By how much the flow differs on opposite faces of the box, tried at a few points; 0 but for rounding."""
    for component in fluid.flow or ():
        values, jumps = [], []
        for point in ((0.1, 0.2, 0.3), (-0.23, 0.41, -0.07), (0.31, -0.17, 0.44)):
            place = {axis: p * size for axis, p, size in zip("xyz", point, fluid.sides or (), strict=False)}
            for axis, size in zip("xyz", fluid.sides or (), strict=False):
                for t in (0.0, 0.37):
                    try:
                        here = component.at(**place, t=t)
                        there = component.at(**{**place, axis: place[axis] + size}, t=t)
                    except ExpressionError:
                        continue
                    values.append(abs(here))
                    jumps.append(abs(there - here))
        if jumps and max(jumps) > 1e-6 * max(values):
            return max(jumps)
    return 0.0


def _drag(case: Scene) -> Iterator[Fault]:
    """The drag needs a radius where it is made of it, and a thin rod one that is thin."""
    fluid = case.fluid
    spin = isinstance(fluid.drag, Coefficients) and fluid.drag.spin is not None
    for name, filament in case.filaments.items():
        key = f"filament.{name}.radius"
        reads = (f"filament.{name}.twisting", f"filament.{name}.length", "fluid.drag", "fluid.model")
        drag = fluid.drag_of(filament.radius) if fluid.model == "rft" else ""
        of_radius = drag if isinstance(drag, str) and drag in THINNEST else ""
        if filament.radius is None:
            if of_radius:
                yield Fault(key, "nothing", f'a radius: drag = "{drag}" is made of it', reads)
            elif filament.twisting is not None and not spin:
                yield Fault(key, "nothing", "with twisting, a radius (or fluid.drag with spin)", reads)
        elif of_radius and filament.radius.constant is not None:
            share, words = THINNEST[of_radius]
            most = share * filament.length
            if filament.radius.constant >= most:
                chosen = f'{drag}" (the default)' if fluid.drag == "auto" else f'{drag}"'
                allowed = f'below {words} = {most:.6g} with drag = "{chosen}, or drag = {{ perp, par }}'
                yield Fault(key, f"{filament.radius.constant:.6g}", allowed, reads)


def _matched(case: Scene) -> Iterator[Fault]:
    """The straight rod whose drag is measured is between one segment and the box long."""
    fluid = case.fluid
    if fluid.model != "rft" or not isinstance(fluid.drag, Matched):
        return
    key, length, found = "fluid.drag.matched", fluid.drag.matched, f"{fluid.drag.matched:g}"
    if fluid.sides is not None and length >= min(fluid.sides):
        allowed = f"below the smallest side of fluid.box, {min(fluid.sides):g}"
        yield Fault(key, found, allowed, ("fluid.box", "fluid.model"))
    for name, filament in case.filaments.items():
        ds = filament.length / (filament.nodes - 1)
        reads = (f"filament.{name}.length", f"filament.{name}.nodes", "fluid.model")
        if not ds <= length <= LONGEST * ds:
            yield Fault(key, found, f"{ds:g} to {LONGEST * ds:g}: 1 to {LONGEST} segments of {name}", reads)


def _time(case: Scene) -> Iterator[Fault]:
    time = case.time
    if time.order == 2 and time.scheme != "implicit":
        yield Fault(
            "time.order",
            f'2 with scheme = "{time.scheme}"',
            '1, or scheme = "implicit"',
            ("time.scheme", "thermal"),
        )
    if time.solver_error is not None:
        yield from _solver_error(time)
    if time.step != "auto" and time.step < time.shortest:
        default = ", by default 1e-12 of time.end" if time.min_step is None else ""
        allowed = f"at least min_step = {time.shortest:g}{default}"
        yield Fault("time.step", f"{time.step:g}", allowed, ("time.min_step", "time.end"))


def _solver_error(time: Time) -> Iterator[Fault]:
    """It is measured by what extrapolation was off by, as implicit steps of second order have it."""
    key, reads = "time.solver_error", ("time.scheme", "time.order", "thermal")
    if time.scheme != "implicit" or time.order != 2:
        yield Fault(key, f'it with scheme = "{time.scheme}", order = {time.order}', "implicit steps of order 2", reads)
    elif time.solver_error is not None and time.solver_error > COARSEST:
        yield Fault(key, f"{time.solver_error:g}", f"at most {COARSEST:g}")


def _output(case: Scene) -> Iterator[Fault]:
    output = case.output
    if (output.every is None) == (output.times is None):
        found = "nothing" if output.every is None else "every and times"
        yield Fault("output.every", found, "a number > 0, or a list of times instead", ("output.times",))
    times = output.times or ()
    if output.times is not None and (not times or any(a >= b for a, b in pairwise(times))):
        yield Fault("output.times", shown(times), "at least one time, each above the one before")
    elif times and times[-1] > case.time.end:
        yield Fault("output.times", f"{times[-1]:g}", f"at most time.end = {case.time.end:g}", ("time.end",))
    if case.fluid.model != "rft" and output.grid_every is None:
        for key in ("fields", "grid_stride", "window", "window_at"):
            if key in output.model_fields_set:
                yield Fault(
                    f"output.{key}",
                    f"{key} and no grid_every",
                    "only with grid_every",
                    ("output.grid_every",),
                )
