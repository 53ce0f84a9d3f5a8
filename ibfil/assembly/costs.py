"""Seconds of a step, from counts alone, so that the same case always takes the same method, on any machine.

The constants are of one thread of a machine of 2025; only their ratios decide anything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ..case.schema import Case


_NODE = 2.0e-6  # seconds a node for geometry, force, stiffness and a banded solve
SPREAD = 1.0e-6  # a node for spreading and interpolating, 4-point kernel
_PAIR = 0.8e-6  # a pair of nodes in the mobility table, 4-point kernel
_COMPONENTS = 2.5  # the same of a table with torques, of one without
_FLOP = 1.0e-10  # a floating-point operation in dense matrices, and in sums over planes
_LARGE_FLOP = 3.0e-11  # the same in products and triangular solves of large ones
_MODE = 0.8e-9  # a number through one pass of an FFT, times the logarithm of its length
_ELEMENT = 1.0e-5  # an element of a link for its force and stiffness
_ROUNDS = {"explicit": 1, "semi-implicit": 1, "implicit": 3}  # Newton iterations
_THERMAL = 1.8  # of a semi-implicit step of the rods, one with thermal forces: a second force, a second solve
_NORMAL = 1.6e-8  # a normal number
_PRODUCTS = 11  # of GMRES with a preconditioner rod by rod, an iteration of Newton
_GIVEN = 12  # products that find what swimmers give each other, an iteration of Newton
_SWIMMER = 8e-4  # a swimmer's own answer to what comes to it
_LARGEST = 2.0**30  # bytes that the table's dense matrices may take before the table is out of the question


def full_evaluation(cells: Sequence[int]) -> float:
    """Seconds of one velocity evaluation by whole FFTs: three passes forth and back of three components."""
    return 6 * float(np.prod(cells)) * float(np.log2(np.prod(cells))) * _MODE / 3


def pruned_evaluation(cells: Sequence[int], sizes: Sequence[int]) -> float:
    """The same by the lines of a box of ``sizes`` (3,) cells."""
    from ..grid.pruned_fft import is_thin

    (ec, nc), (eb, nb), (_, na) = sorted(zip(sizes, cells, strict=True))
    lines = ec * eb * na * np.log2(na) + ec * nb * na * np.log2(nb)
    if is_thin(ec, nc):
        return 6 * float(lines) * _MODE + 18.0 * ec * ec * nb * na * _FLOP
    return 6 * float(lines + nc * nb * na * np.log2(nc)) * _MODE


def evaluation(cells: Sequence[int], sizes: Sequence[int], nodes: int) -> float:
    """Seconds of one velocity evaluation of ``nodes`` by the cheaper transforms."""
    return min(full_evaluation(cells), pruned_evaluation(cells, sizes)) + nodes * SPREAD


def solved(nodes: int, parts: int = 3) -> float:
    """Seconds of one dense system with ``parts`` unknowns a node: M K with K in its band, and LU factors."""
    n = float(parts) * nodes
    return (0.7 * n + 150.0) * n**2 * _FLOP


def factored(nodes: int, parts: int = 3) -> float:
    """Seconds of a rod's own exact matrix and its factors."""
    return _table(nodes, parts) + solved(nodes, parts)


def of_rods(case: Case, nodes: int, scheme: str = "") -> float:
    """Seconds a step takes for the rods alone, in the case's scheme or another."""
    if case.thermal is not None and not scheme:
        return _THERMAL * nodes * _NODE
    return _ROUNDS[scheme or case.time.scheme] * nodes * _NODE


def of_links(case: Case, elements: int) -> float:
    """Seconds a step for the forces and stiffness of so many elements of links."""
    return _ROUNDS[case.time.scheme] * elements * _ELEMENT


def of_factors(case: Case, operations: int, unknowns: int) -> float:
    """Seconds a step for factors that take so many products of blocks."""
    return _ROUNDS[case.time.scheme] * operations * 2.0 * unknowns**3 * _FLOP


def of_inertia(cells: Sequence[int], parts: int) -> float:
    """Seconds a step for a fluid's past and advection: components through FFTs, whatever answers to the forces."""
    return 1.2 * (9 + 6 * (parts - 2)) / 6 * full_evaluation(cells)


def seconds_a_step(
    case: Case, rods: Sequence[int], cells: Sequence[int], sizes: Sequence[int], parts: int = 3
) -> dict[str, float]:
    """Seconds of one step of a grid fluid by each method: "table", "fft", "pruned", "krylov".

    ``rods`` are the nodes of each filament, ``cells`` (3,) those of the grid, ``sizes`` (3,) the extents of their
    bounding box in cells, ``parts`` how many numbers of a node go through the grid (4: torques too). The table is out
    where it does not fit.
    """
    nodes, number = sum(rods), float(np.prod(cells))
    local = of_rods(case, nodes)
    whole = (parts - 2) * (full_evaluation(cells) + nodes * SPREAD)
    if case.fluid.inertial:
        return _by_method(case, rods, parts, local + of_inertia(cells, parts), {"fft": whole}, number)
    if parts == 4:
        return _by_method(case, rods, parts, local, {"fft": whole}, number)
    pruned = pruned_evaluation(cells, sizes) + nodes * SPREAD
    return _by_method(case, rods, parts, local, {"fft": whole, "pruned": pruned}, number)


