from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import stats

from analysis.stats.diagnostics import cousineau_morey


def test_of_two_conditions_the_interval_is_that_of_the_paired_difference_over_root_two() -> None:
    """Morey 2008: the correction makes the within-subject interval of k = 2 agree with the paired t test."""
    scores = np.random.default_rng(1).normal(size=(14, 2)).cumsum(axis=1)
    found = cousineau_morey(scores)
    paired = stats.ttest_1samp(scores[:, 1] - scores[:, 0], 0.0).confidence_interval(0.95)
    half = (paired.high - paired.low) / 2.0
    assert found.ci_high - found.means == pytest.approx([half / math.sqrt(2.0)] * 2)
    assert found.means - found.ci_low == pytest.approx([half / math.sqrt(2.0)] * 2)


def test_what_people_differ_by_changes_nothing_but_the_means() -> None:
    rng = np.random.default_rng(2)
    scores = rng.normal(size=(9, 4))
    shifted = scores + rng.normal(0.0, 50.0, size=(9, 1))
    before, after = cousineau_morey(scores), cousineau_morey(shifted)
    assert after.ci_high - after.ci_low == pytest.approx(before.ci_high - before.ci_low)


@pytest.mark.parametrize("shape", [(1, 3), (3, 1), (3,)])
def test_too_few_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"at least 2 participants and 2 conditions|two axes"):
        cousineau_morey(np.zeros(shape))


def exact_half_widths(scores: np.ndarray, confidence: float = 0.95) -> list[float]:
    """In rationals of the doubles but for the last square root and t."""
    n, k = scores.shape
    x = [[Fraction(float(value)) for value in row] for row in scores]
    grand = sum(map(sum, x)) / (n * k)
    normed = [[value - sum(row) / k + grand for value in row] for row in x]
    t = float(stats.t.isf((1 - confidence) / 2, n - 1))
    widths = []
    for column in zip(*normed, strict=True):
        mean = sum(column) / n
        square = sum((value - mean) ** 2 for value in column) / (n - 1) / n * k / (k - 1)
        shift = max(square.denominator.bit_length() - square.numerator.bit_length(), -1000) // 2
        widths.append(math.ldexp(t * math.sqrt(square * Fraction(4) ** shift), -shift))
    return widths


@pytest.mark.parametrize("offset", [0.0, 1e6, 1e12, 1e14, -1e15])
@pytest.mark.parametrize("scale", [1.0, 2.0**-990, 2.0**960])
def test_the_half_widths_keep_their_digits_at_every_offset_and_scale(offset: float, scale: float) -> None:
    scores = (offset + np.random.default_rng(5).normal(size=(9, 4))) * scale
    assert cousineau_morey(scores).half_widths == pytest.approx(exact_half_widths(scores), rel=1e-13)


def test_numbers_at_either_end_of_the_doubles_have_intervals() -> None:
    scores = np.array([[1.0, 2.0, 4.0], [2.0, 2.0, 6.0], [3.0, 5.0, 5.0]])
    widths = cousineau_morey(scores).half_widths
    for scale in (1e-300, 1e300):
        found = cousineau_morey(scores * scale)
        assert found.half_widths / scale == pytest.approx(widths, rel=1e-12)
        assert found.ci_high == pytest.approx(found.means + found.half_widths)
