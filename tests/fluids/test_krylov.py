"""Many nodes: Krylov on the FFT operator against the dense path, its residual, its memory; copies of a filament."""

import numpy as np
import pytest
from helpers.scenes import swimmer

from ibfil.bench import many
from ibfil.case.reading import parse_case
from ibfil.check.budget import memory
from ibfil.errors import CaseError
from ibfil.fluids import preconditioner
from ibfil.fluids.condensation import Newton, NothingCondensed, TwistCondensed
from ibfil.linalg import gmres
from ibfil.linalg.constraints import Prescribed
from ibfil.linalg.stiffness import Pairs, Stiffness
from ibfil.simulation.simulation import Simulation

MANY = """
[filament.rod]
length = 0.5
nodes = {nodes}
bending = [1, 0.6]
{twisting}
stretching = 1e3
curvature = ["6*sin(4*pi*s - 10*t)", 0]
shape = {{ kind = "relaxed" }}
copies = {{ count = {count}, seed = 5, region = [[-0.8, -0.8, -0.8], [0.8, 0.8, 0.8]] }}
{start}
[fluid]
model = "stokes"
viscosity = 1.3
box = [3.2, 3.2, 3.2]
cells = [32, 32, 32]
method = "{method}"
[time]
end = 0.06
step = 0.01
[output]
every = 0.06
"""
TWIST = "twisting = 0.7\nradius = 0.02"
CLAMP = 'start = { end = "clamped", spin = 3.0 }'


def _simulation(method, count=3, nodes=12, twisting="", start=""):
    return Simulation(
        parse_case(MANY.format(method=method, count=count, nodes=nodes, twisting=twisting, start=start), "many.toml")
    )


def _run(simulation):
    simulation.advance(0.06, lambda: None)
    return simulation.snapshot()


@pytest.mark.parametrize(("twisting", "start"), [("", ""), (TWIST, ""), (TWIST, CLAMP)])
def test_krylov_is_the_dense_path_on_three_filaments(twisting, start):
    dense = _run(_simulation("table", twisting=twisting, start=start))
    gmres = _run(_simulation("krylov", twisting=twisting, start=start))
    assert list(dense.filaments) == ["rod_000", "rod_001", "rod_002"]
    for name, one in dense.filaments.items():
        other = gmres.filaments[name]
        assert np.abs(one.position - other.position).max() < 6 * 1e-8 * 0.5  # six steps, each to Newton's tolerance
        assert np.abs(one.e1 - other.e1).max() < 1e-7
        assert np.abs(one.force - other.force).max() < 1e-5 * np.abs(one.force).max()
        if start:
            size = np.linalg.norm(one.reaction_start)
            assert np.linalg.norm(one.reaction_start - other.reaction_start) < 1e-5 * size


def test_residual_of_a_step_with_2000_nodes():
    """y = target + tau M F at every node, with the velocity of the FFT operator."""
    simulation = _simulation("krylov", 40, 50)
    start = simulation.configuration.r.copy()
    simulation.advance(0.01, lambda: None)  # one step of Euler, M frozen at the start
    move = simulation.configuration.r - start
    force = simulation.state()["force"]
    fluid = simulation.fluid
    base, weights = fluid.immersed.stencil(start)
    u = fluid.solver.velocity(base, weights, np.ascontiguousarray(force)) + fluid.immersed.slip[:, None] * force
    assert np.abs(move - 0.01 * u).max() < 1e-6 * np.abs(move).max()


def test_the_kept_preconditioner_goes_into_the_state_and_comes_back():
    whole, cut = _simulation("krylov", twisting=TWIST), _simulation("krylov", twisting=TWIST)
    cut.advance(0.03, lambda: None)
    again = _simulation("krylov", twisting=TWIST)
    again.restore(cut.state())
    whole.advance(0.03, lambda: None)
    for simulation in (whole, again):
        simulation.advance(0.06, lambda: None)
    assert np.array_equal(whole.configuration.r, again.configuration.r)
    assert np.array_equal(whole.configuration.e1, again.configuration.e1)


def test_memory_of_ten_thousand_nodes_is_told_and_below_two_gibibytes():
    """200 x 50 and 20 x 500 at 128^3, from counts; nothing is run."""
    for count, nodes in ((200, 50), (20, 500)):
        simulation = _simulation("krylov", count, nodes)
        simulation.grid.cells = np.array([128, 128, 128])
        assert sum(memory(simulation).values()) < 2 * 2**30


def test_auto_takes_krylov_where_the_table_costs_more():
    assert _simulation("auto", 2, 12).method == "table"
    assert _simulation("auto", 60, 20).method == "krylov"


