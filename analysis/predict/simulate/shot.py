"""One shot by the model: summary, trace and figure; where energy went, a hand and a stop that give way; a vibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from analysis.predict.simulate.scene import ScenePick, scene_section
from analysis.report.section import Section
from analysis.report.serial import OPTIONAL, as_csv, as_json
from device.parameters import GunParameters
from device.physics import ShotSummary, ShotTrace, simulate, trace
from device.physics.hand import Collision, HandMechanics, compliant_collision, rigid_collision, simulate_held
from device.physics.traces import EnergyBalance
from device.vibration import Vibration, VibrationParameters, solved, waveform
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.record import storage
from experiments.record.provenance import provenance

FULL_MODEL = "full model, enclosure held still, rigid stop"
"""What figures and traces of a shot are of."""
USUAL_HAND = "assumed"
"""The word for the hand of assumed numbers."""
_BALANCE_WORDS = {
    "supplied_J": "by the drive",
    "created_J": "by a back-EMF that is not reciprocal; below 0 what it destroys",
    "switched_off_J": "what the coil held when the drive opened",
    "residual_J": "supplied and created less the rest: rounding",
    "force_impulse_Ns": "of F on the hand",
    "collision_impulse_Ns": "of the impacts on the stop",
    "residual_impulse_Ns": "net over the cycle, less the momentum left",
}
_AFTER_S = 0.4  # looked at after the pulse: a shot's way home and the hand's rest
VIBRATION_POINTS = 2401
_FINE = 200_001  # samples, of which the largest is the peak to nine digits


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotInHand(HandMechanics):
    """A hand, and the shot of the gun that it holds, looked at until `until_s`; the numbers are those of `HeldShot`."""

    until_s: float
    peak_hand_force_N: float
    peak_kick_m: float
    max_displacement_m: float
    turn_s: float | None
    reset_end_s: float | None
    impact_speed_m_s: float | None
    residual_impulse_Ns: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopCollision:
    """The collision with a stop of this stiffness beside the rigid one; None where the magnet does not come home."""

    stop_N_m: float
    rigid: Collision | None
    compliant: Collision | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedShot:
    """The summary of a shot with the parameters it stands for, and what else was asked for."""

    fidelity: str
    parameters: GunParameters
    summary: ShotSummary
    scene: ScenePick | None = field(default=None, metadata=OPTIONAL)
    audit: EnergyBalance | None = field(default=None, metadata=OPTIONAL)
    hand: ShotInHand | None = field(default=None, metadata=OPTIONAL)
    contact: StopCollision | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationSummary:
    """The largest and the mean acceleration, what is left of it at the end, and the two decays."""

    peak_m_s2: float
    rms_m_s2: float
    duration_s: float
    left_at_end_m_s2: float
    frequency_Hz: float
    slow_decay_1_s: float
    fast_decay_1_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedVibration:
    """The acceleration that meets a vibration's published numbers."""

    parameters: VibrationParameters
    summary: VibrationSummary


PARAMETER_KINDS: dict[str, type[float] | type[str]] = {
    field.name: str if isinstance(field.default, str) else float for field in fields(GunParameters)
}
"""What each of a gun's parameters is: a number or a word."""


def parameters_of(gun: GunConfig, method: str | None, changes: Sequence[str]) -> GunParameters:
    """The parameters of a method of a gun, its first one if none is named, with `key=value` changes."""
    name = method_of(gun, method)
    if name not in gun.methods:
        raise ConfigError(f"--method {name}: the gun has {', '.join(gun.methods)}")
    parameters = gun.rendering(name)
    if not isinstance(parameters, GunParameters):
        raise ConfigError(
            f"--method {name}: a vibration has an acceleration and no force (its moving mass is not published); "
            "simulate a voice-coil method"
        )
    return _changed(parameters, changes)


def method_of(gun: GunConfig, method: str | None) -> str:
    """The method that is asked for, else the gun's first one with a voice coil."""
    if method is not None:
        return method
    methods = gun.methods.items()
    return next((name for name, method in methods if method.actuator == "voice-coil"), "asymmetric-1")


def _changed(parameters: GunParameters, changes: Sequence[str]) -> GunParameters:
    values: dict[str, Any] = {}
    for change in changes:
        key, equals, text = change.partition("=")
        if not equals or key not in PARAMETER_KINDS:
            raise ConfigError(f"--set {change}: must be key=value with a key of {', '.join(PARAMETER_KINDS)}")
        values[key] = _value(f"--set {change}", text, PARAMETER_KINDS[key])
    try:
        return replace(parameters, **values)
    except ValueError as error:
        raise ConfigError(f"--set: {error}") from error


