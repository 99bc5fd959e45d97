"""By whose hands answers were given, and on which guns."""

from __future__ import annotations

from collections.abc import Hashable

import pandas as pd

from analysis.summary.results import Origin
from experiments.design.config import DesignConfig


def origin_of_design(design: DesignConfig, table: pd.DataFrame) -> Origin:
    """Who gave each answer to each question that says so, and who rendered each trial that has one."""
    named = [(name, f"{name}_{part}") for name in design.questions for part in ("source", "by")]
    asked = {name: source for name, source in named if source in table}
    if not asked:
        return Origin(answers={}, guns={})
    hands = pd.concat([table.loc[table[name].notna(), source] for name, source in asked.items()])
    return Origin(answers=_counted(hands), guns=_counted(table.loc[table[list(asked)].notna().any(axis=1), "gun"]))


def origin_of(rows: pd.DataFrame, source: str) -> Origin:
    """Whose hands stand in the column `source`, and the guns."""
    return Origin(answers=_counted(rows[source]), guns=_counted(rows["gun"]))


def _counted(names: pd.Series) -> dict[str, int]:
    return {str(name): int(count) for name, count in sorted(names.value_counts().items(), key=_most_first)}


def _most_first(counted: tuple[Hashable, int]) -> tuple[int, str]:
    return -counted[1], str(counted[0])
