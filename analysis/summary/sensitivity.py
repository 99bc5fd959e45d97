"""d′ and criterion of the questions of a design, by the formula of the task."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
import scipy

from analysis.stats.discrimination import Task, discrimination, yes_no
from analysis.summary.question_results import DesignTest
from experiments.design.language import QuestionConfig, TrialConfig

_TASKS: Mapping[str, Task] = {"two-interval": "two-interval", "pair": "two-interval", "abx": "abx", "oddity": "oddity"}
_NOT_BALANCED = "the standard is always in one interval, so a lean to an answer is in the shares of right answers"


def sensitivity(
    trial: TrialConfig,
    question: QuestionConfig,
    scored: pd.DataFrame,
    conditions: Mapping[str, pd.DataFrame],
    factors: Sequence[str],
) -> Iterator[DesignTest]:
    """d′ of all people's answers together, by the formula of the task: of all conditions, and of each.

    Of detection a condition has the false alarms of its own catch trials, and the means of people's own d′ come last:
    where people differ, that of their answers together is another.

    None where the standard has an interval of its own: who leans to an answer is right more or less often by that.

    `conditions`: the rows of each condition, without catch trials, by its name; `factors`: what they differ by.
    """
    if question.correct == "stimulus":
        stimulus = scored["stimulus"].astype(int) == 1
        noise = scored[~stimulus]
        own = {name: (some, _own_catch_trials(noise, some, factors)) for name, some in conditions.items() if len(some)}
        both = {"stimulus": (scored[stimulus], noise), **own}
        for name, (some, catch) in both.items():
            yield from _detection(name, some, catch)
        for name, (some, catch) in both.items():
            yield from _mean_of_people(name, some, catch)
    elif question.correct in {"interval", "larger"} and trial.standard_interval != "random":
        yield DesignTest(name="d_prime", effect=trial.kind, reason=_NOT_BALANCED)
    elif question.correct in {"interval", "larger"} and len(scored):
        for name, some in {trial.kind: scored, **conditions}.items():
            found = discrimination(int(some["score"].sum()), len(some), _TASKS[trial.kind])
            yield DesignTest(name="d_prime", effect=name, statistic=float(found.d_prime))


def _own_catch_trials(noise: pd.DataFrame, condition: pd.DataFrame, factors: Sequence[str]) -> pd.DataFrame:
    """The catch trials whose levels, as that of their session, are all those of the condition; without any, all."""
    columns = [*factors]
    same = (noise[columns] == condition.iloc[0][columns]) | noise[columns].isna()
    return noise[same.all(axis=1)] if same.all(axis=1).any() else noise


def _detection(name: str, signal: pd.DataFrame, noise: pd.DataFrame) -> Iterator[DesignTest]:
    if len(signal) and len(noise):
        hits, rejected = int(signal["score"].sum()), int(noise["score"].sum())
        found = yes_no(hits, len(signal), len(noise) - rejected, len(noise))
        yield DesignTest(name="d_prime", effect=name, statistic=float(found.d_prime))
        yield DesignTest(name="criterion", effect=name, statistic=float(found.criterion))


def _mean_of_people(name: str, signal: pd.DataFrame, noise: pd.DataFrame) -> Iterator[DesignTest]:
    """The mean of the d′ of each person who had stimuli and catch trials, with its interval by Student's t."""
    parts = {"signal": signal, "noise": noise}
    right = {part: some.groupby("participant_id", observed=True)["score"] for part, some in parts.items()}
    people = pd.concat({part: some.agg(["sum", "size"]) for part, some in right.items()}, axis=1, join="inner")
    if len(people) < 2:
        return
    (hits, signals), (rejected, noises) = ((people[part, "sum"], people[part, "size"]) for part in parts)
    own = np.asarray(yes_no(hits, signals, noises - rejected, noises).d_prime)
    half = float(scipy.stats.t.ppf(0.975, len(own) - 1) * own.std(ddof=1) / math.sqrt(len(own)))
    yield DesignTest(
        name="d_prime_mean",
        effect=name,
        statistic=float(own.mean()),
        df=(len(own) - 1,),
        n=len(own) if len(own) < signal["participant_id"].nunique() else None,
        ci_low=float(own.mean()) - half if half else None,
        ci_high=float(own.mean()) + half if half else None,
    )
