"""Segments of rods that are near each other: exact distances, and a search that costs O(N).

Each segment is put into a cell by its midpoint, cells into a hash table; two that are near are in cells side by side.
So a search costs as much as there are segments and pairs that are near, wherever they are in space.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..linalg.compiled import njit

_PARALLEL = 1e-14  # sin^2 of the angle below which two segments are parallel


class Segments(NamedTuple):
    """The segments of all filaments, k of them; lengths in the case's unit."""

    first: np.ndarray  # (k,) the node each begins at
    begin: np.ndarray  # (k,) its arclength
    end: np.ndarray  # (k,) that of the next node
    rod: np.ndarray  # (k,) number of the filament
    radius: np.ndarray  # (k,) two touch at the sum of theirs
    around: np.ndarray  # (k,) the length of the rod where it is closed, else 0


class Pairs(NamedTuple):
    """Segments that are near each other, p pairs: closest points at the fractions a of segment i and b of j."""

    i: np.ndarray  # (p,)
    j: np.ndarray  # (p,)
    a: np.ndarray  # (p,)
    b: np.ndarray  # (p,)
    gap: np.ndarray  # (p, 3) from the point of j to that of i
    distance: np.ndarray  # (p,)
    shift: np.ndarray  # (p, 3) by which j is moved to its image next to i
    looked: int  # how many pairs the search has looked at


@njit(cache=True)
def _clamp(x):
    return min(max(x, 0.0), 1.0)


@njit(cache=True)
def _ratio(x, y):
    return x / y if y > 0.0 else 0.0


@njit(cache=True)
def closest(p, u, q, shift, v, pull, gap):
    """Fractions a, b in [0, 1] of the closest points p + a u and q + shift + b v of two segments, and their distance.

    ``gap`` (3,) becomes the vector between them, to the first. Exact for ``pull`` = 0: where the closest points of the
    two lines are not on the segments, one is an end of a segment. A segment may be a point. On parallel segments many
    points are closest, and the least turn moves the closest from end to end: with ``pull`` (of order 0.01) least is
    |gap|^2 + pull [|u|^2 (a - 1/2)^2 + |v|^2 (b - 1/2)^2], the points are drawn to the middles and move smoothly.
    """
    x = np.empty(3)
    uu, uv, vv, du, dv = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        x[c] = p[c] - q[c] - shift[c]
        uu, uv, vv = uu + u[c] * u[c], uv + u[c] * v[c], vv + v[c] * v[c]
        du, dv = du - u[c] * x[c], dv + v[c] * x[c]
    # Least where  ku a - uv b = du  and  kv b - uv a = dv, if that is on both segments; else on the rim of the square.
    ku, kv, du, dv = (1.0 + pull) * uu, (1.0 + pull) * vv, du + 0.5 * pull * uu, dv + 0.5 * pull * vv
    across, inside, a, b = ku * kv - uv * uv, False, 0.0, 0.0
    if across > _PARALLEL * uu * vv:
        a, b = (kv * du + uv * dv) / across, (ku * dv + uv * du) / across
        inside = 0.0 <= a <= 1.0 and 0.0 <= b <= 1.0
    if not inside:
        a, b = _on_rim(ku, kv, uv, du, dv)
    square = 0.0
    for c in range(3):
        gap[c] = x[c] + a * u[c] - b * v[c]
        square += gap[c] * gap[c]
    return a, b, np.sqrt(square)


@njit(cache=True)
def _on_rim(ku, kv, uv, du, dv):
    """Where ku a^2/2 + kv b^2/2 - uv a b - du a - dv b is least on the rim of the unit square."""
    rim = (
        (0.0, _clamp(_ratio(dv, kv))),
        (1.0, _clamp(_ratio(dv + uv, kv))),
        (_clamp(_ratio(du, ku)), 0.0),
        (_clamp(_ratio(du + uv, ku)), 1.0),
    )
    best, least = 0, np.inf
    for k in range(4):
        a, b = rim[k]
        value = 0.5 * (ku * a * a + kv * b * b) - uv * a * b - du * a - dv * b
        if value < least:
            best, least = k, value
    return rim[best]


@njit(cache=True)
def _key(x, y, z, mask):
    """The place of a cell in the hash table."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & mask


@njit(cache=True)
def _cells(middle, size, box):
    """Each midpoint's cell (k, 3), and the number of cells (3,) along periodic axes (0 along open ones)."""
    count, side = np.zeros(3, np.int64), np.full(3, size)
    for c in range(3):
        if box[c] > 0.0:
            count[c] = max(1, int(box[c] / size))
            side[c] = box[c] / count[c]
    cell = np.empty(middle.shape, np.int64)
    for k in range(middle.shape[0]):
        for c in range(3):
            cell[k, c] = int(np.floor(middle[k, c] / side[c]))
            if count[c] > 0:
                cell[k, c] %= count[c]
    return cell, count


