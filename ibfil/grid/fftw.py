"""pyfftw, without the interfaces to Dask and to scipy that it would load.

Where Dask is installed `import pyfftw` loads all of its arrays, and pandas and xarray with them: a second, of which no
run has any use. Where Dask is loaded already, as in its workers, there is nothing to spare.
"""

from __future__ import annotations

import sys

_spared = [name for name in ("dask", "scipy.fft", "scipy.fftpack") if name not in sys.modules]
for _name in _spared:
    sys.modules[_name] = None  # type: ignore[assignment]
try:
    import pyfftw
finally:
    for _name in _spared:
        del sys.modules[_name]

__all__ = ["pyfftw"]
