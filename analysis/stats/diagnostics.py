"""What stands around a repeated-measures ANOVA: residuals, outliers, sphericity, effect sizes, intervals of means."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from analysis.stats.anova import RepeatedMeasuresAnova, check_scores, one_table, rm_anova, scores_and_names
from analysis.stats.arrays import FloatArray, in_brief, pingouin, scale_number, share
from analysis.stats.frames import Label, Result, Results, ScoreTable, named_scores
from analysis.stats.sums_of_squares import repeated_sums


def unit_scaled(scores: FloatArray) -> FloatArray:
    """`scores` over a power of two, which is exact: the largest lies in 0.5..1, so no square over- or underflows."""
    scaled: FloatArray = np.ldexp(scores, -np.frexp(np.abs(scores).max())[1])
    return scaled


def residuals(scores: ScoreTable) -> FloatArray:
    """e_ij = x_ij - m_i - m_j + m in a power of two of the data's unit, so that the largest score lies in 0.5..1.

    `scores`: (n participants, k conditions), the result too. All zeros where `rm_anova` finds no error variance, so
    that nobody takes rounding for spread. `ValueError` as in `rm_anova`.

    >>> residuals([[1.0, 2.0], [2.0, 5.0]]).tolist()
    [[0.0625, -0.0625], [-0.0625, 0.0625]]
    """
    array = one_table(check_scores(scores))
    sums = repeated_sums(array)
    if not sums.error.any():
        return np.zeros_like(array)
    scaled = unit_scaled(array)
    rest: FloatArray = scaled - scaled[:, :1]
    rest = rest - rest[:1]
    for _ in range(2):  # the second pass takes off what the rounding of the first means left
        rest = rest - rest.mean(axis=1, keepdims=True)
        rest = rest - rest.mean(axis=0, keepdims=True)
    return rest


SHAPIRO_UP_TO = 5000
NO_RESIDUALS = "There is no error variance, so there are no residuals to look at."
TOO_MANY = "Shapiro-Wilk's p-value is not known beyond 5000 residuals; read skewness and kurtosis."
NORMALITY_NOTE = (
    "Shapiro-Wilk test of the n × k residuals of the repeated-measures ANOVA. They are not independent (rows and "
    "columns sum to 0) and come in steps where rates do, so p is a guide, not a size."
)
OUTLIER_RULE = (
    "A score is an outlier if it lies more than 1.5 interquartile ranges of its method below the lower or above the "
    "upper quartile (Tukey 1977). Outliers are named, not removed."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Normality(Result):
    """Shapiro-Wilk's W and p of `n` residuals, skewness and excess kurtosis; None where undefined, for `reason`."""

    W: float | None = None
    p: float | None = None
    n: int
    skewness: float | None = None
    excess_kurtosis: float | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlier(Result):
    """A score beyond the fences of its condition: `row` of the participant, `column` of the condition."""

    row: int
    column: int
    score: float
    fence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends(Result):
    """How many participants score the least and the most that the scale allows, for each condition."""

    floor: tuple[int, ...]
    ceiling: tuple[int, ...]


def normality(scores: ScoreTable) -> Normality:
    """Are the residuals of the repeated-measures ANOVA normal? `scores`: (n participants, k conditions).

    `ValueError` as in `rm_anova`. Source: Shapiro & Wilk 1965, Biometrika 52, 591; p by Royston 1995, algorithm AS R94.

    >>> found = normality([[1, 2, 4], [2, 2, 6], [3, 5, 5], [4, 5, 9]])
    >>> found.n, round(found.W, 3)
    (12, 0.963)
    """
    rest = residuals(scores).ravel()
    if not rest.any():
        return Normality(n=rest.size, reason=NO_RESIDUALS)
    rest = rest / np.abs(rest).max()
    skewness, kurtosis = float(scipy.stats.skew(rest)), float(scipy.stats.kurtosis(rest))
    if rest.size > SHAPIRO_UP_TO:
        return Normality(n=rest.size, skewness=skewness, excess_kurtosis=kurtosis, reason=TOO_MANY)
    W, p = scipy.stats.shapiro(rest)
    return Normality(W=float(W), p=float(p), n=rest.size, skewness=skewness, excess_kurtosis=kurtosis)


