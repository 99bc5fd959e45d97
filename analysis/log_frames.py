"""Log tables as data frames: one type a column, whoever read it, and many frames put together in the order of logs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.log_rules import Cell, Row
from experiments import columns
from experiments.columns import Column

STUDY = "study"
_DTYPES = {"text": "string", "integer": "Int64", "flag": "Int64", "number": "float64"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Coded:
    """A column of few values: the number of each row's value, and the values, None for an empty cell."""

    codes: NDArray[np.int64]
    values: tuple[Cell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Checked rows of an experiment, and for each the number of the log it belongs to.

    Columns are coded, or arrays of numbers or text.
    """

    experiment: str
    columns: Mapping[str, Coded | NDArray[Any]]
    log: NDArray[np.int64]


def is_category(column: Column) -> bool:
    """Columns of few values, which are kept as categories."""
    return column.type == "level" or column.name in {"participant_id", "gun"}


def levels(names: Iterable[str]) -> pd.Index:
    """Categories of text, of one type even if there are none."""
    return pd.Index(list(names), dtype="str")


def block_of_rows(experiment: str, rows: Sequence[Row], log: int) -> Block:
    """The rows of one log as a block."""
    made = {column.name: _coded([row[column.name] for row in rows]) for column in columns.TABLES[experiment]}
    return Block(experiment=experiment, columns=made, log=np.full(len(rows), log, dtype=np.int64))


def _coded(cells: Sequence[Cell]) -> Coded:
    values = tuple(dict.fromkeys(cells))
    places = {value: place for place, value in enumerate(values)}
    return Coded(codes=np.array([places[cell] for cell in cells], dtype=np.int64), values=values)


def joined(experiment: str, blocks: Iterable[Block], studies: Mapping[int, str]) -> pd.DataFrame:
    """The rows of an experiment in the order of their logs, with the study that `studies` names for each log.

    Rows of logs without a study are left out. If there are several studies, a participant is `study/code`.
    """
    mine = [block for block in blocks if block.experiment == experiment]
    log = np.concatenate([np.empty(0, dtype=np.int64), *(block.log for block in mine)])
    order = np.flatnonzero(np.isin(log, np.fromiter(studies, dtype=np.int64)))
    order = order[np.argsort(log[order], kind="stable")]
    whole = np.array_equal(order, np.arange(len(log)))
    made: dict[str, Any] = {}
    for column in columns.TABLES[experiment]:
        made[column.name] = _made(column, [block.columns[column.name] for block in mine], None if whole else order)
    made[STUDY] = _studies(log[order], studies)
    if len(set(studies.values())) > 1:
        made["participant_id"] = _persons(made[STUDY], made["participant_id"])
    return pd.DataFrame(made)


def _made(column: Column, parts: Sequence[Coded | NDArray[Any]], order: NDArray[np.int64] | None) -> Any:
    """A column of all parts, of the column's type."""
    coded = [part for part in parts if isinstance(part, Coded)]
    if len(coded) == len(parts):
        codes, values = _recoded(coded)
        return _tidy(_decoded(column, values, codes if order is None else codes[order]))
    plain = [_plain(part) if isinstance(part, Coded) else part for part in parts]
    whole = np.concatenate(plain)
    cells: Any = whole if order is None else whole[order]
    return pd.array(cells, dtype=_DTYPES[column.type])


def _recoded(parts: Sequence[Coded]) -> tuple[NDArray[np.int64], list[Cell]]:
    """The parts' codes with one list of values for all."""
    places: dict[Cell, int] = {}
    codes = [np.empty(0, dtype=np.int64)]
    for part in parts:
        new = np.array([places.setdefault(value, len(places)) for value in part.values], dtype=np.int64)
        codes.append(new[part.codes])
    return np.concatenate(codes), list(places)


def _plain(part: Coded) -> NDArray[Any]:
    values = np.empty(len(part.values), dtype=object)
    values[:] = part.values
    return values[part.codes]


def _decoded(column: Column, values: Sequence[Cell], codes: NDArray[np.int64]) -> Any:
    missing = np.array([value is None for value in values], dtype=np.bool_)
    if is_category(column):
        names = levels(str(value) for value in values if value is not None)
        places = np.where(missing, -1, np.cumsum(~missing) - 1)
        return pd.Categorical.from_codes(places[codes], categories=names)
    if column.type == "text":
        texts: Any = list(values)
        return pd.array(texts, dtype="string").take(codes)
    if column.type == "number":
        known = np.array([np.nan if value is None else value for value in values], dtype=np.float64)
        return pd.array(known[codes], dtype="float64")
    numbers = np.array([0 if value is None else value for value in values], dtype=np.int64)
    return pd.arrays.IntegerArray(numbers[codes], missing[codes])


def _tidy(cells: Any) -> Any:
    """Categories that occur, in order, so that equal columns are equal however they were read."""
    if not isinstance(cells, pd.Categorical):
        return cells
    used = cells.remove_unused_categories()
    return used.reorder_categories(levels(sorted(used.categories)))


def _studies(log: NDArray[np.int64], studies: Mapping[int, str]) -> pd.Categorical:
    names = sorted(set(studies.values()))
    numbers, place = np.unique(log, return_inverse=True)
    codes = np.array([names.index(studies[number]) for number in numbers.tolist()], dtype=np.int64)
    return pd.Categorical.from_codes(codes[place], categories=levels(names)).remove_unused_categories()


def _persons(study: pd.Categorical, code: pd.Categorical) -> pd.Categorical:
    pairs = study.codes.astype(np.int64) * len(code.categories) + code.codes
    found, place = np.unique(pairs, return_inverse=True)
    width = max(1, len(code.categories))
    names = [f"{study.categories[pair // width]}/{code.categories[pair % width]}" for pair in found.tolist()]
    persons: pd.Categorical = _tidy(pd.Categorical.from_codes(place, categories=levels(names)))
    return persons
