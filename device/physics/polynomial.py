"""Roots of the series over one step, s from 0 to 1: none is missed.

In the Bernstein basis a polynomial has at most as many roots in an interval as its coefficients change sign, so no
change means no root and one change exactly one (Descartes' rule of signs; Farouki, CAGD 29 (2012) 379, section 3.5).
Where there are more, the interval is halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from device.physics.equations import ORDER, Coefficients, StepSeries

_SMALLEST = 2.0**-46  # of the step: two roots closer than this are one touch, which ends nothing


def value_at(c: Coefficients, s: float) -> float:
    """The polynomial of even order at s: Horner's scheme in s^2 for the even and the odd powers side by side."""
    q, even, odd = s * s, c[ORDER], c[ORDER - 1]
    for j in range(ORDER - 2, 0, -2):
        even = even * q + c[j]
        odd = odd * q + c[j - 1]
    return (even * q + odd * s) + c[0]


def lower_bound(c: Coefficients, sign: float) -> float:
    """A bound from below for what the polynomial, times `sign`, adds to its first coefficient on [0, 1]."""
    even, odd = 0.0, 0.0
    for j in range(1, ORDER, 2):
        one, other = sign * c[j], sign * c[j + 1]
        if not one >= 0.0:  # a number below 0, or none
            even += one
        if not other >= 0.0:
            odd += other
    return even + odd


def _to_bernstein() -> list[str]:
    """b_j = sum over k <= j of C(j, k)/C(n, k) c_k."""
    return ["c = w.other", *(f"c{k} = c[{k}]" for k in range(ORDER + 1)), *_summed()]


def _to_bernstein_over() -> list[str]:
    """The same of the polynomial in (s - low)/width: shifted by Horner's scheme, then scaled."""
    shifted = [f"c{k} += low * c{k + 1}" for first in range(ORDER) for k in range(ORDER - 1, first - 1, -1)]
    scaled = [line for k in range(1, ORDER + 1) for line in (f"c{k} *= power", "power *= width")]
    return ["c, power = w.other, width", *(f"c{k} = c[{k}]" for k in range(ORDER + 1)), *shifted, *scaled, *_summed()]


def _summed() -> list[str]:
    scaled = [f"b{k} = c{k} * {1.0 / math.comb(ORDER, k)!r}" for k in range(ORDER + 1)]
    summed = [f"b{j} += b{j - 1}" for low in range(1, ORDER + 1) for j in range(ORDER, low - 1, -1)]
    return ["b = w.bernstein", *scaled, *summed]


def _halve() -> list[str]:
    """De Casteljau's scheme at the middle."""
    lines = ["b, beyond = w.bernstein, w.beyond", *(f"b{j} = b[{j}]" for j in range(ORDER + 1))]
    for r in range(1, ORDER + 1):
        lines.append(f"beyond[{ORDER + 1 - r}] = b{ORDER}")
        lines += [f"b{j} = 0.5 * (b{j - 1} + b{j})" for j in range(ORDER, r - 1, -1)]
    return [*lines, f"beyond[0] = b{ORDER}"]


def from_text(name: str, text: str) -> Any:
    """A function from its text, written out: in loops, bookkeeping takes most of the time."""
    space: dict[str, Any] = {}
    exec(text, space)  # noqa: S102 - our own text
    return space[name]


def _of_series(name: str, arguments: str, lines: list[str]) -> Any:
    """A function of the series that leaves b in their `bernstein`."""
    stored = (f"b[{j}] = b{j}" for j in range(ORDER + 1))
    return from_text(name, "\n    ".join([f"def {name}({arguments}):", *lines, *stored]))


to_bernstein: Callable[[StepSeries], None] = _of_series("to_bernstein", "w", _to_bernstein())
"""The Bernstein coefficients over [0, 1] of the polynomial in `other`."""
to_bernstein_over: Callable[[StepSeries, float, float], None] = _of_series(
    "to_bernstein_over", "w, low, width", _to_bernstein_over()
)
"""The same over [low, low + width]."""
halve: Callable[[StepSeries], None] = _of_series("halve", "w", _halve())
"""Those over the first half of their interval in place of those over all of it; the second half's go `beyond`."""


