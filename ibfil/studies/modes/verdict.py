"""Whether a scene is stable where it rests, in a line: for `ibfil check --rest`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...errors import CaseError, RunFailed
from .kinds import Shape
from .study import own_modes

if TYPE_CHECKING:
    from ...case.schema import Case
    from .results import Mode


def at_rest(case: Case) -> list[str]:
    """The lines: the mode that grows fastest or decays slowest at the rest next to the start, or why none is known."""
    from ...simulation.at_rest import SceneAtRest
    from ...simulation.simulation import Simulation

    try:
        scene = SceneAtRest(Simulation(case))
        rest = scene.next_rest()
    except CaseError as error:
        return [f"not known: {error.faults[0]}"]
    except RunFailed as failure:
        return [f"not known: {failure.message}"]
    step = scene.simulation.step_length
    found, *_ = own_modes(scene, scene.motion(rest.configuration), Shape(scene, rest.configuration), 1, step)
    return [_line(found[0])] if found else ["neither grows nor decays: nothing strains or carries it"]


def _line(mode: Mode) -> str:
    growth, turning = mode.value.real, abs(mode.value.imag)
    swings = f" at the angular frequency {turning:.4g}" if turning else ""
    if growth > 0:
        leads = "" if mode.kind.rigid else ", `ibfil rest` the rest it leads to"
        return (
            f"UNSTABLE: {mode.kind.word}{swings} grows by a factor e in {1 / growth:.4g} from any disturbance, "
            f"round-off too; `ibfil modes` has it with its error bar{leads}"
        )
    return f"stable: the slowest mode, {mode.kind.word}{swings}, decays by a factor e in {-1 / growth:.4g}"
