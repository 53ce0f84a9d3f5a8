"""Docstrings as reStructuredText: they are plain text with `code`, indented blocks of equations, lists, examples."""

from __future__ import annotations

import re
from itertools import groupby
from typing import Any

CODE = re.compile(r"(``?)(?!`)(.+?)\1(?!`)", re.DOTALL)
ITEM = re.compile(r"\s*(?:[*-]|\d+\.)\s")
MARKS = re.compile(r"([\\*|]|_(?!\w))")
FIELD = "Alias for field number"


def to_rst(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Change the ``lines`` of a docstring in place: blocks become literal, marks outside code lose their meaning."""
    lines[:] = rst("\n".join(lines)).splitlines()


def rst(text: str) -> str:
    """A docstring as reStructuredText."""
    parts = []
    for kind, group in groupby(_kinds(text.splitlines()), key=lambda pair: pair[0]):
        block = "\n".join(line for _, line in group)
        if kind == "literal":
            block = f"::\n\n{block.strip(chr(10))}\n"
        parts.append(block if kind in ("literal", "example") else _prose(block))
    return "\n\n".join(parts) + "\n"


def _kinds(lines: list[str]) -> list[tuple[str, str]]:
    """Each line with what it is part of: prose, a list, a block or an example; an empty line goes with that before."""
    out: list[tuple[str, str]] = []
    kind = "prose"
    for line in lines:
        if line.lstrip().startswith(">>>"):
            kind = "example"
        elif ITEM.match(line) and not (kind == "literal" and line.startswith("  ")):
            kind = "list"
        elif line.startswith("  ") and kind not in ("list", "example"):
            kind = "literal"
        elif line.strip() and not line.startswith("  ") and not (kind == "example" and out[-1][1].strip()):
            kind = "prose"
        out.append((kind, line))
    return out


def _prose(text: str) -> str:
    """Text whose code stands in double backticks, and where nothing else is a mark."""
    parts, at = [], 0
    for found in CODE.finditer(text):
        before, after = text[at : found.start()], text[found.end() : found.end() + 1]
        code = f"``{' '.join(found.group(2).split())}``"
        parts += [_escaped(before), "\\ " * before[-1:].isalnum(), code, "\\ " * after.isalnum()]
        at = found.end()
    return "".join([*parts, _escaped(text[at:])])


def _escaped(text: str) -> str:
    return re.sub(r"(?m)^(\s*)\\\*(?=\s)", r"\1*", MARKS.sub(r"\\\1", text))


def skip(app: object, what: str, name: str, obj: Any, skipped: bool, options: object) -> bool | None:
    """Whether a member is left out: fields of tuples, of which the docstring says no more than that."""
    return True if FIELD in (getattr(obj, "__doc__", None) or "") else None
