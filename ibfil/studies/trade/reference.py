"""The reference of `ibfil trade`: a finer run that proves itself before anything is held against it.

Time and space are refined apart from the case's own resolution, each twice: steps h, h/2, h/4 at the case's nodes,
and nodes N, 2N - 1, 4N - 3 at the step h. The distances d1 of the first two runs of each and d2 of the last two give
the order and what is left of the error in the finest, by the rule of all studies (../estimates.py): levels that are
d1 + d2, d2 and 0 from the finest. Where the order is not seen, the levels of what is varied are refined further, and
where that does not help the measure is refused.

The reference has the finest step; and the finest nodes where nodes are varied. Where they are not, it has the case's,
and what the refinement shows is what the nodes themselves cost: `Reference.of_nodes`.

The grid is no level: its cells are the thickness of the rod (fluids/README.md). With little slip the force
density has thin layers at the ends, and second order in nodes shows only where they are well below h apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError, RunFailed
from ...io.reader import RunFile
from ..distance import rms
from ..estimates import estimate
from ..member import Member, Outcome
from ..settings import source
from ..tables import observed

if TYPE_CHECKING:
    from ...case.schema import Case


NOMINAL = 2.0  # order of BDF2 in time, and of the finite volumes in space, ends included
MORE = 1  # further levels, where the order is not seen
POSITION = "position"  # the measure that every run has

Run = Callable[[Sequence[Member], Path], list[Outcome]]


@dataclass(frozen=True)
class Proof:
    """The proof of one measure in one direction of refinement."""

    direction: str  # time | space
    levels: tuple[str, ...]
    distances: tuple[float, float]
    word: str  # what the levels show, as in ../estimates.py
    order: float | None
    error: float  # left in the finest level
    doubt: float  # of that

    @property
    def holds(self) -> bool:
        """Whether the order is seen, or a higher one, or there is nothing left but round-off."""
        return self.word in ("seen", "fast", "round-off")

    @property
    def estimate(self) -> float:
        """The bar of the finest level: its error and the doubt of that."""
        return self.error + self.doubt


@dataclass(frozen=True)
class Reference:
    """The finest run, and for each measure its proofs in time and in space; ``nodes``: it has the finest ones."""

    path: Path
    overrides: tuple[str, ...]
    proofs: dict[str, tuple[Proof, Proof]]
    nodes: bool

    @property
    def refused(self) -> tuple[str, ...]:
        """Measures that are not proved."""
        asked = 2 if self.nodes else 1
        return tuple(name for name, pair in self.proofs.items() if not all(proof.holds for proof in pair[:asked]))

    def estimate(self, measure: str) -> float:
        """Return its own error in a measure, of what it refines."""
        in_time, in_space = self.proofs[measure]
        return in_time.estimate + (in_space.estimate if self.nodes else 0.0)

    def of_nodes(self, measure: str) -> float:
        """Return how far the case's own nodes are from the finest tried; and what those have left, if that is known."""
        in_space = self.proofs[measure][1]
        return sum(in_space.distances) + (in_space.estimate if in_space.holds else 0.0)


def distances(a: RunFile, b: RunFile) -> dict[str, float]:
    """How far run a is from b, by measure.

    `position`: root mean square over nodes and outputs, in units of L; observables: relative to b, absolute where b
    has zero.
    """
    found = {POSITION: float(np.sqrt(np.mean(rms(a, b) ** 2)))}
    ours, theirs = observed(a), observed(b)
    for name, value in theirs.items():
        found[name] = float(np.linalg.norm(ours[name] - value) / (np.linalg.norm(value) or 1.0))
    return found


def base_step(case: Case) -> float:
    """The step of the coarsest level: the automatic one of the default scheme, or the case's, if that is shorter."""
    from ...simulation.simulation import Simulation

    step = Simulation(case).step_length
    return min(step, float(case.time.step)) if not case.time.automatic else step


