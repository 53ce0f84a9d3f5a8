"""The runs of `ibfil tune`: cheap ones of a grid of levels in step and nodes, one half a cell aside, the answer's.

Levels count from the coarsest: (k, m) has a step 2^k times shorter and nodes 2^m times denser than (0, 0), whose step
is four times the case's own (or the automatic one, if that is longer), and whose nodes are half as many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError, RunFailed
from ..uncertainty import levels, sampling
from ..uncertainty.levels import Base
from ..uncertainty.numbers import Recorded, moved_back, own
from ..uncertainty.results import Source
from ..uncertainty.study import nothing
from .choice import FEWEST, Aim, Law, Limits, even, through

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...io.reader import RunFile
    from ...simulation.simulation import Simulation
    from ..member import Member
    from ..runs import Runs
    from .targets import Target

COARSER = 4.0  # the first step, in steps of the case
A_PERIOD = 20  # steps of it at least


class Probe:
    """The levels of one case, run as they are asked for."""

    def __init__(self, runs: Runs, member: Member, simulation: Simulation, wanted: Sequence[Target]) -> None:
        self._runs, self._member, self.case, self._wanted = runs, member, simulation.case, wanted
        self._counts = {name: f.nodes for name, f in self.case.filaments.items()}
        self.own_step = simulation.step_length
        self.longest = _longest(simulation)
        automatic = _simulation(member, "time.step=auto").step_length
        self._step = even(min(max(COARSER * self.own_step, automatic), self.longest), self.every)
        self._halved = min((n - 1) // 2 + 1 for n in self._counts.values()) >= FEWEST
        self._base: Base | None = None
        self.on_grid, self.unplaced = self.case.fluid.on_grid, ""
        self._seconds: dict[int, Callable[[int], float]] = {}

    @property
    def every(self) -> float:
        """The time that steps divide evenly."""
        return float(self.case.output.every or self.case.time.end)

    @property
    def end(self) -> float:
        """When all runs end: where the first did."""
        return self.case.time.end if self._base is None else self._base.end

    @property
    def own_nodes(self) -> int:
        """The nodes of the leading filament, that with the most."""
        return max(self._counts.values())

    @property
    def own_level(self) -> int:
        """The level that has the case's own nodes."""
        return 1 if self._halved else 0

    def nodes(self, m: int) -> int:
        """The nodes of the leading filament at a level."""
        first = (self.own_nodes - 1) // 2 if self._halved else self.own_nodes - 1
        return first * 2**m + 1

    def step(self, k: int) -> float:
        """The step of a level."""
        return float(self._step / 2**k)

    def overrides(self, step: float, nodes: int) -> tuple[str, ...]:
        """The keys of a step and nodes of the leading filament, all others with it."""
        share = (nodes - 1) / (self.own_nodes - 1)
        counts = {name: max(round((n - 1) * share), FEWEST - 1) + 1 for name, n in self._counts.items()}
        return (f"time.step={step!r}", *(f"filament.{name}.nodes={n}" for name, n in counts.items()))

    def member(self, k: int, m: int) -> Member:
        """The run of a level."""
        return self.trial(f"step_{2**k}_nodes_{2**m}", self.step(k), self.nodes(m))

    def trial(self, name: str, step: float, nodes: int) -> Member:
        """A run with any settings; it ends where the first one did."""
        keys = self.overrides(step, nodes)
        if self._base is None:
            return replace(self._member, name=name, overrides=(*self._member.overrides, *keys))
        return self._base.member_of(name, keys)

    def numbers(self, member: Member) -> Recorded:
        """The records of a run. Raises RunFailed where it has no result."""
        run = self._runs.run(member)
        if run is None:
            raise RunFailed(self._runs.why(member))
        return Recorded(run, tuple(dict.fromkeys(one.observable for one in self._wanted)))

    def begin(self, k: int, m: int) -> None:
        """Run the coarsest level of a probe, which says where all end. Raises RunFailed, Interrupted."""
        first = self.member(k, m)
        self._runs.make([first])
        run = self._runs.run(first)
        if run is None:
            raise RunFailed(self._runs.why(first))
        self._base = self._base or Base(self._member, _simulation(first), run)

    def aims(self, k: int, m: int) -> list[Aim]:
        """The laws of all numbers asked for, from the levels k, k + 1, k + 2 and m, m + 1, m + 2.

        Raises RunFailed where a level has no result or a number is none.
        """
        self.begin(k, m)
        in_time = [self.member(k + i, m) for i in range(3)]
        in_space = [self.member(k, m + i) for i in range(3)]
        aside = self._aside(k, m)
        self._runs.make([*in_time[1:], *in_space[1:], *([] if aside is None else [aside[0]])])
        first = self.numbers(in_time[0])
        placed = {} if aside is None else moved_back(self._run(aside[0]), aside[1])
        outputs = sampling.cadence(first)
        steps = [(self.numbers(one).numbers(), self._run(one).steps) for one in in_time]
        meshes = [(self.numbers(one).numbers(), self.nodes(m + i)) for i, one in enumerate(in_space)]
        found, scales, finest = [], first.scales(), meshes[-1][0]
        for key, goal in (
            (key, goal) for goal in self._wanted for key in finest if goal.observable == own(key, [goal.observable])
        ):
            values = [numbers[key] for numbers, _ in (*steps, *meshes)]
            step, nodes = self._laws(key, values, [count for _, count in (*steps, *meshes)], scales[key])
            cadence = outputs[key].estimate
            rest = abs(values[0] - placed.get(key, values[0]))  # |e| + u of a place in a cell, u = |e|
            rest += 0.0 if cadence is None else abs(cadence.error) + cadence.doubt
            found.append(Aim(key, goal.allowed(finest), rest, step, nodes))
        return found

    def _laws(self, key: str, values: Sequence[float], counts: Sequence[int], scale: float) -> tuple[Law, Law]:
        """Those of step and nodes, from three values and counts of each. Raises RunFailed where a number is none."""
        if not np.all(np.isfinite(values)):
            raise RunFailed(f"{key}: no number: a run gives none")
        size = max(*map(abs, values), scale)
        laws = (
            Law(values[:3], [self.end / count for count in counts[:3]], float(self.case.time.order), size),
            Law(values[3:], [1.0 / (count - 1) for count in counts[3:]], 2.0, size),
        )
        for name, law in zip(("step", "nodes"), laws, strict=True):
            why = nothing(values[-1], [Source(name, True, law.coarsest, "")], scale)
            if why:
                raise RunFailed(f"{key}: {why}")
        return laws

    def limits(self, k: int, m: int, beyond: bool) -> Limits:
        """The range of a choice from a probe at (k, m); ``beyond``: coarser settings than it has tried, too."""
        fewest = max(FEWEST, (self.nodes(m) - 1) // 2 + 1) if beyond else self.nodes(m)
        longest = min(self.longest, COARSER * self.step(k) if beyond else self.step(k))
        return Limits(fewest, self.nodes(m + 2), longest, self.every, self.end)

    def seconds(self, m: int) -> Callable[[int], float]:
        """Seconds a step by nodes, from counts: no clock decides what is chosen."""
        if m not in self._seconds:
            counts = [self.nodes(m + i) for i in range(3)]
            models = [_simulation(self.member(0, m + i)) for i in range(3)]
            self._seconds[m] = through(counts, [one.model.seconds[one.method] for one in models])
        return self._seconds[m]

    def _run(self, member: Member) -> RunFile:
        run = self._runs.run(member)
        if run is None:
            raise RunFailed(self._runs.why(member))
        return run

    def _aside(self, k: int, m: int) -> tuple[Member, np.ndarray] | None:
        """The run half a cell aside, and the shift; None where places make no difference, or cannot be moved."""
        if not self.on_grid:
            return None
        first = self.member(k, m)
        try:
            base = Base(first, _simulation(first), self._run(first))
            member, shift = levels.half_cell(base, ())
        except CaseError as error:
            self.unplaced = error.faults[0]
            return None
        return replace(member, name=f"{first.name}_aside"), shift


def _simulation(member: Member, *keys: str) -> Simulation:
    from ...simulation.simulation import Simulation

    return Simulation(replace(member, overrides=(*member.overrides, *keys)).resolved())


def _longest(simulation: Simulation) -> float:
    """The longest step to look at: of an output, of a twentieth of the period of what drives, of a tenth of the run."""
    case, period = simulation.case, simulation.drivers.period
    found = [case.time.end / 10]
    if case.output.every is not None:
        found.append(case.output.every)
    if period is not None:
        found.append(period.length / A_PERIOD)
    return min(found)
