"""The number of threads of numpy's libraries, which they read once, when they are loaded."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_LOCK = threading.Lock()
_held: list[Any] = []  # the limit on BLAS, once for each that asked for it


def set_threads(threads: int) -> None:
    """Give them this many. Has effect only before numpy is imported."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = str(threads)
    os.environ["OMP_WAIT_POLICY"] = "passive"


@contextmanager
def one_thread_of_blas() -> Iterator[None]:
    """Within it BLAS takes one thread, in all threads of the process: until the last of those that asked is done.

    Small dense solves on all cores of a busy machine are some forty times slower than on one: threads are for the
    transforms.
    """
    from threadpoolctl import threadpool_limits

    with _LOCK:
        _held.append(_held[-1] if _held else threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _LOCK:
            limit = _held.pop()
            if not _held:
                limit.restore_original_limits()
