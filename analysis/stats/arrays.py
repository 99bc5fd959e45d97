"""The door of the statistics: numbers are checked on the way in, and a single result leaves as a plain float."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Hashable, Sequence
from decimal import Decimal
from numbers import Real
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from device.messages import QUOTED

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.intp]
Values = float | FloatArray
"""A plain float for one data set, an array over the leading axes for many."""


def numbers(values: ArrayLike, name: str) -> FloatArray:
    """`values` as float64, itself if it is that already; `Fraction` and `Decimal` too. Truth values count as 0 and 1.

    `ValueError` naming the place if a value is missing, infinite or not a number, or if rows differ in length. Numbers
    in text are not read: who wrote "7" may have meant a label.
    """
    array = doubles(values, name)
    if not np.isfinite(array).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name} must be finite, {_at(place)} {array[place]}")
    return array


def doubles(values: ArrayLike, name: str) -> FloatArray:
    """As `numbers`, but NaN and infinite ones may be among them."""
    if isinstance(values, np.ma.MaskedArray) and values.mask.any():
        place = tuple(int(i) for i in np.argwhere(values.mask)[0])
        raise ValueError(f"{name} must be complete, but the value at index {place} is masked")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{name} must be numbers in a full rectangle: {_ragged(values)}") from error
    if array.dtype.kind in "US":  # numpy makes text of the numbers beside a text
        array = np.asarray(values, dtype=object)
    if array.dtype.kind not in "biuf" and (array.dtype.kind != "O" or _first_stranger(array)):
        raise ValueError(
            f"{name} must be numbers in a full rectangle, {_first_stranger(array) or f'not {array.dtype}'}"
        )
    try:
        return array.astype(np.float64, copy=False)
    except OverflowError:
        raise ValueError(f"{name} must be finite, but one is beyond the largest double") from None


def _at(place: tuple[int, ...]) -> str:
    return f"but the value at index {place} is" if place else "not"


def single(value: ArrayLike, name: str) -> float:
    """`value` as one finite number, else `ValueError` naming it.

    >>> single(Decimal("0.5"), "p0")
    0.5
    """
    array = numbers(value, name)
    if array.ndim:
        raise ValueError(f"{name} must be one number, not an array of shape {array.shape}")
    return float(array)


def whole(value: ArrayLike, name: str, low: int, high: float = math.inf) -> int:
    """`value` as one whole number of `low` to `high`, else `ValueError` naming it."""
    found = single(value, name)
    if found != math.floor(found) or not low <= found <= high:
        end = "" if math.isinf(high) else f" to {high:,.0f}"
        raise ValueError(f"{name} must be a whole number from {low}{end}, not {in_brief(value)}")
    return int(found)


_SMALLEST_SCALE, _LARGEST_SCALE = 1e-6, 1e6


def scale_number(value: ArrayLike, name: str) -> float:
    """`value` as one number of 0.000001 to 1,000,000, else `ValueError` naming it: the scale of a prior or a fence."""
    found = single(value, name)
    if not _SMALLEST_SCALE <= found <= _LARGEST_SCALE:
        raise ValueError(f"{name} must be above 0, at least 0.000001, and at most 1,000,000, not {in_brief(value)}")
    return found


def yes_or_no(value: object, name: str) -> bool:
    """`value` if it is True or False, else `ValueError` naming it."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False, not {in_brief(value)}")
    return bool(value)


def one_of(value: object, name: str, options: Sequence[str]) -> str:
    """`value` if it is one of the words, else `ValueError` naming it and them."""
    if not isinstance(value, str) or value not in options:
        raise ValueError(f"{name} must be one of {', '.join(options)}, not {in_brief(value)}")
    return value


def row_labels(values: object, name: str) -> list[Hashable]:
    """What says of each row or condition whose or which it is: a list, an array or a column, with an order.

    `ValueError` naming it: anything else, or an entry that is missing or itself a list.

    >>> row_labels(("P1", "P2"), "people")
    ['P1', 'P2']
    """
    if isinstance(values, str | bytes) or not (isinstance(values, Sequence) or getattr(values, "ndim", 0) == 1):
        raise ValueError(f"{name} must be a list or column, not {in_brief(values)}")
    found = list(cast("Sequence[Hashable]", values))
    for place, one in enumerate(found):
        if not _is_name(one):
            raise ValueError(f"{name} must be a list of names, but the one at index {place} is {in_brief(one)}")
    return found


def _is_name(value: object) -> bool:
    """Whether it can tell one from another: no list, None, NaN or missing value of pandas."""
    if value is None or not isinstance(value, Hashable):
        return False
    try:
        return bool(value == value)  # noqa: PLR0124 - NaN alone is not itself
    except TypeError:  # pandas.NA is neither equal nor unequal
        return False


