"""The gallery of cases and the tutorials are true: what they say is in the cases, and their examples run."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

import ibfil
from ibfil.case import library
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


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_the_examples_of_a_tutorial_run(path: Path):
    found = doctest.testfile(str(path), module_relative=False, encoding="utf-8")
    assert found.attempted > 0
    assert found.failed == 0
