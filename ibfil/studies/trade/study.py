"""Error against wall time over settings of a case: `ibfil trade`.

Every setting is run several times, in rounds, and held against a reference that has proved itself
(reference.py). Its cost is seconds a unit of simulated time, without compilation, start-up and first step: the
least of its runs, their range the noise. Seconds are those of the clock on the wall, or of the processor: the same on
a machine that is idle (a run has one thread), and on a busy one the only ones that mean something. Its errors are
those of the measures: `position`, the root mean square distance of nodes in units of L, and observables, relative. A
setting is on the Pareto front of a measure where no other is both cheaper and better.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import CaseError, Interrupted, RunFailed
from ...screen import tell
from ..member import Member, Outcome
from ..members import run_members
from ..settings import Axis, Setting, combinations, source
from ..tables import measured, refuse_strangers, study_members, write_csv, write_json
from .reference import NOMINAL, POSITION, Proof, Reference, distances, prove
from .results import Trade, Trial

if TYPE_CHECKING:
    from ...case.schema import Case


TABLE, DETAILS, FIGURE = "trade.csv", "trade.json", "trade.png"
CLOCKS = ("wall", "processor")
_SPACE = ("nodes", "spacing")  # keys that change the nodes

Log = Callable[[str], object]


def trade(
    case: str,
    axes: Sequence[Axis],
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    observe: Sequence[str] = (),
    repeat: int = 3,
    clock: str = "wall",
    budget: float | None = None,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = tell,
) -> Trade:
    """Measure every combination of ``axes`` and write trade.csv, trade.json and trade.png into ``folder``.

    ``observe`` names the measures: `position` or an observable of the case; by default position and all of them.
    ``clock`` is wall or processor.
    ``budget`` in seconds: what is not measured by then is left out, and the same call goes on. Raises CaseError;
    RunFailed where the reference fails or is proved in no measure; Interrupted, also where the budget ends before
    the reference is there.
    """
    folder, settings = Path(folder), combinations(axes)
    members = study_members(case, overrides, settings)
    base = _base(case, overrides, folder)
    asked = _measures(base, observe)
    nodes = any(key.rsplit(".", 1)[-1] in _SPACE for one in axes for key in one.keys)

    with _budget(budget) as left:

        def heed(line: str = "") -> None:
            """End it also where the interrupt was lost: one that comes while the garbage collector calls back."""
            if line:
                log(line)
            if left():
                raise Interrupted

        def run(some: Sequence[Member], where: Path) -> list[Outcome]:
            return run_members(some, where, jobs=jobs, executor=executor, log=heed)

        reference = prove(case, overrides, folder, asked, nodes, run)
        heed()
        measures = _proved(reference, asked, log)
        _rounds(members, folder / "runs", repeat, run, left, log)
    trials = tuple(_trial(one, folder / "runs", repeat, clock, reference, measures) for one in settings)
    fronts = {name: front([one.cost for one in trials], [one.errors.get(name) for one in trials]) for name in measures}
    about = {**measured(), "repeats": repeat, "jobs": jobs, "clock": clock}
    result = Trade(base.title, reference, measures, trials, fronts, about)
    _write(result, folder)
    return result


def _base(case: str, overrides: Sequence[str], folder: Path) -> Case:
    """The case that settings vary. Raises CaseError, also where results would take the place of other files."""
    refuse_strangers(folder, DETAILS, TABLE, FIGURE)
    return Member("case", source(case), tuple(overrides)).resolved()


def _measures(base: Case, observe: Sequence[str]) -> tuple[str, ...]:
    known = (POSITION, *base.observe)
    strange = [name for name in observe if name not in known]
    if strange:
        raise CaseError([f"--observe: found {strange[0]}; allowed: {', '.join(known)}"])
    return tuple(dict.fromkeys(observe)) or known


def _proved(reference: Reference, asked: Sequence[str], log: Log) -> tuple[str, ...]:
    """The measures in which the reference holds; what is refused is told. Raises RunFailed where none is left."""
    for name in asked:
        for proof in reference.proofs[name]:
            log(
                f"reference, {name} in {proof.direction}: {_words(proof)}, error left {proof.error:.2g}, "
                f"doubt {proof.doubt:.2g}"
            )
    for name in reference.refused:
        log(f"{name} is refused: its order is not seen, so the reference proves nothing of it")
    kept = tuple(name for name in asked if name not in reference.refused)
    if not kept:
        raise RunFailed(
            "the reference shows its order in none of the measures asked for",
            advice="begin with a shorter time.step (and more nodes, where they are varied), or take other measures",
        )
    return kept


def _words(proof: Proof) -> str:
    """The levels in words, as `ibfil uncertainty` has them."""
    order = "" if proof.order is None else f"order {proof.order:.2f} ({NOMINAL:g})"
    return order if proof.word == "seen" else f"{proof.word}, {order}".removesuffix(", ")


@contextmanager
def _budget(seconds: float | None) -> Iterator[Callable[[], bool]]:
    """Within it, and after so many seconds, the run under way is told to stop as by Ctrl-C; gives whether it was."""
    over: list[int] = []

    def end(number: int, snapshot: object) -> None:
        over.append(number)
        os.kill(os.getpid(), signal.SIGINT)

    if seconds is None:
        yield lambda: False
        return
    before = signal.signal(signal.SIGALRM, end)
    try:
        signal.setitimer(signal.ITIMER_REAL, seconds)
        yield lambda: bool(over)
    except (Interrupted, KeyboardInterrupt):
        if over:
            raise Interrupted("the budget was used up by the reference; the same command goes on") from None
        raise
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _rounds(
    members: Sequence[Member],
    where: Path,
    repeat: int,
    run: Callable[[Sequence[Member], Path], list[Outcome]],
    left: Callable[[], bool],
    log: Log,
) -> None:
    """All members once, all again ...: what disturbs the machine for a while does not fall on one of them."""
    try:
        for number in range(1, repeat + 1):
            run([Member(f"{one.name}.{number}", one.case, one.overrides) for one in members], where)
    except (Interrupted, KeyboardInterrupt):
        if not left():
            raise
        log("the budget is used up; the same command goes on with what is left out")


def _trial(
    setting: Setting, where: Path, repeat: int, clock: str, reference: Reference, measures: Sequence[str]
) -> Trial:
    """The trial of a setting, from its repeats."""
    from ...io.reader import RunFile

    status, message = "left out", ""
    errors: dict[str, float] = {}
    seconds, processor = [], []
    for number in range(1, repeat + 1):
        path = where / f"{setting.name}.{number}.h5"
        if not path.exists():
            continue
        with RunFile(path) as run:
            if run.status not in ("finished", "stopped", "failed"):
                continue
            status, message = run.status, run.reason
            spent = run.pace
            if spent[2] > 0:
                seconds.append(spent[CLOCKS.index(clock)] / spent[2])
                processor.append(spent[1] / spent[2])
            if not errors and status != "failed":
                with RunFile(reference.path) as best:
                    found = distances(run, best)
                errors = {name: found[name] for name in measures}
    return Trial(setting, status, message.replace("\n", "; "), errors, tuple(seconds), tuple(processor))


def front(costs: Sequence[float], errors: Sequence[float | None]) -> tuple[int, ...]:
    """The indices that no other beats in cost and in error, cheapest first; those without an error are out."""
    order = sorted(
        (cost, error, i) for i, (cost, error) in enumerate(zip(costs, errors, strict=True)) if error is not None
    )
    best, found = float("inf"), []
    for _, error, i in order:
        if error < best:
            best = error
            found.append(i)
    return tuple(found)


def rows(result: Trade) -> list[dict[str, Any]]:
    """Return the table: a row a setting."""
    out = []
    for i, one in enumerate(result.trials):
        row: dict[str, Any] = {**one.setting.values, "status": one.status}
        if one.seconds:
            row |= {"seconds": one.cost, "seconds_most": max(one.seconds), "processor": min(one.processor)}
        for name, error in one.errors.items():
            marks = ["front"] * (i in result.fronts[name]) + ["under the reference's error"] * result.uncertain(
                one, name
            )
            row |= {name: error, f"{name}_marks": ", ".join(marks)}
        out.append({**row, "message": one.message})
    return out


def details(result: Trade) -> dict[str, Any]:
    """Return everything, ready for JSON."""
    reference = result.reference
    return {
        "title": result.title,
        **result.about,
        "cost": "seconds a unit of simulated time: the least of the repeats, without start-up and first step",
        "reference": {
            "overrides": reference.overrides,
            "error": {name: reference.estimate(name) for name in result.measures},
            "error_of_the_case_s_nodes": {name: reference.of_nodes(name) for name in result.measures},
            "refused": reference.refused,
            "proofs": {name: [asdict(proof) for proof in proofs] for name, proofs in reference.proofs.items()},
        },
        "settings": [
            {
                "overrides": one.setting.overrides,
                "status": one.status,
                "message": one.message,
                "errors": one.errors,
                "seconds": one.seconds,
                "processor": one.processor,
                "front": [name for name in result.measures if i in result.fronts[name]],
            }
            for i, one in enumerate(result.trials)
        ],
    }


def _write(result: Trade, folder: Path) -> None:
    from .figure import draw

    write_json(folder / DETAILS, details(result))
    write_csv(folder / TABLE, rows(result))
    draw(result, folder / FIGURE)