def in_brief(value: object) -> str:
    """A value as a message shows it: cut where it would hide the message."""
    try:
        text = repr(value)
    except ValueError:  # whole numbers of more than some thousand digits have no text
        return "a number beyond all doubles"
    return text if len(text) <= QUOTED else f"{text[:QUOTED]}..."


def _ragged(values: object) -> str:
    rows = list(values) if isinstance(values, Sequence) else []
    lengths = [len(row) if isinstance(row, Sequence | np.ndarray) else 1 for row in rows]
    odd = [i for i, length in enumerate(lengths) if length != lengths[0]]
    return f"row 0 has {lengths[0]} values, row {odd[0]} has {lengths[odd[0]]}" if odd else "the rows differ in shape"


def _first_stranger(array: NDArray[np.generic]) -> str:
    for place, value in np.ndenumerate(array):
        if not isinstance(value, Real | Decimal | np.bool_) or _signals(value):
            found = value.item() if isinstance(value, np.generic) else value
            return f"{_at(place)} {in_brief(found)}"
    return ""


def _signals(value: object) -> bool:
    """Whether a number is `Decimal("sNaN")`, which no float can be."""
    return isinstance(value, Decimal) and value.is_snan()


def float_or_array(values: ArrayLike) -> Values:
    """A Python float if `values` has no axis, else a float64 array."""
    array = np.asarray(values, dtype=np.float64)
    return float(array) if array.ndim == 0 else array


def share(value: ArrayLike, name: str) -> float:
    """`value` if it lies strictly between 0 and 1, else `ValueError` naming it."""
    found = single(value, name)
    if not 0.0 < found < 1.0:
        raise ValueError(f"{name} must lie between 0 and 1, not {in_brief(value)}")
    return found


def together(**named: FloatArray) -> tuple[FloatArray, ...]:
    """The arrays broadcast against each other, else `ValueError` naming their shapes."""
    try:
        return tuple(np.broadcast_arrays(*named.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in named.items())
        raise ValueError(f"the shapes do not fit together: {shapes}") from None


Number = TypeVar("Number", np.float64, np.longdouble)
_CASES = 2048
"""Cases worked out together: what their nodes take stays in a processor's cache."""


def by_case(function: Callable[..., NDArray[Number]], *arguments: FloatArray) -> NDArray[Number]:
    """`function` of arguments of one shape, called for each different case once; results (..., cases) to (..., shape).

    >>> by_case(lambda k, n: k / n, np.array([1.0, 1.0, 3.0]), np.array([4.0, 4.0, 4.0])).tolist()
    [0.25, 0.25, 0.75]
    """
    first, where = _distinct(*(argument.ravel() for argument in arguments))
    cases = [argument.ravel()[first] for argument in arguments]
    chunks = range(0, max(len(first), 1), _CASES)
    found = np.concatenate([function(*(case[i : i + _CASES] for case in cases)) for i in chunks], axis=-1)
    return found[..., where].reshape(found.shape[:-1] + arguments[0].shape)


def _distinct(*columns: FloatArray) -> tuple[IndexArray, IndexArray]:
    """The row where each different combination of the columns (n,) stands, and for each row which of them it is."""
    key = np.zeros(columns[0].shape, dtype=np.intp)
    first = key[:1]
    for column in columns:
        if column.size and column.min() != column.max():
            codes = _codes(column)
            key = _codes(key * (codes.max() + 1) + codes)
            first = np.empty(key.max() + 1, dtype=np.intp)
            first[key] = np.arange(key.size)
    return first, key


def _codes(values: FloatArray | IndexArray) -> IndexArray:
    """A number from 0 for each value, the same for equal ones; counts in a table, since sorting takes longer."""
    most = values.max()
    if values.min() < 0 or most >= 4 * values.size or (values.dtype.kind == "f" and (values != np.floor(values)).any()):
        return np.unique(values, return_inverse=True)[1]
    places = values.astype(np.intp)
    seen = np.zeros(int(most) + 1, dtype=np.bool_)
    seen[places] = True
    codes: IndexArray = (np.cumsum(seen) - 1)[places]
    return codes


def by_row(**columns: ArrayLike) -> list[dict[str, float]]:
    """The numbers of columns (n,) row by row, as plain floats under the columns' names.

    >>> by_row(t=[1.0, 2.0], p=[0.5, 0.1])
    [{'t': 1.0, 'p': 0.5}, {'t': 2.0, 'p': 0.1}]
    """
    return [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]


def pingouin(name: str) -> Callable[..., Any]:
    """A function of pingouin by its name, its import silent: the deprecations in there are for its authors."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pingouin as library  # type: ignore[import-untyped, unused-ignore]  # noqa: PLC0415 - takes seconds
    function: Callable[..., Any] = getattr(library, name)
    return function
