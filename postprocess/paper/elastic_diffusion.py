"""How the centroid of an elastic rod diffuses: its overdamped motion, linearised about rest, to the end.

    Z dr/dt = K dr + noise,   noise of covariance 2 kT Z        (Eq. 53, corrected)

With S = Z^-1/2 (-K) Z^-1/2 = V diag(lam) V^T the mean square displacement of a component w.r over a lag is, in the
stationary state,

    sum_k (w.Z^-1/2 V)_k^2  2 kT (1 - exp(-lam_k lag))/lam_k,      2 kT lag where lam_k = 0

The six modes of rest move the rod as a whole: with them the helix turns as it slides, which Eq. 57 of the paper
leaves out (as if it were held from turning). The other modes yield within the lag or do not.
"""

from __future__ import annotations

import tomllib

import numpy as np
import tomli_w

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.fluids.resistive_force import resist
from ibfil.simulation.simulation import Simulation


def diffusion_ratio(case: Case, lag: float) -> float:
    """D_perp/D_par of the centroid of the case's only filament over ``lag``, about its gyration axis at rest."""
    simulation = at_rest(case)
    system, shape = simulation.system, simulation.configuration
    n, m = len(shape.r), system.unknowns
    moment = system.moment(shape, 0.0)
    stiffness = system.stiffness(shape, shape, moment, 0.0).dense().reshape(n * m, n * m)
    root = _inverse_root(simulation.fluid.drag, shape.e3, m)
    scaled = root @ (-0.5 * (stiffness + stiffness.T)) @ root
    rates, modes = np.linalg.eigh(scaled)
    share = system.mesh.volume / system.mesh.volume.sum()
    axes = gyration_axes(shape.r, share)
    squares = [_mean_square(rates, modes, root, _component(share, axis, m), lag) for axis in axes.T]
    return 0.5 * (squares[0] + squares[1]) / squares[2]


def at_rest(case: Case) -> Simulation:
    """The rod without thermal forces, come to rest on its nodes: the exact helix is not quite the stencils' own."""
    raw = tomllib.loads(case.text)
    del raw["thermal"], raw["observe"], raw["expect"]
    for filament in raw["filament"].values():
        filament["derivative"] = 2  # the default where there is noise
    raw["time"] = {"end": 2000.0, "step": 100.0, "scheme": "implicit", "order": 1}
    simulation = Simulation(parse_case(tomli_w.dumps(raw), case.file))
    simulation.advance(2000.0, lambda: None)
    return simulation


def gyration_axes(r: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Principal axes (columns) of nodes (n, 3); the last one is a rod's or helix's long axis, a ring's normal."""
    d = r - share @ r
    squares, axes = np.linalg.eigh((d * share[:, None]).T @ d)
    return axes if squares[2] - squares[1] >= squares[1] - squares[0] else axes[:, [1, 2, 0]]


def _inverse_root(drag, e3: np.ndarray, m: int) -> np.ndarray:
    """Z^-1/2, dense (n m, n m): Z is block diagonal, with eigenvalues along and across the tangent."""
    n = len(e3)
    z = np.zeros((n, m, n, m))
    for a in range(m):
        unit = np.zeros((n, m))
        unit[:, a] = 1.0
        z[np.arange(n), :, np.arange(n), a] = resist(drag, e3, unit)
    root = np.zeros_like(z)
    for i in range(n):
        values, vectors = np.linalg.eigh(z[i, :, i, :])
        root[i, :, i, :] = (vectors / np.sqrt(values)) @ vectors.T
    return root.reshape(n * m, n * m)


def _component(share: np.ndarray, axis: np.ndarray, m: int) -> np.ndarray:
    """The weights (n m,) of the centroid's component along ``axis``."""
    w = np.zeros((len(share), m))
    w[:, :3] = share[:, None] * axis
    return w.ravel()


def _mean_square(rates: np.ndarray, modes: np.ndarray, root: np.ndarray, w: np.ndarray, lag: float) -> float:
    """Mean square displacement over 2 kT of the component w.r, stationary."""
    x = np.maximum(rates, 0.0) * lag
    yielded = lag * np.where(x < 1e-6, 1.0 - 0.5 * x, -np.expm1(-x) / np.maximum(x, 1e-300))
    return float((w @ root @ modes) ** 2 @ yielded)
