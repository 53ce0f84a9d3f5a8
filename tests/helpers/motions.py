"""Observables looking at a filament that moves in a known way."""

from __future__ import annotations

import numpy as np

from ibfil.case.reading import parse_case
from ibfil.io.snapshots import FilamentSnapshot, Snapshot
from ibfil.observables.factory import observers
from ibfil.observables.observers import Summary

LENGTH, NODES = 2.0, 10  # an even number of nodes: the middle lies between two
S = np.linspace(0, LENGTH, NODES)
CASE = """
[units]
length = "um"
force = "pN"
time = "s"
[filament.rod]
length = 2.0
nodes = 10
bending = 1.0
stretching = 100.0
start = { end = "clamped" }
[fluid]
model = "rft"
viscosity = 0.5
[time]
end = 10.0
[output]
every = 0.1
"""


def observing(keys: str, more: str = ""):
    """The case with one observable, "o", and the observers of it."""
    text = CASE + f"[observe.o]\n{keys}\n" + more
    given = parse_case(text, "case.toml")
    return given, observers(given)


def snapshot(time: float, position: np.ndarray, **arrays) -> Snapshot:
    """A filament at ``position`` (10, 3) with everything else zero but ``arrays``."""
    zero = np.zeros((NODES, 3))
    held = {"velocity": zero, "force": zero, "e1": zero, "moment": zero, "strain": zero, "tension": np.zeros(NODES - 1)}
    held |= {"reaction_start": np.zeros(3), "reaction_finish": None} | arrays
    return Snapshot(time, {"rod": FilamentSnapshot(position=position, **held)}, {})


def seen(keys: str, motion, times) -> tuple[np.ndarray, Summary]:
    """Series and summary of an observable of ``motion``, a function of time to position or to (position, arrays)."""
    _, looking = observing(keys)
    for time in times:
        given = motion(time)
        position, arrays = given if isinstance(given, tuple) else (given, {})
        looking.record(snapshot(time, position, **arrays))
    return looking.series("o"), looking.summaries()["o"]


def value(keys: str, motion, times):
    return seen(keys, motion, times)[1].value


def straight(direction=(1, 0, 0)) -> np.ndarray:
    return S[:, None] * np.array(direction, float)


def tip_at(x: float, y: float, z: float) -> np.ndarray:
    """A straight line from the origin whose last node is at (x, y, z)."""
    return straight() * 0 + S[:, None] / LENGTH * np.array([x, y, z])


EVEN = np.arange(101) / 10
RNG = np.random.default_rng(11)
UNEVEN = np.sort(np.concatenate([[0.0, 10.0], RNG.uniform(0, 10, 150)]))
