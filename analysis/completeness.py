"""Whose data an experiment can use: participants with every answer under every method."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

_MEASURES = {"direction": ("correct", "trials unanswered"), "preference": ("rating", "ratings missing")}


def complete_rows(
    table: pd.DataFrame, experiment: str, methods: Sequence[str]
) -> tuple[pd.DataFrame, list[dict[str, str]]]:
    """The rows of the participants who answered everything, and the others: experiment, participant, reason.

    Every method must be there; for direction with forward trials, because these are what the measure counts.
    """
    reasons = {
        str(code): _reason(rows, experiment, methods) for code, rows in table.groupby("participant_id", sort=True)
    }
    good = [code for code, reason in reasons.items() if reason is None]
    left_out = [
        {"experiment": experiment, "participant": code, "reason": reason}
        for code, reason in reasons.items()
        if reason is not None
    ]
    return table[table["participant_id"].isin(good)], left_out


def _reason(rows: pd.DataFrame, experiment: str, methods: Sequence[str]) -> str | None:
    """Why a participant is left out; None if nothing is missing."""
    measure, noun = _MEASURES[experiment]
    missing = int(rows[measure].isna().sum())
    if missing:
        return f"{missing} of {len(rows)} {noun}"
    counted = rows[rows["direction"] == "forward"] if experiment == "direction" else rows
    absent = [method for method in methods if method not in set(counted["method"])]
    what = "no forward trials with" if experiment == "direction" else "no rating of"
    return f"{what} {', '.join(absent)}" if absent else None
