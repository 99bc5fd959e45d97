"""A setup against the limits that no config can lift, before any device is opened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from device import LimitError
from device.limits import MAX_SHOTS_PER_MINUTE, DriveHistory, Load, load_of
from device.methods import drive_of, settle_s
from device.parameters import GunParameters
from device.words import Drive, Pulse
from experiments.load import ConfigError
from experiments.preference.config import PreferenceConfig
from experiments.setup import Setup


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodLimits:
    """How a method is driven, and how soon its next shot may follow."""

    method: str
    drive: Drive
    settle_s: float

    @property
    def duty(self) -> float:
        """Largest share of time that the coil is driven: shots as fast as the model allows."""
        return self.drive.pulse_s / self.settle_s if isinstance(self.drive, Pulse) else 0.0


def drives(setup: Setup[Any]) -> dict[str, Drive]:
    """How each method of a setup is driven."""
    methods = setup.gun.renderings(setup.config.design.methods)
    return {name: drive_of(method) for name, method in methods.items()}


def check_limits(setup: Setup[Any]) -> list[MethodLimits]:
    """Each method's drive within the limits, or `ConfigError` with method, value and limit."""
    found = []
    for name, method in setup.gun.renderings(setup.config.design.methods).items():
        try:
            found.append(MethodLimits(method=name, drive=drive_of(method), settle_s=settle_s(method)))
        except LimitError as error:
            raise ConfigError(f"{setup.source.parent / setup.config.gun}: methods.{name}: {error}") from error
    _check_repetition(setup, found)
    return found


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
