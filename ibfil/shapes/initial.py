"""The shape a filament starts in: its nodes' arclength, positions and first directors, from the case."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..case.shape import Circle, ExpressionShape, FileShape, Helix, Relaxed, RunShape, Shape, Straight
from ..case.spacing import Values, node_arclength, values_along
from ..errors import CaseError
from .curves import Curve, curve_from_formula, curve_from_strains, derivative, integrate_frame, unit
from .placing import place
from .points import curve_from_points, read_points

if TYPE_CHECKING:
    from ..case.expressions import Expression
    from ..case.filament import Filament
    from ..case.shape import Noise


_MOST_TURN = 0.5  # of e1 from node to node, of a closed rod
Settle = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]  # r, e1 of a curve -> of nodes at rest


def initial_shape(
    filament: Filament, key: str = "filament", folder: str | Path = ".", settle: Settle | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Positions r (N, 3), in the case's length, and unit directors e1 (N, 3) at t = 0, in the lab frame.

    The shape's own curve and frame are placed (placing.py), then e1 is turned about e3 by the
    integral of ``twist`` from s = 0, then ``perturb`` and ``noise`` are added to r. e1 is normal to the
    tangent of the placed curve; the tangents of stencils, on perturbed nodes, differ, so who has them
    calls ``curves.perpendicular``. A curve bent by kappa1 alone has e1 = ``normal``, with the same bits
    at every node.

    Kinds, in their own frame (O1, O2, O3):

    * straight: (0, 0, 0).
    * relaxed: (kappa1, kappa2, tau0) at t = 0, so the rod starts without moment; ``settle`` makes its nodes rest, and
      those of a helix or circle that has the preferred strains.
    * helix: (k, 0, t), the frame of the relaxed rod with curvature [k, 0] and twist_rate t: e1 is the
      binormal, -e2 points to the axis. k = R/(R^2 + p^2), t = p/(R^2 + p^2), p = pitch/2 pi; t < 0 for a
      left hand.
    * circle: (curvature, 0, 0), an arc of at most one turn that bends to the left seen from the tip of e1.
    * expression: nodes at r(s), also where |dr/ds| is not 1: the rod then starts stretched
      (``stretch_warning``); e1 without twist.
    * file: points in the file (points.py), relative to ``folder``.
    * run: as the filament of the same name, which ``key`` ends with, stood in a run (``shape_from_run``), relative to
      ``folder``; it is not placed again.

    Raises CaseError, one line beginning with ``key``, where the shape cannot be made.
    """
    s = node_arclength(filament, key)
    curve = _placed(filament, s, key, Path(folder))
    if settle is not None and not filament.closed and at_rest(filament):
        r, e1 = settle(curve.r, curve.e1)
        curve = curve._replace(r=r, e1=e1)
    e1 = _turned(curve, filament.shape.twist, s, f"{key}.shape.twist")
    r = curve.r
    if any(p.constant != 0.0 for p in filament.shape.perturb):
        r = r + _triple(filament.shape.perturb, f"{key}.shape.perturb")(s)
    if filament.shape.noise is not None:
        r = r + _noise(filament.shape.noise, filament, curve, s)
    if filament.closed:
        r, e1 = _closed(r, e1, filament, f"{key}.shape")
    same = np.nonzero(np.linalg.norm(np.diff(r, axis=0), axis=1) < 1e-12 * filament.length)[0]
    if len(same):
        raise CaseError([f"{key}.shape: nodes {same[0]} and {same[0] + 1} start at the same point"])
    return r, e1


def _closed(r: np.ndarray, e1: np.ndarray, filament: Filament, key: str) -> tuple[np.ndarray, np.ndarray]:
    from .closing import closed_frame, closed_nodes

    if isinstance(filament.shape, RunShape):
        if np.linalg.norm(r[-1] - r[0]) > 1e-9 * filament.length:
            raise CaseError([f"{key}.path: found a filament that is not closed; allowed: a closed one"])
        return r, e1
    try:
        r = closed_nodes(r, filament.length)
    except ValueError as error:
        raise CaseError([f"{key}: found a shape that does not close: {error}; allowed: with closed, less"]) from None
    e1, turns = closed_frame(r, e1[0], filament.linking)
    step = 2.0 * np.pi * abs(turns) / (filament.nodes - 1)
    if filament.twisting is not None and step > _MOST_TURN:
        found = f"{key.removesuffix('.shape')}.linking: found a turn by {step:.2g} from node to node"
        raise CaseError([f"{found}; allowed: at most {_MOST_TURN:g}: more nodes, or less twist"])
    return r, e1


