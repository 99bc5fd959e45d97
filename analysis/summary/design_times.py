"""Speed and accuracy of a question of any design: its trials as those of experiment 1, and the same measures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd

from analysis.logs.design_logs import DesignLogs
from analysis.summary.conditions import varied
from analysis.summary.results import DesignSummary
from analysis.times.own_trials import INSTRUCTION
from analysis.times.speed_accuracy import NoSpeedAccuracy, SpeedAccuracy, speed_accuracy
from device.words import DIRECTIONS
from experiments.design.config import DesignConfig
from experiments.design.language import shown_level
from experiments.tasks.questions import correct_columns

ALL_TRIALS = "all trials"
"""The one condition of a design in which nothing else varies."""


def timed_designs(
    found: Mapping[str, DesignSummary], logs: Iterable[DesignLogs], *, fits: bool
) -> dict[str, DesignSummary]:
    """The statistics of designs with the measures of speed and accuracy of their questions."""
    return {one.design.design: _timed(found[one.design.design], one, fits=fits) for one in logs}


def _timed(found: DesignSummary, logs: DesignLogs, *, fits: bool) -> DesignSummary:
    timed = {
        name: replace(one, speed_accuracy=question_times(logs.design, name, logs.table, fits=fits))
        for name, one in found.questions.items()
    }
    return replace(found, questions=timed)


def has_times(design: DesignConfig, name: str) -> bool:
    """Whether speed and accuracy of a question are measured: it has two answers of which one is right.

    Not of catch trials, of compared pairs, and where a procedure held the accuracy.
    """
    question = design.questions[name]
    chosen = question.kind == "choice" and question.correct is not None and len(question.answers) == len(DIRECTIONS)
    return chosen and not (design.adapted or design.trial.kind == "pair" or design.trial.catch)


def question_times(
    design: DesignConfig, name: str, table: pd.DataFrame, *, fits: bool
) -> SpeedAccuracy | NoSpeedAccuracy | None:
    """The measures of a question that `has_times`; `None` of any other.

    A condition stands for experiment 1's method: whatever varied but the answer that is right, and the instruction, of
    which each has cells of its own.
    """
    if not has_times(design, name):
        return None
    question = design.questions[name]
    factors = [factor for factor in varied(design) if factor not in (INSTRUCTION, question.correct)]
    correct = pd.to_numeric(table[correct_columns(design.questions)[name]])
    first = (table[name] == question.answers[0]) == (correct == 1)  # where neither was given, nobody looks
    condition, conditions = _conditions(design, factors, table)
    columns = {
        "participant_id": table["participant_id"].astype("category").cat.remove_unused_categories(),
        "method": condition,
        "direction": np.where(first, *DIRECTIONS),
        "correct": correct,
        **{f"response_{part}": table[f"{name}_{part}"] for part in ("time_s", "source")},
        "response_time_valid": table[f"{name}_time_valid"],
        **({INSTRUCTION: _told(design, table)} if INSTRUCTION in table else {}),
    }
    between = [place for place, factor in enumerate(factors) if factor in design.between]
    return speed_accuracy(pd.DataFrame(columns), [*conditions], groups=_groups(conditions, between), fits=fits)


def _told(design: DesignConfig, table: pd.DataFrame) -> pd.Series:
    """What was told before each trial, in the order of the design."""
    return table[INSTRUCTION].astype(pd.CategoricalDtype([*design.factors[INSTRUCTION].all_levels], ordered=True))


def _conditions(
    design: DesignConfig, factors: list[str], table: pd.DataFrame
) -> tuple[pd.Series, dict[str, tuple[str, ...]]]:
    """The condition of each row, and those that occur in the order of the design, each with its parts."""
    levels = [[f"{factor} {shown_level(level)}" for level in design.factors[factor].all_levels] for factor in factors]
    named = {", ".join(parts) or ALL_TRIALS: parts for parts in product(*levels)}
    rows = pd.Series("" if factors else ALL_TRIALS, index=table.index)
    for place, factor in enumerate(factors):
        rows = rows + f"{', ' if place else ''}{factor} " + table[factor].map(shown_level).astype(str)
    found = set(rows.unique())
    return rows.astype("category"), {one: parts for one, parts in named.items() if one in found}


def _groups(conditions: Mapping[str, tuple[str, ...]], between: list[int]) -> list[list[str]]:
    """The conditions that the same people meet: alike in the parts, by their places, that vary between people."""
    found: dict[tuple[str, ...], list[str]] = {}
    for condition, parts in conditions.items():
        found.setdefault(tuple(parts[place] for place in between), []).append(condition)
    return [*found.values()]
