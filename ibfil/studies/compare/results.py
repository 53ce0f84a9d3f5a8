"""The comparison of fluids that a study found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..member import Outcome
from .quantities import Quantity, Window

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Column:
    """One fluid: how its run ended, its numbers, and what it models that not all do."""

    fluid: str
    outcome: Outcome
    method: str
    numbers: Mapping[str, Quantity]
    own: tuple[str, ...]
    shares: tuple[str, ...]  # of each term in time and memory, from counts


@dataclass(frozen=True)
class Comparison:
    """All of it. ``window`` None where no run came to an end."""

    title: str
    window: Window | None
    columns: tuple[Column, ...]
    about: Mapping[str, Any]
