"""Log tables into the statistics of the paper, as plain values ready for `statistics.json`. Nothing is rounded here."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import pandas as pd

from analysis.anova import rm_anova
from analysis.binomial import binomial_test
from analysis.completeness import complete_rows
from analysis.detection import yes_no
from analysis.logs import Logs
from analysis.tukey import rm_tukey_hsd

Json = dict[str, Any]

METHOD_ORDER = ("vibration", "asymmetric-1", "asymmetric-2")
TUKEY_ERROR_TERM = (
    "Tukey's HSD with the pooled error term of the repeated-measures ANOVA (MS_error of participant × method), "
    "on its (n − 1)(k − 1) degrees of freedom; it assumes sphericity."
)
BINOMIAL_NOTE = (
    "Trials are pooled over participants, as in the paper. The test takes them as independent and ignores that trials "
    "come in people; if people differ, its p-values are not exact."
)


def summarize(logs: Logs) -> Json:
    """The statistics of `logs`, in the layout of `statistics.json`: rates 0 to 1, SD with n - 1, JSON-safe.

    An experiment without a log is left out. Participants who miss an answer or a method are left out of that experiment
    and listed in `excluded`. What is not finite becomes None and is named in `warnings`.
    """
    tables = {"direction": (logs.trials, _direction), "preference": (logs.ratings, _preference)}
    excluded: list[dict[str, str]] = []
    result: Json = {}
    for experiment, (table, describe) in tables.items():
        if len(table):
            methods = methods_in(table)
            complete, left_out = complete_rows(table, experiment, methods)
            result[experiment] = describe(complete, methods)
            excluded += left_out
    warnings = [_untested(experiment, found) for experiment, found in result.items() if found["anova"] is None]
    finite = json_safe(result, "", warnings)
    return {**finite, "excluded": excluded, "warnings": warnings, "versions": versions()}


def versions() -> dict[str, str]:
    """What computed the statistics."""
    return {"python": platform.python_version()} | {
        name: _version(name) for name in ("numpy", "scipy", "pandas", "recoil")
    }


def methods_in(table: pd.DataFrame) -> list[str]:
    """The methods of a table: in the paper's order if they are all the paper's, else sorted."""
    found = sorted(str(method) for method in table["method"].unique())
    return [m for m in METHOD_ORDER if m in found] if set(found) <= set(METHOD_ORDER) else found


def json_safe(value: Any, place: str, warnings: list[str]) -> Any:
    """`value` in plain Python types; NaN and infinities become None, and their place is appended to `warnings`."""
    if isinstance(value, Mapping):
        return {str(key): json_safe(item, f"{place}.{key}".lstrip("."), warnings) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_safe(item, f"{place}[{i}]", warnings) for i, item in enumerate(value)]
    if isinstance(value, float | np.floating) and not math.isfinite(value):
        warnings.append(f"{place} is {_not_finite(float(value))}; written as null")
        return None
    return value.item() if isinstance(value, np.generic) else value


def _not_finite(value: float) -> str:
    if math.isnan(value):
        return "undefined (no variance to divide by, or one value only)"
    return "infinite (an effect without any error variance)"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _untested(experiment: str, found: Json) -> str:
    there = f"there are {found['n']} complete participants and {len(found['methods'])} methods"
    return f"{experiment}: no ANOVA and no Tukey test, which need 2 of each; {there}"


def _direction(complete: pd.DataFrame, methods: list[str]) -> Json:
    forward = _rates(complete, "forward", methods)
    backward = _rates(complete, "backward", methods)
    return {
        **_within(forward, methods),
        "origin": _origin(complete, "response_source"),
        "backward": {
            "means": _by_method(backward.mean()),
            "sds": _by_method(backward.std(ddof=1)),
            "participants": _by_participant(backward),
        },
        "binomial": {method: _binomials(complete[complete["method"] == method]) for method in methods},
        "binomial_note": BINOMIAL_NOTE,
        "sensitivity": {method: _sensitivity(complete[complete["method"] == method]) for method in methods},
        "response_time": {method: _response_time(complete[complete["method"] == method]) for method in methods},
    }


def _preference(complete: pd.DataFrame, methods: list[str]) -> Json:
    return {**_within(_table(complete, "rating", methods), methods), "origin": _origin(complete, "rating_by")}


def _origin(complete: pd.DataFrame, source: str) -> Json:
    """Whose hand gave how many of the answers, and which guns rendered how many of the trials."""
    return {kind: complete[column].value_counts().to_dict() for kind, column in (("answers", source), ("guns", "gun"))}


def _rates(trials: pd.DataFrame, direction: str, methods: Sequence[str]) -> pd.DataFrame:
    """Share of correct answers, participants by methods."""
    return _table(trials[trials["direction"] == direction], "correct", methods)


def _table(rows: pd.DataFrame, measure: str, methods: Sequence[str]) -> pd.DataFrame:
    """Means of `measure`, participants (in the order of their codes) by methods."""
    if not len(rows):
        return pd.DataFrame(columns=list(methods), dtype="float64")
    cells = rows.groupby(["participant_id", "method"])[measure].mean().astype("float64")
    return cells.unstack("method").reindex(columns=list(methods))


def _within(scores: pd.DataFrame, methods: list[str]) -> Json:
    return {
        "n": len(scores),
        "methods": methods,
        "means": _by_method(scores.mean()),
        "sds": _by_method(scores.std(ddof=1)),
        "participants": _by_participant(scores),
        **_tests(scores.to_numpy(), methods),
        "tukey_error_term": TUKEY_ERROR_TERM,
    }


def _tests(scores: np.ndarray[Any, Any], methods: list[str]) -> Json:
    if min(scores.shape) < 2:
        return {"anova": None, "tukey": None}
    anova = asdict(rm_anova(scores))
    df = [anova.pop("df_effect"), anova.pop("df_error")]
    named = {"name": "one-way repeated-measures ANOVA", "F": anova.pop("F"), "df": df, **anova}
    return {"anova": named, "tukey": [asdict(comparison) for comparison in rm_tukey_hsd(scores, methods)]}


def _by_method(row: pd.Series) -> dict[str, float]:
    return {str(method): float(value) for method, value in row.items()}


def _by_participant(scores: pd.DataFrame) -> dict[str, dict[str, float]]:
    return {str(code): _by_method(row) for code, row in scores.iterrows()}


def _binomials(trials: pd.DataFrame) -> Json:
    """The test of each direction that was presented; empty without complete participants."""
    result: Json = {}
    for direction in ("forward", "backward"):
        correct = trials.loc[trials["direction"] == direction, "correct"]
        if len(correct):
            successes = int(correct.sum())
            test = asdict(binomial_test(successes, len(correct)))
            result[direction] = {"successes": successes, "trials": len(correct), **test}
    return result


def _sensitivity(trials: pd.DataFrame) -> Json | None:
    """Mean and SD over participants of d' and criterion; None where one direction was never presented."""
    forward, backward = trials[trials["direction"] == "forward"], trials[trials["direction"] == "backward"]
    if not len(forward) or not len(backward):
        return None
    hits = forward.groupby("participant_id")["correct"].agg(["sum", "size"])
    rejections = backward.groupby("participant_id")["correct"].agg(["sum", "size"])
    found = yes_no(
        hits["sum"].to_numpy(dtype=np.float64),
        hits["size"].to_numpy(),
        (rejections["size"] - rejections["sum"]).to_numpy(dtype=np.float64),
        rejections["size"].to_numpy(),
    )
    return {"d_prime": _mean_sd(found.d_prime), "criterion": _mean_sd(found.criterion)}


def _mean_sd(values: float | np.ndarray[Any, Any]) -> dict[str, float]:
    array = np.atleast_1d(values)
    return {"mean": float(array.mean()), "sd": float(array.std(ddof=1)) if array.size > 1 else math.nan}


def _response_time(trials: pd.DataFrame) -> Json:
    """Median over the times that are the participant's own."""
    times = trials.loc[(trials["response_time_valid"] == 1).fillna(False), "response_time_s"].dropna()
    return {"median": float(times.median()) if len(times) else None, "n": len(times)}
