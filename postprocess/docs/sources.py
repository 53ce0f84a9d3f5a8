"""The folder that Sphinx reads: the documents of the project, each folder's README.md as its index, and more pages."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
from pathlib import Path

import ibfil
from ibfil.commands import main as command_line

ROOT = Path(__file__).resolve().parents[2]
INDEX, API = (f"{name}.md" for name in ("index", "api"))
COPIED = {".md", ".png", ".csv"}
README = re.compile(r"(\]\([^)\s]*?)README\.md")
SOURCE = re.compile(r"(\]\([^)\s]*?)([\w-]+)\.py\)")
LISTED = re.compile(r"^- `([\w-]+)\.py`:", re.MULTILINE)
# The packages in the parts of the side bar, in the order that `ibfil/__init__.py` has them.
METHOD = ("linalg", "grid", "rods", "bodies", "fluids", "parallel", "timestepping")
SCENE = ("case", "io", "observables", "shapes", "assembly", "simulation", "check", "running")
RESULTS = ("analysis", "visualization", "bench", "studies", "commands")


def write(out: Path) -> None:
    """Write all pages to the new folder ``out``."""
    for path in _documents():
        to = out / path.relative_to(ROOT)
        to.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".md":
            (to.with_name(INDEX) if path.name == "README.md" else to).write_text(_page(path))
        else:
            shutil.copyfile(path, to)
    for folder in sorted({path.parent for path in (ROOT / "ibfil").rglob("*.py")}):
        (out / folder.relative_to(ROOT) / API).write_text(_modules(folder))
    for name, text in (("python", _public()), ("keys", _keys()), ("commands", _commands())):
        (out / name).with_suffix(".md").write_text(text)


def _documents() -> list[Path]:
    """The files of the project that are pages, or that pages show."""
    below = [path for name in ("ibfil", "cases", "postprocess") for path in (ROOT / name).rglob("*")]
    return sorted(path for path in (*ROOT.glob("*.md"), *below) if path.suffix in COPIED and path.is_file())


def _page(path: Path) -> str:
    """A document with its links to pages, and, where it is the README.md of a folder, the tree of what is below it."""
    text = SOURCE.sub(rf"\1{API}#\2)", README.sub(rf"\1{INDEX}", path.read_text(encoding="utf-8")))
    if path.name != "README.md":
        return text
    if path.parent == ROOT:
        return text + _home()
    pages = sorted(one.stem for one in path.parent.glob("*.md") if one.name != "README.md")
    below = sorted(f"{one.parent.name}/index" for one in path.parent.glob("*/README.md"))
    api = ["api"] if list(path.parent.glob("*.py")) and "ibfil" in path.relative_to(ROOT).parts else []
    return LISTED.sub(rf"- [`\1.py`]({API}#\1):", text) + _tree("", [*pages, *api, *below])


def _tree(caption: str, pages: list[str]) -> str:
    """A tree of pages for the side bar."""
    options = [":hidden:", *([f":caption: {caption}"] if caption else [])]
    return "\n".join(["", "```{toctree}", *options, "", *pages, "```", ""]) if pages else ""


def _home() -> str:
    trees = {
        "Learn": [
            *("postprocess/tutorials/index", "cases/index", "postprocess/studies/index"),
            "The paper, measured <postprocess/paper/measured/index>",
        ],
        "Look up": ["keys", "commands", "python"],
        "The method": [f"ibfil/{name}/index" for name in METHOD],
        "A scene and a run": [f"ibfil/{name}/index" for name in SCENE],
        "What is made of runs": [f"ibfil/{name}/index" for name in RESULTS],
        "The project": ["ibfil/api", "CONTRIBUTING", "CHANGELOG"],
    }
    return "".join(_tree(caption, pages) for caption, pages in trees.items())


def _modules(folder: Path) -> str:
    """The page of a package's modules, in the order in which its README.md lists them."""
    package = ".".join(folder.relative_to(ROOT).parts)
    readme = folder / "README.md"
    names = LISTED.findall(readme.read_text(encoding="utf-8")) if readme.exists() else []
    names = names or sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("__"))
    head = f"# Modules of {package.removeprefix('ibfil.')}\n"
    if folder.parent == ROOT:
        head = _rst("# The package", [f".. automodule:: {package}", "   :no-members:"])
    return "\n".join([head, *(_rst(f"## {name}\n", [f".. automodule:: {package}.{name}"]) for name in names)])


def _rst(head: str, directives: list[str]) -> str:
    return "\n".join([head, "", "```{eval-rst}", *directives, "```", ""])


def _public() -> str:
    """The public names, as `ibfil.__all__` has them."""
    head = "# From Python\n\nThe public names of `ibfil`.\n"
    classes = [name for name in ibfil.__all__ if isinstance(getattr(ibfil, name), type)]
    functions = [name for name in ibfil.__all__ if name not in (*classes, "__version__")]
    directives = [
        *(f".. autofunction:: ibfil.{name}" for name in functions),
        *(f".. autoclass:: ibfil.{name}" for name in classes),
    ]
    return _rst(head, [line for directive in directives for line in (directive, "")])


def _said(*words: str) -> str:
    """The text that a command prints, as a block."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        command_line.main(words)
    return f"```text\n{text.getvalue()}```\n"


def _keys() -> str:
    return f"# Keys of a case\n\n`ibfil schema` prints this.\n\n{_said('schema')}"


def _commands() -> str:
    parts = ["# The command line\n", _said("--help")]
    for module in command_line.COMMANDS:
        parts += [f"## ibfil {module.NAME}\n", _said(module.NAME, "--help")]
    return "\n".join(parts)
