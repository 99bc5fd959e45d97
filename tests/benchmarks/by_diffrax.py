"""diffrax: Runge-Kutta methods compiled by JAX; a whole shot is one compiled program, stage by stage."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot, break_away

_TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-12)
_METHODS = ("Tsit5", "Dopri8")
_PATIENCE_S = 1.0
_SCALE = (1e-3, 1e-1, 1e-1)


def peers() -> list[Peer]:
    """Two methods, each at several tolerances."""
    return [
        Peer(
            family=f"diffrax {method}",
            setting=f"rtol {rtol:.0e}",
            package="diffrax",
            models="all",
            build=lambda drive_off, method=method, rtol=rtol: _build(drive_off, method, rtol),  # type: ignore[misc]
        )
        for method in _METHODS
        for rtol in _TOLERANCES
    ]


def _build(drive_off: DriveOff, method: str, rtol: float) -> Shoot:
    program = _program(drive_off, method)

    def shoot(gun: GunParameters) -> Outputs:
        start, current = break_away(gun)
        found = tuple(program(_numbers(gun), start, current, rtol).tolist())
        if not all(map(math.isfinite, found)):
            raise PeerError("an event was missed")
        return found

    return shoot


def _numbers(gun: GunParameters) -> tuple[float, ...]:
    return (
        *(gun.magnet_mass_kg, gun.back_emf_V_s_m, gun.resistance_ohm, gun.inductance_H, gun.motor_constant_N_A),
        *(gun.coil_reach_m, gun.stiffness_N_m, gun.preload_length_m, gun.friction_N, gun.voltage_V, gun.pulse_s),
    )


_programs: dict[tuple[str, str], Any] = {}


def _program(drive_off: DriveOff, method: str) -> Any:
    """The compiled shot of one method, for all tolerances."""
    if (drive_off, method) not in _programs:
        import jax

        jax.config.update("jax_platforms", "cpu")
        jax.config.update("jax_enable_x64", True)
        flight = _open_flight if drive_off == "open" else _shorted_flight
        _programs[drive_off, method] = jax.jit(_shot(_stage_solver(method), flight))
    return _programs[drive_off, method]


def _stage_solver(method: str) -> Callable[..., Any]:
    import diffrax
    import jax.numpy as jnp
    import optimistix

    solver = getattr(diffrax, method)()

    def solve(rates: Any, t: Any, state: Any, end: Any, rtol: Any, *, until: Any = None) -> tuple[Any, Any]:
        """Time and state where `end` falls to 0 (or at `until`); not a number if it never does."""

        def watched(t: Any, y: Any, args: Any, **_more: object) -> Any:
            return end(y)

        event = end and diffrax.Event(watched, optimistix.Newton(1e-15, 1e-15), direction=False)
        atol = rtol * jnp.asarray(_SCALE[: len(state)])
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(lambda _t, y, _args: jnp.stack(rates(y))),
            solver,
            t0=t,
            t1=t + _PATIENCE_S if until is None else until,
            dt0=None,
            y0=jnp.stack(state),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=atol),
            event=event,
            max_steps=4096,
            throw=False,
        )
        ended = found.event_mask if end else found.result == diffrax.RESULTS.successful
        return jnp.where(ended, found.ts[0], jnp.nan), found.ys[0]

    return solve


def _shot(solve: Any, flight: Any) -> Callable[..., Any]:
    import jax.numpy as jnp

    def shot(p: Any, t: Any, current: Any, rtol: Any) -> Any:
        m, _, _, _, km, xc, k, x0, Ff, V, _ = p
        rates = _rates(p, V, -Ff, inside=True)

        def slope(y: Any) -> Any:
            return km * ((1.0 - y[0] / xc) * rates(y)[2] - y[1] * y[2] / xc) - k * y[1]

        zero = jnp.zeros_like(current)
        t, y = solve(rates, t, (zero, zero, current), slope, rtol)
        peak = km * (1.0 - y[0] / xc) * y[2] - k * (y[0] + x0) - Ff
        t, y = solve(rates, t, tuple(y), lambda y: xc - y[0], rtol)
        return jnp.stack([peak, t, m * y[1], *flight(p, solve, t, y, rtol)])

    return shot


def _open_flight(p: Any, solve: Any, t: Any, y: Any, rtol: Any) -> tuple[Any, ...]:
    Ff = p[8]
    turned, y = solve(_rates(p, 0.0, -Ff, alive=False), t, tuple(y[:2]), lambda y: y[1], rtol)
    top = y[0]
    landed, y = solve(_rates(p, 0.0, Ff, alive=False), turned, (top, 0.0 * top), lambda y: y[0], rtol)
    return turned, top, landed, -y[1]


def _shorted_flight(p: Any, solve: Any, t: Any, y: Any, rtol: Any) -> tuple[Any, ...]:
    xc, Ff, V, ton = p[5], p[8], p[9], p[10]
    t, y = solve(_rates(p, V, -Ff), t, tuple(y), None, rtol, until=ton)
    turned, y = solve(_rates(p, 0.0, -Ff), t, tuple(y), lambda y: y[1], rtol)
    top = y[0]
    t, y = solve(_rates(p, 0.0, Ff), turned, (top, 0.0 * top, y[2]), lambda y: y[0] - xc, rtol)
    landed, y = solve(_rates(p, 0.0, Ff, inside=True), t, (xc, y[1], y[2]), lambda y: y[0], rtol)
    return turned, top, landed, -y[1]


def _rates(p: Any, u: Any, friction: Any, *, inside: bool = False, alive: bool = True) -> Callable[[Any], list[Any]]:
    """The right-hand side; `friction` is signed as a push outwards."""
    m, ke, R, L, km, xc, k, x0, *_ = p

    def rates(y: Any) -> list[Any]:
        motor = km * (1.0 - y[0] / xc) * y[2] if inside else 0.0
        motion = [y[1], (motor - k * (y[0] + x0) + friction) / m]
        return [*motion, (u - R * y[2] - ke * y[1]) / L] if alive else motion

    return rates
