"""A gun that is held, not fixed: its mass on a spring and damper, the hand (the paper's other future work).

    m (x'' - X'') = F,   M X'' = F - k_h X - c_h X',   F = F_m - k (x + x_0) -/+ F_f

X is the enclosure's way back, in the direction of recoil; x the magnet's displacement in the enclosure. The impact
on the stop is inelastic: both go on together. Integrated by scipy from event to event (DOP853, relative 1e-10; Radau
where the coil's time constant is below 20 us).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from device.parameters import GunParameters

_RTOL, _ATOL = 1e-10, 1e-13
_MAX_PHASES = 200
_MAX_WORK = 200_000  # evaluations of the equations: some seconds, where an ordinary shot takes five thousand
_SET_OUT_S = 1e-7  # the first step of a magnet that sets out: a longer one may hold a whole hop
_STIFF_S = 2e-5  # of the coil's time constant
_SLACK = 1e-9  # relative: what friction does not hold by less than this, it holds

Vector = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class HandMechanics:
    """The enclosure and what holds it. The whole gun weighs 340.2 g (paper); the hand's numbers are assumed."""

    enclosure_mass_kg: float = 0.3402 - 0.114
    stiffness_N_m: float = 500.0  # assumed: a firm grip, along the forearm
    damping_N_s_m: float = 10.0  # assumed

    def __post_init__(self) -> None:
        if not 0 < self.enclosure_mass_kg < math.inf:
            raise ValueError(f"enclosure_mass_kg is {self.enclosure_mass_kg:g}; it must be finite and above 0")
        for name, number in (("stiffness_N_m", self.stiffness_N_m), ("damping_N_s_m", self.damping_N_s_m)):
            if not 0 <= number < math.inf:
                raise ValueError(f"{name} is {number:g}; it must be finite and at least 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldShot:
    """One shot of a held gun over the time asked for."""

    peak_hand_force_N: float  # of k_h X + c_h X', what the skin feels
    peak_kick_m: float  # largest way back of the enclosure
    max_displacement_m: float
    turn_s: float | None  # where the magnet first turns back
    reset_end_s: float | None  # first landing after the pulse
    impact_speed_m_s: float | None  # of magnet and enclosure against each other
    residual_impulse_Ns: float  # momentum less the impulse of the hand: integration error


@dataclass(frozen=True, slots=True, kw_only=True)
class _Phase:
    gun: GunParameters
    hand: HandMechanics
    way: int
    drive_V: float
    live: bool

    def rates(self, _t: float, y: Vector) -> list[float]:
        """Of x, x', i, X, X' and of the hand's impulse."""
        x, v, i, X, V, _ = y.tolist()
        gun, hand = self.gun, self.hand
        held_N = hand.stiffness_N_m * X + hand.damping_N_s_m * V
        hold = self.hold(x)
        emf_V = gun.back_emf_V_s_m * v * (hold if gun.emf == "reciprocal" else 1.0)
        current = (self.drive_V - emf_V - gun.resistance_ohm * i) / gun.inductance_H if self.live else 0.0
        if self.way == 0:
            return [0.0, 0.0, current, V, -held_N / (gun.magnet_mass_kg + hand.enclosure_mass_kg), held_N]
        force_N = self.force(x, i)
        back = (force_N - held_N) / hand.enclosure_mass_kg
        return [v, force_N / gun.magnet_mass_kg + back, current, V, back, held_N]

    def felt_rate(self, rates: Sequence[float]) -> float:
        """How the force on the hand changes, in N/s, by the rates of the state."""
        return self.hand.stiffness_N_m * rates[3] + self.hand.damping_N_s_m * rates[4]

    def hold(self, x: float) -> float:
        """The coil's hold, 0 outside."""
        return max(0.0, 1 - x / self.gun.coil_reach_m)

    def force(self, x: float, i: float) -> float:
        """F in N."""
        gun = self.gun
        motor_N = gun.motor_constant_N_A * self.hold(x) * i if self.live else 0.0
        return motor_N - gun.stiffness_N_m * (x + gun.preload_length_m) - self.way * self.friction()

    def friction(self) -> float:
        """What opposes this way in N."""
        return self.gun.homeward_friction_N if self.way < 0 else self.gun.friction_N

    def pull(self, y: Vector) -> float:
        """At rest: the force in N with which friction and stop must hold the magnet in the enclosure."""
        x, _, i, X, V, _ = y.tolist()
        gun, hand = self.gun, self.hand
        held_N = hand.stiffness_N_m * X + hand.damping_N_s_m * V
        share = gun.magnet_mass_kg / (gun.magnet_mass_kg + hand.enclosure_mass_kg)
        free = self.force(x, i) + self.way * self.friction()
        return float(free - share * held_N)


def simulate_held(gun: GunParameters, hand: HandMechanics | None = None, until_s: float = 0.4) -> HeldShot:
    """One shot from rest of a gun in a hand, to `until_s`. `ValueError`: a time that is not above 0.

    `RuntimeError`: the integration did not get there, or not in 200 stretches.
    """
    hand = hand or HandMechanics()
    stretches = list(_stretches(gun, hand, until_s))
    return _held(gun, hand, stretches)


def held_acceleration(
    gun: GunParameters, time_s: Vector, hand: HandMechanics | None = None, until_s: float = 0.4
) -> Vector:
    """The enclosure's acceleration X'' in m/s2 at times from the onset of the pulse, recoil positive.

    0 before the onset and after `until_s`. A landing, an impulse m v, is drawn as half a sine over the time that a stop
    of the contact depth takes (`rigid_collision`). Raises as `simulate_held`.
    """
    hand, found = hand or HandMechanics(), np.zeros(len(time_s))
    for one in _stretches(gun, hand, until_s, dense=True):
        inside = (time_s >= one.times[0]) & (time_s < one.times[-1])
        if inside.any() and one.between is not None:
            found[inside] += [one.phase.rates(0.0, state)[4] for state in one.between(time_s[inside]).T]
        if one.landed_m_s is not None:
            found += _blow(gun, hand, time_s - one.times[-1], one.landed_m_s)
    return found


def _blow(gun: GunParameters, hand: HandMechanics, since_s: Vector, speed_m_s: float) -> Vector:
    """What a landing does to the enclosure, over the time that it takes."""
    blow = rigid_collision(gun, speed_m_s)
    if blow.duration_s == 0:
        return np.zeros(len(since_s))
    change_m_s = blow.impulse_Ns / (gun.magnet_mass_kg + hand.enclosure_mass_kg)
    phase = np.clip(since_s / blow.duration_s, 0.0, 1.0) * math.pi
    return change_m_s * math.pi / (2 * blow.duration_s) * np.sin(phase)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Stretch:
    """A shot between two events: times and states, and the speed of a landing at its end.

    `path`: first the states where kick and force on the hand turn, then those of the times. `between` gives the states
    at any time of it, if that was asked for.
    """

    phase: _Phase
    times: Vector
    path: Vector
    between: Callable[[Vector], Vector] | None
    landed_m_s: float | None


def _stretches(gun: GunParameters, hand: HandMechanics, until_s: float, *, dense: bool = False) -> Iterator[_Stretch]:
    if not 0 < until_s < math.inf:
        raise ValueError(f"until_s is {until_s}; it must be a finite time above 0")
    t, y, broke, rests, work = 0.0, np.zeros(6), 0, False, itertools.count(1)
    for _ in range(_MAX_PHASES):
        phase = _phase(gun, hand, t, y, broke)
        phase = replace(phase, way=0) if rests else phase
        limit_s = gun.pulse_s if t < gun.pulse_s < until_s else until_s
        found = _integrated(phase, (t, limit_s), y, work, dense=dense)
        began_s, t, y = t, float(found.t[-1]), found.y[:, -1].copy()
        landed = found.status == 1 and phase.way < 0 and len(found.t_events[1]) > 0
        landed_m_s = -float(y[1]) if landed else None
        path = np.concatenate([*(some.T for some in found.y_events[2:] if len(some)), found.y], axis=1)
        yield _Stretch(phase=phase, times=found.t, path=path, between=found.sol, landed_m_s=landed_m_s)
        if t >= until_s:
            return
        broke = (1 if len(found.t_events[0]) else -1) if found.status == 1 and phase.way == 0 else 0
        rests = phase.way != 0 and t == began_s  # set out and got nowhere: it rests until the forces let it go anew
        _settle(phase, found, t, y)
    raise RuntimeError(
        f"the held shot came to {t:g} s in {_MAX_PHASES} stretches of motion and rest; ask for another hand or gun"
    )


def _integrated(phase: _Phase, span_s: tuple[float, float], y: Vector, work: Iterator[int], *, dense: bool) -> Any:
    """A stretch as scipy has it. `RuntimeError`: it did not get to an event or the end, or took too much work."""

    def rates(t: float, state: Vector) -> list[float]:
        if next(work) > _MAX_WORK:
            raise RuntimeError(
                f"the held shot came to {t:g} s in {_MAX_WORK:,} evaluations; the hand is too stiff, or the enclosure "
                "too light, to be followed"
            )
        return phase.rates(t, state)

    how: dict[str, Any] = {"rtol": _RTOL, "atol": _ATOL, "max_step": 2e-3, "dense_output": dense}
    if phase.way != 0 and y[1] == 0.0:
        how["first_step"] = min(_SET_OUT_S, span_s[1] - span_s[0])
    found: Any = scipy.integrate.solve_ivp(rates, span_s, y, _method(phase.gun), events=_events(phase), **how)
    if found.status < 0:
        raise RuntimeError(f"the held shot stopped at {found.t[-1]:g} s: {found.message}")
    return found


def _landing(gun: GunParameters, stretches: list[_Stretch]) -> tuple[float, float] | None:
    """When and how fast the magnet landed first after the pulse."""
    landings = ((float(one.times[-1]), one.landed_m_s) for one in stretches if one.landed_m_s is not None)
    return next((landing for landing in landings if landing[0] >= gun.pulse_s), None)


def _method(gun: GunParameters) -> Literal["DOP853", "Radau"]:
    """An implicit one where the current follows the motion at once."""
    return "DOP853" if gun.inductance_H / gun.resistance_ohm > _STIFF_S else "Radau"


def _phase(gun: GunParameters, hand: HandMechanics, t: float, y: Vector, broke: int) -> _Phase:
    """The stretch from here on; a magnet that just broke away goes the way of `broke`."""
    live = gun.drive_off == "shorted" or t < gun.pulse_s
    drive_V = gun.voltage_V if t < gun.pulse_s else 0.0
    rest = _Phase(gun=gun, hand=hand, way=0, drive_V=drive_V, live=live)
    way = int(np.sign(y[1])) or broke
    if way == 0:
        pull_N = rest.pull(y)
        held_N = gun.friction_N if pull_N > 0 else gun.homeward_friction_N
        if abs(pull_N) > held_N * (1 + _SLACK) and (pull_N > 0 or y[0] > 0):
            way = 1 if pull_N > 0 else -1
    return _Phase(gun=gun, hand=hand, way=way, drive_V=drive_V, live=live)


def _events(phase: _Phase) -> list[Any]:
    """Break-away at rest (outwards, homewards) or, in motion, turn and stop; then extremes of kick and felt force."""
    out_N, back_N = (
        friction_N * (1 + 2 * _SLACK) + 1e-12 for friction_N in (phase.gun.friction_N, phase.gun.homeward_friction_N)
    )
    extremes = [lambda _t, y: y[4], lambda t, y: phase.felt_rate(phase.rates(t, y))]
    if phase.way == 0:
        return [
            _ends(lambda _t, y: phase.pull(y) - out_N, 1),
            _ends(lambda _t, y: phase.pull(y) + back_N if y[0] > 0 else 1.0, -1),
            *extremes,
        ]
    return [
        _ends(lambda _t, y: phase.way * y[1], -1),
        _ends(lambda _t, y: y[0] if phase.way < 0 else 1.0, -1),
        *extremes,
    ]


def _ends(function: Callable[[float, Vector], float], direction: int) -> Any:
    def event(t: float, y: Vector) -> float:
        return float(function(t, y))

    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


def _settle(phase: _Phase, found: Any, t: float, y: Vector) -> None:
    """What an event does to the state: turn and stop take the velocity, an open drive the current."""
    gun, hand = phase.gun, phase.hand
    if found.status == 1 and phase.way != 0:
        if phase.way < 0 and len(found.t_events[1]):
            y[4] -= gun.magnet_mass_kg * y[1] / (gun.magnet_mass_kg + hand.enclosure_mass_kg)
            y[0] = 0.0
        y[1] = 0.0
    if gun.drive_off == "open" and t >= gun.pulse_s:
        y[2] = 0.0


def _held(gun: GunParameters, hand: HandMechanics, stretches: list[_Stretch]) -> HeldShot:
    path, landing = np.concatenate([one.path for one in stretches], axis=1), _landing(gun, stretches)
    turns = (float(one.times[-1]) for one in stretches[:-1] if one.phase.way > 0 and one.times[-1] != gun.pulse_s)
    x, v, _, X, V, impulse = path
    felt = hand.stiffness_N_m * X + hand.damping_N_s_m * V
    momentum = (gun.magnet_mass_kg + hand.enclosure_mass_kg) * V[-1] - gun.magnet_mass_kg * v[-1]
    return HeldShot(
        peak_hand_force_N=float(np.abs(felt).max()),
        peak_kick_m=float(X.max()),
        max_displacement_m=float(x.max()),
        turn_s=next(turns, None),
        reset_end_s=landing[0] if landing else None,
        impact_speed_m_s=landing[1] if landing else None,
        residual_impulse_Ns=float(momentum + impulse[-1]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """What a collision does to the hand; it lasts from the touch until the magnet has stopped."""

    impulse_Ns: float
    peak_force_N: float
    duration_s: float


def rigid_collision(gun: GunParameters, impact_speed_m_s: float) -> Collision:
    """The impulse m v of the inelastic stop, with the paper's estimate m v^2/x_k of its peak (equation 4).

    A stop that takes v over the depth x_k as a spring does a quarter of a swing: pi x_k/(2 v).
    """
    speed = _checked(impact_speed_m_s)
    duration_s = math.pi * gun.contact_depth_m / (2 * speed) if speed > 0 else 0.0
    peak_N = gun.magnet_mass_kg * speed**2 / gun.contact_depth_m
    return Collision(impulse_Ns=gun.magnet_mass_kg * speed, peak_force_N=peak_N, duration_s=duration_s)


def compliant_collision(gun: GunParameters, impact_speed_m_s: float, stop_N_m: float | None = None) -> Collision:
    """The same through a stop that gives way, under which the pre-loaded spring and friction work on.

    m y'' = k (x_0 - y) - F_f - k_c y for the depth y, until y' = 0. The peak is that of the stop's push. Without a
    stiffness k_c in N/m the stop is as stiff as equation (4) takes it to be: k_c = m v^2/x_k^2. `ValueError`: a
    stiffness that is not above 0.
    """
    speed = _checked(impact_speed_m_s)
    if stop_N_m is not None and not 0 < stop_N_m < math.inf:
        raise ValueError(f"stop_N_m is {stop_N_m}; it must be a finite number above 0")
    if speed == 0:
        return Collision(impulse_Ns=0.0, peak_force_N=0.0, duration_s=0.0)
    m, push_N = gun.magnet_mass_kg, gun.stiffness_N_m * gun.preload_length_m - gun.homeward_friction_N
    stop_N_m = m * (speed / gun.contact_depth_m) ** 2 if stop_N_m is None else stop_N_m
    total_N_m = stop_N_m + gun.stiffness_N_m
    omega = math.sqrt(total_N_m / m)
    centre_m = push_N / total_N_m
    duration_s = math.atan2(speed / omega, -centre_m) / omega
    depth_m = centre_m + math.hypot(centre_m, speed / omega)
    swept_m_s = centre_m * duration_s + speed / omega**2 + centre_m * (-math.sin(omega * duration_s) / omega)
    swept_m_s -= speed / omega**2 * math.cos(omega * duration_s)
    return Collision(impulse_Ns=stop_N_m * swept_m_s, peak_force_N=stop_N_m * depth_m, duration_s=duration_s)


def _checked(speed: float) -> float:
    if not 0 <= speed < math.inf:
        raise ValueError(f"impact_speed_m_s is {speed}; it must be a finite number of at least 0")
    return speed