def test_copies_are_the_same_filament_turned_and_moved():
    simulation = _simulation("table", 4)
    snapshot = simulation.snapshot()
    one = snapshot.filaments["rod_000"].position
    distances = np.linalg.norm(one[:, None] - one[None], axis=2)
    for filament in snapshot.filaments.values():
        r = filament.position
        assert np.allclose(np.linalg.norm(r[:, None] - r[None], axis=2), distances, atol=1e-13)
        middle = r[np.array([5, 6])].mean(axis=0)
        assert np.all(np.abs(middle) < 0.9)
    turns = [np.linalg.norm(f.position[-1] - f.position[0] - (one[-1] - one[0])) for f in snapshot.filaments.values()]
    assert min(turns[1:]) > 0.05  # turned, each its own way
    again = _simulation("table", 4).snapshot()
    assert np.array_equal(again.filaments["rod_003"].position, snapshot.filaments["rod_003"].position)


def test_copies_from_a_file(tmp_path):
    (tmp_path / "places.csv").write_text("0.5, 0, 0, 0, 0, 0, 1\n-0.5, 0.25, 0, 0, 0, 1, 0\n")
    text = MANY.format(method="table", count=1, nodes=12, twisting="", start="")
    text = text.replace(text.split("copies = ")[1].split("\n")[0], '{ file = "places.csv" }')
    case = parse_case(text, str(tmp_path / "many.toml"))
    a, b = (f.position for f in Simulation(case).snapshot().filaments.values())
    assert np.allclose((a - [0.5, 0, 0]) * [-1, -1, 1], b - [-0.5, 0.25, 0], atol=1e-14)  # half a turn about z
    (tmp_path / "places.csv").write_text("1, 2\n")
    with pytest.raises(CaseError, match=r"copies\.file"):
        Simulation(case)


def test_thickness_chooses_the_grid():
    text = MANY.format(method="table", count=1, nodes=12, twisting="", start="")
    got = Simulation(parse_case(text.replace("cells = [32, 32, 32]", "thickness = 0.1105"), "t.toml"))
    assert got.grid.cells.tolist() == [32, 32, 32]
    got = Simulation(parse_case(text.replace("cells = [32, 32, 32]", "thickness = 0.11"), "t.toml"))
    assert got.grid.cells.tolist() == [36, 36, 36]
    odd = text.replace("cells = [32, 32, 32]", "thickness = 0.1105").replace("3.2, 3.2, 3.2", "3.2, 3.2, 3.7")
    with pytest.raises(CaseError, match=r"fluid\.thickness.*box = "):
        Simulation(parse_case(odd, "t.toml"))


def test_a_stiff_rod_of_many_nodes_is_not_given_up_for_rounding():
    """200 nodes a tenth of a cell apart, EA = 50: by these paths steps were halved where the table needs none."""
    paths = {}
    for method in ("table", "krylov", "fft"):
        fluid = {"model": "stokes", "box": [1.4] * 3, "cells": [28] * 3, "slip": 0.01, "method": method}
        simulation = Simulation(swimmer(fluid, stretching=50.0, end=0.06, step=0.03, rod={"nodes": 200}))
        simulation.advance(0.06, lambda: None)
        assert simulation.shortened == 0
        paths[method] = simulation.configuration.r
    for method in ("krylov", "fft"):
        assert np.abs(paths[method] - paths["table"]).max() < 1e-8


@pytest.mark.parametrize(
    ("unknowns", "condensation"),
    [(3, NothingCondensed()), (4, NothingCondensed()), (4, TwistCondensed(np.linspace(1.0, 2.0, 24)))],
    ids=["plain", "twist on the grid", "twist condensed"],
)
def test_the_system_of_rods_is_their_statement(unknowns, condensation):
    """1 - tau M K by its matrix, and by the products that the FFTs are given: all rods, each alone, two linked ones."""
    rng, n, tau = np.random.default_rng(1), 24, 0.3
    rods = slice(0, 10), slice(10, 15), slice(15, n)
    band = rng.standard_normal((n, unknowns, 7 * unknowns))
    for i, a in np.ndindex(n, 7):
        if not any(rod.start <= i < rod.stop and rod.start <= i + a - 3 < rod.stop for rod in rods):
            band[i, :, a * unknowns : (a + 1) * unknowns] = 0.0
    # The first rod is closed, its turns too; it is linked to the third by positions.
    blocks = rng.standard_normal((5, unknowns, unknowns))
    blocks[3:, 3:], blocks[3:, :, 3:] = 0.0, 0.0
    stiffness = Stiffness(band, Pairs(np.array([0, 9, 1, 4, 20]), np.array([9, 0, 9, 18, 2]), blocks))
    parts = np.array([0, 2, 5 * unknowns + 1, 15 * unknowns + unknowns - 1, 20 * unknowns])
    zero = np.zeros((n, unknowns))
    statement = condensation.reduced(Newton(zero, stiffness, Prescribed(parts, np.zeros(5)), zero, zero, tau))
    c = statement.force.size // n
    for group in ((slice(0, n),), *((rod,) for rod in rods), (rods[0], rods[2]), rods):
        within = np.concatenate([np.arange(c * rod.start, c * rod.stop) for rod in group])
        mobility = np.zeros((c * n, c * n))
        half = rng.standard_normal((len(within),) * 2)
        mobility[np.ix_(within, within)] = half + half.T
        x = np.zeros(c * n)
        x[within] = rng.standard_normal(len(within))
        pushed = statement.times(statement.free * x)
        pushed[statement.index] += x[statement.index]
        expected = (statement.free * x - tau * mobility @ pushed)[within]
        system = statement.frozen().system(group, mobility[np.ix_(within, within)], tau)
        assert np.allclose(system.T @ x[within], expected, rtol=0, atol=1e-10)
        assert np.allclose(gmres.factor(system.copy()).solve(expected), x[within], rtol=0, atol=1e-8)


