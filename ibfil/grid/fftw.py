"""pyfftw, without the interface to Dask that it would load.

Where Dask is installed `import pyfftw` loads all of its arrays, and pandas and xarray with them: a second, of which no
run has any use. Where Dask is loaded already, as in its workers, there is nothing to spare.
"""

from __future__ import annotations

import sys

_spared = "dask" not in sys.modules
if _spared:
    sys.modules["dask"] = None  # type: ignore[assignment]
try:
    import pyfftw
finally:
    if _spared:
        del sys.modules["dask"]

__all__ = ["pyfftw"]
