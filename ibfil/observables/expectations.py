"""Holding a result against the [expect] numbers of its case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .base import Value
from .observers import Summary

if TYPE_CHECKING:
    from ..case.observe import Expect
    from ..case.schema import Case


@dataclass(frozen=True)
class Check:
    """One expectation and what was found.

    ``error`` is relative where the tolerance is, absolute where standard errors decide, the distance from a range, NaN
    where there is no number.
    """

    name: str
    observe: str
    expected: str
    found: Value
    error: float
    allowed: float  # the distance from what is expected that is allowed, in units of the number
    passed: bool
    source: str
    note: str = ""

    def __repr__(self) -> str:
        found = np.array2string(np.asarray(self.found), precision=6)
        held = "passed" if self.passed else "failed"
        return f"<{held}: {self.observe} = {found}, expected {self.expected}{'; ' * bool(self.note)}{self.note}>"

    def line(self) -> str:
        """One line for the user."""
        found = f"{self.found:.6g}" if isinstance(self.found, float) else str(self.found)
        source = f" ({self.source})" if self.source else ""
        note = f"; {self.note}" if self.note else ""
        word = "ok  " if self.passed else "FAIL"
        return f"{word} {self.name}: {found}, expected {self.expected}{source}{note}"


def check(case: Case, summaries: Mapping[str, Summary]) -> list[Check]:
    """Hold every expectation of the case against the summaries of its run.

    A value that is not one finite number, or covers only a part of its window, has not passed.
    """
    return [_check(name, expect, summaries[expect.observe]) for name, expect in case.expect.items()]


def _check(name: str, expect: Expect, summary: Summary) -> Check:
    note = summary.note
    if isinstance(summary.value, np.ndarray):
        note = f"{expect.observe} is a vector; give it `along`"
        found = float("nan")
    else:
        found = summary.value
    error, allowed, expected = _judged(expect, found)
    if expect.standard_errors is not None:
        allowed, expected, doubt = _by_errors(expect, summary, allowed)
        error, note = abs(found - float(expect.value or 0.0)), "; ".join(filter(None, (note, doubt)))
    passed = bool(error <= allowed) and not note
    width = _width(expect, allowed)
    return Check(name, expect.observe, expected, summary.value, error, width, passed, expect.source, note)


def _width(expect: Expect, allowed: float) -> float:
    """The distance that is allowed, in units of the number; of a range half of it."""
    if expect.range is not None:
        return 0.5 * (expect.range[1] - expect.range[0])
    relative = expect.absolute is None and expect.standard_errors is None
    return allowed * abs(expect.value) if relative and expect.value else allowed


def _by_errors(expect: Expect, summary: Summary, widest: float) -> tuple[float, str, str]:
    """The distance allowed by standard errors, the same in words, and why it does not count; ``widest``: their most."""
    assert expect.standard_errors is not None
    assert expect.value is not None
    times = f"{expect.standard_errors:g} standard errors"
    if summary.error is None or isinstance(summary.error, np.ndarray):
        return 0.0, f"{expect.value:.6g} +- {times}", "it has no standard error: a mean, drift or diffusion has one"
    allowed = expect.standard_errors * summary.error
    words = f"{expect.value:.6g} +- {allowed:.2g} ({times})"
    if expect.tolerance is not None:
        widest *= abs(expect.value) if expect.value else 1.0
    if allowed > widest:
        return (
            allowed,
            words,
            f"{times} are {allowed:.2g}, above the {widest:.2g} that the case allows: run it for longer",
        )
    return allowed, words, summary.doubt


def _judged(expect: Expect, found: float) -> tuple[float, float, str]:
    """Return the error (NaN where ``found`` is not finite), that allowed, and what was expected in words."""
    if expect.range is not None:
        low, high = expect.range
        error, allowed, words = max(low - found, found - high, 0.0), 0.0, f"{low:.6g} to {high:.6g}"
    else:
        assert expect.value is not None  # the schema wants one of the two
        error = abs(found - expect.value)
        if expect.absolute is not None:
            allowed, words = expect.absolute, f"{expect.value:.6g} +- {expect.absolute:.6g}"
        else:
            # Filled in by parse_case, but where standard errors decide: no bound then.
            allowed = np.inf if expect.tolerance is None else expect.tolerance
            words = f"{expect.value:.6g} +- {100 * allowed:.3g} %"
            error = error / abs(expect.value) if expect.value else error
    return (error if np.isfinite(found) else float("nan")), allowed, words
