"""The user's cache: what takes time to find and may be found again by anyone. Losing it costs time and nothing else."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


def folder() -> Path:
    """Where the cache of this user is; it need not exist."""
    from platformdirs import user_cache_path

    return user_cache_path("ibfil")


def keep(path: Path, text: str) -> None:
    """Write a file of the cache, whole or not at all; a folder that cannot be written is no fault."""
    part = path.with_suffix(f".{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text)
        os.replace(part, path)
    except OSError:
        with suppress(OSError):
            part.unlink()
