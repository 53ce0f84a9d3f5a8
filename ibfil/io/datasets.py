"""The datasets of a run file: the meaning of each, and what an output adds to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields as fields_of
from typing import Any, NamedTuple

from .snapshots import Snapshot

# Dataset -> its dimension (units.py) and description.
_FILAMENT = {
    "position": ("length", "positions of the nodes, unwrapped"),
    "velocity": (
        "length/time",
        "velocities of the nodes over the step to the output, at t = 0 over the first",
    ),
    "force": (
        "force",
        "force of each node on the fluid over the step that led to the output, at t = 0 over the first; reactions of "
        "supports included",
    ),
    "e1": ("1", "first material director at the nodes"),
    "moment": ("force length", "internal moment at the nodes along e1, e2, e3"),
    "strain": ("1/length", "strains Omega_1, Omega_2, Omega_3 at the nodes"),
    "tension": ("force", "tension of the segments between nodes, positive when stretched"),
    "reaction_start": ("force", "force of the support on the node at s = 0"),
    "reaction_finish": ("force", "force of the support on the node at s = L"),
    "torque": ("force length", "twist torque of each node on the fluid, along the tangent"),
    "spin": ("1/time", "rate at which the first material director turns about the tangent, along it"),
}
ALONG_FRAME = ("moment", "strain")  # of a filament: components along e1, e2, e3, and not along x, y, z
_LINK = {
    "first": ("length", "points on the first of what the link joins"),
    "second": ("length", "points on the second"),
    "force": ("force", "force of the link on the second, the opposite of that on the first"),
    "length": ("length", "distance of the points of a spring"),
    "tension": ("force", "tension, positive where it draws them together; of bound filaments per length"),
    "angle": ("1", "angle between the segments of a hinge"),
    "moment": ("force length", "moment of a hinge"),
    "slide": ("length", "slide of the second of bound filaments along the first"),
    "shear": ("force/length", "shear force per length on the second of bound filaments, along it"),
    "active": ("force/length", "the active part of the shear force per length"),
}
_BODY = {
    "position": ("length", "position of the body's centre, unwrapped"),
    "e1": ("1", "first axis of the body"),
    "e2": ("1", "second axis of the body"),
    "e3": ("1", "third axis of the body"),
    "velocity": ("length/time", "velocity of its centre over the step to the output, at t = 0 over the first"),
    "spin": ("1/time", "rate at which the body turns, over that step"),
    "force": ("force", "force of the body itself on the fluid, that of its rods not in it"),
    "torque": ("force length", "torque of the body itself on the fluid, about its centre"),
    "reaction": ("force", "force that holds or moves the body, where its motion is given"),
    "reaction_torque": ("force length", "torque that holds or moves the body, about its centre"),
    "markers": ("length", "positions of its markers, where they are of a file"),
}
_MOTOR = {
    "angle": ("1", "angle by which the rod has turned against the body since the start, rad"),
    "rate": ("1/time", "rate at which it turns, over the step to the output"),
    "torque": ("force length", "torque of the motor on the rod, about its axis"),
    "power": ("force length/time", "power of the motor, torque times rate"),
}
_DIAGNOSTICS = {
    "net_force": ("force", "total force on the fluid"),
    "net_torque": ("force length", "total torque on the fluid"),
    "stretch_max": ("1", "largest stretch of a segment, length over rest length minus 1"),
    "stretch_min": ("1", "smallest stretch of a segment, length over rest length minus 1"),
    "power": ("force length/time", "power of the nodal forces and twist torques on the fluid over that step"),
    "kinetic_energy": ("force length", "kinetic energy of the rods' mass and rotary inertia"),
    "dissipation": ("force length/time", "power turned into heat, the sum of its parts that follow"),
    "flow_dissipation": ("force length/time", "part of it by the flow that forces drive; in rft by drag"),
    "slip_dissipation": ("force length/time", "part of it by the slip between nodes and grid"),
    "spin_dissipation": ("force length/time", "part of it by spins about the tangent that the flow takes no part in"),
    "couple_dissipation": ("force length/time", "part of it by the couple of flows across the rods' thickness"),
    "background_power": ("force length/time", "power of the rods' forces upon the background flow"),
    "grid_power": ("force length/time", "power of the nodal forces upon the grid's own flow"),
    "contacts": ("1", "pairs of segments in contact"),
    "first_contact": ("time", "time of the first contact that was warned of; NaN before"),
    "newton_iterations": ("1", "Newton iterations of the last step"),
    "steps_shortened": ("1", "steps so far that had to be tried again with a shorter one"),
    "probe_velocity": ("length/time", "velocity at output.probes"),
}
FIELDS = {
    "velocity": ("length/time", "velocity of the fluid"),
    "vorticity": ("1/time", "vorticity of the fluid"),
    "pressure": ("force/length/length", "pressure of the fluid"),
}


_KINDS = {"filaments": _FILAMENT, "links": _LINK, "bodies": _BODY, "motors": _MOTOR}


class Meaning(NamedTuple):
    """The meaning of a dataset: its dimension as in units.py, and words."""

    dimension: str
    description: str


def meaning_of(name: str, observables: Mapping[str, Meaning]) -> Meaning:
    """The meaning of a dataset by its name in the file; ``observables`` have theirs by their own."""
    group, _, last = name.rpartition("/")
    if name == "time":
        return Meaning("time", "times of the outputs")
    if group == "observables":
        return observables[last]
    if group == "diagnostics":
        return Meaning(*_DIAGNOSTICS.get(last, ("1", last.replace("_", " "))))
    return Meaning(*_KINDS[group.partition("/")[0]][last])


def rows_of(snapshot: Snapshot, series: Mapping[str, Any]) -> dict[str, Any]:
    """Dataset -> value of one output."""
    rows: dict[str, Any] = {"time": snapshot.time}
    for kind in _KINDS:
        for name, part in getattr(snapshot, kind).items():
            for field in fields_of(part):
                value = getattr(part, field.name)
                if value is not None:
                    rows[f"{kind}/{name}/{field.name}"] = value
    rows |= {f"observables/{name}": value for name, value in series.items()}
    return rows | {f"diagnostics/{name}": value for name, value in snapshot.diagnostics.items()}
