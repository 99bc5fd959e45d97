"""Roots of the series over one step, s from 0 to 1: none is missed.

Most polynomials fall all the way, as sums of their coefficients show: there is one root if the end is not above 0. Of
others the Bernstein basis tells: in it a polynomial has at most as many roots in an interval as its coefficients change
sign, so no change means no root and one change exactly one (Descartes' rule of signs; Farouki, CAGD 29 (2012) 379,
section 3.5). Where there are more, the interval is halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from types import FunctionType
from typing import Any

from device.physics.equations import ORDER, Coefficients, StepSeries

NO_DIGIT = 1e-17  # relative
NEAR_ROOT = 1e-7  # relative: steps that are larger are not trusted to say how far it is still
_SMALLEST = 2.0**-46  # of the step: two roots closer than this are one touch, which ends nothing


def value_at(c: Coefficients, s: float) -> float:
    """The polynomial of even order at s: Horner's scheme in s^2 for the even and the odd powers side by side."""
    q, even, odd = s * s, c[ORDER], c[ORDER - 1]
    for j in range(ORDER - 2, 0, -2):
        even = even * q + c[j]
        odd = odd * q + c[j - 1]
    return (even * q + odd * s) + c[0]


def _to_bernstein() -> list[str]:
    """b_j = sum over k <= j of C(j, k)/C(n, k) c_k."""
    return ["c = w.other", *(f"c{k} = c[{k}]" for k in range(ORDER + 1)), *_summed()]


def _to_bernstein_over(*, shifted: bool) -> list[str]:
    """The same of the polynomial in (s - low)/width: shifted by Horner's scheme, then scaled."""
    places = [k for first in range(ORDER) for k in range(ORDER - 1, first - 1, -1)] if shifted else []
    shifts = [f"c{k} += low * c{k + 1}" for k in places]
    scaled = [line for k in range(1, ORDER + 1) for line in (f"c{k} *= power", "power *= width")]
    return ["c, power = w.other, width", *(f"c{k} = c[{k}]" for k in range(ORDER + 1)), *shifts, *scaled, *_summed()]


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


def from_text(name: str, arguments: str, lines: Callable[[], Iterable[str]]) -> Any:
    """A function that is written out: in loops, bookkeeping takes most of the time.

    Its text is made and compiled as it is called first, and replaces the two lines that do so: all of them together
    take longer than a command that fires three shots otherwise does, and it calls few.
    """
    space: dict[str, Any] = {}

    def write() -> None:
        if function.__code__ is unwritten:
            written: dict[str, Any] = {}
            exec("\n    ".join([f"def {name}({arguments}):", *lines()]), written)  # noqa: S102 - our own text
            function.__code__ = written[name].__code__

    space["write"] = write
    exec(f"def {name}({arguments}):\n    write()\n    return {name}({arguments})", space)  # noqa: S102 - the same
    function = space[name]
    function.write, unwritten = write, function.__code__
    return function


def write_out(function: FunctionType) -> None:
    """Have the text of a function in place that is compiled further, and not called: where it has one."""
    getattr(function, "write", lambda: None)()


def _of_series(name: str, arguments: str, lines: Callable[[], list[str]]) -> Any:
    """A function of the series that leaves b in their `bernstein`."""
    return from_text(name, arguments, lambda: [*lines(), *(f"b[{j}] = b{j}" for j in range(ORDER + 1))])


to_bernstein: Callable[[StepSeries], None] = _of_series("to_bernstein", "w", _to_bernstein)
"""The Bernstein coefficients over [0, 1] of the polynomial in `other`."""
to_bernstein_over: Callable[[StepSeries, float, float], None] = _of_series(
    "to_bernstein_over", "w, low, width", lambda: _to_bernstein_over(shifted=True)
)
"""The same over [low, low + width]."""
to_bernstein_up_to: Callable[[StepSeries, float], None] = _of_series(
    "to_bernstein_up_to", "w, width", lambda: _to_bernstein_over(shifted=False)
)
"""The same over [0, width]."""
halve: Callable[[StepSeries], None] = _of_series("halve", "w", _halve)
"""Those over the first half of their interval in place of those over all of it; the second half's go `beyond`."""


def value_and_slope(c: Coefficients, s: float) -> tuple[float, float]:
    """The polynomial and its derivative at s, by the same scheme."""
    q, even_slope, odd_slope = s * s, c[ORDER], c[ORDER - 1]
    even, odd = even_slope * q + c[ORDER - 2], odd_slope * q + c[ORDER - 3]
    for j in range(ORDER - 4, 0, -2):
        even_slope = even_slope * q + even
        odd_slope = odd_slope * q + odd
        even = even * q + c[j]
        odd = odd * q + c[j - 1]
    even_slope = even_slope * q + even
    return (even * q + odd * s) + c[0], odd + 2.0 * (s * even_slope + q * odd_slope)


def _least_sum(first: int) -> Iterator[str]:
    yield from (f"s{n} = {f's{n - 1} + ' if n > first else ''}sign * c[{n}]" for n in range(first, ORDER + 1))
    yield f"return min({', '.join(f's{n}' for n in range(first, ORDER + 1))})"


