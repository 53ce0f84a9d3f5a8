"""The map of `ibfil stability`: one square a setting, its class in colour and letter, and the predicted limit."""

from __future__ import annotations

import textwrap
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...visualization.style import drawing, literal, save
from .results import CLASSES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..settings import Axis
    from .results import Map, MapCell


# Colours that all eyes tell apart (Okabe and Ito, lightened), and a letter in each square for prints without them.
_COLOURS = ("#d9f0e6", "#56B4E9", "#CC79A7", "#E69F00", "#f0e442", "#D55E00", "#bbbbbb")
_LETTERS = ("", "W", "T", "L", "S", "D", "?")
_WORDS = {"W": "wrong: > 0.05 L away", "T": "turned: > 0.1 rad", "L": "locked: > 10 times the forces",
          "S": "stretched: > 0.02", "D": "diverged: failed", "?": "no reference", "": "stable"}  # fmt: skip


def draw(result: Map, path: Path) -> None:
    """Draw the map into ``path``; what varies beyond two axes has a panel each."""
    from matplotlib.figure import Figure

    axes = [axis for axis in result.axes if len(axis.values) > 1] or list(result.axes[:1])
    across, down = axes[-1], axes[-2] if len(axes) > 1 else None
    others = [axis for axis in axes if axis is not across and axis is not down]
    panels = list(product(*(axis.values for axis in others)))
    columns, lines = len(across.values), len(down.values) if down else 1
    with drawing():
        size = ((1.9 + 0.78 * columns) * len(panels) + 1.6, max(2.6, 1.7 + 0.52 * lines))
        fig = Figure(figsize=size, layout="constrained")
        grid = fig.subplots(1, len(panels), squeeze=False)[0]
        for location, values in zip(grid, panels, strict=True):
            chosen = {
                key: text
                for axis, v in zip(others, values, strict=True)
                for key, text in zip(axis.keys, v, strict=True)
            }
            cells = [cell for cell in result.cells if all(cell.setting.values[k] == v for k, v in chosen.items())]
            _panel(location, cells, across, down)
            if chosen:
                location.set_title(", ".join(f"{key.rsplit('.', 1)[-1]} {text}" for key, text in chosen.items()))
        _legend(fig, result)
        wide = int(9.5 * size[0])
        fig.suptitle(literal(textwrap.fill(result.title, wide)), x=0.012, ha="left", fontsize=10, fontweight="bold")
        save(fig, path)


def _name(axis: Axis) -> str:
    return ", ".join(key.removeprefix("filament.") for key in axis.keys)


def _label(values: tuple[str, ...]) -> str:
    def short(text: str) -> str:
        parts = text.strip("[] ").split(",")
        same = len(parts) == 3 and len({part.strip() for part in parts}) == 1
        return f"{parts[0].strip()}\u00b3" if same else text

    return "\n".join(short(text) for text in values)


def _panel(axes: Axes, cells: list[MapCell], across: Axis, down: Axis | None) -> None:
    """One map of two axes."""

    def location(cell: MapCell) -> tuple[int, int]:
        def at(axis: Axis) -> int:
            return axis.values.index(tuple(cell.setting.values[key] for key in axis.keys))

        return (0 if down is None else at(down)), at(across)

    shape = (1 if down is None else len(down.values), len(across.values))
    feared = np.zeros(shape, bool)
    for cell in cells:
        row, column = location(cell)
        number = CLASSES.index(cell.kind)
        axes.add_patch(_square(column, row, _COLOURS[number]))
        axes.text(column, row, _LETTERS[number], ha="center", va="center", fontsize=9, fontweight="bold")
        feared[row, column] = bool(cell.predicted)
    _limit(axes, feared)
    axes.set_xlim(-0.5, shape[1] - 0.5)
    axes.set_ylim(shape[0] - 0.5, -0.5)
    axes.set_xticks(range(shape[1]), [_label(values) for values in across.values])
    axes.set_yticks(range(shape[0]), [""] if down is None else [_label(values) for values in down.values])
    axes.set_xlabel(_name(across))
    axes.set_ylabel("" if down is None else _name(down))
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _square(column: int, row: int, colour: str):
    from matplotlib.patches import Rectangle

    return Rectangle((column - 0.47, row - 0.47), 0.94, 0.94, facecolor=colour, edgecolor="0.6", lw=0.5)


def _limit(axes: Axes, feared: np.ndarray) -> None:
    """A line between squares of which one is predicted to be amiss and the other is not."""
    lines, columns = feared.shape
    style: Any = {"color": "black", "lw": 2.4, "solid_capstyle": "butt", "zorder": 4}
    for row in range(lines):
        for column in range(columns):
            if column + 1 < columns and feared[row, column] != feared[row, column + 1]:
                axes.plot([column + 0.5] * 2, [row - 0.5, row + 0.5], **style)
            if row + 1 < lines and feared[row, column] != feared[row + 1, column]:
                axes.plot([column - 0.5, column + 0.5], [row + 0.5] * 2, **style)


def _legend(fig, result: Map) -> None:
    """The classes that are on the map, and the line."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    seen = [kind for kind in CLASSES if any(cell.kind == kind for cell in result.cells)]
    marks: list[Any] = [
        Patch(facecolor=_COLOURS[CLASSES.index(kind)], edgecolor="0.6",
              label=f"{_LETTERS[CLASSES.index(kind)]}  {_WORDS[_LETTERS[CLASSES.index(kind)]]}".strip())
        for kind in seen
    ]  # fmt: skip
    predicted = [bool(cell.predicted) for cell in result.cells]
    if all(predicted):
        marks.append(Line2D([], [], lw=0, label="all predicted to be amiss"))
    elif any(predicted):
        marks.append(Line2D([], [], color="black", lw=2.4, label="predicted limit"))
    fig.legend(handles=marks, loc="outside right center", fontsize=7.5)
