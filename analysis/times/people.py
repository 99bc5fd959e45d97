"""The diffusion model person by person: each one's own fit, and the mean person of the population."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.arrays import share
from analysis.times.fit import DiffusionFit, fit
from analysis.times.likelihood import Range, Trials


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanEstimate:
    """A parameter's mean over people, its standard error and interval, and the SD of people's estimates.

    That SD holds the noise of each person's fit as well as the differences between people.
    """

    name: str
    value: float
    se: float
    ci_low: float
    ci_high: float
    sd: float
    people: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeopleFit:
    """Every person's own fit, in the order of their codes, and the means; `left_out` have no fit of their own."""

    means: tuple[MeanEstimate, ...]
    fits: tuple[DiffusionFit, ...]
    left_out: tuple[int, ...]

    def __getitem__(self, name: str) -> MeanEstimate:
        """The mean of a name. `KeyError`: there is none."""
        for mean in self.means:
            if mean.name == name:
                return mean
        raise KeyError(name)


def fit_people(
    trials: Trials,
    *,
    bias: bool = True,
    lapses: bool | Range = False,
    confidence: float = 0.95,
    track: Callable[[Sequence[int]], Iterable[int]] = iter,
    together: DiffusionFit | None = None,
) -> PeopleFit:
    """Fit each person alone, then the mean over people with Student's t on people - 1 degrees of freedom.

    Two stages: right when people differ, which the fit of all trials together is not; but each person's fit has the
    bias of few trials (with 60: t0 about +10 ms, drifts some percent too large), which the mean keeps. Each climbs from
    the peak of all trials `together`, a fit of the same model, which is made if not given. A person who lacks a
    condition or instruction, or whose fit has no clear peak, is left out and named by place. `track` is given the
    places and gives them back one by one: for a progress bar. `ValueError`: confidence outside 0..1.
    """
    alpha = 1.0 - share(confidence, "confidence")
    places = track(range(int(trials.person.max()) + 1))
    near = together or fit(trials, bias=bias, lapses=lapses)
    fits = [fit(of_person(trials, place), bias=bias, lapses=lapses, near=near) for place in places]
    names = max((tuple(e.name for e in one.estimates) for one in fits), key=len)
    whole = [one.reason is None and tuple(e.name for e in one.estimates) == names for one in fits]
    kept = [one for one, good in zip(fits, whole, strict=True) if good]
    return PeopleFit(
        means=tuple(mean_estimate(name, [one[name].value for one in kept], alpha) for name in names),
        fits=tuple(fits),
        left_out=tuple(place for place, good in enumerate(whole) if not good),
    )


def of_person(trials: Trials, person: int) -> Trials:
    """The trials of one person; conditions and instructions that the person never had are dropped."""
    mine = trials.person == person
    conditions, condition = np.unique(trials.condition[mine], return_inverse=True)
    instructions, instruction = np.unique(trials.instruction[mine], return_inverse=True)
    return replace(
        trials,
        upper=trials.upper[mine],
        time_s=trials.time_s[mine],
        sign=trials.sign[mine],
        condition=condition,
        instruction=instruction,
        person=np.zeros(int(mine.sum()), dtype=np.intp),
        conditions=tuple(trials.conditions[place] for place in conditions),
        instructions=tuple(trials.instructions[place] for place in instructions),
    )


def mean_estimate(name: str, values: ArrayLike, alpha: float = 0.05) -> MeanEstimate:
    """The mean over people with Student's t on people - 1 degrees of freedom; NaN for the spread of fewer than two."""
    own = np.asarray(values, dtype=np.float64)
    n = own.size
    value = float(own.mean()) if n else math.nan
    sd = float(own.std(ddof=1)) if n > 1 else math.nan
    se = sd / math.sqrt(n) if n > 1 else math.nan
    half = -float(special.stdtrit(n - 1, alpha / 2.0)) * se if n > 1 else math.nan
    return MeanEstimate(name=name, value=value, se=se, ci_low=value - half, ci_high=value + half, sd=sd, people=n)
