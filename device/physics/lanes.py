"""Eight shots side by side, in lanes of the processor's registers: a batch of guns that shoot as the paper's.

A lane does what `device.physics.coil` and `device.physics.shot` do with one gun, operation by operation, so it comes to
the same digits. The series and the polynomials are theirs, compiled for lanes; what has branches there stands here with
`where` in their place. Between two stays in the coil a shot goes its own way, through the closed forms.

A shot leaves its lane where lanes would go different ways: a current that follows the motion, a step that has to be
fitted twice, more than one root in a step, too many steps. It is shot again alone, and the next gun enters the lane. A
magnet that creeps stays, in plain steps: the last of its digits may then be others than those of a magnet alone.

All of this is compiled (`device.physics.batch`) and never interpreted. `r` are the rows of what is known of each lane,
`a` the same numbers one by one, `w` the rows of its series.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from device.physics.coil import has_fast_current
from device.physics.equations import (
    COIL,
    COIL_EDGE,
    CONTINUES,
    DRIVE_CHANGE,
    FORCE_ZERO,
    FREE,
    GIVEN_UP,
    MAX_SEGMENTS,
    ORDER,
    OVER,
    RECOILING,
    STOP,
    TURN,
    Constants,
    motor_force,
    spring_force,
)
from device.physics.lane_roots import falling_roots, roots_of, sign_changes_of
from device.physics.polynomial import (
    falls,
    least_sum,
    least_sum_past_first,
    to_bernstein,
    to_bernstein_up_to,
    value_at,
    value_at_end,
)
from device.physics.segments import free_arc, rest
from device.physics.series import (
    LONGEST_STEP,
    NEAR_ENOUGH,
    NEGLIGIBLE,
    TOLERANCE,
    expand_printed,
    expand_reciprocal,
    last_of,
    leading,
    rescale,
    twenty_fourth_root,
)
from device.physics.shot import SAME_FORCE, begin, conclude, goes_on, note_end, rest_at_stop, shoot
from device.physics.vectors import LANES, alike, bits, rows_in, where

MOST_STEPS = 300.0
"""Of one shot in its lane; the paper's guns take 8 and 19."""
FEWEST_GUNS = 2 * LANES
"""Shots that are worth lanes."""

# The rows: of the gun's constants those that steps need, at their places in `Constants`; the state and the drive, the
# step, the results.
TIME, X, V, I, GUESS, U, HEADING, UNTIL, RECOIL_MAY_END, FOLLOWS_FROM = range(16, 26)  # noqa: E741 - the current
EVENT, SPAN, USED, STEP_COUNT, LEAVES, BUSY, STAGE, PEAK, TOP = range(26, 35)
STATE_ROWS = 35
SERIES_ROWS = ORDER + 1
LANE_ROWS = STATE_ROWS + 5 * SERIES_ROWS


class LaneSeries(NamedTuple):
    """`StepSeries` in lanes."""

    x: Any
    v: Any
    i: Any
    other: Any
    bernstein: Any


def series_of(room: Any) -> LaneSeries:
    """The rows behind those of the state."""
    return LaneSeries(
        rows_in(room[STATE_ROWS:]),
        rows_in(room[STATE_ROWS + SERIES_ROWS :]),
        rows_in(room[STATE_ROWS + 2 * SERIES_ROWS :]),
        rows_in(room[STATE_ROWS + 3 * SERIES_ROWS :]),
        rows_in(room[STATE_ROWS + 4 * SERIES_ROWS :]),
    )


def guns_of(r: Any, reciprocal: bool) -> Constants:
    """The constants of each lane's gun, all with one law of the back-EMF; what only the closed forms need is 0."""
    return Constants(
        r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], 0.0, 0.0, 0.0, False, reciprocal, r[14], 0
    )  # fmt: skip


def friction_of(p: Any, heading: Any) -> Any:
    """`friction` in lanes."""
    return where(heading > 0.0, -p.friction_out, p.friction_back)


