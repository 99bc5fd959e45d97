"""F and q in exact rational arithmetic of the stored doubles: the reference that no double-based program can beat."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from mpmath import mp

from analysis import Anova


def digits(found: float, exact: Fraction) -> float:
    """Correct digits of `found`, the log relative error of McCullough 1998; at most 17."""
    error = abs(Fraction(found) / exact - 1) if exact else abs(Fraction(found))
    return min(17.0, -math.log10(error)) if error else 17.0


def p_digits(found: Anova) -> float:
    """Correct digits of p for its F as it stands, by mpmath's beta integral; 17 where p is no normal double."""
    with mp.workdps(40):
        a, b, F = mp.mpf(found.df_effect), mp.mpf(found.df_error), mp.mpf(found.F)
        exact = mp.betainc(b / 2, a / 2, 0, b / (b + a * F), regularized=True)
        if exact < mp.mpf("1e-300"):
            return 17.0 if found.p < 1e-299 else 0.0
        return float(min(17, -mp.log10(abs(found.p / exact - 1) + mp.mpf("1e-17"))))


def exact_rm_F(scores: np.ndarray) -> Fraction:
    """F of a (participants, conditions) table."""
    effect, error = exact_rm_mean_squares(scores)
    return effect / error


def exact_rm_mean_squares(scores: np.ndarray) -> tuple[Fraction, Fraction]:
    """Mean squares of effect and error of a (participants, conditions) table."""
    n, k = scores.shape
    x = [[Fraction(float(value)) for value in row] for row in scores]
    rows = [sum(row) / k for row in x]
    columns = [sum(x[i][j] for i in range(n)) / n for j in range(k)]
    grand = sum(rows) / n
    effect = n * sum((column - grand) ** 2 for column in columns) / (k - 1)
    error = sum((x[i][j] - rows[i] - columns[j] + grand) ** 2 for i in range(n) for j in range(k))
    return effect, error / ((n - 1) * (k - 1))


def exact_squared_q(scores: np.ndarray, a: int, b: int) -> Fraction:
    """q^2 of two conditions on the pooled error: (m_a - m_b)^2 / (MS_error / n)."""
    n = len(scores)
    difference = sum(Fraction(float(row[a])) - Fraction(float(row[b])) for row in scores) / n
    return difference**2 / (exact_rm_mean_squares(scores)[1] / n)


def exact_one_way_F(groups: list[np.ndarray]) -> Fraction:
    """F of groups of different people."""
    effect, error = exact_between_mean_squares(groups)
    return effect / error


def exact_squared_group_q(groups: list[np.ndarray], a: int, b: int) -> Fraction:
    """Tukey and Kramer's q^2 of two groups: (m_a - m_b)^2 / (MS_error / 2 (1/n_a + 1/n_b))."""
    first, second = ([Fraction(float(value)) for value in groups[i]] for i in (a, b))
    difference = sum(first) / len(first) - sum(second) / len(second)
    share = (Fraction(1, len(first)) + Fraction(1, len(second))) / 2
    return difference**2 / (exact_between_mean_squares(groups)[1] * share)


def exact_between_mean_squares(groups: list[np.ndarray]) -> tuple[Fraction, Fraction]:
    """Mean squares of effect and error of groups of different people."""
    x = [[Fraction(float(value)) for value in group] for group in groups]
    total = sum(len(group) for group in x)
    grand = sum(sum(group) for group in x) / total
    means = [sum(group) / len(group) for group in x]
    effect = sum(len(group) * (mean - grand) ** 2 for group, mean in zip(x, means, strict=True)) / (len(x) - 1)
    error = sum((value - mean) ** 2 for group, mean in zip(x, means, strict=True) for value in group)
    return effect, error / (total - len(x))
