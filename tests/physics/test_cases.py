"""Every shipped case does what it says: its expected numbers, in the quick form here and in full where marked slow."""

from __future__ import annotations

import pytest

from ibfil.case import library
from ibfil.case.reading import differences, quick_case, read_case
from ibfil.studies.verify import verify

CASES = {name: read_case(path) for name, path in library.paths().items()}


def _quicker(name: str) -> bool:
    """Whether a number of the case has a quick form of its own."""
    case = CASES[name]
    return any(differences(quick_case(case, expect), case) for expect in case.expect)


@pytest.mark.parametrize("name", CASES)
def test_a_shipped_case_has_a_title_a_source_and_a_number_with_one(name):
    case = CASES[name]
    assert case.title
    assert case.source
    assert case.expect
    assert all(expect.source for expect in case.expect.values())


@pytest.mark.parametrize("name", CASES)
def test_the_quick_form_of_a_shipped_case_meets_its_numbers(name):
    told: list[str] = []
    assert verify([name], quick=True, log=told.append) == 0, "\n".join(told)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if _quicker(name)])
def test_the_full_form_of_a_shipped_case_meets_its_numbers(name):
    told: list[str] = []
    assert verify([name], quick=False, log=told.append) == 0, "\n".join(told)
