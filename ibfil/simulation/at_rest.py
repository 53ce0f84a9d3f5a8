"""A scene about its states of rest: the frame in which it may rest, its equilibria, its growth rates and modes.

The method is in timestepping (steady.py, linear_motion.py, spectrum.py, equilibrium.py); here it is asked of a case.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, NoReturn

from ..case.table import expressions
from ..errors import CaseError, RunFailed
from ..timestepping import equilibrium
from ..timestepping.base import FAILURES
from ..timestepping.linear_motion import LinearMotion
from ..timestepping.spectrum import Modes, modes
from ..timestepping.steady import SteadyFluid, frame_of
from . import timescales

if TYPE_CHECKING:
    from ..case.schema import Case
    from ..rods.geometry import Configuration
    from ..timestepping.equilibrium import Rest, Settled
    from .simulation import Simulation

FASTER = 25.0  # times the slowest bending rate: where growth is looked for first


class SceneAtRest:
    """A simulation's rods and fluid as they would stand still. ``time`` is the slowest bending time of the scene.

    Raises CaseError for a case that is driven in time, or whose fluid or rods have a past, RunFailed where held ends
    move.
    """

    def __init__(self, simulation: Simulation) -> None:
        refuse_driven(simulation.case)
        self.simulation, self.system = simulation, simulation.system
        self.time = timescales.slowest_bending(simulation.model)

    @cached_property
    def fluid(self) -> SteadyFluid:
        """The fluid seen from the frame in which held ends are at rest."""
        start, fluid = self.simulation.start, self.simulation.fluid
        try:
            frame = frame_of(self.system, fluid, start, 0.0)
        except FAILURES as failure:
            self._fail(failure)
        return SteadyFluid(fluid, frame, self.system.unknowns, 0.0)

    def next_rest(self, configuration: Configuration | None = None) -> Rest:
        """The rest next to a configuration, the start by default, stable or not; else the one the motion leads to.

        Raises RunFailed where there is none.
        """
        begin = self.simulation.start if configuration is None else configuration
        try:
            return self._inside(equilibrium.newton(self.system, self.fluid, begin, self.time))
        except FAILURES:
            pass
        try:
            return self._inside(equilibrium.continued(self.system, self.fluid, begin, self.time))
        except FAILURES as failure:
            self._fail(failure)

    def settled(self) -> Settled:
        """The stable rest that the motion from the start leads to, and those it passes. Raises RunFailed."""
        try:
            found = equilibrium.settled(self.system, self.fluid, self.simulation.start, self.time)
            self._inside(found.rests[-1])
            return found
        except FAILURES as failure:
            self._fail(failure)

    def motion(self, configuration: Configuration) -> LinearMotion:
        """The motion linearised about a configuration."""
        return LinearMotion(self.system, self.fluid, configuration)

    def modes(self, motion: LinearMotion, count: int) -> Modes:
        """All modes, or where there are many unknowns at least the ``count`` that grow fastest."""
        return modes(motion, count, FASTER / self.time)

    def zero_rate(self, motion: LinearMotion) -> float:
        """The rate below which a mode neither grows nor decays."""
        return equilibrium.zero_rate(motion, self.time)

    def _inside(self, rest: Rest) -> Rest:
        """The rest. Raises StepFailed where it is outside of the fluid."""
        self.simulation.model.fluid_model.refuse(rest.configuration.r)
        return rest

    def _fail(self, failure: Exception) -> NoReturn:
        """Raise RunFailed for a search that found nothing."""
        name, local = self.simulation.rods.locate(getattr(failure, "node", 0))
        advice = "`ibfil run` shows how it moves; another start shape, or a lower load"
        raise RunFailed(f"no state of rest: {failure}", filament=name, node=local, advice=advice) from None


def refuse_driven(case: Case) -> None:
    """Raises CaseError, a line a key, for all that changes in time, for a fluid that has a past, and for mass."""
    faults = [f"{case.file}: {fault}" for fault in _driven(case)]
    if case.fluid.inertial:
        past = "a fluid with a past has modes of its own"
        faults.append(f"{case.file}: fluid.model: found {case.fluid.model}; allowed: rft, stokes; {past}")
    heavy = [name for name, filament in case.filaments.items() if filament.mass is not None]
    without = "allowed: none; rests are the same without it, and modes of rods with mass are not computed"
    faults += [f"{case.file}: filament.{name}.mass: found a mass; {without}" for name in heavy]
    if faults:
        raise CaseError(faults)


def _driven(case: Case) -> Iterator[str]:
    found = [(f"filament.{name}.{path}", e) for name, f in case.filaments.items() for path, e in expressions(f)]
    found += [(f"link.{name}.{path}", e) for name, link in case.links.items() for path, e in expressions(link)]
    found += [(f"fluid.flow.{number}", e) for number, e in enumerate(case.fluid.flow or ())]
    told = set()
    for path, expression in found:
        key = path.rstrip("0123456789").rstrip(".")
        if "t" in expression.variables and key not in told:
            told.add(key)
            yield f"{key}: found a function of t; allowed: constants; rests and modes are of what does not change"
    for name, filament in case.filaments.items():
        if filament.damping:
            yield f"filament.{name}.damping: found {filament.damping:g}; allowed: 0; modes do not have it"
        if filament.closed:
            yield f"filament.{name}.closed: found true; allowed: rods with ends; rests and modes are not of closed ones"
    for name in case.bodies:
        yield f"body.{name}: found a body; allowed: none; rests and modes are not of scenes with bodies"
    for name, link in case.links.items():
        if link.resists_rates:
            yield f"link.{name}: found what answers to rates; allowed: no damping, no motors; modes do not have it"
