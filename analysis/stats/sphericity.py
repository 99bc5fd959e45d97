"""Sphericity: do all differences between two conditions vary alike, and what becomes of F if they do not?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import special

from analysis.stats.anova import check_scores, rm_anova
from analysis.stats.arrays import FloatArray, pingouin
from analysis.stats.diagnostics import residuals

TRIVIAL = "With two conditions there is one difference only: sphericity holds trivially and nothing is corrected."
NO_COVARIANCES = "There is no error variance, so there are no covariances to compare."
TOO_FEW = (
    "There are fewer participants than conditions: the covariance matrix of the contrasts is singular, so Mauchly's W "
    "and the Huynh-Feldt epsilon are undefined; the Greenhouse-Geisser epsilon is defined, but leans towards its bound."
)
SINGULAR = "A contrast of the conditions has no variance at all (W = 0), so Mauchly's chi-square is undefined."


@dataclass(frozen=True, slots=True, kw_only=True)
class Corrected:
    """The F test with both degrees of freedom multiplied by `epsilon`."""

    epsilon: float
    df: tuple[float, float]
    p: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphericity:
    """Mauchly's test and the two corrections; what is undefined is None, and `reason` says why."""

    W: float | None = None
    chi2: float | None = None
    df: int | None = None
    p: float | None = None
    greenhouse_geisser: Corrected | None = None
    huynh_feldt: Corrected | None = None
    reason: str | None = None


def sphericity(scores: ArrayLike) -> Sphericity:
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
    array = check_scores(scores)
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
    return Corrected(epsilon=epsilon, df=df, p=float(special.fdtrc(*df, anova.F)))
