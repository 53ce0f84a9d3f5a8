"""The map of a stability study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..settings import Axis, Setting

STRETCH, LOCKED, TURN, PLACE = 0.02, 10.0, 0.1, 0.05  # what is amiss: above these
CLASSES = ("stable", "wrong", "turned", "locked", "stretched", "diverged", "no reference")


@dataclass(frozen=True)
class MapCell:
    """One setting: its class, the numbers that made it, and what was predicted ("" for nothing to fear)."""

    setting: Setting
    kind: str
    numbers: Mapping[str, float]  # place, shape, turn, stretch, force
    predicted: str
    why: str  # what that is taken from
    message: str


@dataclass(frozen=True)
class Map:
    """All cells, in the order of `combinations` of the axes."""

    title: str
    axes: tuple[Axis, ...]
    cells: tuple[MapCell, ...]
    about: Mapping[str, Any]

    @property
    def foretold(self) -> int:
        """In how many cells prediction and run agree on whether something is amiss."""
        return sum((cell.kind != "stable") == bool(cell.predicted) for cell in self.cells)
