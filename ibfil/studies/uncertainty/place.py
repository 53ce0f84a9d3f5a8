"""A scene moved as a whole: its filaments, and everything in it that is tied to places."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...case.link import Spring
from ...case.table import ORIGIN
from ...errors import CaseError

if TYPE_CHECKING:
    from ...case.expressions import Expression
    from ...case.link import Site
    from ...case.schema import Case
    from ...simulation.simulation import Simulation


def moved(simulation: Simulation, shift: np.ndarray) -> tuple[str, ...]:
    """The overrides that move the scene of a simulation by ``shift`` (3,). Raises CaseError where it cannot be."""
    case = simulation.case
    if any(f.copies is not None and f.copies.file is not None for f in case.filaments.values()):
        raise CaseError([f"{case.file}: copies.file: found places in a file; allowed: copies that can be moved"])
    places = {name: np.array(f.position) + shift for name, f in case.filaments.items()}
    for _ in range(2):
        overrides = (*_tied(case, shift), *_positions(case, places, shift))
        found = _starts(simulation, overrides)
        off = {name: shift - found[name] for name in places}
        if max(float(np.abs(part).max()) for part in off.values()) < 1e-9 * simulation.system.length:
            return overrides
        places = {name: place + off[name] for name, place in places.items()}
    raise CaseError([f"{case.file}: found a start that does not follow `position`; allowed: one that does"])


def _positions(case: Case, places: dict[str, np.ndarray], shift: np.ndarray) -> Iterator[str]:
    for name, filament in case.filaments.items():
        if filament.copies is not None and filament.copies.region is not None:
            corners = [[float(x) for x in np.array(corner) + shift] for corner in filament.copies.region]
            yield f"filament.{name}.copies.region={corners}"
        else:
            yield f"filament.{name}.position={[float(x) for x in places[name]]}"


def _starts(simulation: Simulation, overrides: tuple[str, ...]) -> dict[str, np.ndarray]:
    """How far the overrides move the start of each filament."""
    from ...case.reading import parse_case
    from ...simulation.simulation import Simulation

    there = Simulation(parse_case(simulation.case.text, simulation.case.file, overrides))
    return {
        name: np.mean(there.start.r[there.nodes(name)] - simulation.start.r[simulation.nodes(name)], axis=0)
        for name in simulation.case.filaments
    }


def _tied(case: Case, shift: np.ndarray) -> Iterator[str]:
    """The overrides of flows, bodies, loads and springs that are tied to places."""
    if case.fluid.flow is not None:
        yield f"fluid.flow={_elsewhere(case.fluid.flow, shift)}"
    for name, link in case.links.items():
        if isinstance(link, Spring) and any(site.point is not None for site in link.between):
            yield f"link.{name}.between=[{', '.join(_site(site, shift) for site in link.between)}]"
    for name, body in case.bodies.items():
        follows = body.position is None and body.shape.file is None  # its first end, without a key
        if not follows and name in case.each_body:  # copies go with their filaments
            yield f"body.{name}.position={[float(x) for x in np.array(body.position or ORIGIN) + shift]}"
    for name, filament in case.filaments.items():
        for side, end in (("start", filament.start), ("finish", filament.finish)):
            if end.spring is not None:
                yield f"filament.{name}.{side}.spring.to={[float(x) for x in np.array(end.spring.to) + shift]}"
        loads = filament.loads
        if loads is None:
            continue
        if loads.force is not None:
            yield f"filament.{name}.loads.force={_elsewhere(loads.force, shift)}"
        if loads.tether is not None and loads.tether.places is not None:
            to = [f"({e.text}) + ({float(d)!r})" for e, d in zip(loads.tether.places, shift, strict=True)]
            yield f"filament.{name}.loads.tether.to={to}"


def _site(site: Site, shift: np.ndarray) -> str:
    """A place that a link holds on to: one of the lab moves with the scene."""
    if site.point is not None:
        return f"{{point = {[float(x) for x in np.array(site.point) + shift]}}}"
    at = f'"{site.at}"' if isinstance(site.at, str) else repr(site.at)
    return f'{{filament = "{site.filament}", at = {at}}}'


def _elsewhere(formulas: tuple[Expression, ...], shift: np.ndarray) -> list[str]:
    """Formulas of x, y, z at places ``shift`` back."""
    out = []
    for expression in formulas:
        text = str(expression.text)
        for letter, distance in zip("xyz", shift, strict=True):
            text = re.sub(rf"\b{letter}\b", f"({letter} - ({float(distance)!r}))", text)
        out.append(text)
    return out
