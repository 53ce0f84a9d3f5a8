"""The error of a number from the same number at three levels of resolution: one rule for all studies.

Three values f1, f2, f3 at sizes h1 > h2 > h3 (steps taken, 1/(N - 1), ...), d1 = f1 - f2, d2 = f2 - f3. With f = f0 +
C h^p the observed order p solves

    (h1^p - h2^p)/(h2^p - h3^p) = d1/d2

and the limit is ext(q) = f3 - d2 h3^q/(h2^q - h3^q) for an order q. The error is signed and that of the value f asked
for, the first one or the second. How well it is known, its doubt u, depends on what the values show:

    word           when                                          error                  doubt
    round-off      both distances below 1e-8 of the value        0                      1e-8 of it + the larger one
    levels alike   sizes that differ by less than 5 %            f - f3                 twice the larger distance
    seen           0.65 p0 <= p <= 1.4 p0, p0 the nominal order  f - ext(min(p, p0))    a quarter of the error
    fast           p > 1.4 p0                                    f - ext(p0)            half of |f - f3|
    low            0.3 < p < 0.65 p0                             f - ext(p)             half of the error
    unseen         else                                          f - f3                 twice the larger distance

Errors of independent sources add with their signs, and their doubts as squares: the corrected value is f - sum e with
a bar of sqrt(sum u^2); the bar of the run as it is |sum e| + sqrt(sum u^2).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

ROUND_OFF = 1e-8  # of the value: distances that no refinement needs to lessen
ALIKE = 0.05  # sizes that differ by less are one level
ORDERS = (-3.0, 8.0)  # between which an order is looked for
SEEN, FAST = 0.65, 1.4  # of the nominal order
LOW = 0.3  # an order itself
_HALVINGS = 46  # of the distance between ORDERS: 11 to 2e-13


@dataclass(frozen=True)
class Estimate:
    """The error of a number from one source: its ``error``, signed, the ``doubt`` of that, the observed ``order``.

    ``order`` is None where there is none, ``word`` says what the levels show, ``values`` and ``sizes`` are theirs.
    """

    error: float
    doubt: float
    order: float | None
    word: str
    values: tuple[float, ...] = ()
    sizes: tuple[float, ...] = ()

    @property
    def settled(self) -> bool:
        """Whether finer levels would tell no more: the order is seen, or there is nothing left but round-off."""
        return self.word in ("seen", "round-off")


def observed_order(values: Sequence[float], sizes: Sequence[float]) -> float | None:
    """p of f0 + C h^p through three values; None where distances change their sign or no p between ORDERS fits."""
    d1, d2 = values[0] - values[1], values[1] - values[2]
    if d1 * d2 <= 0:
        return None
    a, b = float(np.log(sizes[0] / sizes[1])), float(np.log(sizes[2] / sizes[1]))
    wanted = d1 / d2

    def off(p: float) -> float:
        # (h1^p - h2^p)/(h2^p - h3^p) over h2^p, whose limit at p = 0 is a/-b.
        top, bottom = np.expm1(p * a), -np.expm1(p * b)
        return (top / bottom if abs(p) > 1e-12 else -a / b) - wanted

    low, high = ORDERS
    below = off(low) > 0
    if below == (off(high) > 0):
        return None
    for _ in range(_HALVINGS):  # by hand: to load scipy.optimize takes far longer than this rule
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (off(middle) > 0) == below else (low, middle)
    return 0.5 * (low + high)


def limit(values: Sequence[float], sizes: Sequence[float], order: float) -> float:
    """The value at size zero, from the last two levels and an order."""
    (h2, h3), d2 = sizes[1:], values[1] - values[2]
    ratio = (h3 / h2) ** order
    return float(values[2] - d2 * ratio / (1.0 - ratio))


def estimate(
    values: Sequence[float], sizes: Sequence[float], nominal: float, level: int = 0, scale: float | None = None
) -> Estimate:
    """The estimate of the error of ``values[level]`` from three values at falling sizes; ``nominal`` is the order p0.

    ``scale`` is what round-off is measured by, the size of the values by default. Raises ValueError for other than
    three levels, or sizes that do not fall.
    """
    if len(values) != 3 or len(sizes) != 3 or not sizes[0] >= sizes[1] >= sizes[2] > 0:
        raise ValueError(f"found values {values} at sizes {sizes}; allowed: three, at sizes that fall")
    kept = tuple(float(v) for v in values), tuple(float(h) for h in sizes)
    size = max(abs(v) for v in values) if scale is None else scale
    largest = max(abs(values[0] - values[1]), abs(values[1] - values[2]))
    if not np.isfinite(largest):
        return Estimate(float("nan"), float("inf"), None, "unseen", *kept)
    if largest <= ROUND_OFF * size:
        return Estimate(0.0, ROUND_OFF * size + largest, None, "round-off", *kept)
    left = float(values[level] - values[2])
    if sizes[0] < (1 + ALIKE) * sizes[1] or sizes[1] < (1 + ALIKE) * sizes[2]:
        return Estimate(left, 2 * largest, None, "levels alike", *kept)
    p = observed_order(values, sizes)
    if p is None or p <= LOW:
        return Estimate(left, 2 * largest, p, "unseen", *kept)
    if p > FAST * nominal:
        return Estimate(values[level] - limit(values, sizes, nominal), 0.5 * abs(left), p, "fast", *kept)
    low = p < SEEN * nominal
    error = values[level] - limit(values, sizes, p if low else min(p, nominal))
    return Estimate(error, (0.5 if low else 0.25) * abs(error), p, "low" if low else "seen", *kept)


def combined(estimates: Iterable[Estimate]) -> tuple[float, float]:
    """The error of several sources together, signed, and its doubt."""
    errors, squares = 0.0, 0.0
    for one in estimates:
        errors, squares = errors + one.error, squares + one.doubt**2
    return errors, float(np.sqrt(squares))
