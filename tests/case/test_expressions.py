"""Expressions against Python's own arithmetic: values, shapes, equality, and calls from threads."""

from __future__ import annotations

import ast
import math
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from helpers.expression_trees import CAREFUL, PARAMETERS, PLAIN, VARIABLES, Number, trees
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from ibfil.case import expressions
from ibfil.case.expressions import Expression, ExpressionError, parse
from ibfil.case.formulas import evaluation


def _python(text: str, names: dict) -> object:
    """Python's own value; None where it has no finite real one."""
    try:
        return eval(text, {"__builtins__": {}}, names)
    except (ValueError, ZeroDivisionError, OverflowError):
        return None


@settings(max_examples=400, deadline=None)
@given(trees, st.floats(-3, 3), st.floats(0, 2))
def test_value_is_pythons_to_the_bit(tree, s, t):
    text, python = tree
    expected = _python(python, {**PLAIN, **PARAMETERS, "s": s, "t": t})
    try:
        ours = parse(text, VARIABLES, PARAMETERS).at(s=s, t=t)
    except ExpressionError:
        # Stricter than Python: an inf on the way is refused too, and so is a constant part without a value.
        assume(expected is None or not math.isfinite(expected))
        return
    assert expected is not None
    assert ours == expected


@settings(max_examples=400, deadline=None)
@given(trees, st.lists(st.floats(-3, 3), min_size=1, max_size=3), st.floats(0, 2))
@example(("where(s<0, sqrt(-s), min(s, t, k)**2)", "(sqrt(-s) if s < 0 else min(s, t, k)**2)"), [-2.0, 0.3], 0.7)
@example(("-s**2", "-s**2"), [1.5], 0.0)
@example(("2/s - s/3/k", "2/s - s/3/k"), [1.5], 0.0)
@example(("step(s) + 10*sign(t - 1)", "step(s) + 10*sign(t - 1)"), [-1.5, 2.0], 0.5)
def test_array_value_is_pythons_within_rounding(tree, s, t):
    text, python = tree
    names = {**CAREFUL, **PARAMETERS}
    expected = [_python(python, {**names, "s": Number(x), "t": Number(t)}) for x in s]
    assume(None not in expected)
    expected = [Number.of(e) for e in expected]
    assume(all(math.isfinite(e.value) and math.isfinite(e.error) for e in expected))
    try:
        expression = parse(text, VARIABLES, PARAMETERS)
    except ExpressionError:
        assume(False)
    values = expression.bind("s", "t")(np.array(s), t)
    assert values.shape == (len(s),)
    assert values.dtype == np.float64
    for value, e in zip(values, expected, strict=True):
        assert abs(value - e.value) <= 4 * e.error


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("-2**2", -4.0),
        ("2**-1", 0.5),
        ("2**3**0.5", 2.0 ** (3.0**0.5)),
        ("1 - 2 - 3", -4.0),
        ("6/3/2", 1.0),
        ("1e-3", 1e-3),
        (".5", 0.5),
        ("sign(0)", 0.0),
        ("step(0)", 1.0),
        ("step(-0.1)", 0.0),
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
        ("atan2(1, -1)", 0.75 * math.pi),
        ("where(k > 1, 5, 1/0)", 5.0),
        ("where(k <= 1, log(-1), 6)", 6.0),
        ("cos(pi)", -1.0),
        (" ( 1\n+ 2 )\t", 3.0),
        ("k*2", 3.5),
        (7, 7.0),
        (0.25, 0.25),
    ],
)
def test_constants(text, value):
    expression = parse(text, VARIABLES, PARAMETERS)
    assert expression.constant == value
    assert expression.variables == frozenset()
    assert isinstance(expression.constant, float)


def test_a_constant_condition_leaves_the_chosen_branch_only():
    expression = parse("where(k > 1, 2*s, t)", VARIABLES, PARAMETERS)
    assert expression.variables == {"s"}
    assert expression == parse("2*s", VARIABLES)


# --- shapes, equality, pickling -----------------------------------------------------------------------


