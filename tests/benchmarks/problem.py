"""The shots that all solve, the numbers they are asked for, and how far these are from fifty digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from device.methods import FRICTION_I_N, FRICTION_II_N
from device.parameters import DriveOff, GunParameters
from device.physics.scenes import OUTPUTS
from tests.golden_shots import RANDOM, SHOTS

Outputs = tuple[float, ...]
"""The numbers of `OUTPUTS`, in their order."""
Shoot = Callable[[GunParameters], Outputs]
"""One shot of a gun; `PeerError` or an error of the package if it gets nowhere."""

OFF_STATES: tuple[DriveOff, ...] = ("open", "shorted")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shots:
    """Guns with the coil in one off-state, and the outputs of each in fifty digits."""

    drive_off: DriveOff
    guns: tuple[GunParameters, ...]
    exact: tuple[Mapping[str, str], ...]


class PeerError(RuntimeError):
    """A peer that missed an event or gave up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """One solver at one setting. `build` prepares it (and compiles, where it does) for an off-state of the coil."""

    family: str
    setting: str
    package: str
    models: str
    build: Callable[[DriveOff], Shoot]


def guns(drive_off: DriveOff) -> tuple[GunParameters, ...]:
    """The paper's gun without and with its damper, back-EMF as printed."""
    return tuple(GunParameters(friction_N=friction, drive_off=drive_off) for friction in (FRICTION_I_N, FRICTION_II_N))


def reference(drive_off: DriveOff) -> tuple[dict[str, str], ...]:
    """The outputs of `guns(drive_off)` in fifty digits, made by tests/golden/make_physics.py (mpmath)."""
    known = {(shot["friction_N"], shot["drive_off"], shot["emf"]): shot["summary"] for shot in SHOTS}
    return tuple(known[gun.friction_N, gun.drive_off, gun.emf] for gun in guns(drive_off))


def papers_shots(drive_off: DriveOff) -> Shots:
    """Those of `guns`, against `reference`."""
    return Shots(drive_off=drive_off, guns=guns(drive_off), exact=reference(drive_off))


def random_shots(drive_off: DriveOff) -> Shots:
    """Those of the paper's guns, and of 200 random ones that shoot as they do."""
    papers = papers_shots(drive_off)
    drawn = tuple(GunParameters(**shot.numbers, drive_off=drive_off) for shot in RANDOM)
    digits = tuple(getattr(shot, drive_off) for shot in RANDOM)
    return Shots(drive_off=drive_off, guns=papers.guns + drawn, exact=papers.exact + digits)


def errors(found: Sequence[Outputs], exact: Sequence[Mapping[str, str]]) -> dict[str, float]:
    """The largest relative error of each output over the guns. Not a number counts as infinite."""
    return {
        name: max(_error(one[place], float(digits[name])) for one, digits in zip(found, exact, strict=True))
        for place, name in enumerate(OUTPUTS)
    }


def _error(found: float, exact: float) -> float:
    error = abs(found - exact) / exact
    return math.inf if math.isnan(error) else error


def break_away(gun: GunParameters) -> tuple[float, float]:
    """When the resting magnet breaks away, and the current then: i(t) = V/R (1 - exp(-t R/L)) meets k x_0 + F_f."""
    current = (gun.stiffness_N_m * gun.preload_length_m + gun.friction_N) / gun.motor_constant_N_A
    steady = gun.voltage_V / gun.resistance_ohm
    return -gun.inductance_H / gun.resistance_ohm * math.log1p(-current / steady), current


def force_on_hand(gun: GunParameters, x: float, i: float) -> float:
    """F = m d2x/dt2 of equation (1) inside the coil, on the way out."""
    motor = gun.motor_constant_N_A * (1.0 - x / gun.coil_reach_m) * i
    return motor - gun.stiffness_N_m * (x + gun.preload_length_m) - gun.friction_N
