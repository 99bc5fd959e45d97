"""Our statistics against R's: aov, TukeyHSD, afex, emmeans, car, base R. No R is needed; golden/r/ holds its numbers.

R is another program, not the truth: a tolerance says where R's digits end. F and sums of squares agree to 12 digits, or
to each data set's `relative_tolerance` where R loses some to an offset. Tukey's p and critical values end earlier,
because R's `ptukey` does: 1 - a quadrature that is good to 2e-11 in the tail, 6e-6 of p at 5 degrees of freedom.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis import (
    Comparison,
    binomial_test,
    one_way_anova,
    rm_anova,
    rm_tukey_hsd,
    rm_tukey_hsd_paired,
    studentized_range_isf,
    studentized_range_sf,
    tukey_hsd,
)
from analysis.stats.diagnostics import effect_size, normality, sphericity
from analysis.stats.paired import friedman, paired_t_tests
from tests.golden.r import make_datasets

GOLDEN = Path(__file__).parent / "golden" / "r"
DATA = json.loads((GOLDEN / "datasets.json").read_text(encoding="utf-8"))
R = json.loads((GOLDEN / "expected.json").read_text(encoding="utf-8"))

PTUKEY_RELATIVE = 1e-5
"""Worst found 5.7e-6 (k = 3, df = 5, q = 7), where quadrature on a fine grid sides with us to 3e-14."""
PTUKEY_ABSOLUTE = 5e-11
"""Worst found 2.0e-11 (k = 2, df = 60, q = 7): R takes 1 less a sum; the same grid sides with us to 4e-15."""
QTUKEY_RELATIVE = 2e-6
"""R's search stops at steps of 1e-4. Worst found 7.8e-7 (df = 3); at 5 degrees of freedom and .01 it is 3.5e-5."""

Entry = dict[str, Any]


def _both(kind: str, part: str) -> pytest.MarkDecorator:
    """Every data set with R's `part`, where R has one."""
    pairs = [(data, found) for data, found in zip(DATA[kind], R[kind], strict=True) if found[part] is not None]
    return pytest.mark.parametrize(("data", "found"), [pytest.param(*pair, id=pair[0]["name"]) for pair in pairs])


def _near(expected: float, relative: float, absolute: float = 1e-15) -> Any:
    return pytest.approx(expected, rel=relative, abs=absolute)


def test_the_data_sets_are_those_that_the_script_makes() -> None:
    text = make_datasets.as_text(make_datasets.everything()) + "\n"
    assert (GOLDEN / "datasets.json").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(("kind", "least"), [("within", 20), ("between", 8)])
def test_every_data_set_has_its_numbers_from_R(kind: str, least: int) -> None:
    names = [data["name"] for data in DATA[kind]]
    assert names == [found["name"] for found in R[kind]]
    assert len(set(names)) == len(names) >= least


# ---- analysis of variance ----


@_both("within", "aov")
def test_the_repeated_measures_anova_is_that_of_aov_with_its_error_strata(data: Entry, found: Entry) -> None:
    ours, theirs, relative = rm_anova(data["scores"]), found["aov"], data["relative_tolerance"]
    total = ours.ss_participants + ours.ss_effect + ours.ss_error
    for name in ("ss_participants", "ss_effect", "ss_error"):
        assert getattr(ours, name) == _near(theirs[name], relative, 1e-15 * total), name
    assert (ours.df_effect, ours.df_error) == (theirs["df_effect"], theirs["df_error"])
    assert _near(theirs["F"], relative) == ours.F
    assert ours.p == _near(theirs["p"], 10 * relative)  # a tail changes faster than its F


@_both("within", "afex")
def test_afex_finds_the_same_F_and_the_same_effect_sizes(data: Entry, found: Entry) -> None:
    anova, theirs, relative = rm_anova(data["scores"]), found["afex"], data["relative_tolerance"]
    ours = effect_size(anova)
    assert _near(theirs["F"], relative) == anova.F
    assert anova.p == _near(theirs["p"], 10 * relative)
    assert anova.ms_error == _near(theirs["ms_error"], relative, 0.0)
    assert ours.partial_eta_squared == _near(theirs["pes"], relative)
    assert ours.generalized_eta_squared == _near(theirs["ges"], relative)


