"""Tables of results for R, JASP and SPSS: the participants' own scores, nothing rounded.

Of the paper's two experiments long and wide, of other designs long, with everyone in them. Long: a row a participant
and condition. Wide: a row a participant, a column a method and measure, as in
`vibration_rate_forward`; names start with a letter, hold letters, digits and underscores only, and have at most 64
characters. RFC 4180, UTF-8; an empty cell is missing; a text that a spreadsheet takes for a formula has a `'` in front.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import get_args

import numpy as np
import pandas as pd

from analysis.logs.design_logs import DesignLogs
from analysis.logs.kinds import folder_of
from analysis.logs.reading import Logs
from analysis.logs.texts import STUDY
from analysis.summary.conditions import answer_scores, varied
from analysis.summary.results import WithinStatistics
from analysis.times.own_trials import timed
from experiments.design.language import QuestionConfig
from experiments.record.tables import DataKind, guard, is_rated
from experiments.tasks.questions import correct_columns

MAX_NAME = 64
_KEYS = [STUDY, "participant_id", "method"]


_TABLES = ("*_long.csv", "*_wide.csv")
TABLE_FILES = (*_TABLES, *(f"{folder_of(kind)}/{name}" for kind in get_args(DataKind) for name in _TABLES))
"""What the files of tables are called, those of data that are kept apart too."""


def table_names(logs: Logs, analysed: Mapping[str, WithinStatistics]) -> tuple[str, ...]:
    """What the tables of results are called, in their order."""
    within = (f"{name}_{shape}.csv" for name in logs.tables if name in analysed for shape in ("long", "wide"))
    return (*within, *(f"{one.design.design}_long.csv" for one in logs.designs))


def result_tables(logs: Logs, analysed: Mapping[str, WithinStatistics]) -> dict[str, bytes]:
    """File names and contents: `direction_long.csv`, `direction_wide.csv`, `preference_long.csv`, ..."""
    files: dict[str, bytes] = {}
    for experiment, table in logs.tables.items():
        whose = analysed.get(experiment)
        if whose is not None:
            mine = table["participant_id"].isin(whose.participants.codes)
            long = _scores(experiment, table[mine]).astype(dict.fromkeys(_KEYS, str))
            files[f"{experiment}_long.csv"] = _csv(long)
            files[f"{experiment}_wide.csv"] = _csv(_wide(long, whose.methods))
    return files | {f"{one.design.design}_long.csv": _csv(_of_design(one)) for one in logs.designs}


def _of_design(logs: DesignLogs) -> pd.DataFrame:
    """What each participant answered to each question in each condition; catch trials, which have no level, as well."""
    keys = [STUDY, "participant_id", *varied(logs.design)]
    scored = correct_columns(logs.design.questions)
    measured: dict[str, tuple[pd.Series, str]] = {}
    for name, question in logs.design.questions.items():
        measured |= _measures(logs.table, name, question, scored.get(name))
    rows = logs.table[keys].assign(**{name: values for name, (values, _) in measured.items()})
    by = rows.groupby(keys, dropna=False)
    found = by.agg(**{name: (name, how) for name, (_, how) in measured.items()})
    found.insert(0, "trials", by.size())
    table = found.reset_index()
    return table.set_axis(short_names(table.columns), axis=1)


def _measures(
    table: pd.DataFrame, name: str, question: QuestionConfig, correct: str | None
) -> dict[str, tuple[pd.Series, str]]:
    """The measures of a question by name: a value a trial, and how those of a condition become one."""
    if question.kind == "text":
        return {}
    found: dict[str, tuple[pd.Series, str]] = {f"{name}_answers": (table[name].notna(), "sum")}
    if correct is not None:
        right = pd.to_numeric(table[correct])
        found |= {f"{name}_right": (right, "sum"), f"{name}_rate": (right, "mean")}
    elif question.named_answers:
        found |= {f"{name}_{one}": (table[name] == one, "sum") for one in question.named_answers}
    else:
        score = pd.Series(answer_scores(question, table[name]), index=table.index)
        found[f"{name}_log_mean" if question.kind == "number" else f"{name}_mean"] = (score, "mean")
    if question.named_answers:
        times_s = pd.to_numeric(table[f"{name}_time_s"]).where(pd.to_numeric(table[f"{name}_time_valid"]) == 1)
        found[f"{name}_time_median_s"] = (times_s, "median")
    return found


def _scores(experiment: str, rows: pd.DataFrame) -> pd.DataFrame:
    """What each participant answered with each method."""
    return _ratings(rows) if is_rated(experiment) else _answers(rows)


def _answers(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials, correct answers and rates by direction, and the median of the participant's own response times."""
    own_s = trials["response_time_s"].where(timed(trials).own)
    keyed = trials.assign(correct=trials["correct"].astype("float64"), own_time_s=own_s)
    found: dict[str, pd.Series] = {}
    for direction in ("forward", "backward"):
        rows = keyed[keyed["direction"] == direction].groupby(_KEYS, observed=True)["correct"]
        found |= {f"trials_{direction}": rows.size(), f"correct_{direction}": rows.sum()}
    table = pd.DataFrame(found, index=keyed.groupby(_KEYS, observed=True).size().index)
    counts = table.fillna(0).astype("int64")
    for direction in ("forward", "backward"):
        trials_of = counts[f"trials_{direction}"]
        counts[f"rate_{direction}"] = counts[f"correct_{direction}"] / trials_of.where(trials_of > 0)
    counts["response_time_median_s"] = keyed.groupby(_KEYS, observed=True)["own_time_s"].median()
    return counts.reset_index()


def _ratings(ratings: pd.DataFrame) -> pd.DataFrame:
    """Rating and order of presentation."""
    rows = ratings.groupby(_KEYS, observed=True).agg(rating=("rating", "mean"), order=("trial", "min"))
    return rows.reset_index()


def _wide(long: pd.DataFrame, methods: Sequence[str]) -> pd.DataFrame:
    measures = [name for name in long.columns if name not in _KEYS]
    pairs = [(method, measure) for method in methods for measure in measures]
    names = short_names([f"{method}_{measure}" for method, measure in pairs])
    index = long.set_index(_KEYS[:2]).index.unique()
    by_method = {method: rows.set_index(_KEYS[:2]).reindex(index) for method, rows in long.groupby("method")}
    made = {
        name: by_method[method][measure]
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
        elif shown[name].dtype.kind == "O" or name in _KEYS:
            cells = shown[name].astype(object)
            shown[name] = [guard(str(cell)) if isinstance(cell, str) else cell for cell in cells]
    return shown.to_csv(index=False, lineterminator="\r\n").encode("utf-8")


def _number(value: float) -> str:
    """Every digit; whole counts of a wide table without a point."""
    return "" if value != value else repr(value)  # noqa: PLR0124 - NaN
