"""Keys that do not go together are refused, with the key at fault; and what is near them and sound is not."""

from __future__ import annotations

import pytest
import tomli_w
from helpers.schema_keys import SCENE, fault_lines

from ibfil.case.reading import parse_case

ROD = "filament.rod"
TWISTED = [f"{ROD}.twisting=1", f"{ROD}.radius=0.01"]
STOKES = ["fluid.model=stokes", "fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 40]"]
NAVIER = ["fluid.model=navier-stokes", "fluid.density=1", *STOKES[1:]]
FREE = ["fluid.model=stokes", "fluid.box=free", "fluid.spacing=0.1"]
WALL = [*FREE, "fluid.wall=no-slip"]
SPEED = ["observe.v.kind=speed"]
THERMAL = ["thermal.energy=1"]
EXPECT = [*SPEED, "expect.e.observe=v"]

MIDDLE, LAB = "{filament='rod'}", "{point=[0, 0, 0]}"
TWO = "filament.two={length=1, nodes=9, bending=1, stretching=1, position=[0, 1, 0]}"
BOUND = [TWO, "link.k={kind='bind', filaments=['rod', 'two'], normal=1}"]


def sprung(one: str, other: str) -> list[str]:
    """A spring between two places."""
    return [f"link.k={{stiffness=1, between=[{one}, {other}]}}"]


CLOSED = [f"{ROD}.closed=true", f"{ROD}.shape={{kind='circle', curvature='2*pi'}}"]
SPRUNG = sprung(MIDDLE, LAB)

