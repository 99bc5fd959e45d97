"""Paired comparison in a design: how often each level was chosen over each other, the scores behind it, and circles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.psychometric.paired import Consistency, PairedScores, circular_triads, paired_scores
from analysis.stats.arrays import FloatArray
from analysis.summary.thresholds import in_design_order
from experiments.design.config import DesignConfig
from experiments.design.language import Level

MOST_ITEMS = 30
"""Of more items a fit takes seconds (assumed that nobody compares so many)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonCircles:
    """One person's circular triads."""

    participant: str
    circles: Consistency


@dataclass(frozen=True, slots=True, kw_only=True)
class PairCondition:
    """One condition of the factors that are not compared: counts, scores by both models, and everybody's circles.

    `wins` (items, items): how often the row was chosen over the column; `ties` likewise, on both sides.
    """

    levels: Mapping[str, Level]
    trials: int
    wins: tuple[tuple[int, ...], ...]
    ties: tuple[tuple[int, ...], ...]
    scores: tuple[PairedScores, ...]
    participants: tuple[PersonCircles, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedComparison:
    """What a question about pairs says of the levels (`items`) of `factor`; no scores for a `reason`."""

    factor: str
    items: tuple[Level, ...]
    people: int
    conditions: tuple[PairCondition, ...] = ()
    reason: str | None = None


def paired_comparison(design: DesignConfig, name: str, table: pd.DataFrame) -> PairedComparison | None:
    """The scores of a question about pairs; `None` of any other. The first answer is the first of the pair.

    A third answer is a tie: neither is chosen.
    """
    question, factor = design.questions[name], design.trial.compare
    if design.trial.kind != "pair" or factor is None or len(question.answers) < 2 or question.when == "block":
        return None
    items = design.factors[factor].all_levels
    rows = table[table[name].notna()]
    if not len(rows):
        return None
    found = PairedComparison(factor=factor, items=items, people=rows["participant_id"].nunique())
    if len(items) > MOST_ITEMS:
        return PairedComparison(factor=factor, items=items, people=found.people, reason=f"more than {MOST_ITEMS} items")
    others = [one for one, of in design.factors.items() if len(of.all_levels) > 1 and one != factor]
    conditions = tuple(
        _condition(levels, items, *_counts(some, name, factor, items, question.answers))
        for levels, some in _by(in_design_order(design, others, rows), others)
    )
    return PairedComparison(factor=factor, items=items, people=found.people, conditions=conditions)


def _by(rows: pd.DataFrame, names: Sequence[str]) -> Iterator[tuple[dict[str, Level], pd.DataFrame]]:
    if not names:
        yield {}, rows
        return
    for levels, some in rows.groupby(list(names), sort=True, observed=True):
        yield dict(zip(names, (one if isinstance(one, str) else float(str(one)) for one in levels), strict=True)), some


def _counts(
    rows: pd.DataFrame, name: str, factor: str, items: Sequence[Level], answers: Sequence[str]
) -> tuple[list[str], FloatArray, FloatArray]:
    """Who answered, and their wins and ties (people, items, items)."""
    people, person = np.unique(rows["participant_id"].astype(str).to_numpy(), return_inverse=True)
    place = {item: at for at, item in enumerate(items)}
    first, second = (rows[f"{factor}_{at}"].map(place).to_numpy(dtype=np.intp) for at in (1, 2))
    wins = np.zeros((len(people), len(items), len(items)))
    ties = np.zeros_like(wins)
    answer = rows[name].astype(str).to_numpy()
    chosen_first, chosen_second = answer == answers[0], answer == answers[1]
    tied = ~(chosen_first | chosen_second)
    np.add.at(wins, (person[chosen_first], first[chosen_first], second[chosen_first]), 1.0)
    np.add.at(wins, (person[chosen_second], second[chosen_second], first[chosen_second]), 1.0)
    for one, other in ((first, second), (second, first)):
        np.add.at(ties, (person[tied], one[tied], other[tied]), 1.0)
    return [str(who) for who in people], wins, ties


def _condition(
    levels: Mapping[str, Level], items: Sequence[Level], people: Sequence[str], wins: FloatArray, ties: FloatArray
) -> PairCondition:
    return PairCondition(
        levels=levels,
        trials=int(wins.sum() + ties.sum() / 2),
        wins=_whole(wins),
        ties=_whole(ties),
        scores=(
            paired_scores(items, wins, ties, model="bradley-terry"),
            paired_scores(items, wins, ties, model="thurstone"),
        ),
        participants=tuple(
            PersonCircles(participant=who, circles=circular_triads(items, own))
            for who, own in zip(people, wins, strict=True)
            if len(items) > 2
        ),
    )


def _whole(counts: FloatArray) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(map(round, row)) for row in counts.sum(axis=0).tolist())
