"""The cases that come with ibfil: finding, listing and copying them.

In a wheel they lie in ``ibfil/_cases``, in a checkout (and so in an editable install) in ``cases`` beside the
package.
"""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass
from pathlib import Path

from ..errors import CaseError


@dataclass(frozen=True)
class Shipped:
    """One shipped case: the name it is called by, the folder it is grouped in, and what it says of itself."""

    name: str
    group: str
    path: Path
    title: str
    source: str


def folder() -> Path:
    """Where the shipped cases lie."""
    package = Path(__file__).resolve().parents[1]
    packed = package / "_cases"
    return packed if packed.is_dir() else package.parent / "cases"


def paths() -> dict[str, Path]:
    """Name -> path of every shipped case, group after group, without reading any."""
    found = sorted(folder().rglob("*.toml"), key=lambda p: (p.parent.as_posix(), p.name))
    return {p.stem: p for p in found}


def listing() -> list[Shipped]:
    """Every shipped case with its title and source, which alone are read."""
    rows = []
    for name, path in paths().items():
        head = tomllib.loads(path.read_text(encoding="utf-8"))
        group = path.parent.relative_to(folder()).as_posix()
        rows.append(Shipped(name, group, path, head.get("title", ""), head.get("source", "")))
    return rows


def named(name: str) -> Path:
    """The path of the shipped case ``name``. Raises CaseError, with the nearest name, where there is none."""
    known = paths()
    if name in known:
        return known[name]
    if Path(name).is_dir():
        raise CaseError([f"{name}: is a folder; allowed: a case file, or the name of a shipped case"])
    near = [f"{name}.toml"] if Path(f"{name}.toml").is_file() else difflib.get_close_matches(name[:100], known, n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    raise CaseError([f"{name}: no such file, and no shipped case of that name; {hint}`ibfil cases` lists them"])


def find(case: str) -> Path:
    """The path of ``case``: a file, or else the name of a shipped case. Raises CaseError for neither."""
    path = Path(case)
    return path if path.is_file() else named(case)


def copy(name: str, target: str) -> Path:
    """Copy the shipped case ``name`` to the file ``target``, which must not exist; returns its path.

    Raises CaseError for a name that is not shipped, a target that is there, or one that cannot be written.
    """
    return _write(named(name).read_bytes(), target)


def write(text: str, target: str) -> Path:
    """Write the text of a case to the file ``target``, which must not exist; returns its path. Raises CaseError."""
    return _write(text.encode(), target)


def _write(content: bytes, target: str) -> Path:
    path = Path(target)
    try:
        with path.open("xb") as out:
            out.write(content)
    except FileExistsError:
        raise CaseError([f"{target}: is there already; nothing was written"]) from None
    except OSError as error:
        raise CaseError([f"{target}: cannot be written ({error.strerror})"]) from None
    return path
