"""Lengths of thermal steps: the longest whose kicks neither turn segments too far nor make stiff modes ring (kicks.py).

s and W are means over the segments and nodes of a filament, copies together. On a grid the moves of a step are small
against its spacing h as well, where the random finite difference of the drift would add to their variance.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..timestepping.kicks import Kicks, Trials
from ..timestepping.stability_limit import explicit_limit

if TYPE_CHECKING:
    from .model import Model

TURN = 2e-3  # s of automatic steps
RINGING = 0.02  # W of automatic steps, in kT a node; runs failed from 0.5 on
MOVE = 0.1  # rms kick of a node, along an axis, in cells
_SAMPLES = 400  # segments of the filament with the fewest, over all trial steps of a length
_TRIALS = (4, 64)  # steps of a length, at least and at most
_SHORTEST = 0.25  # of the explicit limit: what trials begin with
_POWERS = (1.0, 3.0, 0.5)  # of dt, that s, W and kicks go with in steps shorter than that


class KickSizes(NamedTuple):
    """The kicks of a step: s and W of the filament where they are largest, and rms lengths of all.

    ``kick`` is one component of the random motion itself, ``move`` of what the rods make of it, ``cell`` the spacing of
    the grid (infinite without one).
    """

    dt: float
    turn: float
    ringing: float
    kick: float
    move: float
    cell: float
    filament: str

    def over(self) -> tuple[float, float, float]:
        """How many times what is allowed s, W and the kick are."""
        return self.turn / TURN, self.ringing / RINGING, self.kick / (MOVE * self.cell)


def _groups(model: Model) -> list[tuple[str, np.ndarray]]:
    """The name of each filament of the case, of its first copy, and its nodes, copies together."""
    found: dict[int, list[int]] = {}
    rods = model.rods
    for k, filament in enumerate(rods.filaments):
        found.setdefault(id(filament), []).append(k)
    return [
        (rods.names[copies[0]], np.concatenate([np.arange(rods.nodes[k].start, rods.nodes[k].stop) for k in copies]))
        for copies in found.values()
    ]


def _sizes(model: Model, kicks: Kicks) -> KickSizes:
    joined, cell = model.rods.system.mesh.joined, model.fluid_model.spacing or np.inf
    lengths = float(np.sqrt(kicks.kick)), float(np.sqrt(kicks.move)), cell
    found = []
    for name, nodes in _groups(model):
        turn, ringing = np.mean(kicks.turn[nodes[joined[nodes]]]) / 4, np.mean(kicks.ringing[nodes])
        found.append(KickSizes(kicks.dt, float(turn), float(ringing), *lengths, name))
    return max(found, key=lambda sizes: max(sizes.over()))


def _trials(model: Model) -> Trials:
    segments = min(len(nodes) for _, nodes in _groups(model)) - 1
    count = int(np.clip(-(-_SAMPLES // segments), *_TRIALS))
    assert model.noise is not None
    return Trials(model.rods.system, model.fluid, model.noise, model.rods.start, 0.0, count)


def _lengths(model: Model, last: float) -> Iterator[float]:
    """Lengths that double, from a quarter of the explicit limit up to ``last``."""
    length = _SHORTEST * explicit_limit(model.rods.system, model.fluid, model.rods.start, 0.0)
    while length < last:
        yield length
        length *= 2
    yield last


def sizes_of_step(model: Model, dt: float) -> KickSizes:
    """The sizes of the kicks of steps of length dt, from the case's start."""
    trials = _trials(model)
    for length in _lengths(model, dt):
        if length < dt:
            trials.pass_by(length)
    return _sizes(model, trials.of(dt))


def longest_step(model: Model, most: float) -> float:
    """The longest step, up to ``most``, whose kicks are small enough."""
    trials, before = _trials(model), None
    for length in _lengths(model, most):
        found = _sizes(model, trials.of(length))
        if max(found.over()) > 1:
            return _between(before, found)
        before = found
    return most


def _between(before: KickSizes | None, after: KickSizes) -> float:
    """The step that just keeps its kicks small, between the last tried that does and the first that does not."""
    if before is None:
        return after.dt * min(
            min(1.0, 1 / over) ** (1 / power) for over, power in zip(after.over(), _POWERS, strict=True) if over
        )
    if not np.isfinite(after.ringing):
        return before.dt
    steps = [
        np.log(1 / old) / np.log(new / old) for old, new in zip(before.over(), after.over(), strict=True) if new > 1
    ]
    return float(before.dt * (after.dt / before.dt) ** min(steps))