def at_rest(filament: Filament) -> bool:
    """Whether the curve of the start shape has the preferred strains at t = 0, and is not straight."""
    shape = filament.shape
    wanted = [e.constant for e in (*filament.curvature, filament.twist_rate)]
    if isinstance(shape, Relaxed):
        return any(value != 0.0 for value in wanted)
    strains = _helix_strains(shape) if isinstance(shape, Helix) else np.zeros(3)
    if isinstance(shape, Circle):
        strains = np.array([shape.curvature, 0.0, 0.0])
    known = None not in wanted and bool(np.any(strains))
    return known and bool(np.allclose(np.array(wanted, float), strains, rtol=1e-9, atol=0.0))


def end_tangents(filament: Filament, key: str = "filament", folder: str | Path = ".") -> tuple[np.ndarray, np.ndarray]:
    """Tangents (3,), (3,) of the start shape at s = 0 and s = L: what a clamp holds by default.

    Those of the curve itself with ``perturb``, not of the nodes; ``noise`` is flat at clamped ends. Raises
    CaseError as ``initial_shape`` does.
    """
    s = node_arclength(filament, key)
    slope = _placed(filament, s, key, Path(folder)).slope[[0, -1]]
    if any(p.constant is None for p in filament.shape.perturb):
        slope = slope + derivative(_triple(filament.shape.perturb, f"{key}.shape.perturb"), s[[0, -1]])
    return unit(slope[0]), unit(slope[1])


def stretch_warning(s: np.ndarray, r: np.ndarray, key: str = "filament") -> list[str]:
    """Say in one sentence where the nodes r (N, 3) are nearer or further than ``s`` (N,) by more than 1 %."""
    stretch = np.linalg.norm(np.diff(r, axis=0), axis=1) / np.diff(s) - 1.0
    low, high = 100.0 * np.min(stretch), 100.0 * np.max(stretch)
    if max(-low, high) <= 1.0:
        return []
    return [
        f"{key}.shape: the rod starts stretched by {low:.3g} % to {high:.3g} % between nodes: its curve is "
        "not as long as its arclength says, or has bends too sharp for the nodes"
    ]


