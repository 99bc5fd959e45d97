"""heyoka: adaptive Taylor integration compiled by LLVM, with events as roots of the series."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot, break_away, force_on_hand

_TOLERANCES = (1e-6, 1e-9, 1e-12, 2.2e-16)
_PATIENCE_S = 1.0
_SPRING, _HELD, _TARGET, _DRIVE, _DAMPING, _EMF, _MOTOR, _PER_REACH = range(8)  # places of the parameters


def peers() -> list[Peer]:
    """At several tolerances."""
    return [
        Peer(
            family="heyoka",
            setting=f"tol {tol:.0e}",
            package="heyoka",
            models="all",
            build=lambda drive_off, tol=tol: _build(drive_off, tol),  # type: ignore[misc]
        )
        for tol in _TOLERANCES
    ]


def _build(drive_off: DriveOff, tol: float) -> Shoot:
    recoil = _Recoil(tol)
    flight = _open_flight(tol) if drive_off == "open" else _shorted_flight(tol)

    def shoot(gun: GunParameters) -> Outputs:
        numbers = _numbers(gun, gun.voltage_V, -gun.friction_N)
        peak, t, state = recoil.run(gun, numbers)
        return (peak, t, gun.magnet_mass_kg * state[1], *flight(gun, numbers, t, state))

    return shoot


def _numbers(gun: GunParameters, u: float, friction: float) -> list[float]:
    """The coefficients of the equations; `friction` is signed as a push outwards."""
    m, L = gun.magnet_mass_kg, gun.inductance_H
    return [
        gun.stiffness_N_m / m,
        (gun.stiffness_N_m * gun.preload_length_m - friction) / m,
        gun.coil_reach_m,
        u / L,
        gun.resistance_ohm / L,
        gun.back_emf_V_s_m / L,
        gun.motor_constant_N_A / m,
        1.0 / gun.coil_reach_m,
    ]


class _Top:
    """Notes where the force peaks. heyoka copies what it calls back, so a copy is the original."""

    def __init__(self) -> None:
        self.seen: list[float] = []

    def __deepcopy__(self, _memo: dict[int, object]) -> _Top:
        return self

    def __call__(self, run: Any, time_s: float, _sign: int) -> None:
        run.update_d_output(time_s)
        self.seen += (run.d_output[0], run.d_output[2])


class _Recoil:
    """The recoil stage: its end is a terminal event, the peak of the force a non-terminal one."""

    def __init__(self, tol: float) -> None:
        import heyoka as hy

        x, v, i = hy.make_vars("x", "v", "i")
        rates = _rates(hy, inside=True)
        motor, spread, spring = hy.par[_MOTOR], hy.par[_PER_REACH], hy.par[_SPRING]
        slope = motor * ((1.0 - x * spread) * rates[2][1] - v * i * spread) - spring * v
        self._top = _Top()
        top = hy.nt_event(slope, self._top, direction=hy.event_direction.negative)
        edge = hy.t_event(x - hy.par[_TARGET], direction=hy.event_direction.positive)
        self._run = hy.taylor_adaptive(rates, [0.0] * 3, tol=tol, t_events=[edge], nt_events=[top])

    def run(self, gun: GunParameters, numbers: list[float]) -> tuple[float, float, list[float]]:
        """Peak, end and state at the end."""
        self._top.seen.clear()
        start, current = break_away(gun)
        t, state = _until_event(self._run, numbers, start, [0.0, 0.0, current])
        x, i = self._top.seen[:2]
        return force_on_hand(gun, x, i), t, state


def _rates(hy: Any, *, inside: bool, alive: bool = True) -> list[tuple[Any, Any]]:
    x, v, i = hy.make_vars("x", "v", "i")
    p = hy.par
    push = p[_MOTOR] * (1.0 - x * p[_PER_REACH]) * i if inside else 0.0
    motion = [(x, v), (v, push - p[_SPRING] * x - p[_HELD])]
    return [*motion, (i, p[_DRIVE] - p[_DAMPING] * i - p[_EMF] * v)] if alive else motion


def _stage(tol: float, *, ends_at: str, inside: bool, alive: bool) -> Any:
    """An integrator that stops where the speed, or the way to the target, falls to 0."""
    import heyoka as hy

    x, v, _ = hy.make_vars("x", "v", "i")
    watched = v if ends_at == "turn" else x - hy.par[_TARGET]
    event = hy.t_event(watched, direction=hy.event_direction.negative)
    rates = _rates(hy, inside=inside, alive=alive)
    return hy.taylor_adaptive(rates, [0.0] * len(rates), tol=tol, t_events=[event])


def _prepare(run: Any, numbers: list[float], t: float, state: list[float]) -> None:
    run.pars[:] = numbers[: len(run.pars)]  # a stage knows the parameters up to its last one
    run.time = t
    run.state[:] = state
    run.reset_cooldowns()


def _until_event(run: Any, numbers: list[float], t: float, state: list[float]) -> tuple[float, list[float]]:
    _prepare(run, numbers, t, state)
    outcome = run.propagate_until(t + _PATIENCE_S)[0]
    if int(outcome) != -1:  # the first terminal event
        raise PeerError("an event was missed")
    return run.time, run.state.tolist()


Flight = Callable[[GunParameters, list[float], float, list[float]], tuple[float, ...]]


def _open_flight(tol: float) -> Flight:
    rise = _stage(tol, ends_at="turn", inside=False, alive=False)
    fall = _stage(tol, ends_at="target", inside=False, alive=False)

    def flight(gun: GunParameters, numbers: list[float], t: float, state: list[float]) -> tuple[float, ...]:
        turned, (top, _) = _until_event(rise, numbers, t, state[:2])
        homeward = _numbers(gun, 0.0, gun.friction_N)
        homeward[_TARGET] = 0.0
        landed, (_, speed) = _until_event(fall, homeward, turned, [top, 0.0])
        return turned, top, landed, -speed

    return flight


def _shorted_flight(tol: float) -> Flight:
    rise = _stage(tol, ends_at="turn", inside=False, alive=True)
    fall = _stage(tol, ends_at="target", inside=False, alive=True)
    land = _stage(tol, ends_at="target", inside=True, alive=True)

    def flight(gun: GunParameters, numbers: list[float], t: float, state: list[float]) -> tuple[float, ...]:
        _prepare(rise, numbers, t, state)
        rise.propagate_until(gun.pulse_s)
        coasting = [*numbers[:_DRIVE], 0.0, *numbers[_DRIVE + 1 :]]
        turned, state = _until_event(rise, coasting, rise.time, rise.state.tolist())
        homeward, top = _numbers(gun, 0.0, gun.friction_N), state[0]
        t, state = _until_event(fall, homeward, turned, [top, 0.0, state[2]])
        homeward[_TARGET] = 0.0
        landed, state = _until_event(land, homeward, t, [gun.coil_reach_m, *state[1:]])
        return turned, top, landed, -state[1]

    return flight
