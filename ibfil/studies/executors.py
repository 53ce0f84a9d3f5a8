"""Executors that a user names: what `--executor MODULE:FACTORY` does (recipes in README.md).

FACTORY is called with the number of --jobs. It gives an executor as of concurrent.futures, or a context manager of one,
which is where a cluster is begun and ended.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any

from ..errors import CaseError

FORM = "MODULE:FACTORY, of which FACTORY(jobs) gives an executor or a context manager of one (ibfil/studies/README.md)"


@contextmanager
def opened(name: str | None, jobs: int) -> Iterator[Executor | None]:
    """The executor of that name while the ``with`` lasts; None for none. Modules are looked for here first.

    Raises CaseError, in one line, where there is none of that name or it cannot be begun.
    """
    if name is None:
        yield None
        return
    factory = _found(name)
    try:
        given = factory(jobs)
        inner = given.__enter__()
    except Exception as error:
        raise CaseError([f"--executor {name}: cannot be begun ({type(error).__name__}: {error})"]) from error
    try:
        if not callable(getattr(inner, "submit", None)):
            raise CaseError([f"--executor {name}: found {type(inner).__name__}; allowed: {FORM}"])
        yield inner
    finally:
        given.__exit__(None, None, None)


def _found(name: str) -> Callable[[int], Any]:
    """The factory."""
    module, colon, factory = name.partition(":")
    if not (module and colon and factory):
        raise CaseError([f"--executor: found {name!r}; allowed: {FORM}"])
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        loaded = importlib.import_module(module)
    except Exception as error:  # what a user's file may raise
        raise CaseError([f"--executor {name}: {module} cannot be imported ({error})"]) from error
    found = getattr(loaded, factory, None)
    if not callable(found):
        raise CaseError([f"--executor {name}: {module} has no function {factory}; allowed: {FORM}"])
    made: Callable[[int], Any] = found
    return made


def loss(future: Future[Any]) -> tuple[str, str] | None:
    """How a member ended of which there is no outcome, as status and message; None where there is one.

    Where the executor itself has broken the member need not be at fault: it waits, to be run by the same command.
    """
    try:
        error = future.exception()
    except CancelledError:
        return "waiting", "the executor gave it up"
    if error is None:
        return None
    words = f"{type(error).__name__}: {error}".replace("\n", "; ")
    if isinstance(error, BrokenExecutor):
        return "waiting", f"the executor broke ({words}); with --jobs alone the run that breaks it is named"
    if isinstance(error, CancelledError) or "Cancelled" in type(error).__name__:
        return "waiting", f"the executor gave it up ({words})"
    return "failed", f"its process died: {words}"
