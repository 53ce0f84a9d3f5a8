"""VTKHDF files of runs, read back by vtk's own reader: the arrays of the .vtp and .vti files, to the last bit."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista
from helpers.linked_scenes import ASKEW, LINKS, linked
from helpers.made_run import make_run
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

import ibfil
from ibfil.analysis import meshes
from ibfil.commands.main import main
from ibfil.errors import CaseError
from ibfil.io.reader import RunFile
from ibfil.visualization import vtkhdf, vtkhdf_layout
from ibfil.visualization.vtk_files import write_vtk
from ibfil.visualization.vtkhdf import write_vtkhdf


class Read:
    """A file by vtk's reader: its times, and what it has at one."""

    def __init__(self, path: Path) -> None:
        self.reader = vtkHDFReader()
        self.reader.SetFileName(str(path))
        self.reader.UpdateInformation()
        information = self.reader.GetOutputInformation(0)
        self.times = list(information.Get(self.reader.GetExecutive().TIME_STEPS()))

    def at(self, number: int):
        self.reader.SetStep(number)
        self.reader.UpdateTimeStep(self.times[number])
        return self.reader.GetOutputDataObject(0)


def same(found, expected) -> None:
    """Points, lines and arrays at the points are the same bits."""
    np.testing.assert_array_equal(pyvista.wrap(found).points, pyvista.wrap(expected).points)
    if hasattr(expected, "GetLines"):
        for name in ("GetOffsetsArray", "GetConnectivityArray"):
            lines = (vtk_to_numpy(getattr(data.GetLines(), name)()) for data in (found, expected))
            np.testing.assert_array_equal(*lines)
        assert found.GetNumberOfCells() == expected.GetNumberOfLines()
    names = [expected.GetPointData().GetArrayName(i) for i in range(expected.GetPointData().GetNumberOfArrays())]
    assert names
    for name in names:
        a, b = (vtk_to_numpy(data.GetPointData().GetArray(name)) for data in (found, expected))
        assert (a.dtype, a.shape) == (b.dtype, b.shape)
        assert a.tobytes() == b.tobytes()


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return make_run(tmp_path_factory.mktemp("made") / "made.h5")


@pytest.mark.parametrize("view", [meshes.PLAIN, meshes.View(wrap=True), meshes.View(wrap=True, images=1)])
def test_filaments_are_those_of_the_run_at_every_time(run, tmp_path, view):
    paths = write_vtkhdf(run, tmp_path, wrap=view.wrap, images=view.images)
    assert [path.name for path in paths] == ["made_filaments.vtkhdf", "made_grid.vtkhdf"]
    read = Read(paths[0])
    with RunFile(run) as opened:
        assert read.times == opened.time.tolist()
        for number in (0, 3, 1, 4, 2):  # in any order
            same(read.at(number), meshes.filament_data(opened, number, view))


def test_filaments_are_written_some_times_at_once_and_only_every_nth(run, tmp_path, monkeypatch):
    monkeypatch.setattr(vtkhdf, "TOGETHER", 40)  # two times of 16 nodes
    monkeypatch.setattr(vtkhdf_layout, "BLOCK", 3000)
    read = Read(write_vtkhdf(run, tmp_path, every=2)[0])
    with RunFile(run) as opened:
        assert read.times == opened.time[::2].tolist()
        for number in range(3):
            same(read.at(number), meshes.filament_data(opened, 2 * number))


def test_lines_may_change_from_time_to_time(tmp_path):
    """As those of filaments that are cut at other faces: more and fewer points, more lines, the same again."""
    random, made = np.random.default_rng(1), []
    for time, lengths in enumerate(([3, 4], [3, 4], [2, 5, 3], [3, 4], [6])):
        points = random.normal(size=(sum(lengths), 3))
        arrays = [{"a": np.float32(random.normal(size=n)), "b": random.normal(size=(n, 3))} for n in lengths]
        made.append((0.5 * time, meshes._poly_data(points, lengths, arrays, 0.5 * time)))
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        vtkhdf._write_meshes(file, iter(made))
    read = Read(tmp_path / "a.vtkhdf")
    assert read.times == [0.0, 0.5, 1.0, 1.5, 2.0]
    for number in (0, 3, 1, 4, 2):
        same(read.at(number), made[number][1])


def test_fields_are_those_of_the_run(run, tmp_path):
    read = Read(write_vtkhdf(run, tmp_path)[1])
    with RunFile(run) as opened:
        assert read.times == np.asarray(opened.grid.time).tolist()
        for number in (2, 0, 1):
            found, expected = read.at(number), meshes.field_data(opened, number)
            assert found.GetDimensions() == expected.GetDimensions()
            assert (found.GetOrigin(), found.GetSpacing()) == (expected.GetOrigin(), expected.GetSpacing())
            same(found, expected)


def test_links_have_a_file_of_their_own(tmp_path):
    text = linked(ASKEW, {"spring": LINKS["spring"], "pair": LINKS["motors"]}, end=0.04, every=0.02).text
    ibfil.run(ibfil.parse_case(text, "linked"), tmp_path / "pair.h5")
    paths = write_vtkhdf(tmp_path / "pair.h5")
    assert [path.name for path in paths] == ["pair_filaments.vtkhdf", "pair_links.vtkhdf"]
    read = Read(paths[1])
    with RunFile(tmp_path / "pair.h5") as opened:
        for number in range(len(read.times)):
            same(read.at(number), meshes.link_lines(opened.snapshot(number)))


def test_lines_that_stay_the_same_are_kept_once(run, tmp_path):
    with h5py.File(write_vtkhdf(run, tmp_path)[0]) as file:
        assert len(file["VTKHDF/Lines/Connectivity"]) == 9 + 7
        assert file["VTKHDF/Points"].shape == (5 * (9 + 7), 3)


def test_every_second_output(run, tmp_path):
    assert Read(write_vtkhdf(run, tmp_path / "hdf", every=2)[0]).times == [0.0, 0.5, 1.0]
    collection = write_vtk(run, tmp_path / "xml", every=2)
    alone = pyvista.PVDReader(str(collection.with_stem("made_filaments")))
    assert alone.time_values == [0.0, 0.5, 1.0]
    with RunFile(run) as opened:
        alone.set_active_time_value(0.5)
        np.testing.assert_array_equal(alone.read()[0].points, pyvista.wrap(meshes.filament_data(opened, 2)).points)


def test_the_command_writes_over_its_own_and_over_nothing_else(run, tmp_path, capsys):
    words = ["vtk", str(run), "-o", str(tmp_path / "out"), "--hdf"]
    assert main(words) == main(words) == 0
    assert "made_filaments.vtkhdf in ParaView" in capsys.readouterr().out
    other = tmp_path / "out" / "made_grid.vtkhdf"
    other.write_text("mine")
    assert main(words) == 2
    assert other.read_text() == "mine"
    assert main([*words, "--watch"]) == 2
    assert "--watch: found with --hdf" in capsys.readouterr().err


def test_without_a_box_nothing_is_wrapped(tmp_path):
    ibfil.run(ibfil.read_case("swimmer_rft", ["time.end=0.01"]), tmp_path / "rft.h5")
    with pytest.raises(CaseError, match="--wrap or --images; allowed: a run in a periodic box"):
        write_vtkhdf(tmp_path / "rft.h5", wrap=True)
