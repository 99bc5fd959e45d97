"""Whose data an experiment can use: participants with every answer under every method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from analysis.logs.frames import STUDY
from analysis.logs.reading import Logs
from analysis.stats.cells import codes_of, places_among

_MEASURES = {"direction": ("correct", "trials unanswered"), "preference": ("rating", "ratings missing")}


def complete_rows(
    table: pd.DataFrame, experiment: str, methods: Sequence[str]
) -> tuple[pd.DataFrame, list[dict[str, str]]]:
    """The rows of the participants who answered everything, and the others: experiment, participant, reason.

    Every method must be there; for direction with forward trials, because these are what the measure counts. `table` is
    coded.
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
    codes = table["participant_id"].cat.categories.tolist()
    person, method = codes_of(table["participant_id"]), places_among(table["method"], methods)
    rows = np.bincount(person, minlength=len(codes))
    missing = np.bincount(person[table[measure].isna()], minlength=len(codes))
    lacking = {codes[i]: f"{missing[i]} of {rows[i]} {noun}" for i in np.flatnonzero(missing)}
    counted = np.asarray(table["direction"] == "forward") if experiment == "direction" else slice(None)
    seen = np.zeros((len(codes), len(methods)), dtype=np.bool_)
    seen[person[counted], method[counted]] = True
    what = "no forward trials with" if experiment == "direction" else "no rating of"
    absent = {
        codes[i]: f"{what} {', '.join(name for name, there in zip(methods, seen[i], strict=True) if not there)}"
        for i in np.flatnonzero(~seen.all(axis=1))
    }
    return absent | lacking


def by_study(logs: Logs) -> dict[str, Logs]:
    """The logs of each study with plain codes, by the study's name; nothing if there is one study only."""
    names = sorted({str(name) for table in (logs.trials, logs.ratings) for name in table[STUDY].unique()})
    if len(names) < 2:
        return {}
    return {name: replace(logs, trials=_alone(logs.trials, name), ratings=_alone(logs.ratings, name)) for name in names}


def _alone(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = tidied(table[table[STUDY] == study]).reset_index(drop=True)
    codes = rows["participant_id"].cat.rename_categories(lambda code: str(code).removeprefix(f"{study}/"))
    return rows.assign(participant_id=codes)
