"""Inconsistencies of what is observed of a run: observables, rules that end it, expectations."""

from __future__ import annotations

from collections.abc import Iterator

from ..copies import copy_name, number_of
from ..expressions import suggestion
from ..faults import Fault, shown
from ..filament import single
from ..observe import Observe
from ..schema import Scene

# Three numbers where `along` is absent.
VECTORS = (
    *("position", "velocity", "displacement", "drift", "force", "torque"),
    *("body_position", "body_velocity", "body_spin", "body_axis", "body_drift", "body_force", "body_torque"),
)
OTHERS = {"link": "a [link.NAME]", "body": "a [body.NAME]", "motor": "an end of a filament with a motor"}


def check_observed(case: Scene) -> Iterator[Fault]:
    """All faults of observables, stop rules and expectations."""
    yield from _observe(case)
    yield from _stops(case)
    yield from _expect(case)


def _observe(case: Scene) -> Iterator[Fault]:
    for name, entry in case.observe.items():
        yield from _observed(f"observe.{name}", entry, case)
        if case.output.copies_every > 1:
            yield from _unwritten(f"observe.{name}", entry, case)


def _unwritten(key: str, entry: Observe, case: Scene) -> Iterator[Fault]:
    """Faults of what looks at copies that are not written."""
    every, reads = case.output.copies_every, ("output.copies_every",)
    if entry.pumps and any(filament.copies for filament in case.filaments.values()):
        yield Fault(f"{key}.kind", f"{shown(entry.kind)}, which takes all copies", "output.copies_every = 1", reads)
    one = None if entry.filament in case.filaments else single(case.filaments, entry.filament)
    if one is not None and number_of(entry.filament) % every:
        allowed = f"a copy that is written, one in {every}: {copy_name(entry.filament.rpartition('_')[0], every)}"
        yield Fault(f"{key}.filament", shown(entry.filament), allowed, reads)


def _observed(key: str, entry: Observe, case: Scene) -> Iterator[Fault]:
    filament = single(case.filaments, entry.filament)
    if entry.over_copies and entry.looks_at == "filament":
        named = case.filaments.get(entry.filament)
        if entry.filament and (named is None or named.copies is None):
            found = f"{shown(entry.copies)} with {shown(entry.filament)}"
            yield Fault(f"{key}.copies", found, "the name of a filament with copies", (f"{key}.filament", "filament"))
            return
        filament = named
        if entry.of_each and entry.kind in VECTORS and entry.along is None:
            yield Fault(f"{key}.copies", f'"all" of {entry.kind}, three numbers', f"one number a copy: {key}.along")
    if entry.looks_at != "filament" or any(getattr(entry, other) for other in OTHERS):
        yield from _of_other(key, entry, case)
    elif filament is None and entry.filament in case.filaments:
        if not entry.together:
            found, name = f"{shown(entry.filament)}, which has copies", copy_name(entry.filament, 0)
            allowed = f'a copy by its name, "{name}" being the first; or all of them, with {key}.copies = "mean"'
            yield Fault(f"{key}.filament", found, allowed, ("filament",))
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
    if entry.kind.startswith("diffusion") != (entry.interval > 0.0):
        found = f'{entry.interval:g} with kind = "{entry.kind}"'
        yield Fault(f"{key}.interval", found, "> 0 with diffusion, and only there", (f"{key}.kind",))


def _of_other(key: str, entry: Observe, case: Scene) -> Iterator[Fault]:
    """A link, a body or a motor is named where it is looked at, and only there."""
    for kind, none in OTHERS.items():
        name, known = getattr(entry, kind), case.joined[kind]
        if entry.looks_at != kind:
            if name:
                found = f'{shown(name)} with kind = "{entry.kind}"'
                yield Fault(f"{key}.{kind}", found, f"only with kinds that look at a {kind}", (f"{key}.kind",))
        elif name not in known:
            found = shown(name) + suggestion(name, known) if name else "nothing"
            yield Fault(f"{key}.{kind}", found, ", ".join(known) or f"{none}, of which there is none", (kind,))


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
    elif entry.of_each:
        found = f"{shown(name)}, a number for each copy"
        yield Fault(key, found, f'an observable of one number; observe.{name}.copies = "mean"', reads)


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
        if entry.standard_errors is not None and (entry.range is not None or case.thermal is None):
            found = f"{entry.standard_errors:g}" + (" with range" if case.thermal is not None else " without [thermal]")
            yield Fault(f"{key}.standard_errors", found, "only with value, of a thermal run", (*reads, "thermal"))
        elif entry.range is not None and (entry.tolerance is not None or entry.absolute is not None):
            yield Fault(f"{key}.tolerance", "a tolerance with range", "tolerance or absolute only with value", reads)
        elif entry.tolerance is not None and entry.absolute is not None:
            yield Fault(f"{key}.tolerance", "tolerance and absolute", "one of them", reads)
        elif entry.value == 0.0 and entry.absolute is None and entry.standard_errors is None:
            yield Fault(f"{key}.tolerance", "a relative tolerance of value = 0", "absolute", reads)
