"""A grid one cell deep along an axis: its flow is plane, and a filament is a sheet. Lines and warnings about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...case.filament import Filament
    from ...fluids.base import Flow
    from .base import Scene

PLANE = 1e-9  # of the largest: a component along the thin axis that is none


def drag(viscosity: float, spacing: float, length: float) -> float:
    """Drag per length across, of a depth of one cell, that sheets of a length feel when they wave: 4 eta k h."""
    return 4 * viscosity * 2 * np.pi / length * spacing


def modelled(axis: int) -> str:
    """The line that says so."""
    return f"a plane flow: the grid is one cell deep along {'xyz'[axis]}, and a filament is a sheet"


def size(axis: int, spacing: float) -> list[str]:
    """Lines about the meaning of numbers, and what a grid makes of a sheet."""
    out = [
        f"moduli, mass, loads and forces are of a depth of one cell, {spacing:.4g}: divide by it for those per depth",
        "a sheet is blurred over the kernel, of first order in h: Taylor's, a wavelength from the next, swims 15 % too "
        "slowly with 64 cells a wavelength (peskin4), 8 % with 128, 4 % with 256",
        "what moves a sheet moves others as the logarithm of their distance (Stokes' paradox): drag depends on the box",
    ]
    if axis == 2:
        out.append("transforms of a grid that is thin along x or y take half the time: lay the scene in y, z")
    return out


def leaves_plane(scene: Scene, filament: Filament, name: str, axis: int) -> list[str]:
    """A filament whose nodes, or the forces on them, do not stay in a plane across the thin axis, or a copy's."""
    letter, now, found = "xyz"[axis], scene.snapshot().filaments, ""
    for copy, whose in zip(scene.rods.names, scene.rods.filaments, strict=True):
        if whose is not filament:
            continue
        spans, forces = np.ptp(now[copy].position, axis=0), np.max(np.abs(now[copy].force), axis=0)
        if spans[axis] > PLANE * np.max(spans):
            found = f"spans {spans[axis]:.3g} along {letter}"
        elif forces[axis] > PLANE * np.max(forces):
            found = found or f"is pushed along {letter}"
    if not found:
        return []
    return [
        f"filament.{name}: {found}, where the grid is one cell deep: a plane flow knows no place along {letter}, and a "
        f"sheet has none; lay it in a plane {letter} = const, or take more fluid.cells"
    ]


def of_flow(flow: Flow | None, axis: int, box: np.ndarray) -> list[str]:
    """A background flow along the thin axis, or one that changes along it."""
    if flow is None:
        return []
    places = np.random.default_rng(1).uniform(-0.5, 0.5, (64, 3)) * box
    here, letter = flow(places, 0.0), "xyz"[axis]
    moved = flow(places + np.eye(3)[axis] * 0.37 * np.max(box), 0.0)
    along, changes = float(np.max(np.abs(here[:, axis]))), float(np.max(np.abs(moved - here)))
    if max(along, changes) <= PLANE * max(float(np.max(np.abs(here))), 1e-300):
        return []
    what = f"flows along {letter}" if along > changes else f"changes along {letter}"
    return [
        f"fluid.flow: {what}, where the grid is one cell deep and the flow of the filaments plane; leave {letter} out"
    ]
