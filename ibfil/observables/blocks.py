"""Standard errors of means of one correlated series, from blocks of it (Flyvbjerg & Petersen 1989).

The error of a mean of B blocks is their scatter over sqrt(B), if blocks know nothing of each other. They are made
longer until that is so: of blocks with n of N outputs each, the first with n^3 > 2 N (error/error of single outputs)^4
(Lee, Needs, Towler & Drummond 2011), which weighs what longer blocks still gain against their own scatter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

FEWEST = 8  # blocks; fewer tell an error to worse than a quarter of itself

Blocks = Callable[[np.ndarray], np.ndarray]  # edges (B + 1,) of blocks in time -> the number of each (B,) or (B, 3)


class StandardError(NamedTuple):
    """A standard error () or (3,); ``settled`` is False where the series remembers too long for it to be told well."""

    value: np.ndarray
    settled: bool


def standard_error(of_blocks: Blocks, outputs: int, start: float, end: float) -> StandardError | None:
    """The error of the mean from ``start`` to ``end``, in which so many outputs are; None with too few of them."""
    counts = []
    count = outputs - 1
    while count >= FEWEST:
        counts.append(count)
        count //= 2
    if not counts:
        return None
    errors = [_scatter(of_blocks(np.linspace(start, end, count + 1))) for count in counts]
    single = np.where(errors[0] > 0, errors[0], 1.0)
    for count, error in zip(counts, errors, strict=True):
        if np.all((counts[0] / count) ** 3 > 2 * counts[0] * (error / single) ** 4):
            return StandardError(error, True)
    return StandardError(np.max(errors, axis=0), False)


def _scatter(values: np.ndarray) -> np.ndarray:
    return np.std(values, axis=0, ddof=1) / np.sqrt(len(values))


def means_of_blocks(times: np.ndarray, values: np.ndarray) -> Blocks:
    """The time means of the broken line through the outputs, between edges."""
    columns = values.reshape(len(times), -1)
    whole = np.concatenate([np.zeros((1, columns.shape[1])), _areas(times, columns).cumsum(axis=0)])

    def of(edges: np.ndarray) -> np.ndarray:
        before = np.clip(np.searchsorted(times, edges, side="right") - 1, 0, len(times) - 1)
        here = np.stack([np.interp(edges, times, column) for column in columns.T], axis=1)
        part = 0.5 * (here + columns[before]) * (edges - times[before])[:, None]
        area = np.diff(whole[before] + part, axis=0) / np.diff(edges)[:, None]
        return area.reshape(len(area), *values.shape[1:])

    return of


def _areas(times: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """The integral of each interval."""
    return 0.5 * (columns[1:] + columns[:-1]) * np.diff(times)[:, None]


def rates_of_blocks(times: np.ndarray, values: np.ndarray) -> Blocks:
    """The changes of the broken line through the outputs, per time, between edges."""
    columns = values.reshape(len(times), -1)

    def of(edges: np.ndarray) -> np.ndarray:
        here = np.stack([np.interp(edges, times, column) for column in columns.T], axis=1)
        change = np.diff(here, axis=0) / np.diff(edges)[:, None]
        return change.reshape(len(change), *values.shape[1:])

    return of