@_both("between", "aov")
def test_the_anova_of_groups_is_that_of_aov(data: Entry, found: Entry) -> None:
    ours, theirs, relative = one_way_anova(data["groups"]), found["aov"], data["relative_tolerance"]
    assert ours.ss_effect == _near(theirs["ss_effect"], relative)
    assert ours.ss_error == _near(theirs["ss_error"], relative)
    assert (ours.df_effect, ours.df_error) == (theirs["df_effect"], theirs["df_error"])
    assert _near(theirs["F"], relative) == ours.F
    assert ours.p == _near(theirs["p"], 10 * relative)
    assert _near(found["afex"]["F"], relative) == ours.F


# ---- Tukey's test ----


def _compare_pairs(ours: Sequence[Comparison], rows: list[Entry], data: Entry, df: int) -> None:
    relative = data["relative_tolerance"]
    by_pair = {(pair.a, pair.b): pair for pair in ours}
    largest = max(abs(value) for row in data.get("scores", data.get("groups")) for value in row)
    assert len(by_pair) == len(rows)
    for row in rows:
        pair = by_pair[row["a"], row["b"]]
        assert pair.difference == _near(row["difference"], relative, 1e-14 * largest)
        if "t" in row:
            assert pair.q == _near(np.sqrt(2) * abs(row["t"]), relative, 1e-12)
            assert df == pytest.approx(row["df"], rel=1e-9)
        _compare_p_and_interval(pair, row, relative, df)


def _compare_p_and_interval(pair: Comparison, row: Entry, relative: float, df: int) -> None:
    if df == 1 and row["p"] is None:  # R's ptukey and qtukey begin at 2
        return
    assert pair.p == _near(row["p"], PTUKEY_RELATIVE, PTUKEY_ABSOLUTE)
    slack = QTUKEY_RELATIVE * (row["ci_high"] - row["ci_low"]) / 2
    assert (pair.ci_low, pair.ci_high) == _near((row["ci_low"], row["ci_high"]), relative, slack)


@pytest.mark.slow
@_both("within", "tukey_hsd")
def test_the_pooled_Tukey_test_is_TukeyHSD_of_participants_and_conditions(data: Entry, found: Entry) -> None:
    _compare_pairs(rm_tukey_hsd(data["scores"]), found["tukey_hsd"], data, found["aov"]["df_error"])


@pytest.mark.slow
@_both("within", "emmeans_univariate")
def test_the_pooled_Tukey_test_is_emmeans_on_the_univariate_model(data: Entry, found: Entry) -> None:
    _compare_pairs(rm_tukey_hsd(data["scores"]), found["emmeans_univariate"], data, found["aov"]["df_error"])


@pytest.mark.slow
@_both("within", "emmeans_multivariate")
def test_the_paired_Tukey_test_is_emmeans_on_the_multivariate_model(data: Entry, found: Entry) -> None:
    scores = data["scores"]
    _compare_pairs(rm_tukey_hsd_paired(scores), found["emmeans_multivariate"], data, len(scores) - 1)


@_both("between", "tukey_hsd")
def test_the_Tukey_test_of_groups_is_TukeyHSD(data: Entry, found: Entry) -> None:
    _compare_pairs(tukey_hsd(data["groups"]), found["tukey_hsd"], data, found["aov"]["df_error"])


@pytest.mark.parametrize("df", DATA["studentized_range"]["ptukey"]["df"])
def test_the_studentized_range_is_ptukey_as_far_as_its_quadrature_goes(df: float) -> None:
    k, _, q, p = np.array([row for row in R["ptukey"] if row[1] == df]).T
    assert p.size >= 50
    np.testing.assert_allclose(studentized_range_sf(q, k, df), p, rtol=PTUKEY_RELATIVE, atol=PTUKEY_ABSOLUTE)


@pytest.mark.parametrize(("df", "relative"), [(5, 5e-5), (13, 2e-7), (26, 2e-7), (200, 2e-7)])
def test_the_critical_values_are_those_of_qtukey(df: float, relative: float) -> None:
    k, _, alpha, q = np.array([row for row in R["qtukey"] if row[1] == df]).T
    assert q.size == 12
    np.testing.assert_allclose(studentized_range_isf(alpha, k, df), q, rtol=relative)


# ---- sphericity ----


