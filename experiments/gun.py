"""What `gun.toml` may say: the voice coil, the vibration actuator, and the rendering methods made of them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from device.methods import Method
from device.parameters import GunParameters, VibrationParameters
from experiments.config import Model, Text

Numbers = dict[str, Any]
"""A table for one of the device's parameter types, which say what may stand in it."""


class MethodConfig(Model):
    """A rendering method: the actuator, the damper that is set by hand, and what differs from the gun's own numbers."""

    label: Text
    actuator: Literal["voice-coil", "vibration"]
    damper: str = ""
    voice_coil: Numbers = Field(default_factory=dict)
    vibration: Numbers = Field(default_factory=dict)


class GunConfig(Model):
    """A gun and its rendering methods. Numbers are checked by the device's own parameter types."""

    title: Text
    assumed: tuple[Text, ...] = ()
    voice_coil: Numbers = Field(default_factory=dict)
    vibration: Numbers = Field(default_factory=dict)
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
            return _build(VibrationParameters, self.vibration, own.vibration, f"methods.{method}.", "vibration")
        return _build(GunParameters, self.voice_coil, own.voice_coil, f"methods.{method}.", "voice_coil")

    def renderings(self, methods: tuple[str, ...]) -> dict[str, Method]:
        """The device's parameters of several methods. `ValueError` names one that this gun does not have."""
        unknown = [name for name in methods if name not in self.methods]
        if unknown:
            raise ValueError(
                f"design.methods: the gun has no method {', '.join(unknown)}; it has {', '.join(self.methods)}"
            )
        return {name: self.rendering(name) for name in methods}


_Parameters = TypeVar("_Parameters")
_KINDS: dict[type, tuple[tuple[type, ...], str]] = {
    float: ((int, float), "a number"),
    int: ((int,), "a whole number"),
    str: ((str,), "text"),
}


def _build(parameters: type[_Parameters], shared: Numbers, own: Numbers, method: str, table: str) -> _Parameters:
    """The device's own parameter type, which checks ranges; keys and kinds of values are checked here.

    A method's `own` values come before those it shares with the gun's other methods.
    """
    known = {field.name: type(field.default) for field in fields(parameters)}  # type: ignore[arg-type] # dataclasses
    values = {**shared, **own}
    for key, value in values.items():
        place = f"{method if key in own else ''}{table}.{key}"
        if key not in known:
            raise ValueError(f"{place} is an unknown key; known are {', '.join(known)}")
        kinds, name = _KINDS[known[key]]
        if isinstance(value, bool) or not isinstance(value, kinds):
            raise ValueError(f"{place} is {value!r}; it must be {name}")
    try:
        return parameters(**values)
    except ValueError as error:
        key = str(error).split(maxsplit=1)[0]
        raise ValueError(f"{method if key in own else ''}{table}.{error}") from error
