"""Shipped or given cases run, and their [expect] numbers held against the results: `ibfil verify`."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..case import library
from ..case.reading import differences, quick_case, read_case
from ..errors import CaseError, RunFailed
from ..observables.expectations import Check, check
from ..screen import on_terminal, tell

if TYPE_CHECKING:
    from ..case.schema import Case


@dataclass(frozen=True)
class Planned:
    """One run, and the expectations it answers, each with the case that holds its number."""

    label: str
    case: Case
    expects: dict[str, Case]


def verify(cases: Sequence[str], quick: bool, log: Callable[[str], object] = tell) -> int:
    """Run the cases (files or shipped names; none: all shipped ones) and say a line for each expectation.

    With ``quick`` each expectation is held against the quick form of its case; those whose quick forms are
    the same share a run. Returns the exit status: 0 where all were met, 1 where one was not or its run
    failed. Raises CaseError, with the faults of all the cases, before anything is run.
    """
    planned = _plan(cases, quick)
    width = max(len(f"{one.label} {name}") for one in planned for name in one.expects)
    met = total = 0
    for one in planned:
        began = clock.monotonic()
        for name, passed, message in _outcome(one):
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


def _outcome(one: Planned) -> Iterator[tuple[str, bool, str]]:
    """Run it; for each expectation its name, whether it was met, and what was expected and found."""
    from ..running.run import run

    try:
        result = run(one.case, progress=on_terminal(), log=lambda line: None)
    except RunFailed as failure:
        for name in one.expects:
            yield name, False, str(failure).replace("\n", "; ")
        return
    summaries = result.summaries
    for name, case in one.expects.items():
        held = next(held for held in check(case, summaries) if held.name == name)
        yield name, held.passed, _told(held)


def _told(held: Check) -> str:
    found = f"{held.found:.6g}" if isinstance(held.found, float) else str(held.found)
    return f"expected {held.expected}, found {found}" + (f" ({held.note})" if held.note else "")
