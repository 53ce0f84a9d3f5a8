"""Filaments in a periodic box: cut where they cross its faces, each part shown where it lies in the box."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Pieces(NamedTuple):
    """Parts of a filament, one after the other, by points at nodes and between them."""

    station: np.ndarray  # (m,) number of the node, with a fraction between two
    image: np.ndarray  # (m, 3) which box each point lies in
    lengths: list[int]  # points of each part

    def take(self, values: np.ndarray) -> np.ndarray:
        """Values (m, ...) at the points, linear between nodal ``values`` (N, ...)."""
        low = np.minimum(self.station.astype(int), len(values) - 1)
        high = np.minimum(low + 1, len(values) - 1)
        part = (self.station - low).reshape(-1, *[1] * (values.ndim - 1))
        between = (1.0 - part) * values[low] + part * values[high]
        return np.where(part == 0.0, values[low], between)


def unwrapped(count: int) -> Pieces:
    """A filament of ``count`` nodes as it is."""
    return Pieces(np.arange(float(count)), np.zeros((count, 3)), [count])


def wrapped(r: np.ndarray, origin: np.ndarray, box: np.ndarray) -> Pieces:
    """The filament r (N, 3) cut at the faces of the box, with a point on each side of a cut."""
    location = (r - origin) / box
    stations = np.unique(np.concatenate([np.arange(float(len(r))), _crossings(location)]))
    middle = 0.5 * (stations[:-1] + stations[1:])
    low = middle.astype(int)
    part = (middle - low)[:, None]
    image = np.floor((1.0 - part) * location[low] + part * location[low + 1])
    cuts = np.nonzero(np.any(np.diff(image, axis=0) != 0, axis=1))[0] + 1
    points, images, lengths = [], [], []
    for piece in np.split(np.arange(len(middle)), cuts):
        points.append(stations[piece[0] : piece[-1] + 2])
        lengths.append(len(points[-1]))
        images.append(np.tile(image[piece[0]], (lengths[-1], 1)))
    return Pieces(np.concatenate(points), np.concatenate(images), lengths)


def _crossings(location: np.ndarray) -> np.ndarray:
    """Where segments cross whole numbers of ``location`` (N, 3): node numbers with fractions."""
    found = []
    for axis in range(3):
        x = location[:, axis]
        for i in np.nonzero(np.floor(x[:-1]) != np.floor(x[1:]))[0]:
            low, high = sorted((x[i], x[i + 1]))
            faces = np.arange(np.ceil(low), np.floor(high) + 1)
            found.append(i + (faces - x[i]) / (x[i + 1] - x[i]))
    return np.concatenate(found) if found else np.empty(0)
