"""heyoka: adaptive Taylor integration compiled by LLVM, with events as roots of the series.

Either one shot at a time, as the other peers, or as many at once as a vector register holds, its batch mode. The same
stages serve both: what is a number of one shot is an array of the lanes' numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot, break_away, force_on_hand

Lanes = NDArray[np.float64]
"""A number of each shot in a group, or rows of them."""

_TOLERANCES = (1e-6, 1e-9, 1e-12, 2.2e-16)
_PATIENCE_S = 1.0
_SPRING, _HELD, _TARGET, _DRIVE, _DAMPING, _EMF, _MOTOR, _PER_REACH = range(8)  # places of the parameters
_GOES = 8  # of a lane: 1 on its way, 0 at the end of its stage
_ENDED = -1  # an outcome: the first terminal event


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
    fly = _Flight(lambda **stage: _Alone(tol, **stage), drive_off)
    return lambda gun: fly(gun, *break_away(gun))


def in_lanes(asked: Sequence[GunParameters], tol: float) -> Callable[[], list[Outputs]]:
    """A function that shoots all these guns, of one off-state, so many at once as a vector register holds.

    Their numbers are put side by side beforehand.
    """
    import heyoka as hy

    lanes = hy.recommended_simd_size()
    padded = [*asked, *asked[-1:] * (-len(asked) % lanes)]
    groups = [_side_by_side(padded[start : start + lanes]) for start in range(0, len(padded), lanes)]
    fly = _Flight(lambda **stage: _InLanes(tol, lanes, **stage), asked[0].drive_off)

    def shoot_all() -> list[Outputs]:
        found = np.concatenate([fly(*group) for group in groups], axis=1)
        return [tuple(one) for one in found.T[: len(asked)].tolist()]

    return shoot_all


def _side_by_side(asked: Sequence[GunParameters]) -> tuple[Any, Any, Any]:
    """The guns as one whose numbers are arrays, and when and with which currents they break away."""
    names = [one.name for one in fields(GunParameters) if isinstance(getattr(asked[0], one.name), float)]
    gun = SimpleNamespace(**{name: np.array([getattr(one, name) for one in asked]) for name in names})
    start, current = np.array([break_away(one) for one in asked]).T
    return gun, start, current


def _numbers(gun: Any, u: Any, friction: Any) -> list[Any]:
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


class _Flight:
    """The stages of a shot."""

    def __init__(self, stage: Callable[..., Any], drive_off: DriveOff) -> None:
        self._alive = drive_off == "shorted"
        self._recoil = stage(ends_at="edge", inside=True, alive=True)
        self._rise = stage(ends_at="turn", inside=False, alive=self._alive)
        self._fall = stage(ends_at="target", inside=False, alive=self._alive)
        self._land = stage(ends_at="target", inside=True, alive=True) if self._alive else None

    def __call__(self, gun: Any, start: Any, current: Any) -> tuple[Any, ...]:
        """The outputs, from the break-away on."""
        numbers = _numbers(gun, gun.voltage_V, -gun.friction_N)
        t, state = self._recoil.until_end(numbers, start, [0.0 * current, 0.0 * current, current])
        peak, later = force_on_hand(gun, *self._recoil.top()), self._shorted if self._land else self._open
        return (peak, t, gun.magnet_mass_kg * state[1], *later(gun, numbers, t, state))

    def _open(self, gun: Any, numbers: list[Any], t: Any, state: Any) -> tuple[Any, ...]:
        turned, (top, _) = self._rise.until_end(numbers, t, state[:2])
        homeward = _numbers(gun, 0.0 * top, gun.friction_N)
        homeward[_TARGET] = 0.0 * top
        landed, (_, v) = self._fall.until_end(homeward, turned, [top, 0.0 * top])
        return turned, top, landed, -v

    def _shorted(self, gun: Any, numbers: list[Any], t: Any, state: Any) -> tuple[Any, ...]:
        t, state = self._rise.until(gun.pulse_s, numbers, t, state)
        coasting = _numbers(gun, 0.0 * t, -gun.friction_N)
        turned, (top, _, i) = self._rise.until_end(coasting, t, state)
        homeward = _numbers(gun, 0.0 * t, gun.friction_N)
        t, (_, v, i) = self._fall.until_end(homeward, turned, [top, 0.0 * top, i])
        homeward[_TARGET] = 0.0 * t
        landed, (_, v, _) = self._land.until_end(homeward, t, [gun.coil_reach_m, v, i])
        return turned, top, landed, -v


def _rates(hy: Any, *, inside: bool, alive: bool) -> list[tuple[Any, Any]]:
    x, v, i = hy.make_vars("x", "v", "i")
    p = hy.par
    push = p[_MOTOR] * (1.0 - x * p[_PER_REACH]) * i if inside else 0.0
    motion = [(x, v), (v, push - p[_SPRING] * x - p[_HELD])]
    return [*motion, (i, p[_DRIVE] - p[_DAMPING] * i - p[_EMF] * v)] if alive else motion


def _end(hy: Any, ends_at: str) -> tuple[Any, Any]:
    """What falls, or rises, through 0 at the end of a stage: the turn, the target on the way home, or outwards."""
    x, v = hy.make_vars("x", "v")
    direction = hy.event_direction.positive if ends_at == "edge" else hy.event_direction.negative
    return v if ends_at == "turn" else x - hy.par[_TARGET], direction


def _slope(hy: Any, current_rate: Any) -> Any:
    """dF/dt over the mass."""
    x, v, i = hy.make_vars("x", "v", "i")
    fading = (1.0 - x * hy.par[_PER_REACH]) * current_rate - v * i * hy.par[_PER_REACH]
    return hy.par[_MOTOR] * fading - hy.par[_SPRING] * v


class _Called:
    """Calls a function. heyoka copies what it calls back, so a copy is the original."""

    def __init__(self, function: Callable[..., bool | None]) -> None:
        self._function = function

    def __deepcopy__(self, _memo: dict[int, object]) -> _Called:
        return self

    def __call__(self, *given: Any) -> bool | None:
        return self._function(*given)


class _Alone:
    """A stage of one shot. Its end is a terminal event, the peak of the force in the recoil stage is none."""

    def __init__(self, tol: float, *, ends_at: str, inside: bool, alive: bool) -> None:
        import heyoka as hy

        rates, (end, direction) = _rates(hy, inside=inside, alive=alive), _end(hy, ends_at)
        tops, down = [], hy.event_direction.negative
        if ends_at == "edge":
            tops = [hy.nt_event(_slope(hy, rates[2][1]), _Called(self._note_top), direction=down)]
        ends = [hy.t_event(end, direction=direction)]
        self._run = hy.taylor_adaptive(rates, [0.0] * len(rates), tol=tol, t_events=ends, nt_events=tops)
        self._tops: list[float] = []

    def _note_top(self, run: Any, time_s: float, _sign: int) -> None:
        run.update_d_output(time_s)
        self._tops += (run.d_output[0], run.d_output[2])

    def top(self) -> list[float]:
        """Position and current where the force first peaked."""
        return self._tops[:2]

    def until(self, end_s: float, numbers: list[float], t: float, state: Any) -> tuple[float, list[float]]:
        """Time and state then."""
        self._go(end_s, numbers, t, state)
        return end_s, self._run.state.tolist()

    def until_end(self, numbers: list[float], t: float, state: Any) -> tuple[float, list[float]]:
        """Time and state at the stage's end."""
        if self._go(t + _PATIENCE_S, numbers, t, state) != _ENDED:
            raise PeerError("an event was missed")
        return self._run.time, self._run.state.tolist()

    def _go(self, until_s: float, numbers: list[float], t: float, state: Any) -> int:
        self._tops.clear()
        run = self._run
        run.pars[:] = numbers[: len(run.pars)]  # a stage knows the parameters up to its last one
        run.time = t
        run.state[:] = state
        run.reset_cooldowns()
        return int(run.propagate_until(until_s)[0])


