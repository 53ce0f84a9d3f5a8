"""A run opened from Python for analysis: `ibfil.open`. All that io/reader.py reads, and flow, meshes, dataset."""

from __future__ import annotations

import threading
import warnings
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from ..io.datasets import ALONG_FRAME
from ..io.reader import RunFile

if TYPE_CHECKING:
    import pyvista
    import xarray

    from ..observables.observers import Summary
    from .flow import Flow


def open_run(path: str | Path) -> Run:
    """The run in the file ``path``, open for reading, without the pictures that `ibfil.open` gives; raises as that."""
    return Run(path)


class Run(RunFile):
    """A run file, open for reading: lazy arrays, the flow at any point, meshes. Made by `ibfil.open`.

    ``time`` (T,), ``filaments[NAME][KEY]`` (T, N, 3) or (T, N-1), ``observables[NAME]``, ``diagnostics[NAME]`` (T,) or
    (T, 3) are read where they are indexed; ``numbers[NAME]`` are what `ibfil show` prints of the observables. One that
    is fitted to a series, as a drift U, has that as ``observables["U.position"]``.

    ``case`` is the case it ran; ``status``, ``reason``, ``steps``, ``versions``
    ... tell of the run. Units are the case's: ``run.units("filaments/NAME/force")`` has their label.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path)
        self._flow: Flow | None = None
        self._turn = threading.Lock()  # of threads that ask for the flow, which is computed in arrays of its own

    def __repr__(self) -> str:
        from .summary import listed

        filaments = listed(
            [f"{name} ({columns['position'].shape[1]} nodes)" for name, columns in self.filaments.items()]
        )
        span = f"t = {self.time[0]:g} to {self.time[-1]:g}"
        return f"<Run {self.path}: {self.status}, {len(self)} outputs, {span}; {filaments}>"

    @property
    def summaries(self) -> dict[str, Summary]:
        """The number of each observable, as `Result.summaries`: of a drift the speed, of a growth the rate."""
        from ..observables.factory import numbers_of

        return numbers_of(self.case, self.time, self.observables)

    @property
    def numbers(self) -> dict[str, float | np.ndarray]:
        """Deprecated: the values of `summaries`."""
        warnings.warn("Run.numbers: write run.summaries[NAME].value", DeprecationWarning, stacklevel=2)
        return {name: one.value for name, one in self.summaries.items()}

    def output_at(self, time: float | None = None) -> int:
        """The number of the output nearest to ``time``; the last by default. Raises CaseError outside of the run."""
        if time is None:
            return len(self) - 1
        slack = 1e-9 * self.case.time.end
        if not self.time[0] - slack <= time <= self.time[-1] + slack:
            raise CaseError([f"{self.path}: time: found {time:g}; allowed: {self.time[0]:g} to {self.time[-1]:g}"])
        return int(np.argmin(np.abs(self.time - time)))

    def velocity_at(self, points: np.ndarray, time: float | None = None) -> np.ndarray:
        """The fluid's velocity (k, 3) at ``points`` (k, 3) at a time of the run, by default its last.

        Stokes: J L^-1 S F + u0 (Eq. 45) of the nodes' recorded forces, which is what a point carried along would feel,
        exact at the times of outputs; between two, positions and forces are interpolated linearly. Where the spin
        stirs the grid, and in Navier-Stokes, which have no such formula: the recorded ``velocity`` field, linear in
        space and time. All periodic in the box. Raises CaseError in resistive-force theory, which has no flow, without
        a recorded field where one is needed, and for times outside of what is recorded.

        >>> with ibfil.open("run.h5") as run:
        ...     u = run.velocity_at([[0.0, 0.5, 0.0], [0.0, 0.6, 0.0]], 0.001)
        >>> u.shape
        (2, 3)
        """
        wanted = np.atleast_2d(np.asarray(points, float))
        if wanted.ndim != 2 or wanted.shape[1] != 3 or not np.all(np.isfinite(wanted)):
            raise CaseError([f"{self.path}: points: found shape {np.shape(points)}; allowed: (k, 3), finite"])
        with self._turn:
            if self._flow is None:
                from .flow import flow_of

                self._flow = flow_of(self)
            return self._flow.velocity_at(wanted, float(self.time[-1]) if time is None else time)

    def mesh(self, time: float | None = None) -> pyvista.PolyData:
        """All filaments as polylines at the output nearest to ``time``, by default the last, with arrays at the nodes.

        velocity, force, moment, strain, e1, e2, e3 (N, 3), tension, tube_radius, arclength (N,), and the number of the
        filament. ``run.mesh().tube(scalars="tube_radius", absolute=True).plot()`` shows rods to scale.

        >>> with ibfil.open("run.h5") as run:
        ...     print(run.mesh(0.001).n_lines, run.mesh()["e3"].shape)
        1 (9, 3)
        """
        import pyvista

        from .meshes import filament_data

        return pyvista.wrap(filament_data(self, self.output_at(time)))

    def field(self, time: float | None = None) -> pyvista.ImageData:
        """The recorded fields nearest to ``time``, by default the last, with the Q-criterion where there is a velocity.

        Point (i, j, k) lies at origin + spacing (i, j, k). Raises CaseError where no fields were written.
        """
        import pyvista

        from .meshes import field_data

        if self.grid is None:
            raise CaseError([f"{self.path}: found no fields; set output.grid_every to have them"])
        times = np.asarray(self.grid.time)
        return pyvista.wrap(field_data(self, int(np.argmin(np.abs(times - (times[-1] if time is None else time))))))

    def to_xarray(self) -> xarray.Dataset:
        """All but the fields as one dataset, read whole: NAME_position (time, NAME_node, xyz) ..., links, observables.

        Nodes are found by arclength, ``sel(NAME_arclength=0.5, method="nearest")``. Moments and strains of filaments
        have components along the frame, ``sel(frame="e1")``. Each variable carries its units and description. Raises
        ImportError where xarray is not installed.
        """
        import xarray

        variables: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]] = {}
        coordinates = {"time": ("time", self.time, {"units": self.units("time")}), "xyz": ("xyz", list("xyz"))}
        coordinates["frame"] = ("frame", ["e1", "e2", "e3"])
        for name, columns in self.filaments.items():
            node, length = f"{name}_node", self.case.units.length
            s = self.arclength(name)
            coordinates[f"{name}_arclength"] = (node, s, {"units": length})
            for key, column in columns.items():
                along = () if key.startswith("reaction") else (f"{name}_segment" if key == "tension" else node,)
                parts = "frame" if key in ALONG_FRAME else "xyz"
                last = (parts,) if len(column.shape) > 1 + len(along) else ()
                variables[f"{name}_{key}"] = (("time", *along, *last), np.asarray(column), self._about(name, key))
        for name, columns in self.links.items():
            for key, column in columns.items():
                last = ("xyz",) if len(column.shape) > 2 else ()
                path = f"links/{name}/{key}"
                about = {"units": self.units(path), "description": self.description(path)}
                variables[f"{name}_{key}"] = (("time", f"{name}_element", *last), np.asarray(column), about)
        variables |= self._of_bodies()
        for group, found in (("observables", self.observables), ("diagnostics", self.diagnostics)):
            for name, column in found.items():
                dims = ("time", *(f"{name}_{i}" if n != 3 else "xyz" for i, n in enumerate(column.shape[1:])))
                about = {"units": self.units(f"{group}/{name}"), "description": self.description(f"{group}/{name}")}
                variables[name] = (dims, np.asarray(column), about)
        whole = xarray.Dataset(variables, coordinates, {"title": self.case.title, "case": self.case_text})
        for name in self.filaments:  # whole.sel(rod_arclength=0.5, method="nearest")
            whole = whole.set_xindex(f"{name}_arclength")
        return whole

    def _of_bodies(self) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
        """The variables of bodies and motors: NAME_position (time, xyz) ..., NAME_motor_rate (time) ..."""
        out = {}
        for group, before, found in (("bodies", "", self.bodies), ("motors", "motor_", self.motors)):
            for name, columns in found.items():
                for key, column in columns.items():
                    path, dims = f"{group}/{name}/{key}", ("time", "xyz")[: len(column.shape)]
                    if len(column.shape) > 2:
                        dims = ("time", f"{name}_marker", "xyz")
                    about = {"units": self.units(path), "description": self.description(path)}
                    out[f"{name}_{before}{key}"] = (dims, np.asarray(column), about)
        return out

    def _repr_html_(self) -> str:
        """All that `ibfil show` tells, in a notebook."""
        from .summary import as_text, digest

        return f"<pre>{escape(as_text(digest(self)))}</pre>"

    def _about(self, name: str, key: str) -> dict[str, str]:
        path = f"filaments/{name}/{key}"
        return {"units": self.units(path), "description": self.description(path)}
