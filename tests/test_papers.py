"""The documents of the project: each package has its own, and none names what is not there.

The rules are R6 and R7 of CONTRIBUTING.md.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "ibfil"
FOLDERS = ("ibfil", "cases", "postprocess", "tests")
TEXT = {".py", ".md", ".toml", ".csv", ".json", ".sh", ".cff"}
# Beside the folder of a text, the folders that names of files are relative to: the last for postprocess/paper's table.
BASES = (PACKAGE, ROOT, ROOT / "tests", ROOT / "postprocess" / "paper" / "measured")
DOCUMENT = re.compile(r"(?<![\w$./-])(?:[\w.-]+/)*[\w-]+\.md\b")
SOURCE = re.compile(r"(?<![\w$./-])((?:[\w.-]+/)*)([\w-]+\.py)\b")  # its folder, with a slash or empty, and its name
LIST = re.compile(r"`([A-Za-z_]\w*)`\s+(?:of|in)\s+((?:[\w-]+/)+[\w-]+\.py)\b")
LINK = re.compile(r"\]\(([^)\s#]+)\)")
CODE = re.compile(r"^    .*|`[^`\n]*`", re.MULTILINE)


def packages() -> list[Path]:
    """Every folder of modules below ibfil."""
    return sorted(path.parent for path in PACKAGE.rglob("__init__.py") if path.parent != PACKAGE)


def texts(*endings: str) -> list[Path]:
    """Every text file of the project, or those with these endings."""
    paths = [*ROOT.iterdir(), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))]
    return sorted(path for path in paths if path.is_file() and path.suffix in (endings or TEXT))


def modules(folder: Path) -> list[str]:
    """The Python files of a package that have a name of their own."""
    return sorted(path.name for path in folder.glob("*.py") if path.name != "__init__.py")


def located(name: str, beside: Path) -> Path | None:
    """The file of that name, relative to the folder ``beside`` or to one of BASES; None where there is none."""
    return next((base / name for base in (beside, *BASES) if (base / name).exists()), None)


EACH_PACKAGE = pytest.mark.parametrize("folder", packages(), ids=lambda path: path.relative_to(PACKAGE).as_posix())
EACH_TEXT = pytest.mark.parametrize("path", texts(), ids=lambda path: path.relative_to(ROOT).as_posix())
EACH_DOCUMENT = pytest.mark.parametrize("path", texts(".md"), ids=lambda path: path.relative_to(ROOT).as_posix())


@EACH_PACKAGE
def test_each_package_has_a_readme_that_names_its_files_and_no_others(folder):
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert {name for where, name in SOURCE.findall(text) if not where} == set(modules(folder))
    assert "## To add another" in text


@EACH_PACKAGE
def test_it_lists_each_file_once_in_reading_order(folder):
    text = (folder / "README.md").read_text(encoding="utf-8").partition("## Files in reading order")[2]
    assert sorted(re.findall(r"^- `([\w-]+\.py)`: \S", text, re.MULTILINE)) == modules(folder)


@EACH_TEXT
def test_every_document_that_is_named_is_in_the_project(path):
    """And every Python file that is named with its folder."""
    text = path.read_text(encoding="utf-8")
    named = {*DOCUMENT.findall(text), *(where + name for where, name in SOURCE.findall(text) if where)}
    assert [name for name in named if located(name, path.parent) is None] == []


@EACH_DOCUMENT
def test_links_between_documents_lead_somewhere(path):
    links = LINK.findall(CODE.sub("", path.read_text(encoding="utf-8")))
    assert [link for link in links if "://" not in link and not (path.parent / link).exists()] == []


@EACH_DOCUMENT
def test_what_a_document_says_is_in_a_file_is_there(path):
    """As "`LOADS` of tests/rods/test_variation.py"."""
    for name, file in LIST.findall(path.read_text(encoding="utf-8")):
        place = located(file, path.parent)
        assert place is not None
        assert re.search(rf"\b{name}\b", place.read_text(encoding="utf-8")), f"{name} of {file}"


def test_documents_are_shipped():
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]["targets"]
    assert {"/README.md", "/CONTRIBUTING.md", "/CHANGELOG.md", "/ibfil"} <= set(build["sdist"]["include"])
    assert build["wheel"]["packages"] == ["ibfil"]
    assert (PACKAGE / "py.typed").exists()
