"""The kinds of observables that look at a link, read off each output."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..errors import CaseError
from ..io.snapshots import LinkSnapshot, Snapshot
from .base import ObservableBase, Unfit, Value

if TYPE_CHECKING:
    from ..case.observe import Observe
    from ..case.schema import Case


_OVER: dict[str, str] = {"none": "mean", "mean": "mean", "max": "max", "min": "min"}


class OfLink(ObservableBase):
    """A number of each element of a link: their mean, max or min."""

    keys: ClassVar[tuple[str, ...]] = ("link", "space", "over", "summary")
    part: ClassVar[str] = ""  # of a LinkSnapshot
    of_bound: ClassVar[str] = ""  # the dimension for bound filaments, whose forces are per length

    def __init__(self, case: Case, observe: Observe) -> None:
        super().__init__(case, observe)
        self.link, self.space = observe.link, _OVER[observe.space]
        table = case.links[self.link]
        if self.part not in table.parts:
            having = [name for name, other in case.links.items() if self.part in other.parts]
            raise Unfit("link", self.link, f"a link that has a {self.part}: {', '.join(having) or 'there is none'}")
        if table.per_length:
            self.dimension = self.summary_dimension = self.of_bound

    def values(self, snapshot: Snapshot) -> np.ndarray:
        """The numbers (K,) of the elements. Raises CaseError for a copy of a link that there is not."""
        found: LinkSnapshot | None = snapshot.links.get(self.link)
        if found is None:
            names = ", ".join(list(snapshot.links)[:3])
            raise CaseError([f'an observable: link: found "{self.link}"; allowed: {names} ...'])
        return np.asarray(getattr(found, self.part))

    def sample(self, snapshot: Snapshot) -> Value:
        """At one output."""
        return float(getattr(np, self.space)(self.values(snapshot)))


class LinkTension(OfLink, kind="link_tension"):
    """Tension of a spring, positive where it draws its ends together; of bound filaments across, per length."""

    part, of_bound = "tension", "force/length"
    dimension = "force"
    description = "tension"


class LinkSlide(OfLink, kind="link_slide"):
    """Slide of the second of two bound filaments along the first."""

    part, of_bound = "slide", "length"
    dimension = "length"
    description = "slide"


class LinkShear(OfLink, kind="link_shear"):
    """Shear force per length on the second of two bound filaments, along it; motors and active force included."""

    part, of_bound = "shear", "force/length"
    dimension = "force/length"
    description = "shear force per length"
