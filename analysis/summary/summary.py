"""Log tables into the statistics of the paper, as plain values ready for `statistics.json`. Nothing is rounded here."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import pandas as pd

from analysis.logs.exclusions import complete_rows
from analysis.logs.reading import Logs
from analysis.report.serial import plain
from analysis.stats.anova import rm_anova
from analysis.stats.assumptions import assumptions
from analysis.stats.binomial import binomial_test
from analysis.stats.cells import DIRECTIONS, Finite, TrialCells, by_name, coded, trial_cells
from analysis.stats.detection import yes_no
from analysis.stats.effect_sizes import cousineau_morey
from analysis.stats.logit_model import METHOD as CLUSTERING_NOTE
from analysis.stats.supplement import model, pooled_clustering, within_supplement
from analysis.stats.tukey import rm_tukey_hsd
from analysis.times.own_trials import INSTRUCTION, timed
from analysis.times.response_times import response_times
from analysis.times.speed_accuracy import speed_accuracy

Json = dict[str, Any]

SCALES = {"direction": (0.0, 1.0), "preference": (0.0, 10.0)}
"""The least and the most that a score can be."""
METHOD_ORDER = ("vibration", "asymmetric-1", "asymmetric-2")
TUKEY_ERROR_TERM = (
    "Tukey's HSD with the pooled error term of the repeated-measures ANOVA (MS_error of participant × method), "
    "on its (n − 1)(k − 1) degrees of freedom; it assumes sphericity."
)
BINOMIAL_NOTE = (
    "Trials are pooled over participants, as in the paper. The test takes them as independent and ignores that trials "
    "come in people; if people differ, its p-values are not exact."
)


def summarize(logs: Logs, *, trade: bool = True) -> Json:
    """The statistics of `logs`, in the layout of `statistics.json`: rates 0 to 1, SD with n - 1, JSON-safe.

    `trade`: with the measures of speed and accuracy. An experiment without a log is left out. Participants who miss an
    answer or a method are left out of that experiment and listed in `excluded`. What is not finite becomes None and is
    named in `warnings`.
    """
    tables = {"direction": (logs.trials, _direction), "preference": (logs.ratings, _preference)}
    excluded: list[dict[str, str]] = []
    result: Json = {}
    for experiment, (table, describe) in tables.items():
        if len(table):
            methods = methods_in(table)
            complete, left_out = complete_rows(_coded(table), experiment, methods)
            result[experiment] = _with_assumptions(describe(complete, methods))
            if trade and experiment == "direction":
                result[experiment]["speed_accuracy"] = plain(speed_accuracy(complete, methods))
            excluded += plain(left_out)
    warnings = [warning for experiment, found in result.items() for warning in _warnings(experiment, found)]
    finite = json_safe(result, "", warnings)
    return {**finite, "excluded": excluded, "warnings": warnings, "versions": versions()}


def _coded(table: pd.DataFrame) -> pd.DataFrame:
    """The coded table, with the instructions if the table has them."""
    found = coded(table)
    if INSTRUCTION in table:
        found[INSTRUCTION] = table[INSTRUCTION]
    return found


def versions() -> dict[str, str]:
    """What computed the statistics."""
    return {"python": platform.python_version()} | {
        name: _version(name) for name in ("numpy", "scipy", "pandas", "pingouin", "recoil")
    }


def methods_in(table: pd.DataFrame) -> list[str]:
    """The methods of a table: in the paper's order if they are all the paper's, else sorted."""
    found = sorted(str(method) for method in table["method"].unique())
    return [m for m in METHOD_ORDER if m in found] if set(found) <= set(METHOD_ORDER) else found


def json_safe(value: Any, place: str, warnings: list[str]) -> Any:
    """`value` in plain Python types; NaN and infinities become None, and their place is appended to `warnings`."""
    if isinstance(value, Finite):
        return value
    if isinstance(value, dict):
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


def _with_assumptions(found: Json) -> Json:
    return {**found, "assumptions": [asdict(assumption) for assumption in assumptions(found)]}


def _warnings(experiment: str, found: Json) -> list[str]:
    """Why there is no test, or the violated assumptions that change which number to read."""
    if found["anova"] is None:
        there = f"there are {found['n']} complete participants and {len(found['methods'])} methods"
        return [f"{experiment}: no ANOVA and no Tukey test, which need 2 of each; {there}"]
    return [f"{experiment}: {entry['warning']}" for entry in found["assumptions"] if entry["serious"]]


def _direction(complete: pd.DataFrame, methods: list[str]) -> Json:
    cells = trial_cells(complete, methods)
    forward, backward = cells.rates("forward"), cells.rates("backward")
    return {
        **_within(forward, methods, SCALES["direction"]),
        "origin": _origin(complete, "response_source"),
        "backward": {
            "means": _by_method(backward.mean()),
            "sds": _by_method(backward.std(ddof=1)),
            "participants": _by_participant(backward),
        },
        "binomial": {method: _binomials(cells, method) for method in methods},
        "binomial_note": BINOMIAL_NOTE,
        "clustering_note": CLUSTERING_NOTE,
        "model": model(cells),
        "sensitivity": {method: _sensitivity(cells, method) for method in methods},
        "response_time": _median_times(complete, methods),
        "response_times": plain(response_times(complete, methods)),
    }


def _preference(complete: pd.DataFrame, methods: list[str]) -> Json:
    scores = _table(complete, "rating", methods)
    return {**_within(scores, methods, SCALES["preference"]), "origin": _origin(complete, "rating_by")}


def _origin(complete: pd.DataFrame, source: str) -> Json:
    """Whose hand gave how many of the answers, and which guns rendered how many of the trials."""
    return {kind: complete[column].value_counts().to_dict() for kind, column in (("answers", source), ("guns", "gun"))}


def _table(rows: pd.DataFrame, measure: str, methods: Sequence[str]) -> pd.DataFrame:
    """Means of `measure`, participants (in the order of their codes) by methods."""
    if not len(rows):
        return pd.DataFrame(columns=list(methods), dtype="float64")
    cells = rows.groupby(["participant_id", "method"], observed=True)[measure].mean().astype("float64")
    return cells.unstack("method").reindex(columns=list(methods))


def _within(scores: pd.DataFrame, methods: list[str], scale: tuple[float, float]) -> Json:
    return {
        "n": len(scores),
        "methods": methods,
        "means": _by_method(scores.mean()),
        "sds": _by_method(scores.std(ddof=1)),
        "participants": _by_participant(scores),
        "within_ci": _within_ci(scores),
        **_tests(scores.to_numpy(), methods),
        "tukey_error_term": TUKEY_ERROR_TERM,
        **within_supplement(scores, scale),
    }


def _within_ci(scores: pd.DataFrame) -> Json | None:
    """Cousineau-Morey intervals of the means, None for fewer than 2 participants or methods."""
    if min(scores.shape) < 2:
        return None
    found = cousineau_morey(scores.to_numpy())
    rows = zip(scores.columns, found.ci_low, found.ci_high, strict=True)
    return {str(method): {"ci_low": float(low), "ci_high": float(high)} for method, low, high in rows}


def _tests(scores: np.ndarray[Any, Any], methods: list[str]) -> Json:
    if min(scores.shape) < 2:
        return {"anova": None, "tukey": None}
    anova = asdict(rm_anova(scores))
    df = [anova.pop("df_effect"), anova.pop("df_error")]
    named = {"name": "one-way repeated-measures ANOVA", "F": anova.pop("F"), "df": df, **anova}
    return {"anova": named, "tukey": [asdict(comparison) for comparison in rm_tukey_hsd(scores, methods)]}


def _by_method(row: pd.Series) -> dict[str, float]:
    return {str(method): float(value) for method, value in row.items()}


def _by_participant(scores: pd.DataFrame) -> Json:
    codes, names = map(str, scores.index), [str(method) for method in scores.columns]
    return by_name(list(codes), names, scores.to_numpy(dtype="float64"))


def _binomials(cells: TrialCells, method: str) -> Json:
    """The test of each direction that was presented; empty without complete participants."""
    result: Json = {}
    for place, direction in enumerate(DIRECTIONS):
        column = cells.methods.index(method), place
        successes, trials = int(cells.correct[:, *column].sum()), int(cells.trials[:, *column].sum())
        if trials:
            test = asdict(binomial_test(successes, trials))
            clustered = pooled_clustering(cells, method, direction)
            result[direction] = {"successes": successes, "trials": trials, **test, "clustering": clustered}
    return result


def _sensitivity(cells: TrialCells, method: str) -> Json | None:
    """Mean and SD over participants of d' and criterion; None where nobody was presented with both directions."""
    column = cells.methods.index(method)
    both = np.flatnonzero(cells.trials[:, column].min(axis=1, initial=np.inf))
    if not both.size:
        return None
    (hits, rejections), (signals, noises) = cells.correct[both, column].T, cells.trials[both, column].T
    found = yes_no(hits, signals, noises - rejections, noises)
    measures = {"d_prime": np.atleast_1d(found.d_prime), "criterion": np.atleast_1d(found.criterion)}
    people = [cells.participants[i] for i in both]
    return {
        **{name: _mean_sd(values) for name, values in measures.items()},
        "participants": by_name(people, list(measures), np.column_stack(list(measures.values()))),
    }


def _mean_sd(values: float | np.ndarray[Any, Any]) -> dict[str, float]:
    array = np.atleast_1d(values)
    return {"mean": float(array.mean()), "sd": float(array.std(ddof=1)) if array.size > 1 else math.nan}


def _median_times(trials: pd.DataFrame, methods: list[str]) -> Json:
    """Median over the times that are the participant's own, by method."""
    valid = timed(trials).own
    times = {method: trials["response_time_s"][valid & (trials["method"] == method)] for method in methods}
    return {
        method: {"median": float(own.median()) if len(own) else None, "n": len(own)} for method, own in times.items()
    }
