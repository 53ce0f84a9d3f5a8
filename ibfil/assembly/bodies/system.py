"""From the [body] tables of a case to bodies, motors, and the ends of rods in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...bodies.body import NOTHING, Attachment, Body, Motor, OfTime
from ...bodies.system import RodsWithBodies
from ...case.table import ORIGIN
from ...rods.boundary_conditions import spinning, steady, turned
from ..loads import number, triple
from .attached import InBody, attached_ends, by_body, check_places
from .clouds import cloud, size
from .supports import supports

if TYPE_CHECKING:
    from ...case.bodies import body as tables
    from ...case.bodies.motor import Motor as MotorTable
    from ...case.schema import Case
    from ...rods.base import Load
    from ...rods.geometry import Configuration
    from ..stacked import RodStack


def with_bodies(case: Case, rods: RodStack) -> RodStack:
    """These rods, with the bodies of the case."""
    system = _system(case, rods)
    start = system.rows.appended(rods.start, system.rows.start())
    s = np.append(rods.s, np.zeros(system.rows.count - rods.count))
    joined = case.joined
    return replace(rods, s=s, system=system, start=start, bodies=joined["body"], motors=joined["motor"])


def _system(case: Case, rods: RodStack) -> RodsWithBodies:
    """The system of the rods and the bodies."""
    begin, each, ends = rods.start, case.each_body, attached_ends(rods)
    names, inside = list(each), by_body(ends)
    bodies = [_body(case, name, table, inside[name], begin) for name, table in each.items()]
    check_places(case, rods, ends, bodies)
    motors: list[Motor] = []
    driven, attachments = [], []
    for at in ends:
        number_of = names.index(at.end.body)
        body, motor = bodies[number_of], -1
        if at.end.motor is not None:
            motor = len(motors)
            motors.append(_motor(at.end.motor, number_of, body, begin, at))
            driven.append(np.arange(at.where.start, at.where.stop))
        attachments.append(_attachment(at, number_of, motor, body, begin, rods.system.unknowns))
    parts = [[np.arange(e.where.start, e.where.stop) for e in inside[name]] for name in names]
    own = [np.unique(np.concatenate([np.zeros(0, np.int64), *some])) for some in parts]
    found = supports(rods, ends, names)
    together = [own[b] for b in range(len(own))] if found is None else found.together(own)
    return RodsWithBodies(rods.system, bodies, motors, attachments, own, driven, _outside(rods, together), found)


def _outside(rods: RodStack, own: Sequence[np.ndarray]) -> list[Load]:
    """The loads but for links, and contact, that act between the rods of one body alone: these sum to zero."""
    whole = any(len(nodes) == rods.count for nodes in own)
    inner: list[Load] = [*rods.contact.loads()] if whole else []
    for link in rods.links:
        on_rods = bool(np.all(np.abs(link.elements.weights).sum(axis=2) > 0))  # a place in the lab has no weights
        if on_rods and any(np.isin(link.elements.nodes, nodes).all() for nodes in own):
            inner.append(link)
    return [load for load in rods.system.loads if not any(load is other for other in inner)]


def _body(case: Case, name: str, table: tables.Body, ends: Sequence[InBody], begin: Configuration) -> Body:
    """One body as it begins."""
    own = size(case, name, table)
    x = np.array(table.axes[0]) / np.linalg.norm(table.axes[0])
    y = np.array(table.axes[1]) - (np.array(table.axes[1]) @ x) * x
    y /= np.linalg.norm(y)
    axes = np.column_stack([x, y, np.cross(x, y)])
    copied = ends[0].copied if ends else None
    if copied is not None:
        axes = copied.turn @ axes
    given = table.given_motion
    turns = None if given is None else triple(given.turns, "t")
    if not own.any() and all(at.end.hinged for at in ends):
        turns = _still  # a joint of hinges: nothing would tell how it turns
    return Body(
        _centre(table, axes, ends, begin, own),
        axes,
        None if given is None else triple(given.moves, "t"),
        turns,
        _of_time(table.force),
        _of_time(table.torque),
        table.own_axes,
        cloud(case, name, table),
    )


def _centre(
    table: tables.Body, axes: np.ndarray, ends: Sequence[InBody], begin: Configuration, size: np.ndarray
) -> np.ndarray:
    """The centre (3,): as given, or such that the first end is on the surface, the centre behind its tangent."""
    if table.position is not None or table.shape.file is not None or not ends:
        place = np.array(table.position or ORIGIN)
        return place if not ends or ends[0].copied is None else ends[0].copied.place(place)
    first = ends[0]
    out = begin.e3[first.node] * (-1.0 if first.finish else 1.0)  # from the body into the rod
    if not size.any():
        return begin.r[first.node].copy()
    return begin.r[first.node] - out / np.linalg.norm((out @ axes) / size)


def _still(time: float) -> np.ndarray:
    return NOTHING


def _of_time(given) -> OfTime | None:
    return None if given is None else triple(given, "t")


def _motor(table: MotorTable, number_of: int, body: Body, begin: Configuration, at: InBody) -> Motor:
    """One motor."""
    if isinstance(table.axis, str):
        axis, point = begin.e3[at.node] @ body.axes, (begin.r[at.node] - body.centre) @ body.axes
    else:
        axis, point = np.array(table.axis) / np.linalg.norm(table.axis), np.array(table.through or ORIGIN)
    if table.stall is not None:
        assert table.free is not None
        stall = table.stall
        return Motor(number_of, axis, point, None, lambda t: stall, stall / table.free)
    if table.torque is not None:
        return Motor(number_of, axis, point, None, number(table.torque))
    return Motor(number_of, axis, point, _angle(table))


def _angle(table: MotorTable) -> Callable[[float, float], float]:
    """The angle that a motor of a given rate or angle turns between two times."""
    if table.angle is not None:
        return turned(number(table.angle))
    assert table.spin is not None
    return steady(table.spin.constant) if table.spin.constant is not None else spinning(number(table.spin))


def _attachment(at: InBody, body: int, motor: int, of: Body, begin: Configuration, unknowns: int) -> Attachment:
    """The end in body axes."""
    tangent = begin.e3[at.node] @ of.axes if at.end.clamped else None
    director = begin.e1[at.node] @ of.axes if at.end.clamped and at.twists and unknowns == 4 else None
    return Attachment(at.node, body, motor, (begin.r[at.node] - of.centre) @ of.axes, tangent, director)
