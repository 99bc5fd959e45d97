"""The magnet moving inside a live coil: one step of its series, ended by the first event in it.

Where the current's own time constant L/R is far below all others and its transient is over, the current follows the
motion, and the step no longer depends on the inductance. Where the back-EMF brakes so much that the magnet creeps,
speed and current follow the position, and the step no longer depends on how fast they do.
"""

from __future__ import annotations

import math

from device.physics.equations import (
    COIL_EDGE,
    CONTINUES,
    DRIVE_CHANGE,
    FORCE_ZERO,
    GIVEN_UP,
    HORIZON_S,
    ORDER,
    STOP,
    TURN,
    Constants,
    ShotState,
    StepSeries,
    grip,
)
from device.physics.polynomial import (
    first_crossing,
    least_sum,
    least_sum_past_first,
    look_for,
    value_at,
    value_at_end,
)
from device.physics.series import (
    clear,
    expand,
    expand_creeping,
    expand_slaved,
    fitted_span,
    follow,
    rescale,
    size_ratio,
)

_TRANSIENT = 40.0  # time constants of the current, after which exp(-40) of it is left
_TRY_AGAIN = 400.0  # the same, until the next look at series that did not settle: some forty plain steps
_SLAVED = 0.02  # the current follows the motion if L/R is at most this part of the motion's own time


def motion_rate(p: Constants, u: float, x: float, v: float, i: float) -> float:
    """How fast the motion itself changes, in 1/s: braking by the back-EMF, the force's fading along x, the spring."""
    current = abs(u) / p.resistance + abs(i)
    braking = braking_rate(p, grip(p, x))
    fading = math.sqrt(p.motor_constant * current / (p.coil_reach * p.mass)) + abs(v) / p.coil_reach
    return braking + fading + math.sqrt(p.stiffness / p.mass)


def has_fast_current(p: Constants, u: float, x: float, v: float, i: float) -> bool:
    """Whether the current settles so fast that it follows the motion, once its transient is over."""
    return motion_rate(p, u, x, v, i) * p.inductance / p.resistance <= _SLAVED


def try_to_follow(p: Constants, s: ShotState, w: StepSeries) -> bool:
    """The series whose current follows the motion, if it does; if they do not settle, when to look again."""
    if s.time < s.transient_until or not has_fast_current(p, s.u, s.x, s.v, s.i):
        return False
    settled = expand_slaved(p, s.u, s.heading, s.guess, w)
    if not settled:
        s.transient_until = s.time + _TRY_AGAIN * p.inductance / p.resistance
    return settled


def begin_coil(p: Constants, s: ShotState) -> None:
    """A first guess at the step, and when the current's transient will be over."""
    if p.inductance == 0.0:
        s.guess = 2.0 / motion_rate(p, s.u, s.x, s.v, s.i)
        return
    rate = p.resistance / p.inductance
    swing = math.sqrt(p.back_emf * p.motor_constant / (p.mass * p.inductance))
    current = abs(s.u) / p.resistance + abs(s.i)
    fading = math.sqrt(p.motor_constant * current / (p.coil_reach * p.mass))
    s.guess = 2.0 / (rate + swing + fading + math.sqrt(p.stiffness / p.mass))
    s.transient_until = s.time + _TRANSIENT / rate


def how_long(part: float, rate: float) -> float:
    """How many seconds a part takes at a rate; infinite if nothing goes on."""
    return part / rate if rate > 0.0 else math.inf


def braking_rate(p: Constants, hold: float) -> float:
    """How fast the back-EMF brakes a free magnet at the coil's hold, in 1/s, without inductance."""
    return p.back_emf * p.motor_constant / (p.mass * p.resistance) * hold * (hold if p.reciprocal else 1.0)


def fading_rate(p: Constants, hold: float) -> float:
    """How fast speed and current come to follow the position, in 1/s: the slower of their two rates."""
    braking = braking_rate(p, hold)
    if p.inductance == 0.0:
        return braking
    rate = p.resistance / p.inductance
    spare = 1.0 - 4.0 * braking / rate
    return 2.0 * braking / (1.0 + math.sqrt(spare)) if spare > 0.0 else 0.5 * rate


def settling_rate(p: Constants, hold: float) -> float:
    """How fast what fades goes on meanwhile, in 1/s: above the rate of its fading where speed and current ring."""
    braking = braking_rate(p, hold)
    rings = p.inductance > 0.0 and 4.0 * braking * p.inductance > p.resistance
    return math.sqrt(braking * p.resistance / p.inductance) if rings else fading_rate(p, hold)


