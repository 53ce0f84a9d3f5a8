"""Streamlines in a plane, evenly apart, for pictures.

By matplotlib: vtkEvenlySpacedStreamlines2D reads past its arrays where lines run into a stagnation point, and takes
the process with it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

_MASK = 30  # cells of matplotlib's mask a side at density 1: no two lines pass one cell


def evenly_spaced(x: np.ndarray, y: np.ndarray, u: np.ndarray, v: np.ndarray, apart: float) -> list[np.ndarray]:
    """Lines, each (k, 2) with its points in the order of the flow (``u``, ``v``), both (n, m), about ``apart`` apart.

    ``x`` (n,) and ``y`` (m,) are evenly spaced. No two points that follow each other are the same.
    """
    from matplotlib.figure import Figure

    if not np.any(u) and not np.any(v):
        return []
    density = (np.ptp(x) / apart / _MASK, np.ptp(y) / apart / _MASK)
    drawn = Figure().add_subplot().streamplot(x, y, u.T, v.T, density=density, maxlength=8.0, arrowstyle="-")
    return _joined([np.asarray(piece) for piece in drawn.lines.get_segments()])


def _joined(pieces: list[np.ndarray]) -> list[np.ndarray]:
    """Pieces that begin where the one before ends, as one."""
    if not pieces:
        return []
    cuts = [i for i, (a, b) in enumerate(pairwise(pieces), 1) if not np.array_equal(a[-1], b[0])]
    lines = (
        np.vstack([pieces[start][:1], *(piece[1:] for piece in pieces[start:end])])
        for start, end in pairwise([0, *cuts, len(pieces)])
    )
    return [_once_round(line[np.append(True, np.any(np.diff(line, axis=0) != 0.0, axis=1))]) for line in lines]


def _once_round(line: np.ndarray) -> np.ndarray:
    """The line until it has turned by a whole turn: about a vortex it would wind on."""
    step = np.diff(line, axis=0)
    turned = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    beyond = np.nonzero(np.abs(turned - turned[:1]) > 2 * np.pi)[0]
    return line[: beyond[0] + 1] if len(beyond) else line
