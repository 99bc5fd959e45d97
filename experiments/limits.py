"""A setup against the limits that no config can lift, before any device is opened."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device import LimitError
from device.limits import MAX_SHOTS_PER_MINUTE, DriveHistory, Load, load_of
from device.methods import GunParameters, drive_of, rendering_of
from device.words import Drive
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig, Setup
from experiments.preference.config import PreferenceConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodLimits:
    """How a method is driven, and how soon its next shot may follow."""

    method: str
    drive: Drive
    settle_s: float


def check_limits(setup: Setup[Any]) -> list[MethodLimits]:
    """Each method's drive within the limits, or `ConfigError` with method, value and limit."""
    found = check_methods(setup.gun, setup.config.design.methods, setup.source.parent / setup.config.gun)
    _check_repetition(setup, found)
    return found


def check_methods(gun: GunConfig, methods: tuple[str, ...], source: Path) -> list[MethodLimits]:
    """Methods of a gun that can be run: within the limits, and moving. `ConfigError` names file, method and rule."""
    found = []
    for name, method in gun.renderings(methods).items():
        try:
            drive, rendering = drive_of(method), rendering_of(method)
        except LimitError as error:
            raise ConfigError(f"{source}: methods.{name}: {error}") from error
        if isinstance(method, GunParameters) and rendering.motion == "no-break-away":
            raise ConfigError(f"{source}: methods.{name}: {_never_moves(method)}")
        found.append(MethodLimits(method=name, drive=drive, settle_s=rendering.settle_s))
    return found


def _never_moves(gun: GunParameters) -> str:
    """Why no shot of a gun ever moves: what holds the standing magnet, and what the coil pulls with at the most.

    Held by k x_0 + F_f; pulled by k_m i, where i = V/R (1 - exp(-R t/L)) is largest at the end of the pulse.
    """
    held_N = gun.stiffness_N_m * gun.preload_length_m + gun.friction_N
    share = -math.expm1(-gun.resistance_ohm * gun.pulse_s / gun.inductance_H)
    pull_N = gun.motor_constant_N_A * gun.voltage_V / gun.resistance_ohm * share
    return (
        f"no shot ever moves the magnet, by the model: spring and friction hold it with {held_N:.4g} N "
        f"(friction_N {gun.friction_N:g}), and the coil pulls with {pull_N:.4g} N at the most (voltage_V "
        f"{gun.voltage_V:g} for pulse_s {gun.pulse_s:g}); lower the friction, or raise the voltage or the pulse"
    )


def _check_repetition(setup: Setup[Any], methods: list[MethodLimits]) -> None:
    """A whole train against the device's own limits, before any device is opened."""
    if not isinstance(setup.config, PreferenceConfig):
        return
    every_s, shots = setup.config.stimulus.repeat_every_s, setup.config.fatigue.max_shots_per_trial
    for method in methods:
        load, history = _load(setup, method), DriveHistory()
        try:
            for start_s in (shot * every_s for shot in range(min(shots, _ENOUGH_SHOTS))):
                history = history.record(load, start_s, start_s + method.settle_s)
        except LimitError as error:
            raise ConfigError(
                f"{setup.source}: stimulus.repeat_every_s = {every_s:g}: {method.method} needs {method.settle_s:.4g} s "
                f"until its magnet is home, and no more than {MAX_SHOTS_PER_MINUTE} shots a minute are allowed "
                f"({error}); repeat more slowly"
            ) from error


_ENOUGH_SHOTS = 2 * MAX_SHOTS_PER_MINUTE
"""A train that keeps the limits for so long keeps them for ever, but for the coil, which is warm by then as well."""


def _load(setup: Setup[Any], method: MethodLimits) -> Load:
    parameters = setup.gun.rendering(method.method)
    return load_of(method.drive, parameters.resistance_ohm if isinstance(parameters, GunParameters) else 0.0)
