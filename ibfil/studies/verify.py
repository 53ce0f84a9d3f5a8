"""Shipped or given cases run, and their [expect] numbers held against the results: `ibfil verify`.

With error bars each case is run at other levels of step and nodes too, as by `ibfil uncertainty`, and every number that
is found has the bar of that rule. An expectation is met by the number as it is; a bar that is wider than what is
allowed is told, since finer levels might decide otherwise.
"""

from __future__ import annotations

import tempfile
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..case import library
from ..case.reading import differences, quick_case, read_case
from ..errors import CaseError, RunFailed
from ..observables.expectations import Check, check
from ..screen import on_terminal, tell
from .tables import with_bar

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..observables.observers import Summary
    from .uncertainty.results import Bar


@dataclass(frozen=True)
class Planned:
    """One run, and the expectations it answers, each with the case that holds its number."""

    label: str
    case: Case
    expects: dict[str, Case]


def verify(cases: Sequence[str], quick: bool, log: Callable[[str], object] = tell, *, bars: bool = False) -> int:
    """Run the cases (files or shipped names; none: all shipped ones) and say a line for each expectation.

    With ``quick`` each expectation is held against the quick form of its case; those whose quick forms are
    the same share a run; with ``bars`` the numbers have error bars. Returns the exit status: 0 where all were
    met, 1 where one was not or its run failed. Raises CaseError, with the faults of all the cases, before
    anything is run.
    """
    planned = _plan(cases, quick)
    width = max(len(f"{one.label} {name}") for one in planned for name in one.expects)
    met = total = 0
    for one in planned:
        began = clock.monotonic()
        for name, passed, message in _outcome(one, bars):
            met, total = met + passed, total + 1
            verdict, title = "ok  " if passed else "FAIL", f"{one.label} {name}"
            log(f"{verdict}  {title:{width}}  {message}  {clock.monotonic() - began:.1f} s")
    log(f"{met} of {total} expected numbers found")
    return 0 if met == total else 1


def _plan(cases: Sequence[str], quick: bool) -> list[Planned]:
    """The runs to do. Shipped cases that expect nothing are passed over; one that is asked for is a fault."""
    planned: list[Planned] = []
    faults: list[str] = []
    for name in cases or library.paths():
        try:
            case = read_case(library.find(name))
        except CaseError as error:
            faults += error.faults
            continue
        if case.expect:
            planned += _runs(name, case, quick)
        elif cases:
            faults.append(f"{name}: found no [expect] table; allowed: a case with one or more [expect.NAME]")
    if not faults and not planned:
        faults.append(f"{library.folder()}: no shipped case expects a number")
    if faults:
        raise CaseError(faults)
    return planned


def _runs(label: str, case: Case, quick: bool) -> Iterator[Planned]:
    """The case itself; or its quick forms, each with the expectations that share it."""
    if not quick:
        yield Planned(label, case, dict.fromkeys(case.expect, case))
        return
    planned: list[Planned] = []
    for name in case.expect:
        form = quick_case(case, name)
        for other in planned:
            if all(key.startswith("expect.") for key in differences(form, other.case)):
                other.expects[name] = form
                break
        else:
            planned.append(Planned(label, form, {name: form}))
    yield from planned


def _outcome(one: Planned, bars: bool) -> Iterator[tuple[str, bool, str]]:
    """Run it; for each expectation its name, whether it was met, and what was expected and found."""
    try:
        summaries, found = _with_bars(one) if bars else (_summaries(one.case), {})
    except RunFailed as failure:
        for name in one.expects:
            yield name, False, str(failure).replace("\n", "; ")
        return
    for name, case in one.expects.items():
        held = next(held for held in check(case, summaries) if held.name == name)
        yield name, held.passed, _told(held, found.get(held.observe))


def _summaries(case: Case) -> Mapping[str, Summary]:
    from ..running.run import run

    return run(case, progress=on_terminal(), log=lambda line: None).summaries


def _with_bars(one: Planned) -> tuple[Mapping[str, Summary], dict[str, Bar]]:
    """The numbers of a run and their error bars, from runs in a folder that is not kept."""
    from ..io.reader import RunFile
    from ..observables.factory import numbers_of
    from .uncertainty.study import BASE, RUNS, uncertainty

    observed = dict.fromkeys(case.expect[name].observe for name, case in one.expects.items())
    wanted = [name for name in observed if not one.case.observe[name].of_each]
    if not wanted:
        return _summaries(one.case), {}
    with tempfile.TemporaryDirectory() as folder:
        result = uncertainty(one.case.text, folder, observe=wanted, log=lambda line: None)
        with RunFile(Path(folder) / RUNS / f"{BASE}.h5") as run:
            return numbers_of(run.case, run.time, run.observables), {bar.name: bar for bar in result.bars}


def _told(held: Check, bar: Bar | None) -> str:
    """The expected and the found number, with its error bar where there is one, and what that leaves open."""
    found = f"{held.found:.6g}" if isinstance(held.found, float) else str(held.found)
    notes = [held.note] if held.note else []
    if bar is not None and bar.nothing:
        notes.append(bar.nothing)
    elif bar is not None:
        value, _, width = with_bar(bar.value, bar.bar).partition(" +- ")
        found = f"{value} +- {'' if bar.whole else 'at least '}{width}"
        if bar.bar > held.allowed:
            notes.append(f"the error bar is wider than the {held.allowed:.2g} that is allowed: finer levels may differ")
    return f"expected {held.expected}, found {found}" + (f" ({'; '.join(notes)})" if notes else "")
