"""The motion inside the coil as Taylor series over one step, in s = (t - t_start)/span.

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

from device.physics.kernel import (
    BACK_EMF,
    FRICTION_BACK,
    FRICTION_OUT,
    GS,
    INDUCTANCE,
    IS,
    MASS,
    MOTOR,
    ORDER,
    PRELOAD,
    REACH,
    RECIPROCAL,
    RESISTANCE,
    STIFFNESS,
    VS,
    XS,
    Floats,
    kernel,
)

Expand = Callable[[Floats, float, float, float, Floats], None]


def written_out(name: str, *, reciprocal: bool) -> Expand:
    """A kernel function of (parameters, drive in V, push in N, step in s, work), the first coefficients in `work`.

    The push is what friction and the spring's pre-load give at x = 0.
    """
    space: dict[str, Any] = {}
    exec("\n".join([_head(name), *(_step(n, reciprocal) for n in range(ORDER))]), space)  # noqa: S102 - our own text
    expand: Expand = space[name]
    return kernel(expand)


def _head(name: str) -> str:
    return f"""
def {name}(p, u, push, h, w):
    per_reach, per_mass, per_inductance = 1.0 / p[{REACH}], h / p[{MASS}], h / p[{INDUCTANCE}]
    k, motor, emf, R = p[{STIFFNESS}], p[{MOTOR}], p[{BACK_EMF}], p[{RESISTANCE}]
    x0, v0, i0 = w[{XS}], w[{VS}], w[{IS}]
    g0 = (p[{REACH}] - x0) * per_reach
    w[{GS}] = g0"""


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
    w[{XS + after}], w[{VS + after}], w[{IS + after}], w[{GS + after}] = x{after}, v{after}, i{after}, g{after}"""


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


@kernel
def friction(p: Floats, heading: float) -> float:
    """The friction's push, signed: against the way the magnet goes."""
    return -p[FRICTION_OUT] if heading > 0.0 else p[FRICTION_BACK]


@kernel
def product(w: Floats, a: int, b: int, n: int) -> float:
    """The n-th coefficient of a product of series: two terms at a time, first those that were known first."""
    half = (n + 1) // 2
    total = w[a + half] * w[b + half] if n % 2 == 0 else 0.0
    for j in range(half - 1, -1, -1):
        total += w[a + n - j] * w[b + j] + w[a + j] * w[b + n - j]
    return total


@kernel
def expand(p: Floats, u: float, heading: float, span: float, w: Floats) -> None:
    """The series of x, v, i and g from their first coefficients, w[XS], w[VS] and w[IS]."""
    push = friction(p, heading) - p[STIFFNESS] * p[PRELOAD]
    if p[RECIPROCAL] != 0.0:
        expand_reciprocal(p, u, push, span, w)
    else:
        expand_printed(p, u, push, span, w)


@kernel
def expand_slaved(p: Floats, u: float, heading: float, span: float, w: Floats) -> None:
    """The same on the slow manifold, R i = u - emf - L i': w[IS] follows from w[XS] and w[VS].

    The sum of all derivatives of the emf that this stands for is one pass from the last coefficient down; a few
    passes settle what the current does to the motion.
    """
    follow(p, u, heading, span, w, True)
    for _ in range(_SWEEPS):
        change = slave(p, u, span, w)
        follow(p, u, heading, span, w, False)
        if change <= 1e-16:
            break


@kernel
def follow(p: Floats, u: float, heading: float, span: float, w: Floats, algebraic: bool) -> None:
    """x, v and g from the series of the current; if `algebraic`, from the current that L = 0 would give."""
    push = friction(p, heading) - p[STIFFNESS] * p[PRELOAD]
    w[GS] = (p[REACH] - w[XS]) / p[REACH]
    for n in range(ORDER):
        if algebraic:
            w[IS + n] = (u - p[BACK_EMF] * seen_speed(p, w, n)) / p[RESISTANCE]
        w[XS + n + 1] = span * w[VS + n] * _PER[n + 1]
        w[GS + n + 1] = -w[XS + n + 1] / p[REACH]
        force = p[MOTOR] * product(w, GS, IS, n) - p[STIFFNESS] * w[XS + n] + push
        w[VS + n + 1] = force * span / p[MASS] * _PER[n + 1]
        push, u = 0.0, 0.0
    if algebraic:
        w[IS + ORDER] = -p[BACK_EMF] * seen_speed(p, w, ORDER) / p[RESISTANCE]


@kernel
def seen_speed(p: Floats, w: Floats, n: int) -> float:
    """The n-th coefficient of the speed that the back-EMF sees."""
    return product(w, GS, VS, n) if p[RECIPROCAL] != 0.0 else w[VS + n]


@kernel
def slave(p: Floats, u: float, span: float, w: Floats) -> float:
    """The current that R i = u - emf - L i' gives for this motion; how much it changed, relative to its size."""
    lag = p[INDUCTANCE] / p[RESISTANCE] / span
    above, change, size = 0.0, 0.0, 1e-300
    for n in range(ORDER, -1, -1):
        drive = u if n == 0 else 0.0
        above = (drive - p[BACK_EMF] * seen_speed(p, w, n)) / p[RESISTANCE] - lag * (n + 1) * above
        change = max(change, abs(above - w[IS + n]))
        size = max(size, abs(above))
        w[IS + n] = above
    return change / size


@kernel
def leading(w: Floats, c: int, floor: float) -> float:
    """The size of a series over a step of its scale, at least `floor`."""
    return max(abs(w[c]), abs(w[c + 1]), abs(w[c + 2]), abs(w[c + 3]), floor)


@kernel
def radius(p: Floats, u: float, span: float, w: Floats) -> float:
    """How far the three series reach, in steps: where the last two coefficients come down to the tolerance.

    The floors keep what cancels in a force or a voltage from being asked to more digits than it has.
    """
    held = p[STIFFNESS] * (p[PRELOAD] + abs(w[XS])) + p[FRICTION_OUT] + p[MOTOR] * abs(w[IS])
    v_size = leading(w, VS, 1e-6 * held / p[MASS] * span)
    x_size = leading(w, XS, v_size * span)
    i_size = leading(w, IS, 1e-2 * (abs(u) + p[BACK_EMF] * abs(w[VS])) / p[RESISTANCE])
    last = max(ratio(w[XS + ORDER], x_size), ratio(w[VS + ORDER], v_size), ratio(w[IS + ORDER], i_size))
    other = max(ratio(w[XS + ORDER - 1], x_size), ratio(w[VS + ORDER - 1], v_size), ratio(w[IS + ORDER - 1], i_size))
    last = max(last, other)
    if last <= _NEGLIGIBLE:
        return _LONGEST
    return min(_LONGEST, (TOLERANCE / last) ** (1.0 / ORDER)) if last < math.inf else 0.0


@kernel
def ratio(a: float, b: float) -> float:
    """|a|/b, 0 for 0/0, infinite for what is not a number."""
    if a == 0.0:
        return 0.0
    part = abs(a) / b if b > 0.0 else math.inf
    return part if part >= 0.0 else math.inf


@kernel
def rescale(w: Floats, factor: float) -> None:
    """The series over a step `factor` times as long."""
    square, odd = factor * factor, factor
    for n in range(1, ORDER, 2):
        even = odd * factor
        w[XS + n] *= odd
        w[VS + n] *= odd
        w[IS + n] *= odd
        w[XS + n + 1] *= even
        w[VS + n + 1] *= even
        w[IS + n + 1] *= even
        odd *= square


@kernel
def fit(p: Floats, u: float, span: float, w: Floats) -> float:
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
