"""What is no arithmetic is refused at once, with a reason; and the largest that is allowed is compiled quickly."""

from __future__ import annotations

import math
import re
import time

import numpy as np
import pytest
from helpers.expression_trees import PARAMETERS, VARIABLES
from hypothesis import given, settings
from hypothesis import strategies as st

from ibfil.case.expressions import FUNCTIONS, BrokenParameter, ExpressionError, parse

HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__[0]",
    "s.__class__",
    "s.real",
    "s.T",
    "(1).real",
    "1 .real",
    "lambda: 1",
    "(lambda s: s)(1)",
    "[s for s in s]",
    "(s for s in s)",
    "{s: s}",
    "{s}",
    "[s]",
    "(s, t)",
    "s,",
    "()",
    "s[0]",
    "s[:]",
    "'a'",
    '"a"',
    "'''a'''",
    "b'a'",
    "f'{s}'",
    "(s := 1)",
    "s = 1",
    "s == 1",
    "sin(x=s)",
    "sin(s, t=1)",
    "sin(*s)",
    "sin(**s)",
    "max(*s, 1)",
    "s if s else t",
    "s and t",
    "s or t",
    "not s",
    "~s",
    "s // 2",
    "s % 2",
    "s @ t",
    "s & t",
    "s | t",
    "s ^ t",
    "s << 1",
    "s >> 1",
    "s < 1",
    "where(s, 1, 2)",
    "where(0 < s < 1, 1, 2)",
    "where(s == 1, 1, 2)",
    "where(s != 1, 1, 2)",
    "where((s < 1) < 1, 1, 2)",
    "where(s in t, 1, 2)",
    "where(s is t, 1, 2)",
    "where(where(s < 1, s, t), 1, 2)",
    "where(s < 1)",
    "True",
    "None",
    "...",
    "1j",
    "2 + 3j",
    "nan",
    "inf",
    "1e999",
    "-1e999",
    "eval(s)",
    "exec(s)",
    "open(s)",
    "print(s)",
    "sum(s)",
    "prod(s)",
    "arcsin(s)",
    "sin(s)(s)",
    "(sin)(s)(t)",
    "sin(sin)",
    "sin",
    "sin()",
    "sin(s, t)",
    "min(s)",
    "atan2(s)",
    "pi(s)",
    "k(s)",
    "s(t)",
    "where",
    "await s",
    "yield s",
    "yield",
    "return s",
    "import os",
    "s; t",
    "s # t",
    "s\\\n+ t",
    "s $ t",
    "s ? t",
    "s!",
    "2s",
    "s t",
    "s +",
    "* s",
    "(s",
    "s)",
    "",
    "   ",
    "\n",
    "\x00",
    "s\x00",
    "ｓ",
    "ſin(s)",
    "𝐬𝐢𝐧(s)",
    "s + é",
    "s−1",
    "s​",
    "x",
    "q",
    "S",
    "Pi",
    "kk",
    "9**9**9",
    "9**9**9**9**9",
    "(9**9)**17",
    "s**t",
    "2**s",
    "s**17",
    "s**-17",
    "s**(1/0)",
    "1/0",
    "s/0",
    "s/(1 - 1)",
    "s/sin(0)",
    "0**-1",
    "(-8)**(1/3)",
    "log(0)",
    "log(-1)",
    "sqrt(-1)",
    "asin(2)",
    "exp(1000)",
    "1e300*1e300",
    "sinh(1e3)",
    "9" * 5000,
    "9" * 1900,
    "0x" + "f" * 1900,
    "(" * 1000 + "s" + ")" * 999,
    "-" * 1999 + "s",
    "s" + "+s" * 900,
    "s" + "*s" * 900,
    "s" + "**s" * 600,
    "sin(" * 400 + "s" + ")" * 400,
    "min(" + "s," * 900 + "s)",
    "1 " * 1000,
    "s" * 10**6,
    "((((" * 10**5,
    "+".join(f"{i}*s" for i in range(100)),
    "where(s<1," * 60 + "s" + ",s)" * 60 + "+" + "where(s<1," * 60 + "s" + ",s)" * 60,
]


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: ascii(text[:40]) + f" {len(text)}")
def test_refused_at_once_with_a_reason(text):
    started = time.process_time()
    with pytest.raises(ExpressionError) as caught:
        parse(text, VARIABLES, PARAMETERS)
    assert time.process_time() - started < 1.0
    assert 0 < len(str(caught.value)) < 300