@pytest.mark.parametrize("text", ["2.5", "s", "t", "s*t", "1 + 0*t", "x + s"])
@pytest.mark.parametrize(
    "arguments",
    [
        (np.linspace(0, 1, 7), 0.3, 1.0),
        (np.linspace(0, 1, 7), np.float64(0.3), np.ones(7)),
        (np.linspace(0, 1, 7), np.array(0.3), np.ones((3, 1))),
        (np.arange(4), 2, 1),
        (0.5, 0.3, 0.2),
        (np.zeros(0), 1.0, 1.0),
    ],
)
def test_result_has_the_common_shape(text, arguments):
    s, t, x = arguments
    value = parse(text, ("s", "t", "x")).bind("s", "t", "x")(s, t, x)
    expected = eval(text, {"s": np.asarray(s), "t": t, "x": np.asarray(x)}) + 0.0 * (s + np.asarray(t) + x)
    assert isinstance(value, np.ndarray)
    assert value.dtype == np.float64
    assert value.shape == np.shape(expected)
    np.testing.assert_allclose(value, expected, rtol=1e-15)


def test_the_result_is_the_callers_own():
    s = np.linspace(0.0, 1.0, 5)
    for text in ("s", "3", "t"):
        bound = parse(text, VARIABLES).bind("s", "t")
        bound(s, 0.5)[:] = 9.0
        assert bound(s, 0.5)[0] != 9.0
    assert s[0] == 0.0


def test_bind_needs_every_variable_used():
    with pytest.raises(ValueError, match="uses"):
        parse("s*t", VARIABLES).bind("s")


def test_no_value_is_inf_or_nan_not_an_error():
    value = parse("1/s + sqrt(s - 1)", ("s",)).bind("s")(np.array([0.0, 0.5, 2.0]))
    assert not np.isfinite(value[:2]).any()
    assert value[2] == 1.5


def test_equal_by_meaning_not_by_text():
    a = parse("k*s", VARIABLES, PARAMETERS)
    b = parse("1.75 * s", VARIABLES)
    assert a == b
    assert hash(a) == hash(b)
    assert (a.text, b.text) == ("k*s", "1.75 * s")
    assert a != parse("1.5*s", VARIABLES)
    assert parse(1) == parse("1.0")


def test_pickles_after_use():
    expression = parse("sin(k*s)", VARIABLES, PARAMETERS)
    expression.bind("s")(np.zeros(3))
    again = pickle.loads(pickle.dumps(expression))
    assert again == expression
    np.testing.assert_array_equal(again.bind("s")(np.ones(3)), expression.bind("s")(np.ones(3)))


# --- calls -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [-16, -5, -3, -2, -1, -0.5, 0, 0.5, 1, 1.5, 2, 3, 4, 7, 15, 16, 12.25])
def test_powers_are_pythons(exponent):
    s = np.array([0.3, 1.0, 2.5, 17.0])
    values = parse(f"s**({exponent})", ("s",)).bind("s")(s)
    np.testing.assert_allclose(values, [x**exponent for x in s], rtol=1e-14)


def test_threads_may_call_one_function_at_the_same_time():
    """Each thread its own arrays, over and over; a state kept between calls would mix them up."""
    bound = parse("where(s < 0.5, sin(9*s - t)**3, exp(-s*t)) + s**5", VARIABLES).bind("s", "t")
    given = [(np.linspace(0, 1, 4000 + 7 * k), 0.1 * k) for k in range(8)]
    alone = [bound(*one) for one in given]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda i: bound(*given[i % 8]), range(400)))
    assert all(np.array_equal(value, alone[i % 8]) for i, value in enumerate(together))


def test_a_call_parses_and_compiles_nothing(monkeypatch):
    """So that it costs what the arithmetic does: some microseconds."""

    def never(*given, **named):
        raise AssertionError("asked at every call")

    s, t = np.linspace(0, 1, 128), 0.3
    bound = parse("8*sin(4*pi*s - 10*t)", VARIABLES).bind("s", "t")
    for place, name in ((ast, "parse"), (evaluation, "_source"), (evaluation, "function_of"), (expressions, "parse")):
        monkeypatch.setattr(place, name, never)
    assert bound(s, t) == pytest.approx(8 * np.sin(4 * np.pi * s - 10 * t), rel=1e-14, abs=1e-14)


def test_importing_and_parsing_needs_no_numpy():
    code = "import sys; from ibfil.case.expressions import parse; parse('2*s', ('s',)).at(s=1.0); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "ibfil.case.expressions" in done.stdout.split()
    assert not {"numpy", "pydantic"} & set(done.stdout.split())


def test_frozen():
    expression = parse("s", ("s",))
    assert isinstance(expression, Expression)
    with pytest.raises(AttributeError):
        expression.text = "t"