NOTHING = gmres.Blocks(*[np.zeros(0)] * 6)


@pytest.mark.parametrize("number", ["double", "single"])
def test_factored_blocks_solve_each_system(number, monkeypatch):
    rng, sizes = np.random.default_rng(3), [5, 12, 1, 40]
    order, units = rng.permutation(sum(sizes)), 10.0 ** rng.integers(-3, 4, sum(sizes))
    at = np.split(order, np.cumsum(sizes)[:-1])
    systems = [rng.normal(size=(n, n)) + np.diag(rng.choice([-9.0, 0.0, 9.0], n)) for n in sizes]
    systems = [units[k][:, None] * system / units[k] for k, system in zip(at, systems, strict=True)]

    def parts():
        return [(k, system.T.copy()) for k, system in zip(at, systems, strict=True)]

    monkeypatch.setattr(gmres, "_LARGE", 0 if number == "single" else 2**30)
    blocks = gmres.factored(parts, sizes, at[1][:2], units)
    assert blocks.lu.dtype == (np.float32 if number == "single" else np.float64)
    x = units * rng.normal(size=sum(sizes))
    right = np.empty_like(x)
    for k, system in zip(at, systems, strict=True):
        right[k] = system @ x[k]
    limit = 1e-3 if number == "single" else 1e-10
    assert np.abs((blocks.solve(right) - x) / units).max() < limit
    held = units[at[1][:2]] / np.diag(systems[1])[:2]
    assert blocks.scale[at[1][:2]] == pytest.approx(held, rel=1e-14)


def test_a_block_too_stiff_for_single_precision_is_kept_in_double(monkeypatch):
    n = 8
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(n, n)))[0]
    stiff = rotation @ np.diag(np.logspace(0, 11, n)) @ rotation.T
    monkeypatch.setattr(gmres, "_LARGE", 0)
    blocks = gmres.factored(lambda: [(np.arange(n), stiff.T.copy())], [n], np.zeros(0, np.int64))
    assert blocks.lu.dtype == np.float64


def _rounds(kept, products):
    """For each round of solves, of so many products, whether the factors are made anew after it."""
    made = []
    for count in products:
        kept.now += count
        made.append(kept.end_round())
        if made[-1]:
            kept.renew(NOTHING, 1.0)
    return made


def test_a_preconditioner_is_kept_while_that_is_cheaper_than_the_mean():
    kept = preconditioner.KeptFactors(100.0)
    kept.renew(NOTHING, 1.0)
    assert kept.fits(0.8)
    assert not kept.fits(0.5)
    # (100 + 10)/1, (100 + 30)/2 = 65, (100 + 80)/3 = 60 < 90: the fourth round was one too many
    assert _rounds(kept, [10, 20, 50, 90]) == [False, False, False, True]
    # remembered: three rounds from now on
    assert _rounds(kept, [10, 20, 50, 10, 20, 50]) == [False, False, True] * 2


def test_a_preconditioner_that_serves_once_is_made_each_round_but_for_a_trial():
    kept = preconditioner.KeptFactors(5.0)
    kept.renew(NOTHING, 1.0)
    made = []
    for _ in range(12):
        made += _rounds(kept, [40 if not made or made[-1] else 60])
    assert made[:3] == [False, True, True]
    assert made.count(False) == 2  # the trials


def test_a_part_of_the_error_of_a_step_is_solved_for_with_fewer_products(monkeypatch):
    """Each solution differs from the exact one by less than that part of what steps twice as short change."""
    text = many.scene(20, 20, 32)
    found, counts, solve = {}, {}, gmres.solve
    for name, overrides in {"exact": (), "loose": ("time.solver_error=0.01",), "fine": ("time.step=0.0125",)}.items():
        counts[name] = 0

        def counted(*given, name=name):
            answer = solve(*given)
            counts[name] += answer.products
            return answer

        monkeypatch.setattr(gmres, "solve", counted)
        simulation = Simulation(parse_case(text, "many", ("fluid.method=krylov", *overrides)))
        simulation.advance(0.2, lambda: None)
        found[name] = simulation.state_now.configuration.r.copy()
    assert counts["loose"] < 0.75 * counts["exact"]
    loose, step = (np.abs(found[name] - found["exact"]).max() for name in ("loose", "fine"))
    assert 0 < loose < 0.01 * step