def _value(option: str, text: str, kind: type[float] | type[str]) -> Any:
    try:
        return kind(text)
    except ValueError as error:
        raise ConfigError(f"{option}: {text!r} is not a number") from error


def simulated_shot(parameters: GunParameters, fidelity: str) -> SimulatedShot:
    """A shot by a model. `ConfigError` for a fidelity that is not known."""
    try:
        summary = simulate(parameters, fidelity=fidelity)
    except ValueError as error:
        raise ConfigError(f"--fidelity {fidelity}: {error}") from error
    return SimulatedShot(fidelity=fidelity, parameters=parameters, summary=summary)


def in_hand(parameters: GunParameters, words: str) -> ShotInHand:
    """The shot of a gun in a hand of these words. `ConfigError`: words that are none."""
    hand = _hand(words)
    until_s = parameters.pulse_s + _AFTER_S
    try:
        shot = simulate_held(parameters, hand, until_s)
    except (ValueError, RuntimeError) as error:
        raise ConfigError(f"--hand {words}: {error}") from error
    return ShotInHand(**asdict(hand), until_s=until_s, **asdict(shot))


def _hand(words: str) -> HandMechanics:
    if words == USUAL_HAND:
        return HandMechanics()
    known = [field.name for field in fields(HandMechanics)]
    numbers: dict[str, float] = {}
    for word in words.split(","):
        key, equals, text = word.partition("=")
        if not equals or key not in known:
            raise ConfigError(
                f"--hand {words}: must be `{USUAL_HAND}`, or key=value,... with keys of {', '.join(known)}"
            )
        numbers[key] = _value(f"--hand {words}", text, float)
    try:
        return HandMechanics(**numbers)
    except ValueError as error:
        raise ConfigError(f"--hand {words}: {error}") from error


def collision_with_stop(parameters: GunParameters, impact_speed_m_s: float | None, stop_N_m: float) -> StopCollision:
    """The collision with a stop of this stiffness. `ConfigError`: a stiffness that is none."""
    if not 0 < stop_N_m < math.inf:
        raise ConfigError(f"--contact-stiffness {stop_N_m:g}: must be a finite stiffness in N/m above 0")
    if impact_speed_m_s is None:
        return StopCollision(stop_N_m=stop_N_m, rigid=None, compliant=None)
    return StopCollision(
        stop_N_m=stop_N_m,
        rigid=rigid_collision(parameters, impact_speed_m_s),
        compliant=compliant_collision(parameters, impact_speed_m_s, stop_N_m),
    )


def check_own(option: str, path: Path, is_ours: Callable[[Path], bool]) -> None:
    """`ConfigError` for a file in the place of a table that is none of ours; an empty one is nothing."""
    if path.is_file() and path.stat().st_size and not is_ours(path):
        raise ConfigError(f"{option} {path}: holds something else, which is not replaced; name another file")


def place_of_origin(option: str, path: Path) -> Path:
    """Where, beside a table, stands what it was made with. `ConfigError`: something else is there."""
    beside = path.with_name(f"{path.name}.json")
    check_own(option, beside, lambda there: b'"provenance"' in there.read_bytes())
    return beside


def header_of(path: Path) -> str:
    """The first line of a CSV file; of what is none, some text."""
    return storage.first_line(path).decode("utf-8", "replace").strip()


_Looked = TypeVar("_Looked")


def looked_at(option: str, look: Callable[[GunParameters], _Looked], gun: GunParameters) -> _Looked:
    """What an option asks of a shot's course. `ConfigError`: its numbers are beyond what floats can express."""
    try:
        return look(gun)
    except ValueError as error:
        raise ConfigError(f"{option}: {error}; leave {option} out") from error


def write_trace(parameters: GunParameters, path: Path) -> ShotTrace:
    """The shot over time as CSV; units end the names. `ConfigError` where something else is, or beyond floats."""
    shot = looked_at("--trace", trace, parameters)
    arrays = {one.name: getattr(shot, one.name) for one in fields(shot)}
    columns = {name: array.tolist() for name, array in arrays.items() if isinstance(array, np.ndarray)}
    _write_columns(path, columns, _origin(FULL_MODEL, parameters))
    return shot


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceOrigin:
    """Where a trace comes from, written beside it."""

    model: str
    parameters: dict[str, float | str | None]
    provenance: dict[str, str]


def _origin(model: str, parameters: GunParameters | VibrationParameters) -> TraceOrigin:
    return TraceOrigin(model=model, parameters=asdict(parameters), provenance=provenance())


