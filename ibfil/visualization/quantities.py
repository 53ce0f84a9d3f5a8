"""The quantities that rods are coloured by, and their scale of colours."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..analysis.meshes import polylines, rods_of
from ..errors import CaseError
from ..io.units import label
from .style import COLOURS

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

    from ..analysis.run import Run
    from ..case.schema import Units


TIMES = "viridis"  # all eyes can order it
SIGNED = "coolwarm"
OWN = "filaments"  # of the map that gives each filament a colour
OUTER = 1  # percent at each end of a run's values that may be off the scale
SAMPLED = 100  # outputs that a run's scale is of, at most


class Quantity(NamedTuple):
    """A quantity that colours rods: words, dimension, whether it has a sign; its array, and which components count.

    Positions are no array of a mesh: they are where its points are.
    """

    words: str
    dimension: str
    signed: bool
    array: str
    components: tuple[int, ...] = ()

    @property
    def colours(self) -> str:
        """The map of colours."""
        return SIGNED if self.signed else TIMES

    def values(self, mesh: Any) -> np.ndarray:
        """The values (n,) at the points of a mesh of filaments."""
        found = np.asarray(mesh[self.array] if self.array in mesh.point_data else mesh.points, float)
        if found.ndim == 1:
            return found
        picked = found[:, self.components or (0, 1, 2)]
        return picked[:, 0] if picked.shape[1] == 1 else np.linalg.norm(picked, axis=1)


class Scale(NamedTuple):
    """A quantity as colour: its name, the label at the bar, map and ends, and whether values lie beyond these.

    ``names`` are written at the bar in place of numbers: of filaments, each of which has a colour.
    """

    name: str
    label: str
    colours: str
    low: float
    high: float
    below: bool = False
    above: bool = False
    names: tuple[str, ...] = ()


FILAMENT = "filament"
CENTRED = ("velocity", "force", "moment", "strain")  # about zero, which a position is not
QUANTITIES = {
    "tension": Quantity("tension", "force", True, "tension"),
    "moment": Quantity("size of the moment", "force length", False, "moment"),
    "curvature": Quantity("curvature", "1/length", False, "strain", (0, 1)),
    "twist": Quantity("twist", "1/length", True, "strain", (2,)),
    "speed": Quantity("speed of the rod", "length/time", False, "velocity"),
    "force": Quantity("force of a node on the fluid", "force", False, "force"),
    "arclength": Quantity("arclength", "length", False, "arclength"),
    FILAMENT: Quantity("filament", "1", False, "filament"),
} | {
    f"{array}.{axis}": Quantity(f"{array}, {axis}", dimension, array in CENTRED, array, (k,))
    for array, dimension, axes in (
        ("position", "length", "xyz"),
        ("velocity", "length/time", "xyz"),
        ("force", "force", "xyz"),
        ("moment", "force length", "123"),
        ("strain", "1/length", "123"),
    )
    for k, axis in enumerate(axes)
}


def limits_of(text: str | tuple[float, float]) -> str | tuple[float, float]:
    """Return "run", "last" or "LOW,HIGH" as two numbers. Raises CaseError for others."""
    if text in LIMITS:
        return text
    try:
        low, high = (float(part) for part in (text.split(",") if isinstance(text, str) else text))
        if low < high and np.isfinite(high - low):
            return low, high
    except (ValueError, TypeError):
        pass
    raise CaseError([f"--range: found {text}; allowed: {', '.join(LIMITS)}, or LOW,HIGH with LOW < HIGH"])


LIMITS = ("run", "last")


def colours(name: str) -> Colormap:
    """A map of matplotlib's; viridis without its end that is too light on white; that of filaments one by one."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    if name.startswith(OWN):
        count = int(name.removeprefix(OWN))
        return ListedColormap([COLOURS[k % len(COLOURS)] for k in range(count)])
    found = matplotlib.colormaps[name]
    return ListedColormap(found(np.linspace(0, 0.92, 256))) if name == TIMES else found


def words_with_unit(words: str, dimension: str, units: Units) -> str:
    """A label: "tension (pN)"."""
    unit = label(units, dimension)
    return words if unit == "1" else f"{words} ({unit})"


def scale_of(run: Run, name: str, limits: str | tuple[float, float], last: int) -> Scale:
    """The colours of a quantity: over the run but for its outermost hundredths, of output ``last``, or within limits.

    With a sign zero is in the middle, but for limits that are given.
    """
    import pyvista

    quantity = QUANTITIES[name]
    if name == FILAMENT:
        names = tuple(run.filaments)
        return Scale(name, "filament", f"{OWN}{len(names)}", -0.5, len(names) - 0.5, names=names)
    picked = [last] if limits == "last" else np.unique(np.linspace(0, len(run) - 1, SAMPLED).astype(int))
    rods = rods_of(run)
    every = np.concatenate([quantity.values(pyvista.wrap(polylines(run.snapshot(int(i)), rods))) for i in picked])
    every = every[np.isfinite(every)]
    if isinstance(limits, tuple):
        low, high = limits
    else:
        outer = 0 if limits == "last" else OUTER
        low, high = (float(v) for v in np.percentile(every, (outer, 100 - outer)))
        if quantity.signed:
            high = max(abs(low), abs(high))
            low = -high
        if not high - low > 1e-12 * max(abs(low), abs(high)):
            low, high = low - 1.0, high + 1.0
    slack = 1e-3 * (high - low)
    shown = words_with_unit(quantity.words, quantity.dimension, run.case.units)
    beyond = bool(every.min() < low - slack), bool(every.max() > high + slack)
    return Scale(name, shown, quantity.colours, low, high, *beyond)
