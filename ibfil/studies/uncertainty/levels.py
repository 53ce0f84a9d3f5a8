"""The runs from which errors are told: levels of the step and of the nodes, a place in the cell, choices, seeds.

Levels of a direction are numbered from the base, 0: -1 is coarser by two, 1 and 2 are finer by two and four. Each run
is the base's case with a few overrides; rules that end a run are dropped, so that all end where the base did. Errors of
nodes and places do not depend on the step, so they are told from runs with twice the step where that showed its order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import CaseError
from ..member import Member
from . import place

if TYPE_CHECKING:
    from ...io.reader import RunFile
    from ...simulation.simulation import Simulation

FEWEST = 9  # nodes of a coarser level
TOLERANCE = 8.0  # ratio of two tolerances: a step is about its square root
WIDER, STIFFER = 1.5, 4.0  # of the box, of EA
NEAR = 0.8  # of a cell: nodes nearer than that lock without slip
SEEDS = 8
_NAMES = {-1: "coarse", 1: "fine", 2: "finest"}


class Direction(NamedTuple):
    """A direction of refinement: its name, nominal order, whether it has a coarser level, its overrides by level.

    ``size`` is what falls along it, of a run; ``under`` are the overrides of all its levels, the base's own included;
    ``finest``: whether a second finer level tells more where the first shows no order.
    """

    name: str
    nominal: float
    coarser: bool
    overrides: Callable[[int], tuple[str, ...]]
    size: Callable[[RunFile], float]
    words: Callable[[RunFile], str]
    under: tuple[str, ...] = ()
    finest: bool = True


class Base:
    """The base run of a study: its member, its scene, and the facts of its run that other runs depend on."""

    def __init__(self, member: Member, simulation: Simulation, run: RunFile) -> None:
        self.member, self.simulation, self.case = member, simulation, simulation.case
        self.end, self.steps = float(run.time[-1]), run.steps
        self.pushed = net_force(run)

    def member_of(self, name: str, overrides: Sequence[str]) -> Member:
        """A run that differs from the base by some keys; it ends where the base did, whatever ended that."""
        ended = ("stop=[]", "expect={}", f"time.end={self.end!r}") if self.end < self.case.time.end else ()
        return Member(name, self.member.case, (*self.member.overrides, *ended, *overrides))

    @property
    def step(self) -> float:
        """The step of the base, as it was set or chosen."""
        time = self.case.time
        if time.automatic and self.case.fluid.inertial:
            return self.end / max(self.steps, 1)  # as it was on average: the fluid shortens it as it moves
        return self.simulation.step_length

    @property
    def same_step(self) -> tuple[str, ...]:
        """The override that keeps the step where other keys would choose another one."""
        time = self.case.time
        given = time.tolerance is not None or not time.automatic or self.case.fluid.inertial
        return () if given else (f"time.step={self.step!r}",)


def net_force(run: RunFile) -> bool:
    """Whether the rods push the fluid with a net force, from outside: the box weakens its flow slowly then."""
    net = np.linalg.norm(np.asarray(run.diagnostics["net_force"]), axis=1)
    whole = sum(np.abs(np.asarray(columns["force"])).sum(axis=(1, 2)) for columns in run.filaments.values())
    return bool(np.max(net) > 1e-6 * max(float(np.max(whole)), 1e-300))


# --- directions -------------------------------------------------------------------------------------------------------


def steps(base: Base) -> Direction:
    """The direction of shorter steps."""
    time = base.case.time

    def overrides(level: int) -> tuple[str, ...]:
        if time.tolerance is not None:
            return (f"time.tolerance={float(time.tolerance * TOLERANCE ** (-level))!r}",)
        return (f"time.step={float(base.step * 2.0 ** (-level))!r}",)

    # Explicit steps are as long as they may be.
    return Direction("step", float(time.order), not time.explicit, overrides, _step_taken, _step_words)


def _step_taken(run: RunFile) -> float:
    return float(run.time[-1]) / max(run.steps, 1)


def _step_words(run: RunFile) -> str:
    return f"{run.steps} steps"


def twice_the_step(base: Base) -> tuple[str, ...]:
    """The overrides of the coarser level of the step."""
    return steps(base).overrides(-1)


def nodes(base: Base, under: tuple[str, ...]) -> Direction:
    """The direction of more nodes, all filaments together, at the step of the base or that of ``under``."""
    counts = {name: f.nodes for name, f in base.case.filaments.items()}

    def count(n: int, level: int) -> int:
        return (n - 1) // 2 + 1 if level < 0 else (n - 1) * 2**level + 1

    def overrides(level: int) -> tuple[str, ...]:
        return tuple(f"filament.{name}.nodes={count(n, level)}" for name, n in counts.items())

    coarser = min(count(n, -1) for n in counts.values()) >= FEWEST
    # On a grid more nodes scatter, and do not show an order sooner: the dearest run of all would tell nothing.
    finest = not base.case.fluid.on_grid
    return Direction("nodes", 2.0, coarser, overrides, _segment, _node_words, under or base.same_step, finest)


def _segment(run: RunFile) -> float:
    return float(np.mean([1.0 / (f.nodes - 1) for f in run.case.filaments.values()]))


def _node_words(run: RunFile) -> str:
    return f"{'/'.join(dict.fromkeys(str(f.nodes) for f in run.case.filaments.values()))} nodes"


def level_member(base: Base, direction: Direction, level: int) -> Member:
    """The run of a level, 0 the base itself, or what stands for it under other keys."""
    if level == 0 and direction.under in ((), base.same_step):
        return base.member
    name = f"{direction.name}_{_NAMES[level]}" if level else f"{direction.name}_base"
    return base.member_of(name, (*direction.under, *(direction.overrides(level) if level else ())))


# --- single runs ------------------------------------------------------------------------------------------------------


def half_cell(base: Base, under: tuple[str, ...]) -> tuple[Member, np.ndarray]:
    """The run half a cell aside along all axes, and the shift (3,). Raises CaseError where it cannot be moved."""
    from ...assembly.grid import spacing

    shift = np.full(3, 0.5 * spacing(base.case))
    if base.case.fluid.thin_axis is not None:
        shift[base.case.fluid.thin_axis] = 0.0  # sheets stay in their plane
    if base.case.fluid.wall is not None:
        shift[2] = 0.0  # another height would be another scene
    overrides = (*place.moved(base.simulation, shift), *(under or base.same_step))
    return base.member_of("place", overrides), shift


def wider_box(base: Base) -> tuple[Member, float]:
    """The run in a wider box of the same cells, and how much wider it is. Raises CaseError where there is none."""
    from ...assembly.grid import spacing

    case, h = base.case, spacing(base.case)
    assert case.fluid.sides is not None
    if case.fluid.thin_axis is not None:
        raise CaseError(["sheets in a plane flow: no law of their images is known"])
    for factor in (WIDER, 1.6, 1.75, 2.0):
        cells = np.ceil(np.round(np.array(case.fluid.sides) / h) * factor - 1e-9).astype(int)
        box = [float(n * h) for n in cells]
        keys = f"fluid.box={box}", *(() if case.fluid.cells is None else (f"fluid.cells={cells.tolist()}",))
        member = base.member_of("wider_box", (*keys, *base.same_step))
        try:
            there = spacing(member.resolved())
        except CaseError:
            continue
        if abs(there - h) < 1e-9 * h:
            return member, box[0] / case.fluid.sides[0]
    raise CaseError([f"{case.file}: fluid.box: found none 1.5 to 2 times as wide with the same cells"])


def without_slip(base: Base) -> Member | None:
    """The run without slip; None where there is none, or nodes would lock."""
    from ...check.dimensionless import groups

    near = min((value for key, value in groups(base.simulation).items() if key.endswith("ds/h")), default=0.0)
    if not base.case.fluid.on_grid or base.case.fluid.slip == 0 or near < NEAR:
        return None
    return base.member_of("no_slip", ("fluid.slip=0", *base.same_step))


def stiffer(base: Base) -> Member:
    """The run with rods that stretch less."""
    keys = (f"filament.{name}.stretching={STIFFER!r}*({f.stretching.text})" for name, f in base.case.filaments.items())
    return base.member_of("stretching", (*keys, *base.same_step))


def seeded(base: Base) -> list[Member]:
    """The runs with other random numbers."""
    thermal = base.case.thermal
    assert thermal is not None
    return [base.member_of(f"seed_{k}", (f"thermal.seed={thermal.seed + k}",)) for k in range(1, SEEDS)]
