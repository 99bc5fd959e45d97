"""The psychometric functions of a design: which answers tell of them, whose they are, and what differs.

Of a question with right answers the share of these is fitted over the levels of a numeric factor, with chance as the
guess rate; of yes or no the share of yes, the guess rate with it; of a comparison with a standard how often the level
was chosen, whose threshold is the point of subjective equality. Other factors make conditions.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from analysis.psychometric.people import (
    GroupFit,
    PersonFit,
    ShareAtLevel,
    ThresholdDifference,
    person_fit,
    threshold_difference,
    with_group,
)
from analysis.psychometric.priors import ListedPrior, Priors, default_priors
from analysis.report.serial import UNWRITTEN, beside
from analysis.stats.arrays import FloatArray
from analysis.summary.tracks import TrackAnswers, tracks_in
from experiments.design.config import DesignConfig
from experiments.design.language import (
    INTERVAL_NAMES,
    YES,
    Level,
    QuestionConfig,
    StandardInterval,
    shown_level,
)
from experiments.design.procedures.config import PosteriorConfig
from experiments.record.tables import AT_EDGE
from experiments.tasks.questions import chance, correct_columns

if TYPE_CHECKING:
    import pandas as pd

MOST_FITTED, MOST_FITS = 40, 60
"""So many people, and functions, are fitted unless all are asked for: a function takes 10 to 40 ms."""
MOST_COMPARED = 10
"""Of more conditions the pairs fill pages that nobody reads."""
_FALLS = -3.0
"""In so many standard errors: the share is taken to fall with the level."""

FittedShare = Literal["right", "yes", "chosen"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionFit:
    """One condition: everybody's trials together, the people who were fitted, and the group behind them."""

    levels: Mapping[str, Level]
    points: tuple[ShareAtLevel, ...]
    people: tuple[PersonFit, ...]
    group: GroupFit | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionDifference:
    """The threshold in condition `a` less that in `b`."""

    a: Mapping[str, Level]
    b: Mapping[str, Level]
    threshold: ThresholdDifference = field(metadata=beside(ThresholdDifference))


@dataclass(frozen=True, slots=True, kw_only=True)
class Thresholds:
    """The psychometric functions of one question over `factor`; none with a `reason`.

    `share`: of what, right answers, yes, or the level chosen over the standard. `standard`: what levels were compared
    with, in `standard_interval` if that was always the same. `guess`: chance where the design knows it. Of the
    `people` so many were `fitted`. `even`: trials whose two intervals had the same level. `tracks`: of a procedure
    that chose the levels from the answers; `own_priors`: its priors of width and lapse rate are the fit's. `at_edge`:
    trials of them whose level was the last that there is.
    """

    factor: str
    share: FittedShare
    guess: float | None = None
    falling: bool = False
    standard: Level | None = None
    standard_interval: StandardInterval = field(default="random", metadata=UNWRITTEN)
    people: int = 0
    fitted: int = 0
    even: int = 0
    own_priors: bool = field(default=False, metadata=UNWRITTEN)
    conditions: tuple[ConditionFit, ...] = ()
    differences: tuple[ConditionDifference, ...] = ()
    reason: str | None = None
    tracks: tuple[TrackAnswers, ...] = field(default=(), repr=False, metadata=UNWRITTEN)
    at_edge: int = field(default=0, metadata=UNWRITTEN)

    @property
    def told_from(self) -> float | None:
        """The number of the standard that levels were told from: the distance of the threshold is what is noticed."""
        return None if self.share != "right" or not isinstance(self.standard, float) else self.standard


def thresholds(design: DesignConfig, name: str, table: pd.DataFrame, *, everybody: bool = False) -> Thresholds | None:
    """The functions of a question from the table of its design; `None` of one that has none.

    `everybody`: all people are fitted, however many, not some spread evenly over their codes.
    """
    question, factor = design.questions[name], numeric_factor(design)
    share = None if factor is None else fitted_share(design, question)
    if factor is None or share is None:
        return None
    known = chance(question) if share == "right" else None
    found = Thresholds(
        factor=factor,
        share=share,
        guess=known,
        standard=design.trial.standard,
        standard_interval=design.trial.standard_interval,
    )
    if why := _unordered(design, factor, share):
        return replace(found, reason=why)
    level = _coerced(table[factor])
    success = _successes(design, name, factor, share, table)
    even = int((success.isna() & table[name].notna() & level.notna()).sum()) if share == "chosen" else 0
    others = [one for one, of in design.factors.items() if len(of.all_levels) > 1]
    conditions = tuple(one for one in others if one not in {factor, question.correct})
    rows = in_design_order(design, conditions, table).assign(level=level, success=success)
    answers = LevelledAnswers(rows=rows, conditions=conditions, design=design)
    tracks = tuple(tracks_in(design, list(answers.conditions), answers.with_level))
    at_edge = sum(AT_EDGE in str(flags).split() for flags in answers.with_level.get("flags", ())) if tracks else 0
    falls = False if design.adapted or share == "chosen" else None  # low levels follow right answers: no sign of a fall
    of_trials = replace(found, even=even, tracks=tracks, at_edge=at_edge)
    return fitted_thresholds(answers, of_trials, falls=falls, everybody=everybody)


