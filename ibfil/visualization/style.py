"""The common style of figures: style, colours and marks, labels with units, the plane that is drawn, files.

Figures look alike wherever they are drawn: with matplotlib's own settings and those here, not with the user's, which
may ask for what is not there (LaTeX, fonts, a window).
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..io.overwriting import replacing
from ..screen import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


AXES = "xyz"
# Okabe and Ito: told apart by all eyes; with them the marks, for prints without colour.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKS = "osD^vPX"
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "lines.linewidth": 1.4,
}
_TURN = threading.Lock()  # the settings are those of the process


@contextmanager
def drawing() -> Iterator[None]:
    """Within it figures have this style and no other settings; one thread at a time."""
    import matplotlib

    kept = {"backend", "backend_fallback", "interactive"}  # of windows, which are none of ours
    plain = {key: value for key, value in matplotlib.rcParamsDefault.items() if key not in kept}
    with _TURN, matplotlib.rc_context(plain | STYLE):
        yield


def literal(text: str) -> str:
    """A text of the user's for a figure: a $ in it begins no formula."""
    return printable(text).replace("$", r"\$")


def with_units(name: str, units: str) -> str:
    """A label for an axis: the name, and its units where it has any."""
    return f"{name} ({literal(units)})" if units not in ("", "1") else name


def with_unit(number: float, unit: str, digits: int = 4) -> str:
    """A number with its unit, where it has any: "0.6283 s"."""
    return f"{number:.{digits}g}" + (f" {unit}" if unit not in ("", "1") else "")


def plane_of_motion(positions: Sequence[np.ndarray]) -> tuple[int, int]:
    """The two lab axes, in order, along which the filaments (T, N, 3) reach farthest."""
    low = np.min([p.min(axis=(0, 1)) for p in positions], axis=0)
    high = np.max([p.max(axis=(0, 1)) for p in positions], axis=0)
    reach = high - low
    # The first of equally short axes counts from z: a straight rod along x is seen in x-y.
    dropped = 2 - int(np.argmin(reach[::-1]))
    a, b = (axis for axis in range(3) if axis != dropped)
    return a, b


def save(fig: Figure, path: Path) -> None:
    """Write a figure as a picture, and beside it as PDF, for papers; its layout is fixed then."""
    for place in (path, path.with_suffix(".pdf")):
        with replacing(place) as part:
            fig.savefig(part, dpi=170)
        fig.set_layout_engine("none")  # both have one layout: to find it is a fifth of the time of both
