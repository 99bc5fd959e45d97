"""`recoil simulate`: one shot by the model, a vibration, or a table of shots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from analysis.predict.simulate.request import ModelRequest, SimulateRequest
from analysis.predict.simulate.scene import picked, with_contact
from analysis.predict.simulate.shot import (
    FULL_MODEL,
    SimulatedShot,
    SimulatedVibration,
    check_own,
    collision_with_stop,
    in_hand,
    looked_at,
    method_of,
    parameters_of,
    simulated_shot,
    simulated_vibration,
    up_to,
    vibration_section,
    write_trace,
)
from analysis.predict.simulate.shot import sections as shot_sections
from analysis.report.placing import is_own_picture
from analysis.report.section import Section
from analysis.report.terminal import Progress
from device.parameters import GunParameters
from device.physics.traces import energy_balance
from device.vibration import VibrationParameters
from experiments.config.door import ConfigError
from experiments.load import find, load_gun

if TYPE_CHECKING:
    from analysis.predict.simulate.sweep import Sweep

__all__ = ["ModelRequest", "SimulateRequest", "sections", "simulated"]

AnySimulated: TypeAlias = "SimulatedShot | SimulatedVibration | Sweep"


def simulated(request: SimulateRequest, progress: Progress, tell: Callable[[str], None]) -> AnySimulated:
    """What was asked for; trace, figure and table are written. `ConfigError` for whatever cannot be."""
    stem, config = request.plot_stem, load_gun(find(request.gun))
    for path in request.figures:
        check_own("--plot", path, is_own_picture)
    of = f"{Path(request.gun).name}, {method_of(config, request.method)}"
    rendering = config.rendering(request.method) if request.method in config.methods else None
    if isinstance(rendering, VibrationParameters):
        found: AnySimulated = _vibration(request, rendering)
        _write_vibration(rendering, stem, of)
        _tell_files(request, stem, tell)
        return found
    gun = parameters_of(config, request.method, request.changes)
    if request.vary or request.table:
        from analysis.predict.simulate.sweep import sweep  # noqa: PLC0415 - no shot alone writes tables

        return sweep(request, gun, progress, tell)
    found = _shot(request, gun)
    followed = _write_shot(request, gun, stem, of)
    _tell_files(request, stem, tell)
    if followed and request.of_files:
        tell(f"{' and '.join(request.of_files)}: {followed}; the numbers may reach further")
    _tell_model(request, found.fidelity, tell)
    return found


def sections(found: AnySimulated) -> tuple[Section, ...]:
    """What was simulated, in words."""
    if isinstance(found, SimulatedVibration):
        return (vibration_section(found),)
    if isinstance(found, SimulatedShot):
        return shot_sections(found)
    from analysis.predict.simulate.sweep import table_sections  # noqa: PLC0415 - as above

    return table_sections(found)


def _vibration(request: SimulateRequest, parameters: VibrationParameters) -> SimulatedVibration:
    if others := request.of_one_shot + request.of_models:
        raise ConfigError(
            f"{', '.join(others)}: a vibration has an acceleration and no force (its moving mass is not published); "
            "ask for --trace or --plot, or simulate a voice-coil method"
        )
    return simulated_vibration(parameters, request.trace)


def _write_vibration(parameters: VibrationParameters, stem: Path | None, of: str) -> None:
    if stem:
        from analysis.predict.simulate.panels import write_vibration_plot  # noqa: PLC0415 - what draws waits for it

        write_vibration_plot(parameters, stem, of)


def _shot(request: SimulateRequest, gun: GunParameters) -> SimulatedShot:
    fidelity, pick = picked(request.model, gun, {})
    found = simulated_shot(gun, fidelity)
    speed_m_s, stop_N_m = found.summary.impact_speed_m_s, request.contact_stiffness_N_m
    return replace(
        found,
        scene=pick and with_contact(pick, request.model, gun, speed_m_s),
        audit=looked_at("--audit", energy_balance, gun) if request.audit else None,
        hand=None if request.hand is None else in_hand(gun, request.hand),
        contact=None if stop_N_m is None else collision_with_stop(gun, speed_m_s, stop_N_m),
    )


def _write_shot(request: SimulateRequest, gun: GunParameters, stem: Path | None, of: str) -> str:
    """Trace and figure; how far they follow the shot, if not to its end."""
    shots = [write_trace(gun, request.trace)] if request.trace else []
    if stem:
        from analysis.predict.simulate.panels import write_plot  # noqa: PLC0415 - as above

        shots.append(write_plot(gun, stem, of))
    return up_to(shots[0].given_up_s) if shots else ""


def _tell_files(request: SimulateRequest, stem: Path | None, tell: Callable[[str], None]) -> None:
    if request.trace:
        tell(f"Trace: {request.trace}")
    if stem:
        tell("Figure: " + ", ".join(map(str, request.figures)))


def _tell_model(request: SimulateRequest, fidelity: str, tell: Callable[[str], None]) -> None:
    """What was asked for and is in the numbers alone: trace and figure are of the full model of a gun that is held."""
    given = {
        f"the {fidelity} model": fidelity != "full",
        "--hand": request.hand is not None,
        "--contact-stiffness": request.contact_stiffness_N_m is not None,
    }
    if request.of_files and any(given.values()):
        left = ", ".join(name for name, is_given in given.items() if is_given)
        tell(f"{' and '.join(request.of_files)}: {FULL_MODEL}; {left}: in the numbers alone")
