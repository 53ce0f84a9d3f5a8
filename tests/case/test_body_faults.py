"""What does not go together in bodies, ends and motors: one line each, with key, value and what is allowed."""

from __future__ import annotations

import pytest
from helpers.example_cases import case, faults

SCENE = """
[filament.tail]
length = 1.0
nodes = 21
bending = 1.0
twisting = 1.0
stretching = 1e4
radius = 0.01
start = { end = "body", body = "head", motor = { spin = 1.0 } }
[filament.other]
length = 1.0
nodes = 21
bending = 1.0
twisting = 1.0
stretching = 1e4
radius = 0.01
position = [0, 1, 0]
[body.head]
shape = { kind = "sphere", radius = 0.1 }
[fluid]
model = "rft"
viscosity = 1.0
[time]
end = 1.0
step = 0.1
[output]
every = 1.0
"""
HEAD, START, MOTOR = "body.head", "filament.tail.start", "filament.tail.start.motor"
IN_HEAD = '{end="body",body="head"}'
CASES = {
    "an unknown body": (
        [f"{START}.body=hea"],
        f'{START}.body: found "hea"; did you mean "head"?; allowed: one of head',
    ),
    "no body": ([START + '={end="body"}'], f"{START}.body: found nothing; allowed: one of head"),
    "a body at a free end": (
        ['filament.other.start={body="head"}'],
        'filament.other.start.body: found body with end = "free"; allowed: only with end = "body"',
    ),
    "a motor at a clamp": (
        ['filament.other.start={end="clamped",motor={spin=1}}'],
        'filament.other.start.motor: found motor with end = "clamped"; allowed: only with end = "body"',
    ),
    "a motion of the end": (
        [START + '={end="body",body="head",moves=["t",0,0]}'],
        f'{START}.moves: found moves with end = "body"; allowed: body.NAME.motion, which moves the body',
    ),
    "a moment on the end": (
        [START + '={end="body",body="head",moment=[0,0,1]}'],
        f'{START}.moment: found moment with end = "body"; allowed: body.NAME.torque, or a motor',
    ),
    "a force on the end": (
        [START + '={end="body",body="head",force=[0,0,1]}'],
        f'{START}.force: found force with end = "body"; allowed: only at a free end',
    ),
    "two motions of a motor": (
        [MOTOR + "={spin=1,torque=1}"],
        f"{MOTOR}: found spin and torque; allowed: one of spin, angle, torque, or stall with free",
    ),
    "a motor of nothing": (
        [MOTOR + "={}"],
        f"{MOTOR}: found nothing; allowed: one of spin, angle, torque, or stall with free",
    ),
    "a line without its end": (
        [MOTOR + "={stall=1}"],
        f"{MOTOR}.free: found nothing; allowed: a number > 0 with stall",
    ),
    "an axis of no direction": (
        [MOTOR + "={spin=1,axis=[0,0,0]}"],
        f"{MOTOR}.axis: found [0.0, 0.0, 0.0]; allowed: a vector that is not zero",
    ),
    "a place of the tangent": (
        [MOTOR + "={spin=1,through=[0,0,1]}"],
        f'{MOTOR}.through: found [0.0, 0.0, 1.0] with axis = "tangent"; allowed: only with axis = [x, y, z]',
    ),
    "a motor at a hinge": (
        [START + '={end="body",body="head",hinged=true,motor={spin=1}}'],
        f"{MOTOR}: found a motor at a hinged end, which it could not turn; allowed: hinged = false",
    ),
    "a motor between a body and itself": (
        ['filament.tail.finish={end="body",body="head"}'],
        'filament.tail.finish.body: found "head", as the start has, and a motor, which would turn it against itself; '
        "allowed: another body, or no motor",
    ),
    "copies": (
        ["filament.tail.copies={file='places.csv'}"],
        "filament.tail.copies.file: found a file for copies of a filament in a body; allowed: count with region or at",
    ),
    "axes": (
        [f"{HEAD}.axes=[[1,0,0],[2,0,0]]"],
        f"{HEAD}.axes: found [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]; allowed: two directions at an angle to each other",
    ),
    "a frame of nothing": (
        [f"{HEAD}.frame=body"],
        f'{HEAD}.frame: found "body" and neither force nor torque; allowed: only with one of them',
    ),
    "a joint of one end": (
        [HEAD + '={shape={kind="joint"}}'],
        f"{HEAD}.shape: found a joint with 1 end of filaments in it; allowed: at least two ends",
    ),
    "a torque on hinges": (
        [
            HEAD + '={shape={kind="joint"},torque=[0,0,1]}',
            START + '={end="body",body="head",hinged=true}',
            'filament.other.start={end="body",body="head",hinged=true}',
        ],
        f"{HEAD}.torque: found a torque on a joint of hinged ends; allowed: an end in it that is not hinged",
    ),
    "a resistance of a joint": (
        [HEAD + '={shape={kind="joint"},resistance={translation=[1,1,1],rotation=[1,1,1]}}'],
        f"{HEAD}.resistance: found a resistance of a joint; allowed: another shape, or none",
    ),
    "a closed rod": (
        ["filament.other.closed=true", 'filament.other.shape={kind="circle",curvature=6.283185307179586}'],
        "filament.other.closed: found true in a scene with bodies; allowed: false",
    ),
    "thick rods": (["fluid.thick=true"], "fluid.thick: found true in a scene with bodies; allowed: false"),
    "no size": (
        [f"{HEAD}.shape.radius=0"],
        f"{HEAD}.shape.radius: found 0; allowed: a number (or constant expression) > 0",
    ),
    "noise": (
        ["thermal.energy=1", "time.scheme=implicit"],
        f"{HEAD}: found a body with [thermal]; allowed: no bodies with [thermal]",
    ),
    "an explicit scheme": (
        ["time.scheme=explicit", "time.order=1"],
        f'{HEAD}: found a body with time.scheme = "explicit"; allowed: bodies with scheme = "implicit"',
    ),
    "mass": (
        ["filament.tail.mass=1"],
        "filament.tail.mass: found a mass in a scene with bodies, which have none; allowed: no mass",
    ),
    "a body that is not there": (
        ["observe.x.kind=body_spin", "observe.x.body=tail"],
        'observe.x.body: found "tail"; allowed: head',
    ),
    "a motor that is not there": (
        ["observe.x.kind=motor_rate", "observe.x.motor=tail"],
        'observe.x.motor: found "tail"; allowed: tail_start',
    ),
    "a body where a filament is looked at": (
        ["observe.x.kind=speed", "observe.x.filament=tail", "observe.x.body=head"],
        'observe.x.body: found "head" with kind = "speed"; allowed: only with kinds that look at a body',
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_one_line(name):
    overrides, line = CASES[name]
    assert any(found.endswith(line) for found in faults(SCENE, *overrides)), faults(SCENE, *overrides)


def test_the_scene_itself_is_allowed():
    assert case(SCENE).joined == {"link": (), "body": ("head",), "motor": ("tail_start",)}


def test_rods_without_twist_stay_in_their_plane_with_their_bodies():
    """A bent rod without twisting: what leads its body out of the plane is refused, what does not is not."""
    flat = [
        f'filament.tail={{length=1,nodes=21,bending=1,stretching=1e4,curvature=["3*sin(t)",0],start={IN_HEAD}}}',
        "filament.other.position=[0,1,0]",
    ]
    case(SCENE, *flat, f"{HEAD}.force=[1,0,0]", f"{HEAD}.position=[-0.1,0,0]")
    for key, value in (
        ("force", "[0,0,1]"),
        ("torque", "[1,0,0]"),
        ("position", "[-0.1,0,0.05]"),
        ("motion", '{moves=[0,0,"t"]}'),
        ("motion", '{turns=["t",0,0]}'),
    ):
        lines = faults(SCENE, *flat, f"{HEAD}.{key}={value}")
        assert any("leads out of the plane" in line and HEAD in line for line in lines), (key, lines)
    lines = faults(SCENE, *flat, f"filament.other.start={IN_HEAD}")
    assert any("filament.other.start.body" in line for line in lines)
