"""Growth rates and modes of a scene at rest, with error bars from three levels of nodes: `ibfil modes`.

The rest is the one next to the start shape, stable or not. Modes are found at the case's own nodes, and each is
followed to a coarser and a finer level by inverse iteration from its own shape; the error of its eigenvalue is the
estimate of the three (estimates.py). The growth and frequency that a run shows follow from the eigenvalue and the step
alone, since every scheme takes a mode by a known factor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import RunFailed
from ...timestepping.equilibrium import residual_of
from ...timestepping.linear_steps import MOST, Spectrum
from ...timestepping.spectrum import followed
from ..estimates import Estimate, estimate
from ..settings import source
from ..tables import measured
from .critical import threshold
from .files import write
from .kinds import Shape
from .levels import begun, carried, node_levels, own_level, rest_near, scene_of, size
from .results import Found, Mode

if TYPE_CHECKING:
    from ...simulation.at_rest import SceneAtRest
    from ...timestepping.base import Stepper
    from ...timestepping.equilibrium import Rest
    from ...timestepping.linear_motion import LinearMotion

ALIKE = 1e-5  # of an eigenvalue: two modes that differ by less are one, double
OVERLAP = 0.8  # of a mode with its own at another level
FEW = 800  # unknowns up to which a mode is followed to other levels

Log = Callable[[str], object]


def modes(
    case: str,
    folder: str | Path | None = None,
    overrides: Sequence[str] = (),
    *,
    count: int = 8,
    step: float | None = None,
    critical: tuple[str, float, float] | None = None,
    log: Log = print,
) -> Found:
    """The ``count`` modes of a case that grow fastest or decay slowest, and the threshold of what grows.

    Writes modes.csv, modes.json, modes.h5 and modes.png into ``folder``, where one is given.
    ``step`` is that of the run whose growth is foretold, the case's by default; ``critical`` a key and the two values
    between which growth changes its sign. Raises CaseError for what has no rest by its nature, RunFailed where none is
    found or growth does not change its sign.
    """
    whole = source(case)
    scene = scene_of(whole, overrides)
    own = scene.simulation.case
    rest = scene.next_rest()
    motion = scene.motion(rest.configuration)
    step = scene.simulation.step_length if step is None else step
    shape = Shape(scene, rest.configuration)
    found, zeros, left_out = own_modes(scene, motion, shape, count, step)
    found = _seen_by_own_steps(found, scene, motion, step)
    levels = [scene if not over else scene_of(whole, (*overrides, *over)) for over in node_levels(own)]
    found, lost = _with_bars(found, levels, own_level(own), rest)
    limit = None if critical is None else threshold(whole, overrides, *critical, log)
    out = Found(
        own.title or own.file,
        rest,
        residual_of(motion.noise, scene.system.length, scene.time),
        tuple(len(level.simulation.arclength) for level in levels),
        tuple(found),
        zeros,
        left_out,
        step,
        tuple(name for name, _ in _schemes(scene)),
        limit,
        (*_notes(scene, left_out), *lost),
        measured(),
    )
    if folder is not None:
        write(out, scene, Path(folder))
    return out


def own_modes(
    scene: SceneAtRest, motion: LinearMotion, shape: Shape, count: int, step: float
) -> tuple[list[Mode], int, int]:
    """The modes at the case's own nodes, how many neither grow nor decay, and how many are no modes of a real rod."""
    spectrum, zero = scene.modes(motion, 2 * count + 6), scene.zero_rate(motion)
    out: list[Mode] = []
    zeros = left_out = 0
    for value, vector in zip(spectrum.values, np.moveaxis(spectrum.vectors, 2, 0), strict=True):
        value = complex(value)
        if abs(value) < zero:
            zeros += 1
            continue
        if value.imag < -zero:  # the conjugate of one that is there
            continue
        if len(out) == count and not _same(out[-1], value):
            break
        kind = shape.kind(vector)
        if shape.unphysical_across and kind.across is not None and kind.across > 0.5:
            left_out += 1
            continue
        if out and _same(out[-1], value):
            out[-1] = replace(out[-1], count=out[-1].count + 1)
            continue
        value = value if abs(value.imag) > zero else complex(value.real)
        out.append(Mode(value, vector, 1, kind, None, None, seen(scene, value, step)))
    return out, zeros, left_out


