"""The headings of tracked data: which column is what, in which unit.

`x_um`, `x (um)`, `X [um]`, `x3`, `y_3` are read; a number at the end counts points along the filament.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ...errors import CaseError

TIMES, FRAMES = ("t", "time"), ("frame", "image", "slice")
ARCLENGTHS, POINTS = ("s", "arclength"), ("node", "point", "index", "i")
ANGLES = ("psi", "theta", "angle")
WEIGHTS, FILAMENTS = ("weight", "w"), ("filament", "track")
FORM = (
    "headings t (or frame), x, y, z (two of them or all; or psi, the tangent's angle), and where there are any s or "
    "node, weight, filament; a unit after a name, x_um or t (ms); or a row a frame, t, x0, y0, x1, y1, ..."
)
OTHERWISE = "other files with --headings frame,x_um,y_um: what their columns are, in order, empty for those left alone"
# In metres, seconds, radians.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "microns": 1e-6, "nm": 1e-9}
DURATIONS = {"h": 3600.0, "min": 60.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6}
TURNS = {"rad": 1.0, "deg": math.pi / 180, "degree": math.pi / 180, "degrees": math.pi / 180}
_KINDS = {
    **dict.fromkeys(TIMES, "t"),
    **dict.fromkeys(FRAMES, "frame"),
    **dict.fromkeys(ARCLENGTHS, "s"),
    **dict.fromkeys(POINTS, "node"),
    **dict.fromkeys(ANGLES, "psi"),
    **dict.fromkeys(WEIGHTS, "weight"),
    **dict.fromkeys(FILAMENTS, "filament"),
    **{letter: letter for letter in "xyz"},
}
_MICRO = {0xB5: "u", 0x3BC: "u"}  # both letters mu
_HEADING = re.compile(r"([a-z]+)[\s_]?(\d+)?\s*(?:[_(\[/\s]\s*([a-z\u00b5\u03bc]+)\s*[)\]]?)?")


@dataclass(frozen=True)
class Heading:
    """A column: ``kind`` t, frame, s, node, psi, weight, filament, x, y, z; which ``point``; its ``unit`` or ""."""

    kind: str
    point: int | None
    unit: str


def heading(cell: str) -> Heading | None:
    """Read the heading of a column; None where it is none that is known."""
    found = _HEADING.fullmatch(cell.strip().lower())
    if found is None or found[1] not in _KINDS:
        return None
    unit = (found[3] or "").translate(_MICRO)
    if unit in ("px", "pixel", "pixels", "voxel", "voxels"):
        unit = "px"
    return Heading(_KINDS[found[1]], None if found[2] is None else int(found[2]), unit)


def factor(one: Heading, units: tuple[str, str], scale: float | None, rate: float | None) -> float:
    """The number that those of the column are multiplied by to be in the case's ``units`` of length and time.

    A ``scale`` or ``rate`` given is taken for what the heading says. Raises CaseError where neither says it.
    """
    if one.kind in ("x", "y", "z", "s"):
        return (
            scale if scale is not None else _converted(one, units[0], LENGTHS, "length", "--scale, case units a pixel")
        )
    if one.kind == "frame":
        if rate is None:
            raise CaseError(["--data: found frame numbers; allowed: with --rate, frames a unit of the case's time"])
        return 1.0 / rate
    if one.kind == "t":
        return 1.0 / rate if rate is not None else _converted(one, units[1], DURATIONS, "time", "--rate")
    if one.kind == "psi":
        if one.unit and one.unit not in TURNS:
            raise CaseError([f"--data: found psi in {one.unit}; allowed: rad or deg"])
        return TURNS[one.unit or "rad"]
    return 1.0


def _converted(one: Heading, own: str, known: dict[str, float], what: str, else_: str) -> float:
    """From the unit of a heading to the case's; one that says none has the case's."""
    own = own.translate(_MICRO)
    if not one.unit or one.unit == own:
        return 1.0
    if one.unit in known and own in known:
        return known[one.unit] / known[own]
    says = f"the case states {own}" if own != "1" else f"the case states no unit of {what}"
    raise CaseError([f"--data: found {one.kind} in {one.unit}, and {says}; allowed: units.{what} = one of "
                     f"{', '.join(known)} in the case, or {else_}"])  # fmt: skip