# Overrides of a sound case, the key that is then at fault, and words of the sentence.
COMBINATIONS = [
    # the rod
    ([f"{ROD}.nodes=7"], f"{ROD}.nodes", "at least 8 with derivative = 6"),
    ([f"{ROD}.bending=0"], f"{ROD}.bending", "> 0"),
    ([f"{ROD}.bending=[1, -1]"], f"{ROD}.bending.1", "> 0"),
    ([f"{ROD}.bending=1 - s"], f"{ROD}.bending", "0 at s = 1"),
    ([f"{ROD}.stretching=s - 0.5"], f"{ROD}.stretching", "-0.5 at s = 0"),
    ([f"{ROD}.twisting=0", f"{ROD}.radius=1"], f"{ROD}.twisting", "> 0"),
    ([f"{ROD}.radius=-0.1"], f"{ROD}.radius", "> 0"),
    ([f"{ROD}.radius=sqrt(0.5 - s)"], f"{ROD}.radius", "sqrt(-"),
    ([f"{ROD}.curvature=['1/s', 0]"], f"{ROD}.curvature.0", "at s = 0"),
    ([f"{ROD}.shape.perturb=[0, 'log(s)', 0]"], f"{ROD}.shape.perturb.1", "at s = 0"),
    ([f"{ROD}.spacing=q + 0.1"], f"{ROD}.spacing", "0 at q = 0"),
    ([f"{ROD}.spacing=q + sin(2*pi*q)"], f"{ROD}.spacing", "increases"),
    ([f"{ROD}.spacing=1/q"], f"{ROD}.spacing", "no finite value"),
    ([f"{ROD}.direction=[0, 0, 0]"], f"{ROD}.direction", "not zero"),
    ([f"{ROD}.normal=[0, 0, 0]"], f"{ROD}.normal", "not zero"),
    ([f"{ROD}.direction=[0, 0, -2]", f"{ROD}.normal=[0, 0, 1]"], f"{ROD}.normal", "parallel to direction"),
    ([f"{ROD}.direction=[1, 1, 1]", f"{ROD}.normal=[-3, -3, -3]"], f"{ROD}.normal", "parallel"),
    ([f"{ROD}.copies.seed=1"], f"{ROD}.copies", "neither count nor file"),
    ([f"{ROD}.copies={{count=1, file='a'}}"], f"{ROD}.copies", "count and file"),
    ([f"{ROD}.copies.count=1"], f"{ROD}.copies.region", "two corners"),
    ([f"{ROD}.copies={{file='a', seed=2}}"], f"{ROD}.copies", "file alone"),
    ([f"{ROD}.copies={{count=1, region=[[0, 1, 0], [1, 0, 1]]}}"], f"{ROD}.copies.region", "lower corner"),
    ([f"{ROD}.mass=s - 0.5"], f"{ROD}.mass", "-0.5 at s = 0"),
    ([f"{ROD}.velocity=[0, 0, 1]"], f"{ROD}.velocity", "only with mass"),
    ([f"{ROD}.rotary_inertia=1"], f"{ROD}.rotary_inertia", "only with mass"),
    ([f"{ROD}.mass=1", f"{ROD}.rotary_inertia=1"], f"{ROD}.rotary_inertia", "only with twisting"),
    ([f"{ROD}.mass=1", f"{ROD}.velocity=['1/s', 0, 0]"], f"{ROD}.velocity.0", "at s = 0"),
    ([f"{ROD}.mass=1", f"{ROD}.curvature=[1, 0]", f"{ROD}.velocity=[0, 0, 's']"], f"{ROD}.velocity", "plane"),
    ([f"{ROD}.mass=1", *THERMAL], f"{ROD}.mass", "no mass with [thermal]"),
    ([f"{ROD}.mass=1", "time.scheme=explicit"], f"{ROD}.mass", '"implicit" or "semi-implicit"'),
    # its shape
    ([f"{ROD}.shape.kind=helix"], f"{ROD}.shape", "radius and pitch"),
    ([f"{ROD}.shape={{kind='helix', radius=1, torsion=1}}"], f"{ROD}.shape", "radius and torsion"),
    ([f"{ROD}.shape={{kind='circle', curvature=6.3}}"], f"{ROD}.shape.curvature", "more than one turn"),
    ([f"{ROD}.shape={{kind='circle', radius=1}}"], f"{ROD}.shape.radius", "belongs to another kind"),
    # its ends
    ([f"{ROD}.start.twist=held"], f"{ROD}.start.twist", "clamped"),
    ([f"{ROD}.start.tangent=[1, 0, 0]"], f"{ROD}.start.tangent", "only at a clamped end"),
    ([f"{ROD}.start={{end='clamped', tangent=[0, 0, 0]}}"], f"{ROD}.start.tangent", "not zero"),
    ([f"{ROD}.start.moves=[0, 0, 0]"], f"{ROD}.start.moves", "only at a hinged or clamped end"),
    ([f"{ROD}.start={{end='hinged', force=[1, 0, 0]}}"], f"{ROD}.start.force", "only at a free end"),
    ([f"{ROD}.finish={{end='clamped', follower=1}}"], f"{ROD}.finish.follower", "only at a free end"),
    ([f"{ROD}.finish={{end='hinged', spring={{stiffness=1}}}}"], f"{ROD}.finish.spring", "only at a free"),
    (
        [f"{ROD}.finish={{end='clamped', moment=[0, 0, 1]}}"],
        f"{ROD}.finish.moment",
        "at a free or hinged end; at a clamped one",
    ),
    ([f"{ROD}.finish.frame=body"], f"{ROD}.finish.frame", "only with moment"),
    ([*TWISTED, f"{ROD}.start.spin=1"], f"{ROD}.start.spin", "only at a clamped end"),
    ([*TWISTED, f"{ROD}.start={{end='clamped', spin=1, angle=1}}"], f"{ROD}.start.angle", "one of them"),
    ([*TWISTED, f"{ROD}.start={{end='clamped', spin=1, twist='free'}}"], f"{ROD}.start.spin", "held"),
    # without twisting
    ([f"{ROD}.start={{end='clamped', spin=1}}"], f"{ROD}.start.spin", "only with twisting"),
    ([f"{ROD}.start={{end='clamped', angle=0}}"], f"{ROD}.start.angle", "only with twisting"),
    ([f"{ROD}.start={{end='clamped', twist='free'}}"], f"{ROD}.start.twist", "only with twisting"),
    ([f"{ROD}.twist_rate=1"], f"{ROD}.twist_rate", "only with twisting"),
    ([f"{ROD}.twist_rate=0*s"], f"{ROD}.twist_rate", "only with twisting"),
    ([f"{ROD}.shape.twist=s"], f"{ROD}.shape.twist", "only with twisting"),
    ([f"{ROD}.finish.moment=[5, 0, 0]"], f"{ROD}.finish.moment", "only with twisting"),
    ([f"{ROD}.finish={{moment=[0, 0, 't'], frame='body'}}"], f"{ROD}.finish.moment", "only with twisting"),
    ([f"{ROD}.finish.moment=[0, 1, 0]", f"{ROD}.direction=[1, 1, 0]"], f"{ROD}.finish.moment", "only with twisting"),
    (
        [f"{ROD}.finish.moment=[0, 1, 0]", f"{ROD}.shape={{kind='circle', curvature=1}}"],
        f"{ROD}.finish.moment",
        "only with twisting",
    ),
    ([f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, 'x']"], "fluid.flow", "plane"),
    (
        [f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, 1]", f"{ROD}.start.end=hinged"],
        "fluid.flow",
        "plane",
    ),
    ([f"{ROD}.loads.moment=[0, 0, 's']"], f"{ROD}.loads.moment.2", "only with twisting"),
    ([f"{ROD}.curvature=[1, 't']"], f"{ROD}.curvature", "3-D curvature only with twisting"),
    # without twisting, out of the plane
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.shape.perturb=[0, 0, 's']"], f"{ROD}.shape.perturb", "plane"),
    ([f"{ROD}.curvature=[0, 1]", f"{ROD}.shape.perturb=[0, 's', 0]"], f"{ROD}.shape.perturb", "plane"),
    ([f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, 'x']"], "fluid.flow", "plane"),
    ([f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, '1 - z']"], "fluid.flow", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.force=[0, 0, 't']"], f"{ROD}.finish.force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.moment=[0, 1, 0]"], f"{ROD}.finish.moment", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.finish={{moment=[0, 1, 0], frame='body'}}"], f"{ROD}.finish.moment", "plane"),
    (
        [f"{ROD}.curvature=[1, 0]", f"{ROD}.finish.spring={{stiffness=1, to=[0, 0, 1]}}"],
        f"{ROD}.finish.spring.to",
        "plane",
    ),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.weight=[0, 0, 1]"], f"{ROD}.loads.weight", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.force=['x', 'y', 's*t']"], f"{ROD}.loads.force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.body_force=[1, 0, 0]"], f"{ROD}.loads.body_force", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.loads.internal_moment=[0, 1]"], f"{ROD}.loads.internal_moment", "plane"),
    ([f"{ROD}.curvature=[1, 0]", f"{ROD}.shape={{kind='helix', radius=1, pitch=1}}"], f"{ROD}.shape.kind", "plane"),
    ([f"{ROD}.curvature=[0, 1]", f"{ROD}.shape={{kind='circle', curvature=1}}"], f"{ROD}.shape.kind", "plane"),
    ([f"{ROD}.curvature=[1, 0]", *THERMAL], "thermal.directions", "plane"),
    ([f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[0, 1, 1]"], f"{ROD}.loads.weight", "A1 != A2"),
    ([f"{ROD}.bending=[1, 2]", "fluid.flow=[0, 'z', 'y']"], "fluid.flow", "A1 != A2"),
    ([f"{ROD}.bending=[1, 2]", *THERMAL], "thermal.directions", "A1 != A2"),
    # internal damping
    ([f"{ROD}.damping=1", "time.scheme=explicit"], f"{ROD}.damping", "no rate within a step"),
    ([f"{ROD}.damping=1", *THERMAL], f"{ROD}.damping", "noise it would need"),
    ([f"{ROD}.damping=1", f"{ROD}.force=torque-free"], f"{ROD}.damping", "eq44"),
    # closed filaments
    ([f"{ROD}.linking=1"], f"{ROD}.linking", "without closed = true"),
    ([*CLOSED, f"{ROD}.linking=1"], f"{ROD}.linking", "1 without twisting"),
    (
        [*CLOSED, *TWISTED, f"{ROD}.linking=1", f"{ROD}.shape={{kind='run', path='r.h5'}}"],
        f"{ROD}.linking",
        "of the run",
    ),
    ([*CLOSED, f"{ROD}.start.end=clamped"], f"{ROD}.start", "it has no ends"),
    ([*CLOSED, f"{ROD}.finish.force=[1, 0, 0]"], f"{ROD}.finish", "it has no ends"),
    ([*CLOSED, f"{ROD}.nodes=9"], f"{ROD}.nodes", "at least 10 with closed = true"),
    ([*CLOSED, f"{ROD}.derivative=2", f"{ROD}.nodes=6"], f"{ROD}.nodes", "at least 7 with closed = true"),
    ([*CLOSED, f"{ROD}.spacing=q**2"], f"{ROD}.spacing", '"even" with closed'),
    ([*CLOSED, f"{ROD}.force=torque-free"], f"{ROD}.force", '"eq44"'),
    ([*CLOSED, f"{ROD}.mass=1"], f"{ROD}.mass", "no inertia of closed"),
    ([*CLOSED, f"{ROD}.shape.noise.amplitude=0.1"], f"{ROD}.shape.noise", "shape.perturb"),
    (
        [*CLOSED, *TWISTED, f"{ROD}.law={{kind='two-well', wells=[0, 1], barrier=1, gradient=1}}"],
        f"{ROD}.law.gradient",
        "0",
    ),
    ([*CLOSED, f"{ROD}.radius=0.1", "fluid.thick=true", "fluid.flow=['y', 0, 0]"], f"{ROD}.closed", "axis only"),
    # links
    (sprung("{}", LAB), "link.k.between.0", "{ filament, at }, or { point }"),
    (sprung("{filament='rod', point=[0, 0, 0]}", MIDDLE), "link.k.between.0", "a filament and a point"),
    (sprung("{point=[1, 0, 0]}", LAB), "link.k.between", "two points"),
    (sprung(MIDDLE, "{filament='rod', at='middle'}"), "link.k.between", "two different places"),
    (sprung("{filament='rod', at=1.1}", LAB), "link.k.between.0.at", "0 to length = 1"),
    (sprung(MIDDLE, "{at=1, point=[0, 0, 0]}"), "link.k.between.1.at", "with filament only"),
    (sprung("{filament='rot'}", LAB), "link.k.between.0.filament", 'did you mean "rod"'),
    ([*sprung(MIDDLE, LAB), "link.k.kind=hinge"], "link.k.between.1.point", 'kind = "spring" only'),
    ([*BOUND, "link.k.filaments=['rod', 'rod']"], "link.k.filaments", "two different filaments"),
    ([*BOUND, "link.k.filaments=['rod', 'odd']"], "link.k.filaments.1", "one of rod, two"),
    ([*BOUND, "link.k.range=[0.5, 1.5]"], "link.k.range", "s2 <= length = 1"),
    ([*BOUND, "link.k.range=[0.5, 0.2]"], "link.k.range", "s1 < s2"),
    ([*BOUND, "link.k.offset=-1.5"], "link.k.offset", "lies beside none"),
    ([*BOUND, "link.k.range=[0.6, 1]", "link.k.offset=0.5"], "link.k.offset", "between -1 and 0.4"),
    ([*BOUND, "link.k.motor={friction=1, lag=0}"], "link.k.motor.lag", "> 0 where friction is"),
    ([*BOUND, "link.k.motor={friction=1, lag=1}", "time.scheme=explicit"], "link.k.motor", "no rate within a step"),
    ([*BOUND, "link.k.motor={friction=1, lag=1}", *THERMAL], "link.k.motor", "noise it would need"),
    ([*SPRUNG, "link.k.damping=1", "time.scheme=explicit"], "link.k.damping", '"implicit" or "semi-implicit"'),
    ([*SPRUNG, "link.k.damping=1", *THERMAL], "link.k.damping", "no damping"),
    ([*BOUND, f"{ROD}.copies={{count=2, region=[[0, 0, 0], [1, 1, 1]]}}"], "link.k", '"rod_000" being the first'),
    ([*SPRUNG, "observe.v={kind='link_tension', link='q'}"], "observe.v.link", "allowed: k"),
    ([*SPRUNG, "observe.v={kind='link_tension'}"], "observe.v.link", "found nothing"),
    ([*SPRUNG, "observe.v={kind='speed', link='k'}"], "observe.v.link", "only with kinds that look at a link"),
    # contact
    (["contact.action=stop"], "contact.distance", "a distance, or a radius"),
    (["contact={distance=1, strength=1}"], "contact.strength", "only with action"),
    # the fluid
    (["fluid.model=stokes"], "fluid.box", "this fluid has a grid"),
    (["fluid.model=stokes", "fluid.box=[4, 4, 4]"], "fluid.cells", "cells or thickness"),
    (["fluid.drag={matched=1}"], "fluid.box", "grid"),
    ([*STOKES, "fluid.thickness=0.1"], "fluid.thickness", "one of them"),
    ([*STOKES, "fluid.cells=[40, 40, 41]"], "fluid.cells", "cells = [40, 40, 40]"),
    ([*STOKES, "fluid.box=[4, 2, 6]"], "fluid.cells", "cells = [34, 17, 51]"),
    ([*STOKES, "fluid.box=[3.2, 4.8, 1.6]", "fluid.cells=[64, 64, 64]"], "fluid.cells", "cells = [54, 81, 27]"),
    ([*STOKES, "fluid.box=[4, 4, 'sqrt(13)']"], "fluid.cells", "box = [4.0, 4.0, 4.0]"),
    (["fluid.box=[4, 4, 4]", "fluid.cells=[40, 40, 41]"], "fluid.cells", "one h on all axes"),
    ([*STOKES, "fluid.cells=[3, 3, 3]"], "fluid.cells", "width of peskin4"),
    ([*STOKES, "fluid.cells=[5, 5, 5]", "fluid.kernel=bkp6"], "fluid.cells", "at least 6"),
    ([*STOKES, "fluid.spacing=0.1"], "fluid.spacing", 'only with box = "free"'),
    ([*FREE, "fluid.cells=[8, 8, 8]"], "fluid.cells", "thickness or spacing there"),
    ([*FREE, "fluid.thickness=0.1"], "fluid.thickness", "one of them"),
    (FREE[:2], "fluid.spacing", "thickness or spacing"),
    ([*FREE, "fluid.method=pruned"], "fluid.method", 'allowed: "auto", "table", "fft" or "krylov"'),
    ([*FREE, "fluid.model=navier-stokes", "fluid.density=1"], "fluid.box", '"free" needs stokes'),
    ([*FREE, "output.grid_every=1"], "output.window", "three lengths"),
    ([*FREE, "output.window=[1, 1, 1]"], "output.window", "grid_every"),
    ([*FREE, "output.grid_every=1", "output.window_at=[1, 1, 1]"], "output.window_at", "only with window"),
    ([*FREE, "output.grid_every=1", "output.window=[1e4, 1e4, 1e4]"], "output.window", "GiB"),
    ([*STOKES, "fluid.wall=no-slip"], "fluid.wall", 'only with box = "free"'),
    ([*WALL, "fluid.method=pruned"], "fluid.method", 'allowed: "auto", "table", "fft" or "krylov"'),
    ([*WALL, *TWISTED, "fluid.rotation=grid"], "fluid.rotation", 'torques have no image; allowed: "local"'),
    ([*WALL, "output.grid_every=1", "output.window=[1, 1, 1]", "output.fields=['pressure']"], "output.fields", "veloc"),
    ([*WALL, "output.probes=[[0, 0, -1]]"], "output.probes.0", "below the wall; allowed: z >= 0"),
    (
        [*WALL, "output.grid_every=1", "output.window=[1, 1, 2]", "output.window_at=[0, 0, 0.9]"],
        "output.window_at",
        "z of at least 1",
    ),
    ([*FREE, "observe.q.kind=flux"], "observe.q.kind", 'only with fluid.wall = "no-slip"'),
    ([*WALL, "fluid.wall=free-slip", "observe.q.kind=flux"], "observe.q.kind", 'only with fluid.wall = "no-slip"'),
    ([*STOKES, "output.grid_every=1", "output.window=[1, 1, 1]"], "output.window", 'only with box = "free"'),
    (["fluid.drag.matched=0.5", "fluid.box=free"], "fluid.spacing", "thickness or spacing"),
    ([*STOKES, "fluid.model=navier-stokes"], "fluid.density", "navier-stokes"),
    ([*NAVIER, "fluid.flow=['y', 0, 0]"], "fluid.flow", "box-periodic"),
    ([*NAVIER, "fluid.flow=['sin(2*pi*y/3)', 0, 0]"], "fluid.flow", "box-periodic"),
    ([*STOKES, "fluid.rotation=local"], "fluid.rotation", "has twisting"),
    ([*STOKES, "fluid.rotation=grid"], "fluid.rotation", "has twisting"),
    (["fluid.drag=slender"], f"{ROD}.radius", "slender"),
    ([f"{ROD}.radius=0.26"], f"{ROD}.radius", 'below L/4 = 0.25 with drag = "cylinder" (the default)'),
    (["fluid.drag=cylinder"], f"{ROD}.radius", "cylinder"),
    (["fluid.drag=slender", f"{ROD}.radius=0.31"], f"{ROD}.radius", "below L/(2 sqrt(e)) = 0.303265"),
    ([f"{ROD}.twisting=1"], f"{ROD}.radius", "with twisting"),
    ([f"{ROD}.twisting=1", "fluid.drag={perp=2, par=1}"], f"{ROD}.radius", "with twisting"),
    # noise and time
    (["fluid.thick=true"], f"{ROD}.radius", "with fluid.thick, a radius"),
    (["fluid.thick={aspect=1}"], "fluid.thick.aspect", "> 1"),
    ([*STOKES, "fluid.thick={aspect=9}"], "fluid.thick.aspect", "only with rft"),
    ([*THERMAL, "fluid.thick={aspect=9}"], "fluid.thick", "false with [thermal]"),
    ([*THERMAL, *FREE, "fluid.method=krylov"], "fluid.method", '"auto", "table" or "fft"'),
    ([*THERMAL, *NAVIER], "thermal", 'fluid.model = "stokes" or "rft"'),
    ([*THERMAL, *STOKES, "fluid.slip=0"], "fluid.slip", "have no root"),
    ([*THERMAL, *STOKES, *TWISTED, "fluid.rotation=grid", "thermal.twist=false"], "thermal.twist", "vorticity"),
    ([*THERMAL, "thermal.twist=true"], "thermal.twist", "no filament has twisting"),
    ([*THERMAL, "time.scheme=implicit"], "time.scheme", "semi-implicit"),
    ([*THERMAL, "time.scheme=explicit"], "time.scheme", "semi-implicit"),
    ([*THERMAL, "time.order=2"], "time.order", "implicit"),
    (["time.scheme=explicit", "time.order=2"], "time.order", "implicit"),
    (["time.scheme=semi-implicit", "time.order=2"], "time.order", "implicit"),
    (["time.step=1e-14"], "time.step", "1e-12 of time.end"),
    (["time.step=1e-6", "time.min_step=1e-5"], "time.step", "min_step"),
    (["time.scheme=explicit", "time.solver_error=0.01"], "time.solver_error", "implicit steps of order 2"),
    (["time.order=1", "time.solver_error=0.01"], "time.solver_error", "implicit steps of order 2"),
    ([*THERMAL, "time.solver_error=0.01"], "time.solver_error", "implicit steps of order 2"),
    (["time.solver_error=0.2"], "time.solver_error", "at most 0.1"),
    # output
    (["output={}"], "output.every", "a list of times"),
    (["output.times=[0, 1]"], "output.every", "every and times"),
    (["output={times=[]}"], "output.times", "at least one"),
    (["output={times=[0, 0.5, 0.5]}"], "output.times", "above the one before"),
    (["output={times=[0, 2]}"], "output.times", "time.end = 1"),
    ([*STOKES, "output.fields=['velocity']"], "output.fields", "grid_every"),
    ([*STOKES, "output.grid_stride=2"], "output.grid_stride", "grid_every"),
    # what is looked at
    ([*SPEED, "observe.v.filament=rd"], "observe.v.filament", 'did you mean "rod"?'),
    ([*SPEED, "observe.v.at=1.5"], "observe.v.at", "at most length = 1"),
    ([*SPEED, "observe.v.at=[0.5, 1.5]"], "observe.v.at", "at most length = 1"),
    ([*SPEED, "observe.v.over=[1, 0]"], "observe.v.over", "t1 < t2"),
    ([*SPEED, "observe.v.over=[-1, 1]"], "observe.v.over", "0 <= t1"),
    ([*SPEED, "observe.v.along=[0, 0, 0]"], "observe.v.along", "not zero"),
    ([*SPEED, "observe.v.interval=1"], "observe.v.interval", "diffusion"),
    (["observe.v.kind=diffusion_ratio"], "observe.v.interval", "> 0 with diffusion"),
    ([*EXPECT, "expect.e.observe=w", "expect.e.value=1"], "expect.e.observe", "v"),
    (EXPECT, "expect.e.value", "a value, or a range"),
    ([*EXPECT, "expect.e.value=1", "expect.e.range=[0, 1]"], "expect.e.value", "value and range"),
    ([*EXPECT, "expect.e.range=[1, 0]"], "expect.e.range", "lo < hi"),
    ([*EXPECT, "expect.e.range=[0, 1]", "expect.e.tolerance=1"], "expect.e.tolerance", "only with value"),
    ([*EXPECT, "expect.e.value=1", "expect.e.tolerance=1", "expect.e.absolute=1"], "expect.e.tolerance", "one of"),
    ([*EXPECT, "expect.e.value=0"], "expect.e.tolerance", "absolute"),
    ([*EXPECT, "expect.e.value=1", "observe.v.kind=position"], "expect.e.observe", "three numbers"),
    ([*EXPECT, "expect.e.value=1", f"{ROD}.copies.file=a"], "observe.v.filament", "copies"),
]


@pytest.mark.parametrize(
    ("overrides", "key", "words"), COMBINATIONS, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_what_does_not_go_together(overrides, key, words):
    lines = fault_lines(SCENE, *overrides)
    told = [line for line in lines if line.startswith(f"bad.toml: {key}: found ")]
    assert told, lines
    assert any(words in line for line in told), told
    assert all("; allowed: " in line for line in lines)


@pytest.mark.parametrize(
    ("stop", "key", "words"),
    [
        ({"observe": "v"}, "stop.0", "one of below, above, steady"),
        ({"observe": "v", "below": 1, "above": 2}, "stop.0", "below and above"),
        ({"observe": "w", "below": 1}, "stop.0.observe", "v, p"),
        ({"observe": "p", "below": 1}, "stop.0.observe", "observe.p.along"),
    ],
)
def test_stops_that_cannot_be(stop, key, words):
    scene = {**SCENE, "stop": [stop], "observe": {"v": {"kind": "speed"}, "p": {"kind": "position"}}}
    (line,) = fault_lines(scene)
    assert line.startswith(f"bad.toml: {key}: found ")
    assert words in line


def test_with_several_filaments_an_observable_says_which():
    scene = {**SCENE, "filament": dict.fromkeys(("a", "b"), SCENE["filament"]["rod"])}
    (line,) = fault_lines(scene, *SPEED)
    assert line.startswith("bad.toml: observe.v.filament: found nothing; allowed: one of a, b")


# Near the combinations above, and sound.
SOUND = [
    [f"{ROD}.nodes=5", f"{ROD}.derivative=2"],
    [f"{ROD}.bending=1.001 - s"],
    [f"{ROD}.spacing=q**2"],
    [f"{ROD}.shape={{kind='circle', curvature='-2*pi'}}"],
    [*TWISTED, f"{ROD}.start={{end='clamped', spin='sin(t)'}}", f"{ROD}.curvature=[1, 1]", f"{ROD}.twist_rate=1"],
    [f"{ROD}.twist_rate=0.0", f"{ROD}.start={{end='clamped', twist='held'}}"],
    [f"{ROD}.curvature=['sin(s - t)', 0]", f"{ROD}.shape.perturb=['s', 's**2', 0]"],
    [f"{ROD}.curvature=[0, 1]", f"{ROD}.shape.perturb=['s', 0, 's']", "fluid.flow=['z', 0, 'x*t']"],
    [f"{ROD}.curvature=[1, 0]", "fluid.flow=['-x', '3*y', '-2*z']", f"{ROD}.shape={{kind='circle', curvature=1}}"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.position=[0, 0, 1]", "fluid.flow=[1, 0, '1 - z']"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.finish={{moment=[0, 0, 1], force=[1, 1, 0]}}"],
    [f"{ROD}.finish.moment=[0, 1, 2]"],
    [f"{ROD}.finish.moment=[0, 0, 2]", f"{ROD}.shape={{kind='circle', curvature=1}}"],
    [f"{ROD}.curvature=[1, 0]", "fluid.flow=[0, 0, '1 + sin(t)']"],
    [f"{ROD}.curvature=[1, 0]", f"{ROD}.loads={{moment=[1, 0, 0], internal_moment=[1, 0], body_force=[0, 1, 0]}}"],
    [f"{ROD}.curvature=[1, 0]", *THERMAL, "thermal.directions=xy"],
    [
        f"{ROD}.direction=[1, 1, 0]",
        f"{ROD}.normal=[1, -1, 0]",
        f"{ROD}.curvature=[1, 0]",
        f"{ROD}.loads.weight=[2, 2, 5]",
    ],
    [f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[1, 0, 1]"],
    [f"{ROD}.bending=[1, 2]", f"{ROD}.loads.weight=[1, 1, 0]"],
    [f"{ROD}.shape={{kind='helix', radius=1, pitch=1}}", "fluid.flow=['z', 'x', 'y']"],
    THERMAL,
    [*STOKES, "fluid.box=[4, 2, 6]", "fluid.cells=[40, 20, 60]"],
    [*FREE, "fluid.flow=['y', 0, 0]", "output.grid_every=1", "output.window=[1, 2, 3]", "output.window_at=[0, 9, 0]"],
    [*FREE[:2], "fluid.thickness=0.1", *TWISTED, "fluid.rotation=grid", "fluid.method=krylov"],
    ["fluid.drag.matched=0.5", "fluid.box=free", "fluid.spacing=0.05"],
    ["fluid.box=free"],
    [*WALL, "observe.q={kind='flux', along=[0, 1, 0]}", "output.probes=[[0, 0, 0]]"],
    [*WALL, *TWISTED, "fluid.wall=free-slip", "output.grid_every=1", "output.window=[1, 1, 1]"],
    ["fluid.wall=no-slip", "observe.q.kind=flux"],
    [*STOKES, "fluid.box=[3.2, 0.3, 0.3]", "fluid.cells=[32, 3, 3]", "fluid.kernel=roma3"],
    [*NAVIER, "fluid.flow=['sin(2*pi*y/4)*cos(t)', 'cos(pi*x)', 1]"],
    [*STOKES, "fluid.flow=['y', 0, 0]"],
    ["fluid.rotation=grid"],
    [*STOKES, *TWISTED, "fluid.rotation=grid"],
    [f"{ROD}.twisting=1", "fluid.drag={perp=2, par=1, spin=1}"],
    ["fluid.drag=slender", f"{ROD}.radius=0.3"],
    ["fluid.drag=slender", *STOKES],
    ["fluid.density=1", "output.fields=['pressure']", "output.grid_stride=2"],
    ["contact={distance=1, action='repel', strength=2}"],
    ["contact.action=warn", f"{ROD}.radius=0.1"],
    ["output={times=[0, 0.5, 1]}"],
    [*SPEED, "observe.v={kind='speed', at=[0, 1], space='max', over=[0, 99]}"],
    [*EXPECT, "expect.e.range=[0, 1]"],
    [*EXPECT, "expect.e.value=1", "observe.v={kind='position', along=[0, 1, 0]}"],
]


@pytest.mark.parametrize("overrides", SOUND, ids=" ".join)
def test_what_goes_together(overrides):
    parse_case(tomli_w.dumps(SCENE), "good.toml", overrides)
