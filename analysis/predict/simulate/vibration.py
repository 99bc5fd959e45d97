"""`recoil simulate` of a vibration: the acceleration that meets its published numbers, its trace and figure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from analysis.predict.simulate.more import shown
from analysis.predict.simulate.shot import write_columns
from analysis.report.figures.shot import VibrationPanel, figure_vibration
from device.vibration import Vibration, VibrationParameters, solved, waveform
from experiments.config.door import ConfigError
from experiments.load import load_gun

_POINTS = 2401
_FINE = 200_001  # samples, of which the largest is the peak to nine digits


def vibration_of(gun_file: Path, method: str | None) -> VibrationParameters | None:
    """The parameters of a method that is a vibration, else None."""
    gun = load_gun(gun_file)
    found = gun.rendering(method) if method in gun.methods else None
    return found if isinstance(found, VibrationParameters) else None


def tell(parameters: VibrationParameters, trace: Path | None, plot: Path | None, others: list[str]) -> dict[str, Any]:
    """What the vibration comes to; its trace and figure are written. `ConfigError`: there is no such one."""
    if others:
        raise ConfigError(
            f"{', '.join(others)}: a vibration has an acceleration and no force (its moving mass is not published); "
            "ask for --trace or --plot, or simulate a voice-coil method"
        )
    try:
        vibration = solved(parameters)
    except ValueError as error:
        raise ConfigError(f"vibration: {error}") from error
    if trace:
        time_s, acceleration = waveform(parameters, _POINTS)
        write_columns(trace, {"time_s": time_s.tolist(), "acceleration_m_s2": acceleration.tolist()})
    if plot:
        figure_vibration(_panel(parameters, vibration), plot.with_suffix(""))
    return {"parameters": asdict(parameters), "summary": _summary(parameters, vibration)}


def as_text(found: dict[str, Any]) -> str:
    """The vibration for a person."""
    lines = [f"  {key:24} {shown(value)}" for key, value in found["summary"].items()]
    return "\n".join(["One vibration: two decaying sinusoids of one frequency", *lines])


def _summary(parameters: VibrationParameters, vibration: Vibration) -> dict[str, float]:
    time_s = np.linspace(0.0, parameters.duration_s, _FINE)
    slow, fast = sorted({-float(rate) for rate in vibration.poles.real})
    return {
        "peak_m_s2": float(np.abs(vibration.acceleration_m_s2(time_s)).max()),
        "rms_m_s2": vibration.rms_m_s2(parameters.duration_s),
        "duration_s": parameters.duration_s,
        "left_at_end_m_s2": vibration.envelope_m_s2(parameters.duration_s),
        "frequency_Hz": parameters.frequency_Hz,
        "slow_decay_1_s": slow,
        "fast_decay_1_s": fast,
    }


def _panel(parameters: VibrationParameters, vibration: Vibration) -> VibrationPanel:
    time_s = np.linspace(0.0, 1.25 * parameters.duration_s, _POINTS)
    return VibrationPanel(
        title=f"Vibration, effect {parameters.effect} at {parameters.frequency_Hz:g} Hz",
        time_s=time_s,
        acceleration_m_s2=vibration.acceleration_m_s2(time_s),
        envelope_m_s2=np.array([vibration.envelope_m_s2(time) for time in time_s.tolist()]),
        peak_m_s2=parameters.peak_m_s2,
        rms_m_s2=parameters.rms_m_s2,
        duration_s=parameters.duration_s,
    )
