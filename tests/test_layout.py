"""The layout of the package: which way imports run, how large folders and files are, and what is loaded when.

The rules are in CONTRIBUTING.md. All imports count: at load, in functions, and for types.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from helpers.made_run import BENT

import ibfil

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "ibfil"
# From the ground up: what stands later may import what stands before it, never the other way round.
ORDER = (
    *("version", "errors", "cache", "screen", "threads"),
    *("linalg", "grid", "rods", "bodies", "fluids", "parallel", "timestepping"),
    *("case", "io", "observables", "shapes", "assembly", "simulation", "check", "running"),
    *("analysis", "visualization", "bench", "studies", "commands"),
)
METHOD = ("linalg", "grid", "rods", "bodies", "fluids", "parallel", "timestepping")
FILES_A_FOLDER, LINES_A_FILE, LINES_A_FUNCTION = 20, 300, 50
DRAWING = {"matplotlib", "pyvista", "vtk", "vtkmodules"}


@cache
def modules() -> dict[str, Path]:
    """Every module by its dotted name below ibfil, packages by their own; not ibfil itself, nor __main__."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        if name and name != "__main__":
            found[name] = path
    return found


@cache
def parsed(name: str) -> ast.Module:
    return ast.parse(modules()[name].read_text())


def _absolute(name: str, node: ast.ImportFrom) -> str:
    """The module that an import names, from the top: ibfil.rods.mesh, numpy."""
    if not node.level:
        return node.module or ""
    folder = ["ibfil", *name.split(".")]
    folder = folder if modules()[name].name == "__init__.py" else folder[:-1]
    return ".".join([*folder[: len(folder) - node.level + 1], *([node.module] if node.module else [])])


@cache
def imports(name: str, at_load: bool = False) -> frozenset[str]:
    """What a module imports: sisters by their names below ibfil, others by their first; ``at_load``: when loaded."""
    found, nodes = set(), [parsed(name)]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            where = _absolute(name, node)
            if where.split(".")[0] != "ibfil":
                found.add(where.split(".")[0])
            for alias in node.names if where.split(".")[0] == "ibfil" else ():
                inner = f"{where}.{alias.name}".removeprefix("ibfil.")
                found.add(inner if inner in modules() else where.removeprefix("ibfil."))
        typing = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if not (at_load and (typing or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)))):
            nodes += ast.iter_child_nodes(node)
    return frozenset(found - {name})


def rank(name: str) -> int:
    return ORDER.index(name.split(".")[0])


def test_every_package_has_its_place_in_the_order():
    assert {name.split(".")[0] for name in modules()} == set(ORDER)


def test_imports_run_down_the_order():
    for name in modules():
        upward = [other for other in imports(name) if other in modules() and rank(other) > rank(name)]
        assert upward == [], name


def test_rods_and_fluids_are_apart_and_the_method_knows_no_case():
    for name in modules():
        top, others = name.split(".")[0], {other.split(".")[0] for other in imports(name)}
        assert not (top == "rods" and "fluids" in others), name
        assert not (top in METHOD and others & {"case", "assembly", "simulation"}), name
        assert not (top == "case" and others & set(METHOD)), name


def circles() -> list[list[str]]:
    """The groups of modules that import each other in a round (Tarjan's strongly connected components)."""
    index, low, stack, out = {}, {}, [], []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in imports(name):
            if other in modules() and other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            round_ = [stack.pop()]
            while round_[-1] != name:
                round_.append(stack.pop())
            if len(round_) > 1:
                out.append(sorted(round_))

    for name in modules():
        if name not in index:
            visit(name)
    return out


def test_no_files_import_each_other_in_a_round():
    assert circles() == []


LONG_FUNCTIONS: set[str] = set()


def test_folders_files_and_functions_are_small():
    for folder in {path.parent for path in modules().values()}:
        count = len([path for path in folder.glob("*.py") if path.name != "__init__.py"])
        assert count <= FILES_A_FOLDER, folder
    long_files, long_functions = set(), set()
    for path in modules().values():
        where, text = path.relative_to(PACKAGE).as_posix(), path.read_text()
        if text.count("\n") > LINES_A_FILE:
            long_files.add(where)
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                lines = node.end_lineno - node.lineno + 1
                if lines > LINES_A_FUNCTION:
                    long_functions.add(f"{where}:{node.name}")
    assert long_files == set(), f"over {LINES_A_FILE} lines"
    assert long_functions == LONG_FUNCTIONS


