"""ParaView files of a made run, read back by vtk's own readers through pyvista."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import pyvista
from helpers.made_run import CELLS, ORIGIN, SPACING, SPEED, flow, make_run
from helpers.runs import HERE, wait_for

from ibfil.analysis import meshes
from ibfil.errors import CaseError
from ibfil.grid.kernels import KERNELS
from ibfil.io.paths import checkpoint_path
from ibfil.io.reader import RunFile
from ibfil.visualization import vtk_files


@pytest.fixture(scope="module")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("vtk")
    return vtk_files.write_vtk(make_run(folder / "made.h5"), folder / "out")


def blocks(collection: Path, time: float):
    reader = pyvista.PVDReader(str(collection))
    reader.set_active_time_value(time)
    return reader.read()


def test_the_collection_has_the_real_times(collection):
    assert pyvista.PVDReader(str(collection)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_either_kind_alone_has_its_own_times(collection):
    filaments, grid = (collection.with_stem(f"made_{kind}") for kind in ("filaments", "grid"))
    assert pyvista.PVDReader(str(filaments)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert pyvista.PVDReader(str(grid)).time_values == [0.0, 0.5, 1.0]
    assert [type(block) for block in blocks(filaments, 0.75)] == [pyvista.PolyData]
    assert [type(block) for block in blocks(grid, 0.5)] == [pyvista.ImageData]


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
    e2, e3 = meshes.directors(r, e1, s)
    tangent = np.column_stack([-np.sin(s), np.cos(s), 0.5 + 0 * s]) / np.sqrt(1.25)
    np.testing.assert_allclose(e3, tangent, atol=5e-3)  # second order: (ds^2)/3 at the ends
    snapshot = np.stack([e1, e2, e3], axis=1)
    np.testing.assert_allclose(snapshot @ snapshot.transpose(0, 2, 1), np.tile(np.eye(3), (60, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(snapshot), 1.0)


def test_a_run_that_went_on_extends_the_collection(tmp_path):
    run, folder = tmp_path / "made.h5", tmp_path / "out"
    vtk_files.write_vtk(make_run(run, until=0.5, status="interrupted"), folder)
    before = {path.name: (path.stat().st_ino, path.read_bytes()) for path in folder.iterdir()}
    collection = vtk_files.write_vtk(make_run(run, until=1.0), folder)
    after = {path.name: (path.stat().st_ino, path.read_bytes()) for path in folder.iterdir()}
    assert pyvista.PVDReader(str(collection)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]
    new = set(after) - set(before)
    assert new == {"made_filaments_000003.vtp", "made_filaments_000004.vtp", "made_grid_000002.vti"}
    same = [name for name in before if before[name] == after[name]]
    written = {"made.pvd", "made_filaments.pvd", "made_grid.pvd", "made_paraview.py"}
    assert set(before) - set(same) == written  # the inode tells: the others were not replaced


def test_a_file_of_another_run_is_replaced(tmp_path):
    folder = tmp_path / "out"
    collection = vtk_files.write_vtk(make_run(tmp_path / "made.h5"), folder)
    stale = folder / "made_grid_000001.vti"
    good = stale.read_bytes()
    stale.write_bytes(good[:-40] + bytes(40))
    vtk_files.write_vtk(tmp_path / "made.h5", folder)
    assert stale.read_bytes() == good
    assert not list(folder.glob("*.part"))
    assert collection.parent == folder


def test_the_raw_form_is_what_is_fast(collection):
    text = (collection.parent / "made_grid_000001.vti").read_bytes()
    head = text[: text.index(b">", text.index(b"<VTKFile"))]
    assert b'header_type="UInt64"' in head
    assert b"compressor" not in head
    assert b'<AppendedData encoding="raw">' in text


def test_wrapped_filaments_lie_in_the_box_with_their_values(tmp_path):
    """The long one reaches from x = 0 to 2 in a box that ends at 1.5."""
    data = blocks(vtk_files.write_vtk(make_run(tmp_path / "made.h5"), tmp_path / "out", wrap=True), 0.25)[0]
    assert data.n_lines == 3
    assert data.points[:, 0].max() <= 1.5
    s, x = data["arclength"], data.points[:, 0]
    assert np.all(np.isclose(x, s) | np.isclose(x, s - 3.0))
    np.testing.assert_allclose(np.sort(x[np.isclose(s, 1.5)]), [-1.5, 1.5])  # a point on each side of the cut
    np.testing.assert_allclose(data["force"][:, 0], 2 * s, rtol=1e-6)  # as on the unwrapped line


def test_periodic_images(tmp_path):
    data = blocks(vtk_files.write_vtk(make_run(tmp_path / "made.h5"), tmp_path / "out", images=1), 0.25)[0]
    assert data.n_lines == 2 * 27
    plain = np.all(data["image"] == 0, axis=1)
    assert plain.sum() == 16
    first = data.points[plain]
    for shift in ([1, 0, 0], [0, -1, 1]):
        there = np.all(data["image"] == shift, axis=1)
        np.testing.assert_allclose(data.points[there], first + np.array(shift) * [3.0, 2.0, 1.0], atol=1e-12)


def test_without_a_box_images_are_refused(tmp_path):
    from helpers.fake_simulation import case
    from helpers.runs import run

    run(case("", "time.end=0.1"), tmp_path / "rft.h5")
    for more in ({"wrap": True}, {"images": 1}):
        with pytest.raises(CaseError, match="a run in a periodic box, which rft and free space have not"):
            vtk_files.write_vtk(tmp_path / "rft.h5", **more)


STANDING = """
filament.rod = {{ length = 1.0, nodes = 9, bending = 1.0, stretching = 100, position = [0.2, 0, 0.6] }}
fluid = {{ model = "stokes", viscosity = 1.0, box = "free", spacing = 0.1{wall} }}
time = {{ end = 0.02, step = 0.01 }}
output = {{ every = 0.01 }}
"""


@pytest.mark.parametrize("wall", ["", ', wall = "no-slip"'], ids=["free", "wall"])
def test_a_wall_is_a_plane_below_the_rods_and_stands_in_the_scene(tmp_path, wall):
    """At z = 0, a length wider than their way on each side, and read by the ready scene; or there is neither."""
    import ibfil

    (tmp_path / "case.toml").write_text(STANDING.format(wall=wall))
    ibfil.run(tmp_path / "case.toml", tmp_path / "made.h5", progress=False, log=lambda line: None)
    pvd = vtk_files.write_vtk(tmp_path / "made.h5")
    file, scene = pvd.with_name("made_wall.vtp"), pvd.with_name("made_paraview.py").read_text()
    assert file.exists() == ("made_wall.vtp" in scene) == bool(wall)
    compile(scene, "scene.py", "exec")
    if wall:
        with RunFile(tmp_path / "made.h5") as run:
            way = np.asarray(run.filaments["rod"]["position"]).reshape(-1, 3)
        low, high = way.min(axis=0), way.max(axis=0)
        expected = [low[0] - 1, high[0] + 1, low[1] - 1, high[1] + 1, 0.0, 0.0]
        assert pyvista.read(file).bounds == pytest.approx(expected, abs=1e-3)


def test_q_is_positive_in_a_vortex_and_negative_in_strain():
    """Solid rotation w about z: Q = w^2; pure strain a: Q = -a^2; simple shear: 0. All linear, so exact to rounding."""
    x, y, z = np.meshgrid(*(np.linspace(0, 1, n) for n in (5, 6, 7)), indexing="ij")
    spacing = np.array([1 / 4, 1 / 5, 1 / 6])
    for u, q in (((-2 * y, 2 * x, 0 * z), 4.0), ((3 * x, -3 * y, 0 * z), -9.0), ((5 * y, 0 * x, 0 * z), 0.0)):
        velocity = np.stack(u, axis=-1)
        np.testing.assert_allclose(meshes.q_criterion(velocity, spacing), q, atol=1e-12)
        np.testing.assert_allclose(meshes.q_criterion(velocity[:, :, 3:4], spacing), q, atol=1e-12)  # a plane flow
        np.testing.assert_allclose(meshes.q_criterion(velocity[:2, :, :2], spacing), q, atol=1e-12)


def test_q_is_in_the_collection(collection):
    grid = blocks(collection, 1.0)[1]
    # flow = (x + 10 y + 100 z, x y + t, z - 7 t x): G has rows (1, 10, 100), (y, x, 0), (-7, 0, 1).
    x, y = grid.points[:, 0], grid.points[:, 1]
    trace = 2 + x
    square = 1 + 10 * y - 700 + (10 * y + x**2) + (-700 + 1)
    np.testing.assert_allclose(grid["q_criterion"], 0.5 * (trace**2 - square), rtol=1e-4, atol=1e-3)


def test_outputs_that_were_cut_back_are_replaced(tmp_path):
    """Gone on with from a checkpoint, at other times: those after it are forgotten, and none is there twice."""
    collection = vtk_files.Collection(make_run(tmp_path / "made.h5"), tmp_path / "out")
    collection.update()
    collection.filaments[3:] = [(0.8, "old"), (0.9, "old"), (1.0, "old")]
    collection.update()
    assert [time for time, _ in collection.filaments] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert pyvista.PVDReader(str(collection.path)).time_values == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_watching_follows_a_run_to_its_end(tmp_path):
    """The run waits with its next outputs for the collection to be there, and twice for its last ones to be told of."""
    code = """
