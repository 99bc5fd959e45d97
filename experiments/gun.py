"""What `gun.toml` may say: the voice coil, the vibration actuator, and the rendering methods made of them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from device.methods import Method
from device.parameters import GunParameters, VibrationParameters
from experiments.config import Model, Text


class MethodConfig(Model):
    """A rendering method: the actuator, the damper that is set by hand, and what differs from the gun's own numbers."""

    label: Text
    actuator: Literal["voice-coil", "vibration"]
    damper: str = ""
    voice_coil: dict[str, int | float | str] = Field(default_factory=dict)
    vibration: dict[str, int | float] = Field(default_factory=dict)


class GunConfig(Model):
    """A gun and its rendering methods. Numbers are checked by the device's own parameter types."""

    title: Text
    assumed: tuple[Text, ...] = ()
    voice_coil: dict[str, int | float | str] = Field(default_factory=dict)
    vibration: dict[str, int | float] = Field(default_factory=dict)
    methods: dict[str, MethodConfig] = Field(min_length=1)

    @model_validator(mode="after")
    def _renderable(self) -> Self:
        for name in self.methods:
            self.rendering(name)
        return self

    def rendering(self, method: str) -> Method:
        """The device's parameters of one method. `ValueError`: unknown key or a value out of range."""
        own = self.methods[method]
        if own.actuator == "vibration":
            return _build(VibrationParameters, {**self.vibration, **own.vibration}, f"methods.{method}.vibration")
        return _build(GunParameters, {**self.voice_coil, **own.voice_coil}, f"methods.{method}.voice_coil")

    def renderings(self, methods: tuple[str, ...]) -> dict[str, Method]:
        """The device's parameters of several methods. `ValueError` names one that this gun does not have."""
        unknown = [name for name in methods if name not in self.methods]
        if unknown:
            raise ValueError(
                f"design.methods: the gun has no method {', '.join(unknown)}; it has {', '.join(self.methods)}"
            )
        return {name: self.rendering(name) for name in methods}


_Parameters = TypeVar("_Parameters")


def _build(parameters: type[_Parameters], values: dict[str, Any], where: str) -> _Parameters:
    known = [field.name for field in fields(parameters)]  # type: ignore[arg-type] # both are dataclasses
    unknown = sorted(set(values) - set(known))
    if unknown:
        raise ValueError(f"{where}: unknown key {', '.join(unknown)}; known are {', '.join(known)}")
    try:
        return parameters(**values)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from error