def in_design_order(design: DesignConfig, names: Sequence[str], table: pd.DataFrame) -> pd.DataFrame:
    """A table whose groups by these factors come in the order of the design's levels."""
    import pandas as pd  # noqa: PLC0415 - who has a table has it; who plans a study needs none

    levels = {name: list(design.factors[name].all_levels) for name in names}
    return table.astype({name: pd.CategoricalDtype(some, ordered=True) for name, some in levels.items()})


def numeric_factor(design: DesignConfig) -> str | None:
    """The factor that a function is of: the one that a procedure chooses or that is compared, else the first in people.

    It has three numbers or more.
    """
    compared = next(iter(design.adapted), design.trial.compare)
    names = [compared] if compared is not None else [one for one in design.factors if one not in design.between]
    numbers = {name: _numbers(design.factors[name].all_levels) for name in names}
    return next((name for name, some in numbers.items() if len(some) > 2), None)


def _numbers(levels: Sequence[Level]) -> list[float]:
    return [level for level in levels if not isinstance(level, str)]


def fitted_share(design: DesignConfig, question: QuestionConfig) -> FittedShare | None:
    """What is counted of a question's answers; `None` where nothing is a success."""
    if question.when == "block" or design.trial.kind == "pair":
        return None
    compares = design.trial.kind == "two-interval" and set(question.named_answers) == set(INTERVAL_NAMES[:2])
    if compares and question.correct in {None, "larger"}:
        return "chosen"
    if question.kind == "yes-no" and question.correct in {None, "stimulus"}:
        return "yes"
    return "right" if question.correct is not None else None


def _unordered(design: DesignConfig, factor: str, share: FittedShare) -> str:
    """Why the share of right answers has no single function of the level; empty if it has."""
    if len(design.adapted) > 1:
        return f"the procedure chose levels of {' and '.join(design.adapted)} together, and a function is of one"
    standard, levels = design.trial.standard, _numbers(design.factors[factor].all_levels)
    known = share == "yes" and design.trial.standard_interval != "random"  # yes is said of the comparison
    if share == "chosen" or known or standard is None or isinstance(standard, str):
        return ""
    if min(levels) < standard < max(levels):
        return f"the levels lie on both sides of the standard, {shown_level(standard)}: no single function rises there"
    return ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelledAnswers:
    """Trials with their `participant_id`, `level` and `success` (NaN: none), and the columns that make conditions.

    `design`: which they are of, if they are of one.
    """

    rows: pd.DataFrame
    conditions: tuple[str, ...]
    design: DesignConfig | None = None

    @property
    def with_level(self) -> pd.DataFrame:
        """The answered rows with a level."""
        return self.rows[self.rows["success"].notna() & self.rows["level"].notna()]

    @property
    def catch(self) -> pd.DataFrame:
        """The answered rows without a stimulus."""
        return self.rows[self.rows["success"].notna() & self.rows["level"].isna()]

    @property
    def could_be_met(self) -> FloatArray:
        """The levels that a procedure could choose, which answers have no part in; else those that were met."""
        if self.design is None or not self.design.adapted:
            return self.with_level["level"].to_numpy(dtype=np.float64)
        return np.array(_numbers(self.design.factors[self.design.adapted[0]].all_levels))

    def of_people(self, codes: Sequence[Hashable]) -> Iterator[tuple[dict[str, Level], list[PersonFit]]]:
        """The people in each condition, in the order of their codes; whoever has no trial in it is not there."""
        mine, without = (some[some["participant_id"].isin(codes)] for some in (self.with_level, self.catch))
        for levels, rows in _by_condition(mine, self.conditions):
            catch = without
            for column, level in levels.items():
                catch = catch[catch[column].isna() | (catch[column] == level)]
            people = rows.groupby("participant_id", sort=True, observed=True)
            yield levels, [_person(str(who), some, catch[catch["participant_id"] == who]) for who, some in people]


def _successes(
    design: DesignConfig, name: str, factor: str, share: FittedShare, table: pd.DataFrame
) -> pd.Series[float]:
    """1, 0, or NaN of what tells nothing."""
    given = table[name]
    if share == "yes":
        return (given == YES).astype(float).where(given.notna())
    if share == "right":
        return _coerced(table[correct_columns(design.questions)[name]])
    if design.trial.standard_interval != "random":  # the comparison is known, also where both levels are the same
        comparison = INTERVAL_NAMES[design.trial.standard_interval == INTERVAL_NAMES[0]]
        return (given == comparison).astype(float).where(given.notna())
    intervals = [_coerced(table[f"{factor}_{place}"]) for place in (1, 2)]
    level = _coerced(table[factor])
    first, second = ((of == level) & ~(other == level) for of, other in (intervals, intervals[::-1]))
    chosen = (given == INTERVAL_NAMES[0]).where(first, given == INTERVAL_NAMES[1])
    return chosen.astype(float).where(given.notna() & (first | second))


