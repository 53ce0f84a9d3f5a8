"""A run opened from Python, with its pictures: `ibfil.open`."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..analysis.run import Run
from ..errors import CaseError
from ..io.overwriting import refuse


def open_run(path: str | Path) -> PicturedRun:
    """Open the run file ``path`` for reading; close it or use it in a ``with``.

    A run that is still being written can be open at the same time, and shows its outputs so far. Several threads may
    ask one opened run. Raises RunFileError (a CaseError), with one line, for what is not there, is no run file, is of
    another format version or is damaged.

    >>> with ibfil.open("run.h5") as run:
    ...     tip = run.filaments["rod"]["position"][-1, -1]  # reads three numbers of the file
    ...     bend = run.filaments["rod"]["strain"][:, :, 0]
    ...     print(len(run), run.time[-1], tip.shape, bend.shape)
    3 0.002 (3,) (3, 9)
    """
    return PicturedRun(path)


@dataclass(frozen=True, repr=False)
class Picture:
    """A picture that a notebook shows; ``png`` are its bytes."""

    png: bytes

    def __repr__(self) -> str:
        return f"<Picture of {len(self.png)} bytes; a notebook shows it>"

    def _repr_png_(self) -> bytes:
        return self.png


class PicturedRun(Run):
    """A run, and its pictures as `ibfil show --plot` and `ibfil render` make them, shown by a notebook or in a file."""

    def plot(self, path: str | Path | None = None, *, overwrite: bool = False, **look: Any) -> Picture | Path:
        """The figure of the run: shapes, path, observables. In the file ``path`` (png, pdf, svg), or to be shown.

        ``look`` as moments.Look: begin=0.5, end=1.0 (times), shapes=8 (of each filament), co_moving=True. Raises
        CaseError for others, for another ending, and where the file exists and ``overwrite`` is not set.

        >>> with ibfil.open("run.h5") as run:
        ...     picture = run.plot()
        >>> picture.png[1:4]
        b'PNG'
        """
        from .moments import Look
        from .run_figure import draw, kind_of

        _known(look, Look._fields)
        if path is None:
            return _shown(lambda place: draw(self, place, Look(**look)))
        refuse(Path(path), kind_of(Path(path)), overwrite, [self.path])
        draw(self, path, Look(**look))
        return Path(path)

    def render(self, path: str | Path | None = None, *, overwrite: bool = False, **wishes: Any) -> Picture | Path:
        """The rods to scale, at one time or over the run. In the file ``path`` (png, mp4, gif), or to be shown.

        ``wishes`` are those of pictures.Wish: colour="tension", flow="slice", time=1.0, size=(1280, 960), montage=5,
        fps=25, every=1, view="z", up=(0, 1, 0), zoom=2, box=True, wrap=True, follow="rod", range=(0, 1). Raises
        CaseError for others, for what cannot be drawn, and where the file exists and ``overwrite`` is not set.
        """
        from .pictures import Wish
        from .render import render

        _known(wishes, Wish._fields)
        try:
            with _no_word_of_bars():
                if path is None:
                    return _shown(lambda place: render(self.path, place, Wish(**wishes), overwrite=True))
                return render(self.path, path, Wish(**wishes), overwrite=overwrite)
        except CaseError as error:  # which names the arguments of the command line
            raise CaseError([fault.replace("--", "") for fault in error.faults]) from None

    def page(self, path: str | Path, *, colour: str = "tension", most: float = 20.0, overwrite: bool = False) -> Path:
        """The run as one self-contained page, ``path`` (.html), that turns in any browser; returns the path.

        ``colour`` is the quantity shown first; outputs are left out evenly to keep it below ``most`` MB. Raises
        CaseError for what cannot be had, and where the file exists and ``overwrite`` is not set.
        """
        from .web.page import write_page

        with _no_word_of_bars():
            return write_page(self.path, path, colour=colour, most=most, log=lambda line: None, overwrite=overwrite)


def _known(wishes: Mapping[str, Any], fields: Sequence[str]) -> None:
    strange = [name for name in wishes if name not in fields]
    if strange:
        raise CaseError([f"{strange[0]}: found a wish of that name; allowed: {', '.join(fields)}"])


@contextmanager
def _no_word_of_bars() -> Iterator[None]:
    """Within it pyvista may be loaded in a notebook without widgets, of which a bar that nobody sees would warn."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "IProgress not found")
        yield


def _shown(make: Callable[[Path], object]) -> Picture:
    """The picture that is made in a file."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "picture.png"
        make(place)
        return Picture(place.read_bytes())
