"""Holding a result against the [expect] numbers of its case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .base import Value
from .observers import Summary

if TYPE_CHECKING:
    from ..case.schema import Case, Expect


@dataclass(frozen=True)
class Check:
    """One expectation and what was found.

    ``error`` is relative where the tolerance is, the distance from a range, NaN where there is no number.
    """

    name: str
    observe: str
    expected: str
    found: Value
    error: float
    passed: bool
    source: str
    note: str = ""

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
    passed = bool(error <= allowed) and not note
    return Check(name, expect.observe, expected, summary.value, error, passed, expect.source, note)


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
            assert expect.tolerance is not None  # filled in by parse_case
            allowed, words = expect.tolerance, f"{expect.value:.6g} +- {100 * expect.tolerance:.3g} %"
            error = error / abs(expect.value) if expect.value else error
    return (error if np.isfinite(found) else float("nan")), allowed, words
