"""Error bars on the rows of a comparison, by the rule of `ibfil uncertainty`: of step, nodes and place in a cell."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

from ..tables import numbers
from ..uncertainty.discretisation import refined
from ..uncertainty.levels import Base
from ..uncertainty.numbers import Numbers, moved_back
from .quantities import Quantity, Window, quantities

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from ...io.reader import RunFile
    from ..member import Outcome
    from ..runs import Runs

OBSERVED = "observed: "  # before the name of an observable of the case


def observed(run: RunFile) -> dict[str, float]:
    """The case's own observables but for the dissipation, which has its rows."""
    heat = run.case.dissipation_observed
    return {key: value for key, value in numbers(run).items() if key not in heat}


class Rows:
    """The rows of a run that are of itself alone: none of distances from another."""

    def __init__(self, run: RunFile, window: Window) -> None:
        self._window = window
        self._found = {key: one.value for key, one in quantities(run, window).items()}
        self._found |= {OBSERVED + key: value for key, value in observed(run).items()}

    def of(self, run: RunFile) -> Rows:
        """The same rows of another run."""
        return Rows(run, self._window)

    def numbers(self) -> Numbers:
        """Row by row."""
        return dict(self._found)

    def back(self, run: RunFile, shift: np.ndarray) -> Numbers:
        """Those of a run ``shift`` (3,) aside: only observables of the case can be of places."""
        there = self.of(run).numbers()
        return there | {
            OBSERVED + key: value for key, value in moved_back(run, shift).items() if OBSERVED + key in there
        }

    def scales(self) -> Numbers:
        """The largest of the components beside it: one that vanishes has the round-off of the others."""
        stems = {key: key[:-2] if key[-2:] in (" x", " y", " z", "_x", "_y", "_z") else key for key in self._found}
        largest: dict[str, float] = {}
        for key, stem in stems.items():
            largest[stem] = max(largest.get(stem, 0.0), abs(self._found[key]))
        return {key: largest[stem] for key, stem in stems.items()}


def with_bars(
    found: Mapping[str, Quantity],
    outcome: Outcome,
    window: Window,
    runs: Callable[[str, ExitStack], Runs],
) -> dict[str, Quantity]:
    """The rows of a fluid with the sources of their errors; ``runs`` gives where the runs of a name are made."""
    from ...simulation.simulation import Simulation

    with ExitStack() as stack:
        study = runs(outcome.member.name, stack)
        study.take(outcome)
        run = study.run(outcome.member)
        assert run is not None  # it came to an end
        base = Base(outcome.member, Simulation(run.case), run)
        sources = refined(study, base, Rows(run, window), fine=False)
        return {
            key: replace(one, sources=tuple(source[key] for source in sources if key in source))
            for key, one in found.items()
        }
