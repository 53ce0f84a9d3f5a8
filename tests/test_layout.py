"""Who imports whom: what architecture.md asks of the modules, and what must not be loaded when it is not needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from made_run import BENT

import ibfil

ROOT = Path(__file__).parent.parent
MODULES = {path.stem: path for path in (ROOT / "ibfil").glob("*.py")}


def with_prefix(prefix: str) -> set[str]:
    """Modules whose names begin so: a group that stands together in the listing."""
    return {name for name in MODULES if name.startswith(prefix)}


CASE = {"expressions", *with_prefix("case")}
FLUIDS = {"rft", "stokes", "navier_stokes", "immersed_boundary", "grid", "kernels", "transforms", "pruned", "slab"}
FLUIDS |= {*with_prefix("mobility"), "condensation", "torque_coupling", "krylov", "past", "advection"}
RODS = {"mesh", "geometry", "directors", "elasticity", "laws", "ends", "loads", "mechanics", "torque_free", "variation"}
RESULTS = {"record", "recorder", "checkpoint", "journal", "observe", *with_prefix("observables"), "expectations"}
PICTURES = {"analysis", *with_prefix("vtk"), *with_prefix("render")}
LOOKING = {*with_prefix("show"), *PICTURES, "verify", "check", "bench", "cli"}
ASSEMBLY = {*with_prefix("assemble"), "simulation"}
DRAWING = {"matplotlib", "pyvista", "vtk", "vtkmodules"}


def imports(name: str, at_load: bool = False) -> set[str]:
    """What a module of ibfil imports: names of its sisters, and top names of others; ``at_load``: when it is loaded."""
    found = set()
    nodes = [ast.parse(MODULES[name].read_text())]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            top, *rest = (node.module or "").split(".")
            found |= {rest[0]} if top == "ibfil" and rest else {top}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module} if node.module else {alias.name for alias in node.names}
        typing = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if not typing and not (at_load and isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))):
            nodes += ast.iter_child_nodes(node)
    return found


def test_every_module_this_file_speaks_of_is_there():
    assert CASE | FLUIDS | RODS | RESULTS | (LOOKING - {"bench"}) | {"stepping", "fluid"} <= set(MODULES)


def test_the_map_in_the_package_names_every_module_once():
    """The docstring of ibfil lists its modules by subject: one that is new has to find its place there."""
    table = ibfil.__doc__.split("means one subject:")[1].split("Equations are numbered")[0]
    lines = [line for line in table.splitlines() if line.strip()]
    named = " ".join(line[18:] for line in lines).split()
    assert sorted(named) == sorted(set(MODULES) - {"__init__", "__main__"})


def test_a_stepper_knows_no_fluid_and_a_fluid_no_stepper():
    """Both know fluid.py, the contract, and nothing of each other (numerics.md, section 3)."""
    assert "fluid" in imports("stepping")
    assert not imports("stepping") & (FLUIDS | ASSEMBLY)
    for name in FLUIDS | {"fluid"}:
        assert not imports(name) & (ASSEMBLY | {"stepping", "running", "loop", "timescales"}), name


def test_the_mechanics_know_no_fluid_and_no_stepper():
    for name in RODS & set(MODULES):
        assert not imports(name) & (FLUIDS | ASSEMBLY | {"stepping"}), name


def test_physics_and_schemes_know_no_case():
    """Only what is between them and the case file does: assemble and its sisters."""
    for name in FLUIDS | RODS | {"fluid", "stepping", "marching", "thermal", *with_prefix("contact")}:
        assert not imports(name) & (CASE | ASSEMBLY), name


def test_the_numerics_know_no_files_and_no_screen():
    for name in FLUIDS | RODS | ASSEMBLY | {"stepping", "fluid", "timescales"}:
        assert not imports(name) & (RESULTS | LOOKING | DRAWING | {"running", "loop", "h5py", "tqdm"}), name


def test_a_case_is_data_and_knows_nothing_that_runs_it():
    heavy = {"numba", "scipy", "h5py", "pyfftw", *DRAWING}
    for name in CASE:
        assert not imports(name) & (FLUIDS | RODS | RESULTS | LOOKING | {"simulation", "running", *heavy}), name
        assert "numpy" not in imports(name, at_load=True), name


def test_only_what_draws_loads_what_draws_and_only_when_it_does():
    for name in MODULES:
        assert not imports(name, at_load=True) & (DRAWING - {"vtk"}), name
        if "figure" not in name and name not in PICTURES:
            assert not imports(name) & (DRAWING - {"vtk"}), name


def test_running_knows_the_screen_only_through_print():
    for name in ("running", "loop", "record", "recorder", "observe"):
        assert not imports(name) & LOOKING, name


COMMANDS = {"sweep", *with_prefix("compare"), *with_prefix("trade"), *with_prefix("stability")}
STUDIES = {*with_prefix("study"), *COMMANDS, "cli_studies"}


def test_a_run_knows_nothing_of_studies_and_a_worker_loads_little():
    """What a process of a study loads first is the standard library: it has yet to set its number of threads."""
    for name in set(MODULES) - STUDIES - LOOKING - {"__init__"}:
        assert not imports(name) & STUDIES, name
    for name in ("study_members", "study_workers", "threads", "errors", "cli_studies"):
        outside = imports(name, at_load=True) - set(MODULES)
        assert outside <= set(sys.stdlib_module_names), name


@pytest.mark.parametrize(
    ("model", "unused"),
    [
        ('model = "rft"', {"pyfftw"}),
        ('model = "stokes"\nbox = [2.0, 2.0, 2.0]\ncells = [16, 16, 16]', set()),
    ],
)
def test_a_run_loads_nothing_that_draws_and_no_fft_where_there_is_no_grid(tmp_path, model, unused):
    (tmp_path / "rod.toml").write_text(BENT.replace('model = "rft"', model))
    code = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from ibfil.cli import main
assert main(["run", "rod.toml"]) == 0
print("loaded:", *sorted({{name.split(".")[0] for name in sys.modules}}))
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    loaded = set(done.stdout.split("loaded:")[1].split())
    assert {"ibfil", "numpy", "numba", "h5py"} <= loaded
    assert not loaded & (DRAWING | {"tqdm"} | unused)


def test_the_names_promised_to_python_are_there():
    """Each is found in a process of its own, where nothing is loaded yet."""
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); import ibfil\n"
        "assert not {'numpy', 'pydantic', 'h5py'} & set(sys.modules)\n"
        "print(*(getattr(ibfil, name) is not None for name in ibfil.__all__))\n"
        "assert callable(ibfil.run) and ibfil.run.__module__ == 'ibfil.running'\n"
        "try: ibfil.nonsense\n"
        "except AttributeError: pass\n"
        "else: raise SystemExit(1)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "False" not in done.stdout