import sys; sys.path[:0] = sys.argv[2:]
from pathlib import Path
from helpers.fake_simulation import *
from ibfil.io import writer as recorder
from ibfil.running import loop, run as running
loop._LOOK = recorder._PAUSE = recorder._SHARE = 0
class Paced(FakeSimulation):
    def advance(self, until, after_step):
        super().advance(until, after_step)
        while not Path("out/run.pvd").exists():
            clock.sleep(0.01)
        if until in (0.4, 0.8):
            sys.stdin.readline()
running.run(case(), sys.argv[1], build=Paced, look=look, progress=False, log=id)
"""
    path, said = tmp_path / "run.h5", []
    command = [sys.executable, "-c", code, path, HERE, HERE.parent]
    writer = subprocess.Popen(command, stdin=subprocess.PIPE, bufsize=0, cwd=tmp_path)

    def told(line: str) -> None:
        said.append(line)
        with suppress(BrokenPipeError):  # it has ended
            writer.stdin.write(b"\n")

    try:
        wait_for(checkpoint_path(path).exists, writer)
        collection = vtk_files.write_vtk(path, tmp_path / "out", watch=0.05, log=told)
    finally:
        writer.kill()
        writer.communicate()
    with RunFile(path) as run:
        assert run.status == "finished"
        assert pyvista.PVDReader(str(collection)).time_values == run.time.tolist()
    assert len(said) > 2


def pvpython() -> list[str]:
    """The command that runs a script in ParaView without a display."""
    found = shutil.which("pvpython")
    if not found:
        pytest.skip("pvpython is not installed: ParaView itself has not read these files")
    if not shutil.which("xvfb-run"):
        pytest.skip("xvfb-run is not installed: pvpython cannot save pictures here")
    # -a alone lets two that start at once take one display.
    return ["xvfb-run", "-a", "-n", str(100 + os.getpid() % 30000), found]


def test_paraview_itself_reads_tubes_and_traces(collection, tmp_path):
    """The real client: times, values at t = 0.75, Tube, Stream Tracer, a picture."""
    script = tmp_path / "look.py"
    script.write_text(
        f"""