def _same(mode: Mode, value: complex) -> bool:
    return abs(mode.value - value) <= ALIKE * abs(value)


def _schemes(scene: SceneAtRest) -> list[tuple[str, Stepper]]:
    """The schemes whose growth is told: the case's own, and the implicit ones."""
    from ...timestepping.implicit import Implicit

    case = scene.simulation.case
    own = scene.simulation.model.stepper
    named: list[tuple[str, Stepper]] = [(f"order {order}", Implicit(order)) for order in (2, 1)]
    return named if any(type(own) is type(one) for _, one in named) else [(case.time.scheme, own), *named]


def seen(scene: SceneAtRest, value: complex, step: float) -> dict[str, complex]:
    """The growth and frequency that a run with a ``step`` shows of a mode, by scheme."""
    out = {}
    for name, scheme in _schemes(scene):
        factor = scheme.amplification(np.array([value * step]))[0]
        out[name] = complex(np.log(factor + 0j) / step)
    return out


def _seen_by_own_steps(found: list[Mode], scene: SceneAtRest, motion: LinearMotion, step: float) -> list[Mode]:
    """The same modes with the growth by the case's own scheme where that has no factor of its own: from its matrix."""
    scheme, name = scene.simulation.model.stepper, scene.simulation.case.time.scheme
    unknown = [mode for mode in found if np.isnan(mode.seen.get(name, 0.0))]
    if not unknown or motion.free.size > MOST:
        return found
    steps = Spectrum(motion).steps(scheme, step)
    return [
        replace(mode, seen={**mode.seen, name: steps.rate(mode.vector.ravel()[motion.free]) / step}) for mode in found
    ]


def _with_bars(found: list[Mode], levels: Sequence[SceneAtRest], own: int, rest: Rest) -> tuple[list[Mode], list[str]]:
    """The same modes with the errors that the levels tell; a line for each level that tells nothing."""
    lost = []
    values: list[list[complex | None]] = [[None] * 3 for _ in found]
    for number, level in enumerate(levels):
        if number == own:
            for row, mode in zip(values, found, strict=True):
                row[number] = mode.value
            continue
        nodes = len(level.simulation.arclength)
        try:
            near = rest_near(level, begun(levels[own], level, rest.configuration))
        except RunFailed as failure:
            lost.append(f"no error bars: at {nodes} nodes {failure.message}")
            continue
        motion = level.motion(near.configuration)
        if motion.free.size > FEW:
            lost.append(f"no error bars: {nodes} nodes are too many to follow modes to")
            continue
        for row, mode in zip(values, found, strict=True):
            value, _, overlap = followed(motion, mode.value, carried(levels[own], level, mode.vector))
            row[number] = value if overlap > OVERLAP else None
    sizes = [size(level) for level in levels]
    return [_with_bar(mode, row, sizes, own) for mode, row in zip(found, values, strict=True)], lost


def _with_bar(mode: Mode, values: Sequence[complex | None], sizes: Sequence[float], own: int) -> Mode:
    known = [value for value in values if value is not None]
    if len(known) < 3:
        return mode
    parts: list[Estimate | None] = []
    for part in (np.real, np.imag):
        numbers = [float(part(value)) for value in known]
        parts.append(estimate(numbers, sizes, 2.0, own, scale=abs(mode.value)) if any(numbers) else None)
    return replace(mode, growth=parts[0], frequency=parts[1] if mode.value.imag else None)


def _notes(scene: SceneAtRest, left_out: int) -> Iterator[str]:
    """The lines about what is not in the modes, or is seen from a frame of its own."""
    case, frame = scene.simulation.case, scene.fluid.frame
    if frame.turns:
        rate = float(np.linalg.norm(frame.rate))
        yield (
            f"seen from a frame that turns with the clamp at {rate:.4g}; in the lab a frequency w is |w| -+ {rate:.4g}"
        )
    elif frame.spin.any():
        yield "the rods are the same all around: seen from the lab, where their e1 turns"
    if left_out:
        yield f"{left_out} modes out of the plane are left out: a bent rod without `twisting` has no torsion"
    if case.thermal is not None:
        yield "thermal forces are left out"