def words_of_the_case() -> set[str]:
    """Every word that a key of a case may have for a value."""
    found = set()
    for name in modules():
        if name.startswith("case."):
            for node in ast.walk(parsed(name)):
                if isinstance(node, ast.Subscript) and ast.unparse(node.value) == "Literal":
                    found |= {c.value for c in ast.walk(node.slice) if isinstance(c, ast.Constant)}
    return {word for word in found if isinstance(word, str)}


# Words of other vocabularies that are spelled like those of a case: options of render, names of measures and datasets.
NOT_OF_THE_CASE = {
    ("fluids.fields", "pressure"),
    ("fluids.fields", "velocity"),
    ("fluids.fields", "vorticity"),
    ("studies.trade.figure", "position"),
    ("visualization.pictures", "none"),
    ("visualization.quantities", "last"),
    ("visualization.render", "none"),
}


def compared_words(name: str) -> set[tuple[str, str]]:
    """Words of the case that a module compares something with: ==, !=, or one of several in a tuple or list."""
    words, found = words_of_the_case(), set()
    for node in ast.walk(parsed(name)):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            constants = [
                c for side in sides for c in (side.elts if isinstance(side, (ast.Tuple, ast.List)) else [side])
            ]
            plain = any(isinstance(op, (ast.Eq, ast.NotEq)) for op in node.ops)
            listed = any(isinstance(side, (ast.Tuple, ast.List, ast.Set)) for side in node.comparators)
            if plain or listed or name == "fluids.fields":
                found |= {(name, c.value) for c in constants if isinstance(c, ast.Constant) and c.value in words}
    return found


def test_words_of_a_case_are_compared_where_it_is_read_and_assembled_only():
    """A kind brings what is known of it; elsewhere it is asked, and no word compared (R5)."""
    for name in modules():
        if name.split(".")[0] not in ("case", "assembly"):
            assert compared_words(name) - NOT_OF_THE_CASE == set()
    assert {word for name in modules() for word in compared_words(name)} >= NOT_OF_THE_CASE


def test_physics_knows_no_files_and_no_screen():
    for name in modules():
        if name.split(".")[0] in (*METHOD, "assembly", "simulation", "shapes", "case"):
            assert not imports(name) & {*DRAWING, "tqdm"}, name
            assert name == "shapes.from_run" or not imports(name) & {"h5py", "io.reader", "io.writer"}, name


def test_a_case_loads_little():
    """Reading a case, and its faults, wait for no numerical library."""
    for name in modules():
        if name.split(".")[0] == "case" and name not in ("case.spacing", "case.formulas.evaluation"):
            assert not imports(name, at_load=True) & {"numpy", "numba", "scipy", "h5py", "pyfftw", *DRAWING}, name


def test_only_what_draws_loads_what_draws_and_only_when_it_does():
    for name in modules():
        assert not imports(name, at_load=True) & (DRAWING - {"vtk"}), name
        if not (name.split(".")[0] in ("visualization", "analysis") or name.endswith("figure")):
            assert not imports(name) & (DRAWING - {"vtk"}), name


def test_a_worker_and_the_command_line_load_the_standard_library_only():
    """What a process of a study loads first: it has yet to set its number of threads. And help is instant."""
    first = ("studies.members", "studies.workers", "studies.member", "threads", "errors", "cache", "version")
    for name in (*first, *(n for n in modules() if n.split(".")[0] == "commands")):
        outside = imports(name, at_load=True) - set(modules())
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
from ibfil.commands.main import main
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
        "assert callable(ibfil.run) and ibfil.run.__module__ == 'ibfil.running.run'\n"
        "try: ibfil.nonsense\n"
        "except AttributeError: pass\n"
        "else: raise SystemExit(1)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "False" not in done.stdout
    assert ibfil.__all__


def test_docstrings_say_first_what_a_thing_is_or_returns():
    """A noun of the field, and no sentence that begins with "What"."""
    for name in modules():
        for node in ast.walk(parsed(name)):
            if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
                text = " ".join((ast.get_docstring(node) or "").split())
                assert not re.search(r"(^|[.:;] )What [a-z]", text), f"{name}: {text[:80]}"
