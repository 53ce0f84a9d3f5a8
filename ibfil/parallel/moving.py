"""Moving arrays between process 0, which has the whole, and the processes that have planes or rows of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from .division import Division


def gathered(comm: Any, mine: np.ndarray, division: Division, axis: int) -> np.ndarray | None:
    """The whole (fields, ..) on process 0, None elsewhere, of what each has of ``axis`` (1 or 2) by the division."""
    if comm.rank:
        for field in mine:
            comm.Send(np.ascontiguousarray(field), 0)
        return None
    shape = list(mine.shape)
    shape[axis] = division.starts[-1]
    out = np.empty(shape, mine.dtype)
    for rank in range(comm.size):
        for k, to in enumerate(_part(out, division, axis, rank)):
            to[:] = mine[k] if rank == 0 else _received(comm, to, rank)
    return out


def dealt(comm: Any, whole: np.ndarray | None, mine: np.ndarray, division: Division, axis: int) -> None:
    """The way back: into ``mine`` of each process its part of the ``whole`` that process 0 has."""
    if comm.rank:
        for field in mine:
            field[:] = _received(comm, field, 0)
        return
    assert whole is not None
    for rank in range(comm.size):
        for k, field in enumerate(_part(whole, division, axis, rank)):
            if rank == 0:
                mine[k] = field
            else:
                comm.Send(np.ascontiguousarray(field, mine.dtype), rank)


def _part(whole: np.ndarray, division: Division, axis: int, rank: int) -> np.ndarray:
    return whole[(slice(None),) * axis + (division.rows(rank),)]


def _received(comm: Any, like: np.ndarray, source: int) -> np.ndarray:
    found = np.empty(like.shape, like.dtype)
    comm.Recv(found, source)
    return found
