"""The closed forms: the magnet at rest, and the magnet beyond the coil's force.

At rest i(t) = u/R + (i_0 - u/R) exp(-t R/L). Free, x'' = a - w^2 (x - x_start), in forms that lose no digits and stay
finite for k = 0.
"""

from __future__ import annotations

import math

from device.physics.kernel import (
    BACK_EMF,
    FRICTION_BACK,
    FRICTION_OUT,
    INDUCTANCE,
    MASS,
    MOTOR,
    PRELOAD,
    REACH,
    RECIPROCAL,
    RESISTANCE,
    STIFFNESS,
    Floats,
    kernel,
)

_SLACK = 1e-12  # relative: the magnet breaks away this far beyond the threshold, so that it does accelerate
_SLACK_FLOOR_N = 1e-15  # the same for a gun with neither spring nor friction


@kernel
def spring_force(p: Floats, x: float) -> float:
    """The spring's push towards the stop in N, k (x + x_0)."""
    return p[STIFFNESS] * (x + p[PRELOAD])


@kernel
def grip(p: Floats, x: float) -> float:
    """The coil's hold on the magnet, (x_c - x)/x_c inside the coil and 0 outside (equation 2)."""
    return max(0.0, (p[REACH] - x) / p[REACH])


@kernel
def slack(p: Floats, x: float) -> float:
    """How far beyond friction, in N, a force must go before the model lets the magnet move (rounding only)."""
    return _SLACK * (spring_force(p, x) + max(p[FRICTION_OUT], p[FRICTION_BACK])) + _SLACK_FLOOR_N


@kernel
def resting_current(p: Floats, u: float, i: float, t: float) -> float:
    """The current at rest after t seconds."""
    if p[INDUCTANCE] == 0.0:
        return u / p[RESISTANCE]
    return i + (i - u / p[RESISTANCE]) * math.expm1(-p[RESISTANCE] / p[INDUCTANCE] * t)


@kernel
def instant_current(p: Floats, u: float, x: float, v: float) -> float:
    """The current without inductance, (u - emf)/R."""
    seen = grip(p, x) if p[RECIPROCAL] != 0.0 else 1.0
    return (u - p[BACK_EMF] * seen * v) / p[RESISTANCE]


@kernel
def time_constants(way: float, start: float, threshold: float, steady: float) -> float:
    """How long an exponential from `start` to `steady` takes past the threshold, upwards (1) or downwards (-1).

    In time constants; infinite if it never gets there or comes back from there.
    """
    if way * (steady - threshold) <= 0.0:
        return math.inf
    ahead = way * (threshold - start)
    return math.log1p(ahead / (way * (steady - threshold))) if ahead > 0.0 else 0.0


@kernel
def outward_threshold(p: Floats, x: float) -> float:
    """The current in A beyond which the coil pushes the resting magnet out."""
    return (spring_force(p, x) + p[FRICTION_OUT] + slack(p, x)) / (p[MOTOR] * grip(p, x))


@kernel
def homeward_threshold(p: Floats, x: float) -> float:
    """The current in A below which the spring pushes the resting magnet home."""
    return (spring_force(p, x) - p[FRICTION_BACK] - slack(p, x)) / (p[MOTOR] * grip(p, x))


@kernel
def sine(omega: float, t: float) -> float:
    """The integral of cos(wt): sin(wt)/w, or t without a spring."""
    return math.sin(omega * t) / omega if omega > 0.0 else t


@kernel
def free_position(omega: float, x: float, v: float, a: float, t: float) -> float:
    """The position, x + v sin(wt)/w + a (1 - cos wt)/w^2."""
    half = sine(omega, 0.5 * t)
    return x + v * sine(omega, t) + 2.0 * a * half * half


@kernel
def free_velocity(omega: float, v: float, a: float, t: float) -> float:
    """The velocity, v cos(wt) + a sin(wt)/w."""
    return v * math.cos(omega * t) + a * sine(omega, t)


@kernel
def turn_time(omega: float, v: float, a: float, heading: float) -> float:
    """When the velocity v cos(wt) + a sin(wt)/w falls to 0; infinite if it never does."""
    braking = -heading * a
    if omega > 0.0:
        return math.atan2(abs(v) * omega, braking) / omega
    return abs(v) / braking if braking > 0.0 else math.inf


@kernel
def fall_time(omega: float, v: float, a: float, distance: float) -> float:
    """When the magnet has moved by `distance` (at most 0); infinite if it turns before.

    The mean speed over an arc of harmonic motion gives tan(wt/2)/w = distance/(v + v_end).
    """
    v_squared = v * v + (2.0 * a - omega * omega * distance) * distance
    if distance == 0.0 or v_squared <= 0.0:
        return 0.0 if distance == 0.0 else math.inf
    part = distance / (v - math.sqrt(v_squared))
    return 2.0 * math.atan(omega * part) / omega if omega > 0.0 else 2.0 * part


@kernel
def free_current(p: Floats, u: float, i: float, v: float, a: float, t: float) -> float:
    """The current of equation (3) under the free motion's back-EMF (none if reciprocal: the magnet is outside).

    i(t) = u/R + P cos(wt) + Q sin(wt)/w + (i_0 - u/R - P) exp(-rt), with r = R/L.
    """
    R, L = p[RESISTANCE], p[INDUCTANCE]
    if L == 0.0:
        return instant_current(p, u, p[REACH], free_velocity(math.sqrt(p[STIFFNESS] / p[MASS]), v, a, t))
    omega, rate = math.sqrt(p[STIFFNESS] / p[MASS]), R / L
    emf = 0.0 if p[RECIPROCAL] != 0.0 else p[BACK_EMF]
    coupling = emf / (R + L * omega * omega / rate)
    cosine, sines = -coupling * (v - a / rate), -coupling * (a + omega * omega / rate * v)
    fading = (i - u / R - cosine) * math.exp(-rate * t)
    return u / R + cosine * math.cos(omega * t) + sines * sine(omega, t) + fading