@_both("within", "car_sphericity")
def test_Mauchlys_test_and_both_epsilons_are_those_of_car(data: Entry, found: Entry) -> None:
    ours, theirs, relative = sphericity(data["scores"]), found["car_sphericity"], data["relative_tolerance"]
    assert (ours.W, ours.p) == _near((theirs["mauchly_W"], theirs["mauchly_p"]), 10 * relative, 0.0)
    assert ours.greenhouse_geisser.epsilon == _near(theirs["gg_epsilon"], relative)
    assert ours.greenhouse_geisser.p == _near(theirs["gg_p"], 10 * relative)
    assert ours.huynh_feldt.epsilon == _near(min(theirs["hf_epsilon"], 1.0), relative)  # car reports it beyond 1
    assert ours.huynh_feldt.p == _near(theirs["hf_p"], 10 * relative)


@pytest.mark.slow
@pytest.mark.parametrize("correction", ["greenhouse_geisser", "huynh_feldt"])
@_both("within", "car_sphericity")
def test_afex_corrects_the_degrees_of_freedom_and_p_as_we_do(data: Entry, found: Entry, correction: str) -> None:
    ours = getattr(sphericity(data["scores"]), correction)
    theirs = found[{"greenhouse_geisser": "afex_gg", "huynh_feldt": "afex_hf"}[correction]]
    relative = data["relative_tolerance"]
    assert ours.df == _near((theirs["df_effect"], theirs["df_error"]), relative)
    assert ours.p == _near(theirs["p"], 10 * relative)


@_both("within", "base_sphericity")
def test_the_epsilons_are_those_of_base_R_which_goes_on_with_few_participants(data: Entry, found: Entry) -> None:
    ours, theirs, relative = sphericity(data["scores"]), found["base_sphericity"], data["relative_tolerance"]
    assert ours.greenhouse_geisser.epsilon == _near(theirs["gg_epsilon"], 100 * relative)
    assert ours.greenhouse_geisser.p == _near(theirs["gg_p"], 1e5 * relative)  # its F loses twice an offset's digits
    if len(data["scores"]) >= len(data["scores"][0]):  # below, base R hands out an epsilon that may be negative
        assert ours.huynh_feldt.epsilon == _near(min(theirs["hf_epsilon"], 1.0), 100 * relative)


def test_where_car_gives_no_sphericity_we_say_why_except_where_only_the_scale_stopped_it() -> None:
    pairs = zip(DATA["within"], R["within"], strict=True)
    without = [data for data, found in pairs if found["car_sphericity"] is None]
    unexplained = [data["name"] for data in without if sphericity(data["scores"]).reason is None]
    assert len(without) == 6
    assert unexplained == ["tiny numbers"]  # car takes variances of 1e-12 for none


# ---- pairs and ranks ----


@_both("within", "paired_t")
def test_the_paired_t_tests_and_Holms_p_are_those_of_pairwise_t_test(data: Entry, found: Entry) -> None:
    ours = {(pair.a, pair.b): pair for pair in paired_t_tests(data["scores"])}
    assert len(ours) == len(found["paired_t"])
    for row in found["paired_t"]:
        pair = ours[row["a"], row["b"]]
        assert (pair.t, pair.p, pair.p_holm) == _near((row["t"], row["p"], row["p_holm"]), 1e-12)


@_both("within", "friedman")
def test_Friedmans_test_is_that_of_friedman_test_ties_included(data: Entry, found: Entry) -> None:
    ours, theirs = friedman(data["scores"]), found["friedman"]
    if len(data["scores"][0]) == 2:
        assert ours.chi2 is None
        assert ours.reason is not None
        return
    assert (ours.chi2, ours.df, ours.p) == _near((theirs["chi_squared"], theirs["df"], theirs["p"]), 1e-11)


@_both("within", "shapiro_residuals")
def test_the_residuals_test_as_normal_as_in_shapiro_test(data: Entry, found: Entry) -> None:
    ours, theirs = normality(data["scores"]), found["shapiro_residuals"]
    assert ours.p == _near(theirs["p"], 1e-6)  # AS R94's coefficients have few digits, and R and scipy differ in them
    assert _near(theirs["W"], 1e-8) == ours.W


# ---- binomial ----


def test_the_binomial_test_and_its_interval_are_those_of_binom_test() -> None:
    table = np.array(R["binom_test"], dtype=float)
    for confidence in np.unique(table[:, 3]):
        k, n, p0, _, p, low, high = table[table[:, 3] == confidence].T
        ours = binomial_test(k, n, p0, confidence=confidence)
        assert ours.p == _near(p, 1e-12, 0.0)
        assert ours.ci_low == _near(low, 1e-13, 0.0)
        assert ours.ci_high == _near(high, 1e-13, 0.0)
