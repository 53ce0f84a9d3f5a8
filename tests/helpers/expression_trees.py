"""Random expressions as text and as the Python that means the same, and numbers that know their rounding error."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import strategies as st

VARIABLES = ("s", "t")
PARAMETERS = {"k": 1.75, "u_0": -0.5}


def _combine(inner):
    """Trees one level higher; each is a pair (our text, Python's text)."""
    unary = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"]
    unary += ["sign", "step"]

    def same(template):
        return lambda *parts: (
            template.format(*(p[0] for p in parts)),
            template.format(*(p[1] for p in parts)),
        )

    def where(op, a, b, yes, no):
        ours = f"where({a[0]} {op} {b[0]}, {yes[0]}, {no[0]})"
        return ours, f"(({yes[1]}) if ({a[1]}) {op} ({b[1]}) else ({no[1]}))"

    return st.one_of(
        st.builds(lambda op, a, b: same(f"({{}}){op}({{}})")(a, b), st.sampled_from("+-*/"), inner, inner),
        st.builds(lambda a: same("-({})")(a), inner),
        st.builds(lambda a: same("+({})")(a), inner),
        st.builds(
            lambda n, a: (f"({a[0]})**({n})", f"power({a[1]}, {n})"),
            st.sampled_from([-2, 0, 1, 2, 3, 5, 0.5]),
            inner,
        ),
        st.builds(lambda f, a: same(f"{f}({{}})")(a), st.sampled_from(unary), inner),
        st.builds(lambda a, b: same("atan2({}, {})")(a, b), inner, inner),
        st.builds(
            lambda f, a, b, c: same(f"{f}({{}}, {{}}, {{}})")(a, b, c),
            st.sampled_from(["min", "max"]),
            inner,
            inner,
            inner,
        ),
        st.builds(where, st.sampled_from(["<", "<=", ">", ">="]), inner, inner, inner, inner),
    )


leaves = st.one_of(
    st.sampled_from([*VARIABLES, *PARAMETERS, "pi"]).map(lambda n: (n, n)),
    st.floats(0, 4, allow_subnormal=False).map(lambda x: (repr(x), repr(x))),
    st.integers(0, 9).map(lambda n: (str(n), f"{n}.0")),
)
trees = st.recursive(leaves, _combine, max_leaves=12)


class Number:
    """A value with a bound on the error that rounding may have made in it (running error analysis)."""

    unit = 2.0**-50

    def __init__(self, value: float, error: float = 0.0) -> None:
        self.value, self.error = value, error + abs(value) * self.unit + 1e-300

    @classmethod
    def of(cls, x):
        return x if isinstance(x, cls) else cls(float(x), 0.0)

    def __neg__(self):
        return Number(-self.value, self.error)

    def __pos__(self):
        return self

    def __add__(self, other):
        other = Number.of(other)
        return Number(self.value + other.value, self.error + other.error)

    __radd__ = __add__

    def __sub__(self, other):
        return self + (-Number.of(other))

    def __rsub__(self, other):
        return Number.of(other) - self

    def __mul__(self, other):
        b = Number.of(other)
        error = abs(self.value) * b.error + abs(b.value) * self.error + self.error * b.error
        return Number(self.value * b.value, error)

    __rmul__ = __mul__

    def __truediv__(self, other):
        b = Number.of(other)
        assume(abs(b.value) > 2 * b.error)
        value = self.value / b.value
        return Number(value, (self.error + abs(value) * b.error) / (abs(b.value) - b.error))

    def __rtruediv__(self, other):
        return Number.of(other) / self

    def __pow__(self, n):
        return self.through(lambda x: math.pow(x, float(n)))

    def through(self, function, low=-math.inf, high=math.inf):
        """The value of a function; its error from the largest change over the interval of error."""
        assume(low <= self.value - 2 * self.error and self.value + 2 * self.error <= high)
        value = function(self.value)
        near = [function(self.value + d * self.error) for d in (-1.0, -0.5, 0.5, 1.0)]
        return Number(value, 4 * max(abs(n - value) for n in near) + 8 * abs(value) * self.unit)

    def far(self, other):
        """The other one, where the order of the two is certain."""
        other = Number.of(other)
        assume(abs(self.value - other.value) > self.error + other.error)
        return other

    def __lt__(self, other):
        return self.value < self.far(other).value

    def __gt__(self, other):
        return self.value > self.far(other).value

    __le__ = __lt__
    __ge__ = __gt__


def _pick(function):
    def chosen(*args):
        numbers = [Number.of(a) for a in args]
        return Number(function(n.value for n in numbers), max(n.error for n in numbers))

    return chosen


def _jump(function):
    def value(x):
        x = Number.of(x)
        assume(abs(x.value) > x.error)
        return Number(function(x.value))

    return value


def _smooth(function, low=-math.inf, high=math.inf):
    return lambda x: Number.of(x).through(function, low, high)


def _angle(y, x):
    y, x = Number.of(y), Number.of(x)
    size = math.hypot(y.value, x.value)
    assume(size > 4 * (x.error + y.error) and (x.value > x.error or abs(y.value) > y.error))
    return Number(math.atan2(y.value, x.value), 4 * (x.error + y.error) / size)


PLAIN = {name: getattr(math, name) for name in dir(math) if not name.startswith("_")}
PLAIN |= {
    "power": math.pow,
    "abs": abs,
    "min": min,
    "max": max,
    "sign": lambda x: (x > 0) - (x < 0),
    "step": lambda x: float(x >= 0),
}
CAREFUL = {
    **{name: _smooth(getattr(math, name)) for name in ("sin", "cos", "tan", "atan", "sinh", "cosh", "tanh", "exp")},
    "asin": _smooth(math.asin, -1, 1),
    "acos": _smooth(math.acos, -1, 1),
    "log": _smooth(math.log, 1e-300),
    "sqrt": _smooth(math.sqrt, 0),
    "abs": _smooth(abs),
    "min": _pick(min),
    "max": _pick(max),
    "sign": _jump(lambda x: float((x > 0) - (x < 0))),
    "step": _jump(lambda x: float(x >= 0)),
    "atan2": _angle,
    "pi": math.pi,
    "power": lambda x, n: Number.of(x) ** n,
}
