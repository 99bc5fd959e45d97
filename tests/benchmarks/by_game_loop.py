"""A game's fixed-step loop: fourth-order Runge-Kutta, events found after the step and placed by a straight line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot

_PLAIN = (1e-3, 1e-4, 1e-5)
_COMPILED = (1e-3, 1e-4, 1e-5, 1e-6)
_HORIZON_S = 1.0


def peers() -> list[Peer]:
    """In plain Python and compiled, at several steps."""
    kinds = (("RK4 loop, Python", "recoil", _PLAIN, _as_it_is), ("RK4 loop, numba", "numba", _COMPILED, _compiled))
    return [
        Peer(
            family=family,
            setting=f"step {h:.0e} s",
            package=package,
            models="all; friction held over a step",
            build=lambda drive_off, h=h, jit=jit: _build(drive_off, h, jit),  # type: ignore[misc]
        )
        for family, package, steps, jit in kinds
        for h in steps
    ]


def _as_it_is(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    import numba

    compiled: Callable[..., Any] = numba.njit(function)
    return compiled


def _build(drive_off: DriveOff, h: float, jit: Callable[..., Any]) -> Shoot:
    if jit not in _loops:
        _loops[jit] = _loop(jit)
    loop = _loops[jit]

    def shoot(gun: GunParameters) -> Outputs:
        found: Outputs = loop(_numbers(gun), float(drive_off == "shorted"), h, int(_HORIZON_S / h))
        if found[5] == 0.0:
            raise PeerError("the loop never landed")
        return found

    return shoot


_loops: dict[Callable[..., Any], Callable[..., Any]] = {}


def _numbers(gun: GunParameters) -> tuple[float, ...]:
    return (
        *(gun.magnet_mass_kg, gun.back_emf_V_s_m, gun.resistance_ohm, gun.inductance_H, gun.motor_constant_N_A),
        *(gun.coil_reach_m, gun.stiffness_N_m, gun.preload_length_m, gun.friction_N, gun.voltage_V, gun.pulse_s),
    )


def _step(jit: Callable[..., Any]) -> Callable[..., Any]:
    """One step of the classical method; `way` is where friction pushes, 0 at rest, `live` 0 for a dead coil."""

    def rates(p: Any, x: float, v: float, i: float, u: float, way: float, live: float) -> Any:  # noqa: PLR0917 - compiled
        m, ke, R, L, km, xc, k, x0, Ff, _, _ = p
        motor = km * max(0.0, 1.0 - x / xc) * i
        a = (motor - k * (x + x0) + way * Ff) / m if way != 0.0 else 0.0
        return v, a, live * (u - R * i - ke * v) / L

    rates = jit(rates)

    def step(p: Any, x: float, v: float, i: float, u: float, way: float, live: float, h: float) -> Any:  # noqa: PLR0917
        x1, v1, i1 = rates(p, x, v, i, u, way, live)
        x2, v2, i2 = rates(p, x + 0.5 * h * x1, v + 0.5 * h * v1, i + 0.5 * h * i1, u, way, live)
        x3, v3, i3 = rates(p, x + 0.5 * h * x2, v + 0.5 * h * v2, i + 0.5 * h * i2, u, way, live)
        x4, v4, i4 = rates(p, x + h * x3, v + h * v3, i + h * i3, u, way, live)
        return (
            x + h * (x1 + 2.0 * x2 + 2.0 * x3 + x4) / 6.0,
            v + h * (v1 + 2.0 * v2 + 2.0 * v3 + v4) / 6.0,
            i + h * (i1 + 2.0 * i2 + 2.0 * i3 + i4) / 6.0,
        )

    compiled: Callable[..., Any] = jit(step)
    return compiled


def _loop(jit: Callable[..., Any]) -> Callable[..., Any]:
    step = _step(jit)

    def loop(p: Any, shorted: float, h: float, most: int) -> Any:
        m, _, _, _, km, xc, k, x0, Ff, V, ton = p
        x, v, i, way, live = 0.0, 0.0, 0.0, 0.0, 1.0
        peak, recoil, impulse, firing, top, reset, impact = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for n in range(most):
            t = n * h
            u = V if t + 0.5 * h < ton else 0.0
            if u == 0.0 and shorted == 0.0:
                live, i = 0.0, 0.0
            force = km * max(0.0, 1.0 - x / xc) * i - k * (x + x0)
            if way == 0.0 and force > Ff:
                way = -1.0
            peak = max(peak, force - Ff)  # later forces are smaller
            x_last, v_last = x, v
            x, v, i = step(p, x, v, i, u, way, live, h)
            if recoil == 0.0 and x >= xc:
                part = (xc - x_last) / (x - x_last)
                recoil, impulse = t + part * h, m * (v_last + part * (v - v_last))
            if way < 0.0 and v <= 0.0:
                firing, top, way = t + h * v_last / (v_last - v), x, 1.0
            if way > 0.0 and x <= 0.0:
                part = x_last / (x_last - x)
                reset, impact = t + part * h, -(v_last + part * (v - v_last))
                break
        return peak, recoil, impulse, firing, top, reset, impact

    compiled: Callable[..., Any] = jit(loop)
    return compiled
