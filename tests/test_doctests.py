"""The examples in docstrings run, in a folder with a case and its run; and every public name has its docstring."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest
from helpers.made_run import BENT

import ibfil

TIP = '[observe.tip]\nkind = "position"\nat = "finish"\n'
GRID = ("fluid.model=stokes", "fluid.box=[2.0, 2.0, 2.0]", "fluid.cells=[16, 16, 16]")
SHORT = ("time.end=0.002", "output.every=0.001")


def modules_with_examples() -> list[str]:
    """Names such as "rods.constitutive", of all modules that have examples."""
    folder = Path(ibfil.__file__).parent
    found = [path for path in folder.rglob("*.py") if ">>> " in path.read_text()]
    return sorted(".".join(path.relative_to(folder).with_suffix("").parts) for path in found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("examples")
    (made / "case.toml").write_text(ibfil.parse_case(BENT + TIP, "case.toml", [*GRID, *SHORT]).text)
    ibfil.run(made / "case.toml", made / "run.h5", log=lambda line: None)
    return made


@pytest.mark.parametrize("name", modules_with_examples())
def test_examples_in_docstrings_run(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    module = importlib.import_module("ibfil" if name == "__init__" else f"ibfil.{name}")
    found = doctest.testmod(module, extraglobs={"ibfil": ibfil})
    assert found.attempted > 0
    assert found.failed == 0


def test_every_public_name_says_what_it_is():
    assert dir(ibfil) == sorted(ibfil.__all__)
    for name in ibfil.__all__:
        value = getattr(ibfil, name)
        assert name == "__version__" or len(inspect.getdoc(value) or "") > 40, name
        if inspect.isclass(value):
            for method, function in inspect.getmembers(value, inspect.isfunction):
                inherited = not (function.__module__ or "").startswith("ibfil")
                assert method.startswith("_") or inherited or inspect.getdoc(function), f"{name}.{method}"


def test_what_gives_arrays_says_their_shapes():
    for name in ("velocity_at", "arclength", "position"):
        assert "(" in inspect.getdoc(getattr(ibfil.Run, name)), name
    for name in ("run", "open", "read_case", "parse_case", "write_vtk"):
        assert "Raise" in inspect.getdoc(getattr(ibfil, name)), name
