"""The few unknowns q of bodies beside those of nodes, once it is known what each of them by itself does to the nodes.

With F_0 what nodes do to the fluid while bodies go on as they do, F_k what the k-th unknown adds to that by one, own_0
and own_k the same of what the bodies themselves do, and ext the loads from outside among the forces on the nodes,

    [own_k + D/tau - slope + G (F_k - ext_k) + S_k] dq = want - own_0 - D rate - G (F_0 - ext_0) - S_0

S is the part by supports of rods that have several of them (supports.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.constraints import Carried, Clamps, Prescribed


class Done(NamedTuple):
    """The part of nodes: moves, and forces that the fluid feels, (n, m), or (p, n, m) a unit of each unknown."""

    moves: np.ndarray
    felt: np.ndarray


class Supported(NamedTuple):
    """The part of supports in the balances: S_0 (p,), and by each unknown (p, p)."""

    now: np.ndarray
    by_each: np.ndarray


class Own(NamedTuple):
    """The part of bodies: their own forces on the fluid (p,), and how these follow each unknown (p, p)."""

    force: np.ndarray
    by_each: np.ndarray


def supported(clamps: Clamps, now: np.ndarray, by: np.ndarray, first: Done, each: Done) -> Supported:
    """That part, from the reactions at these supports (e, m), and (p, e, m) a unit of each unknown."""
    moments = clamps.moment + clamps.by_nodes @ first.moves.ravel()
    slope = np.einsum("pem,qem->pq", clamps.sums, by) + clamps.by_nodes @ each.moves.reshape(len(by), -1).T
    return Supported(np.einsum("pem,em->p", clamps.sums, now) + moments, slope + clamps.by_tangents)


def bordered(
    held: Prescribed,
    carried: Carried,
    parts: tuple[Done, Done, Own, Supported | None],
    y: np.ndarray,
    rate: np.ndarray,
    tau: float,
) -> tuple[np.ndarray, np.ndarray]:
    """The correction dq (p,), and the reactions (p,) on those unknowns that ``held`` gives.

    ``parts``: what nodes do first, and by each unknown, what bodies do, and supports. ``y`` (N, m) are the
    displacements so far, ``rate`` (p,) the rates of q that go with them.
    """
    (first, each, own, supports), p = parts, len(carried.by)
    loads, by_each = _outside(carried, first, each)
    matrix = own.by_each + np.diag(carried.drag) / tau - carried.slope
    matrix = matrix + carried.balance @ by_each.reshape(p, -1).T
    with np.errstate(invalid="ignore"):  # of a load that has no value, which the step tells
        short = carried.want - carried.balance @ loads.ravel() - own.force - carried.drag * rate
    if supports is not None:
        matrix, short = matrix + supports.by_each, short - supports.now
    found = carried.by[:, None] == held.at
    given = found.any(axis=1)
    whole, right = matrix.copy(), short.copy()
    whole[given] = np.eye(p)[given]
    right[given] = held.value[np.nonzero(found)[1]] - y.ravel()[carried.by[given]]
    dq = np.linalg.solve(whole, right)
    return dq, np.where(given, matrix @ dq - short, 0.0)


def _outside(carried: Carried, first: Done, each: Done) -> tuple[np.ndarray, np.ndarray]:
    """The felt forces less the loads from outside: (n, m), and (p, n, m) a unit of each unknown."""
    loaded, by_each = carried.external, each.felt - carried.external_columns.transpose(2, 0, 1)
    if carried.external_stiffness is not None:
        follows = carried.external_stiffness.times
        loaded = loaded + follows(first.moves)
        by_each = by_each - np.array([follows(x) for x in each.moves]).reshape(by_each.shape)
    return first.felt - loaded, by_each


def frozen(carried: Carried) -> Carried:
    """The same where forces stay as they are."""
    clamps = carried.clamps
    if clamps is not None:
        zero = np.zeros_like(clamps.by_tangents)
        clamps = clamps._replace(by_nodes=np.zeros_like(clamps.by_nodes), by_tangents=zero)
    columns, slope = np.zeros_like(carried.columns), np.zeros_like(carried.slope)
    still = carried._replace(columns=columns, external_columns=columns, external_stiffness=None)
    return still._replace(slope=slope, clamps=clamps)
