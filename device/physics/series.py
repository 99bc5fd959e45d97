"""Taylor series of the magnet's motion inside a live coil, over one step: s = (t - t_start)/span, 0 to 1.

    m v' = k_m g i - k (x + x_0) -/+ F_f,  L i' = u - R i - k_e v (printed) or k_e g v (reciprocal),  g = 1 - x/x_c

Products of series are Cauchy products (Jorba & Zou, Experimental Mathematics 14 (2005) 99, section 2), and so is the
choice of the step from the last two coefficients (section 3).

    (n + 1) x[n+1] = h v[n],  g[n+1] = -x[n+1]/x_c
    (n + 1) v[n+1] = h/m (k_m (g i)[n] - k x[n]  + at n = 0: friction - k x_0)
    (n + 1) i[n+1] = h/L (at n = 0: u  - R i[n] - k_e v[n])          or, reciprocal, k_e (g v)[n];  h: the step

There (g v)[n] = g[0] v[n] + (n + 1)/(2 h) (the sum of x[j] g[n + 1 - j], 0 < j <= n), as v is the derivative of x. In
that sum x[a] g[b] = x[b] g[a], so it takes half the terms of a product.

The product (g i)[n] is a sum of n + 1 terms. As a loop in a loop its bookkeeping costs more than its arithmetic:
interpreted two thirds of the time, compiled a third. So the text of the function is made here, once, for `ORDER`.

What follows another quantity at once (a slow manifold) does so in two ways, each in passes that take from the pass
before them the small terms, which hold derivatives: the current follows the motion, without the step depending on L;
or current and speed follow the position, without it depending on L and m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from device.physics.equations import ORDER, Coefficients, Constants, ShotState, StepSeries, friction
from device.physics.polynomial import from_text

Expand = Callable[[Constants, float, float, float, StepSeries], None]
Pass = Callable[[Constants, float, float, float, StepSeries], float]
"""Functions of (constants, drive in V, push in N, span in s, series), the first coefficients in the series. The push
is what friction and the spring's pre-load give at x = 0. A pass gives back how much changed, relative to its size."""


def _of_gun(name: str, lines: Callable[[], Iterable[str]]) -> Any:
    """A function with these lines, behind what all have in common."""
    head = [
        "per_reach, per_mass = 1.0 / p.coil_reach, h / p.mass",
        "k, motor, emf, R = p.stiffness, p.motor_constant, p.back_emf, p.resistance",
        "x, v, i, x0 = w.x, w.v, w.i, w.x[0]",
        "g0 = (p.coil_reach - x0) * per_reach",
    ]
    return from_text(name, "p, u, push, h, w", lambda: [*head, *lines()])


def _expansion(*, reciprocal: bool) -> list[str]:
    """The series from their first coefficients."""
    lines = ["per_inductance, v0, i0 = h / p.inductance, v[0], i[0]"]
    lines += ["held, moved = emf * g0, 0.5 * emf / h"] if reciprocal else []
    for n in range(ORDER):
        seen = f"- held * v{n}{_moved(n)}" if reciprocal else f"- emf * v{n}"
        current = f"({_first(n, 'u ')}- R * i{n} {seen}) * per_inductance * {1.0 / (n + 1)!r}"
        lines += [*_position(n), _speed(n), f"i{n + 1} = i[{n + 1}] = {current}"]
    return lines


def _pass_of_current() -> list[str]:
    """One pass of the series whose current follows the motion."""
    lines = ["lag, v0, reciprocal = p.inductance / h, v[0], p.reciprocal"]
    for n in range(ORDER + 1):
        seen = f"(({_product('g', 'v', n)}) if reciprocal else v{n})"
        lines.append(f"i{n} = ({_first(n, 'u ')}{_later('- lag', 'i', n)} - emf * {seen}) / R")
        lines += [_changed("i", n), *([*_position(n), _speed(n)] if n < ORDER else [])]
    return [*lines, f"return {_largest('di')} / ({_largest('i')} + 1e-300)"]


