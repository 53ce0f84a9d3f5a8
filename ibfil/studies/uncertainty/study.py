"""Error bars on the numbers of a scene, without a setting named: `ibfil uncertainty`.

The base is run, and beside it what tells its errors (levels.py): coarser and finer levels of the step and of the nodes,
a place half a cell aside on a grid. Where a direction shows its order the coarse levels serve, else (or with ``fine``)
a finer one is run. Output times and windows are told from the base's own series. With ``meant`` the choices are looked
at too: images of a periodic box, slip, stretching.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import CaseError, RunFailed
from ...io.units import label
from ..estimates import Estimate
from ..member import Member
from ..runs import Runs, spent
from ..settings import source
from ..tables import measured
from . import levels, sampling
from .discretisation import Found, refined
from .files import write
from .levels import Base
from .numbers import Recorded, own
from .results import Bar, Source, Uncertainty

if TYPE_CHECKING:
    from ...case.schema import Case

RUNS, BASE = "runs", "base"  # the folder of the runs, and the name of the scene's own
SINGLE = 1e-8  # of a number: what single precision changes (measured: 7e-9 to 1.6e-8 of speeds)

Log = Callable[[str], object]


def uncertainty(
    case: str,
    folder: str | Path,
    overrides: Sequence[str] = (),
    *,
    observe: Sequence[str] = (),
    fine: bool = False,
    meant: bool = False,
    jobs: int = 1,
    executor: Executor | None = None,
    log: Log = print,
) -> Uncertainty:
    """Bars of all observables of a case, or of those named; writes uncertainty.csv, .json and .png into ``folder``.

    ``fine`` takes finer levels in every direction, and seeds of a thermal scene; ``meant`` looks at choices too.
    Raises CaseError where the case is at fault or observes nothing, RunFailed where its own run fails, Interrupted.
    """
    whole, folder = source(case), Path(folder)
    member = Member(BASE, whole, tuple(overrides))
    base_case = member.resolved()
    wanted = _wanted(base_case, observe)
    with ExitStack() as stack:
        study = Runs(folder / RUNS, jobs, executor, log, stack)
        study.make([member])
        run = study.run(member)
        if run is None:
            raise RunFailed(study.why(member))
        from ...simulation.simulation import Simulation

        base = Base(member, Simulation(base_case), run)
        recorded = Recorded(run, wanted)
        sources = _sources(study, base, recorded, fine, meant)
        result = Uncertainty(
            base_case.title,
            tuple(_bars(recorded, sources, sampling.window(recorded, base))),
            len([one for one in study.outcomes.values() if one.done]),
            study.cost / max(spent(run), 1e-9),
            tuple(study.failures),
            measured(),
        )
        write(result, folder)
    return result


def _wanted(case: Case, observe: Sequence[str]) -> tuple[str, ...]:
    """The observables asked for. Raises CaseError."""
    each = [name for name in observe or case.observe if name in case.observe and case.observe[name].of_each]
    if each:
        raise CaseError(
            [f'{case.file}: observe.{each[0]}.copies: found "all"; allowed: a mean or spread has an error bar']
        )
    if not case.observe:
        raise CaseError([f"{case.file}: [observe]: found none; allowed: at least one, an error bar is of a number"])
    strange = [name for name in observe if name not in case.observe]
    if strange:
        raise CaseError([f"--observe: found {strange[0]}; allowed: {', '.join(case.observe)}"])
    return tuple(observe) or tuple(case.observe)


def _sources(study: Runs, base: Base, recorded: Recorded, fine: bool, meant: bool) -> list[Found]:
    """All sources of error, each by number."""
    value = recorded.numbers()
    if base.case.thermal is not None and base.case.thermal.energy > 0:
        words = "hidden by chance: two random runs differ by more than their steps and nodes make"
        found = [_seeds(study, base, recorded, fine), {k: _source("step, nodes", None, words) for k in value}]
    else:
        found = refined(study, base, recorded, fine)
    found.append(sampling.cadence(recorded))
    if base.case.fluid.on_grid and base.case.fluid.single:
        found.append(
            {k: _source("precision", Estimate(0.0, SINGLE * abs(v), None, ""), "single") for k, v in value.items()}
        )
    return [*found, *(_choices(study, base, recorded) if meant else [])]


def _source(name: str, estimate: Estimate | None, words: str, numerical: bool = True) -> Source:
    return Source(name, numerical, estimate, words)


def _seeds(study: Runs, base: Base, recorded: Recorded, fine: bool) -> Found:
    """The scatter between random runs: of blocks of the base, or with ``fine`` of runs with other seeds."""
    if not fine:
        return sampling.blocks(recorded)
    members = levels.seeded(base)
    study.make(members)
    runs = [run for run in map(study.run, members) if run is not None]
    return sampling.between([recorded.numbers(), *(recorded.of(run).numbers() for run in runs)])


def _choices(study: Runs, base: Base, recorded: Recorded) -> list[Found]:
    """The choices that make another scene: images, slip, stretching."""
    value = recorded.numbers()
    asked: list[tuple[str, Member, float, float, str]] = []
    unknown: list[Found] = []
    if base.case.fluid.on_grid and base.case.fluid.sides is not None:
        try:
            member, factor = levels.wider_box(base)
            power = 1.0 if base.pushed else 3.0
            law = "L^-1, a net force acts" if base.pushed else "L^-3, no net force"
            asked.append(("images", member, 1.0 / (1.0 - factor**-power), 0.25, law))
        except CaseError as error:
            unknown.append({k: _source("images", None, error.faults[0], False) for k in value})
    smooth = levels.without_slip(base)
    if smooth is not None:
        asked.append(("slip", smooth, 1.0, 0.25, "a run without"))
    asked.append(("stretching", levels.stiffer(base), levels.STIFFER / (levels.STIFFER - 1), 0.25, "1/EA"))
    study.make([member for _, member, *_ in asked])
    return [*(_choice(study, one, recorded) for one in asked), *unknown]


def _choice(study: Runs, asked: tuple[str, Member, float, float, str], recorded: Recorded) -> Found:
    """The effect of a choice, by the law of its limit: error (f - f') times a factor, a share of it in doubt."""
    name, member, factor, share, law = asked
    run, value = study.run(member), recorded.numbers()
    if run is None:
        return {k: _source(name, None, study.why(member), False) for k in value}
    there, out = recorded.of(run).numbers(), {}
    for key, number in value.items():
        error = factor * (number - there[key])
        told = Estimate(error, share * abs(error), None, "", (number, there[key]))
        out[key] = _source(name, told, law, False)
    return out


def _bars(recorded: Recorded, sources: Sequence[Found], halves: Mapping[str, tuple[float, float]]) -> list[Bar]:
    """The bars of all numbers."""
    out, scales = [], recorded.scales()
    for key, value in recorded.numbers().items():
        one = recorded.observables[own(key, recorded.observables)]
        found = tuple(source[key] for source in sources if key in source)
        words, unit = getattr(one, "words", one.description), label(recorded.case.units, one.summary_dimension)
        why = nothing(value, found, scales[key])
        out.append(Bar(key, value, words, unit, found, why, halves.get(key)))
    return out


def nothing(value: float, sources: Sequence[Source], scale: float) -> str:
    """Why a number is none: it has no value, or its levels differ by more than itself, and than its series is small."""
    if value != value:
        return "no number: the run gives none"
    for one in sources:
        told = one.estimate
        if told is None or len(told.values) < 3:
            continue
        apart = max(told.values) - min(told.values)
        if apart > abs(value) and apart > 0.1 * scale:
            shown = ", ".join(f"{v:.3g}" for v in told.values)
            return (
                f"no number: its levels ({one.name}) are {shown}; a shorter time.step, more nodes, or what is "
                "observed depends on chance"
            )
    return ""
