"""The results of `ibfil fit`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from .data import Data
    from .intervals import Spread
    from .residuals import Seen

Errors = dict[str, "np.ndarray | str"]  # of step and nodes: (p,) as in the search, or why it is not known
_UNSETTLED = 1.0  # half-width over value
_TIED = 0.9  # correlation


@dataclass(frozen=True)
class Parameter:
    """A key that is varied between ``low`` and ``high``, by its logarithm where both are above 0."""

    key: str
    low: float
    high: float

    @property
    def by_log(self) -> bool:
        """Whether steps, intervals and directions are relative."""
        return self.low > 0

    def inner(self, value: float) -> float:
        """The variable of the search: the logarithm, or the value in units of the range."""
        return math.log(value) if self.by_log else value / (self.high - self.low)

    def outer(self, inner: float) -> float:
        """The value, within the bounds."""
        value = math.exp(inner) if self.by_log else inner * (self.high - self.low)
        return float(min(max(value, self.low), self.high))


@dataclass(frozen=True)
class Fitted:
    """A parameter, its value, its 95 % interval (None at a bound), and what is said of it."""

    parameter: Parameter
    value: float
    interval: tuple[float, float] | None
    word: str

    @property
    def half_width(self) -> float | None:
        """Half the interval over the value; None without an interval."""
        if self.interval is None or self.value == 0:
            return None
        return 0.5 * (self.interval[1] - self.interval[0]) / abs(self.value)


@dataclass(frozen=True)
class Fit:
    """A fit: its parameters, how far the run remains from the data, and what the data leave open."""

    title: str
    parameters: tuple[Fitted, ...]
    spread: Spread
    singular: np.ndarray  # (p,) of the Jacobian in relative changes
    tied: tuple[str, ...]  # directions and pairs that the data do not settle
    rms: float | None  # of points, in units of length
    length: float  # the filaments', the longest
    remembered: float  # frames
    data: Data | None
    seen: list[Seen]
    observables: dict[str, tuple[float, float, float]]  # measured, its error, the run's
    runs: int
    numerical: Errors  # of the parameters, from step and nodes
    converged: bool
    unit: str
    time_unit: str
    notes: tuple[str, ...]
    about: dict[str, Any] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """The values by key."""
        return {one.parameter.key: one.value for one in self.parameters}


def fitted(parameter: Parameter, inner: float, half: float) -> Fitted:
    """A parameter with its interval, from where it was found and its half-width there."""
    value = parameter.outer(inner)
    slack = 1e-5 * (parameter.inner(parameter.high) - parameter.inner(parameter.low))
    for bound, name in ((parameter.low, "lower"), (parameter.high, "upper")):
        if abs(inner - parameter.inner(bound)) <= slack:
            return Fitted(parameter, value, None, f"at its {name} bound: no interval; wider bounds, or other data")
    scale = 1.0 if parameter.by_log else parameter.high - parameter.low
    low, high = (math.exp(min(inner + sign * half, 700.0)) if parameter.by_log else value + sign * half * scale
                 for sign in (-1, 1))  # fmt: skip
    wide = 0.5 * (high - low) > _UNSETTLED * abs(value) if parameter.by_log else half > 1.0
    if wide:  # what is known is the bounds
        low, high = max(low, parameter.low), min(high, parameter.high)
    return Fitted(parameter, value, (low, high), "not determined by these data" if wide else "")


def tied(parameters: list[Parameter], spread: Spread, sizes: np.ndarray, direction: np.ndarray) -> list[str]:
    """The directions that the data do not settle, in words: the weakest direction, and pairs that go together."""
    names = [one.key for one in parameters]
    out = []
    if len(names) > 1 and sizes[-1] < 1e-2 * sizes[0]:
        strong = [i for i in range(len(names)) if abs(direction[i]) > 0.2]
        if len(strong) > 1:
            product = " ".join(f"{names[i]}^{direction[i]:.2g}" for i in strong)
            ratio = sizes[0] / max(float(sizes[-1]), 1e-300)
            how = f"{ratio:.2g} times less settled than what they settle best" if ratio < 1e6 else "free"
            out.append(f"the data hardly tell {' and '.join(names[i] for i in strong)} apart: {product} is {how}")
    correlation = spread.correlation
    for i, one in enumerate(names):
        for j in range(i):
            if abs(correlation[i, j]) > _TIED:
                out.append(f"{names[j]} and {one}: correlation {correlation[i, j]:+.3f}")
    return out
