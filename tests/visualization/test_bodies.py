"""Bodies in ParaView files and pictures: surfaces and outlines where the body is, turned as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.runs import BODIES, FLUIDS, real, rod, run

from ibfil.analysis import body_meshes
from ibfil.analysis.body_meshes import BEYOND, body_surfaces, extents
from ibfil.analysis.meshes import View
from ibfil.analysis.run import open_run
from ibfil.io.reader import RunFile
from ibfil.visualization import render
from ibfil.visualization.bodies import LEGEND, outline
from ibfil.visualization.moments import Look
from ibfil.visualization.pictures import Pictures, Wish
from ibfil.visualization.run_figure import figure
from ibfil.visualization.vtk_files import write_vtk
from ibfil.visualization.vtkhdf import write_vtkhdf
from ibfil.visualization.web.constants import RING
from ibfil.visualization.web.page import _strokes, write_page

SIZE = np.array([0.2, 0.15, 0.1])


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("bodies") / "run.h5"
    given = rod(*FLUIDS["rft"], "filament.rod.start={end='body', body='head', motor={spin=20}}", more=BODIES)
    run(given(), file, build=real)
    return file


def test_a_surface_is_that_of_the_body_and_its_axes_go_beyond_it(path):
    import pyvista

    with RunFile(path) as file:
        snapshot = file.snapshot(-1)
        found = pyvista.wrap(body_surfaces(file, snapshot))
        ends = extents(file)
    body = snapshot.bodies["head"]
    axes = np.stack([body.e1, body.e2, body.e3])
    of = found["body"] == list(snapshot.bodies).index("head")
    away = (found.points - body.position) @ axes.T
    on = np.linalg.norm(away / SIZE, axis=1)
    np.testing.assert_allclose(on[of & (found["axis"] == 0)], 1.0, atol=1e-6)
    for k in range(3):
        tip = away[of & (found["axis"] == k + 1)][1]
        np.testing.assert_allclose(tip, BEYOND * SIZE * np.eye(3)[k], atol=1e-6)
    rigid = body.velocity + np.cross(body.spin, found.points - body.position)
    np.testing.assert_allclose(found["velocity"][of], rigid[of], atol=1e-5)
    assert np.linalg.norm(body.spin) > 0.01
    np.testing.assert_allclose(ends[0][-1, 0], body.position + 0.2 * body.e1, atol=1e-12)


def test_vtkhdf_has_the_surfaces_and_axes_of_every_time(path, tmp_path):
    import pyvista
    from vtkmodules.vtkIOHDF import vtkHDFReader

    (file,) = (made for made in write_vtkhdf(path, tmp_path) if made.stem == "run_bodies")
    reader = vtkHDFReader()
    reader.SetFileName(str(file))
    with RunFile(path) as run:
        for number in range(len(run.time)):
            reader.UpdateInformation()
            reader.SetStep(number)
            reader.UpdateTimeStep(run.time[number])
            found = pyvista.wrap(reader.GetOutputDataObject(0))
            known = pyvista.wrap(body_surfaces(run, run.snapshot(number)))
            np.testing.assert_array_equal(found.points, known.points)
            np.testing.assert_array_equal(found.faces, known.faces)
            np.testing.assert_array_equal(found.lines, known.lines)
            for name in ("velocity", "body", "axis"):
                np.testing.assert_array_equal(found[name], known[name])


def test_a_page_has_rings_on_the_body_and_says_what_they_are(path, tmp_path):
    assert '"linewords": "rings: bodies"' in write_page(path, tmp_path / "run.html", log=str).read_text()
    with open_run(path) as run:
        rings = _strokes(run, np.array([len(run) - 1]))[0]
        body = run.snapshot(-1).bodies["head"]
    of = np.array([np.abs((end - body.position) @ np.stack([body.e1, body.e2, body.e3]).T / SIZE) for end in rings])
    on = np.abs(np.linalg.norm(of, axis=2) - 1).max(axis=1) < 1e-9
    assert np.count_nonzero(on) == 3 * RING
    assert np.count_nonzero(of[on].min(axis=2) < 1e-9) == 2 * 3 * RING  # each in a plane of two axes


def test_an_outline_is_the_shadow_of_the_surface(path):
    """No point of the surface is outside of it, and some are on it."""
    import pyvista

    with RunFile(path) as file:
        snapshot = file.snapshot(-1)
        found = pyvista.wrap(body_surfaces(file, snapshot))
    body = snapshot.bodies["head"]
    arms = (SIZE[:, None] * np.stack([body.e1, body.e2, body.e3]))[:, [0, 2]]
    inverse = np.linalg.inv(arms.T @ arms)
    ring = outline(arms)
    np.testing.assert_allclose(np.einsum("ki,ij,kj->k", ring, inverse, ring), 1.0, atol=1e-9)
    of = (found["body"] == list(snapshot.bodies).index("head")) & (found["axis"] == 0)
    seen = (found.points[of] - body.position)[:, [0, 2]]
    inside = np.einsum("ki,ij,kj->k", seen, inverse, seen)
    assert 0.98 < inside.max() < 1.0 + 1e-5


def test_in_a_box_a_body_is_shown_whole_where_its_centre_is_and_in_each_image(path, monkeypatch):
    import pyvista

    box = np.array([0.5, 0.4, 3.0])
    monkeypatch.setattr(body_meshes, "box_of", lambda run: box)
    with RunFile(path) as file:
        snapshot = file.snapshot(-1)
        far = replace(snapshot.bodies["head"], position=np.array([1.3, -0.7, 0.1]))
        snapshot = replace(snapshot, bodies=snapshot.bodies | {"head": far})
        plain, wrapped, images = (
            pyvista.wrap(body_surfaces(file, snapshot, view)) for view in (View(), View(True), View(True, 1))
        )
    of = plain["body"] == list(snapshot.bodies).index("head")
    apart = (plain.points - wrapped.points)[of]
    np.testing.assert_allclose(apart, np.tile([1.5, -0.8, 0.0], (of.sum(), 1)), atol=1e-6)
    np.testing.assert_array_equal(plain.faces, wrapped.faces)
    assert images.n_points == 27 * plain.n_points
    assert images.n_cells == 27 * plain.n_cells
    np.testing.assert_allclose(images.points, np.tile(wrapped.points, (27, 1)) + images["image"] * box, atol=1e-5)


@pytest.mark.parametrize("co_moving", [False, True])
def test_outlines_of_a_figure_stay_with_their_rods(path, co_moving):
    """The rod begins in the head, whose centre is as far from there as it is in the run."""
    with RunFile(path) as file:
        shapes = figure(file, Look(shapes=3, co_moving=co_moving)).axes[0]
        plane = ["xyz".index(label[0]) for label in (shapes.get_xlabel(), shapes.get_ylabel())]
        wanted = (file.bodies["head"]["position"][-1] - file.filaments["rod"]["position"][-1, 0])[plane]
        names = [*file.filaments, *file.bodies]
    drawn = {name: lines.get_segments()[-1] for name, lines in zip(names, shapes.collections, strict=False)}
    np.testing.assert_allclose(drawn["head"][:-1].mean(axis=0) - drawn["rod"][0], wanted, atol=1e-9)


def test_paraview_files_have_the_bodies_of_every_output(path, tmp_path):
    write_vtk(path, tmp_path)
    with RunFile(path) as file:
        count = len(file)
    assert len(list(tmp_path.glob("run_bodies_*.vtp"))) == count
    assert (tmp_path / "run_bodies.pvd").exists()
    assert "Block1" in (tmp_path / "run_paraview.py").read_text()


@pytest.mark.skipif(not render.can_render(), reason=f"no off-screen rendering here ({render.PACKAGES})")
def test_a_picture_of_many_shapes_says_that_it_has_no_bodies(path):
    with open_run(path) as run:
        for wish, told in ((Wish(montage=3), "without bodies"), (Wish(), LEGEND)):
            pictures = Pictures(run, wish, [0])
            if wish.montage:
                pictures.montage()
            pictures.close()
            assert [note for note in (LEGEND, "without bodies") if note in pictures.words.note] == [told]
