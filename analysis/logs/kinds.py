"""Whose data logs hold: of people at a gun, of people at a simulated one, of synthetic participants. Never together.

Every reader obeys one rule: the first of these kinds that is there is what is read. Logs of the others are left out,
with the reason, or stand apart where they were asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import get_args

import numpy as np

from analysis.logs.design_logs import DesignLog
from analysis.logs.texts import Block, Cell, Coded
from experiments.record.design_table import HANDS, columns
from experiments.record.tables import DataKind, data_kind, is_simulated

OF_KIND: dict[DataKind, str] = {
    "real": "people at a gun",
    "simulated gun": "people at a simulated gun",
    "synthetic": "synthetic participants",
}
_HANDS_OF = {"direction": "response_source", "preference": "rating_by"}


def kinds_of(block: Block) -> Iterator[tuple[int, DataKind | None]]:
    """Each log's number and the kind of its data; None where nobody answered."""
    hands = _HANDS_OF[block.experiment]
    answered = _any_by_log(block, hands, lambda by: by is not None)
    synthetic = _any_by_log(block, hands, lambda by: by == "synthetic")
    simulated = _any_by_log(block, "gun", is_simulated)
    for number, some, own, gun in zip(block.log.tolist(), answered, synthetic, simulated, strict=True):
        yield number, data_kind(synthetic=own, simulated=gun) if some else None


def _any_by_log(block: Block, name: str, holds: Callable[[Cell], bool]) -> list[bool]:
    """Whether something holds of any cell of a column in each log."""
    column = block.columns[name]
    if not isinstance(column, Coded) or not len(block.rows):
        return []
    holding = np.array([holds(value) for value in column.values], dtype=np.bool_)
    found: list[bool] = np.logical_or.reduceat(holding[column.codes], np.cumsum(block.rows) - block.rows).tolist()
    return found


def kind_of_design(log: DesignLog) -> DataKind | None:
    """The kind of a design's data; None where nobody answered."""
    said = [column.name for column in columns(log.design) if column.levels == HANDS]
    hands = {str(row[name]) for row in log.rows for name in said if row[name]}
    simulated = any(is_simulated(row["gun"]) for row in log.rows)
    return data_kind(synthetic="synthetic" in hands, simulated=simulated) if hands else None


def kinds_there(kinds: Iterable[DataKind | None]) -> list[DataKind]:
    """The kinds that are there, in their order; `real` where there is nothing.

    >>> kinds_there(["synthetic", None, "real"])
    ['real', 'synthetic']
    """
    there = set(kinds)
    return [kind for kind in get_args(DataKind) if kind in there] or ["real"]


def folder_of(kind: DataKind) -> str:
    """The folder for what is made of data of a kind that is kept apart.

    >>> folder_of("simulated gun")
    'simulated-gun'
    """
    return kind.replace(" ", "-")


def kept_out(kind: DataKind, first: DataKind) -> str:
    """What is said of a log of another kind than the first."""
    return (
        f"is of {OF_KIND[kind]}, beside logs of {OF_KIND[first]} (rule: never together); read it by itself, or with "
        "`--include-synthetic`, which keeps both apart"
    )