def force_of(p: Any, heading: Any, x: Any, i: Any) -> Any:
    """`force_on_hand` in lanes."""
    return motor_force(p, x, i) - spring_force(p, x) + friction_of(p, heading)


def let_leave(r: Any, chosen: Any) -> None:
    """The shots in these lanes are to be shot alone."""
    r[LEAVES] = where(chosen, 1.0, r[LEAVES])


# The step's series: `coil_step`


def ratio_of(a: Any, b: Any) -> Any:
    """`size_ratio` in lanes; not a number where a series is none, which `radius_of` sees."""
    return where(a == 0.0, 0.0, abs(a) / b)


def radius_of(p: Any, u: Any, span: Any, w: Any) -> Any:
    """`radius` in lanes; 0 where a series is none."""
    held = p.stiffness * (p.preload + abs(w.x[0])) + p.friction_out + p.motor_constant * abs(w.i[0])
    v_size = leading(w.v, 1e-6 * held / p.mass * span)
    x_size = leading(w.x, v_size * span)
    i_size = leading(w.i, 1e-2 * (abs(u) + p.back_emf * abs(w.v[0])) / p.resistance)
    x, v, i = ratio_of(last_of(w.x), x_size), ratio_of(last_of(w.v), v_size), ratio_of(last_of(w.i), i_size)
    last = max(x, v, i)
    factor = where(last <= NEGLIGIBLE, LONGEST_STEP, min(LONGEST_STEP, twenty_fourth_root(TOLERANCE / last)))
    return where(x + v + i < math.inf, factor, 0.0)


def fit_spans(p: Any, r: Any, w: Any) -> None:
    """`fitted_span` in lanes, where once is enough, and the end of the drive."""
    left = r[UNTIL] - r[TIME]
    factor = radius_of(p, r[U], r[GUESS], w)
    let_leave(r, ~(factor > 0.5))
    factor = where(abs(factor - 1.0) <= NEAR_ENOUGH, 1.0, factor)
    rescale(w, factor)
    span = r[GUESS] * factor
    let_leave(r, ~((span > 0.0) & (span < math.inf)))
    r[GUESS] = span
    over = span >= left
    if bits(over) != 0:
        rescale(w, where(over, left / span, 1.0))
    r[SPAN] = where(over, left, span)
    r[USED] = 1.0
    r[EVENT] = where(over, float(DRIVE_CHANGE), float(CONTINUES))


def step(r: Any, w: Any, reciprocal: bool) -> None:
    """`coil_step` in lanes, and what it adds to the results."""
    p = guns_of(r, reciprocal)
    r[LEAVES] = where(r[STEP_COUNT] >= MOST_STEPS, 1.0, 0.0)
    r[STEP_COUNT] = r[STEP_COUNT] + 1.0
    settled = (r[BUSY] > 0.0) & (r[TIME] >= r[FOLLOWS_FROM])
    if bits(settled) != 0:
        let_leave(r, settled & has_fast_current(p, r[U], r[X], r[V], r[I]))
    w.x[0], w.v[0], w.i[0] = r[X], r[V], r[I]
    push = friction_of(p, r[HEADING]) - p.stiffness * p.preload
    if reciprocal:
        expand_reciprocal(p, r[U], push, r[GUESS], w)
    else:
        expand_printed(p, r[U], push, r[GUESS], w)
    fit_spans(p, r, w)
    find_events(p, r, w)
    land_at_events(p, r, w)
    find_peaks(p, r, w)


# The first event in it: `finish_step`


