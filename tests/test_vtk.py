"""ParaView files of a made run, read back by vtk's own readers through pyvista."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import pyvista
from made_run import CELLS, ORIGIN, SPACING, SPEED, flow, make_run

from ibfil import vtk, vtk_data
from ibfil.kernels import KERNELS


@pytest.fixture(scope="module")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("vtk")
    return vtk.write_vtk(make_run(folder / "made.h5"), folder / "out")


def blocks(collection: Path, time: float):
    reader = pyvista.PVDReader(str(collection))
    reader.set_active_time_value(time)
    return reader.read()


def test_the_collection_has_the_real_times(collection):
    assert pyvista.PVDReader(str(collection)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("time", [0.0, 0.5, 1.0])
def test_a_field_has_its_values_at_its_points(collection, time):
    grid = blocks(collection, time)[1]
    x, y, z = grid.points.T
    assert grid.dimensions == CELLS
    np.testing.assert_allclose([x.min(), y.min(), z.min()], ORIGIN)
    np.testing.assert_allclose([x.max(), y.max(), z.max()], ORIGIN + SPACING * (np.array(CELLS) - 1))
    np.testing.assert_allclose(grid["velocity"], flow(x, y, z, time), rtol=1e-6, atol=1e-6)
    assert grid["velocity"].dtype == np.float32


def test_between_two_fields_the_last_one_is_shown_with_its_own_time(collection):
    filaments, grid = blocks(collection, 0.75)
    assert filaments.field_data["TimeValue"] == 0.75
    assert grid.field_data["TimeValue"] == 0.5
    x, y, z = grid.points.T
    np.testing.assert_allclose(grid["velocity"], flow(x, y, z, 0.5), rtol=1e-6, atol=1e-6)


def test_filaments_are_polylines_with_their_nodes_in_order(collection):
    data = blocks(collection, 0.75)[0]
    assert data.n_lines == 2
    first, second = (data.get_cell(i).points for i in range(2))
    np.testing.assert_array_equal(first[:, 0], np.linspace(0, 2, 9))
    np.testing.assert_array_equal(second[:, 0], np.linspace(0, 1, 7))
    assert np.all(data.points[:, 1] == SPEED * 0.75)
    np.testing.assert_array_equal(data["filament"], [0] * 9 + [1] * 7)


def test_arrays_at_the_nodes(collection):
    data = blocks(collection, 0.75)[0]
    r = data.points
    for name, factor in (("force", 2), ("moment", 3), ("strain", 4)):
        np.testing.assert_allclose(data[name], factor * r, rtol=1e-6)
    np.testing.assert_allclose(data["velocity"], np.tile([0, SPEED, 0], (16, 1)))
    # Along x with e1 = z: e3 = x, e2 = e3 x e1 = -y.
    np.testing.assert_allclose(data["e1"], np.tile([0, 0, 1], (16, 1)), atol=1e-7)
    np.testing.assert_allclose(data["e2"], np.tile([0, -1, 0], (16, 1)), atol=1e-7)
    np.testing.assert_allclose(data["e3"], np.tile([1, 0, 0], (16, 1)), atol=1e-7)
    # Segments carry 1.75, 2.75, ...: a node the mean of its two, an end its only one.
    np.testing.assert_allclose(data["tension"][:9], [1.75, *np.arange(2.25, 9), 8.75])
    # "0.1 + 0.01*s" on the first; the second has no material radius and is as thick as the grid makes a line.
    line = KERNELS["peskin4"].line_radius * SPACING
    np.testing.assert_allclose(data["tube_radius"], [*(0.1 + 0.01 * r[:9, 0]), *np.full(7, line)], rtol=1e-6)


def test_names_have_nothing_that_paraview_chokes_on(collection):
    for block in blocks(collection, 0.5):
        assert all(re.fullmatch(r"[A-Za-z0-9_]+", name) for name in block.array_names)


def test_directors_are_orthonormal_on_a_helix():
    s = np.linspace(0, 4, 60)
    r = np.column_stack([np.cos(s), np.sin(s), 0.5 * s])
    e1 = np.column_stack([-np.cos(s), -np.sin(s), 0 * s])  # the normal
    e2, e3 = vtk_data.directors(r, e1, s)
    tangent = np.column_stack([-np.sin(s), np.cos(s), 0.5 + 0 * s]) / np.sqrt(1.25)
    np.testing.assert_allclose(e3, tangent, atol=5e-3)  # second order: (ds^2)/3 at the ends
    frame = np.stack([e1, e2, e3], axis=1)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.tile(np.eye(3), (60, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0)


def test_a_run_that_went_on_extends_the_collection(tmp_path):
    run, folder = tmp_path / "made.h5", tmp_path / "out"
    vtk.write_vtk(make_run(run, until=0.5, status="interrupted"), folder)
    before = {path.name: (path.stat().st_ino, path.read_bytes()) for path in folder.iterdir()}
    collection = vtk.write_vtk(make_run(run, until=1.0), folder)
    after = {path.name: (path.stat().st_ino, path.read_bytes()) for path in folder.iterdir()}
    assert pyvista.PVDReader(str(collection)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]
    new = set(after) - set(before)
    assert new == {"made_filaments_000003.vtp", "made_filaments_000004.vtp", "made_grid_000002.vti"}
    same = [name for name in before if before[name] == after[name]]
    assert set(before) - set(same) == {"made.pvd", "made_paraview.py"}  # the inode tells: the others were not replaced


def test_a_file_of_another_run_is_replaced(tmp_path):
    folder = tmp_path / "out"
    collection = vtk.write_vtk(make_run(tmp_path / "made.h5"), folder)
    stale = folder / "made_grid_000001.vti"
    good = stale.read_bytes()
    stale.write_bytes(good[:-40] + bytes(40))
    vtk.write_vtk(tmp_path / "made.h5", folder)
    assert stale.read_bytes() == good
    assert not list(folder.glob("*.part"))
    assert collection.parent == folder


def test_the_raw_form_is_what_is_fast(collection):
    text = (collection.parent / "made_grid_000001.vti").read_bytes()
    head = text[: text.index(b">", text.index(b"<VTKFile"))]
    assert b'header_type="UInt64"' in head
    assert b"compressor" not in head
    assert b'<AppendedData encoding="raw">' in text
