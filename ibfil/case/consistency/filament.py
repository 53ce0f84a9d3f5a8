"""Inconsistencies within one filament of a case: its moduli, its place, its shape, its ends."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from ..bodies.end import End
from ..copies import Copies, copy_name
from ..expressions import COPIED, Expression, ExpressionError
from ..faults import Fault, shown
from ..filament import Filament, TwoWell, single
from ..schema import Scene
from ..shape import Circle, Helix, RunShape
from ..table import expressions
from .mass import check_mass
from .planar import check_planar
from .vectors import parallel


def check_filament(name: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """All faults of what does not go together in ``[filament.name]``."""
    key = f"filament.{name}"
    yield from _copied(key, filament, case)
    yield from check_one(key, filament, case)
    stem = name.rpartition("_")[0]
    if stem in case.filaments and single({stem: case.filaments[stem]}, name) is not None:
        yield Fault(key, f"the name of a copy of {stem}", f"another name; copies are called {copy_name(stem, 0)} ...")


def check_one(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """The faults within one filament, which may be one copy of many."""
    yield from _numbers(key, filament)
    yield from _moduli(key, filament)
    yield from check_mass(key, filament, case)
    yield from _law(f"{key}.law", filament)
    yield from _damping(key, filament, case)
    yield from _place(key, filament)
    yield from _shape(key, filament)
    yield from _end(f"{key}.start", filament.start)
    yield from _end(f"{key}.finish", filament.finish)
    if filament.twisting is None:
        yield from check_planar(key, filament, case)


def _damping(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """Schemes and noise that damping does not go with."""
    found = f"{filament.damping:g} with "
    if filament.damping and case.time.explicit:
        explicit = found + 'time.scheme = "explicit", which knows no rate within a step'
        yield Fault(f"{key}.damping", explicit, '"implicit" or "semi-implicit"', ("time.scheme",))
    if filament.damping and case.thermal is not None:
        yield Fault(f"{key}.damping", found + "[thermal], whose noise it would need as well", "0", ("thermal",))
    if filament.damping and filament.force == "torque-free":
        yield Fault(f"{key}.damping", found + 'force = "torque-free"', '0, or force = "eq44"', (f"{key}.force",))


def _numbers(key: str, filament: Filament) -> Iterator[Fault]:
    least = 8 if filament.derivative == 6 else 5
    if filament.nodes < least:
        allowed = f"at least {least} with derivative = {filament.derivative}"
        yield Fault(f"{key}.nodes", f"{filament.nodes}", allowed, (f"{key}.derivative", "thermal"))
    if isinstance(filament.spacing, Expression):
        yield from _spacing(f"{key}.spacing", filament.spacing, filament.nodes)


def _spacing(key: str, spacing: Expression, nodes: int) -> Iterator[Fault]:
    """The nodes must run from 0 to 1, each above the one before."""
    steps = min(nodes - 1, 1000)
    try:
        places = [spacing.at(q=i / steps) for i in range(steps + 1)]
    except ExpressionError as error:
        yield Fault(key, f"{shown(spacing.text)} ({error})", "a number for all q from 0 to 1")
        return
    if abs(places[0]) > 1e-9 or abs(places[-1] - 1.0) > 1e-9:
        yield Fault(key, f"{places[0]:.6g} at q = 0 and {places[-1]:.6g} at q = 1", "0 at q = 0 and 1 at q = 1")
    elif any(a >= b for a, b in pairwise(places)):
        yield Fault(key, shown(spacing.text), "an expression that increases with q")


def _moduli(key: str, filament: Filament) -> Iterator[Fault]:
    """Moduli, radius and mass are positive, and what shapes the rod at t = 0 has a value, all along."""
    reads = (f"{key}.length",)
    optional = ("twisting", "radius", "mass", "rotary_inertia")
    positive = {"stretching": filament.stretching} | {name: getattr(filament, name) for name in optional}
    one = filament.bending[0] == filament.bending[1]
    positive |= {"bending": filament.bending[0]} if one else dict(_numbered("bending", filament.bending))
    for name, expression in positive.items():
        found = _least(expression, filament.length) if expression else None
        if isinstance(found, str) or (found is not None and found[0] <= 0.0):
            what = found if isinstance(found, str) else f"{found[0]:.6g}{found[1]}"
            yield Fault(f"{key}.{name}", what, "> 0 along the whole filament", reads)
    finite = {"twist_rate": filament.twist_rate, "shape.twist": filament.shape.twist}
    finite |= _numbered("curvature", filament.curvature) | _numbered("shape.perturb", filament.shape.perturb)
    finite |= _numbered("velocity", filament.velocity or ())
    for name, expression in finite.items():
        found = _least(expression, filament.length)
        if isinstance(found, str):
            yield Fault(f"{key}.{name}", found, "a number along the whole filament", reads)


def _law(key: str, filament: Filament) -> Iterator[Fault]:
    """Two wells are of the twist, and two."""
    if not isinstance(filament.law, TwoWell):
        return
    if filament.twisting is None:
        yield Fault(f"{key}.kind", '"two-well" and no twisting', "two preferred twists only with twisting")
    if not filament.law.wells[0] < filament.law.wells[1]:
        yield Fault(f"{key}.wells", shown(filament.law.wells), "[w1, w2] with w1 < w2")


def _numbered(name: str, expressions: Sequence[Expression]) -> dict[str, Expression]:
    return {f"{name}.{i}": expression for i, expression in enumerate(expressions)}


def _least(expression: Expression, length: float) -> tuple[float, str] | str:
    """The least value at t = 0 along the rod with ' at s = ...' if it varies, or what is wrong at some s."""
    if expression.constant is not None:
        return expression.constant, ""
    least = (math.inf, "")
    for i in range(65):
        s = length * i / 64
        try:
            least = min(least, (expression.at(s=s, t=0.0), f" at s = {s:.6g}"))
        except ExpressionError as error:
            return f"{shown(expression.text)} ({error} at s = {s:.6g})"
    return least


def _place(key: str, filament: Filament) -> Iterator[Fault]:
    for name in ("direction", "normal"):
        if not any(getattr(filament, name)):
            yield Fault(f"{key}.{name}", shown(getattr(filament, name)), "a vector that is not zero")
            return
    if filament.turned and parallel(filament.direction, filament.normal):
        found = f"{shown(filament.normal)}, parallel to direction"
        yield Fault(f"{key}.normal", found, "a vector at an angle to direction", (f"{key}.direction",))
    copies = filament.copies
    if copies is not None:
        if (copies.count is None) == (copies.file is None):
            found = "neither count nor file" if copies.file is None else "count and file"
            yield Fault(f"{key}.copies", found, "{count, region}, {count, at} or {file}")
        elif copies.count is not None and (copies.region is None) == (copies.at is None):
            found = "nothing" if copies.region is None else "region and at"
            yield Fault(f"{key}.copies.region", found, "two corners, with count, or at")
        elif copies.file is not None and not copies.model_fields_set <= _with_file(copies):
            allowed = "file alone or with orientation, phase, apart, or {count, region}"
            yield Fault(f"{key}.copies", "file and other keys", allowed)
    if copies is not None and isinstance(filament.shape, RunShape):
        yield Fault(f"{key}.copies", 'copies with shape.kind = "run"', "a filament for each, or another kind of shape")
    if copies is not None and copies.region is not None:
        low, high = copies.region
        if any(a > b for a, b in zip(low, high, strict=True)):
            yield Fault(f"{key}.copies.region", shown(copies.region), "the lower corner first")


def _copied(key: str, filament: Filament, case: Scene) -> Iterator[Fault]:
    """i and phase stand where there are copies, and mean these; phases are of what moves, not of what a rod is."""
    copies = filament.copies
    for path, formula in expressions(filament):
        used = formula.variables & set(COPIED)
        if path.startswith("copies.") or not used:
            continue
        if copies is None:
            yield Fault(f"{key}.{path}", f"{' and '.join(sorted(used))}, and no copies", f"them with {key}.copies")
        elif "phase" in used and copies.phase is None:
            yield Fault(f"{key}.{path}", f"phase, and no {key}.copies.phase", f"{key}.copies.phase beside it")
        elif "phase" in used and path.partition(".")[0] in _MATERIAL:
            yield Fault(f"{key}.{path}", "phase", "s, i and parameters: the rod is the same at every phase")
    if copies is None:
        return
    named = [name for name, key_of in (("i", copies.at), ("i", copies.phase), ("phase", copies.phase)) if key_of]
    for name in dict.fromkeys(named):
        if name in case.parameters:
            yield Fault(f"parameters.{name}", f"a parameter named like the {name} of {key}.copies", "another name")
    if copies.apart is not None and any(key.rpartition(".")[2] in link.names for link in case.links.values()):
        yield Fault(f"{key}.copies.apart", "a least distance with links", "none where filaments are linked")


def _with_file(copies: Copies) -> set[str]:
    """The keys that go with places from a file: a seed where something is random."""
    random = copies.phases_drawn or not copies.turned_alike
    return {"file", "orientation", "phase", "apart"} | ({"seed"} if random else set())


_MATERIAL = ("bending", "twisting", "stretching", "radius", "mass", "rotary_inertia")


def _shape(key: str, filament: Filament) -> Iterator[Fault]:
    shape = filament.shape
    if isinstance(shape, Helix):
        given = {k for k in ("radius", "pitch", "curvature", "torsion") if getattr(shape, k) is not None}
        if given not in ({"radius", "pitch"}, {"curvature", "torsion"}):
            reads = tuple(f"{key}.shape.{k}" for k in ("radius", "pitch", "curvature", "torsion"))
            found = "a helix with " + (" and ".join(sorted(given)) or "nothing")
            yield Fault(f"{key}.shape", found, "radius and pitch, or curvature and torsion", reads)
    if isinstance(shape, Circle) and abs(shape.curvature) * filament.length > 2.0 * math.pi * (1.0 + 1e-9):
        most = 2.0 * math.pi / filament.length
        found = f"{shape.curvature:.6g}, more than one turn"
        yield Fault(f"{key}.shape.curvature", found, f"at most 2 pi/length = {most:.6g}", (f"{key}.length",))


def _turns(end: End) -> bool:
    """Whether the moment on an end is a torque along the rod alone, which may turn there."""
    assert end.moment is not None
    return end.twist == "free" and end.body_frame and all(part.constant == 0.0 for part in end.moment[:2])


def _end(key: str, end: End) -> Iterator[Fault]:
    """Free ends feel forces, held ones are moved; only a clamp knows a tangent and a twist."""
    reads = (f"{key}.end",)

    def only(name: str, where: str, fits: bool) -> Iterator[Fault]:
        if getattr(end, name) is not None and not fits:
            yield Fault(f"{key}.{name}", f'{name} with end = "{end.end}"', f"only at a {where} end", reads)

    clamped = end.end == "clamped"
    for name in ("spin", "angle", "tangent"):
        yield from only(name, "clamped", clamped)
    yield from only("moves", "hinged or clamped", end.held)
    for name in ("force", "follower", "spring"):
        yield from only(name, "free", not end.held)
    if end.moment is not None and clamped and not _turns(end):
        allowed = (
            'at a free or hinged end; at a clamped one [0, 0, m], a torque, with twist = "free" and frame = "body"'
        )
        found = 'moment with end = "clamped", which holds the tangent'
        yield Fault(f"{key}.moment", found, allowed, (*reads, f"{key}.twist", f"{key}.frame"))
    if end.twist == "held" and not clamped:
        yield Fault(f"{key}.twist", f'"held" with end = "{end.end}"', '"held" only at a clamped end', reads)
    turned = [name for name in ("spin", "angle") if getattr(end, name) is not None]
    if len(turned) == 2:
        yield Fault(f"{key}.angle", "spin and angle", "one of them", (f"{key}.spin",))
    elif turned and clamped and end.twist == "free":
        yield Fault(
            f"{key}.{turned[0]}",
            f'{turned[0]} with twist = "free"',
            'only with twist = "held"',
            (f"{key}.twist",),
        )
    if end.frame == "body" and end.moment is None:
        yield Fault(f"{key}.frame", '"body" and no moment', "only with moment", (f"{key}.moment",))
    if end.tangent is not None and not any(end.tangent):
        yield Fault(f"{key}.tangent", shown(end.tangent), "a vector that is not zero")
