"""A swimming sheet in a fluid with inertia, against Tuck 1968 (J. Fluid Mech. 31, 305).

A sheet y = b sin(k x - omega t) whose points move across only pumps fluid along at

    U = omega k b^2/2 (1 + F)/(2 F),     F^2 = (1 + sqrt(1 + R^2))/2,     R = rho omega/(eta k^2)

to second order in k b: Taylor's speed, times Tuck's factor. The sheet is a row of nodes in a plane flow (a box of one
cell across). It is held, so a net force F_x pushes the fluid along, which the back pressure carries: far from the
sheets, a distance H apart, u = U + F_x/(2 eta V) y (y - H). Nodes and kernel blur the sheet's two sides into each
other, an error of first order in h that is extrapolated away.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ibfil.case.reading import read_case
from ibfil.fluids.immersed_boundary import Immersed
from ibfil.fluids.navier_stokes import NavierStokes, Workspace
from ibfil.fluids.spaces.periodic import PeriodicSpace
from ibfil.fluids.stokes import StokesByTable
from ibfil.grid.kernels import KERNELS
from ibfil.grid.periodic_grid import Grid
from ibfil.linalg.constraints import Prescribed
from ibfil.simulation.simulation import Simulation

CASE = Path(__file__).parents[2] / "cases/inertia/pumping_sheets.toml"
TALL, AMPLITUDE = 2, 0.05  # H in wavelengths, k b


def pumped(reynolds: float, cells: int, periods: int, steps: int) -> float:
    """U over Taylor's, in the last of so many periods of so many steps; k = omega = eta = 1."""
    shape = (cells, TALL * cells, 1)
    h = 2 * np.pi / cells
    grid = Grid([2 * np.pi, 2 * np.pi * TALL, h], shape)
    made = Immersed(PeriodicSpace.of(grid), KERNELS["peskin4"], 1.0, np.zeros(cells), None)
    workspace = Workspace(grid)
    fluid = NavierStokes(made, reynolds, lambda alpha: StokesByTable(made, alpha), workspace)
    s, zero = h * np.arange(cells), np.zeros((cells, 3))
    dt, forces, speeds = 2 * np.pi / steps, [], []
    for m in range(1, steps * periods + 1):
        t, w = m * dt, float(m > 1)
        tau = dt * (1 + w) / (1 + 2 * w)
        moves = tau * np.stack([0 * s, -AMPLITUDE * np.cos(s - t), 0 * s], axis=1)
        response = fluid.response(np.stack([s, AMPLITUDE * np.sin(s - t), 0 * s], axis=1), zero, t, tau, w)
        answer = response.forced(zero, Prescribed(np.arange(3 * cells), moves.ravel()), zero)
        fluid.advance(response, answer.move / tau, answer.force)
        if m > steps * (periods - 1):
            forces.append(answer.force[:, 0].sum())
            u = np.fft.irfftn(fluid.history.now, shape, axes=(1, 2, 3)) * np.prod(shape)
            speeds.append(u[0, :, 0].mean())  # half way between the sheets
    height = 2 * np.pi * TALL
    back = np.mean(forces) * height**2 / (8 * np.prod(grid.box))
    return float((np.mean(speeds) + back) / (0.5 * AMPLITUDE**2))


def tuck(reynolds: float) -> float:
    f = np.sqrt((1 + np.sqrt(1 + reynolds**2)) / 2)
    return float((1 + f) / (2 * f))


def extrapolated(reynolds: float, cells: int, periods: int, steps: int) -> float:
    return 2 * pumped(reynolds, 2 * cells, periods, steps) - pumped(reynolds, cells, periods, steps)


@pytest.mark.parametrize(("reynolds", "periods"), [(1e-3, 2), (4.0, 14)])
def test_a_sheet_pumps_as_tuck_says(reynolds, periods):
    """Tuck's factor is 1 and 0.81."""
    assert extrapolated(reynolds, 32, periods, 32) == pytest.approx(tuck(reynolds), rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize(("reynolds", "periods"), [(1e-3, 2), (1.0, 8), (4.0, 18), (10.0, 40)])
def test_a_sheet_pumps_as_tuck_says_the_better_the_finer(reynolds, periods):
    """Tuck's factor is 1, 0.955, 0.812, 0.713; twice as fine as above, in space and in time."""
    assert extrapolated(reynolds, 64, periods, 64) == pytest.approx(tuck(reynolds), rel=0.015)


@pytest.mark.slow
@pytest.mark.parametrize(("reynolds", "periods"), [(1e-3, 3), (1.0, 4), (4.0, 5)])
def test_the_shipped_sheets_push_as_tuck_says(reynolds, periods):
    """The case's two sheets, each held by tethers, without the kernel's thickness: 4 h U each."""

    def speed(cells):
        end, h = 2 * np.pi * periods, 2 * np.pi / cells
        case = read_case(CASE, [f"parameters.n={cells}", f"parameters.R={reynolds}", f"time.end={end}"])
        simulation, load_rates = Simulation(case), []
        simulation.advance(end - 2 * np.pi, lambda: None)
        for k in range(1, 65):
            simulation.advance(end - 2 * np.pi * (1 - k / 64), lambda: None)
            snapshot = simulation.snapshot().filaments["to_right"]
            load_rates.append(snapshot.force[:, 1].sum())
        return float(np.mean(load_rates)) / (4 * h)

    taylor = 0.5 * AMPLITUDE**2
    assert 2 * speed(64) - speed(32) == pytest.approx(taylor * tuck(reynolds), rel=0.03)