def up_to(given_up_s: float | None) -> str:
    """How far a shot's course is followed, if not to its end."""
    return "" if given_up_s is None else f"up to {given_up_s:.4g} s, where it is more work than is done for a shot"


def _write_columns(path: Path, columns: Mapping[str, Sequence[float]], origin: TraceOrigin) -> None:
    """Columns of one length as CSV, and beside it where they come from; the folder is made if it is missing."""
    check_own("--trace", path, lambda there: header_of(there) == ",".join(columns))
    beside = place_of_origin("--trace", path)
    storage.make_folder(path.parent)
    storage.write_whole(path, as_csv(columns, zip(*columns.values(), strict=True)))
    storage.write_whole(beside, as_json(origin))


def sections(found: SimulatedShot) -> tuple[Section, ...]:
    """The shot in words, with its options: one number a line; the pick before it, what else was asked for after."""
    values, usual = asdict(found.parameters), asdict(GunParameters())
    named = {key: value for key, value in values.items() if key in _ALWAYS_NAMED or value != usual[key]}
    if found.fidelity == "ballistic":
        named["drive_off"] = f"{named['drive_off']}{_NO_COIL}"
    said = ", ".join(f"{key} {in_words(value)}" for key, value in named.items() if value is not None)
    scene = () if found.scene is None else (scene_section(found.scene),)
    shot = Section(title=f"One shot, model {found.fidelity}, {said}", items=_rows(found.summary))
    return *scene, shot, *_more(found)


_ALWAYS_NAMED = ("friction_N", "drive_off", "emf")
"""Of a shot's options; others where they are not the paper's."""
_NO_COIL = " until the recoil is over (then no coil)"


def _more(found: SimulatedShot) -> Iterator[Section]:
    if found.audit is not None:
        rows = (
            f"{name:24} {in_words(value):12} {_BALANCE_WORDS.get(name, '')}".rstrip()
            for name, value in asdict(found.audit).items()
            if name != "given_up_s"
        )
        until = up_to(found.audit.given_up_s) or "until the magnet rests, at most 10 s"
        yield Section(title=f"Energy and momentum, full model, {until}", items=tuple(rows))
    if found.hand is not None:
        title = "In a hand: enclosure on a spring and damper (numbers of the hand first)"
        yield Section(title=title, items=_rows(found.hand))
    if found.contact is not None and found.contact.rigid is None:
        yield Section(title="Collision: none, the magnet does not come home")
    elif found.contact is not None:
        yield Section(title="Collision with a rigid stop (equation 4)", items=_rows(found.contact.rigid))
        title = f"Collision with a stop of {found.contact.stop_N_m:g} N/m"
        yield Section(title=title, items=_rows(found.contact.compliant))


def _rows(numbers: Any) -> tuple[str, ...]:
    """A line for each field."""
    return tuple(f"{one.name:24} {in_words(getattr(numbers, one.name))}" for one in fields(numbers))


def in_words(value: object) -> str:
    """A value for a person: six digits, and words for what was not reached."""
    return "not reached" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def simulated_vibration(parameters: VibrationParameters, trace_file: Path | None) -> SimulatedVibration:
    """What the vibration comes to; its trace is written. `ConfigError`: there is no such one."""
    try:
        vibration = solved(parameters)
    except ValueError as error:
        raise ConfigError(f"vibration: {error}") from error
    if trace_file:
        time_s, acceleration = waveform(parameters, VIBRATION_POINTS)
        columns = {"time_s": time_s.tolist(), "acceleration_m_s2": acceleration.tolist()}
        _write_columns(trace_file, columns, _origin("vibration", parameters))
    return SimulatedVibration(parameters=parameters, summary=_vibration_summary(parameters, vibration))


def vibration_section(found: SimulatedVibration) -> Section:
    """The vibration in words."""
    return Section(title="One vibration: two decaying sinusoids of one frequency", items=_rows(found.summary))


def _vibration_summary(parameters: VibrationParameters, vibration: Vibration) -> VibrationSummary:
    time_s = np.linspace(0.0, parameters.duration_s, _FINE)
    slow, fast = sorted({-float(rate) for rate in vibration.poles.real})
    return VibrationSummary(
        peak_m_s2=float(np.abs(vibration.acceleration_m_s2(time_s)).max()),
        rms_m_s2=vibration.rms_m_s2(parameters.duration_s),
        duration_s=parameters.duration_s,
        left_at_end_m_s2=vibration.envelope_m_s2(parameters.duration_s),
        frequency_Hz=parameters.frequency_Hz,
        slow_decay_1_s=slow,
        fast_decay_1_s=fast,
    )
