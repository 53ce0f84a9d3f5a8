"""Start shapes from files of points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.shape_scene import KEY, SPATIAL, X, Y, Z, fault, helix, rod

from ibfil.case.spacing import node_arclength
from ibfil.shapes.initial import end_tangents, initial_shape, stretch_warning


def points(count: int, power: float = 1.0) -> np.ndarray:
    """Points of a helix of curvature 3, torsion 1 and length 1, unevenly placed unless ``power`` is 1."""
    return helix(np.linspace(0.0, 1.0, count) ** power, 3.0, 1.0) + np.array([5.0, 6.0, 7.0])


SAME = {"align": "tangent", "anchor": "start", **SPATIAL}


def from_file(path: Path, **keys: Any) -> tuple[np.ndarray, np.ndarray]:
    return initial_shape(rod(shape={"kind": "file", "path": path.name}, **(SAME | keys)), KEY, path.parent)


def test_as_many_points_as_nodes_are_the_nodes(tmp_path: Path) -> None:
    table = points(41, power=1.2)
    np.save(tmp_path / "a.npy", table)
    r, _ = from_file(tmp_path / "a.npy", align="chord")
    for step in (1, 13, 40):
        distance = np.linalg.norm(table[step:] - table[:-step], axis=1)
        np.testing.assert_allclose(np.linalg.norm(r[step:] - r[:-step], axis=1), distance, atol=1e-14)


@pytest.mark.parametrize("heading", ["", "x, y, z\n", "# a remark\n\n X,Y,Z \n"])
def test_other_numbers_of_points_are_set_anew_along_the_curve(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "a.csv"
    body = "\n".join(",".join(map(repr, row)) for row in points(200, power=1.3).tolist())
    path.write_text(heading + body)
    errors = []
    exact, _ = initial_shape(rod(shape={"kind": "helix", "curvature": 3.0, "torsion": 1.0}, align="chord", **SPATIAL))
    r, _ = from_file(path, align="chord")
    for step in (1, 13, 40):
        distance = np.linalg.norm(exact[step:] - exact[:-step], axis=1)
        errors.append(np.max(np.abs(np.linalg.norm(r[step:] - r[:-step], axis=1) - distance)))
    # The error of a cubic spline, at most 5/384 h^4 |r|, with h up to 1.3/199 and |r| = k (k^2 + t^2) = 30.
    assert max(errors) < 2 * 5 / 384 * (1.3 / 199) ** 4 * 30


def test_points_of_another_length_stretch_the_rod_evenly(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.outer([0.0, 0.1, 0.7, 0.9, 1.5], [0.0, 1.0, 0.0]))
    filament = rod(
        shape={"kind": "file", "path": "a.npy"},
        position=[1.0, 1.0, 1.0],
        direction=[0, 0, 1],
        normal=[0, 1, 0],
    )
    r, e1 = initial_shape(filament, KEY, tmp_path)
    np.testing.assert_allclose(r, np.outer(np.linspace(-0.75, 0.75, 41), Z) + 1.0, atol=1e-13)
    np.testing.assert_allclose(e1, np.tile(Y, (41, 1)), atol=1e-15)
    assert "by 50 % to 50 %" in stretch_warning(node_arclength(filament), r)[0]


def test_nodes_are_evenly_set_between_few_and_uneven_points(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", [[0, 0, 0], [1, 0, 0], [1.2, 0.6, 0], [3, 1, 0], [4, 0, 0.5], [4, -0.2, 1.0]])
    r, _ = from_file(tmp_path / "a.npy", nodes=4001)
    gap = np.linalg.norm(np.diff(r, axis=0), axis=1)
    # A chord is shorter than its arc by at most (bend ds)^2/24: the sharpest bend here is of radius 0.27.
    assert np.ptp(gap) / np.max(gap) < (np.max(gap) / 0.26) ** 2 / 24.0


def test_end_tangents_of_a_stretched_file_add_the_perturbation(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.outer(np.arange(5.0), X))
    shape = {"kind": "file", "path": "a.npy", "perturb": [0, 0, "s"]}
    start, finish = end_tangents(rod(length=2.0, shape=shape), KEY, tmp_path)  # dr/ds = (2, 0, 1)
    np.testing.assert_allclose(start, np.array([2, 0, 1]) / 5**0.5, atol=1e-9)
    np.testing.assert_allclose(finish, start, atol=1e-9)


def invariants(r: np.ndarray, e1: np.ndarray) -> np.ndarray:
    """Numbers that no rigid motion changes, but any change of shape or frame does."""
    return np.concatenate((e1 @ e1.T, np.sum(e1[:, None] * (r[:, None] - r), axis=-1)))


@pytest.mark.parametrize("count", [41, 321])
def test_directors_of_the_file_are_kept(tmp_path: Path, count: int) -> None:
    shape = {"kind": "helix", "curvature": 3.0, "torsion": 1.0, "twist": "5*s"}
    table = np.hstack(initial_shape(rod(nodes=count, shape=shape, **SAME)))
    np.save(tmp_path / "a.npy", table * [2.0, 2.0, 2.0, 7.0, 7.0, 7.0])
    r, e1 = from_file(tmp_path / "a.npy", length=2.0, direction=[0, 1, 0], normal=[1, 0, 1])
    exact, exact_e1 = initial_shape(rod(shape=shape, **SAME))
    # e1 is made normal to the spline: its slope is off by h^3 |r''''|/24 < 3e-5, a few times that at ends.
    np.testing.assert_allclose(invariants(r / 2.0, e1), invariants(exact, exact_e1), atol=2e-4)
    np.testing.assert_allclose(e1[0], np.array([1, 0, 1]) / 2**0.5, atol=1e-15)


def test_files_that_are_no_points_are_refused_in_one_line(tmp_path: Path) -> None:
    def refused(name: str, content: str | bytes | np.ndarray | None) -> str:
        path = tmp_path / name
        if isinstance(content, np.ndarray):
            np.save(path, content)
        elif content is not None:
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        line = fault(rod(shape={"kind": "file", "path": name}), tmp_path)
        start = f"filament.rod.shape.path: {name}: "
        assert line.startswith(start)
        return line.removeprefix(start)

    assert refused("none.csv", None) == "cannot be read (No such file or directory)"
    assert refused("a.txt", "0,0,0") == "must end in .csv or .npy"
    assert refused("a.csv", "0,0,0\n1,0,zero\n").startswith("line 2 is not numbers divided by commas: '1,0,zero'")
    assert refused("a.csv", "y,x,z\n0,0,0\n").startswith("line 1 is not numbers")
    for heading in ("x_um,y_um,z_um", "x (um),y (um),z (um)", "X [nm],Y [nm],Z [nm]"):
        line = refused("a.csv", f"{heading}\n0,0,0\n")
        assert line.startswith("line 1 names a unit, and none is converted")
        assert "write x,y,z, with the numbers in the case's unit of length" in line
    assert refused("a.csv", "0,0,0\n1,0\n") == "line 2 has 2 columns where the first row has 3"
    assert refused("a.csv", "0,0\n1,0\n").startswith("holds 2 x 2 numbers; each row must be x, y, z")
    assert refused("a.csv", "").startswith("holds 0 x 0 numbers")
    assert refused("a.csv", "0,0,0\n1,0,0\n").startswith("holds 2 points; at least 4")
    assert refused("a.csv", "0,0,0\n1,0,0\n1,0,0\n2,0,0\n") == "points 2 and 3 are the same"
    assert refused("a.csv", "0,0,0\n1,0,0\nnan,0,0\n2,0,0\n") == "point 3 is not finite"
    assert refused("a.csv", b"\xff\xfe0,0,0") == "is not a text file"
    assert refused("a.npy", b"no array").startswith("is not an array of numbers")
    assert refused("a.npy", np.array([{}, {}])).startswith("is not an array of numbers")
    assert refused("a.npy", np.array([["x"]])) == "is not an array of numbers"
    assert refused("a.npy", np.zeros((2, 5, 3))).startswith("holds 2 x 5 x 3 numbers")
    along = np.hstack((np.outer(np.arange(5.0), X), np.tile(X, (5, 1))))
    assert refused("a.npy", along) == "e1 vanishes or lies along the curve"
