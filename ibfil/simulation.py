"""A case come alive: the present state, how it goes on, and what of it is looked at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from . import assemble, timescales
from .errors import RunFailed
from .frames import FilamentFrame, Frame
from .geometry import Geometry
from .mechanics import TangentReversed
from .stepping import NotConverged, State, Step

if TYPE_CHECKING:
    from .case import Case
    from .fields import GridFields

_LONGEST, _SHORTEST = 2.0, 0.2  # of the rest length: beyond this a segment is no rod any more
_LARGEST_TWIST = 0.95  # of sin(O3 ds): Eq. 39 stops resisting at 1


@njit(cache=True)
def _survey(joined, ds, r, length, twist):
    """The largest and smallest |d|/ds, the largest |O3 ds|, the node of each; and the first node that is not finite."""
    high, low, turn = 0.0, np.inf, 0.0
    where = np.zeros(3, np.int64)
    for i in range(joined.size):
        if not np.isfinite(r[i, 0] + r[i, 1] + r[i, 2]):
            return high, low, turn, where, i
        if joined[i]:
            q = length[i] / ds[i]
            if q > high:
                high, where[0] = q, i
            if q < low:
                low, where[1] = q, i
            if abs(twist[i] * ds[i]) > turn:
                turn, where[2] = abs(twist[i] * ds[i]), i
    return high, low, turn, where, -1


class Simulation:
    """One run of a case, at the present ``time`` after ``steps`` steps.

    ``method`` names the fluid's path, ``warnings`` what the user should know, ``grid`` the fluid's grid or None.
    Raises CaseError where the scene cannot be built.
    """

    def __init__(self, case: Case, wisdom: str = "") -> None:
        self.case = case
        self._rods = assemble.rods(case)
        self.mechanics = self._rods.mechanics
        self._wisdom = wisdom
        needs_plans = case.fluid.model != "rft" and case.fluid.method == "fft"
        if needs_plans:
            self._learn()
        self._fluid, self.method, self.grid = assemble.fluid(case, self._rods)
        self._stepper = assemble.stepper(case)
        n, m = len(self._rods.s), self.mechanics.unknowns
        self._state = State(0.0, self._rods.start, np.zeros((n, m)), 0.0)
        self.steps, self.shortened = 0, 0
        self._iterations = 0
        self._plan = (0.0, 0.0, 1, 0)  # interval start and end, its number of steps, those taken
        self._fields: GridFields | None = None
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        if needs_plans:
            self._remember()
        self.step_length = self._choose_step()

    @property
    def time(self) -> float:
        """Present time, in the case's unit."""
        return self._state.time

    @property
    def shape(self) -> Geometry:
        """The present configuration of all nodes."""
        return self._state.shape

    @property
    def start(self) -> Geometry:
        """The configuration the case begins with."""
        return self._rods.start

    @property
    def arclength(self) -> np.ndarray:
        """Arclength (n,) of all nodes, 0 at each filament's start."""
        return self._rods.s

    def nodes(self, name: str) -> slice:
        """The range of nodes of the filament of that name."""
        return self._rods.nodes[self._rods.names.index(name)]

    @property
    def groups(self) -> dict[str, float]:
        """The dimensionless groups of the scene."""
        from .groups import groups

        return groups(self)

    @property
    def warnings(self) -> list[str]:
        """What should make the user look twice, one sentence each."""
        from .groups import warnings

        return warnings(self)

    @property
    def wisdom(self) -> str:
        """FFTW plans in use, as one line of text; empty where no step transforms a field."""
        if self.method != "fft":
            return ""
        from . import transforms

        return transforms.wisdom()

    def _learn(self) -> None:
        from . import transforms

        transforms.learn(self._wisdom)

    def _remember(self) -> None:
        from . import transforms

        transforms.remember()

    # -- how it goes on ------------------------------------------------------------------------------------------

    def driving_rates(self) -> list[float]:
        """How fast the scene is driven, radians per time: curvature, spin, loads."""
        case, rates = self.case, []
        for filament in case.filaments.values():
            s = np.linspace(0.0, filament.length, 101)
            for expression in (*filament.curvature, filament.twist_rate):
                if "t" in expression.variables:
                    value = expression.bind("s", "t")
                    rates.append(timescales.angular_rate(lambda t, v=value: v(s, t), case.time.end))  # type: ignore[misc]
            for end in (filament.start, filament.finish):
                rates += self._end_rates(filament, end)
        return rates

    def _end_rates(self, filament, end) -> list[float]:
        rates, horizon = [], self.case.time.end
        if end.spin is not None:
            spin = end.spin.bind("t")
            rates.append(max(abs(float(spin(t))) for t in np.linspace(0.0, horizon, 101)))
        if end.angle is not None:
            angle = end.angle.bind("t")
            times = np.linspace(0.0, horizon, 1001)
            rates.append(float(np.max(np.abs(np.gradient([float(angle(t)) for t in times], times)))))
        if end.follower is not None:
            load = end.follower.bind("t")
            size = max(abs(float(load(t))) for t in np.linspace(0.0, horizon, 101))
            # A steady load has no period; it moves a rod by its length in zeta L^2/F.
            rates.append(2 * np.pi * size / (self.drag(filament) * filament.length**2))
            if "t" in end.follower.variables:
                rates.append(timescales.angular_rate(lambda t: np.atleast_1d(load(t)), horizon))
        return rates

    def drag(self, filament) -> float:
        """A drag per length across, for time scales: the case's own in RFT, 4 pi eta on a grid."""
        eta = self.case.fluid.viscosity
        if self.case.fluid.model != "rft":
            return 4 * np.pi * eta
        radius = None if filament.radius is None else np.atleast_1d(filament.radius.bind("s", "t")(0.0, 0.0))
        return assemble.drag_coefficients(self.case, filament, radius)[0]

    def bending_time(self) -> float:
        """Relaxation time of the slowest bending mode of any filament."""
        times = []
        for f in self.case.filaments.values():
            s = np.linspace(0.0, f.length, 11)
            softest = min(float(np.min(a.bind("s", "t")(s, 0.0))) for a in f.bending)
            times.append(
                timescales.bending_time(self.drag(f), f.length, softest, f.start.end, f.finish.end)
            )
        return max(times)

    def explicit_limit(self) -> float:
        """The largest stable step of the explicit scheme at the present configuration, 2/rho(M K)."""
        return timescales.explicit_limit(self.mechanics, self._fluid, self._state.shape, self.time)

    def _choose_step(self) -> float:
        if self.case.time.step != "auto":
            return float(self.case.time.step)
        if self.case.time.scheme == "explicit":
            return 0.5 * self.explicit_limit()
        return timescales.implicit_step(self.driving_rates(), self.bending_time())

    def advance(self, until: float, after_step: Callable[[], None]) -> None:
        """Goes on to exactly ``until``, in equal steps no longer than the step's length; calls back after each.

        Raises RunFailed where the rods diverge, over-stretch, or the step cannot be solved.
        """
        start, end, count, done = self._plan
        if end != until or done >= count:
            start, done = self.time, 0
            count = max(1, int(np.ceil((until - start) / self.step_length * (1 - 1e-9))))
        while done < count:
            self._plan = (start, until, count, done)
            goal = until if done + 1 == count else start + (until - start) * ((done + 1) / count)
            self._step_to(goal)
            done += 1
            self._plan = (start, until, count, done)
            after_step()

    def _step_to(self, goal: float) -> None:
        """One step, or as many halves as Newton needs."""
        dt = goal - self.time
        floor = self.case.time.min_step
        while self.time < goal:
            dt = min(dt, goal - self.time)
            if goal - self.time - dt < 1e-9 * dt:
                dt = goal - self.time
            try:
                step = self._stepper.step(self.mechanics, self._fluid, self._state, dt)
            except (NotConverged, TangentReversed, np.linalg.LinAlgError) as error:
                if 0.5 * dt < floor or self.case.time.scheme == "explicit":
                    self._fail(str(error), None, "a shorter time.step, or a smoother start")
                dt *= 0.5
                self.shortened += 1
                continue
            self._accept(step, goal if goal - self.time - dt <= 0 else self.time + dt)

    def _accept(self, step: Step, time: float) -> None:
        self._state = step.state._replace(time=time)
        self._last = (step.velocity, step.force, step.reaction)
        self.steps += 1
        self._iterations = step.iterations
        shape, mesh = step.state.shape, self.mechanics.mesh
        high, low, turn, where, bad = _survey(mesh.joined, mesh.ds, shape.r, shape.length, shape.twist)
        if bad >= 0:
            self._fail("a position is not finite: the run diverged", bad, self._advice())
        if high > _LONGEST or low < _SHORTEST:
            at, ratio = (where[0], high) if high > _LONGEST else (where[1], low)
            self._fail(
                f"a segment is {ratio:.3g} times its rest length (allowed {_SHORTEST} to {_LONGEST})",
                int(at),
                self._advice(),
            )
        if turn > _LARGEST_TWIST:
            self._fail(
                f"the twist between two nodes nears a quarter turn (sin = {turn:.3g}), where Eq. 39 stops resisting",
                int(where[2]),
                "more nodes, a shorter time.step, or a slower spin",
            )

    def _advice(self) -> str:
        if self.case.time.scheme == "explicit":
            return f"time.step below {self.explicit_limit_or_nan():.3g} (the explicit limit), or time.scheme=implicit"
        return "a shorter time.step; if it persists, check stretching, loads and viscosity"

    def explicit_limit_or_nan(self) -> float:
        """The explicit limit at the start shape, for messages when the present one is no longer finite."""
        return timescales.explicit_limit(self.mechanics, self._fluid, self._rods.start, 0.0)

    def _fail(self, message: str, node: int | None, advice: str) -> None:
        name = None
        if node is not None:
            for name, where in zip(self._rods.names, self._rods.nodes, strict=True):
                if where.start <= node < where.stop:
                    node -= where.start
                    break
        raise RunFailed(message, time=self.time, filament=name, node=node, advice=advice)

    # -- what is looked at ---------------------------------------------------------------------------------------

    def _motion(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Velocity, force on the fluid and reaction (n, m): of the last step, or of the start."""
        if self._last is None:
            force, _ = self.mechanics.forces(self._state.shape, self.time)
            small = 1e-6 * self.step_length
            held = self.mechanics.held(self.time, self.time + small)
            response = self._fluid.response(self._state.shape.r, self._state.shape.e3, self.time, small)
            answer = response.forced(force, held, np.zeros_like(force))
            self._last = (answer.move / small, answer.force, answer.reaction)
        return self._last

    def frame(self, fields: Sequence[str] = ()) -> Frame:
        """All filaments now, with diagnostics; velocity and force are those of the step that led here."""
        velocity, force, reaction = self._motion()
        shape = self._state.shape
        moment, strain = self._nodal_moment()
        filaments = {}
        for name, description, where in zip(
            self._rods.names, self._rods.filaments, self._rods.nodes, strict=True
        ):
            segment = slice(where.start, where.stop - 1)
            stretch = shape.length[segment] / self.mechanics.mesh.ds[segment] - 1.0
            ends = (
                reaction[i, :3].copy() if end.end != "free" else None
                for i, end in ((where.start, description.start), (where.stop - 1, description.finish))
            )
            filaments[name] = FilamentFrame(
                shape.r[where].copy(),
                velocity[where, :3].copy(),
                force[where, :3].copy(),
                shape.e1[where].copy(),
                moment[where],
                strain[where],
                self.mechanics.stretching[segment] * stretch,
                *ends,
            )
        grid = self._grid_fields(fields, force) if fields else None
        return Frame(self.time, filaments, self._diagnostics(velocity, force), grid)

    def _nodal_moment(self) -> tuple[np.ndarray, np.ndarray]:
        """Moment and strain (n, 3) at nodes: the third component is the mean of the half nodes beside it."""
        shape, mesh = self._state.shape, self.mechanics.mesh
        moment = self.mechanics.moment(shape, self.time)
        beside = mesh.joined.astype(float) + np.append(False, mesh.joined[:-1])
        thirds = []
        for half in (moment.twist, shape.twist):
            half = np.where(mesh.joined, half, 0.0)
            thirds.append((half + np.append(0.0, half[:-1])) / beside)
        return np.column_stack([moment.bend, thirds[0]]), np.column_stack([shape.bend, thirds[1]])

    def _diagnostics(self, velocity: np.ndarray, force: np.ndarray) -> dict[str, float | np.ndarray]:
        shape, mesh = self._state.shape, self.mechanics.mesh
        stretch = (shape.length / mesh.ds)[mesh.joined] - 1.0
        torque = np.cross(shape.r, force[:, :3]).sum(axis=0)
        if force.shape[1] == 4:
            torque = torque + (force[:, 3:] * shape.e3).sum(axis=0)
        return {
            "net_force": force[:, :3].sum(axis=0),
            "net_torque": torque,
            "stretch_max": float(stretch.max()),
            "stretch_min": float(stretch.min()),
            "power": float(np.sum(velocity * force)),
            "newton_iterations": float(self._iterations),
        }

    def _grid_fields(self, fields: Sequence[str], force: np.ndarray) -> dict[str, np.ndarray]:
        """Fields on the grid: one evaluation of the fluid."""
        assert self.grid is not None
        if self._fields is None:
            from .fields import GridFields

            fluid = self.case.fluid
            self._fields = GridFields(
                self.grid, fluid.viscosity, assemble.flow(self.case), self.case.compute.threads
            )
        base, weights = assemble.kernel(self.case).stencil(self.grid.coordinates(self._state.shape.r))
        return self._fields.evaluate(base, weights, np.ascontiguousarray(force[:, :3]), self.time, fields)

    # -- what must be kept ---------------------------------------------------------------------------------------

    def state(self) -> dict[str, np.ndarray | float | int | str]:
        """All that is needed to go on bit for bit, also between two outputs."""
        shape = self._state.shape
        velocity, force, reaction = self._motion()
        start, end, count, done = self._plan
        return {
            "time": self.time,
            "steps": self.steps,
            "shortened": self.shortened,
            "iterations": self._iterations,
            "position": shape.r,
            "e1": shape.e1,
            "y_old": self._state.y_old,
            "dt_old": self._state.dt_old,
            "velocity": velocity,
            "force": force,
            "reaction": reaction,
            "plan_start": start,
            "plan_end": end,
            "plan_count": count,
            "plan_done": done,
            "step_length": self.step_length,
        }

    def restore(self, state: dict[str, np.ndarray | float | int | str]) -> None:
        """Takes up a state that ``state`` gave."""
        array = {k: np.ascontiguousarray(v) for k, v in state.items() if isinstance(v, np.ndarray)}
        number = {k: float(v) for k, v in state.items() if not isinstance(v, (np.ndarray, str))}
        shape = self.mechanics.measure(array["position"], array["e1"])
        self._state = State(number["time"], shape, array["y_old"], number["dt_old"])
        self._last = (array["velocity"], array["force"], array["reaction"])
        self.steps, self.shortened = int(number["steps"]), int(number["shortened"])
        self._iterations = int(number["iterations"])
        self._plan = (
            number["plan_start"],
            number["plan_end"],
            int(number["plan_count"]),
            int(number["plan_done"]),
        )
        self.step_length = number["step_length"]
