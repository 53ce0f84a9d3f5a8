"""The cheapest step and nodes of a scene for an error that is allowed of its numbers: `ibfil tune`.

Cheap runs tell how errors fall (probe.py), counts what a step costs, and choice.py what is cheapest; one run with the
answer is held against the corrected value. A probe that shows no order, or whose error is above what is allowed, is
refined; so it is where the answer misses, once, and coarser settings than it ran are no longer trusted. Choices are not
touched: fluid, box, cells, slip, kernel, scheme and order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import CaseError, RunFailed
from ...screen import tell
from ..member import Member
from ..runs import Runs
from ..settings import source
from ..tables import measured, refuse_strangers
from .choice import Aim, Law, Settings, candidates, corrected, settings
from .files import DETAILS, FIGURE, SCENE, TABLE, write
from .probe import Probe
from .results import NoSettings, Tuned
from .targets import targets

if TYPE_CHECKING:
    from ...case.schema import Case

RUNS = "runs"
REFINED = 2  # times, of a direction
HARMLESS = 0.2  # of the target: a bar that needs no order

Log = Callable[[str], object]


def tune(
    case: str,
    wanted: Sequence[str],
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = tell,
) -> Tuned:
    """The cheapest settings for what ``wanted`` allows ("speed=1%"); writes tune.csv, .json, .png and .toml.

    Raises CaseError; NoSettings where none are found, or a run with them misses; RunFailed where a probe fails;
    Interrupted.
    """
    folder = Path(folder)
    member = Member("case", source(case), tuple(overrides))
    base = member.resolved()
    goals = targets(wanted, base)
    _refuse(base)
    refuse_strangers(folder, DETAILS, TABLE, FIGURE, SCENE)
    from ...simulation.simulation import Simulation

    with ExitStack() as stack:
        runs = Runs(folder / RUNS, jobs, executor, log, stack)
        probe = Probe(runs, member, Simulation(base), goals)
        search = _Search(probe, runs, log)
        aims, found, answer, checks = search.answer()
        seconds = probe.seconds(search.at[1])
        own = settings(aims, probe.own_step, probe.own_nodes, probe.end, seconds)
        keys = probe.overrides(answer.step, answer.nodes)
        probed = tuple(probe.nodes(search.at[1] + i) for i in range(3))
        count = len([one for one in runs.outcomes.values() if one.done])
        result = Tuned(
            *(base.title, goals, answer, keys, checks, aims, own, found, probed, probe.end, seconds),
            *(count, runs.cost, probe.unplaced, measured()),
        )
        write(result, Member("tuned", member.case, (*overrides, *keys)), folder)
    return result


def _refuse(case: Case) -> None:
    """Raise CaseError for a case whose step is not to be chosen."""
    faults = []
    if case.thermal is not None:
        faults.append(
            "[thermal]: found thermal noise; allowed: none, scatter is what such numbers have (ibfil uncertainty)"
        )
    if case.time.tolerance is not None:
        faults.append("time.tolerance: found one; allowed: none, with it the scheme chooses its steps")
    if case.time.explicit:
        faults.append("time.scheme: found explicit; allowed: implicit, semi-implicit: others go where steps are stable")
    if faults:
        raise CaseError([f"{case.file}: {fault}" for fault in faults])


class _Search:
    """Probe, choose, verify; refine what does not show enough."""

    def __init__(self, probe: Probe, runs: Runs, log: Log) -> None:
        self._probe, self._runs, self._log = probe, runs, log
        self.at = (0, 0)  # the coarsest levels of the present probe

    def answer(self) -> tuple[list[Aim], list[Settings], Settings, dict[str, tuple[float, float, float]]]:
        """The laws, the candidates, the cheapest that a run confirms, and what it showed. Raises RunFailed."""
        missed = ""
        for beyond in (True, False):
            aims = self._aims()
            found = candidates(aims, self._probe.limits(*self.at, beyond), self._probe.seconds(self.at[1]))
            if not found:
                raise NoSettings(missed or "no settings found", advice=self._remedies(_hardest(aims)))
            best = found[0]
            checks = self._verify(best, aims)
            misses = [one for one in aims if _off(checks, one) > one.allowed]
            if not misses:
                return aims, found, best, checks
            words = [
                f"{one.number} is {_off(checks, one):.3g} off with doubts, {one.allowed:.3g} allowed" for one in misses
            ]
            missed = f"a run with {' '.join(self._probe.overrides(best.step, best.nodes))} misses: {'; '.join(words)}"
            self._log(f"{missed}: finer ones are looked at" if beyond else missed)
            if beyond:
                self.at = (self.at[0] + 1, min(self.at[1] + 1, REFINED))
        raise NoSettings(missed, advice=self._remedies(misses))

    def _aims(self) -> list[Aim]:
        """The laws, of a probe fine enough to tell. Raises RunFailed where it fails, or the rest is too much."""
        failure = None
        while True:
            k, m = self.at
            try:
                aims = self._probe.aims(k, m)
            except RunFailed as found:
                failure, finer = found, (True, True)
            else:
                over = [one for one in aims if one.rest >= one.allowed]
                if over:
                    raise NoSettings(f"no settings: {_rest(over[0])}", advice=self._remedies(over[:1]))
                failure = None
                finer = (
                    any(_too_coarse(one.step, one.allowed) for one in aims),
                    any(_too_coarse(one.nodes, one.allowed) for one in aims),
                )
            following = (min(k + finer[0], max(k, REFINED)), min(m + finer[1], max(m, REFINED - self._probe.on_grid)))
            if following == (k, m):
                if failure is not None:
                    raise failure
                return aims
            self._log(f"a finer probe: {'the last one failed' if failure else 'errors above the target, or no order'}")
            self.at = following

    def _remedies(self, aims: Sequence[Aim]) -> str:
        """The changes so that these can be met."""
        return "; ".join(_remedy(one, self._probe.on_grid) for one in aims)

    def _verify(self, best: Settings, aims: Sequence[Aim]) -> dict[str, tuple[float, float, float]]:
        """By number: what a run with the answer has, the corrected value of the probe, and the doubt of that."""
        nodes, step = best.nodes, best.step
        member = self._probe.trial(f"tuned_{nodes}_{step:.6g}", step, nodes)
        self._runs.make([member])
        numbers = self._probe.numbers(member).numbers()
        return {one.number: (numbers[one.number], *corrected(one)) for one in aims}


def _too_coarse(law: Law, allowed: float) -> bool:
    """Whether finer levels are wanted: no order is seen where that matters, or the middle level is above the target."""
    return (not law.seen and law.bar(law.sizes[0]) > HARMLESS * allowed) or law.bar(law.sizes[1]) > allowed


def _off(checks: dict[str, tuple[float, float, float]], one: Aim) -> float:
    value, right, doubt = checks[one.number]
    return abs(value - right) + doubt + one.rest


def _rest(one: Aim) -> str:
    return (
        f"{one.number} has a bar of {one.rest:.3g} from its place in a cell and its outputs, {one.allowed:.3g} allowed"
    )


def _hardest(aims: Sequence[Aim]) -> list[Aim]:
    """Those whose target is below the least bar that any level has."""
    least = [one for one in aims if _least(one) > one.allowed]
    return least or list(aims[:1])


def _least(one: Aim) -> float:
    return one.rest + one.nodes.bar(one.nodes.sizes[2]) + one.step.bar(one.step.sizes[2])


def _remedy(one: Aim, on_grid: bool) -> str:
    """The change that one number needs."""
    why = ""
    for name, law in (("nodes", one.nodes), ("steps", one.step)):
        if not law.seen:
            why += f"{name} show no order, their bar is {law.bar(law.sizes[2]):.2g}; "
    value = abs(one.nodes.coarsest.values[-1])
    if value <= _least(one):
        own = f"{one.number}={2 * _least(one):.1g}"
        return f"{one.number} = {value:.2g} is not told from zero: a target in its own unit, as {own}"
    share = f" ({100 * _least(one) / value:.2g} %)"
    others = ", a finer grid (fluid.thickness)" * on_grid + ", a shorter output.every" * (one.rest > 0.2 * one.allowed)
    return f"{why}{one.number}: a target above {_least(one):.2g}{share}{others}"
