"""The elastic energy of a recorded filament."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..observables.time_series import trapezoid_weights

if TYPE_CHECKING:
    from ..case.expressions import Expression
    from ..io.reader import RunFile


def elastic_energy(run: RunFile, name: str) -> np.ndarray | None:
    """1/2 int (M1^2/A1 + M2^2/A2 + M3^2/C + T^2/EA) ds over the run (T,); None where the law is not linear (Eq. 9).

    The trapezoid rule over nodes for moments, segment by segment for tension; a free end has no moment and so no share.
    """
    filament, s = run.filament(name), run.arclength(name)
    if not filament.law.linear:
        return None
    moment, tension = (np.asarray(run.filaments[name][key]) for key in ("moment", "tension"))
    moduli = [*filament.bending, filament.twisting]
    weights = trapezoid_weights(s)
    bent = sum(moment[:, :, i] ** 2 @ (weights / _at(modulus, s)) for i, modulus in enumerate(moduli) if modulus)
    stretched = tension**2 @ (np.diff(s) / _at(filament.stretching, 0.5 * (s[1:] + s[:-1])))
    return np.asarray(0.5 * (bent + stretched))


def _at(modulus: Expression, s: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.asarray(modulus.bind("s")(s), float), s.shape)
