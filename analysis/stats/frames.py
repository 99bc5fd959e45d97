"""Statistics and tables: scores and groups come in as DataFrames or mappings, with their names, and results go out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar, Union, cast

import numpy as np
from numpy.typing import ArrayLike

from analysis.report.serial import NotebookResult, plain
from analysis.stats.arrays import FloatArray, in_brief, numbers

if TYPE_CHECKING:
    import pandas as pd

Label = str | int
ScoreTable = Union[ArrayLike, Mapping[str, ArrayLike], "pd.DataFrame"]
"""An array (..., participants, conditions); or a DataFrame or mapping of a column each condition, whose names stay."""
GroupTable = Union[Sequence[ArrayLike], Mapping[str, ArrayLike], "pd.DataFrame"]
"""Arrays (..., n_i); or a mapping of them, or a DataFrame of a column each group, whose names stay."""

FROM_LONG = "a long table becomes a wide one by wide(table, participant=..., condition=..., score=...)"


def named_scores(scores: ScoreTable, name: str) -> tuple[FloatArray, tuple[Label, ...] | None]:
    """ScoreTable as an array (..., participants, conditions), and the names of the conditions, if they have any."""
    if is_frame(scores):
        return _stacked(_columns(scores, name)), _labels(scores.columns)
    if isinstance(scores, Mapping):
        columns = [numbers(column, f"{name}[{key!r}]") for key, column in scores.items()]
        if len({column.shape for column in columns}) > 1:
            lengths = ", ".join(f"{key} {column.shape}" for key, column in zip(scores, columns, strict=True))
            raise ValueError(f"{name} must have as many participants in each condition, not {lengths}")
        return _stacked(columns), _labels(scores)
    return numbers(scores, name), None


def _stacked(columns: list[FloatArray]) -> FloatArray:
    return np.stack(columns, axis=-1) if columns else np.empty((0, 0))


def named_groups(groups: GroupTable, name: str) -> tuple[list[FloatArray], tuple[Label, ...] | None]:
    """GroupTable as arrays (..., n_i), and their names, if they have any."""
    if is_frame(groups):
        return _columns(groups, name), _labels(groups.columns)
    if isinstance(groups, Mapping):
        return [numbers(group, f"{name}[{key!r}]") for key, group in groups.items()], _labels(groups)
    listed = isinstance(groups, Sequence) and not isinstance(groups, str | bytes)
    if not listed and getattr(groups, "ndim", 0) < 1:
        raise ValueError(f"{name} must be a sequence or mapping of arrays, one a group, not {in_brief(groups)}")
    return [numbers(cast("ArrayLike", group), f"{name}[{i}]") for i, group in enumerate(groups)], None


def is_frame(values: object) -> TypeGuard[pd.DataFrame]:
    """Whether it is a DataFrame of pandas, which is not imported for this."""
    return hasattr(values, "iloc") and hasattr(values, "columns")


def _columns(frame: pd.DataFrame, name: str) -> list[FloatArray]:
    return [_column(frame, j, f"{name}[{label!r}]") for j, label in enumerate(frame.columns)]


def _column(frame: pd.DataFrame, j: int, name: str) -> FloatArray:
    try:
        return numbers(frame.iloc[:, j].to_numpy(), name)
    except ValueError as error:
        hint = "" if frame.dtypes.iloc[j].kind in "biufc" else f"; {FROM_LONG}"
        raise ValueError(f"{error}{hint}") from None


def _labels(names: Sequence[object] | Mapping[str, ArrayLike] | pd.Index) -> tuple[Label, ...]:
    return tuple(name if isinstance(name, str | int) else str(name) for name in names)


def wide(table: pd.DataFrame, *, participant: str, condition: str, score: str) -> pd.DataFrame:
    """A long table, a row a score, as a wide one: participants by conditions, both in the order in which they come.

    `ValueError`: a column that is not there, two scores of a participant in a condition, or none.

    >>> import pandas as pd
    >>> long = pd.DataFrame({"who": ["P1", "P1", "P2", "P2"], "method": ["b", "a", "b", "a"], "rating": [1, 4, 2, 7]})
    >>> wide(long, participant="who", condition="method", score="rating").to_dict("list")
    {'b': [1, 2], 'a': [4, 7]}
    """
    _there(table, participant=participant, condition=condition, score=score)
    doubled = table.duplicated([participant, condition])
    if doubled.any():
        who, what = table.loc[doubled, [participant, condition]].iloc[0]
        mean = f"table.groupby([{participant!r}, {condition!r}], as_index=False, sort=False)[{score!r}].mean()"
        raise ValueError(f"table: {who!r} has two scores under {what!r}; if their mean is meant, pass {mean}")
    found = table.pivot(index=participant, columns=condition, values=score)
    found = found.loc[table[participant].unique(), table[condition].unique()]
    if found.isna().to_numpy().any():
        i, j = np.argwhere(found.isna().to_numpy())[0]
        raise ValueError(
            f"table: {found.index[i]!r} has no score under {found.columns[j]!r}; leave the participant out"
        )
    return found


def groups_of(table: pd.DataFrame, *, group: str, score: str) -> dict[str, FloatArray]:
    """The scores of a long table by group, in the order in which they come. `ValueError`: a column that is not there.

    >>> import pandas as pd
    >>> long = pd.DataFrame({"group": ["old", "young", "old"], "rating": [3, 5, 4]})
    >>> {name: scores.tolist() for name, scores in groups_of(long, group="group", score="rating").items()}
    {'old': [3.0, 4.0], 'young': [5.0]}
    """
    _there(table, group=group, score=score)
    rows = table.groupby(group, sort=False, observed=True)[score]
    return {str(name): numbers(scores.to_numpy(), f"table[{score!r}] of {name!r}") for name, scores in rows}


def _there(table: pd.DataFrame, **wanted: object) -> None:
    if not is_frame(table):
        raise ValueError(f"table must be a DataFrame, not {in_brief(table)}")
    for argument, column in wanted.items():
        if not isinstance(column, str) or column not in table.columns:
            raise ValueError(
                f"{argument}={in_brief(column)}: no such column; the table has {', '.join(map(str, table))}"
            )


class Result(NotebookResult):
    """A statistic's result: a row of a table in a notebook, or one for each of many data sets."""

    __slots__ = ()

    def rows(self) -> list[dict[str, object]]:
        """Its numbers by name; of arrays over data sets, a row each, in their order."""
        members = dict(_members(self, ""))
        arrays = {name: value for name, value in members.items() if isinstance(value, np.ndarray) and value.ndim}
        if not arrays:
            return [members]
        shape = np.broadcast_shapes(*(value.shape for value in arrays.values()))
        columns = {name: np.broadcast_to(value, shape) for name, value in arrays.items()}
        each = ({name: column[place].item() for name, column in columns.items()} for place in np.ndindex(shape))
        return [{name: row.get(name, value) for name, value in members.items()} for row in each]


def _members(result: Any, prefix: str) -> Iterator[tuple[str, object]]:
    """Fields, those of results within under both names."""
    for field in fields(result):
        value = getattr(result, field.name)
        if is_dataclass(value):
            yield from _members(value, f"{prefix}{field.name}_")
        elif not field.metadata.get("unwritten"):
            yield f"{prefix}{field.name}", value


ResultT_co = TypeVar("ResultT_co", bound=Result, covariant=True)


class Results(tuple[ResultT_co, ...], NotebookResult):
    """Results of one kind, such as those of all pairs: a tuple, and in a notebook a table with a row each."""

    __slots__ = ()

    def rows(self) -> list[dict[str, object]]:
        """Those of each."""
        return [row for result in self for row in result.rows()]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, under `results`."""
        return {"results": plain(list(self))}
