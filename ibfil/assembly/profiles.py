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
    """One function of (s, t) for each run of filaments that share an expression; i and phase of copies by node."""
    runs: list[list[tuple[slice, Expression]]] = []
    for filament, where in zip(filaments, nodes, strict=True):
        expression = pick(filament)
        if runs and _shared(runs[-1][0][1]) == _shared(expression):
            runs[-1].append((where, expression))
        else:
            runs.append([(where, expression)])
    return [(slice(run[0][0].start, run[-1][0].stop), *_run(run, s)) for run in runs]


def _shared(expression: Expression) -> Expression:
    """The formula that all copies share, or the expression itself."""
    return expression if expression.origin is None else expression.origin[0]


def _run(run: list[tuple[slice, Expression]], s: np.ndarray) -> tuple[Callable, np.ndarray]:
    """The function of (s, t) of filaments that share a formula, and the arclength (k,) of their nodes."""
    here = s[run[0][0].start : run[-1][0].stop]
    shared, first = _shared(run[0][1]), run[0][1]
    if first is shared:
        return first.bind("s", "t"), here
    given = [dict(expression.origin[1]) for _, expression in run if expression.origin]
    counts = [where.stop - where.start for where, _ in run]
    fixed = [np.repeat([values[name] for values in given], counts) for name in given[0]]
    whole = shared.bind("s", "t", *given[0])
    return lambda at, t: whole(at, t, *fixed), here


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
