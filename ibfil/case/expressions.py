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
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING, Any

from .formulas import trees
from .formulas.trees import BINARY, COMPARE, fold, leaves, text_of
from .formulas.trees import FUNCTIONS as FUNCTIONS
from .formulas.trees import MAX_EXPONENT as MAX_EXPONENT
from .formulas.trees import ExpressionError as ExpressionError
from .formulas.trees import Tree as Tree

if TYPE_CHECKING:
    import numpy as np


MAX_LENGTH = 2000  # characters
MAX_NODES = 500  # of the syntax tree
MAX_DEPTH = 100  # of the syntax tree: no walk of it meets Python's limit of recursion
VARIABLES = ("s", "t", "x", "y", "z", "q")
COPIED = ("i", "phase")  # of a copy: its number from 0 on, its phase; a parameter of such a name stands before it
CONSTANTS = {"pi": math.pi}

# None: a parameter whose own value is at fault, which is told once and not at each use
Parameters = Mapping[str, float | None]


class BrokenParameter(ExpressionError):
    """An expression that uses a parameter whose own value is at fault."""


@dataclass(frozen=True)
class Expression:
    """A checked expression. Two are equal where their trees are, after [parameters] have become numbers."""

    text: str = field(compare=False)  # as written
    tree: Tree
    variables: frozenset[str]  # those it uses
    # Of a copy: the formula that all copies share, and the values of i and phase that made this one of it.
    origin: tuple[Expression, tuple[tuple[str, float], ...]] | None = field(default=None, compare=False, repr=False)

    @property
    def constant(self) -> float | None:
        """Its value where it uses no variable, else None."""
        return self.tree if isinstance(self.tree, float) else None

    def at(self, **values: float) -> float:
        """Its value, by ``math``, at these values of its variables. Raises ExpressionError without one."""
        return trees.value_of(self.tree, dict.fromkeys(COPIED, 0.0) | values)

    def of_copy(self, **values: float) -> Expression:
        """The expression of one copy, where i and phase have these values; itself where it uses neither.

        Raises ExpressionError where it then has a constant part without a finite value.
        """
        used = {name: value for name, value in values.items() if name in self.variables}
        if not used:
            return self
        tree = fold(trees.replaced(self.tree, used))
        left = frozenset(leaf for leaf in leaves(tree) if isinstance(leaf, str))
        return Expression(self.text, tree, left, (self, tuple(used.items())) if left else None)

    def bind(self, *names: str) -> Callable[..., np.ndarray]:
        """A function of ``names`` in that order: floats or arrays in, a float64 array of their shape out.

        Of a formula of i or phase that is of no copy yet it is that of the first copy, with phase 0.
        Any threads may call it; some microseconds a call for short arrays. Where there is no value (1/0, sqrt(-1)), inf
        or nan. Raises ValueError if the expression uses a variable that is not among ``names``.
        """
        import numpy as np

        from .formulas.evaluation import function_of

        missing = self.variables - set(names)
        if missing & set(COPIED):
            return self.of_copy(**dict.fromkeys(COPIED, 0.0)).bind(*names)
        if missing:
            raise ValueError(f"{self.text!r} uses {sorted(self.variables)}, bound to {names}")
        if isinstance(self.tree, float):
            value = self.tree
            return lambda *args: np.full(np.broadcast(*args).shape, value)
        if self.origin is not None:  # compiled once for all copies
            shared, values = self.origin
            whole = shared.bind(*names, *(name for name, _ in values))
            return lambda *args: whole(*args, *(value for _, value in values))
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
    tree = fold(_read(_syntax(value), variables, parameters or {}))
    return Expression(value, tree, frozenset(leaf for leaf in leaves(tree) if isinstance(leaf, str)))


def of_tree(tree: Tree) -> Expression:
    """The expression of a tree made of others' parts."""
    return Expression(text_of(tree), tree, frozenset(leaf for leaf in leaves(tree) if isinstance(leaf, str)))


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
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            return (BINARY[type(op)], read(left), read(right))
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
    if name in variables and not (name in COPIED and name in parameters):
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
    if name in VARIABLES or name in COPIED:
        raise ExpressionError(f"{name} has no meaning here")
    known = [*(name for name in variables if name not in COPIED), *CONSTANTS, *islice(parameters, 100)]
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
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in COMPARE:
            return (COMPARE[type(op)], read(left), read(right))
    raise ExpressionError("the first argument of where must be one comparison with <, <=, > or >=")
