"""The quantities of a scene that are prescribed in time, and their windows of rates, jumps and period.

Every expression of a filament, a link, a body or the flow that uses t drives, be it a strain, a motion, a load or a
law: they are found by walking the case. An end that spins drives whatever its rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...case.expressions import Expression, Tree, of_tree
from ...case.table import expressions
from .intervals import bounds
from .periods import Period, Sampled, common_period, repeats
from .windows import Windows, windows

if TYPE_CHECKING:
    from ..model import Model

PLACES = 33  # along a filament, at which expressions are looked at
NODES = 64  # of the scene, at which flows are


class Drive(NamedTuple):
    """A quantity that is prescribed: its key, its tree, values of its variables beside t, what it is relative to."""

    key: str
    tree: Tree
    places: Mapping[str, np.ndarray]
    largest: float = np.inf

    @property
    def vector(self) -> str:
        """The key of the vector that it is a component of, or its own."""
        head, _, tail = self.key.rpartition(".")
        return head if tail.isdigit() else self.key


class Drivers:
    """All that drives a scene up to its end."""

    def __init__(self, model: Model) -> None:
        self._model, self.end = model, model.case.time.end

    @cached_property
    def drives(self) -> list[Drive]:
        """The quantities that change in time, spins as the angles they turn by apart."""
        out = []
        for name, filament in self._model.case.filaments.items():
            where, prefix = self._model.nodes(name), f"filament.{name}."
            s = np.linspace(0.0, filament.length, PLACES)
            for path, expression in expressions(filament):
                if "t" in expression.variables and path not in _SPINS:
                    near = _near(self._model, where) if expression.variables & {"x", "y", "z"} else {"s": s}
                    near = _of_all_copies(near, self._model.rods.variation(name, expression))
                    largest = 1.0 if path in _ANGLES else np.inf
                    out.append(Drive(prefix + path, expression.tree, _used(expression, near), largest))
        s = np.linspace(0.0, max(f.length for f in self._model.case.filaments.values()), PLACES)
        for kind, tables in (("link", self._model.case.links), ("body", self._model.case.bodies)):
            for name, table in tables.items():
                for path, expression in expressions(table):
                    if "t" in expression.variables:
                        largest = 1.0 if ".turns." in path else np.inf
                        found = _used(expression, {"s": s})
                        out.append(Drive(f"{kind}.{name}.{path}", expression.tree, found, largest))
        for k, component in enumerate(self._model.case.fluid.flow or ()):
            if "t" in component.variables:
                near = _near(self._model, slice(None))
                out.append(Drive(f"fluid.flow.{k}", component.tree, _used(component, near)))
        return out

    @cached_property
    def spins(self) -> dict[str, Expression]:
        """The ends that spin: key -> rate."""
        rods, found = self._model.rods, {}
        for name, table, filament in zip(rods.names, rods.tables, rods.filaments, strict=True):
            whole = self._model.case.filaments[table]
            found[table if filament is whole else name] = filament
        return {
            f"filament.{name}.{side}.{key}": turning.spin
            for name, filament in found.items()
            for side, end in (("start", filament.start), ("finish", filament.finish))
            for key, turning in (("spin", end), ("motor.spin", end.motor))
            if turning is not None and turning.spin is not None and turning.spin.constant != 0.0
        }

    @cached_property
    def windows(self) -> dict[str, Windows]:
        """How fast each of them changes, by key; rates of a vector's components are relative to the largest of them."""
        drives = [*self.drives, *(Drive(key, spin.tree, {}) for key, spin in self.spins.items())]
        found = {drive.key: (drive, windows(drive.tree, self.end, drive.places, drive.largest)) for drive in drives}
        sizes: dict[str, float] = {}
        for drive, one in found.values():
            sizes[drive.vector] = max(sizes.get(drive.vector, 0.0), one.size)
        out = {key: one.over(sizes[drive.vector]) for key, (drive, one) in found.items()}
        for key, spin in self.spins.items():
            out[key + _SPINNING] = _turning(spin, self.end)
        return out

    def rate(self, begin: float, end: float, spins: bool = True) -> float:
        """The fastest rate (radians a time) of all that changes between two times; of ``spins`` too, or not."""
        found = (one.rate(begin, end) for key, one in self.windows.items() if spins or not key.endswith(_SPINNING))
        return max([self._response, *found])

    @property
    def _response(self) -> float:
        """The rate at which links answer by themselves, as motors do with a lag."""
        return max((1.0 / link.response_time for link in self._model.case.links.values()), default=0.0)

    @property
    def fastest(self) -> float:
        """The fastest of the whole run."""
        return max([self._response, *(one.fastest for one in self.windows.values())])

    @cached_property
    def repeating(self) -> float:
        """The fastest rate of what repeats, in the last half of the run: past a soft start. 0 where nothing does."""
        keys = [drive.key for drive in self.drives if repeats(drive.tree)] + [key + _SPINNING for key in self.spins]
        return max((self.windows[key].rate(0.5 * self.end, self.end) for key in keys), default=0.0)

    @cached_property
    def jumps(self) -> list[float]:
        """The last times before something jumps, in order, within the run."""
        times = {float(t) for one in self.windows.values() for t in one.jumps}
        return sorted(t for t in times if 0.0 <= t < self.end)

    @cached_property
    def telling_times(self) -> np.ndarray:
        """Times at which loads may be largest: the ends of the run, extremes, both sides of jumps, and some between."""
        some = [*np.linspace(0.0, self.end, 33)]
        some += [t for one in self.windows.values() for t in one.times]
        some += [t + side for t in self.jumps for side in (0.0, 1e-9 * self.end)]
        return np.unique(np.clip(some, 0.0, self.end))

    @cached_property
    def period(self) -> Period | None:
        """The period of the scene; None where it has none, or nothing changes in time."""
        return common_period(
            [one for drive in self.drives for one in _sampled(drive)] + self._varying, self._turns, self.end
        )

    @cached_property
    def beat(self) -> float:
        """The angular frequency of what repeats soonest, each by itself; 0 where nothing does."""
        each = [common_period(_sampled(drive), [], self.end) for drive in self.drives if repeats(drive.tree)]
        return max([*(2 * np.pi / period.length for period in each if period), *map(abs, self._turns)], default=0.0)

    @property
    def _varying(self) -> list[Sampled]:
        """The spins that vary."""
        return [(spin.tree, {}) for spin in self.spins.values() if spin.constant is None]

    @cached_property
    def _turns(self) -> list[float]:
        """The steady part of each spin, where it has one."""
        rates = [s.constant if s.constant is not None else _mean_spin(s, self.end) for s in self.spins.values()]
        return [rate for rate in rates if rate]


