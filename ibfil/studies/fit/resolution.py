"""The errors that step and nodes leave in fitted parameters: two more runs at the best place, each finer once.

A finer run changes the residuals by dr, and so the place of the least squares by -H J' dr. Where errors fall as h^p0,
with the nominal order p0 and sizes h of the run and q h of the finer one, the parameters are off by

    e = H J' (r_fine - r)/(1 - q^p0)

Two levels show no order: e is held against the interval, and parameters are not corrected by it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...io.reader import RunFile
from ..estimates import ALIKE
from ..uncertainty.levels import Base, Direction, level_member, nodes, steps
from .intervals import moved

if TYPE_CHECKING:
    from ..member import Outcome
    from .results import Errors, Fitted
    from .search import Found, Search

SHARE = 1 / 3  # of a half-width
_ALIKE = "steps are cut where the data have frames: a time.step below the time between those"
_TOLD = {"step": "a shorter time.step (or time.tolerance)", "nodes": "more nodes"}


def errors(runs: Search, found: Found) -> Errors:
    """The errors of the parameters from the step and from the nodes. Raises Interrupted."""
    from ...simulation.simulation import Simulation

    member = found.outcome.member
    with RunFile(found.outcome.path) as run:
        base = Base(member, Simulation(run.case), run)
        ways = (steps(base), nodes(base, ()))
        sizes = [one.size(run) for one in ways]
    finer = [replace(level_member(base, one, 1), name=f"{member.name}_{one.name}") for one in ways]
    there = runs.beside(finer)
    return {one.name: _error(one, size, found, *ended) for one, size, ended in zip(ways, sizes, there, strict=True)}


def _error(way: Direction, size: float, found: Found, outcome: Outcome, fine: np.ndarray | None) -> np.ndarray | str:
    if fine is None:
        return outcome.message
    with RunFile(outcome.path) as run:
        ratio = way.size(run) / size
    if ratio * (1 + ALIKE) > 1:
        return f"half of it is no finer, {_ALIKE}"
    return -moved(found.jacobian, fine - found.residuals) / (1.0 - ratio**way.nominal)


def notes(found: Errors, parameters: tuple[Fitted, ...], half: np.ndarray) -> list[str]:
    """A line for each error above a third of a half-width (p,), and for what is not known."""
    out = []
    for name, error in found.items():
        if isinstance(error, str):
            out.append(f"the error of the {name} in the parameters is not known: {error}")
            continue
        for one, e, h in zip(parameters, error, half, strict=True):
            if one.interval is not None and abs(e) > SHARE * h:
                of = "" if one.parameter.by_log else " of its range"
                out.append(
                    f"{one.parameter.key}: off by {100 * e:+.2g} %{of} from the {name}, by one finer run, with a "
                    f"half-width of {100 * h:.2g} %: too coarse for these data; {_TOLD[name]}"
                )
    return out
