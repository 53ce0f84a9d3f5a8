"""Where the nodes of a filament are along it, and the values of a case's expressions there."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError

if TYPE_CHECKING:
    from .expressions import Expression
    from .filament import Filament


def node_arclength(filament: Filament, key: str = "filament") -> np.ndarray:
    """Arclength (N,) of the nodes, from exactly 0 to exactly L: even, or L times ``spacing`` of q.

    Raises CaseError where the expression does not rise from 0 at q = 0 to 1 at q = 1. ``key`` begins each
    message: the table's dotted path, with the file's name before it if wanted.
    """
    q = np.linspace(0.0, 1.0, filament.nodes)
    if filament.spacing == "even":
        return filament.length * q
    x = values_along(filament.spacing, "q", f"{key}.spacing")(q)
    if abs(x[0]) > 1e-9 or abs(x[-1] - 1.0) > 1e-9:
        raise CaseError(
            [f"{key}.spacing: must run from 0 at q = 0 to 1 at q = 1; it runs from {x[0]:.6g} to {x[-1]:.6g}"]
        )
    x[0], x[-1] = 0.0, 1.0
    falling = np.nonzero(np.diff(x) <= 0.0)[0]
    if len(falling):
        raise CaseError([f"{key}.spacing: must increase with q; it does not at q = {q[falling[0]]:.6g}"])
    return filament.length * x


Values = Callable[[np.ndarray], np.ndarray]


def values_along(expression: Expression, name: str, key: str, *fixed: float) -> Values:
    """Bind an expression to ``name`` (n,), and t = ``fixed`` if given; CaseError where not finite."""
    bound = expression.bind(name, *(["t"] if fixed else []))

    def values(at: np.ndarray) -> np.ndarray:
        result = np.array(np.broadcast_to(bound(at, *fixed), at.shape), float)
        bad = np.nonzero(~np.isfinite(result))[0]
        if len(bad):
            raise CaseError([f"{key}: not a finite number at {name} = {at[bad[0]]:.6g}: {expression.text}"])
        return result

    return values