@njit(cache=True)
def _beside(x, step, count):
    """The cell ``step`` = -1, 0, 1 further along an axis, and whether it is not there twice (few cells in a box)."""
    if count == 0:
        return x + step, True
    return (x + step) % count, step == 0 or count > 2 or (step == 1 and count == 2)


@njit(cache=True)
def _near(segments: Segments, r, u, middle, half, i, j, box, factor, margin, row):
    """Whether segments i and j are near; fills ``row`` (11,): i, j, a, b, distance, gap, shift."""
    touch = segments.radius[i] + segments.radius[j]
    square, moved = 0.0, False
    for c in range(3):
        d = middle[i, c] - middle[j, c]
        shift = box[c] * np.floor(d / box[c] + 0.5) if box[c] > 0.0 else 0.0
        moved = moved or shift != 0.0
        square += (d - shift) ** 2
        row[8 + c] = shift
    reach = factor * touch + margin
    if not square <= (half[i] + half[j] + reach) ** 2:
        return False
    if segments.rod[i] == segments.rod[j] and not moved:
        between = max(segments.begin[i], segments.begin[j]) - min(segments.end[i], segments.end[j])
        if segments.around[i] > 0.0:  # the other way round a closed rod
            widest = max(segments.end[i], segments.end[j]) - min(segments.begin[i], segments.begin[j])
            between = min(between, segments.around[i] - widest)
        if between < np.pi * touch:
            return False
    row[0], row[1] = i, j
    row[2], row[3], row[4] = closest(r[segments.first[i]], u[i], r[segments.first[j]], row[8:], u[j], 0.0, row[5:])
    return row[4] < reach


@njit(cache=True)
def _search(segments: Segments, r, box, factor, margin, rows):
    """Fills ``rows`` (.., 11) with the pairs that are near, as far as it goes; their number, and of those looked at."""
    k = segments.first.size
    u, middle, half, row = np.empty((k, 3)), np.empty((k, 3)), np.empty(k), np.empty(11)
    for n in range(k):
        p, square = segments.first[n], 0.0
        for c in range(3):
            u[n, c] = r[p + 1, c] - r[p, c]
            middle[n, c] = r[p, c] + 0.5 * u[n, c]
            square += u[n, c] * u[n, c]
        half[n] = 0.5 * np.sqrt(square)
    cell, count = _cells(middle, 2 * np.max(half) + 2 * factor * np.max(segments.radius) + margin, box)
    mask = 1
    while mask < 2 * k:
        mask = 2 * mask + 1
    head, following = np.full(mask + 1, -1, np.int64), np.empty(k, np.int64)
    found, looked = 0, 0
    for i in range(k):
        for step in range(27):
            x, new_x = _beside(cell[i, 0], step // 9 - 1, count[0])
            y, new_y = _beside(cell[i, 1], step // 3 % 3 - 1, count[1])
            z, new_z = _beside(cell[i, 2], step % 3 - 1, count[2])
            j = head[_key(x, y, z, mask)] if new_x and new_y and new_z else -1
            while j >= 0:
                looked += 1
                here = cell[j, 0] == x and cell[j, 1] == y and cell[j, 2] == z
                if here and _near(segments, r, u, middle, half, i, j, box, factor, margin, row):
                    for c in range(11 if found < rows.shape[0] else 0):
                        rows[found, c] = row[c]
                    found += 1
                j = following[j]
        place = _key(cell[i, 0], cell[i, 1], cell[i, 2], mask)
        following[i], head[place] = head[place], i
    return found, looked


def search(segments: Segments, r: np.ndarray, box: np.ndarray, factor: float, margin: float) -> Pairs:
    """All pairs nearer than ``factor`` times their distance of contact and ``margin``, each once; neighbours left out.

    ``r`` (n, 3) are the nodes, ``box`` (3,) the sides of the periodic box, 0 along open axes; the nearest image counts.
    """
    rows = np.empty((len(segments.first), 11))
    found, looked = _search(segments, r, box, factor, margin, rows)
    if found > len(rows):
        rows = np.empty((found, 11))
        _search(segments, r, box, factor, margin, rows)
    rows = rows[:found]
    i, j = rows[:, :2].astype(np.int64).T
    return Pairs(i, j, rows[:, 2], rows[:, 3], rows[:, 5:8], rows[:, 4], rows[:, 8:], looked)
