"""Whose data an experiment can use: participants with every answer under every method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

_MEASURES = {"direction": ("correct", "trials unanswered"), "preference": ("rating", "ratings missing")}


def complete_rows(
    table: pd.DataFrame, experiment: str, methods: Sequence[str]
) -> tuple[pd.DataFrame, list[dict[str, str]]]:
    """The rows of the participants who answered everything, and the others: experiment, participant, reason.

    Every method must be there; for direction with forward trials, because these are what the measure counts.
    """
    reasons = _reasons(table, experiment, methods)
    left_out = [
        {"experiment": experiment, "participant": code, "reason": reason} for code, reason in sorted(reasons.items())
    ]
    return (rows_without(table, reasons) if reasons else table), left_out


def rows_without(table: pd.DataFrame, participants: Iterable[str]) -> pd.DataFrame:
    """The rows of all other participants; categories that no longer occur are gone."""
    kept = table[~table["participant_id"].isin(list(participants))]
    return tidied(kept)


def tidied(table: pd.DataFrame) -> pd.DataFrame:
    """The table without categories that do not occur in it: so that none is counted."""
    categories = [name for name in table.columns if isinstance(table[name].dtype, pd.CategoricalDtype)]
    return table.assign(**{name: table[name].cat.remove_unused_categories() for name in categories})


def _reasons(table: pd.DataFrame, experiment: str, methods: Sequence[str]) -> dict[str, str]:
    """Why participants are left out, by code."""
    measure, noun = _MEASURES[experiment]
    people = table.groupby("participant_id", sort=True, observed=True)[measure]
    rows, missing = people.size(), people.size() - people.count()
    lacking = {str(code): f"{missing[code]} of {rows[code]} {noun}" for code in missing.index[missing > 0]}
    counted = table[table["direction"] == "forward"] if experiment == "direction" else table
    seen = counted.groupby(["participant_id", "method"], observed=True).size().unstack("method")
    seen = seen.reindex(index=rows.index, columns=list(methods)).fillna(0)
    what = "no forward trials with" if experiment == "direction" else "no rating of"
    absent = {
        str(code): f"{what} {', '.join(method for method in methods if not seen.loc[code, method])}"
        for code in seen.index[(seen == 0).any(axis=1)]
    }
    return absent | lacking
