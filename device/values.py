"""Values that come from outside: whether they are numbers, and how an error shows them."""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import TypeGuard


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value is a real number: of Python or numpy, whole or not, but neither true nor false, nor text.

    >>> is_number(1), is_number(True), is_number("1")
    (True, False, False)
    """
    return type(value) is float or (isinstance(value, Real) and not isinstance(value, bool))


def is_finite(value: object) -> TypeGuard[float]:
    """Whether a value is a number within a float's range.

    >>> is_finite(1), is_finite(float("nan")), is_finite(10**400), is_finite(None)
    (True, False, False, False)
    """
    try:
        return is_number(value) and math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def is_whole_number(value: object) -> TypeGuard[int]:
    """Whether a value is a whole number by its type: 1 is, 1.0 and true are not."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def shown(value: object) -> str:
    """A value as an error names it: a number as it is, anything else so that text is told from a number."""
    return f"{value}" if is_number(value) else f"{value!r}"