def find_events(p: Any, r: Any, w: Any) -> None:
    """The first event of each step. Most lanes look for none; those that look for several do so one after another."""
    heading, busy, at_rest = r[HEADING], r[BUSY] > 0.0, w.v[0] == 0.0
    speed, least_change = heading * w.v[0], least_sum_past_first(w.v, heading)
    turns = busy & ~(where(at_rest, least_change, speed + min(0.0, least_change)) > 0.0)
    ahead = heading * (where(heading > 0.0, p.coil_reach, 0.0) - w.x[0])
    arrives = busy & ~(ahead + min(0.0, least_sum_past_first(w.x, -heading)) > 0.0)
    fades = busy & (r[RECOIL_MAY_END] > 0.0) & (heading > 0.0) & (w.i[0] > 0.0)
    if bits(fades) != 0:
        fades = fades & (least_sum(w.i, 1.0) <= 0.0)
    while bits(turns | arrives | fades) != 0:
        arrives_now, fades_now = arrives & ~turns, fades & ~(turns | arrives)
        shifted = at_rest & turns
        sign = where(fades_now, 1.0, where(turns, heading, -heading))
        for n in range(ORDER):
            w.other[n] = sign * where(turns, where(shifted, w.v[n + 1], w.v[n]), where(fades_now, w.i[n], w.x[n]))
        w.other[ORDER] = sign * where(turns, where(shifted, 0.0, w.v[ORDER]), where(fades_now, w.i[ORDER], w.x[ORDER]))
        w.other[0] = where(arrives_now, ahead, w.other[0])
        at = first_crossings(r, w, turns | arrives_now | fades_now)
        end_steps(r, turns & (at <= r[USED]), at, float(TURN))
        end_steps(r, arrives_now & (at <= r[USED]), at, where(heading > 0.0, float(COIL_EDGE), float(STOP)))
        end_steps(r, fades_now & (at < r[USED]), at, float(FORCE_ZERO))
        turns, arrives, fades = turns & ~turns, arrives & turns, fades & (turns | arrives)


def end_steps(r: Any, chosen: Any, at: Any, event: Any) -> None:
    """An event in these lanes."""
    r[USED] = where(chosen, at, r[USED])
    r[EVENT] = where(chosen, event, r[EVENT])


def first_crossings(r: Any, w: Any, needed: Any) -> Any:
    """`first_crossing` of the polynomials in `other` in lanes; 0 where it does not begin above 0."""
    above = w.other[0] > 0.0
    at, falling, end = where(above, 2.0, 0.0), falls(w.other) > 0.0, value_at_end(w.other)
    some, others = needed & above & falling & (end <= 0.0), needed & above & ~falling
    if bits(some) != 0:
        at = where(some, falling_roots(w, end, alike(1.0), some), at)
    if bits(others) == 0:
        return at
    to_bernstein(w)
    changes = sign_changes_of(w.bernstein)
    let_leave(r, others & (changes > 1.0))
    some = others & (changes == 1.0)
    return where(some, roots_of(w, alike(1.0), some), at) if bits(some) != 0 else at


def land_at_events(p: Any, r: Any, w: Any) -> None:
    """`land` in lanes, and when that is."""
    event, used = r[EVENT], r[USED]
    x, v, i = value_at_end(w.x), value_at_end(w.v), value_at_end(w.i)
    inside = (r[BUSY] > 0.0) & (event != float(CONTINUES)) & (event != float(DRIVE_CHANGE))
    if bits(inside) != 0:
        x, v, i = (
            where(inside, value_at(w.x, used), x),
            where(inside, value_at(w.v, used), v),
            where(inside, value_at(w.i, used), i),
        )
        v = where(event == float(TURN), 0.0, v)
        x = where(event == float(COIL_EDGE), p.coil_reach, where(event == float(STOP), 0.0, x))
        i = where(event == float(FORCE_ZERO), 0.0, i)
        r[RECOIL_MAY_END] = where(inside & (r[HEADING] > 0.0), 0.0, r[RECOIL_MAY_END])
    r[X], r[V], r[I] = x, v, i
    now = r[TIME] + used * r[SPAN]
    ends = (event == float(DRIVE_CHANGE)) | ((event == float(CONTINUES)) & (now >= r[UNTIL]))
    r[TIME] = where(ends, r[UNTIL], now)
    r[EVENT] = where(ends, float(DRIVE_CHANGE), event)
    r[TOP] = max(r[TOP], x)


