"""The discrete force that a filament asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..rods.system import RodSystem

if TYPE_CHECKING:
    from ..case.filament import Filament


def rod_system(filament: Filament) -> type[RodSystem]:
    """Eq. 44, or its torque-free form."""
    if filament.force == "torque-free":
        from ..rods.torque_free.mechanics import TorqueFree

        return TorqueFree
    return RodSystem