from paraview.simple import *
run = PVDReader(FileName={str(collection)!r})
run.UpdatePipelineInformation()
print("times", *run.TimestepValues)
run.UpdatePipeline(0.75)
rods = ExtractBlock(Input=run, Selectors=["/Root/Block0"])
rods.UpdatePipeline(0.75)
print("y", rods.GetDataInformation().GetBounds()[2:4])
alone = PVDReader(FileName={str(collection.with_stem("made_filaments"))!r})
tubes = Tube(Input=alone)  # of the collection with a grid this crashes ParaView 5.11
tubes.Scalars, tubes.VaryRadius = ["POINTS", "tube_radius"], "By Absolute Scalar"
tubes.UpdatePipeline(0.75)
print("z", tubes.GetDataInformation().GetBounds()[4:6])
flow = ExtractBlock(Input=run, Selectors=["/Root/Block1"])
flow.UpdatePipeline(0.75)
lines = StreamTracer(Input=flow, SeedType="Point Cloud")
lines.Vectors = ["POINTS", "velocity"]
lines.SeedType.Center, lines.SeedType.Radius = [0.0, 0.0, 0.0], 0.3
lines.UpdatePipeline(0.75)
print("lines", lines.GetDataInformation().GetNumberOfPoints())
view = GetActiveViewOrCreate("RenderView")
Show(tubes, view), Show(lines, view)
SaveScreenshot({str(tmp_path / "look.png")!r}, view)
"""
    )
    done = subprocess.run([*pvpython(), script], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    told = dict(line.split(" ", 1) for line in done.stdout.splitlines() if " " in line)
    assert told["times"] == "0.0 0.25 0.5 0.75 1.0", done.stderr
    assert eval(told["y"]) == (2.25, 2.25)  # SPEED * 0.75
    low, high = eval(told["z"])  # the first lies at z = 0, 0.1 to 0.12 thick; the second at 1, as thick as the grid
    assert low == pytest.approx(-0.12, abs=0.01)
    assert high == pytest.approx(1 + KERNELS["peskin4"].line_radius * SPACING, abs=0.02)
    assert int(told["lines"]) > 100
    assert (tmp_path / "look.png").stat().st_size > 5000


def test_the_ready_scene_opens_in_paraview(collection, tmp_path):
    scene = collection.with_name("made_paraview.py")
    picture = tmp_path / "scene.png"
    done = subprocess.run([*pvpython(), scene, picture], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "rror" not in done.stderr
    pixels = pyvista.read(picture)["PNGImage"].reshape(960, 1280, -1)[..., :3]
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 200  # tubes, a slice, letters, and no blank page
