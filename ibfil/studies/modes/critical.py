"""The threshold of a scene: where the growth of its leading mode changes its sign, with an error bar.

The key is scanned, and where growth changes its sign its zero is found at three levels of nodes, each followed from
the rest and the mode of the level before. Motions as a whole do not count: a rod at a stagnation point drifts and turns
whatever the load is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import RunFailed
from ...timestepping.spectrum import followed
from ..estimates import estimate
from .kinds import Kind, Shape
from .levels import begun, carried, node_levels, own_level, rest_near, scene_of, size
from .results import Threshold

if TYPE_CHECKING:
    from ...rods.geometry import Configuration
    from ...simulation.at_rest import SceneAtRest

VALUES = 9  # of a scan
EXACT = 1e-7  # of the key's range: to which zeros are found
WIDER = 1.7  # factor by which a bracket at another level grows until it holds the zero
_FEW = 800  # unknowns up to which a mode is followed

Log = Callable[[str], object]


class Leading(NamedTuple):
    """The flexible mode that grows fastest at one value of the key: where, its eigenvalue, its vector, its kind."""

    scene: SceneAtRest
    configuration: Configuration
    value: complex
    vector: np.ndarray
    kind: Kind


class Level:
    """One number of nodes: the leading growth at any value of the key, remembered."""

    def __init__(self, case: str, overrides: Sequence[str], key: str) -> None:
        self._case, self._overrides, self._key = case, tuple(overrides), key
        self.known: dict[float, Leading] = {}

    def leading(self, value: float, near: Leading | None = None) -> Leading:
        """The leading mode at a value, by all modes; or by the one ``near`` it, followed."""
        if value not in self.known:
            scene = scene_of(self._case, (*self._overrides, f"{self._key}={float(value)!r}"))
            if near is None and self.known:
                near_rest = self.known[min(self.known, key=lambda other: abs(other - value))]
                begin = begun(near_rest.scene, scene, near_rest.configuration)
            else:
                begin = scene.simulation.start if near is None else begun(near.scene, scene, near.configuration)
            rest = rest_near(scene, begin)
            self.known[value] = _leading(scene, rest.configuration, near)
        return self.known[value]


def _leading(scene: SceneAtRest, configuration: Configuration, near: Leading | None) -> Leading:
    """The flexible mode that grows fastest about a rest; with ``near`` the one that is most like it."""
    motion, shape = scene.motion(configuration), Shape(scene, configuration)
    if near is not None and motion.free.size <= _FEW:
        value, vector, overlap = followed(motion, near.value, carried(near.scene, scene, near.vector))
        if overlap > 0.8:
            return Leading(scene, configuration, value, vector, near.kind)
    zero = scene.zero_rate(motion)
    found = scene.modes(motion, 12)
    for value, vector in zip(found.values, np.moveaxis(found.vectors, 2, 0), strict=True):
        kind = shape.kind(vector)
        across = shape.unphysical_across and kind.across is not None and kind.across > 0.5
        if abs(value) > zero and not kind.rigid and not across:
            return Leading(scene, configuration, complex(value), vector, kind)
    raise RunFailed("no mode strains the rods", advice="a filament that is held, or loaded, and bends")


def threshold(case: str, overrides: Sequence[str], key: str, low: float, high: float, log: Log) -> Threshold:
    """The threshold of ``key`` between two values. Raises CaseError, RunFailed where growth keeps its sign there."""
    from scipy.optimize import brentq

    first = Level(case, overrides, key)
    places = np.linspace(low, high, VALUES)
    growth = []
    for value in places:
        growth.append(_scanned(first, key, float(value)))
        log(f"{key} = {value:.6g}: growth {growth[-1]:.4g}")
    change = next((i for i in range(VALUES - 1) if (growth[i] > 0) != (growth[i + 1] > 0)), None)
    if change is None:
        raise RunFailed(
            f"--critical {key}: growth does not change its sign between {low:g} and {high:g} "
            f"({growth[0]:.3g}, {growth[-1]:.3g})",
            advice="two values with a threshold between them",
        )
    bracket = float(places[change]), float(places[change + 1])
    own = _zero(first, bracket, None, brentq)
    scene = own.scene
    zeros, sizes, nodes = [], [], []
    middle = own_level(scene.simulation.case)
    at = _place(first, own)
    for number, over in enumerate(node_levels(scene.simulation.case)):
        level = first if number == middle else Level(case, (*overrides, *over), key)
        found = own if number == middle else _zero(level, _around(level, at, bracket, own), own, brentq)
        zeros.append(_place(level, found))
        sizes.append(size(found.scene))
        nodes.append(len(found.scene.simulation.arclength))
        log(f"{nodes[-1]} nodes: {key} = {zeros[-1]:.7g}")
    told = estimate(zeros, sizes, 2.0, middle)
    frequency = abs(own.value.imag)
    return Threshold(
        key,
        zeros[middle] - told.error,
        told.doubt,
        told,
        tuple(nodes),
        frequency
        if frequency > 1e-6 * abs(own.value) and frequency > scene.zero_rate(scene.motion(own.configuration))
        else 0.0,
        growth[change + 1] > growth[change],
        own.kind,
        tuple(zip(map(float, places), growth, strict=True)),
    )


def _scanned(level: Level, key: str, value: float) -> float:
    """The leading growth at a value. Raises RunFailed, which names the value, where there is no rest."""
    try:
        return level.leading(value).value.real
    except RunFailed as failure:
        raise RunFailed(
            f"--critical {key} = {value:g}: {failure.message}",
            filament=failure.filament,
            node=failure.node,
            advice="two values between which the scene has a rest",
        ) from None


def _place(level: Level, found: Leading) -> float:
    """The value of the key at which a mode was found."""
    return next(value for value, leading in level.known.items() if leading is found)


def _zero(level: Level, bracket: tuple[float, float], near: Leading | None, solve) -> Leading:
    """The mode at the zero of the growth within a bracket."""
    low, high = (level.leading(value, near) for value in bracket)
    following = low if abs(low.value.real) < abs(high.value.real) else high

    def growth(value: float) -> float:
        return level.leading(float(value), following).value.real

    scale = abs(bracket[1] - bracket[0])
    zero = solve(growth, *bracket, xtol=EXACT * scale, rtol=1e-13)
    growth(zero)
    return level.known[float(zero)]


def _around(level: Level, at: float, bracket: tuple[float, float], near: Leading) -> tuple[float, float]:
    """A bracket about a zero of another level, as narrow as holds that of this one."""
    width = 0.02 * abs(bracket[1] - bracket[0])
    while width < 4 * abs(bracket[1] - bracket[0]):
        low, high = (level.leading(value, near).value.real for value in (at - width, at + width))
        if (low > 0) != (high > 0):
            return at - width, at + width
        width *= WIDER
    raise RunFailed("the threshold is far off at another number of nodes", advice="more nodes: filament.NAME.nodes")
