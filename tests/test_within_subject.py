from __future__ import annotations

import math

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
    with pytest.raises(ValueError, match="at least 2 participants by 2 conditions"):
        cousineau_morey(np.zeros(shape))
