"""The gallery of cases and the tutorials are true: what they say is in the cases, and their examples run."""

from __future__ import annotations

import doctest
import re
import shlex
from pathlib import Path

import pytest

import ibfil
from ibfil.case import library
from ibfil.commands import main as command_line
from postprocess import gallery

TUTORIALS = sorted(path for path in (gallery.ROOT / "postprocess" / "tutorials").glob("*.md") if path.stem != "README")


@pytest.mark.slow
def test_every_case_is_in_the_gallery():
    """Of one that is not: python -m postprocess.gallery NAME. Slow, as a new case need not wait for its picture."""
    assert sorted(gallery.entries(gallery.PAGE.read_text())) == sorted(library.paths())


def test_what_the_gallery_says_of_a_case_is_in_the_case():
    entries = gallery.entries(gallery.PAGE.read_text())
    assert set(entries) <= set(library.paths())
    for shipped in library.listing():
        if shipped.name not in entries:
            continue  # the test above tells it
        case, told = ibfil.read_case(shipped.name), entries[shipped.name]
        first = next(iter(case.expect))
        assert shipped.title in told
        assert shipped.source in told
        assert f"`{first}`: expected " in told
        assert "differs" not in told
        assert (gallery.PICTURES / f"{shipped.name}.png").stat().st_size < 40_000


def test_a_number_of_the_gallery_is_found_again(tmp_path, monkeypatch):
    monkeypatch.setattr(gallery, "PICTURES", tmp_path)
    shipped = next(one for one in library.listing() if one.name == "end_moment")
    there, here = gallery.entries(gallery.PAGE.read_text())["end_moment"], gallery.entry(shipped)
    assert there.rpartition(", in ")[0] == here.rpartition(", in ")[0]
    assert (tmp_path / "end_moment.png").exists()


LONG = {"bending_modulus", "swimmer_in_an_evening", "thermal_filaments", "which_drag_kernel_step"}
FILE = re.compile(r"^```\w+\n# ([\w-]+\.(?:toml|py|csv))\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ ibfil ((?:.*\\\n)*.*)$", re.MULTILINE)


def as_python(text: str) -> str:
    """A page for doctest: fences left out, and a command, ``$ ibfil ...``, as the call that prints what it prints."""
    text = re.sub(r"^```.*$", "", FILE.sub("", text), flags=re.MULTILINE)
    return COMMAND.sub(lambda found: f">>> command({_joined(found[1])!r})", text)


def _joined(line: str) -> str:
    return " ".join(line.replace("\\\n", " ").split())


def command(words: str) -> None:
    """The command line in this process; its status is printed where it is not 0."""
    status = command_line.main(shlex.split(words))
    if status:
        print(f"exit status {status}")


def test_the_commands_cases_and_examples_of_all_tutorials_can_be_read(tmp_path):
    """The quick form of those that are long."""
    for path in TUTORIALS:
        text = path.read_text(encoding="utf-8")
        for name, content in FILE.findall(text):
            assert not name.endswith(".toml") or ibfil.parse_case(content, name).filaments
        for found in COMMAND.finditer(text):
            assert command_line.parse(shlex.split(_joined(found[1]))).do
        for example in doctest.DocTestParser().get_examples(as_python(text)):
            compile(example.source, path.stem, "single")


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in LONG)) for path in TUTORIALS]
)
def test_the_examples_of_a_tutorial_run(path: Path, tmp_path, monkeypatch):
    """In a folder with the files that it shows, as a reader does; numbers are compared as they are shown."""
    monkeypatch.chdir(tmp_path)
    text = path.read_text(encoding="utf-8")
    for name, content in FILE.findall(text):
        (tmp_path / name).write_text(content)
    globs = {"command": command, "__name__": "__main__"}
    page = doctest.DocTestParser().get_doctest(as_python(text), globs, path.stem, str(path), 0)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.DocTestRunner(optionflags=flags).run(page)
    assert found.attempted > 0
    assert found.failed == 0
