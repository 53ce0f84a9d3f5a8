"""The comparison of fluids that a study found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..member import Outcome
from .quantities import Quantity, Window

OBSERVED = "observed: "  # what rows of the case's own observables begin with


@dataclass(frozen=True)
class Column:
    """One fluid: how its run ended, its numbers, and what it models that not all do."""

    fluid: str
    outcome: Outcome
    method: str
    numbers: Mapping[str, Quantity]
    own: tuple[str, ...]
    shares: tuple[str, ...]  # of each term in time and memory, from counts

    @property
    def observed(self) -> list[Quantity]:
        """Those of the case's own observables."""
        return [found for name, found in self.numbers.items() if name.startswith(OBSERVED)]


@dataclass(frozen=True)
class Comparison:
    """All of it. ``window`` None where no run came to an end."""

    title: str
    window: Window | None
    columns: tuple[Column, ...]
    about: Mapping[str, Any]
