"""From the [observe] tables of a case to its observables."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import CaseError
from .base import KINDS, Observable, Unfit
from .copies import OverCopies
from .observers import ObservableSet, Summary, summaries

if TYPE_CHECKING:
    from ..case.schema import Case


def observers(case: Case, extra: Mapping[str, Observable] | None = None) -> ObservableSet:
    """Make the observables of a case, and take in ``extra`` ones made in Python.

    Raises CaseError, a line for each observable or stop rule that asks for what its kind does not have.
    """
    from . import closed, diffusion, fitted, linked, local, of_bodies, together, windowed  # noqa: F401  (they fill KINDS)
    from .stop_rules import stop_faults

    made: dict[str, Observable] = {}
    faults: list[str] = []
    for name, observe in case.observe.items():
        try:
            made[name] = (KINDS[observe.kind] if not observe.over_copies else OverCopies)(case, observe)
        except Unfit as fault:
            faults.append(f"{case.file}: observe.{name}.{fault}")
    if not faults:
        made.update(extra or {})
        faults = stop_faults(case, made)
    if faults:
        raise CaseError(faults)
    return ObservableSet(made)


def numbers_of(case: Case, times: np.ndarray, series: Mapping[str, Any]) -> dict[str, Summary]:
    """The numbers of all observables of a case from recorded series, by name; ``series`` as a run file names them."""
    observables = observers(case).observables
    values = {name: np.asarray(series[case.observe[name].recorded(name)]) for name in observables}
    return summaries(observables, times, values)


def kinds_text() -> str:
    """The kinds of observables and their keys, for `ibfil schema`."""
    from . import closed, diffusion, fitted, linked, local, of_bodies, together, windowed  # noqa: F401  (they fill KINDS)

    lines = ["The kinds of [observe.NAME]: what each takes at an output, or of the run, and the keys it has"]
    for name, kind in KINDS.items():
        meaning = " ".join((kind.__doc__ or "").split("\n\n")[0].split()).rstrip(".")
        line = f"{name}: {meaning} ({', '.join(kind.keys)})"
        lines.append(textwrap.fill(line, 112, initial_indent="  ", subsequent_indent="      "))
    return "\n".join(lines)
