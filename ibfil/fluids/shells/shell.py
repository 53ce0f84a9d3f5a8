"""The markers of bodies: where they are, and how they move with the bodies' unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...rods.linearization import cross


@dataclass(frozen=True)
class Shells:
    """The markers of bodies in their axes, (k, 3) a body and none of a joint; their rows come after ``nodes`` rows.

    ``length`` is what turns are taken times (bodies/rows.py).
    """

    nodes: int
    markers: Sequence[np.ndarray]
    length: float

    @cached_property
    def count(self) -> int:
        """How many markers there are."""
        return sum(len(points) for points in self.markers)

    def unknowns(self, rows: int) -> int:
        """How many unknowns bodies and motors have, where arrays have so many rows."""
        return 3 * (self.end - self.nodes) + rows - self.end

    @property
    def end(self) -> int:
        """The row after those of bodies."""
        return self.nodes + 2 * len(self.markers)

    def places(self, r: np.ndarray, e3: np.ndarray) -> np.ndarray:
        """Where the markers are (k, 3), from places and tangents (N, 3) of all rows."""
        return np.concatenate(self.clouds(r, e3))

    def clouds(self, r: np.ndarray, e3: np.ndarray) -> list[np.ndarray]:
        """The same, (k, 3) a body."""
        return [r[self.nodes : self.end : 2][b] + arms for b, arms in enumerate(self._arms(e3))]

    def levers(self, e3: np.ndarray, p: int) -> np.ndarray:
        """How markers move (3 k, p) with the unknowns q: [1, -(x - X) x /length] for the body that they are of."""
        out, first = np.zeros((self.count, 3, p)), 0
        for b, arms in enumerate(self._arms(e3)):
            here = slice(first, first + len(arms))
            out[here, :, 6 * b : 6 * b + 3] = np.eye(3)
            x, y, z = arms.T / self.length
            turns = out[here, :, 6 * b + 3 : 6 * b + 6]
            turns[:, 0, 1], turns[:, 0, 2], turns[:, 1, 2] = z, -y, x
            turns[:, 1, 0], turns[:, 2, 0], turns[:, 2, 1] = -z, y, -x
            first += len(arms)
        return out.reshape(3 * self.count, p)

    def _arms(self, e3: np.ndarray) -> list[np.ndarray]:
        """The markers from their body's centre, (k, 3) a body, in the lab."""
        third, first = e3[self.nodes : self.end : 2], e3[self.nodes + 1 : self.end : 2]
        axes = np.stack([first, cross(third, first), third], axis=1)
        return [points @ turned for points, turned in zip(self.markers, axes, strict=True)]

    def in_rows(self, q: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """Numbers (p,) of the unknowns in the rows after the nodes, of an array of that shape (N, m)."""
        out, bodies = np.zeros((shape[0] - self.nodes, shape[1])), 2 * len(self.markers)
        out[:bodies, :3] = q[: 3 * bodies].reshape(bodies, 3)
        out[bodies:, 0] = q[3 * bodies :]
        return out

    def of_rows(self, x: np.ndarray) -> np.ndarray:
        """The inverse: (p,) from an array (N, m)."""
        return np.concatenate([x[self.nodes : self.end, :3].ravel(), x[self.end :, 0]])