def without_box(case: Case, rods: Sequence[int], parts: int, whole: float, pair: float = 1.0) -> dict[str, float]:
    """The same in free space, ``whole`` the seconds of an evaluation by transforms, of which noise has no root.

    ``pair`` is what a pair of nodes costs, over what it does in the periodic table.
    """
    found = _by_method(case, rods, parts, of_rods(case, sum(rods)), {"fft": whole}, 0.0, pair)
    if case.thermal is not None:
        del found["krylov"]
    return found


def with_markers(
    case: Case, counts: Sequence[tuple[int, int]], parts: int, evaluations: Mapping[str, float], pair: float = 1.0
) -> dict[str, float]:
    """Seconds of a step with bodies by each method; ``counts`` are the nodes and markers of each swimmer.

    Markers are taken out once a step, of all or of each swimmer; velocities come from the table, or by transforms,
    ``evaluations`` the seconds of one each.
    """

    def made(nodes: int, markers: int) -> float:
        m, n = 3.0 * markers, float(parts) * nodes
        shell = (0.35 * m**3 + m**2 * n + 2 * m * n**2) * _LARGE_FLOP
        return pair * _table(nodes + markers, parts) + shell + rounds * solved(nodes, parts)

    nodes, markers = (sum(numbers) for numbers in zip(*counts, strict=True))
    rounds, local = _ROUNDS[case.time.scheme], of_rods(case, nodes)
    exact = local + made(nodes, markers) if dense_bytes(nodes + markers, parts) < _LARGEST else np.inf
    found = {"table": exact} | {name: exact + 2 * rounds * one for name, one in evaluations.items()}
    each = min(evaluations.values()) + _SWIMMER * len(counts)
    return found | {"krylov": local + sum(made(*one) for one in counts) + _GIVEN * rounds * each}


def _table(nodes: int, parts: int) -> float:
    """Seconds of all pairs of nodes in the mobility table."""
    return 0.5 * nodes**2 * _PAIR * (_COMPONENTS if parts == 4 else 1.0)


def _by_method(
    case: Case,
    rods: Sequence[int],
    parts: int,
    local: float,
    evaluations: dict[str, float],
    cells: float,
    pair: float = 1.0,
) -> dict[str, float]:
    """Seconds by the table, by the transforms of ``evaluations`` (seconds of one each), and by Krylov on the cheapest.

    ``local`` is what a step takes whatever answers to the forces, ``cells`` the number of all.
    """
    rounds, nodes, cheapest = _ROUNDS[case.time.scheme], sum(rods), min(evaluations.values())
    build = pair * _table(nodes, parts)
    if case.time.explicit:
        by_transforms = {name: local + one for name, one in evaluations.items()}
        return {"table": local + build, **by_transforms, "krylov": local + cheapest}
    # Transforms have the exact matrix of all nodes for a preconditioner, Krylov that of each rod.
    exact = local + build + rounds * solved(nodes, parts) if dense_bytes(nodes, parts) < _LARGEST else np.inf
    made = sum(pair * _table(k, parts) + solved(k, parts) for k in rods)
    by_transforms = {name: exact + 4 * rounds * one for name, one in evaluations.items()}
    found = {"table": exact, **by_transforms, "krylov": local + _PRODUCTS * rounds * cheapest + made}
    if case.thermal is None:
        return found
    # The matrix where the drift looks, and the root; by transforms four velocities for the drift, and the correction.
    dense, more = build + _root(nodes, parts), 4 * cheapest + 4 * rounds * cheapest
    root = 0.5 * max(evaluations.values()) + 3 * _NORMAL * cells
    extra = {"table": dense, "krylov": more + _PRODUCTS * rounds * cheapest + root}
    return {name: seconds + extra.get(name, dense + more) for name, seconds in found.items()}


def _root(nodes: int, parts: int) -> float:
    """Seconds of the Cholesky factor of the matrix of all nodes."""
    n = float(parts) * nodes
    return (0.35 * n + 50.0) * n**2 * _FLOP


def dense_bytes(nodes: int, parts: int = 3) -> float:
    """Bytes of the dense matrices of the table and its solve, with ``parts`` unknowns a node."""
    return 4 * 8.0 * (float(parts) * nodes) ** 2
