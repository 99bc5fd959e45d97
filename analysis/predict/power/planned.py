"""The planned analysis on arrays of many simulated studies, and shares of significant ones with intervals.

The tests are those of `statistics.json`: repeated-measures ANOVA, Tukey's test on its error, the pooled exact binomial
test, and d' with its mean over people; here also with the t-test of that mean against 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from analysis.paper.recurrence import Recurrence, ShareOfStudies, share_of
from analysis.stats.anova import check_scores, pairs_of, pooled_pairs, rm_anova
from analysis.stats.anova_power import rm_anova_power
from analysis.stats.arrays import FloatArray
from analysis.stats.binomial import binomial_test_p
from analysis.stats.corrections import SIGNIFICANT
from analysis.stats.discrimination import yes_no
from analysis.stats.studentized_range import studentized_range_isf
from device.words import DIRECTIONS

ANOVA = "ANOVA"
ALL_PAIRS = "Tukey, all pairs"
ANY_PAIR = "Tukey, any pair"


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """Of each study: which claims came out significant, half the length of its 95 % intervals, and its mean squares.

    `mean_squares` (2, studies): of the methods and of the error of the ANOVA.
    """

    claims: dict[str, Recurrence]
    half_widths: dict[str, FloatArray]
    mean_squares: FloatArray


def analysed_ratings(scores: ArrayLike, methods: Sequence[str], expected: Sequence[float]) -> Findings:
    """ANOVA and Tukey's test of `scores` (studies, n people, k methods), all at 5 %.

    A pair that is expected to differ (`expected`: k values, only their order counts) must come out that way round; one
    that is not counts if it differs either way. `all pairs` are all of the former, `any pair` is any pair either way.
    Where nothing varies (0/0) a claim does not hold. `ValueError`: as in `rm_anova`.
    """
    checked = check_scores(scores)
    pairs = pooled_pairs(checked)
    critical = _critical(pairs.k, pairs.df)
    differs = pairs.q > critical
    anova = rm_anova(checked)
    claims = {ANOVA: np.asarray(np.asarray(anova.p) < SIGNIFICANT)}
    ordered = []
    for i, (a, b) in enumerate(pairs_of(pairs.k)):
        name, sign = _pair(methods, expected, a, b)
        right_way = sign * pairs.difference[..., i] > 0.0 if sign else True
        claims[name] = np.asarray(differs[..., i] & right_way)
        ordered += [claims[name]] if sign else []
    claims[ANY_PAIR] = np.asarray(differs.any(axis=-1))
    if ordered:
        claims[ALL_PAIRS] = np.asarray(np.logical_and.reduce(ordered))
    return Findings(
        claims=claims,
        half_widths={"difference of two methods": critical * pairs.error[..., 0]}
        | {f"mean, {name}": half for name, half in zip(methods, _half_widths(checked), strict=True)},
        mean_squares=np.stack([np.asarray(anova.ss_effect) / anova.df_effect, np.asarray(anova.ms_error)]),
    )


def analysed_directions(
    correct: NDArray[np.int64],
    trials: tuple[int, int],
    methods: Sequence[str],
    expected: Sequence[float],
    expected_d: Sequence[float],
) -> Findings:
    """The whole planned analysis of `correct` answers (studies, n people, k methods, 2: forward, backward).

    `trials`: of each direction a person and method, at least 1 forward; without backward ones there is no d'.
    `expected` is the order of the correct rates (as in `analysed_ratings`), `expected_d` the sign of each d' (k); at 0
    either sign counts. `ValueError`: as in `rm_anova`, `yes_no` and `binomial_test`.
    """
    found = analysed_ratings(correct[..., 0] / trials[0], methods, expected)
    claims, half_widths = dict(found.claims), dict(found.half_widths)
    claims |= _binomials(correct.sum(axis=-3), correct.shape[-3], trials, methods)
    if trials[1]:
        d = np.asarray(yes_no(correct[..., 0], trials[0], trials[1] - correct[..., 1], trials[1]).d_prime)
        means, halves = d.mean(axis=-2), _half_widths(d)
        for i, (method, sign) in enumerate(zip(methods, np.sign(expected_d), strict=True)):
            reached = np.abs(means[..., i]) > halves[i]
            claims[f"d′, {method}"] = reached & (sign * means[..., i] > 0.0) if sign else reached
            half_widths[f"d′, {method}"] = halves[i]
    return Findings(claims=claims, half_widths=half_widths, mean_squares=found.mean_squares)


def _pair(methods: Sequence[str], expected: Sequence[float], a: int, b: int) -> tuple[str, int]:
    """What is claimed of a pair, and the sign that the mean of `a` less that of `b` must have; 0 for either."""
    sign = int(np.sign(expected[a] - expected[b]))
    if not sign:
        return f"Tukey, {methods[a]} other than {methods[b]}", 0
    higher, lower = (a, b) if sign > 0 else (b, a)
    return f"Tukey, {methods[higher]} above {methods[lower]}", sign


@lru_cache(maxsize=64)
def _critical(k: int, df: int) -> float:
    """Tukey's critical q, to eleven digits: its last one depends on how many threads the linear algebra runs on."""
    return float(f"{studentized_range_isf(SIGNIFICANT, k, df):.11g}")


