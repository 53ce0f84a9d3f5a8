"""What Sphinx is told (it reads this file by its name): see the docstring of the package."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import ibfil
from postprocess.docs import annotations, docstrings

project = "ibfil"
author = "the ibfil authors"
copyright = author
release = version = ibfil.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc = "index"
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"ibfil {release}"
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["wide.css"]
smartquotes = False  # r'' is a second derivative
html_theme_options = {"navigation_with_keys": True}

# Equations stand in indented blocks: those are of no language. Python in a document says that it is.
highlight_language = "none"
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
# What only one command needs, and is not there, is not needed to describe it.
autodoc_mock_imports = [
    name for name in ("distributed", "imageio", "loky", "mpi4py", "trame", "xarray") if find_spec(name) is None
]
python_maximum_signature_line_length = 88
# Names of other libraries, and of types that a signature names by themselves, lead nowhere.
nitpick_ignore_regex = [(r"py:.*", r".*")]


def setup(app: Any) -> None:
    """Annotations are types; docstrings are plain text with code in it, not reStructuredText."""
    annotations.complete()
    app.connect("autodoc-process-docstring", docstrings.to_rst)
    app.connect("autodoc-skip-member", docstrings.skip)
