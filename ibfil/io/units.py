"""The labels of units that results carry. Nothing is ever converted."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..case.schema import Units


def label(units: Units, dimension: str) -> str:
    """Return the label of a dimension: "force length/time" with um, pN, s is "pN um/s".

    ``dimension`` is made of length, force, time and 1, multiplied by spaces and each divisor after a "/" of
    its own. A label "1" (the default) drops out.
    """
    top, *divisors = dimension.split("/")
    names = {"length": units.length, "force": units.force, "time": units.time}
    over = [names.get(word, word) for word in top.split()]
    under = [names.get(word.strip(), word.strip()) for word in divisors]
    product = " ".join(word for word in over if word != "1") or "1"
    return product + "".join(f"/{word}" for word in under if word != "1")
