"""Rows of many people, quickly: key columns as codes, and counts of answers in cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.stats.arrays import FloatArray
from device.words import DIRECTIONS

_KEYS = ("participant_id", "method", "direction", "response_source", "rating_by", "gun")
_MEASURES = ("correct", "rating", "response_time_s", "response_time_valid")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialCells:
    """Trials and correct answers, arrays (participants, methods, directions); the axes in the order of their names."""

    participants: tuple[str, ...]
    methods: tuple[str, ...]
    trials: FloatArray
    correct: FloatArray

    def rates(self, direction: str) -> pd.DataFrame:
        """Shares of correct answers of those who had such trials, participants by methods; NaN in an empty cell."""
        place = DIRECTIONS.index(direction)
        trials, correct = self.trials[..., place], self.correct[..., place]
        shares = np.divide(correct, trials, out=np.full_like(correct, np.nan), where=trials > 0.0)
        there = np.flatnonzero(trials.sum(axis=1))
        return pd.DataFrame(shares[there], index=[self.participants[i] for i in there], columns=list(self.methods))


class Finite(dict[str, Any]):
    """Numbers by name that are known to be finite, so that nobody looks at each of them again."""

    finite = True


class ByParticipant(Mapping[str, Mapping[str, float]]):
    """A number of each participant under each name: `array` (participants, names), read as a mapping of mappings."""

    def __init__(self, codes: Sequence[str], names: Sequence[str], values: FloatArray) -> None:
        """`values` in the order of `codes` and `names`."""
        self.codes, self.names, self.array = tuple(codes), tuple(names), values
        self._place = {code: i for i, code in enumerate(self.codes)}

    def __getitem__(self, code: str) -> dict[str, float]:
        return dict(zip(self.names, self.array[self._place[code]].tolist(), strict=True))

    def __iter__(self) -> Iterator[str]:
        return iter(self.codes)

    def __len__(self) -> int:
        return len(self.codes)

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        return bool(np.isfinite(self.array).all())

    def column(self, name: str, codes: Iterable[str]) -> FloatArray:
        """The numbers of these participants under a name; NaN for who or what is not here."""
        column = self.array[:, self.names.index(name)] if name in self.names else np.full(len(self), np.nan)
        return np.array([column[self._place[code]] if code in self._place else np.nan for code in codes])


def coded(table: pd.DataFrame) -> pd.DataFrame:
    """The keys and measures of `table`, the keys as categories: only those that occur, in the order of their names.

    The other columns stay behind: rows are chosen many times, and text is slow to choose from.
    """
    made: dict[str, Any] = {name: _category(table[name]) for name in _KEYS if name in table}
    return pd.DataFrame(made | {name: table[name] for name in _MEASURES if name in table}, copy=False)


def trial_cells(trials: pd.DataFrame, methods: Sequence[str]) -> TrialCells:
    """The cells of a coded table in which every trial has an answer."""
    people = trials["participant_id"].cat.categories
    shape = (len(people), len(methods), len(DIRECTIONS))
    keys = (
        codes_of(trials["participant_id"]),
        places_among(trials["method"], methods),
        places_among(trials["direction"], DIRECTIONS),
    )
    cell = np.ravel_multi_index(keys, shape)
    size = int(np.prod(shape))
    correct = trials["correct"].to_numpy(dtype=np.float64)
    return TrialCells(
        participants=tuple(str(code) for code in people),
        methods=tuple(methods),
        trials=np.bincount(cell, minlength=size).reshape(shape).astype(np.float64),
        correct=np.bincount(cell, weights=correct, minlength=size).reshape(shape).astype(np.float64),
    )


def _category(column: pd.Series) -> pd.Series:
    """Codes in the order of the names that occur; the names as plain strings, which are quick to walk through."""
    found = column.astype("category").cat
    codes, names = found.codes.to_numpy(), [str(name) for name in found.categories.tolist()]
    occur = np.flatnonzero(np.bincount(codes + np.intp(1), minlength=len(names) + 1)[1:])
    order = sorted(occur.tolist(), key=names.__getitem__)
    rank = np.full(len(names) + 1, -1, dtype=np.int32)  # the last one stands for a missing value, code -1
    rank[order] = np.arange(len(order))
    categories = pd.Index([names[i] for i in order], dtype=object)
    return pd.Series(pd.Categorical.from_codes(rank[codes], categories), index=column.index)


def codes_of(column: pd.Series) -> NDArray[np.intp]:
    """For each row the place of its value among the categories of a coded column."""
    return np.asarray(column.cat.codes, dtype=np.intp)


def places_among(column: pd.Series, names: Sequence[str]) -> NDArray[np.intp]:
    """For each row of a coded column the place of its value among `names`."""
    places: NDArray[np.intp] = np.array([names.index(str(name)) for name in column.cat.categories], dtype=np.intp)
    found: NDArray[np.intp] = np.take(places, codes_of(column))
    return found
