"""`recoil simulate`: one shot by the model: summary, trace and figure."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from analysis.predict.simulate.more import as_lines, shown
from analysis.report.figures.shot import ShotPanel, figure_5
from device.parameters import GunParameters
from device.physics import ShotSummary, simulate, trace
from experiments.config.door import ConfigError
from experiments.load import load_gun
from experiments.record import storage

_COARSE_S = 0.0005  # steps above which a curve is drawn with corners
_MOST_POINTS = 40_000


def shot_panel(title: str, parameters: GunParameters) -> ShotPanel:
    """The panel of one shot by the model."""
    shot = trace(parameters)
    if shot.time_s[-1] - shot.time_s[-2] > _COARSE_S:
        shot = trace(parameters, min(int(2 * shot.time_s[-1] / _COARSE_S), _MOST_POINTS))
    return ShotPanel(
        title=title,
        time_s=shot.time_s,
        force_N=shot.force_N,
        displacement_m=shot.displacement_m,
        velocity_m_s=shot.velocity_m_s,
        drive_V=shot.drive_V,
        stage_ends_s=_ends(shot.summary),
        collision_force_N=_or_nan(shot.summary.collision_force_N),
        contact_depth_m=parameters.contact_depth_m,
        status=shot.summary.status,
    )


def _ends(summary: ShotSummary) -> tuple[float, float, float]:
    return _or_nan(summary.recoil_end_s), _or_nan(summary.firing_end_s), _or_nan(summary.reset_end_s)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


KINDS: dict[str, type[float] | type[str]] = {
    field.name: str if isinstance(field.default, str) else float for field in fields(GunParameters)
}
"""What each of a gun's parameters is: a number or a word."""


_TITLE_WIDTH = 44


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
    values: dict[str, Any] = {}
    for change in changes:
        key, equals, text = change.partition("=")
        if not equals or key not in KINDS:
            raise ConfigError(f"--set {change}: must be key=value with a key of {', '.join(KINDS)}")
        values[key] = _value(change, text, KINDS[key])
    try:
        return replace(parameters, **values)
    except ValueError as error:
        raise ConfigError(f"--set: {error}") from error


def _value(change: str, text: str, kind: type[float] | type[str]) -> object:
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
    write_columns(path, {name: getattr(shot, name).tolist() for name in names})


def write_columns(path: Path, columns: dict[str, list[float]]) -> None:
    """Columns of one length as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    storage.write_whole(path, text.getvalue().encode())


def write_plot(parameters: GunParameters, path: Path) -> None:
    """Figure 5's panels of the shot, as PNG and SVG beside each other."""
    title = "\n".join(textwrap.wrap(_title(parameters), _TITLE_WIDTH))
    figure_5([shot_panel(title, parameters)], path.with_suffix(""))


def _title(parameters: GunParameters) -> str:
    """The friction, and every number that is not the paper's."""
    own = (field.name for field in fields(parameters) if getattr(parameters, field.name) != field.default)
    others = [f"{name} = {shown(getattr(parameters, name))}" for name in own if name != "friction_N"]
    return ", ".join([f"friction {parameters.friction_N:g} N", *others])


def as_text(found: dict[str, Any]) -> str:
    """The summary for a person: one number a line, units in the names; then what else was asked for."""
    keys = ("friction_N", "return_friction_N", "drive_off", "emf")
    options = ", ".join(f"{key} {found['parameters'][key]}" for key in keys if found["parameters"][key] is not None)
    lines = [f"  {key:24} {shown(value)}" for key, value in found["summary"].items()]
    return "\n".join([f"One shot, model {found['fidelity']}, {options}", *lines, *as_lines(found)])
