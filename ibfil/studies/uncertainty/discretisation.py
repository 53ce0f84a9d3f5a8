"""The errors of the discretisation of any numbers of a run: of the step, of the nodes, of the place in a cell."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ...errors import CaseError
from ..estimates import Estimate
from . import levels
from .refinement import Ladder
from .results import Source

if TYPE_CHECKING:
    import numpy as np

    from ..member import Member
    from ..runs import Runs
    from .levels import Base
    from .numbers import Numbered

SHELLS = "not looked at, the cells being as they are: `ibfil check` tells how far off the drag of each body is"
Found = dict[str, Source]  # of one source, by number


def refined(study: Runs, base: Base, recorded: Numbered, fine: bool) -> list[Found]:
    """The errors of step and nodes, and on a grid of the place in a cell; bodies there have one that is not known."""
    ladder = Ladder(base, recorded, study.make, study.run, study.why)
    in_time = levels.steps(base)
    under = levels.twice_the_step(base) if ladder.climb(in_time, fine) else ()
    in_space = levels.nodes(base, under)
    moved = _half_cell(base, under) if base.case.fluid.on_grid else None
    ladder.climb(in_space, fine, [] if moved is None or isinstance(moved, str) else [moved[0]])
    found = [ladder.sources(in_time), ladder.sources(in_space)]
    if moved is not None:
        found.append(_place(study, levels.level_member(base, in_space, 0), moved, recorded))
        if base.case.fluid.wall is not None:
            found[-1] = {k: replace(one, words=f"{one.words}, along the wall only") for k, one in found[-1].items()}
        if base.case.bodies:
            found.append({k: Source("shells of bodies", True, None, SHELLS) for k in recorded.numbers()})
    return found


def _half_cell(base: Base, under: tuple[str, ...]) -> tuple[Member, np.ndarray] | str:
    """The run half a cell aside, and the shift; or why there is none."""
    try:
        return levels.half_cell(base, under)
    except CaseError as error:
        return error.faults[0]


def _place(study: Runs, here: Member, moved: tuple[Member, np.ndarray] | str, recorded: Numbered) -> Found:
    """Half the difference to a run half a cell aside: places on and between grid points are the two extremes."""
    name, value = "place in a cell", recorded.numbers()
    if isinstance(moved, str):
        return {k: Source(name, True, None, moved) for k in value}
    own_run, run = study.run(here), study.run(moved[0])
    if own_run is None or run is None:
        return {k: Source(name, True, None, study.why(moved[0] if own_run is not None else here)) for k in value}
    there, out = recorded.back(run, moved[1]), {}
    for key, number in recorded.of(own_run).numbers().items():
        error = 0.5 * (number - there[key])
        told = Estimate(error, abs(error), None, "", (number, there[key]))
        out[key] = Source(name, True, told, "a run half a cell away")
    return out