def outliers(scores: ScoreTable, reach: float = 1.5) -> Results[Outlier]:
    """The scores beyond `reach` interquartile ranges from the quartiles of their condition, conditions in order.

    `scores`: (n participants, k conditions). Quartiles interpolate linearly. A score within 1e-9 interquartile ranges
    of a fence is inside: tenths are no doubles. `ValueError`: no finite scores, or a `reach` that is not above 0.
    Source: Tukey 1977, Exploratory Data Analysis, 2D.

    >>> outliers([[1, 4], [2, 5], [2, 5], [3, 6], [30, 5]])[0].score
    30.0
    """
    array, reach = one_table(named_scores(scores, "scores")[0]), scale_number(reach, "reach")
    if not array.size:
        raise ValueError(f"scores must be of at least 1 participant and 1 condition, not of shape {array.shape}")
    lower, upper = np.quantile(array, [0.25, 0.75], axis=0)
    spread = upper - lower
    slack = 1e-9 * np.maximum(spread, np.abs(array).max(axis=0))
    low, high = lower - reach * spread, upper + reach * spread
    out = (array < low - slack) | (array > high + slack)
    return Results(
        Outlier(
            row=int(i),
            column=int(j),
            score=float(array[i, j]),
            fence=float(low[j] if array[i, j] < low[j] else high[j]),
        )
        for j, i in np.argwhere(out.T)
    )


def ends(scores: ScoreTable, scale: Sequence[float]) -> Ends:
    """Counts of scores at the two ends of the `scale` (lowest, highest). `scores`: (n participants, k conditions)."""
    array, (lowest, highest) = one_table(named_scores(scores, "scores")[0]), scale
    return Ends(
        floor=tuple(int(count) for count in (array <= lowest).sum(axis=0)),
        ceiling=tuple(int(count) for count in (array >= highest).sum(axis=0)),
    )


TRIVIAL = "With two conditions there is one difference only: sphericity holds trivially and nothing is corrected."
NO_COVARIANCES = "There is no error variance, so there are no covariances to compare."
TOO_FEW = (
    "There are fewer participants than conditions: the covariance matrix of the contrasts is singular, so Mauchly's W "
    "and the Huynh-Feldt epsilon are undefined; the Greenhouse-Geisser epsilon is defined, but leans towards its bound."
)
SINGULAR = "A contrast of the conditions has no variance at all (W = 0), so Mauchly's chi-square is undefined."


@dataclass(frozen=True, slots=True, kw_only=True)
class Corrected(Result):
    """The F test with both degrees of freedom multiplied by `epsilon`."""

    epsilon: float
    df: tuple[float, float]
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphericity(Result):
    """Mauchly's test and the two corrections; what is undefined is None, and `reason` says why."""

    W: float | None = None
    chi2: float | None = None
    df: int | None = None
    p: float | None = None
    greenhouse_geisser: Corrected | None = None
    huynh_feldt: Corrected | None = None
    reason: str | None = None


def sphericity(scores: ScoreTable) -> Sphericity:
    """Mauchly's test and the F test of `rm_anova` corrected by the Greenhouse-Geisser and Huynh-Feldt epsilon.

    With M = C'SC, the covariance matrix of k - 1 orthonormal contrasts, d = k - 1:
    W = det M / (tr M / d)^d; eps_GG = (tr M)^2 / (d tr M^2), within 1/d..1;
    eps_HF = (n d eps_GG - 2) / (d (n - 1 - d eps_GG)), at most 1.

    `scores`: (n participants, k conditions); `ValueError` as in `rm_anova`. Computed by pingouin on the residuals,
    which have the same M and keep their digits at any offset.
    Sources: Mauchly 1940, Ann. Math. Stat. 11, 204; Greenhouse & Geisser 1959, Psychometrika 24, 95;
    Huynh & Feldt 1976, J. Educ. Stat. 1, 69.

    >>> found = sphericity([[2.2, 1.1, 8.2], [3.1, 2.5, 4.5], [4.3, 4.1, 3.4], [4.1, 5.2, 6.2], [7.2, 6.4, 7.2]])
    >>> round(found.W, 2), round(found.greenhouse_geisser.epsilon, 2), round(found.huynh_feldt.epsilon, 2)
    (0.21, 0.56, 0.62)
    """
    array = one_table(check_scores(scores))
    n, k = array.shape
    rest = residuals(array)
    if not rest.any():
        return Sphericity(reason=NO_COVARIANCES)
    if k == 2:
        trivial = _corrected(array, 1.0)
        return Sphericity(greenhouse_geisser=trivial, huynh_feldt=trivial, reason=TRIVIAL)
    wide = pd.DataFrame(rest / np.abs(rest).max())
    greenhouse_geisser = _corrected(array, _epsilon(wide, "gg"))
    if n < k:
        return Sphericity(greenhouse_geisser=greenhouse_geisser, reason=TOO_FEW)
    huynh_feldt = _corrected(array, _epsilon(wide, "hf"))
    if int(np.linalg.matrix_rank(wide.to_numpy())) < k - 1:
        return Sphericity(W=0.0, greenhouse_geisser=greenhouse_geisser, huynh_feldt=huynh_feldt, reason=SINGULAR)
    found = pingouin("sphericity")(wide)
    return Sphericity(
        W=float(found.W),
        chi2=float(found.chi2),
        df=int(found.dof),
        p=float(found.pval),
        greenhouse_geisser=greenhouse_geisser,
        huynh_feldt=huynh_feldt,
    )


