"""Psychometric functions person by person, the group behind them, and what differs between two conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.psychometric.fit import Credible, PsychometricFit, psychometric_fit
from analysis.psychometric.pooling import difference, pooled_group
from analysis.psychometric.priors import Priors
from analysis.report.serial import OPTIONAL, UNWRITTEN
from analysis.stats.arrays import FloatArray
from analysis.stats.frames import Result
from device.messages import how_many

FEWEST_ANSWERS = 10
"""Fewer trials than this are not fitted (assumed): a function has three parameters or four."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShareAtLevel:
    """How many of the trials at a level were right, or answered with yes."""

    level: float
    right: int
    trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonFit:
    """One person's answers in one condition, and their function; without one, the `reason`.

    `catch`: the yes answers and trials without a stimulus. `pooled`: the threshold drawn towards the group's.
    """

    participant: str
    points: tuple[ShareAtLevel, ...]
    catch: tuple[int, int] | None = field(default=None, metadata=OPTIONAL)
    fit: PsychometricFit | None = None
    pooled: Credible | None = None
    reason: str | None = None

    @property
    def trials(self) -> int:
        """How many trials had a stimulus."""
        return sum(point.trials for point in self.points)

    @property
    def beyond(self) -> str:
        """What there is to say of a threshold that lies beyond every level that was presented; else empty."""
        levels = [point.level for point in self.points]
        if self.fit is None or self.fit.where != "within" or not levels:
            return ""
        if self.fit.threshold.median < min(levels):
            return f"below every level presented, {min(levels):g}"
        return f"above every level presented, {max(levels):g}" if self.fit.threshold.median > max(levels) else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class GroupFit(Result):
    """The threshold's mean and standard deviation over people, and the geometric mean of their JNDs.

    `without`: how many of the `people` have no threshold within the levels; they count with what little they tell.
    """

    people: int
    without: int
    threshold: Credible
    sd: Credible
    jnd: Credible
    mean_draws: FloatArray = field(repr=False, compare=False, metadata=UNWRITTEN)


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdDifference:
    """The mean of the threshold in one condition less that in another: of the same people, or of two groups."""

    people: int
    within: bool
    difference: Credible


def person_fit(
    answers: PersonFit, *, guess: float | None, falling: bool, span: tuple[float, float], priors: Priors
) -> PersonFit:
    """The answers with their function, or with the reason why there is none; `span` as in `psychometric_fit`."""
    if answers.trials < FEWEST_ANSWERS or len(answers.points) < 2:
        counted = f"{how_many(answers.trials, 'trial')} at {how_many(len(answers.points), 'level')}"
        return replace(answers, reason=f"{counted}; a fit needs at least {FEWEST_ANSWERS} at two levels")
    fit = psychometric_fit(
        [point.level for point in answers.points],
        [point.right for point in answers.points],
        [point.trials for point in answers.points],
        guess=guess,
        catch=answers.catch or (0, 0),
        falling=falling,
        span=span,
        priors=priors,
    )
    return replace(answers, fit=fit, reason=fit.reason)


def with_group(people: Sequence[PersonFit]) -> tuple[tuple[PersonFit, ...], GroupFit | None]:
    """The people with their pooled thresholds, and the group; none of fewer than two."""
    fits = [one.fit for one in people if one.fit is not None]
    if len(fits) < 2:
        return tuple(people), None
    thresholds = pooled_group([fit.threshold_draws for fit in fits])
    jnds = pooled_group([np.log(fit.jnd_draws) for fit in fits])
    own = iter(thresholds.people)
    pooled = tuple(one if one.fit is None else replace(one, pooled=next(own)) for one in people)
    group = GroupFit(
        people=len(fits),
        without=sum(fit.where != "within" for fit in fits),
        threshold=thresholds.mean,
        sd=thresholds.sd,
        jnd=_of_logarithms(jnds.mean),
        mean_draws=thresholds.mean_draws,
    )
    return pooled, group


def threshold_difference(
    one: Sequence[PersonFit], other: Sequence[PersonFit], groups: tuple[GroupFit | None, GroupFit | None]
) -> ThresholdDifference | None:
    """`one` less `other`: pooled over the people of both, or of the groups where nobody is in both; else `None`."""
    first, second = _by_name(one), _by_name(other)
    both = [name for name in first if name in second]
    own = [difference(first[name].threshold_draws, second[name].threshold_draws) for name in both]
    if len(own) > 1:
        return ThresholdDifference(people=len(own), within=True, difference=pooled_group(own).mean)
    if own:
        return ThresholdDifference(people=1, within=True, difference=_of_draws(own[0]))
    if groups[0] is None or groups[1] is None:
        return None
    apart = difference(groups[0].mean_draws, groups[1].mean_draws)
    people = groups[0].people + groups[1].people
    return ThresholdDifference(people=people, within=False, difference=_of_draws(apart))


def mean_curve(fits: Iterable[PsychometricFit], levels: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The mean over people of their shares at levels (m,): its median, and the band that holds 95 %."""
    mixed = np.random.default_rng(1917)
    shares = [fit.shares(levels)[mixed.permutation(len(fit.draws))] for fit in fits]
    low, middle, high = np.quantile(np.mean(shares, axis=0), [0.025, 0.5, 0.975], axis=0)
    return middle, low, high


def _by_name(people: Sequence[PersonFit]) -> dict[str, PsychometricFit]:
    return {one.participant: one.fit for one in people if one.fit is not None}


def _of_logarithms(found: Credible) -> Credible:
    median, mean, low, high = np.exp([found.median, found.mean, found.low, found.high]).tolist()
    return Credible(median=median, mean=mean, low=low, high=high)


def _of_draws(draws: FloatArray) -> Credible:
    low, median, high = np.quantile(draws, [0.025, 0.5, 0.975]).tolist()
    return Credible(median=median, mean=float(draws.mean()), low=low, high=high)
