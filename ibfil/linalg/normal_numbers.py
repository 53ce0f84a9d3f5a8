"""Normal numbers from counters (Philox 4x64): the same for the same seed, purpose and step, whatever was drawn before.

So a run's state is the number of its steps, and a new purpose, or another way to draw for one, moves no other.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np


class Purpose(IntEnum):
    """The use that numbers of a step are put to; each has a stream of its own."""

    MOTION = 0  # what of a random motion goes through the fluid
    OWN = 1  # what nodes move by themselves, where that is drawn apart
    TURN = 2  # turns about the tangent against the rods' own drag
    DRIFT = 3  # directions of the random finite difference


class NormalNumbers:
    """Independent numbers of mean zero and variance one, for steps of a run.

    ``seed`` is the run's; ``trial``: other numbers, for steps that are tried and not taken.
    """

    def __init__(self, seed: int, trial: bool = False) -> None:
        self._bits = np.random.Philox(np.random.SeedSequence((seed, int(trial))))
        self._generator = np.random.Generator(self._bits)
        self._state = self._bits.state
        self._state["buffer_pos"] = len(self._state["buffer"])  # nothing is left of the numbers before

    def draw(self, purpose: Purpose, step: int, shape: tuple[int, ...]) -> np.ndarray:
        """The numbers of a step, as an array of that shape."""
        self._state["state"]["counter"] = np.array([0, 0, purpose, step], np.uint64)
        self._bits.state = self._state
        return self._generator.standard_normal(shape)


class Draw:
    """The numbers of one step."""

    def __init__(self, numbers: NormalNumbers, step: int) -> None:
        self._numbers, self._step = numbers, step

    def __call__(self, purpose: Purpose, shape: tuple[int, ...]) -> np.ndarray:
        """The numbers for a purpose, as an array of that shape."""
        return self._numbers.draw(purpose, self._step, shape)
