"""Expressions of a case as numbers along the stacked rods: at nodes, at half nodes, over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..rods.constitutive import Field, gather

if TYPE_CHECKING:
    from ..case.expressions import Expression
    from ..case.filament import Filament

    Pick = Callable[[Filament], Expression]


def _pieces(
    filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray, pick: Pick
) -> list[tuple[slice, Callable, np.ndarray]]:
    """One function of (s, t) for each run of filaments that share an expression."""
    runs: list[tuple[slice, Expression]] = []
    for filament, where in zip(filaments, nodes, strict=True):
        expression = pick(filament)
        if runs and runs[-1][1] == expression:
            runs[-1] = (slice(runs[-1][0].start, where.stop), expression)
        else:
            runs.append((where, expression))
    return [(where, expression.bind("s", "t"), s[where]) for where, expression in runs]


def field(filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray, pick: Pick) -> Field:
    """A field of time over all nodes (n,); evaluated once where nothing in it depends on time."""
    values = gather(_pieces(filaments, nodes, s, pick), s.shape)
    if any("t" in pick(f).variables for f in filaments):
        return values
    fixed = np.broadcast_to(values(0.0), s.shape).copy()
    return lambda t: fixed


def along(filaments: Sequence[Filament], nodes: Sequence[slice], s: np.ndarray, pick: Pick) -> np.ndarray:
    """A property along the rods (n,)."""
    return np.broadcast_to(field(filaments, nodes, s, pick)(0.0), s.shape).astype(float)


def alone(expression: Expression, s: np.ndarray) -> np.ndarray:
    """A property along one filament (k,)."""
    return np.broadcast_to(expression.bind("s")(s), s.shape).astype(float)


def half(values: np.ndarray) -> np.ndarray:
    """Values at half nodes (n,) from values at nodes, by the mean; the entry after a filament's end is never used."""
    return np.append(0.5 * (values[1:] + values[:-1]), values[-1])
