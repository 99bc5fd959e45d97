"""A setup, resolved and hashed by one spelling of every value: an experiment's config with the gun that it runs on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import Field as DataclassField
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Generic, Literal, Self, TypeVar

from pydantic import Field, PrivateAttr, field_validator, model_validator

from device.methods import Method
from device.parameters import GunParameters, VibrationParameters, damper_friction
from experiments.config.door import Model, Text
from experiments.config.lines import LineText, name_fault

Numbers = dict[str, object]
"""A table for one of the device's parameter types, which say what may stand in it."""


class StripsConfig(Model):
    """Two rubber strips pressed on the magnet, equation (5); they add to the gun's friction without damper.

    `brakes`: both ways, or the magnet's return alone (the paper's future work).
    """

    coefficient: float
    stiffness_N_m: float
    deformation_m: float
    brakes: Literal["both", "return"] = "both"


class MethodConfig(Model):
    """A rendering method: the actuator, the damper that is set by hand, and what differs from the gun's own numbers."""

    label: LineText
    actuator: Literal["voice-coil", "vibration"]
    damper: str = ""
    voice_coil: Numbers = Field(default_factory=dict)
    vibration: Numbers = Field(default_factory=dict)
    strips: StripsConfig | None = None


class SerialConfig(Model):
    """The line to a gun: beyond which 95th percentile of the round trip `recoil doctor` warns.

    Assumed: 10 ms, beyond which a USB adapter keeps bytes back, 16 ms as it leaves the factory.
    """

    round_trip_limit_s: float = Field(default=0.010, gt=0, le=1)


class GunConfig(Model):
    """A gun and its rendering methods. Numbers are checked by the device's own parameter types.

    `serial` says nothing about a run, so it is no part of a run's record and hash.
    """

    title: Text
    assumed: tuple[Text, ...] = ()
    voice_coil: Numbers = Field(default_factory=dict)
    vibration: Numbers = Field(default_factory=dict)
    methods: dict[str, MethodConfig] = Field(min_length=1)
    serial: SerialConfig = Field(default_factory=SerialConfig, exclude=True)

    @field_validator("methods")
    @classmethod
    def _named_in_print(cls, methods: dict[str, MethodConfig]) -> dict[str, MethodConfig]:
        for name in methods:
            if fault := name_fault(name):
                raise ValueError(f"the name of a method {fault}")
        return methods

    _rendered: dict[str, Method] = PrivateAttr(default_factory=dict)
    """The methods as the device takes them, made once, when the gun is."""

    @model_validator(mode="after")
    def _render(self) -> Self:
        self._rendered.update((name, self._made(name)) for name in self.methods)
        return self

    @property
    def coil(self) -> GunParameters:
        """The voice coil by itself, without what methods change of it."""
        return _build(GunParameters, self.voice_coil, {}, "", "voice_coil")

    @property
    def labels(self) -> dict[str, str]:
        """What the gun calls its methods."""
        return {name: method.label for name, method in self.methods.items()}

    def rendering(self, method: str) -> Method:
        """The device's parameters of one method."""
        return self._rendered[method]

    def _made(self, method: str) -> Method:
        """What a method's tables make. `ValueError`: unknown key or a value out of range."""
        own = self.methods[method]
        if own.actuator == "vibration":
            if own.strips:
                raise ValueError(f"methods.{method}.strips: a vibration has no magnet to brake; leave the strips out")
            return _build(VibrationParameters, self.vibration, own.vibration, f"methods.{method}.", "vibration")
        gun = _build(GunParameters, self.voice_coil, own.voice_coil, f"methods.{method}.", "voice_coil")
        return _damped(gun, own.strips, own.voice_coil, f"methods.{method}.") if own.strips else gun

    def renderings(self, methods: tuple[str, ...]) -> dict[str, Method]:
        """The device's parameters of several methods. `ValueError` names one that this gun does not have."""
        unknown = [name for name in methods if name not in self.methods]
        if unknown:
            raise ValueError(
                f"factors.method: the gun has no method {', '.join(unknown)}; it has {', '.join(self.methods)}"
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
    known = {field.name: _kind_of(field) for field in fields(parameters)}  # type: ignore[arg-type] # dataclasses
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


def _kind_of(field: DataclassField[object]) -> type:
    """What a key takes; None as the default stands for a number that may be left out."""
    return float if field.default is None else type(field.default)


def _damped(gun: GunParameters, strips: StripsConfig, own: Numbers, method: str) -> GunParameters:
    """The gun with its method's strips. `ValueError`: numbers out of range, or a friction named beside them."""
    named = [key for key in ("friction_N", "return_friction_N") if key in own]
    if named:
        raise ValueError(
            f"{method}voice_coil.{', '.join(named)} stands beside {method}strips, which give the method's friction; "
            "keep one of them"
        )
    numbers = strips.model_dump(exclude={"brakes"})
    try:
        back_N = damper_friction(gun.homeward_friction_N, **numbers)
        if strips.brakes == "return":
            return replace(gun, return_friction_N=back_N)
        friction_N = damper_friction(gun.friction_N, **numbers)
    except ValueError as error:
        raise ValueError(f"{method}strips.{error}") from error
    return replace(gun, friction_N=friction_N, return_friction_N=None if gun.return_friction_N is None else back_N)


def canonical_json(value: object) -> bytes:
    """UTF-8 JSON with sorted keys, no blanks and no NaN; floats in Python's shortest round-trip form.

    >>> canonical_json({"b": 1, "a": [0.1, "é"]}).decode()
    '{"a":[0.1,"é"],"b":1}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()


def sha256(value: object) -> str:
    """The SHA-256 of a value's canonical JSON, in hexadecimal."""
    return hashlib.sha256(canonical_json(value)).hexdigest()


_IN_ORDER = ("factors", "questions")
"""Tables of a design whose order means something: conditions are planned, and questions asked, in it."""


def orders_of(values: Mapping[str, object]) -> dict[str, list[str]]:
    """The names in those tables of a design whose order means something: hashes do not tell it.

    >>> orders_of({"questions": {"strength": {}, "comfort": {}}, "title": "A study"})
    {'questions': ['strength', 'comfort']}
    """
    return {name: [*table] for name in _IN_ORDER if isinstance(table := values.get(name), Mapping)}


Config_co = TypeVar("Config_co", bound=Model, covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup(Generic[Config_co]):
    """A design and its gun. `source` is the design's file.

    `laws`: how synthetic people answer; no part of the record, as only simulation needs them.
    """

    config: Config_co
    gun: GunConfig
    source: Path
    laws: Model | None = None

    def record(self) -> dict[str, object]:
        """All of it as plain JSON values."""
        return {
            "experiment": self.config.model_dump(mode="json"),
            "gun": self.gun.model_dump(mode="json"),
        }

    def sha256(self) -> str:
        """The hash that names this setup."""
        return sha256(self.record())
