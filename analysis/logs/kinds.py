"""Whose data logs hold: of people at a gun, of people at a simulated one, of synthetic participants. Never together.

Every reader obeys one rule: the first of these kinds that is there is what is read. Logs of the others are left out,
with the reason, or stand apart where they were asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

from analysis.logs.design_logs import DesignLog
from analysis.logs.files import BadLogError, Problem
from analysis.logs.journals import BegunRun
from analysis.logs.measures import MEASURES
from analysis.logs.texts import Block, Cell, Coded
from experiments.record.design_columns import columns
from experiments.record.tables import HANDS, DataKind, data_kind, is_simulated

OF_KIND: dict[DataKind, str] = {
    "real": "people at a gun",
    "simulated gun": "people at a simulated gun",
    "synthetic": "synthetic participants",
}


def kinds_of(block: Block) -> Iterator[tuple[int, DataKind | None]]:
    """Each log's number and the kind of its data; None where nobody answered."""
    hands = MEASURES[block.experiment].hand
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


NEVER_TOGETHER, IN_REGISTER = "never together", "whom the register excludes is left out"
"""The rules that leave out data of other kinds, and whom the experimenters have excluded."""


def kept_out(kind: DataKind, first: DataKind) -> str:
    """What is said of a log of another kind than the first."""
    return (
        f"is of {OF_KIND[kind]}, beside logs of {OF_KIND[first]} (rule: {NEVER_TOGETHER}); read it by itself, or with "
        "`--include-synthetic`, which keeps both apart"
    )


def begun_by_kind(
    begun: Iterable[BegunRun], kinds: Sequence[DataKind], *, alone: bool
) -> tuple[dict[DataKind, list[BegunRun]], list[Problem]]:
    """Unfinished runs by the kind of their data, unknown ones with the first; those of other kinds are problems.

    `alone`: there are no logs, and so none that they could not stand beside.
    """
    found: dict[DataKind, list[BegunRun]] = {kind: [] for kind in kinds}
    others = []
    for one in begun:
        kind, run = one.data or kinds[0], one.file
        if kind in found or alone:
            found[kind if kind in found else kinds[0]].append(one)
        else:
            bad = BadLogError(kept_out(kind, kinds[0]))
            problem = bad.of(Path(run.path), run.participant, run.experiment, run.study)
            others.append(replace(problem, data=kind))
    return found, others
