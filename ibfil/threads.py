"""The number of threads of numpy's and numexpr's libraries, which they read once, when they are loaded."""

from __future__ import annotations

import os


def set_threads(threads: int) -> None:
    """Give them this many. Has effect only before numpy is imported."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_MAX_THREADS"):
        os.environ[name] = str(threads)
    os.environ["OMP_WAIT_POLICY"] = "passive"
