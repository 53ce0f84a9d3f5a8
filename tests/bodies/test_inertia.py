"""Bodies in a fluid with inertia: its limit, and the fluid at the markers after each step."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bacterium import BOX, bacterium

INERTIAL = BOX.replace('"stokes"', '"navier-stokes"') + "\ndensity = {density}"


def test_with_little_inertia_a_bacterium_moves_as_without():
    """To the tolerance of Newton's iteration over a step; with more of it differently."""
    found = []
    for fluid in (BOX, INERTIAL.format(density=1e-6), INERTIAL.format(density=30.0)):
        sim = bacterium(fluid, nodes=13)
        sim.advance(0.06, lambda: None)
        found.append(sim.snapshot().bodies["head"])
    np.testing.assert_allclose(found[1].velocity, found[0].velocity, atol=2e-4 * np.linalg.norm(found[0].velocity))
    np.testing.assert_allclose(found[1].spin, found[0].spin, atol=2e-4 * np.linalg.norm(found[0].spin))
    assert np.linalg.norm(found[2].velocity - found[0].velocity) > 1e-2 * np.linalg.norm(found[0].velocity)


@pytest.mark.parametrize("rotation", ["local", "grid"])
def test_the_fluid_with_inertia_moves_with_the_body_after_each_step(rotation):
    """At the markers its new velocity, of the grid's own fields, is that of the rigid body; a run goes on as it was."""
    sim = bacterium(INERTIAL.format(density=10.0) + f'\nrotation = "{rotation}"', nodes=13)
    sim.advance(0.04, lambda: None)
    again = bacterium(INERTIAL.format(density=10.0) + f'\nrotation = "{rotation}"', nodes=13)
    again.restore(sim.state())
    for one in (sim, again):
        step = one.attempt(0.02)
        one.accept(step, 0.06)
        there, n, shells = step.there, one.system.rows.n, one.fluid.immersed.shells
        places = shells.places(there.r, there.e3)
        u = one.fluid.velocity_at(places, there.r, there.e3, step.force, 0.06)
        turn = step.velocity[n + 1, :3] / one.system.rows.length
        known = step.velocity[n, :3] + np.cross(turn, places - there.r[n])
        np.testing.assert_allclose(u, known, atol=1e-10 * np.abs(known).max())
        assert np.abs(one.snapshot().diagnostics["net_force"]).max() < 1e-12 * np.abs(step.force).max()
    np.testing.assert_array_equal(sim.configuration.table, again.configuration.table)
    assert sim.snapshot().diagnostics["dissipation"] == again.snapshot().diagnostics["dissipation"]
