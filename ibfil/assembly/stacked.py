"""All filaments of a scene, stacked node after node, with their mechanics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..rods.base import NoContact
from ..rods.geometry import Configuration
from ..rods.system import RodSystem

if TYPE_CHECKING:
    from ..case.filament import Filament
    from ..rods.contact import Contact


@dataclass(frozen=True)
class RodStack:
    """The rods of a scene: names and node ranges of its filaments, arclength (n,), and the whole of their mechanics."""

    names: tuple[str, ...]
    filaments: tuple[Filament, ...]
    nodes: tuple[slice, ...]
    s: np.ndarray
    system: RodSystem
    start: Configuration
    contact: Contact | NoContact

    @cached_property
    def twists(self) -> np.ndarray:
        """Which nodes are of filaments that twist (n,): e1 of others may come to differ from node to node."""
        return np.repeat([f.twisting is not None for f in self.filaments], [w.stop - w.start for w in self.nodes])

    @property
    def groups(self) -> tuple[tuple[slice, ...], ...]:
        """The node ranges of filaments that a preconditioner takes together."""
        return tuple((where,) for where in self.nodes)

    def locate(self, node: int) -> tuple[str, int]:
        """The filament that a node of the stack is of, and its number there."""
        k = next(k for k, where in enumerate(self.nodes) if node < where.stop)
        return self.names[k], node - self.nodes[k].start
