"""Cases of the paper's scenes as texts, the shortest case there is, and what reads them."""

from __future__ import annotations

import pytest

from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.errors import CaseError

SHORT = """
[filament.rod]
length = 1.0
nodes = 41
bending = 2
stretching = 1e4
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1
[output]
every = 0.1
"""

BROWNIAN_HELIX = """
units = { length = "um", force = "pN", time = "s" }
[parameters]
theta = 0.7853981633974483
seed = 3
[filament.helix]
length = 10
nodes = 500
bending = 1
twisting = 1
stretching = 2000
radius = 0.1
curvature = ["1/tan(theta)", 0]
twist_rate = 1
direction = [0, 0, 1]
align = "axis"
normal = [1, 0, 0]
anchor = "centroid"
shape = { kind = "relaxed" }
[fluid]
model = "rft"
viscosity = 0.1
drag = "paper"
[thermal]
energy = 0.004114
seed = "seed"
directions = "xyz"
twist = true
[time]
end = 1.5
step = 1e-5
[output]
every = 1e-3
[observe.ratio]
kind = "diffusion_ratio"
at = "centroid"
interval = 1e-3
[expect.ratio]
observe = "ratio"
value = 0.779
tolerance = 0.135
source = "linearised elastic rod, 1 ms"
"""

FLAILING = """
[parameters]
F0 = 43.6
k = 1.8751040687119611
c = "(cos(k) + cosh(k))/(sin(k) - sinh(k))"
[filament.rod]
length = 1
nodes = 128
bending = 1
twisting = 1
stretching = 2e4
radius = 0.1
anchor = "start"
normal = [0, 1, 0]
[filament.rod.shape]
perturb = ["0", "0", "0.02*(sin(k*s) - sinh(k*s) + c*(cos(k*s) - cosh(k*s)))"]
twist = "0.1*cos(pi*s/2)"
[filament.rod.start]
end = "clamped"
[filament.rod.finish]
follower = "-F0"
[fluid]
model = "rft"
viscosity = 1
[time]
end = 20
step = 1e-4
[output]
every = 0.01
[observe.tip]
kind = "position"
at = "finish"
"""

HELIX_IN_FLOW = """
[parameters]
A = 1.0
u = 0.01
[filament.helix]
length = 5.0
nodes  = 201
bending = "A"
twisting = "A"
stretching = 4000
radius = 0.1
curvature = [3, 0]
twist_rate = 1
anchor = "start"
align = "axis"
shape = { kind = "relaxed" }
start = { end = "clamped", twist = "held" }
[fluid]
model = "rft"
viscosity = 0.1
flow  = ["u", "0", "0"]
[time]
end = 60
step = 2e-3
[[stop]]
observe = "tip_speed"
below = 1e-5
after = 0.1
[output]
every = 0.05
[observe.tip_speed]
kind = "speed"
at = "finish"
[observe.extension]
kind = "displacement"
at = "finish"
along = [1, 0, 0]
[expect.small_u]
observe = "extension"
value = "1.029 * 0.2*pi * u * 0.3**2 * 25 / A"
tolerance = 0.01
"""

RIBBON = """
[parameters]
gamma = 40
eta = 0.01
A = 0.5
[filament.actin]
length = 4
nodes = 129
bending = ["A", "A/20"]
twisting = 1e-4
stretching = 3000
radius = 0.004
[fluid]
model = "rft"
viscosity = "eta"
flow = ["-gamma*x", "gamma*y", "0"]
drag = "slender"
[thermal]
energy = 0.004114
[contact]
distance = 0.008
[time]
end = 0.15
step = 1e-5
scheme = "semi-implicit"
order = 1
[output]
every = 1e-3
[observe.r_eff]
kind = "radius"
along = [1, 0, 0]
at = [1.0, 3.0]
space = "mean"
summary = "max"
"""

SWIMMER = """
[parameters]
rho = 10
[filament.swimmer]
length = 1
nodes = 41
bending = 1
stretching = 400
curvature = ["8*sin(4*pi*s - 10*t)", 0]
shape = { kind = "relaxed" }
anchor = "centroid"
[fluid]
model = "navier-stokes"
viscosity = 1
density = "rho"
box = [3.2, 3.2, 3.2]
cells = [64, 64, 64]
[time]
end = "6*pi/10"
step = "pi/500"
[output]
every = "pi/250"
grid_every = "pi/5"
fields = ["velocity", "vorticity"]
[observe.speed]
kind = "drift"
at = "centroid"
along = [1, 0, 0]
over = ["2*pi/10", "6*pi/10"]
[expect.speed]
observe = "speed"
value = -0.01857
[expect.speed.quick]
value = -0.0186
absolute = 1e-3
"time.end" = "3*pi/10"
fluid.cells = [32, 32, 32]
observe.speed.over = ["pi/10", "3*pi/10"]
"""

WHIRLING = """
[parameters]
a = 0.1
ratio = 5.0
[filament.rod]
length = 1
nodes = 200
bending = [1, 0.05]
twisting = 1
stretching = 1.6e4
radius = "a"
normal = [0, 1, 0]
shape = { kind = "straight", perturb = ["0", "1e-3*s**2", "1e-3*s**2*(1-s/3)"] }
[filament.rod.start]
end = "clamped"
twist = "held"
spin = "ratio/(4*pi*a**2)"
[fluid]
model = "rft"
viscosity = 1
[contact]
action = "warn"
[time]
end = 400
[[stop]]
observe = "amplitude"
steady = { over = 5.0, change = 1e-3 }
after = 20
[output]
every = 0.05
[observe.amplitude]
kind = "amplitude"
along = [1, 0, 0]
"""

EXAMPLES = [BROWNIAN_HELIX, FLAILING, HELIX_IN_FLOW, RIBBON, SWIMMER, WHIRLING]


def case(text: str, *overrides: str) -> Case:
    return parse_case(text, "case.toml", overrides)


def rod(case: Case):
    return case.filaments["rod"]


def faults(text: str, *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as caught:
        case(text, *overrides)
    return caught.value.faults
