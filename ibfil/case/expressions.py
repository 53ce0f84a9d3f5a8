"""Expressions of a case file: text -> a checked tree -> numbers with ``math``; evaluation.py makes arrays of it.

The text is never evaluated as Python. It is read by the standard ``ast``; every node must be on a short
list; names of [parameters] become numbers, and what is constant is worked out at once.
"""

from __future__ import annotations

import ast
import difflib
import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import numpy as np


MAX_LENGTH = 2000  # characters
MAX_NODES = 500  # of the syntax tree
MAX_DEPTH = 100  # of the syntax tree: no walk of it meets Python's limit of recursion
MAX_EXPONENT = 16.0

VARIABLES = ("s", "t", "x", "y", "z", "q")
CONSTANTS = {"pi": math.pi}

# A number; a variable's name; (operator or function, arguments ...); (comparison, left, right) in where
Tree = float | str | tuple[Any, ...]
# None: a parameter whose own value is at fault, which is told once and not at each use
Parameters = Mapping[str, float | None]


class ExpressionError(ValueError):
    """A fault of an expression, as a clause that fits in brackets."""


class BrokenParameter(ExpressionError):
    """An expression that uses a parameter whose own value is at fault."""


def _sign(x: float) -> float:
    return float((x > 0.0) - (x < 0.0))


def _step(x: float) -> float:
    return 0.0 if x < 0.0 else 1.0


class _Function(NamedTuple):
    """One function: its least and largest number of arguments, its value."""

    least: int
    most: int
    value: Callable[..., float]


