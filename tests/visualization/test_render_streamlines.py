"""Streamlines of pictures: along the flow, evenly apart, and into stagnation points."""

from __future__ import annotations

import numpy as np
import pytest

from ibfil.visualization.streamlines import evenly_spaced

X, Y = np.linspace(-1.0, 1.0, 81), np.linspace(-0.5, 0.5, 41)
ACROSS, UP = np.meshgrid(X, Y, indexing="ij")
GAP = 0.1
FLOWS = {
    "uniform": (np.ones_like(ACROSS), 0 * ACROSS),
    "stagnation point": (ACROSS, -UP),
    "vortex": (-UP, ACROSS),
    "Taylor-Green": (np.sin(np.pi * ACROSS) * np.cos(np.pi * UP), -np.cos(np.pi * ACROSS) * np.sin(np.pi * UP)),
}


@pytest.mark.parametrize("name", FLOWS)
def test_lines_go_with_the_flow_and_fill_the_plane(name):
    u, v = FLOWS[name]
    lines = evenly_spaced(X, Y, u, v, GAP)
    assert 5 <= len(lines) <= 120
    for line in lines:
        step, middle = np.diff(line, axis=0), 0.5 * (line[1:] + line[:-1])
        size = np.linalg.norm(step, axis=1)
        assert np.all(size > 0)
        turned = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
        assert abs(turned[-1] - turned[0]) < 2.5 * np.pi  # about a vortex once, and not again
        flow = {
            "uniform": lambda p: np.stack([np.ones(len(p)), np.zeros(len(p))], 1),
            "stagnation point": lambda p: p * [1, -1],
            "vortex": lambda p: np.stack([-p[:, 1], p[:, 0]], 1),
            "Taylor-Green": lambda p: np.stack(
                [
                    np.sin(np.pi * p[:, 0]) * np.cos(np.pi * p[:, 1]),
                    -np.cos(np.pi * p[:, 0]) * np.sin(np.pi * p[:, 1]),
                ],
                1,
            ),
        }[name](middle)
        speed = np.linalg.norm(flow, axis=1)
        along = np.sum(step * flow, axis=1) / np.maximum(size * speed, 1e-300)
        seen = (speed > 0.05) & (size > 1e-4)
        assert np.all(along[seen] > 0.95)
    points = np.vstack(lines)
    places = np.stack([ACROSS[::8, ::8].ravel(), UP[::8, ::8].ravel()], 1)
    apart = np.linalg.norm(places[:, None] - points[None], axis=2).min(axis=1)
    assert apart.max() < 3 * GAP


def test_where_nothing_flows_there_are_none():
    assert evenly_spaced(X, Y, 0 * ACROSS, 0 * ACROSS, GAP) == []
