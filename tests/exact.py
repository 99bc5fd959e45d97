"""F in exact rational arithmetic of the stored doubles: the reference that no double-based program can beat."""

from __future__ import annotations

from fractions import Fraction

import numpy as np


def exact_rm_F(scores: np.ndarray) -> Fraction:
    """F of a (participants, conditions) table."""
    n, k = scores.shape
    x = [[Fraction(float(value)) for value in row] for row in scores]
    rows = [sum(row) / k for row in x]
    columns = [sum(x[i][j] for i in range(n)) / n for j in range(k)]
    grand = sum(rows) / n
    effect = n * sum((column - grand) ** 2 for column in columns) / (k - 1)
    error = sum((x[i][j] - rows[i] - columns[j] + grand) ** 2 for i in range(n) for j in range(k))
    return effect / (error / ((n - 1) * (k - 1)))


def exact_one_way_F(groups: list[np.ndarray]) -> Fraction:
    """F of groups of different people."""
    x = [[Fraction(float(value)) for value in group] for group in groups]
    total = sum(len(group) for group in x)
    grand = sum(sum(group) for group in x) / total
    means = [sum(group) / len(group) for group in x]
    effect = sum(len(group) * (mean - grand) ** 2 for group, mean in zip(x, means, strict=True)) / (len(x) - 1)
    error = sum((value - mean) ** 2 for group, mean in zip(x, means, strict=True) for value in group)
    return effect / (error / (total - len(x)))
