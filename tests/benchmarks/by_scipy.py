"""scipy's `solve_ivp` as an expert would use it: one call a smooth stage, ended by a terminal event."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot, break_away, force_on_hand

State = Sequence[float]
Watch = Callable[[float, State], float]

_SETTINGS = {
    "RK45": (1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12),
    "DOP853": (1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12),
    "Radau": (1e-3, 1e-6, 1e-9),
    "BDF": (1e-3, 1e-6, 1e-9),
    "LSODA": (1e-3, 1e-6, 1e-9, 1e-10, 1e-12),
}
_SCALE = (1e-3, 1e-1, 1e-1)  # m, m/s, A: the absolute tolerance is the relative one of these
_PATIENCE_S = 1.0  # no stage of these shots lasts as long


def peers() -> list[Peer]:
    """The five methods, each at several tolerances."""
    return [
        Peer(
            family=f"scipy {method}",
            setting=f"rtol {rtol:.0e}",
            package="scipy",
            models="all",
            build=lambda drive_off, method=method, rtol=rtol: _build(drive_off, method, rtol),  # type: ignore[misc]
        )
        for method, tolerances in _SETTINGS.items()
        for rtol in tolerances
    ]


def _build(drive_off: DriveOff, method: str, rtol: float) -> Shoot:
    solve = _stage_solver(method, rtol)
    return lambda gun: _shot(gun, solve, flight=_open_flight if drive_off == "open" else _shorted_flight)


def _stage_solver(method: str, rtol: float) -> Callable[..., Any]:
    from scipy.integrate import solve_ivp

    def solve(
        rates: Any, t: float, state: State, end: Watch | None, *watched: Watch, until: float | None = None
    ) -> Any:
        integrate: Any = solve_ivp  # the events carry attributes, which its types do not know
        found = integrate(
            rates,
            (t, t + _PATIENCE_S if until is None else until),
            state,
            method=method,
            rtol=rtol,
            atol=np.multiply(rtol, _SCALE[: len(state)]),
            events=[*([end] if end else []), *watched] or None,
        )
        if end and not found.t_events[0].size:
            raise PeerError("an event was missed")
        return found

    return solve


def _ends(function: Watch, direction: float) -> Watch:
    function.terminal, function.direction = True, direction  # type: ignore[attr-defined]
    return function


def _shot(gun: GunParameters, solve: Any, flight: Any) -> Outputs:
    km, xc, k = gun.motor_constant_N_A, gun.coil_reach_m, gun.stiffness_N_m
    rates = _inside(gun, gun.voltage_V, -gun.friction_N)

    def force_rate(t: float, y: State) -> float:
        _, _, di = rates(t, y)
        return km * ((1.0 - y[0] / xc) * di - y[1] * y[2] / xc) - k * y[1]

    force_rate.direction = -1.0  # type: ignore[attr-defined]
    t, i = break_away(gun)
    found = solve(rates, t, (0.0, 0.0, i), _ends(lambda _t, y: y[0] - xc, 1.0), force_rate)
    t, state = found.t[-1], found.y[:, -1]
    peak = max(force_on_hand(gun, y[0], y[2]) for y in found.y_events[1])
    turned, top, landed, speed = flight(gun, solve, t, state)
    return (peak, t, gun.magnet_mass_kg * state[1], turned, top, landed, speed)


def _open_flight(gun: GunParameters, solve: Any, t: float, state: State) -> tuple[float, ...]:
    """Without current nothing but spring and friction is left."""
    out = solve(_free(gun, -gun.friction_N), t, state[:2], _ends(lambda _t, y: y[1], -1.0))
    turned, top = out.t[-1], out.y[0, -1]
    home = solve(_free(gun, gun.friction_N), turned, (top, 0.0), _ends(lambda _t, y: y[0], -1.0))
    return turned, top, home.t[-1], -home.y[1, -1]


def _shorted_flight(gun: GunParameters, solve: Any, t: float, state: State) -> tuple[float, ...]:
    """The current lives on, and brakes the magnet once it is inside again."""
    pulse = solve(_outside(gun, gun.voltage_V, -gun.friction_N), t, state, None, until=gun.pulse_s)
    out = solve(_outside(gun, 0.0, -gun.friction_N), gun.pulse_s, pulse.y[:, -1], _ends(lambda _t, y: y[1], -1.0))
    turned, top = out.t[-1], out.y[0, -1]
    edge = _ends(lambda _t, y: y[0] - gun.coil_reach_m, -1.0)
    back = solve(_outside(gun, 0.0, gun.friction_N), turned, (top, 0.0, out.y[2, -1]), edge)
    start = (gun.coil_reach_m, *back.y[1:, -1])
    home = solve(_inside(gun, 0.0, gun.friction_N), back.t[-1], start, _ends(lambda _t, y: y[0], -1.0))
    return turned, top, home.t[-1], -home.y[1, -1]


def _inside(gun: GunParameters, u: float, friction: float) -> Callable[[float, State], State]:
    m, ke, R, L = gun.magnet_mass_kg, gun.back_emf_V_s_m, gun.resistance_ohm, gun.inductance_H
    km, xc, k, held = gun.motor_constant_N_A, gun.coil_reach_m, gun.stiffness_N_m, _held(gun, friction)

    def rates(_t: float, y: State) -> State:
        x, v, i = y
        return v, (km * (1.0 - x / xc) * i - k * x - held) / m, (u - R * i - ke * v) / L

    return rates


def _outside(gun: GunParameters, u: float, friction: float) -> Callable[[float, State], State]:
    m, ke, R, L = gun.magnet_mass_kg, gun.back_emf_V_s_m, gun.resistance_ohm, gun.inductance_H
    k, held = gun.stiffness_N_m, _held(gun, friction)

    def rates(_t: float, y: State) -> State:
        x, v, i = y
        return v, -(k * x + held) / m, (u - R * i - ke * v) / L

    return rates


def _free(gun: GunParameters, friction: float) -> Callable[[float, State], State]:
    m, k, held = gun.magnet_mass_kg, gun.stiffness_N_m, _held(gun, friction)
    return lambda _t, y: (y[1], -(k * y[0] + held) / m)


def _held(gun: GunParameters, friction: float) -> float:
    """The constant part of what pushes towards the stop; `friction` is signed as a push outwards."""
    return gun.stiffness_N_m * gun.preload_length_m - friction
