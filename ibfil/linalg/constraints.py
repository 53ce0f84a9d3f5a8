"""Prescribed (Dirichlet) unknowns of a linear system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Prescribed(NamedTuple):
    """The unknowns that are prescribed over a step: flat indices node * m + component (k,), and their y (k,)."""

    at: np.ndarray
    value: np.ndarray
