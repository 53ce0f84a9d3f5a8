"""A case come alive: the present state, how it goes on, and what of it is looked at."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from . import assemble, assemble_fluid, failures, timescales
from .diagnostics import Diagnostics, Instant
from .errors import CaseError, RunFailed
from .fluid import Held
from .geometry import Geometry
from .marching import ControlledSteps, EvenSteps
from .stepping import State, Step

if TYPE_CHECKING:
    from .case import Case
    from .frames import Frame
    from .laws import MomentLaw


class Simulation:
    """One run of a case, at the present ``time`` after ``steps`` steps.

    ``method`` names the fluid's path, ``warnings`` what the user should know, ``grid`` the fluid's grid or None.
    ``laws`` are constitutive laws made in Python, by filament, which go before the case's (laws.py). Raises CaseError
    where the scene cannot be built.
    """

    def __init__(self, case: Case, wisdom: str = "", laws: Mapping[str, MomentLaw] = MappingProxyType({})) -> None:
        self.case = case
        self._laws = ", ".join(f"{name}: {type(law).__qualname__}" for name, law in sorted(laws.items()))
        self._rods = assemble.rods(case, laws)
        self.mechanics = self._rods.mechanics
        self._wisdom = wisdom
        if case.fluid.model != "rft":
            self._learn()
        self.fluid, self.method, self.grid = assemble_fluid.fluid(case, self._rods)
        self._diagnostics = Diagnostics(case, self._rods, self.fluid, self.grid)
        self._noise = assemble.noise(case, self._rods)
        self._stepper = assemble.stepper(case, self._noise)
        n, m = len(self._rods.s), self.mechanics.unknowns
        self.state_now = State(0.0, self._rods.start, np.zeros((n, m)), 0.0)
        # The e1 of a filament without twisting is carried along, and may come to differ from node to node.
        self._twisting = np.repeat(
            [f.twisting is not None for f in self._rods.filaments], [w.stop - w.start for w in self._rods.nodes]
        )
        self.steps = self._iterations = 0
        self.notices: list[str] = []  # what has happened and nobody was told yet
        self._told = False  # that the fluid moves too far in a step
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        if self._transforms:
            self._remember()
        self._march = self._choose_march()

    @property
    def time(self) -> float:
        """Present time, in the case's unit."""
        return self.state_now.time

    @property
    def shape(self) -> Geometry:
        """The present configuration of all nodes."""
        return self.state_now.shape

    @property
    def start(self) -> Geometry:
        """The configuration the case begins with."""
        return self._rods.start

    @property
    def arclength(self) -> np.ndarray:
        """Arclength (n,) of all nodes, 0 at each filament's start."""
        return self._rods.s

    def nodes(self, name: str) -> slice:
        """The range of nodes of the filament of that name, or of its first copy."""
        names = self._rods.names
        return self._rods.nodes[names.index(name if name in names else f"{name}_000")]

    @property
    def filaments(self) -> tuple[str, ...]:
        """Names of all filaments, copies one by one."""
        return self._rods.names

    @property
    def method_seconds(self) -> dict[str, float]:
        """Estimated seconds of a step by each method the fluid has, from counts."""
        return assemble_fluid.method_seconds(self.case, self._rods, self.grid)

    @property
    def groups(self) -> dict[str, float]:
        """The dimensionless groups of the scene."""
        from .dimensionless import groups

        return groups(self)

    @property
    def warnings(self) -> list[str]:
        """What should make the user look twice, one sentence each."""
        from .scene_warnings import warnings

        return warnings(self)

    @property
    def wisdom(self) -> str:
        """FFTW plans in use, as one line of text; empty where no step transforms a field."""
        if not self._transforms:
            return ""
        from . import transforms

        return transforms.wisdom()

    @property
    def _transforms(self) -> bool:
        """Whether steps transform fields."""
        return self.method not in ("rft", "table", "averaged") or self.case.fluid.model == "navier-stokes"

    def _learn(self) -> None:
        from . import transforms

        transforms.learn(self._wisdom)

    def _remember(self) -> None:
        from . import transforms

        transforms.remember()

    # -- how it goes on ------------------------------------------------------------------------------------------

    def driving_rates(self) -> list[float]:
        """How fast the scene is driven, radians per time: by what changes in time, and by what pushes."""
        return self.cycles + self._pushes

    @cached_property
    def cycles(self) -> list[float]:
        """How fast it is driven by what changes in time."""
        return timescales.cycles(self)

    @cached_property
    def _pushes(self) -> list[float]:
        return timescales.pushes(self)

    def drag(self, filament) -> float:
        """A drag per length across, for time scales: the case's own in RFT, 4 pi eta on a grid."""
        eta = self.case.fluid.viscosity
        if self.case.fluid.model != "rft":
            return 4 * np.pi * eta
        radius = None if filament.radius is None else np.atleast_1d(filament.radius.bind("s", "t")(0.0, 0.0))
        return assemble_fluid.drag_coefficients(self.case, filament, radius)[0]

    def bending_time(self) -> float:
        """Relaxation time of the slowest bending mode of any filament."""
        times = []
        for f in self.case.filaments.values():
            times.append(
                timescales.bending_time(self.drag(f), f.length, timescales.softest(f), f.start.end, f.finish.end)
            )
        return max(times)

    def explicit_limit(self) -> float:
        """The largest stable step of the explicit scheme at the present configuration, 2/rho(M K)."""
        return timescales.explicit_limit(self.mechanics, self.fluid, self.state_now.shape, self.time)

    def _choose_step(self) -> float:
        if self.case.time.step != "auto":
            return float(self.case.time.step)
        if self.case.time.scheme == "explicit":
            return 0.5 * self.explicit_limit()
        step = timescales.implicit_step(self.cycles, self._pushes, self.bending_time())
        if self._noise is not None:
            # The trapezoid forgets its stiffest mode in dt^2/(2 limit): no later than the softest is forgotten.
            step = min(step, float(np.sqrt(2 * self.explicit_limit() * self.bending_time())))
            while self.thermal_stretch(step) > timescales.STRETCH:
                step *= 0.9
        return step

    def thermal_stretch(self, dt: float) -> float:
        """How much longer than at rest thermal kicks leave a filament on average in steps of dt; the most of all."""
        assert self.case.thermal is not None
        energy = self.case.thermal.energy
        return max(
            timescales.thermal_stretch(energy, self.drag(f), timescales.softest(f), f.length, f.nodes, dt)
            for f in self.case.filaments.values()
        )

    def _choose_march(self) -> EvenSteps | ControlledSteps:
        step, time = self._choose_step(), self.case.time
        if time.tolerance is None:
            return EvenSteps(step, 2.0 if self._stepper.order == 2 else np.inf)
        rate = 2 * np.pi / (timescales.POINTS_A_PERIOD * step)
        return ControlledSteps(time.tolerance, rate, time.end, time.order, self.mechanics.length)

    def advance(self, until: float, after_step: Callable[[], None]) -> None:
        """Goes on to exactly ``until``; calls back after each step.

        Raises RunFailed where the rods diverge, over-stretch, or the step cannot be solved; Stopped at a contact
        that ends the run.
        """
        if self.steps == 0:
            self._watch(self.state_now)
        self._march.advance(self, until, after_step)

    def attempt(self, dt: float) -> Step:
        """A step of length dt from the present state, not yet taken."""
        step = self._stepper.step(self.mechanics, self.fluid, self.state_now, dt)
        if self._rods.contact is not None:
            self._rods.contact.refuse_passing(self.state_now, step.state)
        return step

    def may_halve(self, dt: float) -> bool:
        """Whether a step that failed may be tried with half its length.

        Not with noise: trying again only the steps whose kicks were large would bias them.
        """
        return 0.5 * dt >= self.case.time.min_step and self.case.time.scheme != "explicit" and self._noise is None

    def longest_step(self) -> float:
        """What the fluid's own motion leaves to steps that are not given; infinite for those that are."""
        time, longest = self.case.time, self.fluid.longest_step()
        if time.tolerance is not None or longest == np.inf:
            return longest
        if time.step != "auto":
            return np.inf
        assert self.grid is not None
        density, viscosity = self.case.fluid.density, self.case.fluid.viscosity
        assert density is not None
        return longest * timescales.crossing(density * self.grid.spacing**2 / (viscosity * longest))

    def give_up(self, reason: str, dt: float, node: int | None = None) -> None:
        """Raises RunFailed: no step of length dt can be taken, because of ``node`` if that is known."""
        self._fail(failures.unsolved(reason, dt, self.case.time.min_step, node, self._known(dt)))

    @property
    def shortened(self) -> int:
        """How many steps had to be tried again with a shorter one."""
        return self._march.shortened

    @property
    def step_length(self) -> float:
        """The longest step, or with a tolerance the present one."""
        return self._march.length

    def accept(self, step: Step, time: float) -> None:
        """Takes a step, which led to ``time``. Raises RunFailed where it led out of bounds, Stopped at a contact."""
        before, self.state_now = self.state_now, step.state._replace(time=time)
        self.fluid.advance(step.response, step.force)
        self._look_at_crossing(time - before.time)
        self._last = (step.velocity, step.force, step.reaction)
        self.steps += 1
        if self.steps > self.case.time.max_steps:
            message = f"{self.steps} steps are taken (allowed: time.max_steps = {self.case.time.max_steps})"
            cause = f"steps of {time - before.time:.3g} for a time.end of {self.case.time.end:g}"
            cure = "a larger time.max_steps, a longer time.step, or a larger time.tolerance"
            self._fail(failures.Trouble(message, None, cause, cure))
        self._iterations = step.iterations
        self._look_at_bounds(step.state.shape, time - before.time)
        self._watch(before)

    def _look_at_bounds(self, shape: Geometry, dt: float) -> None:
        rods = self.mechanics
        found = failures.out_of_bounds(rods.mesh, self._twisting, rods.stretching, shape)
        if found is not None:
            self._fail(found.trouble(self._known(dt)))

    def _known(self, dt: float) -> failures.Step:
        """What is known of a step that failed; the limit is that of the start, where the present is not finite."""
        explicit = self.case.time.scheme == "explicit"
        limit = timescales.explicit_limit(self.mechanics, self.fluid, self._rods.start, 0.0) if explicit else np.inf
        return failures.Step(dt, limit, self.case.thermal is not None and self.case.thermal.energy > 0)

    def _look_at_crossing(self, dt: float) -> None:
        """Tells, once, of a given step in which the fluid moves too far for its extrapolated advection."""
        longest = self.fluid.longest_step()
        if dt > longest and not self._told and self.longest_step() == np.inf:
            self._told = True
            self.notices.append(
                f"time.step: at t = {self.time:.4g} the fluid crosses {dt / longest:.2g} cells in a step; advection "
                f"is extrapolated, stable up to about one: take a step below {longest:.3g}"
            )

    def _watch(self, before: State) -> None:
        """Looks for a contact since ``before``, where the case has [contact]."""
        if self._rods.contact is not None:
            told = self._rods.contact.watch(before, self.state_now)
            self.notices += [told] if told else []

    @property
    def contacts(self) -> int:
        """How many pairs of segments touch now; zero where the case has no [contact]."""
        return 0 if self._rods.contact is None else self._rods.contact.near(self.shape.r).i.size

    def _fail(self, trouble: failures.Trouble) -> None:
        message, node, cause, cure = trouble
        if node is None:
            raise RunFailed(message, time=self.time, cause=cause, advice=cure)
        k = next(k for k, where in enumerate(self._rods.nodes) if node < where.stop)
        name, first = self._rods.names[k], self._rods.nodes[k].start
        raise RunFailed(message, time=self.time, filament=name, node=node - first, cause=cause, advice=cure)

    # -- what is looked at ---------------------------------------------------------------------------------------

    def _motion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity, force on the fluid and reaction (n, m): of the last step, or of the start."""
        if self._last is None:
            force, _ = self.mechanics.forces(self.state_now.shape, self.time)
            small, dt = 1e-6 * self.case.time.end / 1000, self.step_length
            index, value = self.mechanics.held(self.time, self.time + small)
            # Over a whole step at the speeds of this moment: a fluid with inertia resists a sudden start without limit.
            held = Held(index, value * (dt / small))
            response = self.fluid.response(self.state_now.shape.r, self.state_now.shape.e3, self.time, dt)
            answer = response.forced(force, held, np.zeros_like(force))
            self._last = (answer.move / dt, answer.force, answer.reaction)
        return self._last

    def frame(self, fields: Sequence[str] = ()) -> Frame:
        """All filaments now, with diagnostics; velocity and force are those of the step that led here."""
        now = Instant(self.state_now, *self._motion(), self._iterations, self.shortened)
        return self._diagnostics.frame(now, fields)

    # -- what must be kept ---------------------------------------------------------------------------------------

    def state(self) -> dict[str, np.ndarray | float | int | str]:
        """All that is needed to go on bit for bit, also between two outputs."""
        velocity, force, reaction = self._motion()
        return {
            "time": self.time,
            "steps": self.steps,
            "iterations": self._iterations,
            # Whole: measured again from r and e1 it may differ in the last bit (compilers fuse a b + c as they like).
            "shape": self.state_now.shape.table,
            "start": self.start.r,
            "y_old": self.state_now.y_old,
            "dt_old": self.state_now.dt_old,
            "velocity": velocity,
            "force": force,
            "reaction": reaction,
            **{f"march_{key}": value for key, value in self._march.state().items()},
            **{f"fluid_{key}": value for key, value in self.fluid.memory().items()},
            **({} if self._noise is None else {"random": self._noise.state()}),
            **({} if self._rods.contact is None else {"first_contact": self._rods.contact.since}),
            **({"laws": self._laws} if self._laws else {}),
        }

    def restore(self, state: dict[str, np.ndarray | float | int | str]) -> None:
        """Takes up a state that ``state`` gave.

        Raises CaseError where it was made with other laws from Python, or from a start shape that has changed since in
        the file or run it is read from.
        """
        if state.get("laws", "") != self._laws:
            found, wanted = self._laws or "none", state.get("laws") or "none"
            raise CaseError([f"{self.case.file}: laws: found {found}; the run began with {wanted}"])
        array = {k: np.ascontiguousarray(v) for k, v in state.items() if isinstance(v, np.ndarray)}
        number = {k: float(v) for k, v in state.items() if not isinstance(v, (np.ndarray, str))}
        self._same_start(array["start"])
        shape = Geometry(array["shape"])
        self.state_now = State(number["time"], shape, array["y_old"], number["dt_old"])
        self._last = (array["velocity"], array["force"], array["reaction"])
        self.steps, self._iterations = int(number["steps"]), int(number["iterations"])
        march = {k.removeprefix("march_"): v for k, v in (array | number).items() if k.startswith("march_")}
        self._march.restore(march)
        memory = {k.removeprefix("fluid_"): v for k, v in (array | number).items() if k.startswith("fluid_")}
        if memory:
            self.fluid.recall(memory)
        if self._noise is not None:
            self._noise.restore(str(state["random"]))
        if self._rods.contact is not None:
            self._rods.contact.since = number["first_contact"]

    def _same_start(self, began: np.ndarray) -> None:
        """Clamps and tethers hold the start shape, so it must be the one the run began with."""
        for name, where in zip(self._rods.names, self._rods.nodes, strict=True):
            moved = float(np.max(np.linalg.norm(self.start.r[where] - began[where], axis=1)))
            if moved > 1e-9 * self.mechanics.length:  # another machine may differ in the last bits
                found = f"a start shape that differs by {moved:.3g} from the one the run began with"
                allowed = "the file or run it is read from, as it was"
                raise CaseError([f"{self.case.file}: filament.{name}.shape: found {found}; allowed: {allowed}"])
