from __future__ import annotations

import math

import pytest
from scipy import integrate, stats

from analysis.stats.paired import SCALE, jzs_paired


def _by_effect_size(t: float, n: int, r: float) -> float:
    """The same factor another way: the noncentral t density of t, averaged over a Cauchy(0, r) effect size."""

    def density(effect: float) -> float:
        return float(stats.nct.pdf(t, n - 1, effect * math.sqrt(n)) * stats.cauchy.pdf(effect, scale=r))

    centre = t / math.sqrt(n)
    pieces = [-8.0, -2.0, 0.0, centre - 1.0, centre, centre + 1.0, centre + 4.0]
    total = sum(integrate.quad(density, a, b)[0] for a, b in zip(sorted(pieces), sorted(pieces)[1:], strict=False))
    return total / float(stats.t.pdf(t, n - 1))


@pytest.mark.slow
@pytest.mark.parametrize(("t", "n"), [(2.0, 14), (4.0, 14), (3.5, 20), (1.0, 30)])
def test_the_factor_is_the_average_likelihood_over_effect_sizes(t: float, n: int) -> None:
    assert jzs_paired(t, n) == pytest.approx(_by_effect_size(t, n, SCALE), rel=0.03)  # the tails of the prior are cut


@pytest.mark.parametrize(
    ("t", "n", "factor"),
    [
        (0.0, 14, 0.26992311),
        (4.0, 14, 27.531647),
        (15.0, 14, 6843048.5),
        (100.0, 5, 52626.48),
        (8.0, 1000, 9.628858e11),
        (2.0, 10_000, 0.083276676),
    ],
)
def test_the_factor_equals_equation_1_in_forty_digits(t: float, n: int, factor: float) -> None:
    # mpmath, 40 digits: quad of Rouder et al. (2009), equation 1, over log g, r = sqrt(2) / 2
    assert jzs_paired(t, n) == pytest.approx(factor, rel=1e-7)


def test_jasp_agrees() -> None:
    assert jzs_paired(3.5, 20, r=0.707) == pytest.approx(17.185, abs=5e-4)  # pingouin's documentation, against JASP


def test_the_sign_of_t_does_not_matter() -> None:
    assert jzs_paired(-2.5, 14) == jzs_paired(2.5, 14)


@pytest.mark.parametrize(("t", "n"), [(100.0, 1000), (40.0, 10_000), (100.0, 10_000), (101.0, 7), (-1e8, 3)])
def test_what_no_double_can_hold_or_pingouin_gets_wrong_is_none(t: float, n: int) -> None:
    assert jzs_paired(t, n) is None


@pytest.mark.parametrize(("t", "n"), [(math.inf, 14), (math.nan, 14), (2.0, 1)])
def test_no_t_or_no_people_is_refused(t: float, n: int) -> None:
    with pytest.raises(ValueError, match=r"t must be finite|n must be a whole number from 2"):
        jzs_paired(t, n)
