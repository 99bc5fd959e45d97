"""The bound of a threshold's error is the least over all placements of trials: by brute force, and in a book."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.stats import norm

from tests.threshold_bound import threshold_bound, width_of

RATES = [(0.5, 0.0), (0.5, 0.02), (1 / 3, 0.1), (0.02, 0.02), (0.0, 0.0), (0.0, 0.1)]


@pytest.mark.parametrize(("guess", "lapse"), RATES)
def test_no_placement_of_trials_beats_the_bound(guess: float, lapse: float) -> None:
    """Elfving's theorem as a linear programme: the farthest (t, 0) in the hull of ± s(z) (1, z) has 1/t² = n var."""
    z = np.linspace(-5, 5, 401)
    share = guess + (1 - guess - lapse) * norm.cdf(z)
    told = (1 - guess - lapse) * norm.pdf(z) / np.sqrt(share * (1 - share))
    places = np.concatenate([np.stack([told, told * z]), -np.stack([told, told * z])], axis=1)
    found = linprog(-places[0], A_eq=np.stack([np.ones(802), places[1]]), b_eq=[1, 0])
    best = threshold_bound(100, width=width_of(2.0), guess=guess, lapse=lapse)
    assert 2.0 / -found.fun / 10 == pytest.approx(best, rel=1e-9)


def test_the_bound_of_a_mean_is_that_of_probit_analysis() -> None:
    """Finney (1971, table 3.2): the weight of a probit of 5 is 2/π."""
    assert threshold_bound(50, width=width_of(3.0), guess=0, lapse=0) == pytest.approx(3 / np.sqrt(50 * 2 / np.pi))


def test_the_bound_is_that_of_the_docs() -> None:
    assert threshold_bound(80, width=width_of(2.0), guess=0.5, lapse=0.02) == pytest.approx(0.512, abs=5e-4)