least_sum: Callable[[Coefficients, float], float] = from_text("least_sum", "c, sign", lambda: _least_sum(0))
"""The least of the sums of the coefficients from the first to any of them, times `sign`.

The polynomial, times `sign`, is nowhere in [0, 1] below it: summed by parts (Abel), it is a mean of these sums, whose
weights are differences of powers of s.
"""
least_sum_past_first: Callable[[Coefficients, float], float] = from_text(
    "least_sum_past_first", "c, sign", lambda: _least_sum(1)
)
"""The same without the first coefficient, for the rest of the polynomial divided by s."""


def _falls() -> Iterator[str]:
    """Sums of -p', sums of those, and sums of those; of each but the last sort the last one alone matters."""
    yield from (f"s{n} = {f's{n - 1} - ' if n > 1 else '-'}{n}.0 * c[{n}]" for n in range(1, ORDER + 1))
    yield from (f"t{n} = {f't{n - 1} + ' if n > 1 else ''}s{n}" for n in range(1, ORDER))
    yield from (f"u{n} = {f'u{n - 1} + ' if n > 1 else ''}t{n}" for n in range(1, ORDER - 1))
    yield f"return min({', '.join([f's{ORDER}', f't{ORDER - 1}', *(f'u{n}' for n in range(1, ORDER - 1))])})"


falls: Callable[[Coefficients], float] = from_text("falls", "c", _falls)
"""Above 0 only where the polynomial falls all the way from 0 to 1; not where it may rise, or one is NaN.

As for `least_sum`, but summed by parts three times: -p' is then (1 - s)^3 times the sum of u_n s^(n - 1), and three
terms at its end, of the last u, t and s, so that it is above 0 where all of these are.
"""


def _value_at_end() -> Iterator[str]:
    """The small coefficients first."""
    even, odd = (" + ".join(f"c[{j}]" for j in range(last, 0, -2)) for last in (ORDER, ORDER - 1))
    yield f"return {even} + ({odd}) + c[0]"


value_at_end: Callable[[Coefficients], float] = from_text("value_at_end", "c", _value_at_end)
"""The polynomial of even order at s = 1."""


def _look_for() -> Iterator[str]:
    yield "other = w.other"
    yield from (f"other[{n}] = sign * c[{n}]" for n in range(ORDER + 1))


look_for: Callable[[StepSeries, Coefficients, float], None] = from_text("look_for", "w, c, sign", _look_for)
"""Has a polynomial, times `sign`, in `other`, where its roots are looked for."""


def bernstein_over(w: StepSeries, low: float, high: float) -> None:
    """The Bernstein coefficients over [low, high] of the polynomial in `other`."""
    w.work += 1
    if low > 0.0:
        to_bernstein_over(w, low, high - low)
    elif high < 1.0:
        to_bernstein_up_to(w, high)
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
    """The one root between `low` and `high` of the polynomial in `other`, with its Bernstein coefficients over them.

    Their polygon crosses 0 near the root.
    """
    b = w.bernstein
    sign = 1.0 if b[0] > 0.0 or (b[0] == 0.0 and b[ORDER] < 0.0) else -1.0
    return newton_root(w.other, sign, low, high, low + (high - low) * polygon_root(b))


def falling_crossing(c: Coefficients, high: float) -> float:
    """Where a polynomial that falls from 0 to `high` falls below 0; 2 if it begins there or never does."""
    end = value_at(c, high) if high < 1.0 else value_at_end(c)
    if not (c[0] > 0.0 and end <= 0.0):
        return 2.0
    return newton_root(c, 1.0, 0.0, high, parabola_root(c[0], c[1], end, high))


def parabola_root(first: float, slope: float, end: float, high: float) -> float:
    """Where the parabola with this first value, slope and value at `high` falls below 0."""
    bent = (end - first - slope * high) / (high * high)
    s = 2.0 * first / (math.sqrt(max(slope * slope - 4.0 * bent * first, 0.0)) - slope)
    return s if 0.0 < s < high else 0.5 * high


def newton_root(c: Coefficients, sign: float, low: float, high: float, s: float) -> float:
    """The one root between `low`, where the polynomial has this sign, and `high`: Newton's method from s on.

    It is kept inside by halving. Each step soon is a constant times the square of the one before it; the next one is
    not made if it would move no digit.
    """
    before = 0.0
    for _ in range(80):
        y, slope = value_and_slope(c, s)
        if y == 0.0:
            return s
        if y * sign > 0.0:
            low = s
        else:
            high = s
        step = y / slope if slope != 0.0 else math.inf
        nearer, by = s - step, abs(step)
        if not low < nearer < high:
            nearer, by, before = 0.5 * (low + high), 0.0, 0.0
        settled = before > 0.0 and by <= NEAR_ROOT * s and by * by * by <= NO_DIGIT * s * before * before
        if settled or abs(nearer - s) <= 2.3e-16 * s or nearer in (low, high):
            return nearer
        s, before = nearer, by
    return s


def polygon_root(b: Coefficients) -> float:
    """Where the control polygon first changes sign, between 0 and 1."""
    for j in range(ORDER):
        if (b[j] > 0.0) != (b[j + 1] > 0.0) and b[j] != b[j + 1]:
            return (j + b[j] / (b[j] - b[j + 1])) / ORDER
    return 0.5


def first_crossing(w: StepSeries) -> float:
    """The first s in (0, 1] where the polynomial in `other`, above 0 just after s = 0, falls below it; 2 if none."""
    if falls(w.other) > 0.0:
        w.work += 1
        return falling_crossing(w.other, 1.0)
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
