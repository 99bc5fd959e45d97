"""The phases with a closed form: the magnet at rest, and the magnet beyond the coil's force."""

from __future__ import annotations

import math
from collections.abc import Callable

from device.motion import (
    Event,
    Phase,
    State,
    breakaway_slack,
    coil_is_live,
    drive_voltage,
    grip,
    latest_end,
    spring_force,
)
from device.parameters import GunParameters

# --- at rest: i(t) = u/R + (i_0 - u/R) exp(-t R/L) -----------------------------------------------------------------


def rest_phase(gun: GunParameters, start_s: float, state: State) -> Phase:
    """The magnet at rest until the current breaks it away, the pulse ends, or for good (`settled`)."""
    steady_A = drive_voltage(gun, start_s) / gun.resistance_ohm
    rate = gun.resistance_ohm / gun.inductance_H

    def at(time_s: float) -> State:
        return State(state.x, 0.0, state.i + (state.i - steady_A) * math.expm1(-rate * (time_s - start_s)))

    waits = _breakaways(gun, start_s, state, steady_A)
    wait_s, current_A = min(waits, default=(math.inf, 0.0))
    end_s, event = latest_end(gun, start_s)
    end = at(end_s)
    if start_s + wait_s < end_s:
        end_s, event, end = start_s + wait_s, "break-away", State(state.x, 0.0, current_A)
    elif start_s >= gun.pulse_s and wait_s == math.inf:
        end_s, event = math.inf, "settled"
    return Phase(name="rest", direction=0, start_s=start_s, end_s=end_s, end=end, ended_by=event, at=at)


def _breakaways(gun: GunParameters, time_s: float, state: State, steady_A: float) -> list[tuple[float, float]]:
    """How long until the coil pushes the magnet out or, off the stop, no longer holds it, and at which current."""
    newtons_per_ampere = gun.motor_constant_N_A * grip(gun, state.x)
    if newtons_per_ampere == 0 or not coil_is_live(gun, time_s):
        return []
    time_constant_s = gun.inductance_H / gun.resistance_ohm
    spring_N, held_N = spring_force(gun, state.x), gun.friction_N + breakaway_slack(gun, state.x)
    ways = [(1, (spring_N + held_N) / newtons_per_ampere)]
    if state.x > 0:
        ways.append((-1, (spring_N - held_N) / newtons_per_ampere))
    return [(time_constant_s * _time_constants(way, state.i, i, steady_A), i) for way, i in ways]


def _time_constants(way: int, start: float, threshold: float, steady: float) -> float:
    """How long an exponential from `start` to `steady` takes past the threshold, upwards (1) or downwards (-1).

    In time constants; infinite if it never gets there or comes back from there.
    """
    if way * (steady - threshold) <= 0:
        return math.inf
    ahead = way * (threshold - start)
    return math.log1p(ahead / (way * (steady - threshold))) if ahead > 0 else 0.0


# --- free: x'' = a - w^2 (x - x_start), in forms that lose no digits and stay finite for k = 0 ---------------------


def free_phase(gun: GunParameters, start_s: float, state: State, direction: int) -> Phase:
    """The magnet beyond the coil, or with a dead coil: until it turns, meets the coil again or hits the stop."""
    live = coil_is_live(gun, start_s)
    omega = math.sqrt(gun.stiffness_N_m / gun.magnet_mass_kg)
    a = -(spring_force(gun, state.x) + direction * gun.friction_N) / gun.magnet_mass_kg
    current = _free_current(gun, start_s, state, a) if live else _no_current

    def at(time_s: float) -> State:
        t = time_s - start_s
        sine, cosine = _sine(omega, t), math.cos(omega * t)
        x = state.x + state.v * sine + 2 * a * _sine(omega, t / 2) ** 2
        return State(x, state.v * cosine + a * sine, current(t))

    found: tuple[float, Event] = (_turn(omega, state.v, a, direction), "turn")
    target = gun.coil_reach_m if live else 0.0
    if direction < 0 and (fall_s := _fall(omega, state.v, a, target - state.x)) < math.inf:
        found = (fall_s, "coil-edge" if live else "stop")
    return _ended(gun, start_s, direction, found, at)


def _ended(
    gun: GunParameters, start_s: float, direction: int, found: tuple[float, Event], at: Callable[[float], State]
) -> Phase:
    """The free phase, ended by its event or by the latest end; the event's own quantity is exact, not rounded."""
    end_s, event = latest_end(gun, start_s)
    end = at(min(end_s, start_s + found[0]))
    if start_s + found[0] < end_s:
        end_s, event = start_s + found[0], found[1]
    if event == "turn":
        end = end._replace(v=0.0)
    elif event in ("coil-edge", "stop"):
        end = end._replace(x=gun.coil_reach_m if event == "coil-edge" else 0.0)
    return Phase(name="free", direction=direction, start_s=start_s, end_s=end_s, end=end, ended_by=event, at=at)


def _sine(omega: float, t: float) -> float:
    """The integral of cos(wt): sin(wt)/w, or t without a spring."""
    return math.sin(omega * t) / omega if omega else t


def _turn(omega: float, v: float, a: float, direction: int) -> float:
    """When the velocity v cos(wt) + a sin(wt)/w falls to 0; infinite if it never does."""
    braking = -direction * a
    if omega:
        return math.atan2(abs(v) * omega, braking) / omega
    return abs(v) / braking if braking > 0 else math.inf


def _fall(omega: float, v: float, a: float, distance: float) -> float:
    """When the magnet has moved by `distance` (at most 0); infinite if it turns before.

    The mean speed over an arc of harmonic motion gives tan(wt/2)/w = distance/(v + v_end).
    """
    v_squared = v * v + (2 * a - omega**2 * distance) * distance
    if distance == 0 or v_squared <= 0:
        return 0.0 if distance == 0 else math.inf
    ratio = distance / (v - math.sqrt(v_squared))
    return 2 * math.atan(omega * ratio) / omega if omega else 2 * ratio


def _no_current(_t: float) -> float:
    return 0.0


def _free_current(gun: GunParameters, start_s: float, state: State, a: float) -> Callable[[float], float]:
    """The current of equation (3) under the free motion's back-EMF (none if reciprocal: the magnet is outside).

    i(t) = u/R + P cos(wt) + Q sin(wt)/w + (i_0 - u/R - P) exp(-rt), with r = R/L.
    """
    omega = math.sqrt(gun.stiffness_N_m / gun.magnet_mass_kg)
    rate = gun.resistance_ohm / gun.inductance_H
    steady_A = drive_voltage(gun, start_s) / gun.resistance_ohm
    coupling = (gun.back_emf_V_s_m if gun.emf == "printed" else 0.0) / gun.inductance_H / (rate**2 + omega**2)
    p = -coupling * (rate * state.v - a)
    q = -coupling * (rate * a + omega**2 * state.v)

    def current(t: float) -> float:
        fading = (state.i - steady_A - p) * math.exp(-rate * t)
        return steady_A + p * math.cos(omega * t) + q * _sine(omega, t) + fading

    return current