def _coerced(column: pd.Series[Any]) -> pd.Series[float]:
    """NaN where there is no number."""
    import pandas as pd  # noqa: PLC0415 - who has a column has it; who plans a study needs none

    return pd.to_numeric(column, errors="coerce")


def _by_condition(rows: pd.DataFrame, names: Sequence[str]) -> Iterator[tuple[dict[str, Level], pd.DataFrame]]:
    if not names:
        yield {}, rows
        return
    for levels, some in rows.groupby(list(names), sort=True, observed=True):
        yield dict(zip(names, map(_level, levels), strict=True)), some


def _level(value: Hashable) -> Level:
    return value if isinstance(value, str) else float(str(value))


def _points(rows: pd.DataFrame) -> tuple[ShareAtLevel, ...]:
    counted = rows.groupby("level", sort=True)["success"].agg(["sum", "size"])
    return tuple(
        ShareAtLevel(level=float(str(level)), right=round(right), trials=int(trials))
        for level, right, trials in counted.itertuples()
    )


def _person(who: str, rows: pd.DataFrame, catch: pd.DataFrame) -> PersonFit:
    without = (round(catch["success"].sum()), len(catch)) if len(catch) else None
    return PersonFit(participant=who, points=_points(rows), catch=without)


def fitted_thresholds(
    answers: LevelledAnswers, found: Thresholds, *, falls: bool | None, everybody: bool = False
) -> Thresholds:
    """The functions of some answers; `falls`: whether successes become fewer with the level, `None` to find out."""
    rows = answers.with_level
    if not len(rows):
        return replace(found, reason="nobody answered")
    codes = sorted(rows["participant_id"].unique(), key=str)
    pooled = dict(_pooled(answers))
    most = len(codes) if everybody else max(1, min(MOST_FITTED, MOST_FITS // len(pooled)))
    chosen = (
        codes if len(codes) <= most else [codes[i] for i in np.linspace(0, len(codes) - 1, most).round().astype(int)]
    )
    levels = rows["level"].to_numpy(dtype=np.float64)
    if np.unique(levels).size < 2:
        return replace(found, people=len(codes), reason="the answers are all at one level")
    falling = _falls(levels, rows["success"].to_numpy(dtype=np.float64)) if falls is None else falls
    met = answers.could_be_met
    priors = priors_of(answers.design, -met if falling else met)
    span, conditions = (float(met.min()), float(met.max())), []
    for of, people in answers.of_people(chosen):
        fits = [person_fit(one, guess=found.guess, falling=falling, span=span, priors=priors) for one in people]
        whole, group = with_group(fits)
        conditions.append(ConditionFit(levels=of, points=pooled[tuple(of.items())], people=whole, group=group))
    return replace(
        found,
        falling=falling,
        own_priors=has_own_priors(answers.design),
        people=len(codes),
        fitted=len(chosen),
        conditions=tuple(conditions),
        differences=tuple(_differences(conditions)),
    )


def has_own_priors(design: DesignConfig | None) -> bool:
    """Whether a design says what it thinks of the width and of lapses: its procedure's levels rest on that."""
    return design is not None and isinstance(design.adaptive, PosteriorConfig) and len(design.adapted) == 1


def priors_of(design: DesignConfig | None, levels: FloatArray) -> Priors:
    """Psignifit's priors; width and lapse rate as the design's procedure takes them, where it says so.

    A procedure that measures a threshold learns little of either, so that the fit rests on what is thought of them.
    The threshold's stays flat, so that people can be pooled. Of the logarithm a width is no width of the level.
    """
    priors, table = default_priors(levels), None if design is None else design.adaptive
    if not isinstance(table, PosteriorConfig) or not has_own_priors(design):
        return priors
    lapse = ListedPrior(values=table.lapse.values, weights=table.lapse.weights)
    if table.scale == "log":
        return replace(priors, lapse=lapse)
    return replace(priors, lapse=lapse, width=ListedPrior(values=table.width.values, weights=table.width.weights))


def _pooled(answers: LevelledAnswers) -> Iterator[tuple[tuple[tuple[str, Level], ...], tuple[ShareAtLevel, ...]]]:
    for levels, rows in _by_condition(answers.with_level, answers.conditions):
        yield tuple(levels.items()), _points(rows)


def _falls(levels: FloatArray, success: FloatArray) -> bool:
    """Whether successes become clearly fewer with the level."""
    if np.ptp(levels) == 0 or np.ptp(success) == 0:
        return False
    return bool(np.corrcoef(levels, success)[0, 1] * np.sqrt(levels.size) < _FALLS)


def _differences(conditions: Sequence[ConditionFit]) -> Iterator[ConditionDifference]:
    if len(conditions) > MOST_COMPARED:
        return
    for one, other in combinations(conditions, 2):
        found = threshold_difference(one.people, other.people, (one.group, other.group))
        if found is not None:
            yield ConditionDifference(a=one.levels, b=other.levels, threshold=found)