def creeping_rate(p: Constants, s: ShotState, hold: float) -> float:
    """How fast the position itself changes then, in 1/s."""
    stiffness = p.stiffness + p.motor_constant * abs(s.i) / p.coil_reach
    return stiffness / (p.mass * braking_rate(p, hold)) + abs(s.v) / (hold * p.coil_reach)


_CREEPING = 0.02  # the magnet creeps if its position changes at most at this part of the rate at which the rest settles
_LOOK_AGAIN = 20.0  # rings, in radians, or time constants besides the one of what fades, until the next look
_APART = 1e-12  # relative: closer than this, speed and current are those that follow the position
_ANYWAY = 1e-4  # the same, so near that the hold of the coil counts as constant until all has faded


def until_next_look(p: Constants, hold: float) -> float:
    """How many seconds it is worth waiting before looking whether the magnet creeps; infinite if it never does."""
    fading = fading_rate(p, hold)
    return 1.0 / fading + _LOOK_AGAIN / settling_rate(p, hold) if fading > 0.0 else math.inf


def do_not_creep_yet(p: Constants, s: ShotState) -> None:
    """A magnet that moves freely, and when to look whether it creeps."""
    s.creeping, s.creeping_from = False, s.time + until_next_look(p, 1.0)


def may_creep(p: Constants, s: ShotState, hold: float) -> bool:
    """Whether the position changes slowly enough, at the coil's hold, for speed and current to follow it."""
    settling = settling_rate(p, hold)
    return settling > 0.0 and creeping_rate(p, s, hold) <= _CREEPING * settling


def try_to_creep(p: Constants, s: ShotState, w: StepSeries) -> None:
    """The series of a creeping magnet, if it creeps; if it does not yet, when to look again."""
    going, s.creeping, hold = s.creeping, False, grip(p, s.x)
    if may_creep(p, s, hold):
        rate = creeping_rate(p, s, hold)
        s.creeping, w.x[0] = True, s.x
        span = expand_creeping(p, s, s.guess if going else 1.0 / (rate + 1.0 / HORIZON_S), w)
        if span > 0.0 and not going:
            span = span_from_where_it_goes(p, s, w, span) if has_come_to_creep(p, s, w, rate) else 0.0
        s.creeping = span > 0.0
        if s.creeping:
            s.guess = span
        else:
            s.creeping_from = s.time + until_next_look(p, hold)
    if going and not s.creeping:
        begin_coil(p, s)
        do_not_creep_yet(p, s)


def has_come_to_creep(p: Constants, s: ShotState, w: StepSeries, rate: float) -> bool:
    """Whether it matters no longer how far speed and current are apart from those that follow the position.

    What is apart fades, and must be gone when the magnet arrives or the drive changes. It also shifts the position,
    which is known but for what the position itself changes meanwhile.
    """
    apart_v, apart_i = size_ratio(w.v[0] - s.v, abs(w.v[0])), size_ratio(w.i[0] - s.i, abs(w.i[0]))
    apart = max(apart_v, apart_i)
    ahead, hold = s.x if s.heading < 0.0 else p.coil_reach - s.x, grip(p, s.x)
    changes = s.drive_until - s.time if s.drive_until < HORIZON_S else math.inf  # nobody asks how it moves at the end
    soonest = min(how_long(ahead, abs(s.v)), changes)
    slowest = min(how_long(min(s.x, ahead), abs(s.v)), how_long(1.0, rate))
    settling, fading, products = settling_rate(p, hold), fading_rate(p, hold), braking_rate(p, hold) * slowest
    times = settling * slowest
    shifts = min(0.1 * _APART * times * times, _ANYWAY)
    if s.heading < 0.0:  # what the hold changes by until all has faded, times the shift
        shifts = max(shifts, 2.0 * _APART * times * fading * slowest)
    gone = apart <= _APART * math.exp(min(fading * soonest, 30.0))
    swing = max(apart_v, apart_i * max(1.0, 0.5 * settling / fading))  # of the speed, whatever the ring's phase
    return gone and swing <= s.farthest and apart <= min(shifts, math.sqrt(_APART * products))


