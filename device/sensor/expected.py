"""What a sensor on the enclosure sees of a good shot by the model, in a hand as assumed, through the same reckoning."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from device.methods import Method
from device.parameters import GunParameters
from device.physics.hand import HandMechanics, Vector, held_acceleration, simulate_held
from device.sensor.measuring import BEFORE_S, ExpectedShot, SensorTrace, measured
from device.sensor.turn import ExpectedTurn
from device.vibration import waveform

NO_COURSE = "nothing moves in this shot by the model, or it does not come to an end"
"""Why a shot is not measured of which nothing is expected."""
_HELD_S = 0.15
"""The held shot is reckoned for so long: past every magnet's turn."""
FINE_S = 2e-5
"""From one moment of a modelled course to the next."""
CLEAN = 0.15
"""A friction is measured where the model's own course gives it to so much; else other steps lie too near."""
_PLACES = 4
"""So many places between two samples the onset is put at."""


def modelled_acceleration(actuator: Method, time_s: Vector, hand: HandMechanics | None = None) -> Vector:
    """The acceleration in m/s2 that a shot of the method gives to the enclosure, at times from its onset.

    That of a vibration is the device's, as it was measured.
    """
    if isinstance(actuator, GunParameters):
        return held_acceleration(actuator, time_s, hand, _HELD_S)
    points, course = waveform(actuator, 1 + round(actuator.duration_s / FINE_S))
    return np.interp(time_s, points, course, 0.0, 0.0)


@lru_cache(maxsize=64)
def expected_shot(actuator: Method, rate_Hz: float) -> ExpectedShot | None:
    """What is expected of a shot at so many samples a second; `None` where nothing moves, or the model gives no course.

    The means over several places of the samples, and their standard deviations.
    """
    hand = HandMechanics()
    fine = np.arange(0.0, _HELD_S, FINE_S)
    try:
        course = modelled_acceleration(actuator, fine, hand)
    except RuntimeError:  # the magnet sticks and slips without end
        return None
    peak = float(np.abs(course).max())
    if peak == 0.0:
        return None
    top = int(np.abs(course[: round(0.012 / FINE_S)]).argmax())
    rise_s = float(fine[int((np.abs(course) >= abs(course[top]) / 2).argmax())])
    turn = _turn(actuator, hand) if isinstance(actuator, GunParameters) else None
    raw = ExpectedShot(peak_m_s2=abs(float(course[top])), rise_s=rise_s, turn=turn)
    return _as_measured(raw, fine, course, rate_Hz)


def _turn(gun: GunParameters, hand: HandMechanics) -> ExpectedTurn | None:
    """Where the magnet turns; `None` where it does not, or where no friction is."""
    shot, friction_N = simulate_held(gun, hand, _HELD_S), (gun.friction_N + gun.homeward_friction_N) / 2
    if shot.turn_s is None or friction_N == 0:
        return None
    return ExpectedTurn(
        turn_s=shot.turn_s,
        free_s=shot.turn_s - gun.pulse_s,
        enclosure_kg=hand.enclosure_mass_kg,
        magnet_kg=gun.magnet_mass_kg,
        pull_N=gun.stiffness_N_m * (shot.max_displacement_m + gun.preload_length_m),
        friction_N=friction_N,
        outward=gun.friction_N / friction_N,
    )


def _as_measured(raw: ExpectedShot, fine: Vector, course: Vector, rate_Hz: float) -> ExpectedShot:
    grid = np.arange(-BEFORE_S, raw.until_s, 1 / rate_Hz)
    places = [grid + place / _PLACES / rate_Hz for place in range(_PLACES)]
    shots = [
        shot
        for times in places
        if (shot := measured(SensorTrace(time_s=times, acceleration_m_s2=np.interp(times, fine, course)), 0.0, raw))
    ]
    frictions = [shot.friction.at_scale()[0] for shot in shots if shot.friction is not None]
    found = raw.turn is not None and len(frictions) == len(shots) > 0
    friction_N = float(np.mean(frictions)) if found else None
    clean = raw.turn is not None and friction_N is not None and abs(friction_N / raw.turn.friction_N - 1) < CLEAN
    return replace(
        raw,
        peak_m_s2=float(np.mean([shot.peak_m_s2 for shot in shots])),
        peak_sampling_m_s2=float(np.std([shot.peak_m_s2 for shot in shots])),
        rise_s=raw.rise_s + float(np.mean([shot.onset_s for shot in shots])),
        turn=raw.turn if clean else None,
        friction_N=friction_N if clean else None,
    )
