"""The magnet moving inside a live coil: Taylor series over one step, ended by the first event in it.

In s = (t - t_start)/span, 0 to 1:

    m v' = k_m g i - k (x + x_0) -/+ F_f,  L i' = u - R i - k_e v (printed) or k_e g v (reciprocal),  g = 1 - x/x_c

Products of series are Cauchy products (Jorba & Zou, Experimental Mathematics 14 (2005) 99, section 2), and so is the
choice of the step from the last two coefficients (section 3). Where the current's own time constant L/R is far below
all others and its transient is over, the current follows the motion (the slow manifold), and the step no longer
depends on the inductance.

    (n + 1) x[n+1] = h v[n],  g[n+1] = -x[n+1]/x_c
    (n + 1) v[n+1] = h/m (k_m (g i)[n] - k x[n]  + at n = 0: friction - k x_0)
    (n + 1) i[n+1] = h/L (at n = 0: u  - R i[n] - k_e v[n])          or, reciprocal, k_e (g v)[n];  h: the step

The product (g i)[n] is a sum of n + 1 terms. As a loop in a loop its bookkeeping costs more than its arithmetic:
interpreted two thirds of the time, compiled a third. So the text of the function is made here, once, for `ORDER`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from device.physics.equations import (
    COIL_EDGE,
    CONTINUES,
    DRIVE_CHANGE,
    FORCE_ZERO,
    GIVEN_UP,
    ORDER,
    STOP,
    TURN,
    Coefficients,
    Constants,
    ShotState,
    StepSeries,
    friction,
)
from device.physics.polynomial import first_crossing, lower_bound, value_at, value_at_end

Expand = Callable[[Constants, float, float, float, StepSeries], None]


def written_out(name: str, *, reciprocal: bool) -> Expand:
    """A function of (constants, drive in V, push in N, span in s, series), the first coefficients in the series.

    The push is what friction and the spring's pre-load give at x = 0.
    """
    space: dict[str, Any] = {}
    exec("\n".join([_head(name), *(_step(n, reciprocal) for n in range(ORDER))]), space)  # noqa: S102 - our own text
    expand: Expand = space[name]
    return expand


def _head(name: str) -> str:
    return f"""
