"""A case as it is played: its simulation from output to output, as `ibfil run` would take it, and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.body_meshes import ends_of_axes
from ...analysis.meshes import polylines, rod_of
from ...check.overview import overview_of
from ...io.units import label
from ...observables.factory import observers
from ...observables.stop_rules import StopRules
from ...simulation.schedule import SAME, due_times
from ...simulation.simulation import Simulation
from ..quantities import FILAMENT, OWN, QUANTITIES, words_with_unit
from ..style import COLOURS
from ..web.constants import LEVELS, constants, shades, strokes
from .controls import controls

if TYPE_CHECKING:
    from ...case.schema import Case
    from ...io.snapshots import Snapshot

COLOURED = ("tension", "curvature", "speed")
_OF_BODIES = ("position", "e1", "e2", "e3", "markers")


class Played:
    """The run of ``case``: its steps, outputs and observables are, to the bit, those of `ibfil run`.

    Raises CaseError where the scene cannot be built.
    """

    def __init__(self, case: Case, colour: str) -> None:
        self.case = case
        self._observed = observers(case)
        self._rules = StopRules(case, self._observed)
        self.simulation = Simulation(case)
        self.overview = overview_of(self.simulation)
        self._dues = due_times(case, self.simulation.grid is not None)
        self._next = 0
        rods = self.simulation.model.rods
        self._rods = {
            rods.names[k]: rod_of(case, rods.filaments[k], self.simulation.arclength[rods.nodes[k]])
            for k in rods.written(case.output.copies_every)
        }
        self._quantities = list(dict.fromkeys([colour, *COLOURED, *([FILAMENT] if len(self._rods) > 1 else [])]))

    @property
    def done(self) -> bool:
        """Whether the last output has been taken."""
        return self._next == len(self._dues)

    def go_on(self, after_step: Callable[[], None]) -> tuple[dict[str, Any] | None, str]:
        """Go to the next time at which something is due: the row of an output there, and the stop rule that is true.

        Raises as Simulation.advance, and what ``after_step`` raises: it then goes on from there when called again.
        """
        due, slack = self._dues[self._next], SAME * self.case.time.end
        if due.time > self.simulation.time + slack:
            self.simulation.advance(due.time, after_step)
        self._next += 1
        return self.output() if due.output else (None, "")

    def output(self) -> tuple[dict[str, Any], str]:
        """The time and the observables of an output now, and the stop rule that is true then, or ""."""
        snapshot = self.simulation.snapshot()
        values = self._observed.record(snapshot)
        row = {name: _plain(value) for name, value in values.items()}
        return {"time": snapshot.time, "values": row}, self._rules.check(snapshot.time)

    def numbers(self) -> list[dict[str, Any]]:
        """The number of each observable so far, and what is to be said of it."""
        found, units = [], self.case.units
        for name, one in self._observed.summaries().items():
            dimension = self._observed.observables[name].summary_dimension
            said = "; ".join(text for text in (one.note, one.quality, one.doubt) if text)
            unit = label(units, dimension)
            found.append({"name": name, "value": _plain(one.value), "unit": "" if unit == "1" else unit, "note": said})
        return found

    def notices(self) -> list[str]:
        """All that has happened and was not told yet."""
        told, self.simulation.notices[:] = list(self.simulation.notices), []
        return told

    def scene(self) -> dict[str, Any]:
        """All that stays while it runs (visualization/web/constants.py), and the case's controls."""
        snapshot = self.simulation.snapshot()
        places = [filament.position[None] for filament in snapshot.filaments.values()]
        bodies = ends_of_axes(self.case, _columns(snapshot.bodies, _OF_BODIES))
        whole = np.concatenate([p.reshape(-1, 3) for p in (*places, *bodies)])
        radii = np.concatenate([rod.radius for rod in self._rods.values()])
        units = {self._observed.recorded(name): one for name, one in self._observed.observables.items()}
        return {
            **constants(self.case, self.case.file, [*places, *bodies], (whole.min(axis=0), whole.max(axis=0)), radii),
            "counts": [p.shape[1] for p in places],
            "links": self._strokes(snapshot).shape[0],
            "quantities": [self._colours(name) for name in self._quantities],
            "series": {name: label(self.case.units, one.dimension) for name, one in units.items()},
            "groups": {name: f"{value:.4g}" for name, value in self.overview.groups.items()},
            "warnings": self.overview.warnings,
            "controls": [one._asdict() for one in controls(self.case)],
            "method": f"fluid {self.case.fluid.words}, method {self.simulation.method}",
            "end": self.case.time.end,
        }

    def picture(self) -> bytes:
        """The present as little-endian numbers: time and steps in float64, places, strokes, quantities in float32."""
        from pyvista import wrap

        snapshot = self.simulation.snapshot()
        mesh = wrap(polylines(snapshot, self._rods))
        values = [QUANTITIES[name].values(mesh) for name in self._quantities if name != FILAMENT]
        parts = [np.asarray(mesh.points).ravel(), self._strokes(snapshot).ravel(), *values]
        head = np.array([snapshot.time, self.simulation.steps], "<f8").tobytes()
        return head + np.concatenate(parts).astype("<f4").tobytes()

    def _strokes(self, snapshot: Snapshot) -> np.ndarray:
        """Links and rings of bodies as strokes (K, 2, 3)."""
        links = _columns(snapshot.links, ("first", "second"))
        found: np.ndarray = strokes(self.case, links, _columns(snapshot.bodies, _OF_BODIES))[0]
        return found

    def _colours(self, name: str) -> dict[str, Any]:
        """A quantity for the page, which finds its ends; ``values`` is None of what has a colour of its own."""
        quantity = QUANTITIES[name]
        if name == FILAMENT:
            names = list(self._rods)
            own = shades(f"{OWN}{len(COLOURS)}", len(COLOURS))
            return {"words": name, "values": None, "map": own, "low": names[0], "high": names[-1]}
        words = words_with_unit(quantity.words, quantity.dimension, self.case.units)
        return {"words": words, "values": True, "map": shades(quantity.colours, LEVELS), "signed": quantity.signed}


def _columns(parts: Any, keys: Sequence[str]) -> dict[str, dict[str, np.ndarray]]:
    """Parts of a snapshot as columns over the one time that it has, without those that a part lacks."""
    found = {name: {key: getattr(one, key) for key in keys} for name, one in parts.items()}
    return {
        name: {key: np.asarray(values)[None] for key, values in one.items() if values is not None}
        for name, one in found.items()
    }


def _plain(value: Any) -> Any:
    """A number, or three, as JSON has them; None for one that is not finite."""
    found = np.asarray(value, float)
    if found.ndim:
        return [_plain(part) for part in found]
    return float(found) if np.isfinite(found) else None