_SPINNING = "ning"  # after the key of a spin: the turning, beside how the spin changes
_SPINS, _ANGLES = (
    tuple(f"{side}.{key}" for side in ("start", "finish") for key in (turned, f"motor.{turned}"))
    for turned in ("spin", "angle")
)


def _sampled(drive: Drive) -> list[Sampled]:
    """The trees of which a drive's period is: an angle means what its direction means."""
    if drive.key.endswith(_ANGLES) or ".turns." in drive.key:
        return [(("cos", drive.tree), {}), (("sin", drive.tree), {})]
    return [(drive.tree, drive.places)]


def _of_all_copies(near: Mapping[str, np.ndarray], values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Places along a filament at every copy of it: each place with the i and phase (k,) of each copy."""
    if not values:
        return dict(near)
    places, copies = len(next(iter(near.values()))), len(next(iter(values.values())))
    out = {name: np.tile(at, copies) for name, at in near.items()}
    return out | {name: np.repeat(given, places) for name, given in values.items()}


def _used(expression: Expression, near: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Of some variables, those the expression uses."""
    return {name: values for name, values in near.items() if name in expression.variables}


def _near(model: Model, where: slice) -> dict[str, np.ndarray]:
    """Arclength and start positions of some of the nodes in a range."""
    nodes = np.arange(len(model.rods.s))[where]
    some = nodes[np.unique(np.linspace(0, len(nodes) - 1, NODES).astype(int))]
    x, y, z = model.rods.start.r[some].T
    return {"s": model.rods.s[some], "x": x, "y": y, "z": z}


def _turning(spin: Expression, end: float) -> Windows:
    """How fast an end turns that spins: by the spin itself, a turn being a period."""
    edges = np.linspace(0.0, end, PLACES)
    low, high = bounds(spin.tree, edges[:-1], edges[1:], {}).value
    return Windows(1.0, edges, np.maximum(np.abs(low), np.abs(high))[:, 0], np.zeros(0), edges[:0])


def _mean_spin(spin: Expression, end: float) -> float:
    """The mean of a spin that varies, over its period, or over the run where it has none; 0 to rounding is 0."""
    period = common_period([(spin.tree, {})], [], end)
    begin, length = (period.since, period.length) if period else (0.0, end)
    times = begin + length * (np.arange(4096) + 0.5) / 4096
    values = np.asarray(of_tree(spin.tree).bind("t")(times))
    mean = float(np.mean(values))
    return mean if abs(mean) > 1e-9 * float(np.max(np.abs(values))) else 0.0
