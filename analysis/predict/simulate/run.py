"""`recoil simulate`: one shot by the model, a table of shots over parameters that vary, or a vibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.predict.simulate.scene import ModelRequest, picked, with_contact
from analysis.predict.simulate.shot import (
    SimulatedShot,
    SimulatedVibration,
    collision_with_stop,
    in_hand,
    parameters_of,
    simulated_shot,
    simulated_vibration,
    vibration_section,
    write_plot,
    write_trace,
)
from analysis.predict.simulate.shot import sections as shot_sections
from analysis.predict.simulate.sweep import Sweep, SweepRequest, axis_of, interpreted_note, sweep
from analysis.predict.simulate.sweep import sections as sweep_sections
from analysis.report.section import Section
from analysis.report.terminal import Progress
from device.parameters import GunParameters
from device.physics.traces import energy_balance
from device.vibration import VibrationParameters
from experiments.config.door import ConfigError
from experiments.load import find, load_gun

__all__ = ["ModelRequest", "SimulateRequest", "sections", "simulated"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateRequest:
    """What to simulate of which gun. `changes` are KEY=VALUE, `vary` KEY=VALUES; `table` takes the shots over these."""

    gun: str
    method: str | None
    changes: Sequence[str]
    model: ModelRequest
    trace: Path | None
    plot: Path | None
    audit: bool
    hand: str | None
    contact_stiffness_N_m: float | None
    vary: Sequence[str]
    table: Path | None
    yes: bool

    @property
    def of_one_shot(self) -> list[str]:
        """The options given that tell more of a single shot of a coil."""
        options = {
            "--audit": self.audit or None,
            "--hand": self.hand,
            "--contact-stiffness": self.contact_stiffness_N_m,
        }
        return [name for name, value in options.items() if value is not None]

    @property
    def of_files(self) -> list[str]:
        """The options given that ask for files of a single shot."""
        return [name for name, value in (("--trace", self.trace), ("--plot", self.plot)) if value is not None]

    @property
    def of_models(self) -> list[str]:
        """The options given that a vibration, which has no model, does not know."""
        options = {
            "--fidelity": self.model.fidelity,
            "--scene": self.model.scene,
            "--need": self.model.needs,
            "--set": self.changes,
            "--vary": self.vary,
            "--table": self.table,
        }
        return [name for name, value in options.items() if value]


AnySimulated = SimulatedShot | SimulatedVibration | Sweep


def simulated(request: SimulateRequest, progress: Progress, tell: Callable[[str], None]) -> AnySimulated:
    """What was asked for; trace, figure and table are written. `ConfigError` for whatever cannot be."""
    config = load_gun(find(request.gun))
    rendering = config.rendering(request.method) if request.method in config.methods else None
    if isinstance(rendering, VibrationParameters):
        return _vibration(request, rendering)
    gun = parameters_of(config, request.method, request.changes)
    if request.vary or request.table:
        return _table(request, gun, progress, tell)
    return _shot(request, gun)


def sections(found: AnySimulated) -> tuple[Section, ...]:
    """What was simulated, in words."""
    if isinstance(found, SimulatedVibration):
        return (vibration_section(found),)
    return sweep_sections(found) if isinstance(found, Sweep) else shot_sections(found)


def _vibration(request: SimulateRequest, parameters: VibrationParameters) -> SimulatedVibration:
    if others := request.of_one_shot + request.of_models:
        raise ConfigError(
            f"{', '.join(others)}: a vibration has an acceleration and no force (its moving mass is not published); "
            "ask for --trace or --plot, or simulate a voice-coil method"
        )
    return simulated_vibration(parameters, request.trace, request.plot)


def _table(request: SimulateRequest, gun: GunParameters, progress: Progress, tell: Callable[[str], None]) -> Sweep:
    axes = [axis_of(words, gun) for words in request.vary] if request.model.is_of_scene else []
    fidelity, pick = picked(request.model, gun, {axis.key: axis.values for axis in axes})
    if note := interpreted_note():
        tell(note)
    asked = SweepRequest(
        gun=gun,
        fidelity=fidelity,
        vary=request.vary,
        changes=request.changes,
        table=request.table,
        instead=request.of_files + request.of_one_shot,
        yes=request.yes,
        scene=pick,
    )
    return sweep(asked, progress)


def _shot(request: SimulateRequest, gun: GunParameters) -> SimulatedShot:
    fidelity, pick = picked(request.model, gun, {})
    found = simulated_shot(gun, fidelity)
    speed_m_s, stop_N_m = found.summary.impact_speed_m_s, request.contact_stiffness_N_m
    found = replace(
        found,
        scene=pick and with_contact(pick, request.model, gun, speed_m_s),
        audit=energy_balance(gun) if request.audit else None,
        hand=None if request.hand is None else in_hand(gun, request.hand),
        contact=None if stop_N_m is None else collision_with_stop(gun, speed_m_s, stop_N_m),
    )
    if request.trace:
        write_trace(gun, request.trace)
    if request.plot:
        write_plot(gun, request.plot)
    return found
