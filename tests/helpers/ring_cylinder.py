"""The drag of a cylinder made of rings of uniform force: an integral equation along its axis, h = eta = 1 or any unit.

A ring of radius a that pushes the fluid evenly moves another one, z away, at the mean over both of Oseen's tensor,

    along the axis (K + E)/(4 pi^2 A),     across it (3 K - E)/(8 pi^2 A),     A^2 = z^2 + 4 a^2, m = 4 a^2/A^2

K, E the complete elliptic integrals of m. The rings' forces are those with which all of them move alike.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ellipe, ellipkm1


def drag(length: float, radius: float, along: bool, elements: int = 300) -> float:
    """Its drag over eta, to a part in ten thousand."""
    edges = -0.5 * length * np.cos(np.linspace(0, np.pi, elements + 1))  # finer towards the ends
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    node, weight = np.polynomial.legendre.leggauss(8)
    matrix = np.zeros((elements, elements))
    for side in (-1, 1):  # of an element's middle, towards which points are dense: its own integral has a logarithm
        for u, w in zip(0.5 * (node + 1), 0.5 * weight, strict=True):
            z = middle[:, None] - (middle + side * half * u**3)
            apart = np.sqrt(z * z + 4 * radius**2)
            first, second = ellipkm1(np.maximum((z / apart) ** 2, 1e-300)), ellipe(1 - (z / apart) ** 2)
            kernel = (first + second if along else 1.5 * first - 0.5 * second) / (4 * np.pi**2 * apart)
            matrix += kernel * w * 3 * u**2 * half
    return float(np.linalg.solve(matrix, np.ones(elements)) @ np.diff(edges))
