"""Operating characteristics of the post-hoc tests: how often each finds a difference that is not there, or is.

Normal data sets of n participants by three conditions, at several departures from sphericity. The first two conditions
always have equal means, so a difference found between them is false; the third stands apart, or does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from analysis.stats.anova import PairStatistics, own_pairs, pairs_of, pooled_pairs
from analysis.stats.arrays import FloatArray
from analysis.stats.studentized_range import studentized_range_isf

ALPHA = 0.05
STUDY_SIZE = 14
DATA_SETS = 20_000
NOISE_RATIOS = (1.0, 2.5, 6.0)
"""Standard deviation of the third condition over that of the others: epsilon 1, about .69 and about .53."""
PERSON_SD = 1.5
"""Spread of the participants' own levels, in standard deviations of the first two conditions: a correlation of .69."""
SHIFT = 0.8
"""How far the third condition stands apart, in standard deviations of a single difference between two conditions."""
_CHUNK = 5_000


@dataclass(frozen=True, slots=True, kw_only=True)
class PostHocMethod:
    """A way to compare all pairs, and the error it claims to keep to at epsilon 1 and below; None where it claims none.

    `rejects` takes (..., n, k) and tells of each pair, in the order of `pairs_of(k)`, whether it is found different.
    """

    name: str
    claimed: tuple[float | None, float | None]
    rejects: Callable[[FloatArray], np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Characteristics:
    """Shares of data sets at one epsilon; `claimed` bounds the errors, if anything does.

    `null_error`: a false finding where nothing differs; `partial_error`: one beside a true difference; `power`: any
    true difference found.
    """

    post_hoc: str
    claimed: float | None
    epsilon: float
    null_error: float
    partial_error: float
    power: float
    data_sets: int

    def monte_carlo_error(self, share: float) -> float:
        """Standard error of a share of so many data sets."""
        return math.sqrt(share * (1.0 - share) / self.data_sets)


def characteristics(
    seed: int,
    participants: int = STUDY_SIZE,
    data_sets: int = DATA_SETS,
    ratios: Sequence[float] = NOISE_RATIOS,
) -> tuple[Characteristics, ...]:
    """Every post-hoc test at every departure from sphericity, on the same data sets.

    The same seed gives the same shares. Three conditions; see the module for what is true of them.
    """
    return tuple(
        one
        for number, ratio in enumerate(ratios)
        for one in _at(ratio, np.random.Generator(np.random.PCG64([seed, number])), participants, data_sets)
    )


def box_epsilon(covariance: FloatArray) -> float:
    """Box's epsilon of a covariance matrix of k conditions: 1 at sphericity, 1 / (k - 1) at the least.

    tr(S)^2 / ((k - 1) tr(S^2)), S the covariance with its rows and columns centred.
    Source: Box 1954, Annals of Mathematical Statistics 25, 484.

    >>> round(box_epsilon(np.eye(3)), 12)
    1.0
    """
    k = len(covariance)
    centring = np.eye(k) - 1.0 / k
    S = centring @ covariance @ centring
    return float(np.trace(S) ** 2 / ((k - 1) * np.trace(S @ S)))


def _at(ratio: float, generator: np.random.Generator, participants: int, data_sets: int) -> Iterator[Characteristics]:
    sds = np.array([1.0, 1.0, ratio])
    shift = np.array([0.0, 0.0, SHIFT * math.hypot(1.0, ratio)])
    false, true = _pairs_without_and_with_the_third()
    counts = np.zeros((len(POST_HOCS), 3))
    for size in _chunks(data_sets):
        people = PERSON_SD * generator.standard_normal((size, participants, 1))
        noise = people + sds * generator.standard_normal((size, participants, 3))
        for i, post_hoc in enumerate(POST_HOCS):
            null, apart = post_hoc.rejects(noise), post_hoc.rejects(noise + shift)
            found = (null.any(axis=-1), apart[..., false].any(axis=-1), apart[..., true].any(axis=-1))
            counts[i] += [int(each.sum()) for each in found]
    epsilon = box_epsilon(np.diag(sds**2))
    for post_hoc, (null_error, partial_error, power) in zip(POST_HOCS, (counts / data_sets).tolist(), strict=True):
        yield Characteristics(
            post_hoc=post_hoc.name,
            claimed=post_hoc.claimed[0 if ratio == 1.0 else 1],
            epsilon=epsilon,
            null_error=null_error,
            partial_error=partial_error,
            power=power,
            data_sets=data_sets,
        )


def _chunks(total: int) -> Iterator[int]:
    """Sizes that add up to `total`: so that memory stays small however many data sets are asked for."""
    while total > 0:
        yield min(total, _CHUNK)
        total -= _CHUNK


def _pairs_without_and_with_the_third() -> tuple[list[int], list[int]]:
    pairs = pairs_of(3)
    apart = [i for i, pair in enumerate(pairs) if 2 in pair]
    return [i for i in range(len(pairs)) if i not in apart], apart


def _tukey(pairs: PairStatistics) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    critical = studentized_range_isf(ALPHA, pairs.k, pairs.df)
    return np.asarray(pairs.q > critical)


def _between(scores: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Tukey's test as if other people sat in every condition: the mistake that most packages invite."""
    n, k = scores.shape[-2:]
    means = scores.mean(axis=-2)
    error = np.sqrt(scores.var(axis=-2, ddof=1).mean(axis=-1) / n)[..., None]
    first, second = np.array(pairs_of(k)).T
    q = np.abs(means[..., first] - means[..., second]) / error
    return np.asarray(q > studentized_range_isf(ALPHA, k, k * (n - 1)))


def _holm(scores: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Paired t-tests, the smallest p against LEVEL / pairs, the next against LEVEL / (pairs - 1), until one fails."""
    pairs = own_pairs(scores)
    p = 2.0 * scipy.special.stdtr(pairs.df, -pairs.q / math.sqrt(2.0))
    order = np.argsort(p, axis=-1)
    tried = np.arange(p.shape[-1], 0, -1)
    passed = np.logical_and.accumulate(np.take_along_axis(p, order, -1) * tried <= ALPHA, axis=-1)
    rejected = np.zeros_like(passed)
    np.put_along_axis(rejected, order, passed, axis=-1)
    return rejected


POST_HOCS = (
    PostHocMethod(
        name="Tukey, pooled error", claimed=(ALPHA, None), rejects=lambda scores: _tukey(pooled_pairs(scores))
    ),
    PostHocMethod(name="Tukey, paired errors", claimed=(0.06, 0.06), rejects=lambda scores: _tukey(own_pairs(scores))),
    PostHocMethod(name="paired t, Holm", claimed=(ALPHA, ALPHA), rejects=_holm),
    PostHocMethod(name="Tukey between participants, misused", claimed=(None, None), rejects=_between),
)
"""The paired errors differ from pair to pair, which the studentized range does not know: so near LEVEL, not at most."""
