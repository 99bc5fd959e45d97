"""Whose data an experiment can use: participants with every answer under every method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd


def complete_direction(table: pd.DataFrame, methods: Sequence[str], excluded: list[dict[str, Any]]) -> pd.DataFrame:
    """The trials of participants who answered all of theirs; the others go to `excluded` with the reason.

    The measure counts forward trials, so there must be some under each method.
    """
    return _complete(table, "direction", methods, excluded)


def complete_preference(table: pd.DataFrame, methods: Sequence[str], excluded: list[dict[str, Any]]) -> pd.DataFrame:
    """The ratings of participants who rated every method; the others go to `excluded` with the reason."""
    return _complete(table, "preference", methods, excluded)


def _complete(
    table: pd.DataFrame, experiment: str, methods: Sequence[str], excluded: list[dict[str, Any]]
) -> pd.DataFrame:
    good = []
    for code, rows in table.groupby("participant_id", sort=True):
        reason = _reason(rows, experiment, methods)
        if reason is None:
            good.append(code)
        else:
            excluded.append({"experiment": experiment, "participant": str(code), "reason": reason})
    return table[table["participant_id"].isin(good)]


def _reason(rows: pd.DataFrame, experiment: str, methods: Sequence[str]) -> str | None:
    """Why a participant is left out; None if nothing is missing."""
    measure, noun = ("correct", "trials unanswered") if experiment == "direction" else ("rating", "ratings missing")
    missing = int(rows[measure].isna().sum())
    if missing:
        return f"{missing} of {len(rows)} {noun}"
    counted = rows[rows["direction"] == "forward"] if experiment == "direction" else rows
    absent = [method for method in methods if method not in set(counted["method"])]
    what = "no forward trials with" if experiment == "direction" else "no rating of"
    return f"{what} {', '.join(absent)}" if absent else None