def _pass_of_both() -> list[str]:
    """One pass of the series whose current and speed follow the position."""
    lines = ["lag, inertia, reciprocal = p.inductance / h, p.mass / h, p.reciprocal"]
    for n in range(ORDER + 1):
        force = f"k * x{n}{_first(n, ' - push')}{_later(' + inertia', 'v', n)}"
        lines.append(f"i{n} = (({force}) / motor - ({_product_before('i', n)})) / g0")
        lines.append(f"v{n} = ({_first(n, 'u ')}{_later('- lag', 'i', n)} - R * i{n}) / emf")
        lines.append(f"if reciprocal: v{n} = (v{n} - ({_product_before('v', n)})) / g0")
        lines += [_changed("i", n), _changed("v", n), *(_position(n) if n < ORDER else [])]
    return [
        *lines,
        "least = k * (p.preload + abs(x0)) / motor",  # what may cancel in a force
        f"i_change = {_largest('di')} / (max(least, {_largest('i')}) + 1e-300)",
        f"v_change = {_largest('dv')} / (max(R * least / emf, {_largest('v')}) + 1e-300)",
        "return max(i_change, v_change)",
    ]


def _position(n: int) -> list[str]:
    """The coefficients n + 1 of the position and of the coil's hold."""
    return [f"x{n + 1} = x[{n + 1}] = h * v{n} * {1.0 / (n + 1)!r}", f"g{n + 1} = -x{n + 1} * per_reach"]


def _speed(n: int) -> str:
    """The coefficient n + 1 of the speed, from the forces."""
    force = f"motor * ({_product('g', 'i', n)}) - k * x{n}{_first(n, ' + push')}"
    return f"v{n + 1} = v[{n + 1}] = ({force}) * per_mass * {1.0 / (n + 1)!r}"


def _first(n: int, what: str) -> str:
    """What is constant over the step."""
    return what if n == 0 else ""


def _later(what: str, c: str, n: int) -> str:
    """The n-th coefficient of a derivative, of the pass before this one."""
    return f"{what} * {n + 1}.0 * {c}[{n + 1}]" if n < ORDER else ""


def _changed(c: str, n: int) -> str:
    return f"d{c}{n}, {c}[{n}] = {c}{n} - {c}[{n}], {c}{n}"


def _largest(c: str) -> str:
    return f"max({', '.join(f'abs({c}{n})' for n in range(ORDER + 1))})"


def _product(a: str, b: str, n: int) -> str:
    """The n-th coefficient of a product: terms in pairs, first those that were known first."""
    half = (n + 1) // 2
    middle = [f"{a}{half} * {b}{half}"] if n % 2 == 0 else []
    pairs = [f"({a}{n - j} * {b}{j} + {a}{j} * {b}{n - j})" for j in range(half - 1, -1, -1)]
    return " + ".join([*middle, *pairs])


def _moved(n: int) -> str:
    """What the back-EMF's n-th coefficient loses as the hold changes over the step."""
    half = (n + 2) // 2
    twice = " + ".join(f"x{n + 1 - j} * g{j}" for j in range(half - 1, 0, -1))
    sums = [f"x{half} * g{half}"] if n % 2 == 1 else []
    sums += [f"2.0 * ({twice})"] if twice else []
    return f" - moved * {n + 1}.0 * ({' + '.join(sums)})" if sums else ""


def _product_before(b: str, n: int) -> str:
    """The same of the coil's hold and a series whose own n-th coefficient is still to come."""
    return " + ".join(f"g{n - j} * {b}{j}" for j in range(n)) or "0.0"


expand_printed: Expand = _of_gun("expand_printed", lambda: _expansion(reciprocal=False))
expand_reciprocal: Expand = _of_gun("expand_reciprocal", lambda: _expansion(reciprocal=True))
pass_of_current: Pass = _of_gun("pass_of_current", _pass_of_current)
pass_of_both: Pass = _of_gun("pass_of_both", _pass_of_both)