def _epsilon(wide: pd.DataFrame, correction: str) -> float:
    """Kept between its bounds, which rounding may miss by a digit: 1/(k - 1) and 1."""
    if correction == "hf" and _full(wide):
        return 1.0
    return float(np.clip(pingouin("epsilon")(wide, correction=correction), 1.0 / (wide.shape[1] - 1), 1.0))


def _full(wide: pd.DataFrame) -> bool:
    """Is n - 1 = d eps_GG, where the Huynh-Feldt epsilon's denominator is 0 and its value beyond 1?"""
    n, k = wide.shape
    return n - 1 <= (k - 1) * _epsilon(wide, "gg") * (1.0 + 1e-12)


def _corrected(scores: FloatArray, epsilon: float) -> Corrected:
    anova = rm_anova(scores)
    df = (epsilon * anova.df_effect, epsilon * anova.df_error)
    return Corrected(epsilon=epsilon, df=df, p=float(scipy.special.fdtrc(*df, anova.F)))


NO_ERROR_VARIANCE = (
    "There is no error variance: the partial eta squared is 1 or undefined, and no interval can be given."
)
LARGEST_F = 1e8
TOO_LARGE = "F is above 1e8: the interval of the partial eta squared cannot be told from 1."
EFFECT_SIZE_NOTE = (
    "The intervals are those of the partial eta squared, from the noncentral F distribution (Steiger 2004); the 90 % "
    "interval leaves out 0 exactly if the F test has p < .05. The generalised eta squared has none: its denominator "
    "also holds the variance between participants, and the ratio follows no known noncentral distribution."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectSize(Result):
    """Eta squared, partial (its intervals too) and generalised; None where undefined, and `reason` says why."""

    partial_eta_squared: float | None
    ci_90: tuple[float, float] | None
    ci_95: tuple[float, float] | None
    generalized_eta_squared: float | None
    reason: str | None = None


def effect_size(anova: RepeatedMeasuresAnova) -> EffectSize:
    """Effect sizes of one repeated-measures ANOVA.

    Partial: SS_effect / (SS_effect + SS_error). Generalised: SS_effect / (SS_effect + SS_participants + SS_error).
    `ValueError`: analyses of many data sets. They are safe against the data's scale and offset, as F is.
    Sources: Olejnik & Algina 2003, Psychol. Methods 8, 434; Bakeman 2005, Behav. Res. Methods 37, 379.

    >>> found = effect_size(rm_anova([[1, 2, 4], [2, 2, 6], [3, 5, 5], [4, 5, 9]]))
    >>> round(found.partial_eta_squared, 3), tuple(round(end, 3) for end in found.ci_90)
    (0.812, (0.283, 0.871))
    """
    if not isinstance(anova, RepeatedMeasuresAnova):
        raise ValueError(f"anova must be what rm_anova gives, not {in_brief(anova)}")
    if np.ndim(anova.F):
        raise ValueError(f"anova must be that of one data set, not of an array {np.shape(anova.F)} of them")
    F, partial, generalized = (
        float(one) for one in (anova.F, anova.partial_eta_squared, anova.generalized_eta_squared)
    )
    reason = TOO_LARGE if math.isfinite(F) and F > LARGEST_F else None if math.isfinite(F) else NO_ERROR_VARIANCE
    ci_90, ci_95 = (
        None if reason else partial_eta_squared_interval(F, anova.df_effect, anova.df_error, level)
        for level in (0.90, 0.95)
    )
    return EffectSize(
        partial_eta_squared=None if math.isnan(partial) else partial,
        ci_90=ci_90,
        ci_95=ci_95,
        generalized_eta_squared=None if math.isnan(generalized) else generalized,
        reason=reason,
    )


def partial_eta_squared_interval(F: float, df_effect: int, df_error: int, confidence: float) -> tuple[float, float]:
    """Interval of the partial eta squared: lambda / (lambda + df_effect + df_error + 1).

    The noncentralities lambda are those that put the observed F at the upper and at the lower tail; 0 where there is
    none. Scipy's noncentral F serves up to F = 1e8. Within participants the same conversion is customary, though exact
    only between participants.
    Source: Steiger 2004, Psychol. Methods 9, 164.
    """
    tail = (1.0 - share(confidence, "confidence")) / 2.0
    low, high = (_noncentrality(F, df_effect, df_error, p) for p in (1.0 - tail, tail))
    total = df_effect + df_error + 1
    return low / (low + total), high / (high + total)


def _noncentrality(F: float, df_effect: int, df_error: int, p: float) -> float:
    """The lambda at which P(F' <= F) = p; 0 where even the central F lies below p."""

    def excess(noncentrality: float) -> float:
        return float(scipy.special.ncfdtr(df_effect, df_error, noncentrality, F)) - p

    return (
        float(scipy.optimize.brentq(excess, 0.0, _above(excess, F * df_effect), xtol=1e-10))
        if excess(0.0) > 0.0
        else 0.0
    )


def _above(excess: Callable[[float], float], start: float) -> float:
    """A noncentrality that is surely too large."""
    high = start + 10.0
    while excess(high) > 0.0:
        high *= 2.0
    return high


@dataclass(frozen=True, slots=True, kw_only=True)
class WithinSubject(Result):
    """Means of the `conditions` and their intervals, arrays (conditions,).

    `half_widths` keep their digits also where the means are so large that their ends cannot show them.
    """

    conditions: tuple[Label, ...]
    means: FloatArray
    half_widths: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray

    def rows(self) -> list[dict[str, object]]:
        """The conditions, a row each."""
        return [row | {"conditions": name} for name, row in zip(self.conditions, Result.rows(self), strict=True)]


def cousineau_morey(scores: ScoreTable, confidence: float = 0.95) -> WithinSubject:
    """Means with within-subject intervals, of `scores` (participants, conditions).

    y'_ij = y_ij - mean_i + mean; the interval of condition j is mean_j +- t(n - 1) s'_j / sqrt(n) sqrt(k / (k - 1)),
    with y'_ij - mean_j the `residuals` of the ANOVA, whatever the offset and the scale.
    `ValueError` for fewer than 2 participants or conditions.
    Sources: Cousineau 2005, Tutorials in Quantitative Methods for Psychology 1, 42; Morey 2008, same journal 4, 61.

    >>> cousineau_morey([[1, 2, 3], [5, 6, 7]]).ci_low.tolist()
    [3.0, 4.0, 5.0]
    """
    array, names = scores_and_names(scores)
    n, k = one_table(array).shape
    t = scipy.special.stdtrit(n - 1, 0.5 + share(confidence, "confidence") / 2.0)
    spread = np.sqrt(np.square(residuals(array)).sum(axis=0) / (n - 1))
    exponent = np.frexp(np.abs(array).max())[1]
    half = np.ldexp(t * spread / math.sqrt(n) * math.sqrt(k / (k - 1)), exponent)
    means = np.ldexp(unit_scaled(array).mean(axis=0), exponent)
    with np.errstate(over="ignore"):
        low, high = means - half, means + half
    return WithinSubject(conditions=tuple(names), means=means, half_widths=half, ci_low=low, ci_high=high)
