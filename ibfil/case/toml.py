"""TOML read within limits, and its faults in words: line and column, and what to write where that is known."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

MAX_DEPTH = 16  # of tables and lists in each other, and parts of a dotted key
# Once through the text: texts and comments, in which nothing counts; parts of keys, dots, and what ends a key.
_TOKEN = re.compile(
    r"""(?P<long>\"{3}(?:[^"\\]|\\.|"(?!""))*+\"{3}|'{3}(?:[^']|'(?!''))*+'{3}|\#[^\n]*+)
    |(?P<part>"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+'|[^\s.\#"'=,\[\]{}]++)
    |(?P<open>["'])
    |(?P<dot>\.)
    |(?P<end>[=,\[\]{}\n])""",
    re.VERBOSE | re.DOTALL,
)
_AT = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_NUMBER = r"[+-]?(?:[\d_]+(?:\.[\d_]+)?(?:[eE][+-]?[\d_]+)?|inf|nan|0[xob][\da-fA-F_]+)"
_PLAIN = re.compile(rf"{_NUMBER}|true|false|\d{{4}}-\d\d-\d\d.*|\d\d:\d\d.*")  # needs no quotes


def load(text: str) -> dict[str, Any]:
    """The content of a TOML text. Raises ValueError, with a sentence: not TOML, or nested deeper than any case is."""
    if _longest_key(text) > MAX_DEPTH:  # tomllib takes minutes over keys of many thousand parts
        raise ValueError(f"a key of more than {MAX_DEPTH} parts")
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_sentence(text, str(error))) from None
    layer: list[Any] = [content]
    for _ in range(MAX_DEPTH):
        inner = [entry.values() if isinstance(entry, dict) else entry for entry in layer]
        layer = [value for values in inner for value in values if isinstance(value, dict | list)]
    if layer:
        raise ValueError("nested too deeply")
    return content


def _longest_key(text: str) -> int:
    """The most parts that any dotted key has, up to where the text cannot be TOML any more."""
    longest, parts, after_dot = 0, 0, False
    for token in _TOKEN.finditer(text):
        kind = token.lastgroup
        if kind == "open":  # a text without an end: tomllib comes no further
            break
        if kind == "part":
            parts, after_dot = (parts + 1 if after_dot else 1), False
            longest = max(longest, parts)
        else:
            after_dot = kind == "dot" and parts > 0
            parts = parts if after_dot else 0
    return longest


def _sentence(text: str, error: str) -> str:
    """A fault that tomllib found: where, its line, and what may have been meant."""
    at = _AT.search(error)
    if at is None or at.group(1) is None:
        return error
    number, column = int(at.group(1)), int(at.group(2))
    line = text.split("\n")[number - 1].strip()
    shown = line if len(line) <= 80 else line[:76] + " ..."
    hint = _hint(line)
    return f"line {number}, column {column}: {error[: at.start()]}: {shown}" + (f"; {hint}" if hint else "")


def _hint(line: str) -> str:
    """A hint at what was meant by a line that is at fault; "" where that is not known."""
    _, equals, value = line.partition("=")
    if not equals:
        return ""
    if re.fullmatch(r"\s*\d+,\d+\s*(#.*)?", value):
        return "a number has a point, not a comma"
    for item in _items(value.split("#")[0].strip().strip("[]")):
        if not item or item[0] in "\"'{[" or _PLAIN.fullmatch(item):
            continue
        if item.lower() in ("true", "false"):
            return f"write {item.lower()}"
        if re.fullmatch(r"[+-]?(\d*\.\d*)([eE][+-]?\d+)?", item):
            return f"a number has digits on both sides of its point: {float(item)!r}"
        if re.search(r"[A-Za-z*/(^]", item):
            return f'a word or a formula stands in quotes: "{item}"'
    return ""


def _items(value: str) -> Iterator[str]:
    """The parts of a list between commas that are in no brackets."""
    depth, part = 0, ""
    for letter in value:
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            yield part.strip()
            part = ""
        else:
            part += letter
    yield part.strip()
