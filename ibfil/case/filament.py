"""The tables of a filament in a case file: each key with its default and its meaning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, cast

from pydantic import Discriminator, Field

from .bodies.end import End
from .copies import Copies, copy_name
from .expressions import Expression
from .shape import AnyShape, Straight
from .table import ORIGIN, ZERO, Table, changed
from .values import (
    Formula,
    Listed,
    NotNegative,
    OfS,
    OfST,
    PairST,
    Positive,
    Range,
    Real,
    TripleS,
    TripleST,
    TripleSTXYZ,
    Vector,
    Whole,
    by_kind,
    tagged,
)


class AnyLaw(Table):
    """The base of the constitutive laws."""

    kind: str

    @property
    def linear(self) -> bool:
        """Whether moments are those of Eq. 9."""
        return self.kind == "linear"


class Linear(AnyLaw):
    """M = A (O - kappa), the paper's Eq. 4."""

    kind: Literal["linear"] = Field("linear", description="moment proportional to the strain's excess")


class Stiffening(AnyLaw):
    """A moment that grows faster than the strain."""

    kind: Literal["stiffening"] = Field(
        "stiffening", description="the linear moment times 1 + coefficient |excess strain|^exponent"
    )
    coefficient: Real = Field(description="size of the added term, length^exponent", examples=[1.0])
    exponent: Positive = Field(description="power of the excess strain in it", examples=[2.0])


class TwoWell(AnyLaw):
    """Two preferred twists with a barrier between them; the modulus ``twisting`` is then not used."""

    kind: Literal["two-well"] = Field(
        "two-well", description="two preferred twists instead of one; needs twisting, whose number is then not used"
    )
    wells: Range = Field(description="the two preferred values of Omega3 - twist_rate", examples=[[-1.0, 1.0]])
    barrier: Positive = Field(description="energy per length between the wells", examples=[1.0])
    gradient: NotNegative = Field(
        description="g in the energy g/2 (dOmega3/ds)^2 per length; a wall is (w2 - w1) sqrt(g/(8 barrier)) wide",
        examples=[0.1],
    )


Law = Annotated[
    Annotated[Linear, tagged("linear")]
    | Annotated[Stiffening, tagged("stiffening")]
    | Annotated[TwoWell, tagged("two-well")],
    by_kind("linear", "linear", "stiffening", "two-well"),
]


class Tether(Table):
    """Springs along the whole filament."""

    stiffness: NotNegative = Field(description="force per length per displacement", examples=[1.0])
    to: Annotated[
        Annotated[Literal["initial"], tagged("word")] | Annotated[TripleST, tagged("list")],
        Discriminator(lambda value: "<list>" if isinstance(value, list) else "<word>"),
    ] = Field("initial", description="the shape it pulls to")

    @property
    def places(self) -> tuple[Expression, Expression, Expression] | None:
        """The shape it pulls to, as expressions; None: that of the start."""
        return None if isinstance(self.to, str) else self.to


class Loads(Table):
    """Loads per length along the filament."""

    force: TripleSTXYZ | None = Field(None, description="force per length, lab frame")
    body_force: TripleST | None = Field(None, description="force per length along e1, e2, e3")
    moment: TripleST | None = Field(
        None, description="active moment per length along e1, e2, e3; enters e3 x m and Eq. 36"
    )
    internal_moment: PairST | None = Field(None, description="added to M1, M2 as -A kappa is (Sec. 7.2)")
    weight: Vector | None = Field(None, description="constant force per length, lab frame")
    tether: Tether | None = Field(None, description="springs per length to a shape")


