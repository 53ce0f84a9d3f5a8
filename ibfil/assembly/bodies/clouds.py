"""Bodies that are clouds of markers from a file, and the size of any body. Raise CaseError where a file will not do."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError

if TYPE_CHECKING:
    from ...case.bodies.body import Body
    from ...case.schema import Case

LEAST = 4
_THIN = 1e-8  # of its length, that a cloud is wide: thinner ones are a line, about which no marker resists


def cloud(case: Case, name: str, body: Body) -> np.ndarray | None:
    """The markers (k, 3) of a body in its axes, from its centre, as its file has them; None where it has none."""
    path = body.shape.file
    if path is None:
        return None
    try:
        return _read(Path(case.file).parent / path)
    except ValueError as error:
        raise CaseError([f"{case.file}: {path_key(case, name)}: {path}: {error}"]) from None


def path_key(case: Case, name: str) -> str:
    """The key of the file of a body's markers; of a copy that of the body it is of."""
    table = case.each_body[name]
    return next(f"body.{own}.shape.path" for own, body in case.bodies.items() if body is table)


def size(case: Case, name: str, body: Body) -> np.ndarray:
    """Half the extents (3,) of a body along its axes: semi-axes, or how far markers are from its centre."""
    points = cloud(case, name, body)
    return np.array(body.shape.semi_axes) if points is None else np.abs(points).max(axis=0)


def _read(path: Path) -> np.ndarray:
    """The markers of a file. Raises ValueError, with a sentence."""
    try:
        changed = path.stat().st_mtime_ns
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror})") from None
    return _checked(path, changed)


@lru_cache(maxsize=32)
def _checked(path: Path, changed: int) -> np.ndarray:
    """The same, once for each state of the file."""
    from ...shapes.points import read_table

    points = read_table(path, ("x", "y", "z"))
    if len(points) < LEAST:
        raise ValueError(f"holds {len(points)} points; at least {LEAST} markers are needed")
    bad = np.nonzero(~np.all(np.isfinite(points), axis=1))[0]
    if len(bad):
        raise ValueError(f"point {bad[0] + 1} is not finite")
    length, width, _ = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if width <= _THIN * length:
        raise ValueError("holds points along one line, about which they do not resist; some must be off it")
    points.flags.writeable = False
    return points