FUNCTIONS: dict[str, _Function] = {
    "sin": _Function(1, 1, math.sin),
    "cos": _Function(1, 1, math.cos),
    "tan": _Function(1, 1, math.tan),
    "asin": _Function(1, 1, math.asin),
    "acos": _Function(1, 1, math.acos),
    "atan": _Function(1, 1, math.atan),
    "atan2": _Function(2, 2, math.atan2),
    "sinh": _Function(1, 1, math.sinh),
    "cosh": _Function(1, 1, math.cosh),
    "tanh": _Function(1, 1, math.tanh),
    "exp": _Function(1, 1, math.exp),
    "log": _Function(1, 1, math.log),
    "sqrt": _Function(1, 1, math.sqrt),
    "abs": _Function(1, 1, abs),
    "sign": _Function(1, 1, _sign),
    "min": _Function(2, 8, min),
    "max": _Function(2, 8, max),
    "where": _Function(3, 3, lambda chosen, yes, no: yes if chosen else no),
    "step": _Function(1, 1, _step),  # 0 below 0, 1 from 0 on
}
_BINARY: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
_COMPARE: dict[type[ast.cmpop], str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_VALUES: dict[str, Callable[..., float | bool]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "**": math.pow,
    "neg": lambda a: -a,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    **{name: function.value for name, function in FUNCTIONS.items()},
}


@dataclass(frozen=True)
class Expression:
    """A checked expression. Two are equal where their trees are, after [parameters] have become numbers."""

    text: str = field(compare=False)  # as written
    tree: Tree
    variables: frozenset[str]  # those it uses

    @property
    def constant(self) -> float | None:
        """Its value where it uses no variable, else None."""
        return self.tree if isinstance(self.tree, float) else None

    def at(self, **values: float) -> float:
        """Its value, by ``math``, at these values of its variables. Raises ExpressionError without one."""
        return _value(self.tree, values)

    def bind(self, *names: str) -> Callable[..., np.ndarray]:
        """A function of ``names`` in that order: floats or arrays in, a float64 array of their shape out.

        Any threads may call it; some microseconds a call for short arrays. Where there is no value (1/0, sqrt(-1)), inf
        or nan. Raises ValueError if the expression uses a variable that is not among ``names``.
        """
        import numpy as np

        from .evaluation import function_of

        if self.variables - set(names):
            raise ValueError(f"{self.text!r} uses {sorted(self.variables)}, bound to {names}")
        if isinstance(self.tree, float):
            value = self.tree
            return lambda *args: np.full(np.broadcast(*args).shape, value)
        used = tuple(i for i, name in enumerate(names) if name in self.variables)
        function = function_of(self.tree, tuple(names[i] for i in used))
        if len(used) == len(names):
            return function

        def partly(*args: Any) -> np.ndarray:
            value = function(*[args[i] for i in used])
            shape = np.broadcast(*args).shape
            return value if value.shape == shape else np.full(shape, value)

        return partly


def parse(value: str | int | float, variables: Sequence[str] = (), parameters: Parameters | None = None) -> Expression:
    """The expression ``value``, in which ``variables``, the names of ``parameters`` and pi may stand.

    Raises ExpressionError: not an expression, too long or too deep, a name that is not known, a constant part
    without a finite value; BrokenParameter where it uses a parameter whose value is None.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ExpressionError("neither a number nor a text")
    if not isinstance(value, str):
        return Expression(repr(value), _finite(value), frozenset())
    tree = _fold(_read(_syntax(value), variables, parameters or {}))
    return Expression(value, tree, frozenset(leaf for leaf in _leaves(tree) if isinstance(leaf, str)))


def of_tree(tree: Tree) -> Expression:
    """The expression of a tree made of others' parts."""
    return Expression(_text(tree), tree, frozenset(leaf for leaf in _leaves(tree) if isinstance(leaf, str)))


def suggestion(name: str, known: Iterable[str]) -> str:
    """'; did you mean "..."?' with the one of ``known`` nearest to ``name``, or nothing."""
    near = difflib.get_close_matches(name, sorted(known), n=1)
    return f'; did you mean "{near[0]}"?' if near else ""


def _finite(number: float) -> float:
    """The number as a float; ExpressionError where it has none."""
    try:
        value = float(number)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise ExpressionError("not a finite number")
    return value


def _syntax(text: str) -> ast.expr:
    """The syntax tree of ``text``, once it is known to be plain, short and not too deep."""
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"{len(text)} characters, more than {MAX_LENGTH}")
    # Python reads other alphabets' letters as Latin ones; nobody should have to guess which.
    odd = re.search(r"[^A-Za-z0-9_+\-*/().,<>= \t\r\n]", text)
    if odd:
        power = "; a power is written **" if odd.group() == "^" else ""
        raise ExpressionError(f"the character {odd.group()!r} does not belong in an expression{power}")
    if not text.strip():
        raise ExpressionError("empty")
    try:
        with warnings.catch_warnings(action="ignore"):  # of "1if": it is refused below
            tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ExpressionError("not an expression") from None
    count, layer = 0, [tree]
    for _ in range(MAX_DEPTH):
        count += len(layer)
        layer = [child for node in layer for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
    if layer:
        raise ExpressionError(f"nested more than {MAX_DEPTH} deep (a sum of n terms counts n)")
    if count > MAX_NODES:
        raise ExpressionError(f"{count} numbers, names and operations, more than {MAX_NODES}")
    return tree


def _read(node: ast.AST, variables: Sequence[str], parameters: Parameters) -> Tree:
    """The tree of a syntax tree, names resolved, nothing worked out yet."""

    def read(child: ast.AST) -> Tree:
        return _read(child, variables, parameters)

    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value):
            return _finite(value)
        case ast.Name(id=name):
            return _name(name, variables, parameters)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return (_BINARY[type(op)], read(left), read(right))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return read(operand)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return ("neg", read(operand))
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            _check_call(name, len(args), {*variables, *parameters, *CONSTANTS})
            if name == "where":
                return (name, _condition(args[0], read), read(args[1]), read(args[2]))
            return (name, *map(read, args))
        case ast.Compare():
            raise ExpressionError("a comparison stands only as the first argument of where")
    raise ExpressionError("only numbers, names, + - * / **, brackets and calls of known functions are allowed")


