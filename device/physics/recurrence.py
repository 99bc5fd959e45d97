"""The recurrence of the full model's series, written out term by term.

    (n + 1) x[n+1] = h v[n],  g[n+1] = -x[n+1]/x_c
    (n + 1) v[n+1] = h/m (k_m (g i)[n] - k x[n]  + at n = 0: friction - k x_0)
    (n + 1) i[n+1] = h/L (at n = 0: u  - R i[n] - k_e v[n])          or, reciprocal, k_e (g v)[n];  h: the step

The product (g i)[n] is a sum of n + 1 terms. As a loop in a loop its bookkeeping costs more than its arithmetic:
interpreted two thirds of the time, compiled a third. So the text of the function is made here, once, for `ORDER`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from device.physics.kernel import Floats, kernel
from device.physics.layout import BACK_EMF, GS, INDUCTANCE, IS, MASS, MOTOR, ORDER, REACH, RESISTANCE, STIFFNESS, VS, XS

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
