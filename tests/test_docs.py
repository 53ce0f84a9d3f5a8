"""The pages of `python -m postprocess.docs`: what Sphinx is given. .ci/run builds them, a warning being an error."""

from __future__ import annotations

import re
import sys

import pytest

import ibfil
from ibfil.commands import main as command_line
from postprocess.docs import docstrings, sources
from postprocess.docs.__main__ import main

INDEX, API = sources.INDEX, sources.API
ALONE = ("python", "keys", "commands")  # pages that no document is the source of

PLAIN = """Forces of `Node`s, a*b and |d|, x_ of `two
words`.

    F = Q_ * X/|d|     (Eq. 44)
      goes on
and prose follows at once:
    u = M F
* an item, of which the next line
  is the end
>>> 1 + 1
2
"""

MARKED = r"""Forces of ``Node``\ s, a\*b and \|d\|, x\_ of ``two words``.


::

    F = Q_ * X/|d|     (Eq. 44)
      goes on


and prose follows at once:

::

    u = M F


* an item, of which the next line
  is the end

>>> 1 + 1
2
"""


def test_a_docstring_keeps_its_equations_lists_and_examples():
    assert docstrings.rst(PLAIN) == MARKED


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    out = tmp_path_factory.mktemp("pages") / "source"
    sources.write(out)
    found = {path.relative_to(out): path.read_text() for path in out.rglob("*.md")}
    return {(path.stem if path.stem in ALONE else path.as_posix()): text for path, text in found.items()}


def test_every_package_and_every_module_has_its_place(pages):
    trees = {name: re.findall(r"```{toctree}\n(.*?)```", text, re.DOTALL) for name, text in pages.items()}
    for folder in {path.parent for path in (sources.ROOT / "ibfil").rglob("__init__.py")}:
        name = folder.relative_to(sources.ROOT).as_posix()
        for path in folder.glob("*.py"):
            if not path.stem.startswith("__"):
                assert (
                    f"automodule:: {'.'.join(folder.relative_to(sources.ROOT).parts)}.{path.stem}\n"
                    in pages[f"{name}/{API}"]
                )
        above = INDEX if name.count("/") < 2 else f"{name.rpartition('/')[0]}/{INDEX}"
        wanted = "ibfil/api" if name == "ibfil" else f"{name if above == INDEX else folder.name}/index"
        assert any(wanted in tree for tree in trees[above]), name


def test_documents_lead_to_the_pages_of_others_and_to_modules(pages):
    assert f"[The gallery](cases/{INDEX})" in pages[INDEX]
    assert f"- [`loads.py`]({API}#loads): " in pages[f"ibfil/rods/{INDEX}"]
    assert not any(re.search(r"\]\([^)]*(README.md|[.]py)\)", text) for text in pages.values())


def test_public_names_keys_and_commands_have_a_page(pages):
    for name in ibfil.__all__:
        assert name == "__version__" or f":: ibfil.{name}\n" in pages["python"]
    assert "[filament.NAME]" in pages["keys"]
    for module in command_line.COMMANDS:
        assert f"usage: ibfil {module.NAME}" in pages["commands"]


def test_a_folder_that_holds_something_else_is_left_alone(tmp_path, monkeypatch, capsys):
    (tmp_path / "thesis.tex").write_text("")
    monkeypatch.setattr(sys, "argv", ["docs", "-o", str(tmp_path)])
    assert main() == 2
    assert "which holds something else" in capsys.readouterr().err
    assert (tmp_path / "thesis.tex").exists()


def test_without_sphinx_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "sphinx", None)
    monkeypatch.setattr(sys, "argv", ["docs", "-o", str(tmp_path / "pages")])
    assert main() == 2
    assert capsys.readouterr().err == "sphinx is missing: pip install 'ibfil[docs]'\n"
