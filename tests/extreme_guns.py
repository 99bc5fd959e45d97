"""Guns at random, and at the ends of what is allowed."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from device.parameters import DriveOff, Emf
from device.physics import GunParameters, simulate
from device.physics.equations import CONTINUES, ShotResult, ShotState, StepSeries, pack
from device.physics.shot import shoot as shoot_into
from device.physics.traces import segments

EXTREMES = {
    "1e4 V": {"voltage_V": 1e4},
    "1e300 V": {"voltage_V": 1e300},
    "no pulse": {"pulse_s": 0.0},
    "1 ns": {"pulse_s": 1e-9},
    "100 s": {"pulse_s": 100.0},
    "no spring": {"stiffness_N_m": 0.0},
    "hardly a spring": {"stiffness_N_m": 1e-9},
    "no spring, no friction": {"stiffness_N_m": 0.0, "friction_N": 0.0},
    "no friction": {"friction_N": 0.0},
    "no pre-load, no friction": {"preload_length_m": 0.0, "friction_N": 0.0},
    "no motor": {"motor_constant_N_A": 0.0},
    "1 uH": {"inductance_H": 1e-6},
    "1 nH": {"inductance_H": 1e-9},
    "10 H": {"inductance_H": 10.0},
    "1 mg": {"magnet_mass_kg": 1e-6},
    "1000 t": {"magnet_mass_kg": 1e6},
    "1 mOhm": {"resistance_ohm": 1e-3},
    "coil of 1 um": {"coil_reach_m": 1e-6},
    "coil of 1 m": {"coil_reach_m": 1.0},
    "back-EMF 1000": {"back_emf_V_s_m": 1e3},
}


SPREAD = {
    "magnet_mass_kg": (0.05, 0.3),
    "back_emf_V_s_m": (1.0, 15.0),
    "resistance_ohm": (1.0, 6.0),
    "inductance_H": (1e-5, 2e-3),
    "motor_constant_N_A": (3.0, 15.0),
    "coil_reach_m": (0.003, 0.02),
    "stiffness_N_m": (5.0, 40.0),
    "preload_length_m": (0.03, 0.15),
    "friction_N": (0.0, 1.5),
    "voltage_V": (5.0, 24.0),
    "pulse_s": (0.002, 0.02),
    "contact_depth_m": (1e-4, 1e-3),
}
FAR_SHOTS = json.loads((Path(__file__).parent / "golden" / "physics_far.json").read_text(encoding="utf-8"))["shots"]
"""Guns far from the paper's with their numbers in fifty digits: three that creep, and one that sticks and slips."""
SLIPPING = GunParameters(**FAR_SHOTS[3]["gun"])
"""1,773 slips, each a part of the way that is left to where the drive no longer moves the magnet."""
HALVINGS = 20
NOISE = 2e-11  # relative: below it differences are rounding and tolerance, not the gun's


def work(gun):
    """How the shot ended, and the work that it took, which does not depend on the machine."""
    series, result = StepSeries(), ShotResult()
    shoot_into(pack(gun), ShotState(), series, result)
    return result.status, series.work


def order_of(gun):
    return tuple((s.ended_by, s.heading) for s in segments(pack(gun)) if s.ended_by != CONTINUES)


def outcome(gun, simulate):
    summary = simulate(gun)
    return summary.status, [v for v in dataclasses.astuple(summary)[1:] if v is not None]


def pair(rng):
    """A gun and a direction in the space of guns, as rows."""
    low, high = (np.array([bounds[k] for bounds in SPREAD.values()]) for k in (0, 1))
    options = {"drive_off": rng.choice(["shorted", "open"]), "emf": rng.choice(["printed", "reciprocal"])}
    here = low + (high - low) * rng.random(len(low))
    there = here * (1 + 1e-3 * rng.uniform(-1, 1, len(low)))
    return options, here, there


def gun_of(options, values):
    return GunParameters(**options, **dict(zip(SPREAD, values.tolist(), strict=True)))


def distance(a, b):
    return max(abs(x - y) / max(abs(x), abs(y), 1e-12) for x, y in zip(a, b, strict=True)) if a else 0.0


def jump_of(rng, simulate):
    """What is left of the difference after 20 halvings, as a multiple of what smoothness allows; 0 if it is smooth.

    The pair is bisected towards the larger part of the difference, so that a jump is not halved away.
    """
    options, here, there = pair(rng)
    ends = [(values, *outcome(gun_of(options, values), simulate)) for values in (here, there)]
    for halving in range(HALVINGS):
        if ends[0][1] != ends[1][1] or len(ends[0][2]) != len(ends[1][2]):
            return 0.0  # another status: the numbers may jump
        whole = distance(ends[0][2], ends[1][2])
        if whole < NOISE:
            return 0.0
        middle = (ends[0][0] + ends[1][0]) / 2
        centre = (middle, *outcome(gun_of(options, middle), simulate))
        if centre[1] != ends[0][1] or len(centre[2]) != len(ends[0][2]):
            return 0.0
        halves = [distance(end[2], centre[2]) for end in ends]
        if halving >= 3 and max(halves) < 0.6 * whole:
            return 0.0  # halved
        keep = 0 if halves[0] > halves[1] else 1
        ends = [ends[keep], centre]
    guns = [gun_of(options, end[0]) for end in ends]
    return whole if order_of(guns[0]) == order_of(guns[1]) else 0.0


def defects(seed, count, simulate=simulate):
    rng = np.random.default_rng(seed)
    found = []
    for n in range(count):
        state = rng.bit_generator.state
        jump = jump_of(rng, simulate)
        if jump > 0.0:
            found.append((n, jump, state["state"]))
    return found


PAPER = GunParameters()
NUMBERS = [
    one.name
    for one in dataclasses.fields(GunParameters)
    if isinstance(one.default, float) and one.name not in ("friction_N", "contact_depth_m")
]
OPTIONS: list[tuple[DriveOff, Emf]] = [(off, emf) for off in ("open", "shorted") for emf in ("printed", "reciprocal")]


BREAK_AWAY_V = (14.0 * 0.10 + 0.21) * 2.9 / 7.6  # (k x_0 + F_f) R / k_m


def numbers(summary):
    return {k: v for k, v in dataclasses.asdict(summary).items() if k != "status" and v is not None}


def shoot(simulate=simulate, **changes):
    summary = simulate(GunParameters(**changes))
    assert all(math.isfinite(value) for value in numbers(summary).values())
    return summary


def guns_about(**more):
    """Guns at random about the paper's, their numbers drawn, and `more` of them."""
    return st.builds(
        GunParameters,
        magnet_mass_kg=st.floats(0.02, 0.5),
        inductance_H=st.floats(2e-4, 5e-3),
        stiffness_N_m=st.floats(0.0, 100.0),
        preload_length_m=st.floats(0.0, 0.2),
        friction_N=st.floats(0.0, 2.0),
        voltage_V=st.floats(0.0, 24.0),
        pulse_s=st.floats(0.0, 0.03),
        drive_off=st.sampled_from(["shorted", "open"]),
        emf=st.sampled_from(["printed", "reciprocal"]),
        **more,
    )