def _half_widths(values: FloatArray) -> FloatArray:
    """Half the length of the 95 % interval of each column's mean (Student's t): (k, studies) of (studies, n, k)."""
    n = values.shape[-2]
    quantile = float(special.stdtrit(n - 1, 1.0 - SIGNIFICANT / 2.0))
    halves: FloatArray = quantile * values.std(axis=-2, ddof=1) / math.sqrt(n)
    return np.moveaxis(halves, -1, 0)


def _binomials(
    pooled: NDArray[np.int64], n: int, trials: tuple[int, int], methods: Sequence[str]
) -> dict[str, Recurrence]:
    """Is chance rejected? Of `pooled` (studies, k, 2), a test for each method and direction that was presented."""
    return {
        f"binomial, {method} {direction}": _rejected(n * trials[way])[pooled[..., i, way]]
        for i, method in enumerate(methods)
        for way, direction in enumerate(DIRECTIONS)
        if trials[way]
    }


@lru_cache(maxsize=64)
def _rejected(trials: int) -> Recurrence:
    """Of each count out of so many trials: does the exact test reject one half at 5 %?"""
    p = np.asarray(binomial_test_p(np.arange(trials + 1), trials))
    return p < SIGNIFICANT


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """What is kept of a chunk of studies: in how many a claim held; sum and sum of squares of each half-width.

    `mean_squares`: the sums over studies of those of the methods and of the error.
    """

    studies: int
    held: Mapping[str, int]
    sums: Mapping[str, tuple[float, float]]
    mean_squares: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class TextbookPower:
    """Power of the ANOVA by the noncentral F distribution, from Cohen's `f` of the simulated people."""

    f: float
    power: float


def textbook_power(tally: Tally, participants: int, methods: int) -> TextbookPower | None:
    """What a textbook would say beside the simulated power of the ANOVA; None where the scores have no error.

    f^2 = (k - 1)(MS_methods / MS_error - 1) / (n k), the mean squares in their mean over studies, 0 where that is
    negative: the f of a partial eta squared, as `cohens_f` has it. The scores are taken as normal and spherical.

    >>> found = textbook_power(Tally(studies=1, held={}, sums={}, mean_squares=(8.0, 1.0)), 14, 3)
    >>> round(found.f, 3), round(found.power, 3)
    (0.577, 0.895)
    """
    of_methods, of_error = tally.mean_squares
    if not of_error > 0.0:
        return None
    f = math.sqrt(max((methods - 1) * (of_methods / of_error - 1.0) / (participants * methods), 0.0))
    power = float(rm_anova_power(f, participants, methods, correlation=0.0, alpha=SIGNIFICANT))
    return TextbookPower(f=f, power=power)


@dataclass(frozen=True, slots=True, kw_only=True)
class Precision:
    """Half the length of a 95 % interval in the mean over studies; `mc_error` is that mean's own standard error."""

    measure: str
    half_width: float
    mc_error: float


def tallied(findings: Findings) -> Tally:
    """The tally of studies (one leading axis)."""
    held = {claim: int(flags.sum()) for claim, flags in findings.claims.items()}
    sums = {name: (float(w.sum()), float(np.square(w).sum())) for name, w in findings.half_widths.items()}
    of_methods, of_error = findings.mean_squares.sum(axis=-1).tolist()
    studies = len(next(iter(findings.claims.values())))
    return Tally(studies=studies, held=held, sums=sums, mean_squares=(of_methods, of_error))


def merged(tallies: Sequence[Tally]) -> Tally:
    """One tally of many; the same in whatever order they come, to the last bit. `ValueError` if their claims differ."""
    first = tallies[0]
    if any(one.held.keys() != first.held.keys() or one.sums.keys() != first.sums.keys() for one in tallies):
        raise ValueError("tallies of different claims cannot be added")
    return Tally(
        studies=sum(one.studies for one in tallies),
        held={claim: sum(one.held[claim] for one in tallies) for claim in first.held},
        sums={
            name: (math.fsum(one.sums[name][0] for one in tallies), math.fsum(one.sums[name][1] for one in tallies))
            for name in first.sums
        },
        mean_squares=(
            math.fsum(one.mean_squares[0] for one in tallies),
            math.fsum(one.mean_squares[1] for one in tallies),
        ),
    )


def shares(tally: Tally) -> tuple[ShareOfStudies, ...]:
    """The share of each claim."""
    return tuple(share_of(claim, held, tally.studies) for claim, held in tally.held.items())


def precisions(tally: Tally) -> tuple[Precision, ...]:
    """The mean half-width of each interval.

    >>> precisions(Tally(studies=2, held={}, sums={"mean": (3.0, 5.0)}))
    (Precision(measure='mean', half_width=1.5, mc_error=0.5),)
    """
    rows, n = [], tally.studies
    for measure, (total, squares) in tally.sums.items():
        spread = max(squares - total * total / n, 0.0)
        error = math.sqrt(spread / (n * max(n - 1, 1)))
        rows.append(Precision(measure=measure, half_width=total / n, mc_error=error))
    return tuple(rows)
