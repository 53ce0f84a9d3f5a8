"""The fluids that a comparison may name: the models of a case, and resistive-force theory with other drag."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...case.schema import Case


def _matched(case: Case) -> tuple[str, ...]:
    """The drag of a straight rod dragged through the case's grid, as long as the longest filament."""
    if case.fluid.drag_matched is not None:
        return ("fluid.model=rft",)
    length = max(filament.length for filament in case.filaments.values())
    return ("fluid.model=rft", f"fluid.drag={{matched={length!r}}}")


def _slender(case: Case) -> tuple[str, ...]:
    return ("fluid.model=rft", "fluid.drag=slender")


def _rft(case: Case) -> tuple[str, ...]:
    return ("fluid.model=rft", "fluid.drag=paper") if case.fluid.drag_matched else ("fluid.model=rft",)


_OTHERS = {"rft": _rft, "matched": _matched, "slender": _slender}


def known_fluids() -> tuple[str, ...]:
    """The names that may be asked for."""
    from ...assembly.fluids.models import MODELS

    return (*_OTHERS, *(model for model in MODELS if model not in _OTHERS))


def fluid_overrides(name: str, case: Case) -> tuple[str, ...]:
    """The overrides that turn a case into one with that fluid."""
    return _OTHERS[name](case) if name in _OTHERS else (f"fluid.model={name}",)
