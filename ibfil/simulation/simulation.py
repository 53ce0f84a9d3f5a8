"""A running case: its present state, and the loop that steps it on."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..errors import RunFailed
from ..rods.geometry import Configuration
from ..rods.rates import Accepted
from ..timestepping.base import FAILURES, State, Step
from ..timestepping.stability_limit import explicit_limit
from ..timestepping.step_control import Verdict
from . import checkpoint, failures, steps, timescales
from .diagnostics import Diagnostics
from .driving.drivers import Drivers
from .first_motion import Motion, first_motion
from .model import assemble
from .solved_state import SolvedState
from .watch import Watch

if TYPE_CHECKING:
    from ..assembly.stacked import RodStack
    from ..case.schema import Case
    from ..fluids.base import Fluid
    from ..grid.periodic_grid import Lattice
    from ..io.snapshots import Snapshot
    from ..rods.constitutive import MomentLaw
    from ..rods.system import RodSystem


class Simulation:
    """One run of a case, at the present ``time`` after ``steps`` steps; ``model`` is what the case was assembled to.

    ``laws`` are constitutive laws made in Python, by filament, which go before the case's (rods/constitutive.py).
    One thread at a time: another one that asks meanwhile is refused with a RuntimeError. Raises CaseError where the
    scene cannot be built.
    """

    def __init__(self, case: Case, wisdom: str = "", laws: Mapping[str, MomentLaw] = MappingProxyType({})) -> None:
        self.case = case
        self._laws = ", ".join(f"{name}: {type(law).__qualname__}" for name, law in sorted(laws.items()))
        self.model = assemble(case, laws, wisdom)
        self._diagnostics = Diagnostics(self.model)
        self.state_now = State(0.0, self.start, np.zeros((len(self.arclength), self.system.unknowns)), 0.0)
        self._iterations = 0
        self._turn = threading.RLock()
        self.notices: list[str] = []  # what has happened and nobody was told yet
        self._last: Motion | None = None
        self._there = self.start  # where the fluid was asked for them; kept up with where there are bodies
        self.drivers = Drivers(self.model)
        self.choice = steps.choose(self.model, self.drivers)
        self._control = self.choice.control
        self.limits = steps.StepLimits(self.model, self.drivers)
        self._watch = Watch(self.model, self.limits)

    # -- what it is made of --------------------------------------------------------------------------------------

    @property
    def rods(self) -> RodStack:
        """The rods of the scene."""
        return self.model.rods

    @property
    def system(self) -> RodSystem:
        """The rods as a mechanical system: forces, stiffness."""
        return self.model.rods.system

    @property
    def fluid(self) -> Fluid:
        """The fluid."""
        return self.model.fluid

    @property
    def grid(self) -> Lattice | None:
        """The points at which the fluid's fields are written; None where there are none."""
        return self.model.grid

    @property
    def method(self) -> str:
        """The fluid's path to velocities."""
        return self.model.method

    @property
    def time(self) -> float:
        """Present time, in the case's unit."""
        return self.state_now.time

    @property
    def steps(self) -> int:
        """The number of steps taken."""
        return self.state_now.steps

    @property
    def configuration(self) -> Configuration:
        """The present configuration of all nodes."""
        return self.state_now.configuration

    @property
    def start(self) -> Configuration:
        """The configuration the case begins with."""
        return self.model.rods.start

    @property
    def arclength(self) -> np.ndarray:
        """Arclength (n,) of all nodes, 0 at each filament's start."""
        return self.model.rods.s

    def nodes(self, name: str) -> slice:
        """The range of nodes of the filament of that name, or of its first copy."""
        return self.model.nodes(name)

    @property
    def wisdom(self) -> str:
        """FFTW plans in use, as one line of text; empty where no step transforms a field."""
        if not self.model.transforms:
            return ""
        from ..grid import fft

        return fft.wisdom()

    # -- how it goes on ------------------------------------------------------------------------------------------

    def advance(self, until: float, after_step: Callable[[], None]) -> None:
        """Step to exactly ``until``; call back after each step.

        Raises RunFailed where the rods diverge, over-stretch, or the step cannot be solved; Stopped at a contact
        that ends the run.
        """
        with self._alone():
            if self.steps == 0:
                self.notices += self._watch.contact(self.state_now, self.state_now)
            while self.time < until:
                self.accept(*self._solve(self.limits.breaks.goal(self.time, until)))
                after_step()

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Within it this thread alone uses the simulation. Raises RuntimeError where another one does."""
        if not self._turn.acquire(blocking=False):
            raise RuntimeError("this Simulation is in use by another thread; make one for each thread")
        try:
            yield
        finally:
            self._turn.release()

    def _solve(self, until: float) -> tuple[Step, float]:
        """The next step, made as often as it takes, and the time it leads to."""
        while True:
            dt, time = self._control.propose(self.state_now, until, self.longest_step())
            try:
                step = self.attempt(dt)
            except FAILURES as failure:
                self._refuse(dt, str(failure), getattr(failure, "node", None))
                verdict = self._control.shorten(dt)
            else:
                verdict = self._control.judge(self.state_now, step, dt)
                if verdict is Verdict.ACCEPTED:
                    return step, time
                self._refuse(dt, "the error stays above time.tolerance")
            if verdict is Verdict.RESTARTED:
                self.state_now = self.state_now._replace(dt_old=0.0)

    def attempt(self, dt: float) -> Step:
        """A step of length dt from the present state, not yet taken."""
        breaks, now = self.limits.breaks, self.time
        before, after = breaks.before(now), breaks.before(now + dt)
        dt += (after - (now + dt)) + (now - before)
        step = self.model.stepper.step(self.system, self.fluid, self.state_now._replace(time=before), dt)
        self.rods.contact.refuse_passing(self.configuration.r, step.state.configuration.r)
        self.model.fluid_model.refuse(step.state.configuration.r)
        return step

    def _refuse(self, dt: float, reason: str, node: int | None = None) -> None:
        """Raises RunFailed where a step of length dt may not be tried again with half of it."""
        if not self.may_halve(dt):
            self._fail(failures.unsolved(reason, dt, self.case.time.shortest, node, self._known(dt)))

    def may_halve(self, dt: float) -> bool:
        """Whether a step of length dt that failed may be tried with half of it.

        Not with noise: trying again only the steps whose kicks were large would bias them. Nor a given explicit one: it
        is above its limit, which is to be told.
        """
        time = self.case.time
        given = time.explicit and time.tolerance is None
        return 0.5 * dt >= time.shortest and not given and self.model.noise is None

    def longest_step(self) -> float:
        """The longest step that the fluid's own motion allows; infinite where the step is given."""
        time, longest = self.case.time, self.fluid.longest_step()
        if time.tolerance is None and longest < np.inf:
            longest = self.model.fluid_model.automatic_limit(longest) if time.automatic else np.inf
        return min(longest, self.limits.longest(self.state_now, self.steps, self._control.reach))

    @property
    def shortened(self) -> int:
        """How many steps had to be tried again with a shorter one."""
        return self._control.shortened

    @property
    def step_length(self) -> float:
        """The longest step, or with a tolerance the present one."""
        return self._control.length

    def accept(self, step: Step, time: float) -> None:
        """Take a step, which led to ``time``. Raises RunFailed where it led out of bounds, Stopped at a contact."""
        before, self.state_now = self.state_now, step.state._replace(time=time)
        if self.limits.breaks.at(time):
            self.state_now = self.state_now._replace(dt_old=0.0)
            self._control.restart()
        self.fluid.advance(step.response, step.velocity, step.force)
        self.system.advance(Accepted(time, time - before.time, step.state.configuration))
        self.notices += self._watch.step(time, time - before.time)
        self._last = (step.velocity, step.force, step.reaction)
        self._there = step.there or self._there
        if self.steps > self.case.time.max_steps:
            limits = self.case.time
            self._fail(failures.too_many(self.steps, limits.max_steps, limits.end, time - before.time))
        self._iterations = step.iterations
        self._look_at_bounds(step.state.configuration, time - before.time)
        self.notices += self._watch.contact(before, self.state_now)

    def _look_at_bounds(self, configuration: Configuration, dt: float) -> None:
        rods = self.system
        found = failures.out_of_bounds(rods.mesh, self.rods.twists, rods.stretching, configuration)
        if found is not None:
            self._fail(found.trouble(self._known(dt)))

    def _known(self, dt: float) -> failures.Step:
        """The facts of a step that failed; the limit is that of the start, where the present is not finite."""
        limit = explicit_limit(self.system, self.model.inner, self.start, 0.0) if self.case.time.explicit else np.inf
        return failures.Step(dt, limit, self.case.thermal is not None and self.case.thermal.energy > 0)

    def _fail(self, trouble: failures.Failure) -> None:
        message, node, cause, remedy = trouble
        if node is None:
            raise RunFailed(message, time=self.time, cause=cause, advice=remedy)
        name, local = self.model.rods.locate(node)
        raise RunFailed(message, time=self.time, filament=name, node=local, cause=cause, advice=remedy)

    # -- its speeds ----------------------------------------------------------------------------------------------

    @cached_property
    def load_rate(self) -> float:
        """How fast what pushes moves rods by their length, radians a time; 0 where nothing does."""
        return timescales.load_rate(self.model, self.drivers)

    def growth_rate(self) -> float:
        """How fast the fastest disturbance grows at present, radians a time; 0 where none does."""
        return self.limits.growth_rate(self.state_now, self.steps, self.step_length)

    def drag(self, filament) -> float:
        """A drag per length across, for time scales: the case's own in RFT, 4 pi eta on a grid."""
        return self.model.fluid_model.drag(filament)

    def explicit_limit(self) -> float:
        """The largest stable step of the explicit scheme now, 2/rho(M K), or less where nodes feel their velocity."""
        return explicit_limit(self.system, self.model.inner, self.configuration, self.time)

    # -- what is looked at ---------------------------------------------------------------------------------------

    def _solved(self) -> SolvedState:
        """The present, with what the step that led here found; at the start, with what a first step finds."""
        if self._last is None:
            dt = min(self.step_length, self.longest_step())
            self._last = first_motion(self.model, self.state_now, dt)
        there = self._there if self.rods.bodies else self.configuration
        return SolvedState(self.state_now, *self._last, self._iterations, self.shortened, there)

    def snapshot(self, fields: Sequence[str] = ()) -> Snapshot:
        """All filaments now, with diagnostics; velocities and forces are those of the step here, or of the first."""
        with self._alone():
            return self._diagnostics.snapshot(self._solved(), fields)

    # -- what must be kept ---------------------------------------------------------------------------------------

    def state(self) -> checkpoint.Stored:
        """All that is needed to go on bit for bit, also between two outputs."""
        with self._alone():
            return checkpoint.stored(self.model, self._solved(), self._control, self.limits, self._laws)

    def restore(self, state: checkpoint.Stored) -> None:
        """Takes up a state that ``state`` gave.

        Raises CaseError where it was made with other laws from Python, or from a start shape or markers of a body that
        have changed since in the file or run they are read from.
        """
        now, told = checkpoint.taken_up(self.model, state, self._control, self.limits, self._laws)
        self.state_now, self._iterations = now.state, now.iterations
        self._last, self._there = (now.velocity, now.force, now.reaction), now.there
        self.notices += told