def span_from_where_it_goes(p: Constants, s: ShotState, w: StepSeries, span: float) -> float:
    """The series from the position that the magnet goes on from once all has faded; their span, 0 if there is none.

    L di' = -R di - k_e dv and m dv' = k_m g di, integrated over what is apart, say how far it still carries the magnet.
    """
    pull, seen = p.motor_constant * grip(p, s.x), p.back_emf * (grip(p, s.x) if p.reciprocal else 1.0)
    apart_v, apart_i = s.v - w.v[0], s.i - w.i[0]
    w.x[0] = s.x + (p.inductance * apart_i + p.resistance * p.mass * apart_v / pull) / seen
    return expand_creeping(p, s, span, w)


def coil_step(p: Constants, s: ShotState, w: StepSeries) -> int:
    """One step; `s` moves on to its end, the series over it stay in `w`, and how much of them was used in `s`."""
    left, u = s.drive_until - s.time, s.u
    if s.time == s.began:
        do_not_creep_yet(p, s)
    if s.creeping or s.time >= s.creeping_from:
        try_to_creep(p, s, w)
    if not s.creeping:
        w.x[0], w.v[0], w.i[0] = s.x, s.v, s.i
        if p.inductance == 0.0:
            clear(w.i)
            follow(p, u, s.heading, s.guess, w)
        elif not try_to_follow(p, s, w):
            w.i[0] = s.i
            expand(p, u, s.heading, s.guess, w)
    span = fitted_span(p, s, s.guess, w)
    if not 0.0 < span < math.inf:
        return GIVEN_UP
    s.guess = span
    event = CONTINUES
    if span >= left:
        rescale(w, left / span)
        span, event = left, DRIVE_CHANGE
    return finish_step(p, s, w, span, event)


def finish_step(p: Constants, s: ShotState, w: StepSeries, span: float, event: int) -> int:
    """The first event of the step of `span` seconds, `event` if there is none; `s` moves on to it."""
    used = 1.0
    at = first_turn(w, s.heading)
    if at <= used:
        used, event = at, TURN
    at = first_arrival(p, w, s.heading)
    if at <= used:
        used, event = at, COIL_EDGE if s.heading > 0.0 else STOP
    if s.recoiling and s.heading > 0.0 and w.i[0] > 0.0 and least_sum(w.i, 1.0) <= 0.0:
        look_for(w, w.i, 1.0)
        at = first_crossing(w)
        if at < used:
            used, event = at, FORCE_ZERO
    land(p, s, w, used, event)
    s.span, s.used = span, used
    s.time = s.drive_until if event == DRIVE_CHANGE else s.time + used * span
    if event == CONTINUES and s.time >= s.drive_until:
        s.time, event = s.drive_until, DRIVE_CHANGE
    return event


def first_turn(w: StepSeries, heading: float) -> float:
    """Where the velocity first falls to 0, 2 if it does not. From rest v/s is looked at."""
    shift = 1 if w.v[0] == 0.0 else 0
    least = least_sum_past_first(w.v, heading)
    if (least if shift == 1 else heading * w.v[0] + min(0.0, least)) > 0.0:
        return 2.0
    look_for(w, w.v, heading)
    if shift == 1:
        for n in range(ORDER):
            w.other[n] = w.other[n + 1]
        w.other[ORDER] = 0.0
    return first_crossing(w) if w.other[0] > 0.0 else 0.0


def first_arrival(p: Constants, w: StepSeries, heading: float) -> float:
    """Where the magnet first meets the coil's edge (outwards) or the stop (homewards), 2 if it does not."""
    ahead = (p.coil_reach if heading > 0.0 else 0.0) - w.x[0]
    if heading * ahead + min(0.0, least_sum_past_first(w.x, -heading)) > 0.0:
        return 2.0
    look_for(w, w.x, -heading)
    w.other[0] = heading * ahead
    return first_crossing(w) if w.other[0] > 0.0 else 0.0


def land(p: Constants, s: ShotState, w: StepSeries, used: float, event: int) -> None:
    """The state at the end of a step; the quantity that defines the event is exact."""
    if event in (CONTINUES, DRIVE_CHANGE):
        s.x, s.v, s.i = value_at_end(w.x), value_at_end(w.v), value_at_end(w.i)
        return
    s.x, s.v, s.i = value_at(w.x, used), value_at(w.v, used), value_at(w.i, used)
    s.recoiling = s.recoiling and s.heading < 0.0  # what ends a way out in the coil ends the recoil stage
    if event == TURN:
        s.v = 0.0
    elif event == COIL_EDGE:
        s.x = p.coil_reach
    elif event == STOP:
        s.x = 0.0
    elif event == FORCE_ZERO:
        s.i = 0.0
