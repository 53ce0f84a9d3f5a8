"""The targets of `--for`: OBSERVABLE=1%, a share of its size, or OBSERVABLE=0.01, in its own unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CaseError
from ..uncertainty.numbers import Numbers, own

if TYPE_CHECKING:
    from ...case.schema import Case


class Target(NamedTuple):
    """The error that is allowed of an observable, a share of it where ``relative``."""

    observable: str
    error: float
    relative: bool

    def __str__(self) -> str:
        """As `--for` has it, in words."""
        return (
            f"{self.observable} to {100 * self.error:g} %" if self.relative else f"{self.observable} to {self.error:g}"
        )

    def allowed(self, numbers: Numbers) -> float:
        """The error allowed in the unit of the observable; of a vector, of its length."""
        parts = [value for key, value in numbers.items() if own(key, [self.observable]) == self.observable]
        return self.error * (float(np.linalg.norm(parts)) if self.relative else 1.0)


def target(word: str) -> Target:
    """The target in a word. Raises CaseError."""
    name, _, text = word.partition("=")
    try:
        error = float(text.removesuffix("%"))
    except ValueError:
        error = 0.0
    share = 0.01 if text.endswith("%") else 1.0
    if not name or not 0 < error < float("inf"):
        raise CaseError([f"--for: found {word}; allowed: OBSERVABLE=1% or OBSERVABLE=0.01, an error above 0"])
    return Target(name, share * error, share < 1)


def targets(words: Sequence[str], case: Case) -> tuple[Target, ...]:
    """The targets of the words, each of an observable of the case. Raises CaseError."""
    found = tuple(target(word) for word in words)
    known: Mapping[str, object] = case.observe
    strange = [one.observable for one in found if one.observable not in known]
    if not known:
        raise CaseError([f"{case.file}: [observe]: found none; allowed: at least one, a target is of a number"])
    if strange or not found:
        raise CaseError(
            [f"--for: found {', '.join(strange) or 'none'}; allowed: {', '.join(known)}, as {next(iter(known))}=1%"]
        )
    return found
