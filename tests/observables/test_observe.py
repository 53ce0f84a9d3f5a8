"""Summaries, what a kind does not have, expectations."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.motions import CASE, observing, seen, tip_at, value

from ibfil.case.reading import parse_case
from ibfil.errors import CaseError
from ibfil.io.units import label
from ibfil.observables.base import KINDS
from ibfil.observables.expectations import check
from ibfil.observables.observers import Summary

# --- summaries -------------------------------------------------------------------------------------------------------


def test_summaries_over_a_window():
    def motion(t):
        return tip_at(np.where(t < 4, t, 8 - t), 0, 0)

    times = np.concatenate([np.arange(0, 4, 0.5), np.arange(4, 9.0)])  # twice as many outputs on the way up

    def summary(word, over):
        keys = f'kind = "position"\nat = "finish"\nalong = [1, 0, 0]\nsummary = "{word}"\nover = {over}'
        return value(keys, motion, times)

    assert summary("last", "[1, 7]") == pytest.approx(1.0)
    assert summary("max", "[1, 7]") == pytest.approx(4.0)
    assert summary("min", "[1, 6]") == pytest.approx(1.0)
    assert summary("median", "[0, 1]") == pytest.approx(0.5)
    # The mean is over time, not over outputs, and the window may begin and end between two.
    assert summary("mean", "[0, 8]") == pytest.approx(2.0)
    assert summary("mean", "[0.25, 1.25]") == pytest.approx(0.75)
    assert summary("mean", "[4.5, 7.5]") == pytest.approx(2.0)


def test_summaries_of_vectors_are_of_each_component():
    def motion(t):
        return tip_at(t, -t, t**2)

    for word, expected in {"max": (2, 0, 4), "min": (0, -2, 0), "median": (1, -1, 1), "mean": (1, -1, 1.5)}.items():
        found = value(f'kind = "position"\nat = "finish"\nsummary = "{word}"', motion, [0.0, 1.0, 2.0])
        assert found == pytest.approx(np.array(expected), abs=1e-12)


def test_a_window_that_the_run_did_not_finish_is_noted():
    keys = 'kind = "position"\nat = "finish"\nalong = [1, 0, 0]\nover = [2, 8]'
    _, summary = seen(keys, lambda t: tip_at(t, 0, 0), [0.0, 1.0, 2.0, 3.0])
    assert summary == Summary(3.0, "seen until 3, within `over` = [2, 8]")
    _, summary = seen(keys, lambda t: tip_at(t, 0, 0), [0.0, 1.0])
    assert np.isnan(summary.value)
    assert "until 1," in summary.note


def test_times_that_differ_by_rounding_are_in_the_window():
    keys = 'kind = "position"\nat = "finish"\nalong = [1, 0, 0]\nsummary = "max"\nover = [0, "3*0.1"]'
    assert value(keys, lambda t: tip_at(t, 0, 0), [0.0, 0.3, 0.6]) == 0.3  # 3*0.1 is more than 0.3


def test_descriptions_and_units():
    _, looking = observing('kind = "frequency"\nat = "middle"\nalong = [0, 1, 0]')
    observable = looking.observables["o"]
    assert observable.description == ('position seen from the start of rod, at = "middle", along = [0, 1, 0]')
    units = parse_case(CASE, "case.toml").units
    assert label(units, observable.dimension) == "um"
    assert label(units, observable.summary_dimension) == "rad/s"
    assert label(units, "force length/time") == "pN um/s"
    assert label(units, "1/time") == "1/s"
    assert label(units, "force/length/length") == "pN/um/um"
    plain = parse_case(CASE.split("[filament.rod]")[1].join(["[filament.rod]", ""]), "case.toml").units
    assert label(plain, "force length/time") == "1"
    assert label(plain, "rad/time") == "rad"


def test_every_kind_of_the_schema_is_built():
    from typing import get_args

    from ibfil.case.observe import Observe

    observing('kind = "position"')
    assert set(KINDS) == set(get_args(Observe.model_fields["kind"].annotation))


# --- what a kind does not have ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('kind = "end_to_end"\nat = "start"', r'observe\.o\.at: found "start"; allowed: nothing; end_to_end has over'),
        ('kind = "speed"\nalong = [1, 0, 0]', r"observe\.o\.along: found \[1, 0, 0\]; allowed: nothing"),
        ('kind = "drift"\nsummary = "max"', r"observe\.o\.summary"),
        ('kind = "twist"\nat = "centroid"', r'observe\.o\.at: found "centroid"; allowed: start, finish, middle'),
        ('kind = "speed"\nat = [0, 1]', r'observe\.o\.space: found "none"; allowed: "mean", "max" or "min"'),
        ('kind = "position"\nat = [0, 1]\nspace = "max"', r'observe\.o\.space: found "max"; .* with `along`'),
        ('kind = "drift"\nat = [0, 1]\nspace = "max"\nalong = [1, 0, 0]', r'observe\.o\.space: found "max"'),
        ('kind = "radius"\nat = [0, 1]', r'observe\.o\.space: found "none"'),
        ('kind = "power"\nat = "middle"', r"observe\.o\.at: .*a window"),
        ('kind = "force"\nat = "finish"', r"observe\.o\.at: .*a free end has no support"),
        ('kind = "stretch"\nat = [0.12, 0.2]\nspace = "max"', r"observe\.o\.at: .*middle of a segment"),
        ('kind = "diffusion_ratio"\ninterval = 0.15', r"observe\.o\.interval: .*multiple of output\.every = 0\.1"),
    ],
)
def test_what_a_kind_does_not_have_is_refused(keys, words):
    with pytest.raises(CaseError, match=words) as caught:
        observing(keys)
    assert len(caught.value.faults) == 1


def test_all_faults_are_told_at_once():
    more = '[observe.p]\nkind = "twist"\nat = "centroid"\n'
    with pytest.raises(CaseError) as caught:
        observing('kind = "speed"\nat = [0, 1]', more)
    assert len(caught.value.faults) == 2


def test_defaults_may_be_written_out():
    observing('kind = "end_to_end"\nat = "finish"\nspace = "none"\nsummary = "last"')


def test_a_stop_rule_needs_a_number_at_each_output():
    rule = '[[stop]]\nobserve = "o"\nbelow = 1.0\n'
    with pytest.raises(CaseError, match=r"stop\.0\.observe: found o, known at the end only"):
        observing('kind = "growth"', rule)
    with pytest.raises(CaseError, match=r"stop\.0\.observe"):
        observing('kind = "frequency"', rule)


# --- expectations ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expect", "found", "passed", "error"),
    [
        ("value = 2.0", 2.019, True, 0.0095),
        ("value = 2.0", 2.021, False, 0.0105),
        ("value = -2.0\ntolerance = 0.1", -2.19, True, 0.095),
        ("value = -2.0\ntolerance = 0.1", 2.0, False, 2.0),
        ("value = 2.0\nabsolute = 0.5", 1.51, True, 0.49),
        ("value = 0.0\nabsolute = 0.5", -0.51, False, 0.51),
        ("range = [1, 2]", 1.0, True, 0.0),
        ("range = [1, 2]", 2.5, False, 0.5),
        ("range = [1, 2]", 0.25, False, 0.75),
        ("value = 2.0", float("nan"), False, float("nan")),
        ("range = [1, 2]", float("nan"), False, float("nan")),
        ("value = 2.0", float("inf"), False, float("nan")),
    ],
)
def test_expectations(expect, found, passed, error):
    more = f'[expect.e]\nobserve = "o"\nsource = "by hand"\n{expect}\n'
    given, _ = observing('kind = "end_to_end"', more)
    (held,) = check(given, {"o": Summary(found)})
    assert (held.name, held.observe, held.passed, held.source) == ("e", "o", passed, "by hand")
    assert held.error == pytest.approx(error, nan_ok=True)
    assert held.line().startswith("ok  " if passed else "FAIL")
    assert "by hand" in held.line()


def test_a_part_of_a_window_is_not_what_was_expected():
    given, _ = observing('kind = "end_to_end"', '[expect.e]\nobserve = "o"\nvalue = 2.0\n')
    (held,) = check(given, {"o": Summary(2.0, "the run ended early")})
    assert not held.passed
    assert "the run ended early" in held.line()
    (held,) = check(given, {"o": Summary(np.ones(3))})
    assert not held.passed
    assert "a vector" in held.note
