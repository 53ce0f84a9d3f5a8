"""README's first command up to its first step: with nothing compiled or kept, and as every later run."""

from __future__ import annotations

import os
import subprocess
import sys
from compileall import compile_dir
from pathlib import Path
from tempfile import TemporaryDirectory

from .timing import Row, of_children

COLD, WARM = 10.0, 1.2  # seconds
_COMMAND = ("-m", "ibfil", "run", "swimmer_stokes", "time.end=0.005", "-o", "first.h5", "--force")  # one step
_LIBRARIES = ("-c", "import numpy, scipy.linalg, numba, h5py, pydantic")
_TIMES = 5


def first_step() -> list[Row]:
    """The first run after installation, and the best of later ones, against what they may take."""
    compile_dir(Path(__file__).parent.parent, quiet=2)  # as an installation does
    with TemporaryDirectory() as folder:
        cold = processor_seconds(_COMMAND, folder)
        warm = min(processor_seconds(_COMMAND, folder) for _ in range(_TIMES))
        floor = min(processor_seconds(_LIBRARIES, folder) for _ in range(_TIMES))
    return [
        Row("first step, nothing compiled", cold, f"{COLD:g} s", COLD, cold / COLD, 1.0),
        Row("first step of later runs", warm, f"{WARM:g} s", WARM, warm / WARM, 1.0),
        Row("first step of later runs", warm, "libraries loaded", floor, warm / floor, None),
    ]


def processor_seconds(words: tuple[str, ...], folder: str) -> float:
    """Processor time of a process that has its caches in a folder and nowhere else: that of an idle machine's clock."""
    cache = str(Path(folder) / "cache")
    surroundings = os.environ | {"NUMBA_CACHE_DIR": cache, "XDG_CACHE_HOME": cache}
    surroundings.pop("PYTHONDONTWRITEBYTECODE", None)
    began = of_children()
    subprocess.run([sys.executable, *words], cwd=folder, env=surroundings, capture_output=True, check=True)
    return of_children() - began