TOLERANCE = 2e-12
"""Of the first coefficient left out, relative to the largest of the leading ones."""
LONGEST_STEP = 3.0  # how far past its scale a series may reach
NEAR_ENOUGH = 0.02  # a span this near is as good: it multiplies what is left out by at most 1.02^24
NEGLIGIBLE = 1e-30  # a last coefficient as small as this ends no step
_PASSES = 16  # the n-th adds about n! (L/R or the like, over the motion's own time)^n
_SETTLED = 4e-16  # relative


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
    """One pass: x, v and the current; how much the current changed, relative to its size."""
    w.work += 1
    return pass_of_current(p, u, friction(p, heading) - p.stiffness * p.preload, span, w)


def expand_creeping(p: Constants, s: ShotState, span: float, w: StepSeries) -> float:
    """The same where speed and current both follow the position: k_m g i = k x - push + m v', emf = u - R i - L i'.

    w.v[0] and w.i[0] follow from w.x[0]. A pass takes m v' and L i' from the pass before it. Gives back the span over
    which the series hold, about the one asked for, or 0 if the passes do not settle.
    """
    clear(w.v)
    clear(w.i)
    creep(p, s.u, s.heading, span, w)
    span = fitted_span(p, s, span, w)
    before = math.inf
    for left in range(_PASSES - 1, -1, -1):
        if not 0.0 < span < math.inf:
            return 0.0
        change = creep(p, s.u, s.heading, span, w)
        if change <= _SETTLED:
            return span
        if change * min(change / before, 1.0) ** left > _SETTLED:
            return 0.0  # each pass gains less than the one before it, so those that are left will not do
        before = change
    return 0.0


def creep(p: Constants, u: float, heading: float, span: float, w: StepSeries) -> float:
    """One pass: x, v and i; how much v and i changed, relative to their size."""
    w.work += 1
    return pass_of_both(p, u, friction(p, heading) - p.stiffness * p.preload, span, w)


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
    last = max(size_ratio(last_of(w.x), x_size), size_ratio(last_of(w.v), v_size), size_ratio(last_of(w.i), i_size))
    if last <= NEGLIGIBLE:
        return LONGEST_STEP
    return min(LONGEST_STEP, twenty_fourth_root(TOLERANCE / last)) if last < math.inf else 0.0


def twenty_fourth_root(y: float) -> float:
    """y**(1/24), right to 1.1 % where it is between 0.4 and 3; less is at least 0.2, more at most 5.

    Three square roots, then one step of Halley's method for the third root: what processors do in all lanes at once.
    """
    eighth = math.sqrt(math.sqrt(math.sqrt(y)))
    third = (0.4 + eighth) / (1.0 + 0.4 * eighth)
    cube = third * third * third
    return third * (cube + 2.0 * eighth) / (2.0 * cube + eighth)


def last_of(c: Coefficients) -> float:
    """The size of the last two coefficients."""
    last, other = abs(c[ORDER]), abs(c[ORDER - 1])
    return max(last, other)


def size_ratio(a: float, b: float) -> float:
    """|a|/b, 0 for 0/0, infinite for what is not a number."""
    if a == 0.0:
        return 0.0
    part = abs(a) / b if b > 0.0 else math.inf
    return part if part >= 0.0 else math.inf


def _rescale() -> Iterator[str]:
    yield "x, v, i, f1, square = w.x, w.v, w.i, factor, factor * factor"
    for n in range(1, ORDER + 1):
        if n > 1:
            yield f"f{n} = f{n - 1} * factor" if n % 2 == 0 else f"f{n} = f{n - 2} * square"
        yield from (f"{c}[{n}] *= f{n}" for c in "xvi")


rescale: Callable[[StepSeries, float], None] = from_text("rescale", "w, factor", _rescale)
"""The series over a step `factor` times as long."""


def fitted_span(p: Constants, s: ShotState, span: float, w: StepSeries) -> float:
    """The span over which the series hold to the tolerance; they are rescaled to it. 0 if there is none."""
    for _ in range(40):
        factor = radius(p, s, span, w)
        if factor <= 0.0:
            return 0.0
        if abs(factor - 1.0) <= NEAR_ENOUGH:
            break
        rescale(w, factor)
        span *= factor
        if factor > 0.5:
            break
    return span
