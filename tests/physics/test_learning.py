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


def commands_as_python(text: str) -> str:
    """A page for doctest: fences left out, and a command, ``$ ibfil ...``, as the call that prints what it prints."""
    text = re.sub(r"^```.*$", "", text, flags=re.MULTILINE)
    return re.sub(
        r"^\$ ibfil (.*(?:\\\n.*)*)$", lambda found: f">>> command({_joined(found[1])!r})", text, flags=re.MULTILINE
    )


def _joined(line: str) -> str:
    return " ".join(line.replace("\\\n", " ").split())


def command(words: str) -> None:
    """The command line in this process; its status is printed where it is not 0."""
    status = command_line.main(shlex.split(words))
    if status:
        print(f"exit status {status}")


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_the_examples_of_a_tutorial_run(path: Path, tmp_path, monkeypatch):
    """In an empty folder, as a reader does; numbers are compared as they are shown."""
    monkeypatch.chdir(tmp_path)
    globs = {"command": command, "__name__": "__main__"}
    page = doctest.DocTestParser().get_doctest(commands_as_python(path.read_text()), globs, path.stem, str(path), 0)
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.DocTestRunner(optionflags=flags).run(page)
    assert found.attempted > 0
    assert found.failed == 0