def {name}(p, u, push, h, w):
    per_reach, per_mass, per_inductance = 1.0 / p.coil_reach, h / p.mass, h / p.inductance
    k, motor, emf, R = p.stiffness, p.motor_constant, p.back_emf, p.resistance
    x, v, i, g = w.x, w.v, w.i, w.grip
    x0, v0, i0 = x[0], v[0], i[0]
    g0 = (p.coil_reach - x0) * per_reach
    g[0] = g0"""


def _step(n: int, reciprocal: bool) -> str:
    """The coefficients n + 1 from those before."""
    after, part = n + 1, repr(1.0 / (n + 1))
    seen = f"({_product('g', 'v', n)})" if reciprocal else f"v{n}"
    push, drive = (" + push", "u ") if n == 0 else ("", "")
    return f"""
    x{after} = h * v{n} * {part}
    g{after} = -x{after} * per_reach
    v{after} = (motor * ({_product("g", "i", n)}) - k * x{n}{push}) * per_mass * {part}
    i{after} = ({drive}- R * i{n} - emf * {seen}) * per_inductance * {part}
    x[{after}], v[{after}], i[{after}], g[{after}] = x{after}, v{after}, i{after}, g{after}"""


def _product(a: str, b: str, n: int) -> str:
    """The n-th coefficient of a product: terms in pairs, first those that were known first."""
    half = (n + 1) // 2
    middle = [f"{a}{half} * {b}{half}"] if n % 2 == 0 else []
    pairs = [f"({a}{n - j} * {b}{j} + {a}{j} * {b}{n - j})" for j in range(half - 1, -1, -1)]
    return " + ".join([*middle, *pairs])


expand_printed = written_out("expand_printed", reciprocal=False)
expand_reciprocal = written_out("expand_reciprocal", reciprocal=True)

TOLERANCE = 2e-12
"""Of the first coefficient left out, relative to the largest of the leading ones."""
_LONGEST = 3.0  # how far past its scale a series may reach
_NEGLIGIBLE = 1e-30  # a last coefficient as small as this ends no step
_SWEEPS = 40  # the n-th adds about (braking x span)^n / n! of the first: 25 settle a step of three scales
_PER = (0.0, *(1.0 / n for n in range(1, ORDER + 2)))


def product(a: Coefficients, b: Coefficients, n: int) -> float:
    """The n-th coefficient of a product of series: two terms at a time, first those that were known first."""
    half = (n + 1) // 2
    total = a[half] * b[half] if n % 2 == 0 else 0.0
    for j in range(half - 1, -1, -1):
        total += a[n - j] * b[j] + a[j] * b[n - j]
    return total


def expand(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> None:
    """The series of x, v, i and g from their first coefficients, w.x[0], w.v[0] and w.i[0]."""
    push = friction(p, heading) - p.stiffness * p.preload
    if p.reciprocal:
        expand_reciprocal(p, u, push, span, w)
    else:
        expand_printed(p, u, push, span, w)


def expand_slaved(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> None:
    """The same on the slow manifold, R i = u - emf - L i': w.i[0] follows from w.x[0] and w.v[0].

    The sum of all derivatives of the emf that this stands for is one pass from the last coefficient down; a few
    passes settle what the current does to the motion.
    """
    follow(p, u, heading, span, w, True)
    for _ in range(_SWEEPS):
        change = slave(p, u, span, w)
        follow(p, u, heading, span, w, False)
        if change <= 1e-16:
            break


def follow(p: Constants, u: float, heading: float, span: float, w: StepSeries, algebraic: bool) -> None:
    """x, v and g from the series of the current; if `algebraic`, from the current that L = 0 would give."""
    push = friction(p, heading) - p.stiffness * p.preload
    w.grip[0] = (p.coil_reach - w.x[0]) / p.coil_reach
    for n in range(ORDER):
        if algebraic:
            w.i[n] = (u - p.back_emf * seen_speed(p, w, n)) / p.resistance
        w.x[n + 1] = span * w.v[n] * _PER[n + 1]
        w.grip[n + 1] = -w.x[n + 1] / p.coil_reach
        force = p.motor_constant * product(w.grip, w.i, n) - p.stiffness * w.x[n] + push
        w.v[n + 1] = force * span / p.mass * _PER[n + 1]
        push, u = 0.0, 0.0
    if algebraic:
        w.i[ORDER] = -p.back_emf * seen_speed(p, w, ORDER) / p.resistance


def seen_speed(p: Constants, w: StepSeries, n: int) -> float:
    """The n-th coefficient of the speed that the back-EMF sees."""
    return product(w.grip, w.v, n) if p.reciprocal else w.v[n]


def slave(p: Constants, u: float, span: float, w: StepSeries) -> float:
    """The current that R i = u - emf - L i' gives for this motion; how much it changed, relative to its size."""
    lag = p.inductance / p.resistance / span
    above, change, size = 0.0, 0.0, 1e-300
    for n in range(ORDER, -1, -1):
        drive = u if n == 0 else 0.0
        above = (drive - p.back_emf * seen_speed(p, w, n)) / p.resistance - lag * (n + 1) * above
        change = max(change, abs(above - w.i[n]))
        size = max(size, abs(above))
        w.i[n] = above
    return change / size


def leading(c: Coefficients, floor: float) -> float:
    """The size of a series over a step of its scale, at least `floor`."""
    return max(abs(c[0]), abs(c[1]), abs(c[2]), abs(c[3]), floor)


def radius(p: Constants, u: float, span: float, w: StepSeries) -> float:
    """How far the three series reach, in steps: where the last two coefficients come down to the tolerance.

    The floors keep what cancels in a force or a voltage from being asked to more digits than it has.
    """
    held = p.stiffness * (p.preload + abs(w.x[0])) + p.friction_out + p.motor_constant * abs(w.i[0])
    v_size = leading(w.v, 1e-6 * held / p.mass * span)
    x_size = leading(w.x, v_size * span)
    i_size = leading(w.i, 1e-2 * (abs(u) + p.back_emf * abs(w.v[0])) / p.resistance)
    last = max(size_ratio(w.x[ORDER], x_size), size_ratio(w.v[ORDER], v_size), size_ratio(w.i[ORDER], i_size))
    other = max(
        size_ratio(w.x[ORDER - 1], x_size), size_ratio(w.v[ORDER - 1], v_size), size_ratio(w.i[ORDER - 1], i_size)
    )
    last = max(last, other)
    if last <= _NEGLIGIBLE:
        return _LONGEST
    return min(_LONGEST, (TOLERANCE / last) ** (1.0 / ORDER)) if last < math.inf else 0.0


def size_ratio(a: float, b: float) -> float:
    """|a|/b, 0 for 0/0, infinite for what is not a number."""
    if a == 0.0:
        return 0.0
    part = abs(a) / b if b > 0.0 else math.inf
    return part if part >= 0.0 else math.inf


def rescale(w: StepSeries, factor: float) -> None:
    """The series over a step `factor` times as long."""
    x, v, i = w.x, w.v, w.i
    square, odd = factor * factor, factor
    for n in range(1, ORDER, 2):
        even = odd * factor
        x[n] *= odd
        v[n] *= odd
        i[n] *= odd
        x[n + 1] *= even
        v[n + 1] *= even
        i[n + 1] *= even
        odd *= square


