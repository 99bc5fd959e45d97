"""Checked rows as data frames: one type a column, and many blocks put together in the order of logs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from analysis.logs.texts import TEXT, Texts, has_many_values, is_category
from experiments.record import tables
from experiments.record.tables import Column

STUDY = "study"

Cell = str | int | float | None
"""The value of a cell; `None` if it is empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Coded:
    """A column of few values: the number of each row's value, and the values, None for an empty cell."""

    codes: NDArray[np.int32]
    values: tuple[Cell, ...]


Cells = Coded | NDArray[np.float64] | Texts
"""A column: coded, or numbers, or texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Checked rows of an experiment, log after log: the logs' numbers, and how many rows each has."""

    experiment: str
    columns: Mapping[str, Cells]
    log: NDArray[np.int64]
    rows: NDArray[np.int64]


def levels(names: Iterable[str]) -> pd.Index:
    """Categories of text, of one type even if there are none."""
    return pd.Index(list(names), dtype="str")


def chosen(cells: Cells, rows: NDArray[np.int64]) -> Cells:
    """Some rows of a column."""
    if isinstance(cells, Coded):
        return replace(cells, codes=cells.codes[rows])
    return cells[rows] if isinstance(cells, np.ndarray) else cells.take(pa.array(rows))


def joined(experiment: str, blocks: Iterable[Block], studies: Mapping[int, str]) -> pd.DataFrame:
    """The rows of an experiment in the order of their logs, with the study that `studies` names for each log.

    Rows of logs without a study are left out. If there are several studies, a participant is `study/code`.
    """
    mine = [block for block in blocks if block.experiment == experiment]
    none = np.empty(0, dtype=np.int64)
    log = np.concatenate([none, *(block.log for block in mine)])
    rows = np.concatenate([none, *(block.rows for block in mine)])
    known = np.array([number in studies for number in log.tolist()], dtype=np.bool_)
    order = np.argsort(log)
    order = order[known[order]]
    chosen_rows = None if np.array_equal(order, np.arange(len(log))) else _rows_of(order, rows)
    made: dict[str, Any] = {}
    for column in tables.TABLES[experiment]:
        made[column.name] = _made(column, [block.columns[column.name] for block in mine], chosen_rows)
    made[STUDY] = _studies([studies[number] for number in log[order].tolist()], rows[order], set(studies.values()))
    if len(set(studies.values())) > 1:
        made["participant_id"] = _persons(made[STUDY], made["participant_id"])
    return pd.DataFrame(made, copy=False)


def _rows_of(logs: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The places of the rows of some logs, in the order of these."""
    starts, counts = (np.cumsum(rows) - rows)[logs], rows[logs]
    return np.asarray(np.arange(counts.sum()) + np.repeat(starts - (np.cumsum(counts) - counts), counts))


def _made(column: Column, parts: Sequence[Cells], rows: NDArray[np.int64] | None) -> Any:
    """Some rows of a column's parts, of the column's type."""
    if column.type == "number":
        numbers = np.concatenate([np.empty(0), *parts])
        return pd.array(numbers if rows is None else numbers[rows], dtype="float64")
    if has_many_values(column):
        texts = pa.chunked_array(parts, TEXT)
        return pd.array(texts if rows is None else texts.take(pa.array(rows)), dtype="string")
    codes, values = _recoded([part for part in parts if isinstance(part, Coded)])
    codes = codes if rows is None else codes[rows]
    return _categories(codes, values) if is_category(column) else _integers(codes, values)


def _recoded(parts: Sequence[Coded]) -> tuple[NDArray[np.int32], list[Cell]]:
    """The parts' codes with one list of values for all."""
    places: dict[Cell, int] = {}
    codes = [np.empty(0, dtype=np.int32)]
    for part in parts:
        new = np.array([places.setdefault(value, len(places)) for value in part.values], dtype=np.int32)
        codes.append(new[part.codes])
    return np.concatenate(codes), list(places)


def _categories(codes: NDArray[np.int32], values: Sequence[Cell]) -> pd.Categorical:
    """Categories that occur, in the order of their names, so that equal columns are equal however they were read."""
    counts = np.bincount(codes, minlength=len(values))
    used = sorted((str(value), i) for i, value in enumerate(values) if counts[i] and value is not None)
    places = np.full(len(values), -1, dtype=np.int32)
    places[[i for _, i in used]] = np.arange(len(used))
    return pd.Categorical.from_codes(places[codes], categories=levels(name for name, _ in used))


def _integers(codes: NDArray[np.int32], values: Sequence[Cell]) -> pd.arrays.IntegerArray:
    missing = np.array([value is None for value in values], dtype=np.bool_)
    numbers = np.array([0 if value is None else value for value in values], dtype=np.int64)
    return pd.arrays.IntegerArray(numbers[codes], missing[codes])


def _studies(studies: Sequence[str], rows: NDArray[np.int64], all_studies: Iterable[str]) -> pd.Categorical:
    """The study of each row, from the study of each log."""
    places = {name: place for place, name in enumerate(sorted(all_studies))}
    codes = np.array([places[study] for study in studies], dtype=np.int32)
    return _categories(np.repeat(codes, rows), list(places))


def _persons(study: pd.Categorical, code: pd.Categorical) -> pd.Categorical:
    width = max(1, len(code.categories))
    found, place = np.unique(study.codes.astype(np.int64) * width + code.codes, return_inverse=True)
    names = [f"{study.categories[pair // width]}/{code.categories[pair % width]}" for pair in found.tolist()]
    return _categories(place.astype(np.int32), names)