# What it adds to the results: `note_peak`


def find_peaks(p: Any, r: Any, w: Any) -> None:
    """The recoil stage's peaks so far."""
    heading = r[HEADING]
    pushed = (r[BUSY] > 0.0) & (r[STAGE] != float(OVER)) & ((heading > 0.0) | (r[U] > 0.0))
    if bits(pushed) == 0:
        return
    start = where(r[STAGE] == float(RECOILING), r[PEAK], force_of(p, heading, w.x[0], w.i[0]))
    best = max(start, force_of(p, heading, r[X], r[I]))
    r[STAGE] = where(pushed, float(RECOILING), r[STAGE])
    r[PEAK] = where(pushed, best, r[PEAK])
    for n in range(ORDER):
        w.other[n] = (n + 1) * w.v[n + 1]
    w.other[ORDER] = 0.0
    rises = pushed & (-least_sum(w.other, -1.0) > (best + SAME_FORCE * abs(best)) * r[SPAN] / p.mass)
    if bits(rises) != 0:
        find_tops(p, r, w, rises)


def find_tops(p: Any, r: Any, w: Any, rises: Any) -> None:
    """`peak_force` in lanes where the force may rise above its ends."""
    used = r[USED]
    for n in range(ORDER - 1):
        w.other[n] = (n + 1) * (n + 2) * w.v[n + 2]
    w.other[ORDER - 1] = 0.0
    end = where(used < 1.0, value_at(w.other, used), value_at_end(w.other))
    falling = falls(w.other) > 0.0
    tops = rises & falling & (w.other[0] > 0.0) & (end <= 0.0)
    if bits(tops) != 0:
        see_tops(p, r, w, tops, falling_roots(w, end, used, tops))
    rises = rises & ~falling
    if bits(rises) == 0:
        return
    if bits(rises & (used < 1.0)) != 0:
        to_bernstein_up_to(w, used)
    else:
        to_bernstein(w)
    changes = sign_changes_of(w.bernstein)
    let_leave(r, rises & (changes > 1.0))
    tops = rises & (changes == 1.0)
    if bits(tops) != 0:
        see_tops(p, r, w, tops, roots_of(w, used, tops))


def see_tops(p: Any, r: Any, w: Any, tops: Any, at: Any) -> None:
    """The force at its tops in these lanes, whose largest so far is in `r`."""
    top = force_of(p, r[HEADING], value_at(w.x, at), value_at(w.i, at))
    r[PEAK] = where(tops, max(r[PEAK], top), r[PEAK])


# Between the steps: one lane at a time


def put_gun(a: Any, lane: int, p: Constants) -> None:
    """The constants of a lane's next gun."""
    a[0, lane], a[1, lane], a[2, lane], a[3, lane] = p.mass, p.back_emf, p.resistance, p.inductance
    a[4, lane], a[5, lane], a[6, lane], a[7, lane] = p.motor_constant, p.coil_reach, p.stiffness, p.preload
    a[8, lane], a[14, lane], a[STEP_COUNT, lane] = p.friction_out, p.friction_back, 0.0


def put_state(a: Any, lane: int, s: Any, out: Any) -> None:
    """The state at the beginning of a stay in the coil."""
    a[TIME, lane], a[X, lane], a[V, lane], a[I, lane], a[GUESS, lane] = s.time, s.x, s.v, s.i, s.guess
    a[U, lane], a[HEADING, lane], a[UNTIL, lane], a[FOLLOWS_FROM, lane] = (
        s.u,
        s.heading,
        s.drive_until,
        s.transient_until,
    )
    a[RECOIL_MAY_END, lane] = 1.0 if s.recoiling else 0.0
    a[STAGE, lane], a[PEAK, lane], a[TOP, lane] = out.stage, out.peak_force_N, out.max_displacement_m


