"""Where the files of a run lie: the checkpoint and the journal beside RUN.h5."""

from __future__ import annotations

from pathlib import Path


def checkpoint_path(path: Path) -> Path:
    """RUN.ckpt.h5, where RUN.h5 can be gone on from."""
    return path.with_name(path.name.removesuffix(".h5") + ".ckpt.h5")


def journal_path(path: Path) -> Path:
    """RUN.journal, which is there while RUN.h5 is being written (journal.py)."""
    return path.with_name(path.name.removesuffix(".h5") + ".journal")


def part_path(path: Path) -> Path:
    """FILE.part, where a file of a run is made before it takes its place."""
    return path.with_name(path.name + ".part")
