"""d′ and criterion of the questions of a design, by the formula of the task."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pandas as pd

from analysis.stats.binomial import yes_no
from analysis.stats.discrimination import Task, discrimination
from analysis.summary.question_results import DesignTest
from experiments.design.language import QuestionConfig

_TASKS: Mapping[str, Task] = {"two-interval": "two-interval", "pair": "two-interval", "abx": "abx", "oddity": "oddity"}


def sensitivity(
    kind: str, question: QuestionConfig, scored: pd.DataFrame, conditions: Mapping[str, pd.DataFrame]
) -> Iterator[DesignTest]:
    """d′ of all people's answers together, by the formula of the task: of all conditions, and of each.

    `kind`: of the design's trials. `conditions`: the rows of each condition, without catch trials, by its name.
    """
    if question.correct == "stimulus":
        stimulus = scored["stimulus"].astype(int) == 1
        noise = scored[~stimulus]
        for name, some in {"stimulus": scored[stimulus], **conditions}.items():
            yield from _detection(name, some, noise)
    elif question.correct in {"interval", "larger"} and len(scored):
        for name, some in {kind: scored, **conditions}.items():
            found = discrimination(int(some["score"].sum()), len(some), _TASKS[kind])
            yield DesignTest(name="d_prime", effect=name, statistic=float(found.d_prime))


def _detection(name: str, signal: pd.DataFrame, noise: pd.DataFrame) -> Iterator[DesignTest]:
    if len(signal) and len(noise):
        hits, rejected = int(signal["score"].sum()), int(noise["score"].sum())
        found = yes_no(hits, len(signal), len(noise) - rejected, len(noise))
        yield DesignTest(name="d_prime", effect=name, statistic=float(found.d_prime))
        yield DesignTest(name="criterion", effect=name, statistic=float(found.criterion))