def take_state(a: Any, lane: int, s: Any, out: Any) -> None:
    """The state at its end."""
    s.time, s.x, s.v, s.i = a[TIME, lane], a[X, lane], a[V, lane], a[I, lane]
    s.recoiling = a[RECOIL_MAY_END, lane] > 0.0
    out.stage, out.peak_force_N, out.max_displacement_m = int(a[STAGE, lane]), a[PEAK, lane], a[TOP, lane]


def enter_lane(a: Any, lane: int, p: Constants, s: Any, out: Any) -> bool:
    """A shot up to its first step in the coil, and whether there is one; else it is over."""
    put_gun(a, lane, p)
    rest_at_stop(s)
    begin(p, s, out)
    return to_coil(a, lane, p, s, out)


def after_event(a: Any, lane: int, p: Constants, s: Any, out: Any) -> bool:
    """A shot from the event that ended a step on, up to the next step, and whether there is one; else it is over."""
    event = int(a[EVENT, lane])
    take_state(a, lane, s, out)
    note_end(p, s, event, out)
    if goes_on(p, s, event):
        return to_coil(a, lane, p, s, out)
    conclude(p, s, event, out)
    return False


def to_coil(a: Any, lane: int, p: Constants, s: Any, out: Any) -> bool:
    """The closed forms up to the next step in the coil, and whether there is one; else the shot is over."""
    event = GIVEN_UP
    for _ in range(MAX_SEGMENTS):
        if s.kind == COIL:
            put_state(a, lane, s, out)
            return True
        event = free_arc(p, s) if s.kind == FREE else rest(p, s)
        note_end(p, s, event, out)
        if not goes_on(p, s, event):
            break
    conclude(p, s, event, out)
    return False


def refill(a: Any, gun_in: Any, taken: int, shots: Any, reciprocal: bool) -> int:
    """The next guns into the lanes that are free; how many have been taken then."""
    guns, results, alone, states = shots
    for lane in range(LANES):
        while a[BUSY, lane] == 0.0 and taken < len(guns):
            n, taken = taken, taken + 1
            if not alone[n] and guns[n].reciprocal == reciprocal:
                gun_in[lane] = n
                a[BUSY, lane] = enter_lane(a, lane, guns[n], states[lane], results[n])
    return taken


def after_steps(a: Any, gun_in: Any, ended: int, leave: int, shots: Any) -> None:
    """What follows in the lanes whose step ended in an event, or which their shot has to leave."""
    guns, results, alone, states = shots
    for lane in range(LANES):
        if ended >> lane & 1:
            n = gun_in[lane]
            if leave >> lane & 1:
                alone[n], a[BUSY, lane] = True, 0.0
            else:
                a[BUSY, lane] = after_event(a, lane, guns[n], states[lane], results[n])


def shoot_side_by_side(shots: Any, room: Any, reciprocal: bool) -> None:
    """The shots of the guns with this law of the back-EMF that are not marked as `alone`; who leaves is marked."""
    a, r, w = room, rows_in(room), series_of(room)
    gun_in, taken, busy = np.zeros(LANES, np.int64), 0, 1
    for lane in range(LANES):
        a[BUSY, lane] = 0.0
    while busy != 0:
        taken = refill(a, gun_in, taken, shots, reciprocal)
        busy = bits(r[BUSY] > 0.0)
        step(r, w, reciprocal)
        leave = bits(r[LEAVES] > 0.0) & busy
        after_steps(a, gun_in, (leave | bits(r[EVENT] != float(CONTINUES))) & busy, leave, shots)


def shoot_each(guns: Any, results: Any, alone: Any, room: Any, states: Any, series: Any) -> None:
    """The result of each gun's shot. Those that are not plain from the start are marked as `alone`."""
    many, shots = len(guns) >= FEWEST_GUNS, (guns, results, alone, states)
    if many:
        shoot_side_by_side(shots, room, False)
        shoot_side_by_side(shots, room, True)
    for n in range(len(guns)):
        if alone[n] or not many:
            shoot(guns[n], states[0], series[0], results[n])
