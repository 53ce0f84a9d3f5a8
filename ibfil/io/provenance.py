"""How a result was made: what a run file says of its case, of the program and of the libraries it depends on."""

from __future__ import annotations

import contextlib
import json
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache as once
from importlib import metadata
from typing import TYPE_CHECKING, Any

from ..version import __version__
from .opening import FORMAT, FORMAT_VERSION

if TYPE_CHECKING:
    from ..case.schema import Case


_LIBRARIES = ("numpy", "scipy", "numba", "pyfftw", "h5py")


@once
def _versions() -> dict[str, str]:
    """The same, looked up once: each is a file to parse."""
    found = {"ibfil": __version__, "python": platform.python_version()}
    for library in _LIBRARIES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[library] = metadata.version(library)
    return found


def versions() -> dict[str, str]:
    """Versions of ibfil, Python and the libraries that results depend on."""
    return dict(_versions())


def about(case: Case, method: str, wisdom: str, groups: Mapping[str, float]) -> dict[str, Any]:
    """Return the attributes of a run that begins."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "ibfil_version": __version__,
        "case": case.text,
        "created": now(),
        "finished": "",
        "versions": json.dumps(versions()),
        "method": method,
        "wisdom": wisdom,
        "groups": json.dumps(dict(groups)),
        "status": "running",
        "reason": "",
        "steps": 0,
        "wall_time": 0.0,
    }


def now() -> str:
    """The time, as run files have it."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
