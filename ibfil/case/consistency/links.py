"""Inconsistencies of links: what they hold on to, and what they cannot be combined with."""

from __future__ import annotations

from collections.abc import Iterator

from ..copies import copy_name
from ..expressions import suggestion
from ..faults import Fault, shown
from ..filament import Filament, single
from ..link import AnyLink, Bind, Hinge, Site, Spring
from ..schema import Scene


def check_links(case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together in [link.NAME]."""
    for name, link in case.links.items():
        key = f"link.{name}"
        if isinstance(link, Bind):
            yield from _bind(key, link, case)
        elif isinstance(link, (Spring, Hinge)):
            for k, site in enumerate(link.between):
                yield from _site(f"{key}.between.{k}", site, isinstance(link, Spring), case)
            yield from _apart(f"{key}.between", link)
        yield from _copies(key, link, case)
        yield from _rates(key, link, case)


def _found(name: str, case: Scene) -> Filament | None:
    """The filament of that name: one, one copy, or all copies."""
    return single(case.filaments, name) or case.filaments.get(name)


def _unknown(key: str, name: str, case: Scene) -> Iterator[Fault]:
    if _found(name, case) is None:
        found = shown(name) + suggestion(name, case.filaments)
        yield Fault(key, found, f"one of {', '.join(case.filaments)}", ("filament",))


def _site(key: str, site: Site, spring: bool, case: Scene) -> Iterator[Fault]:
    if (site.filament is None) == (site.point is None):
        found = "nothing" if site.filament is None else "a filament and a point"
        yield Fault(key, found, "{ filament, at }, or { point }", (f"{key}.filament", f"{key}.point"))
    if site.point is not None:
        if not spring:
            yield Fault(f"{key}.point", shown(site.point), 'a place in the lab with kind = "spring" only')
        if "at" in site.model_fields_set:
            yield Fault(f"{key}.at", f"{shown(site.at)} with a point", "with filament only", (f"{key}.point",))
    if site.filament is None:
        return
    yield from _unknown(f"{key}.filament", site.filament, case)
    filament = _found(site.filament, case)
    if filament is not None and isinstance(site.at, float) and site.at > filament.length * (1.0 + 1e-12):
        reads = (f"{key}.filament", f"filament.{site.filament}.length")
        yield Fault(f"{key}.at", f"{site.at:g}", f"0 to length = {filament.length:g}", reads)


def _apart(key: str, link: Spring | Hinge) -> Iterator[Fault]:
    """A link joins two places, at least one of them on a filament."""
    one, other = link.between
    if one.point is not None and other.point is not None:
        yield Fault(key, "two points", "at least one { filament, at }", (key,))
    elif one.filament is not None and (one.filament, one.at) == (other.filament, other.at):
        yield Fault(key, f"{shown(one.filament)} at {shown(one.at)} twice", "two different places", (key,))


def _bind(key: str, link: Bind, case: Scene) -> Iterator[Fault]:
    for k, name in enumerate(link.filaments):
        yield from _unknown(f"{key}.filaments.{k}", name, case)
    if link.filaments[0] == link.filaments[1]:
        yield Fault(f"{key}.filaments", shown(link.filaments), "two different filaments")
    motor = link.motor
    if motor is not None and motor.friction > 0.0 and motor.lag == 0.0:
        found = f"0 with friction = {motor.friction:g}, which grows without bound at once"
        yield Fault(f"{key}.motor.lag", found, "> 0 where friction is", (f"{key}.motor.friction",))
    one, other = (_found(name, case) for name in link.filaments)
    if one is None or other is None:
        return
    first, last = link.range or (0.0, one.length)
    reads = (f"{key}.filaments", *(f"filament.{name}.length" for name in link.filaments))
    if not 0.0 <= first < last <= one.length * (1.0 + 1e-12):
        allowed = f"[s1, s2] with 0 <= s1 < s2 <= length = {one.length:g}"
        yield Fault(f"{key}.range", shown(link.range), allowed, reads)
    elif min(last, other.length - link.offset) <= max(first, -link.offset):
        found = f"{link.offset:g}, at which {link.filaments[1]} lies beside none of [{first:g}, {last:g}]"
        allowed = f"between {-last:g} and {other.length - first:g}"
        yield Fault(f"{key}.offset", found, allowed, (*reads, f"{key}.range"))


def _copies(key: str, link: AnyLink, case: Scene) -> Iterator[Fault]:
    """Filaments that are linked copy by copy are copied alike."""
    many = [name for name in link.names if name in case.filaments and case.filaments[name].copies is not None]
    if not many:
        return
    for name in link.names:
        filament = case.filaments.get(name)
        if filament is None or filament.copies != case.filaments[many[0]].copies:
            found = f"{many[0]}, which has copies, and {name}, which has not the same"
            allowed = (
                f'filaments with the same copies, or a copy by its name, "{copy_name(many[0], 0)}" being the first'
            )
            yield Fault(key, found, allowed, ("filament", key))
            return


def _rates(key: str, link: AnyLink, case: Scene) -> Iterator[Fault]:
    """Schemes and noise that a link which answers to rates does not go with."""
    if not link.resists_rates:
        return
    name = "motor" if isinstance(link, Bind) else "damping"
    if case.time.scheme == "explicit":
        found = f'{name} with time.scheme = "explicit", which knows no rate within a step'
        yield Fault(f"{key}.{name}", found, '"implicit" or "semi-implicit"', ("time.scheme",))
    if case.thermal is not None:
        found = f"{name} with [thermal], whose noise it would need as well"
        yield Fault(f"{key}.{name}", found, "no damping and no motors with [thermal]", ("thermal",))
