"""Numbers as text in the style of the APA: the only rounding there is. What is undefined becomes a dash."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import ROUND_HALF_UP, Decimal

NO_NUMBER = "–"
"""Stands where there is no number."""


def known(value: float | None) -> float | None:
    """The number, None if it is NaN or infinite: a page shows neither."""
    return value if value is not None and math.isfinite(value) else None


def number(value: float | None, digits: int = 2) -> str:
    """`value` with so many decimals, and a true minus sign; a dash for None and for what is not finite.

    A half is rounded away from 0, wherever the last bits of its float lie: 49 of 80 is 61.3 % by whatever sum.

    >>> number(-1.2345), number(None), number(math.nan), number(61.25, 1), number(100 * (0.1 + 0.5125), 1)
    ('−1.23', '–', '–', '61.3', '61.3')
    """
    if value is None or not math.isfinite(value):
        return NO_NUMBER
    text = f"{_rounded(value, digits) if abs(value) < _EXACT else value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0.0 else text.replace("-", "−")


_EXACT, _KNOWN_DIGITS = 1e12, 13
"""Below this so many digits are more than the last bits of a sum disturb."""


def _rounded(value: float, digits: int) -> Decimal:
    return Decimal(f"{value:.{_KNOWN_DIGITS}g}").quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP)


def figures(value: float | None) -> str:
    """`value` with three significant figures, where decimals would be zeros alone or hundreds of digits.

    >>> figures(-1.2345e-12), figures(1e300), figures(None)
    ('−1.23e−12', '1e+300', '–')
    """
    if value is None or not math.isfinite(value):
        return NO_NUMBER
    return f"{value:.3g}".replace("-", "−")


def below_one(value: float | None) -> str:
    """A number that cannot pass 1, without a leading zero.

    >>> below_one(0.7351), below_one(1.0)
    ('.74', '1.00')
    """
    return number(value).removeprefix("0")


def percent(share: float | None, digits: int = 1) -> str:
    """A share of 1 in percent.

    >>> percent(0.55714)
    '55.7 %'
    """
    return NO_NUMBER if share is None or not math.isfinite(share) else f"{number(100.0 * share, digits)} %"


def p_cell(p: float | None) -> str:
    """A p-value without "p =", for a table: three decimals, no leading zero.

    >>> p_cell(0.0004), p_cell(0.0423), p_cell(0.9999)
    ('< .001', '.042', '> .999')
    """
    if p is None or math.isnan(p):
        return NO_NUMBER
    if p < 0.001:
        return "< .001"
    return "> .999" if p >= 0.9995 else number(p, 3).removeprefix("0")


def p_value(p: float | None, *, exact: bool = False) -> str:
    """A p-value in a sentence; `exact`: below .001 in full, with two digits.

    >>> p_value(0.0004), p_value(0.0423), p_value(None), p_value(2.84e-7, exact=True)
    ('p < .001', 'p = .042', 'p undefined', 'p = 2.8 × 10⁻⁷')
    """
    cell = p_cell(p)
    if cell == NO_NUMBER:
        return "p undefined"
    if exact and p is not None and 0.0 < p < 0.001:
        digits, _, power = f"{p:.1e}".partition("e")
        return f"p = {digits} × 10{str(int(power)).translate(_RAISED)}"
    return f"p {cell}" if cell[0] in "<>" else f"p = {cell}"


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def f_test(F: float | None, df: Sequence[float], p: float | None, *, exact: bool = False) -> str:
    """An F test in a sentence; whole degrees of freedom without decimals, corrected ones with two.

    >>> f_test(28.4512, (2, 26), 2.7e-7)
    'F(2, 26) = 28.45, p < .001'
    >>> f_test(math.inf, (2, 22), 0.0)  # everybody differs by the same
    'F(2, 22) = ∞, p < .001'
    """
    shown = "∞" if F is not None and math.isinf(F) else number(F)
    of = ", ".join(str(one) if isinstance(one, int) else number(one) for one in df)
    return f"F({of}) = {'undefined or infinite' if shown == NO_NUMBER else shown}, {p_value(p, exact=exact)}"


def odds_cell(value: float | None) -> str:
    """An odds ratio for a table: ends that nobody reads to the last digit are bounds.

    >>> odds_cell(2.5), odds_cell(7.4e16), odds_cell(3e-9), odds_cell(None)
    ('2.50', '> 1000', '< 0.01', '–')
    """
    if value is None or not math.isfinite(value) or _READ[0] <= value <= _READ[1]:
        return number(value)
    return f"> {_READ[1]}" if value > _READ[1] else f"< {_READ[0]}"


_READ = 0.01, 1000


def interval(low: float | None, high: float | None, digits: int = 2) -> str:
    """A confidence interval.

    >>> interval(-0.5, 1.25)
    '[−0.50, 1.25]'
    """
    return f"[{number(low, digits)}, {number(high, digits)}]"
