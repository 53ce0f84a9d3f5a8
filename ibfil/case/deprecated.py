"""Words of older versions that are still read: each with the one that stands for it now, and a line that says so."""

from __future__ import annotations

from typing import Any, NamedTuple


class Deprecated(NamedTuple):
    """A word that a key once had; ``instead`` is read for it until the version ``gone``."""

    table: str
    key: str
    word: str
    instead: str
    gone: str
    why: str


DEPRECATED = (
    Deprecated("fluid", "method", "averaged", "table", "0.3", "an approximation that saved a quarter of a step"),
)


def modernise(raw: dict[str, Any]) -> list[str]:
    """Replace deprecated words of a case as it was read; a line for each."""
    lines = []
    for old in DEPRECATED:
        table = raw.get(old.table)
        if isinstance(table, dict) and table.get(old.key) == old.word:
            table[old.key] = old.instead
            lines.append(
                f'{old.table}.{old.key}: "{old.word}" is gone ({old.why}); "{old.instead}" is taken, and said so until '
                f"version {old.gone}"
            )
    return lines