class Levels:
    """The runs of the levels of one case, made when they are asked for."""

    def __init__(self, case: str, overrides: Sequence[str], folder: Path, run: Run) -> None:
        self._source, self._folder, self._run = source(case), folder, run
        exact: tuple[str, ...] = ("time.scheme=implicit", "time.order=2")
        given = Member("reference", self._source, (*overrides, *exact)).resolved()
        _refuse(given)
        if given.fluid.on_grid:
            exact += ("fluid.method=auto", "fluid.precision=double")
        self._overrides = (*overrides, *exact)
        automatic = Member("reference", self._source, (*self._overrides, "time.step=auto")).resolved()
        self.step = min(base_step(automatic), base_step(given))
        self.nodes = {name: filament.nodes for name, filament in given.filaments.items()}

    def overrides(self, time: int, space: int) -> tuple[str, ...]:
        """Return the settings of a level."""
        nodes = (f"filament.{name}.nodes={(n - 1) * 2**space + 1}" for name, n in self.nodes.items())
        return (f"time.step={self.step / 2**time!r}", *nodes)

    def member(self, time: int, space: int) -> Member:
        """The run of a level."""
        name = f"step_{2**time}_nodes_{2**space}"
        return Member(name, self._source, (*self._overrides, *self.overrides(time, space)))

    def paths(self, levels: Sequence[tuple[int, int]]) -> list[Path]:
        """Run what is not there. Raises RunFailed where one fails: nothing can be measured then."""
        members = [self.member(*level) for level in levels]
        for outcome in self._run(members, self._folder):
            if not outcome.done:
                advice = "a shorter time.step or more nodes: the reference begins with the case's own"
                raise RunFailed(f"the reference {outcome.member.name} failed: {outcome.message}", advice=advice)
        return [self._folder / f"{member.name}.h5" for member in members]


def _refuse(case: Case) -> None:
    """Raise CaseError for a case that has no reference of this kind."""
    faults = []
    if case.thermal is not None:
        faults.append("[thermal]: found thermal noise; allowed: none, a random run has no error against a reference")
    if case.time.tolerance is not None:
        faults.append("time.tolerance: found one in the case; allowed: none; vary it with --vary time.tolerance=...")
    if faults:
        raise CaseError([f"{case.file}: {fault}" for fault in faults])


def _refine(levels: Levels, direction: str, measures: Sequence[str], more: int) -> tuple[int, dict[str, Proof]]:
    """Refine until every measure shows its order, or ``more`` times; the finest level and the proofs."""
    for first in range(more + 1):
        at = [(k, 0) if direction == "time" else (0, k) for k in range(first, first + 3)]
        paths = levels.paths(at)
        proofs = {}
        with RunFile(paths[0]) as coarse, RunFile(paths[1]) as middle, RunFile(paths[2]) as fine:
            before, after = distances(coarse, middle), distances(middle, fine)
        for name in measures:
            d = (before[name], after[name])
            # Distances are shares, of a length or a number: round-off is told by one.
            told = estimate((d[0] + d[1], d[1], 0.0), (4.0, 2.0, 1.0), NOMINAL, level=2, scale=1.0)
            names = tuple(levels.member(*level).name for level in at)
            proofs[name] = Proof(direction, names, d, told.word, told.order, abs(told.error), told.doubt)
        if all(proof.holds for proof in proofs.values()):
            break
    return first + 2, proofs


def prove(
    case: str,
    overrides: Sequence[str],
    folder: Path,
    measures: Sequence[str],
    nodes: bool,
    run: Run,
) -> Reference:
    """Make the reference of a case and its proofs for ``measures``, with the finest ``nodes`` where they are varied.

    ``run`` runs members in a folder, as `run_members` does. Raises CaseError, RunFailed, Interrupted.
    """
    levels = Levels(case, overrides, folder / "reference", run)
    time, in_time = _refine(levels, "time", measures, MORE)
    space, in_space = _refine(levels, "space", measures, MORE if nodes else 0)
    finest = (time, space if nodes else 0)
    (path,) = levels.paths([finest])
    proofs = {name: (in_time[name], in_space[name]) for name in measures}
    return Reference(path, levels.overrides(*finest), proofs, nodes)
