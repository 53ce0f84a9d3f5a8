"""Tracked data as users have them: tables of points, their units, what is refused; rigid motions taken out."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.errors import CaseError
from ibfil.studies.fit.data import observed, read
from ibfil.studies.fit.residuals import motion

LONG = "t,s,x,y\n0,0,0,0\n0,2,2,0\n1,0,0,1\n1,1,1,1\n1,2,2,1\n"
SAME = {
    "commas": LONG,
    "a column more, a comment, the rows mixed": "# by hand\ns,t,X,Y,what\n2,1,2,1,a\n2,0,2,0,b\n"
    "0,0,0,0,c\n0,1,0,1,d\n1,1,1,1,e\n",
    "blanks": LONG.replace(",", "  "),
    "decimal commas": LONG.replace(",", ";").replace("\n1;1;1;1", "\n1,0;1;1;1"),
    "units": "t (ms);s_nm;x [um];y_nm\n0;0;0;0\n0;2000;2;0\n1000;0;0;1000\n1000;1000;1;1000\n1000;2000;2;1000\n",
    "points that are not there": LONG + "1,1.5,NaN,1\n1,1.7,,1\n1,-0.5,-0.5,1\n",
}
WIDE = "t,x0,x1,x2,y0,y1,y2\n0,0,,2,0,0,0\n1,0,1,2,1,1,1\n"
SIDEWAYS = "\n".join(",".join(column) for column in zip(*(row.split(",") for row in WIDE.split()), strict=True))


def data(tmp_path, text, lengths=None, units=("um", "s"), scale=None, rate=None, named=()):
    path = tmp_path / "tracked.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read(path, lengths or {"rod": 2.0}, units, scale=scale, rate=rate, named=named)


@pytest.mark.parametrize("text", [*SAME.values(), WIDE, SIDEWAYS], ids=[*SAME, "a row a frame", "a column a frame"])
def test_tables_that_say_the_same_are_read_the_same(tmp_path, text):
    found = data(tmp_path, text)
    assert found.axes == (0, 1)
    assert found.times == [0.0, 1.0]
    first, second = found.frames
    order = np.argsort(second.s)
    np.testing.assert_allclose(np.sort(first.s), [0, 2], atol=1e-12)
    np.testing.assert_allclose(second.s[order], [0, 1, 2], atol=1e-12)
    np.testing.assert_allclose(second.points[order], [[0, 1], [1, 1], [2, 1]], atol=1e-12)
    assert any("3 of 8 points" in note for note in found.notes) == ("NaN" in text)


@pytest.mark.parametrize("own", ["LABEL,POSITION_T,S,POSITION_X,POSITION_Y\n", ""], ids=["others", "none"])
def test_headings_may_be_given_in_place_of_those_of_a_file(tmp_path, own):
    """As trackers write them, or without any; UTF-16 as spreadsheets save it."""
    rows = [f"7,{1000 * t},{s},{s},{y}" for t, s, y in ((0, 0, 0), (0, 2, 0), (1, 0, 1), (1, 1, 1), (1, 2, 1))]
    text = (own + "\n".join(rows) + "\n").encode("utf-16")
    found = data(tmp_path, text, named=["", "t_ms", "s", "x", "y"])
    assert found.times == [0.0, 1.0]
    np.testing.assert_allclose(found.frames[1].points, [[0, 1], [1, 1], [2, 1]], atol=1e-12)
    with pytest.raises(CaseError, match="--headings frame,x_um,y_um"):
        data(tmp_path, text)
    with pytest.raises(CaseError, match="row 2: found 5 cells; allowed: 3"):
        data(tmp_path, text, named=["t", "x", "y"])


def test_pixels_frames_order_and_filaments(tmp_path):
    text = "frame,node,x,z,filament,weight\n4,2,10,0,b,1\n4,1,5,0,b,2\n"
    text += "4,0,0,0,b,1\n2,0,0,0,a,1\n2,1,0,4,a,0\n2,2,0,9,a,1\n"
    found = data(tmp_path, text, {"a": 1.0, "b": 3.0}, scale=0.5, rate=4.0)
    assert found.axes == (0, 2)
    a, b = found.frames
    assert (a.time, a.filament, b.time, b.filament) == (0.5, "a", 1.0, "b")
    np.testing.assert_allclose(a.points, [[0, 0], [0, 4.5]])
    np.testing.assert_allclose(b.s, [0, 1.5, 3])
    np.testing.assert_allclose(b.weight, [1, 2, 1])
    assert any("arclength is measured" in note for note in found.notes)


def test_tangent_angles_are_integrated(tmp_path):
    s = np.linspace(0, 2, 201)
    rows = "\n".join(f"0,{a!r},{np.degrees(a)!r}" for a in s.tolist())
    found = data(tmp_path, f"t,s,psi_deg\n{rows}\n".replace("np.float64(", "").replace(")", ""))
    exact = np.stack([np.sin(s), 1 - np.cos(s)], axis=1)
    assert found.free
    np.testing.assert_allclose(found.frames[0].points, exact, atol=1.2e-5)  # trapezoids: ds^2/12 times 2 at most 1.7e-5


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "found the headings of nothing"),
        ("0,1,2\n1,2,3\n", "found the headings 0, 1, 2"),
        ("t,x\n0,1\n", "found the headings t, x"),
        ("t,x,y\n", "found no rows"),
        ("t,x,y\n0,1\n", "row 2: found 2 cells; allowed: 3"),
        ("t,x,y\n0,one,2\n", "row 2: found 'one'"),
        ("t,x,y,x\n0,1,2,3\n", "found the headings x and x"),
        ("t,s,x,y\n0,3,1,2\n", "found s = 3; allowed: up to the length 2"),
        ("t,s,x,y\n0,1,1,2\n0,1,1,3\n", "found one s twice"),
        ("t,x,y\n0,1,2\n", "found one point and no s"),
        ("t,x,y\n0,1,2\n0,1,2\n", "all the same"),
        ("t,x,y\n0,nan,2\n", "found no point"),
        ("t,x_px,y_px\n0,1,2\n0,2,2\n", "found x in px, and the case states um.*--scale"),
        ("frame,x,y\n0,1,2\n0,2,2\n", "found frame numbers; allowed: with --rate"),
        ("t,x0,y0,x1\n0,1,2,2\n", "found no y1"),
        ("t,x,y,filament\n0,1,2,tail\n", "found the filament 'tail'; allowed: rod"),
        (b"\x89HDF\r\n\x1a\n\x00\x00", "found a binary file"),
        (b"t,x,y\n0,\xff\xfe,1\n", "found a binary file"),
    ],
)
def test_what_is_no_data_is_one_line(tmp_path, text, line):
    with pytest.raises(CaseError, match=line) as caught:
        data(tmp_path, text)
    assert len(caught.value.faults) == 1


def test_a_unit_needs_one_in_the_case_and_files_have_a_size(tmp_path, monkeypatch):
    with pytest.raises(CaseError, match=r"no unit of length.*units\.length"):
        data(tmp_path, "t,x_um,y_um\n0,1,2\n0,2,2\n", units=("1", "1"))
    monkeypatch.setattr("ibfil.studies.fit.data.MOST", 10)
    with pytest.raises(CaseError, match="MiB; allowed"):
        data(tmp_path, LONG)
    with pytest.raises(CaseError, match="cannot be read"):
        read(tmp_path / "none.csv", {"rod": 1.0}, ("1", "1"), scale=None, rate=None)


def test_measured_numbers_are_read():
    assert observed(["speed=-0.5+-1e-2", "tip_x = 3 ± 0.5"]) == {"speed": (-0.5, 0.01), "tip_x": (3.0, 0.5)}
    for wrong in ("speed=1", "speed=1+-0", "speed=1+--2", "=1+-1", "speed=nan+-1"):
        with pytest.raises(CaseError, match="NAME=VALUE"):
            observed([wrong])


@pytest.mark.parametrize("d", [2, 3])
def test_a_rigid_motion_is_found_and_a_mirror_is_none(d):
    rng = np.random.default_rng(3)
    points, weight = rng.normal(size=(9, d)), rng.uniform(0.5, 2, 9)
    turn = np.linalg.qr(rng.normal(size=(d, d)))[0]
    turn *= np.linalg.det(turn) if d == 3 else 1.0
    turn[:, -1] *= np.linalg.det(turn)
    found, shift = motion(points @ turn + 7.0, points, weight)
    np.testing.assert_allclose(points @ found + shift, points @ turn + 7.0, atol=1e-12)
    mirror = np.diag([*([1.0] * (d - 1)), -1.0])
    assert np.linalg.det(motion(points @ mirror, points, weight)[0]) == pytest.approx(1.0)
