"""Expressions in time and space as sums of products f(t) g(x, y, z): a flow that is one is put on a grid once.

Sums, products, quotients and whole powers are taken apart, and sin and cos of a(x, y, z) + b(t), as in travelling
waves, by the addition theorems; not exp, whose two factors may overflow. Nothing else that mixes time and place is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..case.expressions import Expression, Tree, of_tree

MOST = 4  # products of a flow, each of which is a whole field
LONGEST = 64  # of those that are looked at on the way there


class Product(NamedTuple):
    """One product of a vector: its factor in t, and its components in x, y, z."""

    factor: Expression
    place: tuple[Expression, ...]


class _Term(NamedTuple):
    """f(t) g(x, y, z)."""

    f: Tree
    g: Tree


def products(components: Sequence[Expression]) -> list[Product] | None:
    """The vector as a sum of at most MOST products, equal to it but for rounding; None where none is seen.

    ``components`` use t, x, y and z.
    """
    places: dict[Tree, list[Tree]] = {}
    for k, component in enumerate(components):
        terms = _terms(component.tree)
        if terms is None:
            return None
        for f, g in [term for term in terms if term.g != 0.0]:
            place = places.setdefault(f, [0.0] * len(components))
            place[k] = g if place[k] == 0.0 else ("+", place[k], g)
    if len(places) > MOST:
        return None
    places = places or {1.0: [0.0] * len(components)}
    return [Product(of_tree(f), tuple(map(of_tree, place))) for f, place in places.items()]


def _terms(tree: Tree) -> list[_Term] | None:
    """The products that add up to the tree; numbers are in their g, so that an f in two components is the same."""
    uses = of_tree(tree).variables
    if "t" not in uses:
        return [_Term(1.0, tree)]
    if not isinstance(tree, tuple) or (uses == {"t"} and tree[0] not in ("*", "/", "neg")):
        return [_Term(tree, 1.0)]
    op, *children = tree
    if op in ("sin", "cos"):
        return _of_a_sum(op, children[0])
    if op not in ("+", "-", "*", "/", "**", "neg"):
        return None
    parts = [_terms(child) for child in children]
    known = [part for part in parts if part is not None]
    return _combined(op, *known) if len(known) == len(parts) else None


def _combined(op: str, left: list[_Term], right: Sequence[_Term] = ()) -> list[_Term] | None:
    """The products of an operation on sums of products."""
    if op == "neg":
        return [_Term(f, ("neg", g)) for f, g in left]
    if op in ("+", "-"):
        return left + (list(right) if op == "+" else [_Term(f, ("neg", g)) for f, g in right])
    if op == "*" and len(left) * len(right) <= LONGEST:
        return [_Term(_times(a.f, b.f), _times(a.g, b.g)) for a in left for b in right]
    divisor, *more = right
    if op == "/" and not more:
        return [_Term(_over(f, divisor.f), _over(g, divisor.g)) for f, g in left]
    if op == "**" and len(left) == 1 and isinstance(divisor.g, float) and divisor.g in range(17):
        f, g = left[0]
        return [_Term(("**", f, divisor.g), ("**", g, divisor.g))]
    return None


def _of_a_sum(op: str, argument: Tree) -> list[_Term] | None:
    """sin or cos of a(x, y, z) + b(t)."""
    a: Tree = 0.0
    b: Tree = 0.0
    terms = _terms(argument)
    if terms is None:
        return None
    for f, g in terms:
        if f == 1.0:
            a = ("+", a, g)
        elif not of_tree(g).variables:
            b = ("+", b, ("*", f, g))
        else:
            return None
    other = "cos" if op == "sin" else "sin"
    second: Tree = (other, a) if op == "sin" else ("neg", (other, a))
    return [_Term(("cos", b), (op, a)), _Term(("sin", b), second)]


def _times(a: Tree, b: Tree) -> Tree:
    return b if a == 1.0 else a if b == 1.0 else ("*", a, b)


def _over(a: Tree, b: Tree) -> Tree:
    return a if b == 1.0 else ("/", a, b)
