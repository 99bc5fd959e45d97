"""The figures of one shot and of a vibration."""

from __future__ import annotations

import math
import textwrap
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from analysis.predict.simulate.shot import FULL_MODEL, VIBRATION_POINTS, in_words, looked_at
from analysis.report.figures.shot import ShotPanel, VibrationPanel, figure_5, figure_vibration
from analysis.report.placing import files_in
from device.parameters import GunParameters
from device.physics import ShotTrace, trace
from device.vibration import Vibration, VibrationParameters, solved
from experiments.config.door import ConfigError

_COARSE_S = 0.0005  # steps above which a curve is drawn with corners
_MOST_POINTS = 40_000
_TITLE_WIDTH = 52
_LARGEST_DRAWN = 1e100  # beyond it the products of an axis overflow


def shot_panel(title: str, shot: ShotTrace, contact_depth_m: float) -> ShotPanel:
    """The panel of one shot by the model. What comes after its course was given up is not in it."""
    summary, last_s = shot.summary, math.inf if shot.given_up_s is None else shot.given_up_s
    ends = [_or_nan(end_s) for end_s in (summary.recoil_end_s, summary.firing_end_s, summary.reset_end_s)]
    recoil_s, firing_s, reset_s = (end_s if end_s <= last_s else math.nan for end_s in ends)
    return ShotPanel(
        title=title,
        time_s=shot.time_s,
        force_N=shot.force_N,
        displacement_m=shot.displacement_m,
        velocity_m_s=shot.velocity_m_s,
        drive_V=shot.drive_V,
        stage_ends_s=(recoil_s, firing_s, reset_s),
        collision_force_N=_or_nan(summary.collision_force_N),
        contact_depth_m=contact_depth_m,
        status=summary.status if shot.given_up_s is None else f"followed to {last_s:.4g} s",
    )


def smooth_trace(parameters: GunParameters) -> ShotTrace:
    """The shot over time, in steps that draw no corners. `ConfigError`: its numbers are beyond floats."""
    shot = looked_at("--plot", trace, parameters)
    if shot.time_s[-1] - shot.time_s[-2] > _COARSE_S:
        return trace(parameters, min(int(2 * shot.time_s[-1] / _COARSE_S), _MOST_POINTS))
    return shot


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def write_plot(parameters: GunParameters, stem: Path, of: str) -> ShotTrace:
    """Figure 5's panels of the shot by the full model, with all that it was made with; PNG, SVG and PDF.

    `of` names gun and method. `ConfigError`: the shot's numbers are too large for any drawing.
    """
    back_N = parameters.return_friction_N
    friction = f"Friction {parameters.friction_N:g} N{'' if back_N is None else f' ({back_N:g} N on the way back)'}"
    title = f"{friction}, coil {parameters.drive_off} after the pulse"
    shot = smooth_trace(parameters)
    panel = shot_panel("\n".join(textwrap.wrap(title, _TITLE_WIDTH)), shot, parameters.contact_depth_m)
    _check_drawable(panel)
    with files_in(stem.parent) as part:
        figure_5([replace(panel, options=f"{of}; {FULL_MODEL}: {_options(parameters)}")], part / stem.name)
    return shot


def _check_drawable(panel: ShotPanel) -> None:
    arrays = (panel.time_s, panel.force_N, panel.displacement_m, panel.velocity_m_s, panel.drive_V)
    if not all(np.all(np.abs(one) < _LARGEST_DRAWN) for one in arrays):
        raise ConfigError(f"--plot: this shot goes beyond {_LARGEST_DRAWN:g}, which no axis holds; leave --plot out")


def _options(parameters: GunParameters | VibrationParameters) -> str:
    """Every one by the name that --set knows it by, also those that are the paper's or assumed."""
    values = {one.name: getattr(parameters, one.name) for one in fields(parameters)}
    said = [f"{name}={in_words(value)}" for name, value in values.items() if value is not None]
    return " ".join(said)


def write_vibration_plot(parameters: VibrationParameters, stem: Path, of: str) -> None:
    """The vibration over time, with all that it was made with, as PNG, SVG and PDF. `of` names gun and method."""
    panel = _vibration_panel(parameters, solved(parameters))
    options = f"{of}; dotted: the envelope. {_options(parameters)}"
    with files_in(stem.parent) as part:
        figure_vibration(replace(panel, options=options), part / stem.name)


def _vibration_panel(parameters: VibrationParameters, vibration: Vibration) -> VibrationPanel:
    time_s = np.linspace(0.0, 1.25 * parameters.duration_s, VIBRATION_POINTS)
    return VibrationPanel(
        title=f"Vibration, effect {parameters.effect} at {parameters.frequency_Hz:g} Hz",
        time_s=time_s,
        acceleration_m_s2=vibration.acceleration_m_s2(time_s),
        envelope_m_s2=np.array([vibration.envelope_m_s2(time) for time in time_s.tolist()]),
        peak_m_s2=parameters.peak_m_s2,
        rms_m_s2=parameters.rms_m_s2,
        duration_s=parameters.duration_s,
    )