def _name(name: str, variables: Sequence[str], parameters: Parameters) -> Tree:
    if name in variables:
        return name
    if name in CONSTANTS:
        return CONSTANTS[name]
    if name in parameters:
        value = parameters[name]
        if value is None:
            raise BrokenParameter(f"the parameter {name} has no value")
        return float(value)
    if name in FUNCTIONS:
        raise ExpressionError(f"{name} is a function, so it needs brackets after it")
    if name in VARIABLES:
        raise ExpressionError(f"{name} has no meaning here")
    known = [*variables, *CONSTANTS, *islice(parameters, 100)]
    hint = suggestion(name, known) or f"; there are {', '.join(known[:20])}"
    raise ExpressionError(f"unknown name '{name[:100]}'{hint}")


def _check_call(name: str, count: int, names: set[str]) -> None:
    if name not in FUNCTIONS:
        if name in names:
            raise ExpressionError(f"'{name}' is not a function; write {name}*(...) to multiply")
        hint = suggestion(name, FUNCTIONS) or f"; there are {' '.join(FUNCTIONS)}"
        raise ExpressionError(f"unknown function '{name}'{hint}")
    least, most = FUNCTIONS[name].least, FUNCTIONS[name].most
    if not least <= count <= most:
        wanted = f"{least}" if least == most else f"{least} to {most}"
        raise ExpressionError(f"{name} takes {wanted} argument{'s' if most > 1 else ''}, not {count}")


def _condition(node: ast.expr, read: Callable[[ast.AST], Tree]) -> Tree:
    match node:
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARE:
            return (_COMPARE[type(op)], read(left), read(right))
    raise ExpressionError("the first argument of where must be one comparison with <, <=, > or >=")


def _fold(tree: Tree) -> Tree:
    """The tree with its constant parts worked out; of a where with a constant condition, the branch."""
    if not isinstance(tree, tuple):
        return tree
    op, *children = tree
    if op == "where":
        _, left, right = children[0]
        left, right = _fold(left), _fold(right)
        if isinstance(left, float) and isinstance(right, float):
            return _fold(children[1 if _VALUES[children[0][0]](left, right) else 2])
        return (op, (children[0][0], left, right), _fold(children[1]), _fold(children[2]))
    children = [_fold(child) for child in children]
    if op == "/" and children[1] == 0.0:
        raise ExpressionError("division by zero")
    if op == "**" and not (isinstance(children[1], float) and abs(children[1]) <= MAX_EXPONENT):
        raise ExpressionError(f"an exponent must be a number, at most {MAX_EXPONENT:g} in size")
    if all(isinstance(child, float) for child in children):
        return _apply(op, children)
    return (op, *children)


def _apply(op: str, values: list[float]) -> float:
    """One operation on numbers; ExpressionError where it has no finite value."""
    try:
        result = float(_VALUES[op](*values))
    except (ValueError, ZeroDivisionError, OverflowError):
        result = math.nan
    if not math.isfinite(result):
        shown = f" {op} ".join(f"{v:.6g}" for v in values) if op in _BINARY.values() else f"{op}({values[0]:.6g})"
        raise ExpressionError(f"{shown} has no finite value")
    return result


def _value(tree: Tree, values: Mapping[str, float]) -> float:
    """The value of the tree by ``math``, where each variable has the given value."""
    if isinstance(tree, float):
        return tree
    if isinstance(tree, str):
        return float(values[tree])
    op, *children = tree
    if op == "where":
        compare, left, right = children[0]
        chosen = _VALUES[compare](_value(left, values), _value(right, values))
        return _value(children[1 if chosen else 2], values)
    return _apply(op, [_value(child, values) for child in children])


def _leaves(tree: Tree) -> Iterator[float | str]:
    """The numbers and variables of the tree."""
    if isinstance(tree, tuple):
        for child in tree[1:]:
            yield from _leaves(child)
    else:
        yield tree


def _text(tree: Tree) -> str:
    """The tree as a text that `parse` reads, every operation in brackets."""
    if not isinstance(tree, tuple):
        return tree if isinstance(tree, str) else f"({tree!r})"
    op, *children = tree
    parts = [_text(child) for child in children]
    if op == "neg":
        return f"(-{parts[0]})"
    return f"{op}({', '.join(parts)})" if op in FUNCTIONS else f"({parts[0]}{op}{parts[1]})"