def _value_at_end() -> Callable[[Coefficients], float]:
    """The small coefficients first."""
    even, odd = (" + ".join(f"c[{j}]" for j in range(last, 0, -2)) for last in (ORDER, ORDER - 1))
    function: Callable[[Coefficients], float] = from_text(
        "value_at_end", f"def value_at_end(c):\n    return {even} + ({odd}) + c[0]"
    )
    return function


value_at_end = _value_at_end()
"""The polynomial of even order at s = 1."""


def bernstein_over(w: StepSeries, low: float, high: float) -> None:
    """The Bernstein coefficients over [low, high] of the polynomial in `other`."""
    w.work += 1
    if low > 0.0 or high < 1.0:
        to_bernstein_over(w, low, high - low)
    else:
        to_bernstein(w)


def sign_changes(b: Coefficients) -> int:
    """How often the coefficients change sign, zeros left out; 2 if more often."""
    changes, last = 0, 0.0
    for j in range(ORDER + 1):
        if b[j] * last < 0.0:
            if changes == 1:
                return 2
            changes, last = 1, -last
        elif last == 0.0 and b[j] != 0.0:
            last = math.copysign(1.0, b[j])
    return changes


def bracketed_root(w: StepSeries, low: float, high: float) -> float:
    """The one root between `low` and `high` of the polynomial in `other`: Newton's method, kept inside by halving.

    The polygon of the Bernstein coefficients over the bracket crosses 0 near the root.
    """
    c, b = w.other, w.bernstein
    sign = 1.0 if b[0] > 0.0 or (b[0] == 0.0 and b[ORDER] < 0.0) else -1.0
    s = low + (high - low) * polygon_root(b)
    for _ in range(80):
        q, even, odd, even_slope, odd_slope = s * s, c[ORDER], c[ORDER - 1], 0.0, 0.0
        for j in range(ORDER - 2, 0, -2):
            even_slope = even_slope * q + even
            odd_slope = odd_slope * q + odd
            even = even * q + c[j]
            odd = odd * q + c[j - 1]
        even_slope = even_slope * q + even
        y = (even * q + odd * s) + c[0]
        slope = odd + 2.0 * (s * even_slope + q * odd_slope)
        if y == 0.0:
            return s
        if y * sign > 0.0:
            low = s
        else:
            high = s
        step = y / slope if slope != 0.0 else math.inf
        nearer = s - step
        if not low < nearer < high:
            nearer = 0.5 * (low + high)
        if abs(nearer - s) <= 2.3e-16 * s or nearer in (low, high):
            return nearer
        s = nearer
    return s


def polygon_root(b: Coefficients) -> float:
    """Where the control polygon first changes sign, between 0 and 1."""
    for j in range(ORDER):
        if (b[j] > 0.0) != (b[j + 1] > 0.0) and b[j] != b[j + 1]:
            return (j + b[j] / (b[j] - b[j + 1])) / ORDER
    return 0.5


def first_crossing(w: StepSeries) -> float:
    """The first s in (0, 1] where the polynomial in `other`, above 0 just after s = 0, falls below it; 2 if none."""
    low, width, halved = 0.0, 1.0, False
    bernstein_over(w, low, width)
    while low < 1.0:
        changes, high = sign_changes(w.bernstein), min(low + width, 1.0)
        if changes == 1 or (changes > 1 and width <= _SMALLEST and w.bernstein[ORDER] < 0.0):
            return bracketed_root(w, low, high)
        if changes > 1 and width > _SMALLEST:
            w.work += 1
            halve(w)
            width, halved = 0.5 * width, True
        else:
            width = next_piece(w, high, 1.0, width, halved)
            low, halved = high, False
    return 2.0


def next_piece(w: StepSeries, low: float, end: float, width: float, halved: bool) -> float:
    """The Bernstein coefficients over the piece that begins at `low`, and its width, which may go past the `end`.

    It is as wide as the one before it if that was halved just now, whose other half lies ready, else twice as wide.
    """
    if halved:
        for j in range(ORDER + 1):
            w.bernstein[j] = w.beyond[j]
        return width
    if low < end:
        bernstein_over(w, low, min(low + 2.0 * width, end))
    return 2.0 * width
