"""Unknowns of a linear system that are prescribed (Dirichlet), or follow a few others: those of bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .stiffness import Stiffness


class Clamps(NamedTuple):
    """The part of balances by supports of rods with several of them, by their reactions R (e, m), linear in a step:

    sums R + moment + by_nodes d + by_tangents dq
    """

    nodes: np.ndarray  # (e,)
    sums: np.ndarray  # (p, e, m)
    moment: np.ndarray  # (p,)
    by_nodes: np.ndarray  # (p, n m)
    by_tangents: np.ndarray  # (p, p)


class Carried(NamedTuple):
    """Unknowns that bodies carry, and the balances that the bodies' own unknowns q (p,) obey; n nodes, N rows.

    In a linear step the carried unknowns move by value + lever dq, forces on nodes change by ``columns`` dq too, and

        balance (F - external) + own drag + drag rate = want + slope dq
    """

    at: np.ndarray  # (k,) flat indices of the carried unknowns
    value: np.ndarray  # (k,) how far each still is from where q has it
    lever: np.ndarray  # (k, p)
    by: np.ndarray  # (p,) flat indices of q, in the rows after the nodes
    columns: np.ndarray  # (n, m, p)
    balance: np.ndarray  # (p, n m)
    external: np.ndarray  # (n, m) the loads within the forces on the nodes
    external_stiffness: Stiffness | None  # of these loads; None: they follow nothing
    external_columns: np.ndarray  # (n, m, p)
    want: np.ndarray  # (p,)
    slope: np.ndarray  # (p, p)
    drag: np.ndarray  # (p,) against the rates of q, besides the fluid's
    clamps: Clamps | None = None  # of bodies whose rods have other supports too


class Prescribed(NamedTuple):
    """The unknowns that are prescribed over a step: flat indices node * m + component (k,), and their y (k,).

    ``carried``: those that follow the unknowns of bodies; None where there are none.
    """

    at: np.ndarray
    value: np.ndarray
    carried: Carried | None = None
