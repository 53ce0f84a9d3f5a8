"""Scenes on which the error bars of `ibfil uncertainty` are calibrated, not shipped, and true numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ibfil.assembly.grid import spacing
from ibfil.case.reading import parse_case
from ibfil.case.schema import Case
from ibfil.io.reader import RunFile
from ibfil.simulation.simulation import Simulation
from ibfil.studies.member import Member
from ibfil.studies.members import run_members
from ibfil.studies.uncertainty import place
from ibfil.studies.uncertainty.numbers import Numbers, Recorded, moved_back

RFT = '[fluid]\nmodel = "rft"\nviscosity = 1.0\n'
X, Y, Z, TIP, FOOT = "[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]", '"finish"', '"start"'
CLAMPED = '[filament.rod.start]\nend = "clamped"\n'
BETWEEN = 'anchor = "middle"'


def rod(nodes: int, stretching: float, keys: str = 'anchor = "start"', ends: str = "", side: str = Y) -> str:
    head = f"[filament.rod]\nlength = 1.0\nnodes = {nodes}\nbending = 1.0\nstretching = {stretching}\nnormal = {side}\n"
    return f"{head}{keys}\n{ends}"


def cube(cells: int, keys: str = "", side: float = 2.4, model: str = "stokes") -> str:
    grid = f"box = {[side] * 3}\ncells = {[cells] * 3}\n"
    return f'[fluid]\nmodel = "{model}"\nviscosity = 1.0\n{grid}{keys}\n'


def until(end: float, step: float, every: float, keys: str = "") -> str:
    return f"[time]\nend = {end}\nstep = {step}\n{keys}\n[output]\nevery = {every}\n"


def seen(name: str, kind: str, **keys: str) -> str:
    return f'[observe.{name}]\nkind = "{kind}"\n' + "".join(f"{key} = {value}\n" for key, value in keys.items())


def sagging(fluid: str, nodes: int) -> str:
    weight = "[filament.rod.loads]\nweight = [0, 0, -6.0]\n"
    numbers = seen("tip", "position", at=TIP, along=Z) + seen("speed", "speed", at=TIP) + seen("power", "power")
    return rod(nodes, 1e4, ends=CLAMPED + weight) + fluid + until(1.0, 0.04, 0.1) + numbers


def shaken(order: str = "") -> str:
    end = '[filament.rod.start]\nend = "hinged"\nmoves = [0, 0, "0.2*sin(5*t)*(1 - exp(-5*t))"]\n'
    late = {"over": "[2.513274, 3.76991]"}
    numbers = seen("reach", "position", at=TIP, along=Z, summary='"max"', **late)
    numbers += seen("force", "force", at=FOOT, along=Z, summary='"max"', **late)
    numbers += seen("power", "power", summary='"mean"', **late) + seen("x", "position", at=TIP, along=X)
    return rod(25, 2e3, ends=end) + RFT + until(3.76991, 0.025, 0.0628318, order) + numbers


def cilium(fluid: str, nodes: int, step: float) -> str:
    keys = 'anchor = "start"\ncurvature = ["3*sin(2*pi*s - 6*t) + 1.5", 0]\nshape = { kind = "relaxed" }'
    late = {"over": "[1.04719755, 3.14159]"}
    numbers = seen("thrust", "force", at=FOOT, along=X, summary='"mean"', **late)
    numbers += seen("power", "power", summary='"mean"', **late)
    numbers += seen("sweep", "amplitude", at=TIP, along=X, summary='"max"', **late)
    return rod(nodes, 2e3, keys, CLAMPED) + fluid + until(3.14159, step, 0.0523599) + numbers


def wound() -> str:
    held = 'end = "clamped"\ntwist = "held"\n'
    ends = f'[filament.rod.start]\n{held}spin = "8*sin(20*t)"\n[filament.rod.finish]\n{held}'
    numbers = seen("middle", "twist", at='"middle"') + seen("end", "twist", at=TIP)
    numbers += seen("power", "power", summary='"mean"')
    keys = 'anchor = "start"\ntwisting = 0.8\nradius = 0.05'
    return rod(25, 2e3, keys, ends) + RFT + until(0.5, 0.004, 0.02) + numbers


def corkscrew() -> str:
    keys = 'anchor = "start"\ntwisting = 1.0\nradius = 0.03\ncurvature = [4.5, 0]\ntwist_rate = 6.0\n'
    keys += 'shape = { kind = "relaxed" }'
    end = CLAMPED + 'twist = "held"\nspin = "60*(1 - exp(-80*t))"\n'
    numbers = seen("thrust", "force", at=FOOT, along=X, summary='"mean"', over="[0.05, 0.1]")
    numbers += seen("tip", "position", at=TIP, along=Y) + seen("reach", "end_to_end")
    return rod(41, 2e3, keys, end) + RFT + until(0.1, 0.0005, 0.0025) + numbers


def tumbling(fluid: str, nodes: int) -> str:
    keys = f'{BETWEEN}\ndirection = [0.5, 0, 1]\nshape = {{ kind = "straight", perturb = ["0.03*sin(pi*s)", 0, 0] }}'
    numbers = seen("span", "end_to_end") + seen("tip", "position", at=TIP, along=Z)
    return rod(nodes, 2e3, keys) + fluid + until(0.4, 0.004, 0.02) + numbers


def squeezed() -> str:
    keys = f'{BETWEEN}\nshape = {{ kind = "straight", perturb = [0, 0, "1e-3*cos(3*pi*s)"] }}'
    numbers = seen("growth", "growth", at='"middle"', along=X, over="[0.01, 0.04]") + seen("span", "end_to_end")
    return rod(33, 1e4, keys) + RFT + 'flow = ["-60*x", 0, "60*z"]\n' + until(0.05, 0.0005, 0.0025) + numbers


def recoil() -> str:
    bent = '["sin(2*s)/2", 0, "(1 - cos(2*s))/2"]'
    keys = f'{BETWEEN}\ncurvature = [0.5, 0]\nshape = {{ kind = "expression", r = {bent} }}'
    numbers = seen("span", "end_to_end") + seen("power", "power")
    numbers += seen("middle", "displacement", at='"middle"', along=Z)
    return rod(25, 1e3, keys) + RFT + until(0.1, 0.002, 0.01) + numbers


def pulled() -> str:
    keys = 'anchor = "start"\nlaw = { kind = "stiffening", coefficient = 0.2, exponent = 2 }'
    ends = CLAMPED + '[filament.rod.finish]\nforce = [0, 0, "5*sin(4*t)"]\n'
    numbers = seen("tip", "position", at=TIP, along=Z) + seen("turn", "speed", at=TIP)
    numbers += seen("reach", "position", at=TIP, along=Z, summary='"max"', over="[0, 1.5]")
    return rod(25, 5e3, keys, ends) + RFT + until(1.5, 0.03, 0.05) + numbers


def uneven() -> str:
    ends = CLAMPED + '[filament.rod.loads]\nforce = [0, 0, "8*s*cos(6*t)"]\n'
    numbers = seen("tip", "position", at=TIP, along=Z)
    numbers += seen("force", "force", at=FOOT, along=Z, summary='"max"', over="[0.5, 1.5]")
    keys = 'anchor = "start"\nspacing = "q*(0.4 + 0.6*q)"'
    return rod(25, 5e3, keys, ends) + RFT + until(1.5, 0.02, 0.05) + numbers


def falling_pair(fluid: str) -> str:
    text = ""
    for name, z in (("a", 0.12), ("b", -0.12)):
        text += (
            f"[filament.{name}]\nlength = 1.0\nnodes = 17\nbending = 0.3\nstretching = 1e3\nposition = [0, 0, {z}]\n"
        )
        text += "normal = [0, 0, 1]\nloads = { weight = [0, -8.0, 0] }\n"
    numbers = seen("fall", "drift", filament='"a"', at='"centroid"', along=Y, over="[0.1, 0.4]")
    numbers += seen("apart", "position", filament='"a"', at='"middle"', along=Z)
    return text + fluid + until(0.4, 0.01, 0.02) + numbers + seen("bow", "end_to_end", filament='"b"')


def pressed() -> str:
    text = ""
    for name, z, tilt in (("a", 0.06, 0.6), ("b", -0.06, -0.6)):
        text += f"[filament.{name}]\nlength = 1.0\nnodes = 21\nbending = 0.5\nstretching = 1e3\nnormal = [0, 0, 1]\n"
        text += f"position = [0, 0, {z}]\ndirection = [1, {tilt}, 0]\nloads = {{ weight = [0, 0, {-50 * z}] }}\n"
    contact = '[contact]\ndistance = 0.06\naction = "repel"\nstrength = 5.0\n'
    numbers = seen("apart", "position", filament='"a"', at='"middle"', along=Z)
    numbers += seen("bow", "position", filament='"a"', at=TIP, along=Z)
    return text + contact + RFT + until(0.4, 0.004, 0.02) + numbers


def inertia() -> str:
    keys = 'curvature = ["6*sin(2*pi*s - 12*t)", 0]\nshape = { kind = "relaxed" }'
    fluid = cube(32, "density = 3.0", 2.0, "navier-stokes")
    numbers = seen("speed", "drift", at='"centroid"', along=X, over="[0.5235988, 1.5708]")
    numbers += seen("power", "power", summary='"mean"', over="[0.5235988, 1.5708]")
    return rod(21, 400, keys, side=Z) + fluid + until(1.5708, 0.01, 0.026179939) + numbers


SCENES = {
    "sagging": sagging(RFT, 25),
    "shaken": shaken(),
    "first_order": shaken("order = 1"),
    "cilium": cilium(RFT, 31, 0.02),
    "wound": wound(),
    "corkscrew": corkscrew(),
    "tumbling": tumbling(RFT + 'flow = ["25*z", 0, 0]\n', 25),
    "squeezed": squeezed(),
    "recoil": recoil(),
    "pulled": pulled(),
    "uneven": uneven(),
    "pressed": pressed(),
    "sagging_grid": sagging(cube(36), 21),
    "cilium_grid": cilium(cube(40, "slip = 0.02"), 25, 0.025),
    "falling_pair": falling_pair(cube(32)),
    "tumbling_grid": tumbling(cube(32, 'flow = ["25*sin(2*pi*z/2.4)*2.4/(2*pi)", 0, 0]'), 17),
    "inertia": inertia(),
}


def finer(case: Case, step: float, nodes: float) -> tuple[str, ...]:
    """The overrides of a step and numbers of nodes so many times finer."""
    assert isinstance(case.time.step, float)
    counts = (f"filament.{name}.nodes={round((f.nodes - 1) * nodes) + 1}" for name, f in case.filaments.items())
    return (f"time.step={case.time.step / step!r}", *counts)


def truth(name: str, folder: Path) -> Numbers:
    """The numbers of a scene at step and segment zero: levels 4 and 8 times finer (2 and 4 on grids), extrapolated.

    On a grid the nodes of the finest level are taken as they are, and the mean of two places in a cell.
    """
    case = parse_case(SCENES[name], f"{name}.toml")
    grid = case.fluid.on_grid
    half, whole = (2, 4) if grid else (4, 8)

    def numbers(step: int, nodes: int) -> Numbers:
        return _run(name, f"s{step}n{nodes}", finer(case, step, nodes), folder)

    best, later, sooner = numbers(whole, whole), numbers(whole, 1), numbers(half, 1)
    more, fewer = numbers(1, whole), numbers(1, half)
    found = {}
    for key, value in best.items():
        left = (later[key] - sooner[key]) / (2**case.time.order - 1)
        found[key] = value + left + (0.0 if grid else (more[key] - fewer[key]) / 3)
    if not grid:
        return found
    simulation = Simulation(case)
    shift = np.full(3, 0.5 * spacing(case))
    here = numbers(1, 1)
    there = _run(name, "place", place.moved(simulation, shift), folder, shift)
    return {key: value - 0.5 * (here[key] - there[key]) for key, value in found.items()}


def _run(name: str, run: str, overrides: tuple[str, ...], folder: Path, shift: np.ndarray | None = None) -> Numbers:
    outcome = run_members([Member(run, SCENES[name], overrides)], folder, log=lambda line: None)[0]
    assert outcome.done, outcome.message
    with RunFile(outcome.path) as found:
        return Recorded(found, tuple(found.case.observe)).numbers() if shift is None else moved_back(found, shift)
