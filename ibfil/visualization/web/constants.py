"""The common part of pages that draw rods (draw.js): constants of a scene, strokes of links and bodies, colours."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.body_meshes import Columns, drawn, ends_of_axes, grain
from ...assembly.fluids.models import fluid_model
from ...screen import printable
from ..camera import turned, upwards, viewpoint
from ..quantities import colours

if TYPE_CHECKING:
    from ...case.schema import Case

LEVELS = 256  # of colours
RING = 24  # strokes of a ring about a body


def filled(page: str, title: str, data: str, *scripts: str) -> str:
    """The page with its title, its data (JSON, of which no character can end the script), its scripts in turn.

    Files are named from the folder of visualization on.
    """
    here = files(__package__.rpartition(".")[0])
    text = (here / page).read_text(encoding="utf-8")
    for char in "<>&\u2028\u2029":
        data = data.replace(char, f"\\u{ord(char):04x}")
    code = "".join((here / name).read_text(encoding="utf-8") for name in scripts)
    head, rest = text.split("@DATA@")
    middle, tail = rest.split("@SCRIPT@")
    return head.replace("@TITLE@", escape(printable(title))) + data + middle + code + tail


def constants(
    case: Case, name: str, seen: Sequence[np.ndarray], corners: tuple[np.ndarray, np.ndarray], radii: np.ndarray
) -> dict[str, Any]:
    """All that stays: words, radii (n,), and from where one looks at what is ``seen``, (T, N, 3) each.

    ``name`` is the title of a case without one; ``corners`` are the lowest and the highest place (3,).
    """
    look = turned(viewpoint(seen), None, None, upwards(case))
    model, units = fluid_model(case), case.units
    low, high = corners
    return {
        "title": printable(" ".join(case.title.split()) or name),
        "casetext": case.text,
        "timewords": "time #" + ("" if units.time == "1" else f" {units.time}"),
        "lengthunit": "" if units.length == "1" else f" {units.length}",
        "linewords": _words(case),
        "radius": packed(radii, "<f4"),
        "centre": look.centre.tolist(),
        "reach": max(0.5 * float(np.linalg.norm(high - low)) + float(radii.max()), 1e-300),
        "towards": look.towards.tolist(),
        "up": look.up.tolist(),
        "box": None if model.box is None else model.box.tolist(),
        "wall": model.wall,
    }


def _words(case: Case) -> str:
    """The legend of strokes."""
    shapes = [body.shape for body in case.bodies.values()]
    found = {
        "lines: links": case.links,
        "rings: bodies": any(any(shape.semi_axes) for shape in shapes),
        "crosses: markers": any(shape.file for shape in shapes),
    }
    return "; ".join(words for words, there in found.items() if there)


def strokes(case: Case, links: Columns, bodies: Columns) -> np.ndarray:
    """The two ends of each stroke (T, K, 2, 3): of the elements of all links, and three rings about each body.

    Columns are arrays over times: ``first`` and ``second`` (T, K, 3) of links, ``position``, ``e1`` ... (T, 3).
    Markers (T, k, 3) of a file are crosses of three short strokes.
    """
    each = [np.stack([np.asarray(c["first"]), np.asarray(c["second"])], axis=2) for c in links.values()]
    turn = np.linspace(0.0, 2 * np.pi, RING + 1)[:, None]
    for ends, (columns, _) in zip(ends_of_axes(case, bodies), drawn(case, bodies), strict=True):
        if "markers" in columns:
            each += _crosses(columns)
            continue
        centre = np.asarray(columns["position"])[:, None]
        arms = [ends[:, None, k] - centre for k in (0, 2, 4)]
        for one, other in ((0, 1), (1, 2), (2, 0)):
            ring = centre + np.cos(turn) * arms[one] + np.sin(turn) * arms[other]
            each.append(np.stack([ring[:, :-1], ring[:, 1:]], axis=2))
    return np.concatenate(each, axis=1) if each else np.zeros((1, 0, 2, 3))


def _crosses(columns: Mapping[str, Any]) -> list[np.ndarray]:
    """Strokes (T, k, 2, 3) along each axis of a body through its markers."""
    markers = np.asarray(columns["markers"])
    arms = [grain(markers[0]) * np.asarray(columns[key])[:, None] for key in ("e1", "e2", "e3")]
    return [np.stack([markers - arm, markers + arm], axis=2) for arm in arms]


def packed(values: np.ndarray, kind: str) -> str:
    """An array as base64 of numbers of that kind, little-endian."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()


def shades(name: str, count: int = LEVELS) -> list[list[int]]:
    """So many colours, 0 to 255 each of red, green and blue, along the map of that name."""
    return np.round(255 * colours(name)(np.linspace(0, 1, count))[:, :3]).astype(int).tolist()
