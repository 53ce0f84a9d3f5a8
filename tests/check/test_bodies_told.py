"""The line of a body: who pushes it."""

from __future__ import annotations

import pytest
from helpers.bacterium import FREE, bacterium

from ibfil.check.bodies import of_body

BY_NOTHING, BY_HOLDING = "nothing pushes it from outside", "what holds or moves it"
GIVEN = {
    "": (BY_NOTHING,),
    'motion = "held"': ("held", BY_HOLDING),
    'motion = { moves = ["t", "0", "0"] }': ("moved as given", BY_HOLDING),
    "force = [1.0, 0, 0]": ("external force in the lab",),
}


@pytest.mark.parametrize("keys", GIVEN)
def test_a_body_that_is_held_is_not_said_to_be_pushed_by_nothing(keys):
    more = f'[body.other]\nshape = {{ kind = "sphere", radius = 0.2 }}\nposition = [0, 2, 0]\n{keys}'
    line = of_body(bacterium(FREE, more=more).case, "other")
    for words in {BY_NOTHING, BY_HOLDING, *GIVEN[keys]}:
        assert (words in line) == (words in GIVEN[keys]), line
