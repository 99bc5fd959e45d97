"""One table of results an experiment, long and wide, for R, JASP and SPSS: the analysed participants, nothing rounded.

Long: a row a participant and method. Wide: a row a participant, a column a method and measure, as in
`vibration_rate_forward`; names start with a letter, hold letters, digits and underscores only, and have at most 64
characters. RFC 4180, UTF-8; an empty cell is missing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.logs.reading import Logs
from analysis.logs.texts import STUDY
from analysis.summary.results import WithinStatistics
from analysis.times.own_trials import timed

MAX_NAME = 64
_KEYS = [STUDY, "participant_id", "method"]


def result_tables(logs: Logs, analysed: Mapping[str, WithinStatistics]) -> dict[str, bytes]:
    """File names and contents: `direction_long.csv`, `direction_wide.csv`, `preference_long.csv`, ..."""
    files: dict[str, bytes] = {}
    tables = {"direction": (logs.trials, _direction), "preference": (logs.ratings, _preference)}
    for experiment, (table, measure) in tables.items():
        whose = analysed.get(experiment)
        if whose is not None:
            keys = table[_KEYS].astype(str)
            mine = keys["participant_id"].isin(whose.participants.codes)
            long = measure(pd.concat([keys, table.drop(columns=_KEYS)], axis=1)[mine])
            files[f"{experiment}_long.csv"] = _csv(long)
            files[f"{experiment}_wide.csv"] = _csv(_wide(long, whose.methods))
    return files


def _direction(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials, correct answers and rates by direction, and the median of the participant's own response times."""
    own_s = trials["response_time_s"].where(timed(trials).own)
    keyed = trials.assign(correct=trials["correct"].astype("float64"), own_time_s=own_s)
    found: dict[str, pd.Series] = {}
    for direction in ("forward", "backward"):
        rows = keyed[keyed["direction"] == direction].groupby(_KEYS)["correct"]
        found |= {f"trials_{direction}": rows.size(), f"correct_{direction}": rows.sum()}
    table = pd.DataFrame(found, index=keyed.groupby(_KEYS).size().index)
    counts = table.fillna(0).astype("int64")
    for direction in ("forward", "backward"):
        trials_of = counts[f"trials_{direction}"]
        counts[f"rate_{direction}"] = counts[f"correct_{direction}"] / trials_of.where(trials_of > 0)
    counts["response_time_median_s"] = keyed.groupby(_KEYS)["own_time_s"].median()
    return counts.reset_index()


def _preference(ratings: pd.DataFrame) -> pd.DataFrame:
    """Rating and order of presentation."""
    rows = ratings.groupby(_KEYS).agg(rating=("rating", "mean"), order=("trial", "min"))
    return rows.reset_index()


def _wide(long: pd.DataFrame, methods: Sequence[str]) -> pd.DataFrame:
    measures = [name for name in long.columns if name not in _KEYS]
    pairs = [(method, measure) for method in methods for measure in measures]
    names = short_names([f"{method}_{measure}" for method, measure in pairs])
    by_method = {method: rows.set_index(_KEYS[:2]) for method, rows in long.groupby("method")}
    index = long.set_index(_KEYS[:2]).index.unique()
    made = {
        name: by_method[method][measure].reindex(index)
        for name, (method, measure) in zip(names, pairs, strict=True)
        if method in by_method
    }
    return pd.DataFrame(made, index=index).reset_index()


def short_names(names: Iterable[str]) -> list[str]:
    """Names that SPSS takes, each once.

    >>> short_names(["asymmetric-1_rating", "asymmetric 1_rating", "2nd"])
    ['asymmetric_1_rating', 'asymmetric_1_rating_2', 'm_2nd']
    """
    found: list[str] = []
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
        plain = plain if re.match("[A-Za-z]", plain) else f"m_{plain}"
        plain = plain if len(plain) <= MAX_NAME else f"{plain[:24]}_{plain[-(MAX_NAME - 25) :]}"
        taken = {one.lower() for one in found}
        doubles = (plain, *(f"{plain[: MAX_NAME - 5]}_{number}" for number in range(2, len(found) + 3)))
        found.append(next(one for one in doubles if one.lower() not in taken))
    return found


def _csv(table: pd.DataFrame) -> bytes:
    shown = table.copy()
    for name in shown.columns:
        if shown[name].dtype.kind == "f":
            shown[name] = [_number(value) for value in shown[name].to_numpy(dtype=np.float64).tolist()]
    return shown.to_csv(index=False, lineterminator="\r\n").encode("utf-8")


def _number(value: float) -> str:
    """Every digit; whole counts of a wide table without a point."""
    return "" if value != value else repr(value)  # noqa: PLR0124 - NaN
