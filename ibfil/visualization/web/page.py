"""A run as one self-contained page: `ibfil page RUN.h5 -o run.html`. No network, no graphics card, any browser."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...analysis.body_meshes import extents
from ...analysis.meshes import polylines, rods_of
from ...analysis.run import Run, open_run
from ...errors import CaseError
from ...io.overwriting import Kind, refuse, replacing
from ...screen import tell
from ..quantities import FILAMENT, OWN, QUANTITIES, Scale, scale_of
from ..style import AXES, COLOURS, plane_of_motion, with_units
from .constants import LEVELS, constants, filled, packed, shades, strokes

PAGE = Kind("a page of ibfil", lambda path, head: b'<meta name="generator" content="ibfil">' in head[:512])
COLOURED = ("tension", "curvature", "speed")
MOST = 20.0  # MB of a page, at most
SHEET = 96  # points along a side of the flow's plane, at most
FIELDS = 60  # fields shown, at most


def write_page(
    run: str | Path,
    output: str | Path,
    *,
    colour: str = COLOURED[0],
    most: float = MOST,
    log: Callable[[str], object] = tell,
    overwrite: bool = False,
) -> Path:
    """Write the run file ``run`` as the page ``output`` (.html) of at most ``most`` MB; returns its path.

    ``colour`` is the quantity that is shown first, one of quantities.QUANTITIES. Outputs are left out evenly where they
    would make it larger, which is told. The file is whole or not there. Raises CaseError where it exists and
    ``overwrite`` is not set, for a name that does not end in .html, for other quantities, for a bound that not even one
    output keeps, and as `ibfil.open`.
    """
    path = Path(output)
    faults = [] if path.suffix == ".html" else [f"{path}: found a name that does not end in .html"]
    if colour not in QUANTITIES:
        faults.append(f"--colour: found {colour}; allowed: {', '.join(QUANTITIES)}")
    if not 0.1 <= most <= 1000:
        faults.append(f"--most: found {most:g}; allowed: 0.1 to 1000 MB")
    if faults:
        raise CaseError(faults)
    refuse(path, PAGE, overwrite, [Path(run)])
    with open_run(run) as opened:
        shown = list(dict.fromkeys([colour, *COLOURED, *([FILAMENT] if len(opened.filaments) > 1 else [])]))
        flow = _flow(opened)
        picked = _picked(opened, len(shown), flow, most, path)
        content = json.dumps(_content(opened, picked, shown, flow), allow_nan=False)
        text = filled("web/page.html", opened.case.title or opened.path.stem, content, "web/draw.js", "web/page.js")
        count = len(opened)
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")
    told = f"{len(picked)} of {count} outputs" + ("" if len(picked) == count else ", evenly; --most MB for more")
    log(f"{path}: {told}, {len(text.encode()) / 1e6:.1f} MB, open it in any browser")
    return path


def _picked(run: Run, quantities: int, flow: dict[str, Any] | None, most: float, path: Path) -> np.ndarray:
    """The outputs that are in the page: all, or as many as its bound allows, evenly."""
    nodes = sum(columns["position"].shape[1] for columns in run.filaments.values())
    room = 1e6 * most - 40e3 - len(run.case_text.encode()) - len(json.dumps(flow))
    elements = _strokes(run, np.zeros(1, np.int64)).shape[1]
    each = 4 / 3 * (nodes * (6 + quantities) + 12 * elements) + 25
    count = int(min(len(run), room // each))
    if count < 1:
        least = (each + 1e6 * most - room) / 1e6 + 0.1
        raise CaseError([f"{path}: --most: found {most:g}; allowed: {least:.1f} MB or more"])
    return np.unique(np.linspace(0, len(run) - 1, count).round().astype(int))


def _content(run: Run, picked: np.ndarray, shown: Sequence[str], flow: dict[str, Any] | None) -> dict[str, Any]:
    """All that the page knows of the run, as JSON: arrays as base64, little-endian."""
    every = [np.asarray(columns["position"])[picked] for columns in run.filaments.values()]
    places, links = np.concatenate(every, axis=1), _strokes(run, picked)
    both = np.concatenate([places, links.reshape(len(picked), -1, 3)], axis=1)
    low, high = both.min(axis=(0, 1)), both.max(axis=(0, 1))
    span = np.where(high > low, high - low, 1.0)
    ends = [each[picked] for each in extents(run)]
    radii = np.concatenate([rod.radius for rod in rods_of(run).values()])
    return {
        **constants(run.case, run.path.stem, [*every, *ends], (low, high), radii),
        "times": [float(t) for t in run.time[picked]],
        "counts": [p.shape[1] for p in every],
        "positions": packed(np.round((places - low) / span * 65535), "<u2"),
        "links": links.shape[1],
        "linked": packed(np.round((links - low) / span * 65535), "<u2"),
        "low": low.tolist(),
        "span": span.tolist(),
        "quantities": _quantities(run, picked, shown),
        "flow": flow,
    }


def _strokes(run: Run, picked: np.ndarray) -> np.ndarray:
    """The strokes (T, K, 2, 3) of the outputs that are picked."""
    kept = {"first", "second", "position", "e1", "e2", "e3", "markers"}
    links, bodies = (
        {name: {key: np.asarray(columns[key])[picked] for key in kept & set(columns)} for name, columns in part.items()}
        for part in (run.links, run.bodies)
    )
    found = strokes(run.case, links, bodies)
    return found if found.size else np.zeros((len(picked), 0, 2, 3))


def _quantities(run: Run, picked: np.ndarray, names: Sequence[str]) -> list[dict[str, Any]]:
    """Quantities as bytes on their scales of colours; of filaments none are needed."""
    from pyvista import wrap

    rods, out = rods_of(run), []
    scales = {name: scale_of(run, name, "run", len(run) - 1) for name in names}
    bytes_of: dict[str, list[np.ndarray]] = {name: [] for name in names}
    wanted = set(picked.tolist())
    for snapshot in (one for output, one in enumerate(run.snapshots()) if output in wanted):  # read in blocks
        mesh = wrap(polylines(snapshot, rods))
        for name, scale in scales.items():
            share = (QUANTITIES[name].values(mesh) - scale.low) / (scale.high - scale.low)
            bytes_of[name].append(np.round(np.nan_to_num(np.clip(share, 0, 1)) * (LEVELS - 1)))
    for name, scale in scales.items():
        if scale.names:
            low, high = scale.names[0], scale.names[-1]
            own = shades(f"{OWN}{len(COLOURS)}", len(COLOURS))
            out.append({"words": name, "values": None, "map": own, "low": low, "high": high})
            continue
        low, high = _ends(scale)
        values = packed(np.array(bytes_of[name]), "u1")
        out.append({"words": scale.label, "values": values, "map": shades(scale.colours), "low": low, "high": high})
    return out


def _ends(scale: Scale) -> tuple[str, str]:
    below, above = ("\u2264 " if scale.below else ""), ("\u2265 " if scale.above else "")
    return f"{below}{scale.low:.3g}", f"{above}{scale.high:.3g}"


def _flow(run: Run) -> dict[str, Any] | None:
    """The recorded velocity in the grid plane nearest the filaments, at some of its times; None where there is none."""
    grid = run.grid
    if grid is None or "velocity" not in grid.fields or not len(grid.time):
        return None
    positions = [np.asarray(columns["position"]) for columns in run.filaments.values()]
    a, b = plane_of_motion(positions)
    across, cells = 3 - a - b, np.array(grid.fields["velocity"].shape[1:4])
    middle = float(np.mean([p[..., across].mean() for p in positions]))
    level = round((middle - grid.origin[across]) / grid.spacing[across]) % int(cells[across])
    times = np.asarray(grid.time)
    picked = np.unique(np.linspace(0, len(times) - 1, min(FIELDS, len(times))).round().astype(int))
    thin = int(max(1, np.ceil(max(cells[a], cells[b]) / SHEET)))
    sheets = []
    for number in picked:
        sheet = grid.fields["velocity"][int(number)].astype(float).take(level, axis=across)
        sheets.append(sheet.swapaxes(0, 1)[::thin, ::thin])  # [b, a]
    u = np.array(sheets)
    speed = np.linalg.norm(u, axis=-1)
    fastest = max(float(np.nanmax(speed)), 1e-300)
    ways = u[..., [a, b]] / np.maximum(np.linalg.norm(u[..., [a, b]], axis=-1, keepdims=True), 1e-12 * fastest)
    corner = np.array(grid.origin, float)
    corner[across] += level * grid.spacing[across]
    step = thin * np.asarray(grid.spacing, float)
    corner[[a, b]] -= 0.5 * step[[a, b]]
    unit = run.units("grid/velocity")
    words = with_units(f"speed up to {fastest:.3g}", unit) + f", {AXES[across]} = {corner[across]:.3g}"
    return {
        "shape": [u.shape[2], u.shape[1]],
        "times": [float(t) for t in times[picked]],
        "speed": packed(np.round(255 * speed / fastest), "u1"),
        "arrows": packed(np.round(127 * ways), "i1"),
        "origin": corner.tolist(),
        "first": (np.eye(3)[a] * step[a] * u.shape[2]).tolist(),
        "second": (np.eye(3)[b] * step[b] * u.shape[1]).tolist(),
        "words": words,
    }
