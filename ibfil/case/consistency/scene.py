"""Inconsistencies of a case whose single values are all allowed. Checks yield faults.

A fault names in ``reads`` the other keys it rests on: where one of them is at fault itself, this is not told.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from ..expressions import ExpressionError, suggestion
from ..faults import Fault, shown
from ..filament import copy_name, single
from ..fluid import Coefficients, Fluid, Matched
from ..schema import Observe, Scene
from .closed import check_closed
from .filament import check_filament
from .links import check_links
from .sheet import check_sheet
from .size import check_size
from .space import check_space
from .thickness import check_thickness

LONGEST = 500  # segments of the straight rod that drag is matched to: more would be a long wait
# Three numbers where `along` is absent.
VECTORS = ("position", "velocity", "displacement", "drift", "force", "torque")


def check(case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together."""
    for name, filament in case.filaments.items():
        yield from check_filament(name, filament, case)
    for part in (
        check_size,
        _one_force,
        check_closed,
        check_links,
        _contact,
        _fluid,
        check_space,
        _drag,
        _matched,
        check_thickness,
        check_sheet,
        _thermal,
        _time,
        _output,
        _observe,
        _stops,
        _expect,
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
    """The drag needs a radius where it is made of it, and a slender rod one that is slender."""
    fluid = case.fluid
    spin = isinstance(fluid.drag, Coefficients) and fluid.drag.spin is not None
    for name, filament in case.filaments.items():
        key = f"filament.{name}.radius"
        reads = (f"filament.{name}.twisting", f"filament.{name}.length", "fluid.drag", "fluid.model")
        slender = fluid.model == "rft" and fluid.drag == "slender"
        if filament.radius is None:
            if slender:
                yield Fault(key, "nothing", 'a radius: drag = "slender" is made of it', reads)
            elif filament.twisting is not None and not spin:
                yield Fault(key, "nothing", "with twisting, a radius (or fluid.drag with spin)", reads)
        elif slender and filament.radius.constant is not None:
            most = 0.5 * filament.length * math.exp(-0.5)
            if filament.radius.constant >= most:
                allowed = f'below L/(2 sqrt(e)) = {most:.6g} with drag = "slender"'
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


def _thermal(case: Scene) -> Iterator[Fault]:
    if case.thermal is None:
        return
    if case.fluid.model != "rft":
        found = (
            f"thermal forces and fluid.model = {shown(case.fluid.model)}, in which kicks of different nodes are related"
        )
        yield Fault("thermal", found, 'only fluid.model = "rft"', ("fluid.model",))
    if case.thermal.twist and all(filament.twisting is None for filament in case.filaments.values()):
        yield Fault("thermal.twist", "true", "false where no filament has twisting", ("filament",))
    if case.time.scheme != "semi-implicit":
        yield Fault(
            "time.scheme",
            shown(case.time.scheme),
            '"semi-implicit", the only one with [thermal]',
            ("thermal",),
        )
    if case.time.tolerance is not None:
        found = "a tolerance with [thermal], whose kicks no shorter step follows more closely"
        yield Fault("time.tolerance", found, "time.step", ("thermal",))


def _time(case: Scene) -> Iterator[Fault]:
    time = case.time
    if time.order == 2 and time.scheme != "implicit":
        yield Fault(
            "time.order",
            f'2 with scheme = "{time.scheme}"',
            '1, or scheme = "implicit"',
            ("time.scheme", "thermal"),
        )
    if time.step != "auto" and time.step < time.shortest:
        default = ", by default 1e-12 of time.end" if time.min_step is None else ""
        allowed = f"at least min_step = {time.shortest:g}{default}"
        yield Fault("time.step", f"{time.step:g}", allowed, ("time.min_step", "time.end"))


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


def _observe(case: Scene) -> Iterator[Fault]:
    for name, entry in case.observe.items():
        yield from _observed(f"observe.{name}", entry, case)


def _observed(key: str, entry: Observe, case: Scene) -> Iterator[Fault]:
    filament = single(case.filaments, entry.filament)
    if entry.of_link or entry.link:
        yield from _of_link(key, entry, case)
    elif filament is None and entry.filament in case.filaments:
        if not entry.together:
            found, name = f"{shown(entry.filament)}, which has copies", copy_name(entry.filament, 0)
            yield Fault(f"{key}.filament", found, f'a copy by its name, "{name}" being the first', ("filament",))
    elif filament is None and not (entry.together and not entry.filament):
        found = shown(entry.filament) + suggestion(entry.filament, case.filaments) if entry.filament else "nothing"
        yield Fault(f"{key}.filament", found, f"one of {', '.join(case.filaments)}", ("filament",))
    elif filament is not None and not isinstance(entry.at, str):
        last = entry.at[1] if isinstance(entry.at, tuple) else entry.at
        if last > filament.length * (1.0 + 1e-12):
            reads = (f"{key}.filament", f"filament.{entry.filament}.length")
            yield Fault(f"{key}.at", f"{last:g}", f"at most length = {filament.length:g}", reads)
    if entry.over is not None and not 0.0 <= entry.over[0] < entry.over[1]:
        yield Fault(f"{key}.over", shown(entry.over), "[t1, t2] with 0 <= t1 < t2")
    if entry.along is not None and not any(entry.along):
        yield Fault(f"{key}.along", shown(entry.along), "a vector that is not zero")
    if (entry.kind == "diffusion_ratio") != (entry.interval > 0.0):
        found = f'{entry.interval:g} with kind = "{entry.kind}"'
        yield Fault(f"{key}.interval", found, "> 0 with diffusion_ratio, and only there", (f"{key}.kind",))


def _of_link(key: str, entry: Observe, case: Scene) -> Iterator[Fault]:
    """A link is named where it is looked at, and only there."""
    if not entry.of_link:
        found = f'{shown(entry.link)} with kind = "{entry.kind}"'
        yield Fault(f"{key}.link", found, "only with kinds that look at a link", (f"{key}.kind",))
    elif entry.link not in case.links:
        found = shown(entry.link) + suggestion(entry.link, case.links) if entry.link else "nothing"
        known = ", ".join(case.links) or "a [link.NAME], of which there is none"
        yield Fault(f"{key}.link", found, known, ("link",))


def _scalar(key: str, name: str, case: Scene) -> Iterator[Fault]:
    """The faults of ``key`` = ``name`` where a number is wanted of the observable ``name``."""
    entry = case.observe.get(name)
    reads = (f"observe.{name}",)
    if entry is None:
        known = ", ".join(case.observe) or "an [observe.NAME], of which there is none"
        yield Fault(key, shown(name) + suggestion(name, case.observe), known, ("observe",))
    elif entry.kind in VECTORS and entry.along is None:
        found = f"{shown(name)}, three numbers ({entry.kind})"
        yield Fault(key, found, f"an observable of one number; give observe.{name}.along", reads)


def _stops(case: Scene) -> Iterator[Fault]:
    for i, stop in enumerate(case.stops):
        yield from _scalar(f"stop.{i}.observe", stop.observe, case)
        given = [key for key in ("below", "above", "steady") if getattr(stop, key) is not None]
        if len(given) != 1:
            keys = tuple(f"stop.{i}.{key}" for key in ("below", "above", "steady"))
            yield Fault(f"stop.{i}", " and ".join(given) or "no condition", "one of below, above, steady", keys)


def _expect(case: Scene) -> Iterator[Fault]:
    for name, entry in case.expect.items():
        key = f"expect.{name}"
        yield from _scalar(f"{key}.observe", entry.observe, case)
        if (entry.value is None) == (entry.range is None):
            found = "nothing" if entry.value is None else "value and range"
            yield Fault(f"{key}.value", found, "a value, or a range instead", (f"{key}.range",))
        elif entry.range is not None and not entry.range[0] < entry.range[1]:
            yield Fault(f"{key}.range", shown(entry.range), "[lo, hi] with lo < hi")
        reads = (f"{key}.value", f"{key}.range", f"{key}.absolute")
        if entry.range is not None and (entry.tolerance is not None or entry.absolute is not None):
            yield Fault(f"{key}.tolerance", "a tolerance with range", "tolerance or absolute only with value", reads)
        elif entry.tolerance is not None and entry.absolute is not None:
            yield Fault(f"{key}.tolerance", "tolerance and absolute", "one of them", reads)
        elif entry.value == 0.0 and entry.absolute is None:
            yield Fault(f"{key}.tolerance", "a relative tolerance of value = 0", "absolute", reads)
