"""The door of the statistics: numbers are checked on the way in, and a single result leaves as a plain float."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
Values = float | FloatArray
"""A plain float for one data set, an array over the leading axes for many."""


def numbers(values: ArrayLike, name: str) -> FloatArray:
    """`values` as float64; `ValueError` if they are not finite numbers. Truth values count as 0 and 1."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name} must be numbers in a full rectangle, not {array.dtype}")
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must be finite, but the value at index {place} is {array[place]}")
    return array


def plain(values: ArrayLike) -> Values:
    """A Python float if `values` has no axis, else a float64 array."""
    array = np.asarray(values, dtype=np.float64)
    return float(array) if array.ndim == 0 else array


def share(value: float, name: str) -> float:
    """`value` if it lies strictly between 0 and 1, else `ValueError`."""
    if not 0.0 < value < 1.0:
        raise ValueError(f"{name} must lie between 0 and 1, not {value}")
    return value