def fitted_span(p: Constants, u: float, span: float, w: StepSeries) -> float:
    """The span over which the series hold to the tolerance; they are rescaled to it. 0 if there is none."""
    for _ in range(8):
        factor = radius(p, u, span, w)
        if factor <= 0.0:
            return 0.0
        rescale(w, factor)
        span *= factor
        if factor > 0.5:
            break
    return span


_TRANSIENT = 40.0  # time constants of the current, after which exp(-40) of it is left
_SLAVED = 0.005  # the current follows the motion if L/R is at most this part of the motion's own time


def motion_rate(p: Constants, s: ShotState) -> float:
    """How fast the motion itself changes, in 1/s: braking by the back-EMF, the force's fading along x, the spring."""
    current = abs(s.u) / p.resistance + abs(s.i)
    braking = p.back_emf * p.motor_constant / (p.mass * p.resistance)
    fading = math.sqrt(p.motor_constant * current / (p.coil_reach * p.mass)) + abs(s.v) / p.coil_reach
    return braking + fading + math.sqrt(p.stiffness / p.mass)


def is_slaved(p: Constants, s: ShotState) -> bool:
    """Whether the current has come to follow the motion."""
    if s.time < s.transient_until:
        return False
    return motion_rate(p, s) * p.inductance / p.resistance <= _SLAVED


def begin_coil(p: Constants, s: ShotState) -> None:
    """A first guess at the step, and when the current's transient will be over."""
    if p.inductance == 0.0:
        s.guess = 2.0 / motion_rate(p, s)
        return
    rate = p.resistance / p.inductance
    swing = math.sqrt(p.back_emf * p.motor_constant / (p.mass * p.inductance))
    current = abs(s.u) / p.resistance + abs(s.i)
    fading = math.sqrt(p.motor_constant * current / (p.coil_reach * p.mass))
    s.guess = 2.0 / (rate + swing + fading + math.sqrt(p.stiffness / p.mass))
    s.transient_until = s.time + _TRANSIENT / rate


def coil_step(p: Constants, s: ShotState, w: StepSeries) -> int:
    """One step; `s` moves on to its end, the series over it stay in `w`, and how much of them was used in `s`."""
    left, u = s.drive_until - s.time, s.u
    w.x[0], w.v[0], w.i[0] = s.x, s.v, s.i
    if p.inductance == 0.0:
        follow(p, u, s.heading, s.guess, w, True)
    elif is_slaved(p, s):
        expand_slaved(p, u, s.heading, s.guess, w)
    else:
        expand(p, u, s.heading, s.guess, w)
    span = fitted_span(p, u, s.guess, w)
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
    if s.heading > 0.0 and w.i[0] > 0.0 and w.i[0] + lower_bound(w.i, 1.0) <= 0.0:
        at = first_crossing(w.i, w.bernstein)
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
    begins = heading * w.v[shift]
    if begins + lower_bound(w.v, heading) - min(shift * begins, 0.0) > 0.0:
        return 2.0
    for n in range(ORDER + 1 - shift):
        w.other[n] = heading * w.v[n + shift]
    if shift == 1:
        w.other[ORDER] = 0.0
    return first_crossing(w.other, w.bernstein) if w.other[0] > 0.0 else 0.0


def first_arrival(p: Constants, w: StepSeries, heading: float) -> float:
    """Where the magnet first meets the coil's edge (outwards) or the stop (homewards), 2 if it does not."""
    ahead = (p.coil_reach if heading > 0.0 else 0.0) - w.x[0]
    if heading * ahead + lower_bound(w.x, -heading) > 0.0:
        return 2.0
    for n in range(1, ORDER + 1):
        w.other[n] = -heading * w.x[n]
    w.other[0] = heading * ahead
    return first_crossing(w.other, w.bernstein) if w.other[0] > 0.0 else 0.0


def land(p: Constants, s: ShotState, w: StepSeries, used: float, event: int) -> None:
    """The state at the end of a step; the quantity that defines the event is exact."""
    if event in (CONTINUES, DRIVE_CHANGE):
        s.x, s.v, s.i = value_at_end(w.x), value_at_end(w.v), value_at_end(w.i)
        return
    s.x, s.v, s.i = value_at(w.x, used), value_at(w.v, used), value_at(w.i, used)
    if event == TURN:
        s.v = 0.0
    elif event == COIL_EDGE:
        s.x = p.coil_reach
    elif event == STOP:
        s.x = 0.0
    elif event == FORCE_ZERO:
        s.i = 0.0