class Filament(Table):
    """One elastic rod."""

    length: Positive = Field(description="rest length L", examples=[1.0])
    nodes: Annotated[int, Whole(low=5)] = Field(
        description="number of nodes, at least 8 with derivative 6 and 5 with 2", examples=[41]
    )
    spacing: Annotated[Expression | Literal["even"], Formula(("even",), ("q",))] = Field(
        "even", description="s/L of the nodes for q from 0 to 1, increasing"
    )
    derivative: Annotated[int, Whole(choices=(2, 6))] = Field(
        6, description="order of the stencils of r', r''; 2 by default where [thermal] stands"
    )
    force: Literal["eq44", "torque-free"] = Field("eq44", description="discrete force: Eq. 44 or torque-free")
    bending: Annotated[tuple[OfS, OfS], Listed(2, repeat=True)] = Field(
        description="bending moduli A, or [A1, A2], > 0", examples=[1.0]
    )
    twisting: OfS | None = Field(None, description="twist modulus C > 0; absent: no twist, planar scenes only")
    stretching: OfS = Field(description="axial stiffness EA > 0, a force (the paper's sigma0)", examples=[1e4])
    radius: OfS | None = Field(None, description="material radius > 0; required with twisting unless drag gives spin")
    damping: NotNegative = Field(
        0.0, description="internal damping, a time mu: moments mu A d(curvature)/dt, mu C d(twist)/dt beside the law's"
    )
    mass: OfS | None = Field(
        None, description="mass per length; navier-stokes: beyond that of the fluid displaced. Absent: no inertia"
    )
    rotary_inertia: OfS | None = Field(
        None, description="moment of inertia about the tangent, per length; absent: mass radius^2/2"
    )
    velocity: TripleS | None = Field(None, description="with mass: velocity at t = 0, lab frame; absent: at rest")
    law: Law = Field(Linear(), description="moment against strain")
    curvature: PairST = Field((ZERO, ZERO), description="preferred curvatures kappa1, kappa2")
    twist_rate: OfST = Field(ZERO, description="preferred twist tau0")
    position: Vector = Field(
        ORIGIN,
        description="where anchor stands; the box is centred on the origin; shapes expression and file stay where they "
        "are without it",
    )
    anchor: Literal["start", "middle", "centroid"] = Field("middle", description="the point put at position")
    direction: Vector = Field(
        (1.0, 0.0, 0.0),
        description="where align points; expression and file are turned only where direction or align is given",
    )
    align: Literal["auto", "axis", "tangent", "chord"] = Field(
        "auto",
        description="what points along direction; auto: axis for helix and relaxed, else tangent (e3(0))",
    )
    normal: Vector = Field(
        (0.0, 0.0, 1.0),
        description="e1 at s = 0, made normal to e3; [0, 1, 0] by default where direction is along z; of points that "
        "are not turned those of the file, or along z, or x, by default",
    )
    copies: Copies | None = Field(
        None, description="many of them, called NAME_000, NAME_001 ..., each with the bodies it is in"
    )
    shape: AnyShape = Field(Straight(), description="shape at t = 0")
    start: End = Field(End(), description="the end at s = 0")
    finish: End = Field(End(), description="the end at s = L")
    loads: Loads | None = Field(None, description="loads per length")
    closed: bool = Field(False, description="a ring: the last node is the first; the shape is scaled to length")
    linking: Annotated[int, Whole(low=-10000)] | None = Field(
        None, description="linking number of a closed filament that twists; absent: the one of least twist"
    )

    def of_copy(self, values: Mapping[str, float]) -> Filament:
        """The filament that one copy is, by its i and phase; itself where no formula uses them.

        Raises ExpressionError where a formula then has no finite value.
        """
        return cast(Filament, changed(self, lambda formula: formula.of_copy(**values)))

    @property
    def keeps_no_plane(self) -> bool:
        """Whether it is round and naturally straight: without twisting it then bends in any plane."""
        return self.bending[0] == self.bending[1] and all(kappa.constant == 0.0 for kappa in self.curvature)

    @property
    def moved(self) -> bool:
        """Whether the shape is moved to ``position``: points given in the lab frame only where it is asked."""
        return not self.shape.in_place or not {"position", "anchor"}.isdisjoint(self.model_fields_set)

    @property
    def turned(self) -> bool:
        """Whether the shape is turned to ``direction``: points given in the lab frame only where it is asked."""
        return not self.shape.in_place or not {"direction", "align"}.isdisjoint(self.model_fields_set)

    @property
    def own_normal(self) -> bool:
        """Whether e1 at s = 0 is the one that the shape's points come with."""
        return not self.turned and "normal" not in self.model_fields_set

    @property
    def aligned(self) -> str:
        """The direction of the shape that points along ``direction``: axis, tangent or chord."""
        if self.align != "auto":
            return self.align
        return "axis" if self.shape.has_axis else "tangent"


def single(filaments: Mapping[str, Filament], name: str) -> Filament | None:
    """The one filament that ``name`` means: one without copies, or a copy by its own name, NAME_003; else None."""
    whole = filaments.get(name)
    if whole is not None and whole.copies is None:
        return whole
    stem, _, digits = name.rpartition("_")
    many = filaments.get(stem)
    if many is None or many.copies is None or not (digits.isascii() and digits.isdigit()):
        return None
    number, count = int(digits), many.copies.count
    return many if copy_name(stem, number) == name and (count is None or number < count) else None
