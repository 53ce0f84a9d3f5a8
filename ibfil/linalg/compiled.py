"""`njit` as numba has it, whose kernels come out of numba's cache without the rest of numba.

Before numba reads a kernel from its cache it loads all that it could compile with, some sixty modules and scipy.linalg:
a third of a second, of which a kernel that is compiled already has no use. Here that waits for the first kernel that
has to be compiled. Only numba's memory, which kernels call at run time, is made ready first.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

try:
    from numba.core.caching import FunctionCache
    from numba.core.runtime import rtsys

    class _Kept(FunctionCache):
        """numba's cache of one function."""

        def load_overload(self, sig, target_context):
            """The kernel of a signature; None where it is not there."""
            rtsys.initialize(target_context)
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)

    _quick = hasattr(FunctionCache, "_load_overload") and hasattr(FunctionCache, "_guard_against_spurious_io_errors")
except (ImportError, AttributeError):  # another numba: its own way
    _quick = False


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """numba.njit with these options."""
    if not (cache and _quick):
        return numba.njit(cache=cache, **options)

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        if hasattr(dispatcher, "_cache"):  # not where compiling is switched off (NUMBA_DISABLE_JIT)
            dispatcher._cache = _Kept(function)
        return dispatcher

    return compiled
