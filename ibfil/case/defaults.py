"""Defaults that depend on other tables of a case; those that do not are with their keys."""

from __future__ import annotations

from typing import Any

from .expressions import ExpressionError, Parameters, parse

UPRIGHT_NORMAL = [0.0, 1.0, 0.0]  # of a filament along z: kappa1 bends it in the x-z plane


def _is_upright(direction: Any, parameters: Parameters) -> bool:
    """Whether a direction is along z, as the default of ``normal`` is."""
    try:
        x, y, z = (parse(part, (), parameters).constant or 0.0 for part in direction)
    except (ExpressionError, TypeError, ValueError):  # told elsewhere, if it is at fault
        return False
    return abs(x) + abs(y) < 1e-9 * abs(z)


def fill_defaults(filled: dict[str, Any], parameters: Parameters) -> None:
    """Have the defaults stand in the file's content that depend on other tables."""

    def table(*path: str) -> dict[str, Any]:
        """The table of that path, or one that is thrown away where the file has none."""
        found: Any = filled
        for part in path:
            found = found.get(part) if isinstance(found, dict) else None
        return found if isinstance(found, dict) else {}

    filaments = table("filament")
    for name in filaments:
        if "thermal" in filled:
            table("filament", name).setdefault("derivative", 2)
        if _is_upright(table("filament", name).get("direction"), parameters):
            table("filament", name).setdefault("normal", UPRIGHT_NORMAL)
        copies = table("filament", name, "copies")
        if {"at", "file"} & set(copies):
            copies.setdefault("orientation", "same")
        for end in (table("filament", name, "start"), table("filament", name, "finish")):
            if end.get("end") == "clamped":
                end.setdefault("twist", "held")
    table("thermal").setdefault("twist", any("twisting" in table("filament", name) for name in filaments))
    scheme = table("time").setdefault("scheme", "semi-implicit" if "thermal" in filled else "implicit")
    table("time").setdefault("order", 2 if scheme == "implicit" else 1)
    for name in table("observe"):
        if len(filaments) == 1 and "link" not in table("observe", name):
            table("observe", name).setdefault("filament", next(iter(filaments)))
    for name in table("expect"):
        if "value" in table("expect", name) and not {"absolute", "standard_errors"} & set(table("expect", name)):
            table("expect", name).setdefault("tolerance", 0.01)