def _placed(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    """The curve of ``shape`` where it is to be; that of another run is there already."""
    if isinstance(filament.shape, RunShape):
        return _of_run(filament, s, key, folder)
    return place(_MAKERS[type(filament.shape)](filament, s, key, folder), s, filament, key)


def _of_run(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    from .from_run import curve_from_run

    assert isinstance(filament.shape, RunShape)
    try:
        return curve_from_run(filament, key.rpartition(".")[2], s, folder)
    except ValueError as error:
        raise CaseError([f"{key}.shape.path: {filament.shape.path}: {error}"]) from None


# --- the kinds, each in its own coordinates --------------------------------------------------------------------------


def _straight(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    return curve_from_strains(lambda at: np.zeros((at.size, 3)), s)


def _helix(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    assert isinstance(filament.shape, Helix)
    return _constant(_helix_strains(filament.shape), s)


def _circle(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    assert isinstance(filament.shape, Circle)
    strains = [filament.shape.curvature, 0.0, 0.0]
    return curve_from_strains(lambda at: np.tile(strains, (at.size, 1)), s)


def _expression(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    assert isinstance(filament.shape, ExpressionShape)
    try:
        return curve_from_formula(_triple(filament.shape.r, f"{key}.shape.r"), s)
    except ValueError as error:
        raise CaseError([f"{key}.shape.r: {error}"]) from None


def _file(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    assert isinstance(filament.shape, FileShape)
    try:
        return curve_from_points(read_points(folder / filament.shape.path), s)
    except ValueError as error:
        raise CaseError([f"{key}.shape.path: {filament.shape.path}: {error}"]) from None


def _relaxed(filament: Filament, s: np.ndarray, key: str, folder: Path) -> Curve:
    """Integrate the preferred strains at t = 0; constant ones with tau0 not 0 make a curve with an axis."""
    kappa1, kappa2 = filament.curvature
    parts = [
        values_along(expression, "s", f"{key}.{name}", 0.0)
        for name, expression in (
            ("curvature.0", kappa1),
            ("curvature.1", kappa2),
            ("twist_rate", filament.twist_rate),
        )
    ]

    def strains(at: np.ndarray) -> np.ndarray:
        return np.stack([part(at) for part in parts], axis=-1)

    sample = strains(np.linspace(0.0, filament.length, 257))
    same = np.ptp(sample, axis=0) <= 1e-12 * np.max(np.abs(sample), axis=0)
    if np.all(same) and sample[0, 2] != 0.0:
        return _constant(sample[0], s)
    return curve_from_strains(strains, s)


def _constant(strains: np.ndarray, s: np.ndarray) -> Curve:
    """Make the helix of constant strains (3,); its axis is O1 e1 + O2 e2 + O3 e3, towards growing s."""
    axis = np.copysign(1.0, strains[2]) * strains
    return curve_from_strains(lambda at: np.tile(strains, (at.size, 1)), s, axis)


def _helix_strains(shape: Helix) -> np.ndarray:
    """O1, O2, O3 (3,) of a helix, from radius and pitch or curvature and torsion: the case gives a pair."""
    if shape.radius is not None and shape.pitch is not None:
        p = shape.pitch / (2.0 * np.pi)
        curvature, torsion = np.array([shape.radius, p]) / (shape.radius**2 + p**2)
    else:
        curvature, torsion = shape.curvature, shape.torsion
    return np.array([curvature, 0.0, torsion if shape.right_handed else -torsion])


_MAKERS: dict[type[Shape], Callable[[Filament, np.ndarray, str, Path], Curve]] = {
    Straight: _straight,
    Relaxed: _relaxed,
    Helix: _helix,
    Circle: _circle,
    ExpressionShape: _expression,
    FileShape: _file,
}


def _turned(curve: Curve, twist: Expression, s: np.ndarray, key: str) -> np.ndarray:
    """Turn e1 (N, 3) about e3 by the integral of ``twist`` from s = 0: strains (0, 0, twist) on top."""
    if twist.constant == 0.0:
        return curve.e1
    value = values_along(twist, "s", key)

    def strains(at: np.ndarray) -> np.ndarray:
        return np.stack((np.zeros_like(at), np.zeros_like(at), value(at)), axis=-1)

    frame = integrate_frame(strains, s)[1]
    e2 = np.cross(unit(curve.slope), curve.e1)
    return np.asarray(frame[:, :1, 0] * curve.e1 + frame[:, 1:2, 0] * e2)


def _noise(noise: Noise, filament: Filament, curve: Curve, s: np.ndarray) -> np.ndarray:
    """Displacements (N, 3) across the curve: random cosines, the same smooth field at any number of nodes.

    Mode m = 1 .. ``modes`` is cos(m pi s/L) times three normal numbers over m^2, as bending fluctuations
    fall off. A hinged end multiplies by sin(pi x/2), x = distance/L from it; a clamped one by its square,
    so it starts flat. The largest size of that field is ``amplitude``; then its part along the tangent,
    which would stretch the rod, is taken out, and for a filament without ``twisting`` the part that
    leaves the plane of the curve.
    """
    order = np.arange(1, noise.modes + 1)
    random = np.random.default_rng(noise.seed).standard_normal((noise.modes, 3)) / order[:, None] ** 2
    power = {"free": 0, "hinged": 1, "clamped": 2}
    at_start, at_finish = power[filament.start.end], power[filament.finish.end]

    def field(x: np.ndarray) -> np.ndarray:
        held = np.sin(0.5 * np.pi * x) ** at_start * np.sin(0.5 * np.pi * (1.0 - x)) ** at_finish
        return np.asarray(held[:, None] * (np.cos(np.pi * x[:, None] * order) @ random))

    largest = np.max(np.linalg.norm(field(np.linspace(0.0, 1.0, 2001)), axis=1))
    moved = noise.amplitude / largest * field(s / filament.length)
    e3 = unit(curve.slope)
    moved -= np.sum(moved * e3, axis=1, keepdims=True) * e3
    normal = _plane_normal(curve, filament.length) if filament.twisting is None else None
    return moved if normal is None else moved - np.outer(moved @ normal, normal)


def _plane_normal(curve: Curve, length: float) -> np.ndarray | None:
    """Take e1 or e2 at s = 0, whichever the curve is flat across: e1 if straight, None if neither."""
    for normal in (curve.e1[0], np.cross(unit(curve.slope[0]), curve.e1[0])):
        if np.max(np.abs((curve.r - curve.r[0]) @ normal)) < 1e-9 * length:
            return np.asarray(normal)
    return None


def _triple(expressions: Sequence[Expression], key: str) -> Values:
    """Three expressions of s as one function s (n,) -> (n, 3)."""
    parts = [values_along(expression, "s", f"{key}.{i}") for i, expression in enumerate(expressions)]
    return lambda at: np.stack([part(at) for part in parts], axis=-1)
