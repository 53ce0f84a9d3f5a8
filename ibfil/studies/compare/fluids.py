"""The fluids that a comparison may name: the models of a case, and resistive-force theory with other drag.

Between a periodic box and free space the spacing of the grid is kept, and with it the thickness of the rods.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import CaseError

if TYPE_CHECKING:
    from ...case.schema import Case

TIMES = 3.0  # of the longest filament: the least side of the box that a case without one is given


def _matched(case: Case) -> tuple[str, ...]:
    """The drag of a straight rod dragged through the case's grid, as long as the longest filament."""
    if case.fluid.drag_matched is not None:
        return ("fluid.model=rft",)
    return ("fluid.model=rft", f"fluid.drag={{matched={_longest(case)!r}}}")


def _slender(case: Case) -> tuple[str, ...]:
    return ("fluid.model=rft", "fluid.drag=slender")


def _rft(case: Case) -> tuple[str, ...]:
    return ("fluid.model=rft", "fluid.drag=auto") if case.fluid.drag_matched else ("fluid.model=rft",)


def _wall(case: Case) -> tuple[str, ...]:
    """Above the case's own wall. Raises CaseError where it has none: a scene has to be made for one."""
    if case.fluid.wall is None:
        raise CaseError(["--fluids: found wall, and no fluid.wall in the case; allowed: wall with fluid.wall"])
    return ("fluid.model=stokes",)


def _no_wall(case: Case) -> tuple[str, ...]:
    """Without the wall, and without what is pumped along it."""
    if case.fluid.wall is None:
        return ()
    pumped = [name for name, entry in case.observe.items() if entry.pumps]
    expected = [name for name, entry in case.expect.items() if entry.observe in pumped]
    gone = [f"observe.{name}" for name in pumped] + [f"expect.{name}" for name in expected]
    return tuple(f"{key}=absent" for key in ("fluid.wall", *gone))


def _free(case: Case) -> tuple[str, ...]:
    """Free space, with the spacing of the case's box; fields in a window as large as that."""
    if case.fluid.sides is None:
        return ("fluid.model=stokes", *_no_wall(case))
    from ...assembly.grid import spacing

    taken = ("fluid.cells=absent", "fluid.thickness=absent", f"fluid.spacing={spacing(case)!r}", "fluid.method=auto")
    fields = () if case.output.grid_every is None else (f"output.window={list(case.fluid.sides)}",)
    return ("fluid.model=stokes", "fluid.box=free", *taken, *fields)


def _periodic(model: str, case: Case) -> tuple[str, ...]:
    """The case's own box; where it has none a cube with its spacing, TIMES as long as the longest filament."""
    if not case.fluid.free:
        return (f"fluid.model={model}", *_no_wall(case))
    from ...assembly.grid import spacing
    from ...grid.periodic_grid import smooth

    h = spacing(case)
    least = int(np.ceil(TIMES * _longest(case) / h))
    n = next(k for k in range(least, 2 * least + 1) if smooth(k))
    taken = ("fluid.spacing=absent", "fluid.thickness=absent", "output.window=absent", "output.window_at=absent")
    box = (f"fluid.box={[n * h] * 3}", f"fluid.cells={[n] * 3}")
    return (f"fluid.model={model}", *box, *taken, *_no_wall(case))


def _longest(case: Case) -> float:
    return max(filament.length for filament in case.filaments.values())


_OTHERS = {"rft": _rft, "matched": _matched, "slender": _slender, "free": _free, "wall": _wall}


def known_fluids() -> tuple[str, ...]:
    """The names that may be asked for."""
    from ...assembly.fluids.models import MODELS

    return (*_OTHERS, *(model for model in MODELS if model not in _OTHERS))


def fluid_overrides(name: str, case: Case) -> tuple[str, ...]:
    """The overrides that turn a case into one with that fluid. Raises CaseError where it cannot be."""
    return _OTHERS[name](case) if name in _OTHERS else _periodic(name, case)
