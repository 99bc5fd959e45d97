"""Taylor series of the magnet's motion inside a live coil, over one step: s = (t - t_start)/span, 0 to 1.

    m v' = k_m g i - k (x + x_0) -/+ F_f,  L i' = u - R i - k_e v (printed) or k_e g v (reciprocal),  g = 1 - x/x_c

Products of series are Cauchy products (Jorba & Zou, Experimental Mathematics 14 (2005) 99, section 2), and so is the
choice of the step from the last two coefficients (section 3).

    (n + 1) x[n+1] = h v[n],  g[n+1] = -x[n+1]/x_c
    (n + 1) v[n+1] = h/m (k_m (g i)[n] - k x[n]  + at n = 0: friction - k x_0)
    (n + 1) i[n+1] = h/L (at n = 0: u  - R i[n] - k_e v[n])          or, reciprocal, k_e (g v)[n];  h: the step

The product (g i)[n] is a sum of n + 1 terms. As a loop in a loop its bookkeeping costs more than its arithmetic:
interpreted two thirds of the time, compiled a third. So the text of the function is made here, once, for `ORDER`.

What follows another quantity at once (a slow manifold) does so in two ways, each in passes that take from the pass
before them the small terms, which hold derivatives: the current follows the motion, without the step depending on L;
or current and speed follow the position, without it depending on L and m.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from device.physics.equations import ORDER, Coefficients, Constants, ShotState, StepSeries, friction
from device.physics.polynomial import from_text

Expand = Callable[[Constants, float, float, float, StepSeries], None]


def written_out(name: str, *, reciprocal: bool) -> Expand:
    """A function of (constants, drive in V, push in N, span in s, series), the first coefficients in the series.

    The push is what friction and the spring's pre-load give at x = 0.
    """
    expand: Expand = from_text(name, "\n".join([_head(name), *(_step(n, reciprocal) for n in range(ORDER))]))
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
_PASSES = 16  # the n-th adds about n! (L/R or the like, over the motion's own time)^n
_SETTLED = 4e-16  # relative
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


def expand_slaved(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> bool:
    """The same where the current follows the motion, R i = u - emf - L i': w.i[0] follows from w.x[0] and w.v[0].

    A pass takes L i' from the pass before it: what is left of it falls by L/R over the motion's own time.
    """
    clear(w.i)
    for _ in range(_PASSES):  # noqa: SIM110 - the compiler knows no generators
        if follow(p, u, heading, span, w) <= _SETTLED:
            return True
    return False


def clear(c: list[float]) -> None:
    """No coefficients after the first."""
    for n in range(1, ORDER + 1):
        c[n] = 0.0


def follow(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> float:
    """One pass: x, v, g and the current; how much the current changed, relative to its size."""
    push, lag = friction(p, heading) - p.stiffness * p.preload, p.inductance / span
    w.work += 1
    change, size = 0.0, 1e-300
    w.grip[0] = (p.coil_reach - w.x[0]) / p.coil_reach
    for n in range(ORDER + 1):
        delay = lag * (n + 1) * w.i[n + 1] if n < ORDER else 0.0
        i = (u - delay - p.back_emf * seen_speed(p, w, n)) / p.resistance
        change, size = max(change, abs(i - w.i[n])), max(size, abs(i))
        w.i[n] = i
        if n < ORDER:
            w.x[n + 1] = span * w.v[n] * _PER[n + 1]
            w.grip[n + 1] = -w.x[n + 1] / p.coil_reach
            force = p.motor_constant * product(w.grip, w.i, n) - p.stiffness * w.x[n] + push
            w.v[n + 1] = force * span / p.mass * _PER[n + 1]
        push, u = 0.0, 0.0
    return change / size


def seen_speed(p: Constants, w: StepSeries, n: int) -> float:
    """The n-th coefficient of the speed that the back-EMF sees."""
    return product(w.grip, w.v, n) if p.reciprocal else w.v[n]


def expand_creeping(p: Constants, s: ShotState, span: float, w: StepSeries) -> float:
    """The same where speed and current both follow the position: k_m g i = k x - push + m v', emf = u - R i - L i'.

    w.v[0] and w.i[0] follow from w.x[0]. A pass takes m v' and L i' from the pass before it. Gives back the span over
    which the series hold, about the one asked for, or 0 if the passes do not settle.
    """
    clear(w.v)
    clear(w.i)
    creep(p, s.u, s.heading, span, w)
    span = fitted_span(p, s, span, w)
    for _ in range(_PASSES):
        if not 0.0 < span < math.inf:
            return 0.0
        if creep(p, s.u, s.heading, span, w) <= _SETTLED:
            return span
    return 0.0


def creep(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> float:
    """One pass: x, g, v and i; how much v and i changed, relative to their size."""
    push, lag, inertia = friction(p, heading) - p.stiffness * p.preload, p.inductance / span, p.mass / span
    i_size = p.stiffness * (p.preload + abs(w.x[0])) / p.motor_constant  # what may cancel in a force
    v_size = p.resistance * i_size / p.back_emf
    v_change, i_change = 0.0, 0.0
    w.work += 1
    w.grip[0] = (p.coil_reach - w.x[0]) / p.coil_reach
    for n in range(ORDER + 1):
        v, i, later = w.v[n], w.i[n], n + 1 if n < ORDER else 0
        delay = lag * later * w.i[later]
        w.v[n], w.i[n] = 0.0, 0.0
        held = p.stiffness * w.x[n] - push + inertia * later * w.v[later]
        w.i[n] = (held / p.motor_constant - product(w.grip, w.i, n)) / w.grip[0]
        seen = (u - delay - p.resistance * w.i[n]) / p.back_emf
        w.v[n] = (seen - product(w.grip, w.v, n)) / w.grip[0] if p.reciprocal else seen
        v_change, v_size = max(v_change, abs(w.v[n] - v)), max(v_size, abs(w.v[n]))
        i_change, i_size = max(i_change, abs(w.i[n] - i)), max(i_size, abs(w.i[n]))
        if n < ORDER:
            w.x[n + 1] = span * w.v[n] * _PER[n + 1]
            w.grip[n + 1] = -w.x[n + 1] / p.coil_reach
        push, u = 0.0, 0.0
    return max(v_change / (v_size + 1e-300), i_change / (i_size + 1e-300))


def leading(c: Coefficients, floor: float) -> float:
    """The size of a series over a step of its scale, at least `floor`."""
    return max(abs(c[0]), abs(c[1]), abs(c[2]), abs(c[3]), floor)


def radius(p: Constants, s: ShotState, span: float, w: StepSeries) -> float:
    """How far the three series reach, in steps: where the last two coefficients come down to the tolerance.

    The floors keep what cancels in a force or a voltage from being asked to more digits than it has.
    """
    held = p.stiffness * (p.preload + abs(w.x[0])) + p.friction_out + p.motor_constant * abs(w.i[0])
    v_size = leading(w.v, 0.0 if s.creeping else 1e-6 * held / p.mass * span)
    x_size = leading(w.x, v_size * span)
    i_size = leading(w.i, 1e-2 * (abs(s.u) + p.back_emf * abs(w.v[0])) / p.resistance)
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


def fitted_span(p: Constants, s: ShotState, span: float, w: StepSeries) -> float:
    """The span over which the series hold to the tolerance; they are rescaled to it. 0 if there is none."""
    for _ in range(8):
        factor = radius(p, s, span, w)
        if factor <= 0.0:
            return 0.0
        rescale(w, factor)
        span *= factor
        if factor > 0.5:
            break
    return span
