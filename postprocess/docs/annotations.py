"""Annotations of the package as types: modules get what they import for types alone, so that signatures lead on."""

from __future__ import annotations

import ast
import importlib
import pkgutil
from types import ModuleType
from typing import get_type_hints

import ibfil


def complete() -> None:
    """Import every module, and then in each what stands below ``if TYPE_CHECKING:``, which makes no circle by then."""
    found = [one.name for one in pkgutil.walk_packages(ibfil.__path__, "ibfil.")]
    for module in [importlib.import_module(name) for name in found if not name.endswith("__main__")]:
        _types_of(module)


def _types_of(module: ModuleType) -> None:
    if module.__file__ is None:
        return
    with open(module.__file__, encoding="utf-8") as source:
        tree = ast.parse(source.read())
    for node in tree.body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            exec(compile(ast.Module(node.body, []), module.__file__, "exec"), module.__dict__)
    for each in vars(module).values():
        if isinstance(each, type) and issubclass(each, tuple) and each.__module__ == module.__name__:
            each.__new__.__annotations__ = get_type_hints(each)  # of a named tuple: it does not know its module
