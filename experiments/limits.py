"""A setup against the limits that no config can lift, before any device is opened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from device import LimitError
from device.methods import drive_of, settle_s
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
            raise ConfigError(f"{setup.folder / setup.config.gun}: methods.{name}: {error}") from error
    _check_repetition(setup, found)
    return found


def _check_repetition(setup: Setup[Any], methods: list[MethodLimits]) -> None:
    if not isinstance(setup.config, PreferenceConfig):
        return
    every_s = setup.config.stimulus.repeat_every_s
    for method in methods:
        if every_s < method.settle_s:
            raise ConfigError(
                f"stimulus.repeat_every_s = {every_s:g}: {method.method} needs {method.settle_s:.4g} s until its "
                "magnet is home again; repeat more slowly"
            )
