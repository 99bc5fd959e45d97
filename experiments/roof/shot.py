"""`recoil simulate`: one shot by the model: summary, trace and figure."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from analysis.report.figures import figure_5
from device.parameters import GunParameters
from device.physics import simulate, trace
from experiments import storage
from experiments.load import ConfigError, load_gun
from experiments.roof.pictures import shot_panel


def parameters_of(gun_file: Path, method: str | None, changes: Sequence[str]) -> GunParameters:
    """The parameters of a method of a gun, its first one if none is named, with `key=value` changes."""
    gun = load_gun(gun_file)
    name = method or _first_force_method(gun.methods)
    if name not in gun.methods:
        raise ConfigError(f"--method {name}: the gun has {', '.join(gun.methods)}")
    parameters = gun.rendering(name)
    if not isinstance(parameters, GunParameters):
        raise ConfigError(
            f"--method {name}: a vibration has an acceleration and no force (its moving mass is not published); "
            "simulate a voice-coil method"
        )
    return _changed(parameters, changes)


def _first_force_method(methods: Any) -> str:
    return next((name for name, method in methods.items() if method.actuator == "voice-coil"), "asymmetric-1")


def _changed(parameters: GunParameters, changes: Sequence[str]) -> GunParameters:
    known = {field.name: type(getattr(parameters, field.name)) for field in fields(parameters)}
    values: dict[str, Any] = {}
    for change in changes:
        key, equals, text = change.partition("=")
        if not equals or key not in known:
            raise ConfigError(f"--set {change}: must be key=value with a key of {', '.join(known)}")
        values[key] = _value(change, text, known[key])
    try:
        return replace(parameters, **values)
    except ValueError as error:
        raise ConfigError(f"--set: {error}") from error


def _value(change: str, text: str, kind: type) -> object:
    try:
        return kind(text)
    except ValueError as error:
        raise ConfigError(f"--set {change}: {text!r} is not a number") from error


def summary_of(parameters: GunParameters, fidelity: str) -> dict[str, Any]:
    """The summary of a shot with the parameters it stands for. `ConfigError` for a fidelity that is not known."""
    try:
        summary = simulate(parameters, fidelity=fidelity)
    except ValueError as error:
        raise ConfigError(f"--fidelity {fidelity}: {error}") from error
    return {"fidelity": fidelity, "parameters": asdict(parameters), "summary": asdict(summary)}


def write_trace(parameters: GunParameters, path: Path) -> None:
    """The shot over time as CSV; units end the names."""
    shot = trace(parameters)
    names = [field.name for field in fields(shot) if field.name != "summary"]
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(names)
    writer.writerows(zip(*(getattr(shot, name).tolist() for name in names), strict=True))
    storage.write_whole(path, text.getvalue().encode())


def write_plot(parameters: GunParameters, path: Path) -> None:
    """Figure 5's panels of the shot, as PNG and SVG beside each other."""
    figure_5([shot_panel(f"friction {parameters.friction_N:g} N", parameters)], path.with_suffix(""))


def as_text(found: dict[str, Any]) -> str:
    """The summary for a person: one number a line, units in the names."""
    options = ", ".join(f"{key} {found['parameters'][key]}" for key in ("friction_N", "drive_off", "emf"))
    lines = [f"  {key:20} {_shown(value)}" for key, value in found["summary"].items()]
    return "\n".join([f"One shot, model {found['fidelity']}, {options}", *lines])


def _shown(value: object) -> str:
    return "not reached" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
