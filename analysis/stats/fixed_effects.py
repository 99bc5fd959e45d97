"""The fixed effects of a model of single trials: predictors as columns, and what was estimated of each."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.stats.arrays import FloatArray, by_row, in_brief, numbers, one_of, row_labels
from analysis.stats.frames import Result, Results

INTERCEPT = "intercept"


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient(Result):
    """One coefficient with its standard error, z = estimate / se, p of the normal distribution, and interval."""

    name: str
    estimate: float
    se: float
    z: float
    p: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PredictorColumns:
    """The intercept and the predictors, each centred and over its SD: `matrix` (rows, columns).

    `back` (columns, columns) brings the coefficients of these columns to those of the predictors as they were given.
    """

    names: tuple[str, ...]
    matrix: FloatArray
    back: FloatArray


def indicators(levels: Sequence[str], reference: str | None = None) -> dict[str, FloatArray]:
    """A factor as predictors: for each level but the `reference` (the first that occurs unless given) 1 where it is.

    `ValueError`: a reference that does not occur, or one level only.

    >>> {name: column.tolist() for name, column in indicators(["a", "b", "c", "b"]).items()}
    {'b': [0.0, 1.0, 0.0, 1.0], 'c': [0.0, 0.0, 1.0, 0.0]}
    """
    each = list(map(str, row_labels(levels, "levels")))
    names = list(dict.fromkeys(each))
    if len(names) < 2:
        raise ValueError(f"levels: at least two are needed, not {in_brief(names)}")
    first = names[0] if reference is None else one_of(reference, "reference", names)
    given = np.array(each)
    return {name: (given == name).astype(np.float64) for name in names if name != first}


def people_codes(people: Sequence[Hashable], rows: int) -> NDArray[np.intp]:
    """A number for each person, row by row. `ValueError`: another number of rows, or a row of nobody.

    >>> people_codes(["P2", "P1", "P2"], 3).tolist()
    [0, 1, 0]
    """
    each = row_labels(people, "people")
    if len(each) != rows:
        raise ValueError(f"people must say whose each row is: there are {len(each)} for {rows} rows")
    codes: NDArray[np.intp] = pd.factorize(np.fromiter(each, dtype=object, count=rows))[0]
    return codes


def _check_named(predictors: object) -> None:
    if not isinstance(predictors, Mapping):
        kind = type(predictors).__name__
        raise ValueError(f"predictors must be columns by their names, {{name: values}}, not a {kind}")


def columns_of(predictors: Mapping[str, ArrayLike], rows: int) -> PredictorColumns:
    """The columns of a model. `ValueError`: another number of rows, a constant predictor, predictors that overlap."""
    _check_named(predictors)
    given = [numbers(values, f"predictors[{name!r}]") for name, values in predictors.items()]
    for name, array in zip(predictors, given, strict=True):
        if array.shape != (rows,):
            raise ValueError(
                f"predictors[{name!r}] must have one number for each of the {rows} rows, not {array.shape}"
            )
        if array.min() == array.max():
            raise ValueError(f"predictors[{name!r}] is {array[0]:g} in every row: it tells nothing from the intercept")
    wide = np.column_stack([np.ones(rows), *given])
    means, spreads = wide.mean(axis=0), wide.std(axis=0)
    means[0], spreads[0] = 0.0, 1.0
    matrix = (wide - means) / spreads
    if int(np.linalg.matrix_rank(matrix)) < matrix.shape[1]:
        raise ValueError(f"the predictors {', '.join(predictors)} overlap: one of them follows from the others")
    back = np.diag(1.0 / spreads)
    back[0, 1:] = -means[1:] / spreads[1:]
    return PredictorColumns(names=(INTERCEPT, *predictors), matrix=matrix, back=back)


def coefficients(
    names: Sequence[str], estimates: FloatArray, se: FloatArray, confidence: float
) -> Results[Coefficient]:
    """Wald tests and intervals of estimates (p,) with their standard errors (p,)."""
    z, half = estimates / se, -NormalDist().inv_cdf((1.0 - confidence) / 2.0) * se
    rows = by_row(
        estimate=estimates,
        se=se,
        z=z,
        p=2.0 * scipy.special.ndtr(-np.abs(z)),
        ci_low=estimates - half,
        ci_high=estimates + half,
    )
    return Results(Coefficient(name=name, **row) for name, row in zip(names, rows, strict=True))
