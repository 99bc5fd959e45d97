"""What nobody should hand over, to each argument of each public function: the declared error names the argument."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import analysis
import recoil

SCORES = [[1.0, 2.0, 3.5], [2.0, 3.0, 3.0], [1.5, 2.5, 4.0], [2.0, 2.0, 5.0]]
GROUPS = [[1.0, 2.0, 3.0], [2.0, 3.0, 4.5], [3.0, 4.0, 6.0]]
LONG = pd.DataFrame({"who": list("aabb"), "method": list("xyxy"), "score": [1.0, 2.0, 3.0, 4.5]})
ONE_NUMBER: dict[str, Any] = {"successes": 5, "trials": 10, "p0": 0.5, "alternative": "less"}
PAIRS: dict[str, Any] = {"scores": SCORES, "labels": ["a", "b", "c"], "confidence": 0.9}
BOUNDS: dict[str, Any] = {"low": -1.0, "high": 3.0, "alpha": 0.05}
TRIALS: dict[str, Any] = {"people": list("aabbcc"), "predictors": {"x": [0, 1, 0, 1, 0, 1]}, "confidence": 0.95}
WINS = [[0, 7, 9], [3, 0, 6], [1, 4, 0]]
RANGE: dict[str, Any] = {"k": 3, "df": 10}
GUN = recoil.GunParameters()

STATISTICS: Mapping[str, Mapping[str, Any]] = {
    "benjamini_hochberg": {"p": [0.1, 0.2]},
    "binomial_test": ONE_NUMBER | {"confidence": 0.9},
    "binomial_test_log_p": ONE_NUMBER,
    "binomial_test_p": ONE_NUMBER,
    "circular_triads": {"items": ["a", "b", "c"], "wins": WINS},
    "clustering": {"successes": [3, 4, 5], "trials": [10, 10, 10], "p0": 0.5},
    "cohens_f": {"eta_squared": 0.1},
    "cousineau_morey": {"scores": SCORES, "confidence": 0.95},
    "discrimination": {"right": 8, "trials": 10, "task": "abx"},
    "effect_size": {"anova": analysis.rm_anova(SCORES)},
    "factorial_anova": {"scores": SCORES, "names": ["age", "method"], "group": list("aabb")},
    "friedman": {"scores": SCORES},
    "groups_of": {"table": LONG, "group": "method", "score": "score"},
    "holm": {"p": [0.1, 0.2]},
    "indicators": {"levels": ["a", "b", "c"], "reference": "a"},
    "jzs_paired": {"t": 2.0, "n": 10, "r": 0.7},
    "linear_mixed_model": TRIALS | {"values": [1.0, 2.0, 2.5, 3.0, 2.0, 4.0]},
    "logit_model": {"successes": [[3, 4], [5, 6]], "trials": [[9, 9], [9, 9]], "labels": ["a", "b"], "confidence": 0.9},
    "normality": {"scores": SCORES},
    "one_way_anova": {"groups": GROUPS},
    "one_way_anova_power": {"f": 0.3, "sizes": [10, 10], "alpha": 0.05},
    "one_way_bayes_factor": {"groups": GROUPS, "fixed_scale": 0.5},
    "outliers": {"scores": SCORES, "reach": 1.5},
    "paired_scores": {
        "items": ["a", "b", "c"],
        "wins": WINS,
        "ties": [[0, 1, 0], [1, 0, 2], [0, 2, 0]],
        "model": "thurstone",
        "confidence": 0.9,
    },
    "paired_t_tests": PAIRS,
    "planned_contrasts": {"scores": SCORES, "weights": {"w": [1, 0, -1]}, "correction": "holm", "confidence": 0.95},
    "pooled_group": {"draws": [[1.0, 2.0, 2.5], [1.5, 2.0, 3.0]], "confidence": 0.9},
    "psychometric_fit": {
        "levels": [1.0, 2.0, 3.0],
        "right": [3, 6, 9],
        "trials": [10, 10, 10],
        "guess": 0.25,
        "lapse": 0.02,
        "catch": (2, 10),
        "overdispersed": False,
        "shape": "logistic",
        "log": False,
        "falling": False,
        "span": (1.0, 3.0),
        "priors": None,
        "confidence": 0.9,
    },
    "random_intercept_logit": TRIALS | {"right": [0, 1, 1, 1, 0, 0], "nodes": 9},
    "rm_anova": {"scores": SCORES},
    "rm_anova_bayes_factor": {"scores": SCORES, "fixed_scale": 0.5, "random_scale": 1.0},
    "rm_anova_power": {"f": 0.3, "participants": 9, "conditions": 3, "correlation": 0.5, "epsilon": 0.9, "alpha": 0.05},
    "rm_tukey_hsd": PAIRS,
    "rm_tukey_hsd_paired": PAIRS,
    "signed_rank_tests": {"scores": SCORES, "labels": ["a", "b", "c"]},
    "sphericity": {"scores": SCORES},
    "studentized_range_isf": RANGE | {"p": 0.05},
    "studentized_range_logsf": RANGE | {"q": 3.0},
    "studentized_range_sf": RANGE | {"q": 3.0},
    "tost_one_sample": BOUNDS | {"values": [1.0, 2.0, 3.0]},
    "tost_paired": BOUNDS | {"a": [1.0, 2.0, 3.0], "b": [1.0, 2.5, 3.0]},
    "tost_two_samples": BOUNDS | {"a": [1.0, 2.0, 3.0], "b": [1.0, 2.5, 3.0], "equal_variances": True},
    "tukey_hsd": {"groups": GROUPS, "labels": ["a", "b", "c"], "confidence": 0.95},
    "wide": {"table": LONG, "participant": "who", "condition": "method", "score": "score"},
    "yes_no": {"hits": 5, "signal_trials": 10, "false_alarms": 3, "noise_trials": 10},
}
OF_NOTEBOOKS: Mapping[str, Mapping[str, Any]] = {
    "GunParameters": {name: getattr(GUN, name) for name in type(GUN).__match_args__},
    "analyze": {"columns": None, "include_synthetic": False, "requests": None, "fits": False},
    "audit": {"paper": "paper"},
    "load_config": {"name": "preference"},
    "plan": {"setup": None, "participant": "P01", "seed": 1, "order_row": None},
    "power": {
        "config": "preference",
        "participants": 5,
        "trials": (),
        "effects": (),
        "methods": (),
        "studies": 5,
        "target": 0.8,
        "seed": 1,
    },
    "read_logs": {"columns": None, "include_synthetic": False},
    "run_synthetic": {"setup": None, "participants": ["P01"], "results": "results", "seed": 1},
    "simulate": {"parameters": GUN, "fidelity": "full"},
}

NOBODY_MEANS: Mapping[str, Callable[[], Any]] = {
    "NaN": lambda: float("nan"),
    "minus infinity": lambda: -float("inf"),
    "a text": lambda: "x" * 1_000,
    "a null": lambda: "a\0b",
    "None": lambda: None,
    "a set": lambda: {1, 2},
    "a mapping of numbers": lambda: {"a": 1},
    "a generator": lambda: (number for number in (1.0, 2.0)),
    "a decimal that is none": lambda: Decimal("sNaN"),
    "pandas' NA": lambda: pd.NA,
    "pandas' NaT": lambda: pd.NaT,
    "an object": object,
    "a function": lambda: len,
    "a complex number": lambda: 1j,
    "bytes": lambda: b"x",
    "Nones": lambda: [None] * 3,
    "sets": lambda: [{1}, {2}, {3}],
    "a column with NA": lambda: pd.Series([1, None, 2], dtype="Int64"),
    "a number beyond all doubles": lambda: 10**400,
}
"""No argument of a statistic can be one of these, but for those in `TAKEN`."""
MISSHAPEN: Mapping[str, Callable[[], Any]] = {
    "empty": list,
    "an empty mapping": dict,
    "an empty table": pd.DataFrame,
    "a cube": lambda: np.zeros((2, 2, 2)),
    "ragged": lambda: [[1.0], [1.0, 2.0]],
    "another length": lambda: (1.0, 2.0),
    "negative": lambda: -1,
    "zero": lambda: 0,
    "a half": lambda: Fraction(1, 2),
    "huge": lambda: 1e308,
    "true": lambda: True,
    "dates": lambda: pd.Series(pd.to_datetime(["2020-01-01", "2020-01-02"])),
}
"""What some arguments may be, and others not; where two do not fit together, one of them is named."""
TAKEN = {
    "labels": {"None"},
    "reference": {"None"},
    "group": {"None"},
    "guess": {"None"},
    "lapse": {"None"},
    "priors": {"None"},
    "span": {"None"},
    "ties": {"None"},
    "q": {"NaN", "minus infinity", "a column with NA"},
    "p of studentized_range_isf": {"NaN"},
}


def said_of(call: Callable[..., object], arguments: Mapping[str, Any]) -> str | None:
    """The declared error, if there is one."""
    try:
        call(**arguments)
    except (ValueError, recoil.RecoilError) as error:
        return str(error)
    return None


def test_no_statistic_is_forgotten() -> None:
    functions = [name for name in analysis.__all__ if inspect.isfunction(getattr(analysis, name))]
    assert sorted(STATISTICS) == functions
    for name, arguments in STATISTICS.items():
        assert set(arguments) == set(inspect.signature(getattr(analysis, name)).parameters)


@pytest.mark.slow
@pytest.mark.parametrize("name", STATISTICS)
def test_what_no_statistic_takes_is_refused_by_the_name_of_its_argument(name: str) -> None:
    for argument in STATISTICS[name]:
        taken = TAKEN.get(argument, set()) | TAKEN.get(f"{argument} of {name}", set())
        for what in NOBODY_MEANS.keys() - taken:
            said = said_of(getattr(analysis, name), {**STATISTICS[name], argument: NOBODY_MEANS[what]()})
            assert re.search(rf"\b{argument}\b", said or "it was taken"), f"{argument} is {what}: {said}"
            assert len(said or "") < 500, f"{argument} is {what}"


@pytest.mark.slow
@pytest.mark.parametrize("name", STATISTICS)
def test_what_a_statistic_takes_or_not_is_no_other_error(name: str) -> None:
    any_argument = re.compile(rf"\b({'|'.join(STATISTICS[name])})\b")
    for argument in STATISTICS[name]:
        for what, value in MISSHAPEN.items():
            said = said_of(getattr(analysis, name), {**STATISTICS[name], argument: value()})
            assert said is None or any_argument.search(said), f"{argument} is {what}: {said}"


NUMBERS = frozenset({"a set", "a generator"})
TAKEN_BY_NOTEBOOKS: Mapping[str, frozenset[str]] = {
    **dict.fromkeys(("columns", "requests", "order_row", "seed", "studies", "return_friction_N"), frozenset({"None"})),
    **dict.fromkeys(("participants", "trials"), NUMBERS),
    "effects": NUMBERS,
    "results": frozenset({"a text"}),
}


def refused(function: Callable[..., object], positional: tuple[str, ...], arguments: Mapping[str, Any]) -> str:
    declared = (ValueError, recoil.RecoilError, *((TypeError,) if function is recoil.simulate else ()))
    with pytest.raises(declared) as error:
        function(*positional, **arguments)
    return str(error.value)


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_NOTEBOOKS)
def test_what_no_function_of_a_notebook_takes_is_refused_by_the_name_of_its_argument(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    given = dict(OF_NOTEBOOKS[name])
    if "setup" in given:
        given["setup"] = recoil.load_config("preference")
    positional = ("results",) if name in {"analyze", "read_logs"} else ()
    for argument in given:
        for what in NOBODY_MEANS.keys() - TAKEN_BY_NOTEBOOKS.get(argument, frozenset()):
            said = refused(getattr(recoil, name), positional, {**given, argument: NOBODY_MEANS[what]()})
            assert re.search(rf"\b{argument}\b", said), f"{argument} is {what}: {said}"
    assert list(tmp_path.iterdir()) == []
