"""What `recoil simulate` tells of a shot beyond its summary: where energy went, a hand and a stop that give way."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from typing import Any

from device.parameters import GunParameters
from device.physics.hand import HandMechanics, compliant_collision, rigid_collision, simulate_held
from device.physics.traces import energy_balance
from experiments.config.door import ConfigError

ASSUMED = "assumed"
"""The word for the hand of assumed numbers."""
_AUDIT_WORDS = {
    "supplied_J": "by the drive",
    "created_J": "by a back-EMF that is not reciprocal; below 0 what it destroys",
    "switched_off_J": "what the coil held when the drive opened",
    "residual_J": "supplied and created less the rest: rounding",
    "force_impulse_Ns": "of F on the hand",
    "collision_impulse_Ns": "of the impacts on the stop",
    "residual_impulse_Ns": "net over the cycle, less the momentum left",
}
_AFTER_S = 0.4  # looked at after the pulse: a shot's way home and the hand's rest


def asked_for(
    parameters: GunParameters, summary: dict[str, Any], audit: bool, hand: str | None, stop_N_m: float | None
) -> dict[str, Any]:
    """What is asked for beyond the summary, by name. `ConfigError`: a hand or a stop that is none."""
    found: dict[str, Any] = {}
    if audit:
        found["audit"] = audited(parameters)
    if hand is not None:
        found["hand"] = held(parameters, hand)
    if stop_N_m is not None:
        found["contact"] = struck(parameters, summary["impact_speed_m_s"], stop_N_m)
    return found


def audited(parameters: GunParameters) -> dict[str, Any]:
    """The energies and impulses of the shot by the full model, until the magnet rests."""
    return asdict(energy_balance(parameters))


def held(parameters: GunParameters, words: str) -> dict[str, Any]:
    """The shot of a gun in a hand of these words, with the hand's numbers. `ConfigError`: words that are none."""
    hand = _hand(words)
    until_s = parameters.pulse_s + _AFTER_S
    try:
        shot = simulate_held(parameters, hand, until_s)
    except (ValueError, RuntimeError) as error:
        raise ConfigError(f"--hand {words}: {error}") from error
    return asdict(hand) | {"until_s": until_s} | asdict(shot)


def _hand(words: str) -> HandMechanics:
    if words == ASSUMED:
        return HandMechanics()
    known = [field.name for field in fields(HandMechanics)]
    numbers: dict[str, float] = {}
    for word in words.split(","):
        key, equals, text = word.partition("=")
        if not equals or key not in known:
            raise ConfigError(f"--hand {words}: must be `{ASSUMED}`, or key=value,... with keys of {', '.join(known)}")
        numbers[key] = _number(f"--hand {words}", text)
    try:
        return HandMechanics(**numbers)
    except ValueError as error:
        raise ConfigError(f"--hand {words}: {error}") from error


def struck(parameters: GunParameters, impact_speed_m_s: float | None, stop_N_m: float) -> dict[str, Any]:
    """The collision with a stop of this stiffness beside the rigid one. `ConfigError`: a stiffness that is none.

    Numbers are None where the magnet does not come home.
    """
    if not 0 < stop_N_m < math.inf:
        raise ConfigError(f"--contact-stiffness {stop_N_m:g}: must be a finite stiffness in N/m above 0")
    if impact_speed_m_s is None:
        return {"stop_N_m": stop_N_m, "rigid": None, "compliant": None}
    return {
        "stop_N_m": stop_N_m,
        "rigid": asdict(rigid_collision(parameters, impact_speed_m_s)),
        "compliant": asdict(compliant_collision(parameters, impact_speed_m_s, stop_N_m)),
    }


def _number(place: str, text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ConfigError(f"{place}: {text!r} is not a number") from error


def as_lines(found: dict[str, Any]) -> list[str]:
    """What was asked for beyond the summary, for a person."""
    lines: list[str] = []
    if "audit" in found:
        lines += ["Energy and momentum, full model, until the magnet rests", *_audit_lines(found["audit"])]
    if "hand" in found:
        lines += ["In a hand: enclosure on a spring and damper (numbers of the hand first)", *_rows(found["hand"])]
    if "contact" in found:
        lines += _contact_lines(found["contact"])
    return lines


def _audit_lines(table: dict[str, float]) -> list[str]:
    return [f"  {key:24} {shown(value):12} {_AUDIT_WORDS.get(key, '')}".rstrip() for key, value in table.items()]


def _contact_lines(contact: dict[str, Any]) -> list[str]:
    if contact["rigid"] is None:
        return ["Collision: none, the magnet does not come home"]
    return [
        "Collision with a rigid stop (equation 4)",
        *_rows(contact["rigid"]),
        f"Collision with a stop of {contact['stop_N_m']:g} N/m",
        *_rows(contact["compliant"]),
    ]


def _rows(table: dict[str, Any]) -> list[str]:
    return [f"  {key:24} {shown(value)}" for key, value in table.items()]


def shown(value: object) -> str:
    """A value for a person: six digits, and words for what was not reached."""
    return "not reached" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