class _InLanes:
    """A stage of several shots. Where one ends all would stop; so it is held there, and the others go on."""

    def __init__(self, tol: float, lanes: int, *, ends_at: str, inside: bool, alive: bool) -> None:
        import heyoka as hy

        rates, (end, direction) = _rates(hy, inside=inside, alive=alive), _end(hy, ends_at)
        tops, down = [], hy.event_direction.negative
        if ends_at == "edge":
            tops = [hy.nt_event_batch(_slope(hy, rates[2][1]), _Called(self._note_top), direction=down)]
        ends = [hy.t_event_batch(end, callback=_Called(self._hold), direction=direction)]
        held = [(variable, hy.par[_GOES] * rate) for variable, rate in rates]
        start = np.zeros((len(rates), lanes))
        self._run = hy.taylor_adaptive_batch(held, start, tol=tol, t_events=ends, nt_events=tops)
        self._tops, self._ended_s = np.zeros((2, lanes)), np.zeros(lanes)

    def _note_top(self, run: Any, time_s: float, _sign: int, lane: int) -> None:
        run.update_d_output(time_s)
        self._tops[:, lane] = run.d_output[::2, lane]

    def _hold(self, run: Any, _sign: int, lane: int) -> bool:
        self._ended_s[lane] = run.time[lane]
        run.pars[_GOES, lane] = 0.0
        return True

    def top(self) -> Lanes:
        """Positions and currents where the force peaked."""
        return self._tops.copy()

    def until(self, end_s: Lanes, numbers: list[Lanes], t: Lanes, state: Any) -> tuple[Lanes, Lanes]:
        """Times and states then."""
        self._go(end_s, numbers, t, state)
        return end_s, self._run.state.copy()

    def until_end(self, numbers: list[Lanes], t: Lanes, state: Any) -> tuple[Lanes, Lanes]:
        """Times and states at the stage's end."""
        self._go(t + _PATIENCE_S, numbers, t, state)
        if self._run.pars[_GOES].any():
            raise PeerError("an event was missed")
        return self._ended_s.copy(), self._run.state.copy()

    def _go(self, until_s: Lanes, numbers: list[Lanes], t: Lanes, state: Any) -> None:
        run = self._run
        run.pars[:_GOES], run.pars[_GOES] = numbers, 1.0
        run.set_time(t)
        run.state[:] = state
        run.reset_cooldowns()
        run.propagate_until(until_s)
