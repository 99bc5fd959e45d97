"""A magnet that sticks and slips outwards, thousands of times in a pulse: all of its slips, read off a few.

A slip begins from rest, at the current that breaks the magnet away there. So how far it goes, and how long it is until
the next one, follow from the place alone. Each brings the magnet nearer to where the drive's steady current just holds
it, by a share that changes slowly: over a stretch of hundreds of slips that share and the time from slip to slip are
polynomials of the logarithm of the way left. They are laid through slips that are made, at Chebyshev's nodes, and the
others are read off them, each from where the one before it ended.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from device.physics.equations import (
    BREAK_AWAY,
    COIL,
    CONTINUES,
    MAX_WORK,
    OVER,
    TURN,
    Coefficients,
    Constants,
    ShotResult,
    ShotState,
    StepSeries,
)
from device.physics.polynomial import from_text, value_at
from device.physics.segments import advance, enter, outward_threshold

MANY_SLIPS = 20
"""So many are made one by one before it is worth looking ahead."""
_DEGREE = 12
_MOST, _FEWEST = 1024.0, 48.0  # slips of a stretch
_LATER = 4  # times as many slips until the next look, where no stretch will do
_STEPS = 20  # of one slip, which has two or three
_EXACT = 3e-13  # of the place: what a stretch may be out by
_READ_A_STEP = 8  # slips that are read off in the time of a step


def slip_on(p: Constants, s: ShotState, w: StepSeries, out: ShotResult) -> None:
    """At a break-away: moves `s` on to a later one, if there are many and each is as the one before it.

    The recoil stage is over by then: all that a slip adds to the results is how far the magnet is.
    """
    s.slips += 1
    if s.slips < MANY_SLIPS or out.stage != OVER or not s.heading > 0.0:
        return
    x = s.x
    w.limit = limit_of_slips(p, s.u)
    left = w.limit - x
    width = widest_stretch(p, s, w, left) if left > 0.0 else 0.0
    break_away(p, s, x + read_slips(s, w, left, width))
    s.slips = MANY_SLIPS if width > 0.0 else -_LATER * MANY_SLIPS
    out.max_displacement_m = max(out.max_displacement_m, s.x)


def limit_of_slips(p: Constants, u: float) -> float:
    """Where the drive's steady current just holds a resting magnet."""
    push = p.motor_constant * u / p.resistance
    return (push - p.stiffness * p.preload - p.friction_out) / (p.stiffness + push / p.coil_reach)


def widest_stretch(p: Constants, s: ShotState, w: StepSeries, left: float) -> float:
    """How far ahead slips are polynomials, which stay in `w`, as a logarithm of the way left; 0: not worth it."""
    share, wait = slip(p, s, w, left)
    if share == 0.0:
        return 0.0
    width = share * min(_MOST, (s.drive_until - s.time) / wait)
    while width >= _FEWEST * share:
        if expand_slips(p, s, w, left, width):
            return width
        width *= 0.5
    return 0.0


def expand_slips(p: Constants, s: ShotState, w: StepSeries, left: float, width: float) -> bool:
    """The polynomials over a stretch, and whether they are as exact as they must be.

    The drive changes at a time of its own: what the time is out by moves the magnet by a part of a slip.
    """
    for n in range(_DEGREE + 1):
        w.shares[n], w.waits[n] = 0.0, 0.0
    for node in range(_DEGREE + 1):
        angle = math.pi * (node + 0.5) / (_DEGREE + 1)
        share, wait = slip(p, s, w, left * math.exp(-0.5 * width * (1.0 + math.cos(angle))))
        if share == 0.0:
            return False
        for n in range(_DEGREE + 1):
            part = (2.0 if n > 0 else 1.0) / (_DEGREE + 1) * math.cos(n * angle)
            w.shares[n] += part * share
            w.waits[n] += part * wait
    count = width / w.shares[0]
    out = max(last_two(w.shares), last_two(w.waits) * w.shares[0] / w.waits[0])
    return count * out * left <= _EXACT * (w.limit - left * math.exp(-width))


def last_two(c: Coefficients) -> float:
    """The size of what a polynomial leaves out, by the last coefficients that it has."""
    last, other = abs(c[_DEGREE]), abs(c[_DEGREE - 1])
    return max(last, other)


def slip(p: Constants, s: ShotState, w: StepSeries, left: float) -> tuple[float, float]:
    """One slip with this way left: which share of it, as a logarithm, and the time to the next; 0 if none follows.

    Its clock starts at 0 and it counts the way from its beginning: both would lose digits in far larger numbers.
    """
    now, until = s.time, s.drive_until
    s.time, s.drive_until = 0.0, until - now
    break_away(p, s, w.limit - left)
    moved, event = 0.0, CONTINUES
    for _ in range(_STEPS):
        in_coil = s.kind == COIL
        event = advance(p, s, w)
        w.work += 1
        if in_coil:
            w.x[0] = 0.0
            moved += value_at(w.x, s.used)
        enter(p, s, event)
        if event != CONTINUES and not (event == TURN and s.heading == 0.0):
            break
    wait, share = s.time, moved / left
    s.time, s.drive_until = now, until
    if event != BREAK_AWAY or not (s.heading > 0.0 and 0.0 < share < 1.0 and wait > 0.0):
        return 0.0, 0.0
    return -math.log1p(-share), wait


def break_away(p: Constants, s: ShotState, x: float) -> None:
    """The beginning of a slip: at rest at x, with the current that lets the magnet go."""
    s.x, s.v, s.heading, s.i = x, 0.0, 0.0, outward_threshold(p, x)
    enter(p, s, BREAK_AWAY)


def read_slips(s: ShotState, w: StepSeries, left: float, width: float) -> float:
    """How far the slips of a stretch go, up to its end or the last one before the drive changes; `s` has their time."""
    gone, took, ahead, count = 0.0, 0.0, s.drive_until - s.time, 0
    while count < _READ_A_STEP * (MAX_WORK - w.work) and gone < width:
        place = 2.0 * gone / width - 1.0
        wait = chebyshev_at(w.waits, place)
        if took + wait >= ahead:
            break
        gone += chebyshev_at(w.shares, place)
        took += wait
        count += 1
    w.work += count // _READ_A_STEP
    s.time += took
    return -left * math.expm1(-gone)


def _chebyshev_at() -> Iterator[str]:
    """Clenshaw's scheme."""
    yield f"twice, b{_DEGREE + 1}, b{_DEGREE} = 2.0 * place, 0.0, c[{_DEGREE}]"
    yield from (f"b{n} = c[{n}] + twice * b{n + 1} - b{n + 2}" for n in range(_DEGREE - 1, 0, -1))
    yield "return c[0] + place * b1 - b2"


chebyshev_at: Callable[[Coefficients, float], float] = from_text("chebyshev_at", "c, place", _chebyshev_at)
"""The sum of c[n] T_n(place), `place` from -1 to 1."""
