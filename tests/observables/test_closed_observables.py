"""What is observed of a closed filament, told of it by check, and refused of others."""

from __future__ import annotations

import pytest

from ibfil.case.reading import parse_case
from ibfil.check.report import report
from ibfil.errors import CaseError
from ibfil.observables.factory import observers
from ibfil.rods.linking import linking
from ibfil.running.run import run

RING = """
[filament.ring]
length = 1.0
nodes = 31
bending = 1.0
twisting = "1 + s"
radius = 0.01
stretching = 1e4
closed = true
linking = 2
shape = { kind = "circle", curvature = "2*pi" }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1e-3
step = 5e-4
[output]
every = 5e-4
[observe.lk]
kind = "linking"
[observe.wr]
kind = "writhe"
[observe.tw]
kind = "total_twist"
"""


def test_observables_are_the_numbers_of_the_snapshots(tmp_path):
    done = run(parse_case(RING, "ring.toml"), tmp_path / "ring.h5", progress=False, log=lambda line: None)
    ring = done.snapshot.filaments["ring"]
    found = linking(ring.position, ring.e1)
    assert done.series("lk")[-1] == found.linking == 2
    assert done.series("wr")[-1] == pytest.approx(found.writhe, abs=1e-12)
    assert done.series("tw")[-1] == pytest.approx(found.twist, abs=1e-12)


def test_they_are_refused_of_open_filaments():
    bad = RING.replace("closed = true\nlinking = 2\n", "")
    with pytest.raises(
        CaseError, match=r'observe\.lk\.filament: found "ring"; allowed: one that is closed, and twists'
    ):
        observers(parse_case(bad, "ring.toml"))


def test_check_tells_of_closed_filaments_of_what_does_not_close_and_of_strands():
    text = report(parse_case(RING, "ring.toml"))
    assert "closed, linking number 2" in text
    assert "filament.ring.twisting: 1 at s = 0 and 2 at s = length, which are one node" in text
    assert 'contact.action = "repel" keeps them apart' in text