@pytest.mark.parametrize("value", [True, False, None, [1], {"a": 1}, (1,), 1j, b"1", math.inf, math.nan, 10**400])
def test_values_that_are_neither_numbers_nor_texts_are_refused(value):
    with pytest.raises(ExpressionError):
        parse(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sinn(s)", "unknown function 'sinn'; did you mean \"sin\"?"),
        ("u0*s", "unknown name 'u0'; did you mean \"u_0\"?"),
        ("foo(s)", "there are sin cos"),
        ("sin", "needs brackets"),
        ("k(s)", "write k*(...)"),
        ("x + s", "x has no meaning here"),
        ("s**t", "exponent must be a number, at most 16"),
        ("s*1.5*log(-2)", "log(-2) has no finite value"),
        ("atan2(s)", "atan2 takes 2 arguments, not 1"),
        ("s < 1", "first argument of where"),
        ("s; t", "the character ';'"),
        ("s" * 2001, "2001 characters, more than 2000"),
    ],
)
def test_messages_name_what_is_wrong(text, message):
    with pytest.raises(ExpressionError, match=re.escape(message)):
        parse(text, VARIABLES, PARAMETERS)


def test_a_parameter_without_a_value_is_told_apart():
    with pytest.raises(BrokenParameter):
        parse("2*k", (), {"k": None})


def test_every_function_is_known_and_evaluates():
    arguments = {1: "0.3*s", 2: "0.3*s, t", 3: "s < t, s, t"}
    for name, function in FUNCTIONS.items():
        expression = parse(f"{name}({arguments[function.least]})", VARIABLES)
        value = expression.bind("s", "t")(np.array([0.5]), 0.2)
        assert value[0] == pytest.approx(expression.at(s=0.5, t=0.2), rel=1e-14)


tokens = st.lists(
    st.sampled_from(
        [
            *"st()()()+-*/,.<>=0123456789",
            "**",
            "k",
            "pi",
            " ",
            "where(",
            "sin(",
            "exp(",
            "min(",
            "s)",
            ",1)",
            "__",
            "e",
        ]
    ),
    max_size=40,
).map("".join)


@settings(max_examples=500, deadline=None)
@given(st.one_of(tokens, st.text(max_size=60)))
def test_any_text_is_refused_or_evaluates(text):
    try:
        expression = parse(text, VARIABLES, PARAMETERS)
    except ExpressionError:
        return
    assert expression.bind("s", "t")(np.array([0.1, 0.2]), 0.5).shape == (2,)


LARGEST = [
    "+".join(f"{i}.5*s" for i in range(80)),
    "+".join(f"sin({i}*s)" for i in [*range(40), *range(40)]),
    "+".join(f"(s+{i})**15" for i in range(70)),
    "max(" * 60 + "s" + ",0.5)" * 60,
    "s*(1+" * 45 + "t" + ")" * 45,
    "where(s<t," * 30 + "s" + ",t)" * 30,
    "(" * 30 + "s" + ")**7" * 30,
    "(" * 40 + "1.0001*s" + "**2)" * 40,
    "sin(cos(" * 40 + "s" + "))" * 40,
]


@pytest.mark.parametrize("text", LARGEST, ids=lambda text: text[:20])
def test_the_largest_allowed_are_compiled_quickly_and_rightly(text):
    started = time.process_time()
    expression = parse(text, VARIABLES)
    value = expression.bind("s", "t")(np.array([0.25, 0.5]), 0.5)
    assert time.process_time() - started < 2.0
    assert value == pytest.approx([expression.at(s=0.25, t=0.5), expression.at(s=0.5, t=0.5)], rel=1e-9)
