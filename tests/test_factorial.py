"""ANOVAs of several factors, against R's afex, statsmodels and sums of squares spelled out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.anova import AnovaRM

from analysis.stats.anova import F_UNDEFINED, NO_ERROR, rm_anova
from analysis.stats.factorial import factorial_anova


def drawn(*shape):
    return np.random.default_rng(4).normal(size=shape) + np.arange(shape[-1])


def test_two_factors_within_people_are_those_of_statsmodels():
    scores = drawn(9, 2, 4)
    found = factorial_anova(scores, ("damper", "voltage"))
    who, one, other = (part.ravel() for part in np.indices(scores.shape))
    table = pd.DataFrame({"who": who, "one": one, "other": other, "score": scores.ravel()})
    theirs = AnovaRM(table, "score", "who", within=["one", "other"]).fit().anova_table
    assert [effect.source for effect in found] == [("damper",), ("voltage",), ("damper", "voltage")]
    assert [effect.F for effect in found] == pytest.approx(list(theirs["F Value"]), rel=1e-9)
    assert [effect.df for effect in found] == [*zip(theirs["Num DF"], theirs["Den DF"], strict=True)]
    assert [effect.p for effect in found] == pytest.approx(list(theirs["Pr > F"]), rel=1e-8)
    assert all(0 < effect.size < 1 for effect in found)


OFFSETS = [0.0, 0.3, 1e6]
SCALES = [1.0, 0.1, 1e200, 1e-200]


@pytest.mark.slow
@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("people", [6, 14])
def test_rounding_is_no_effect(people, scale, offset):
    same = scale * (np.full((people, 3), 4.0) + offset)
    groups = ["one", "two"] * (people // 2)
    for effect in factorial_anova(same, ["grip", "method"], groups):
        assert (np.isnan([effect.F, effect.p, effect.size]).all(), effect.reason) == (True, F_UNDEFINED)

    own = np.random.default_rng(people).integers(1, 7, people)[:, None, None]
    scores = scale * (own + np.array([0.0, 1.0])[:, None] + np.zeros(3) + offset)
    damper, voltage, both = factorial_anova(scores, ["damper", "voltage"])
    assert (damper.F, damper.p, damper.reason) == (np.inf, 0.0, NO_ERROR)
    assert 0 < damper.size < 1
    assert {voltage.reason, both.reason} == {F_UNDEFINED}


@pytest.mark.parametrize("scale", SCALES)
def test_no_f_hangs_on_the_scale(scale):
    scores = drawn(9, 2, 4)
    found, scaled = (factorial_anova(one, ("damper", "voltage")) for one in (scores, scale * scores))
    assert [one.F for one in scaled] == pytest.approx([one.F for one in found], rel=1e-9)
    assert not any(one.reason for one in found)


def test_a_factor_with_two_levels_needs_no_correction():
    damper, voltage, both = factorial_anova(drawn(9, 2, 4), ("damper", "voltage"))
    assert damper.epsilon == pytest.approx(1)
    assert 1 / 3 <= voltage.epsilon < 1
    assert both.p_gg >= 0


def test_a_mixed_anova_is_its_sums_of_squares():
    n, k = 12, 3
    scores = drawn(n, k)
    group = ["one"] * 6 + ["two"] * 6
    scores[:6] += np.array([0.0, 0.4, 0.9])
    halves, grand = scores.reshape(2, 6, k), scores.mean()
    people, cells = scores.mean(axis=1).reshape(2, 6), halves.mean(axis=1)
    of_groups, of_levels = cells.mean(axis=1), scores.mean(axis=0)
    ss_group = 6 * k * ((of_groups - grand) ** 2).sum()
    ss_people = k * ((people - of_groups[:, None]) ** 2).sum()
    ss_levels = n * ((of_levels - grand) ** 2).sum()
    ss_both = 6 * ((cells - of_groups[:, None] - of_levels + grand) ** 2).sum()
    ss_error = ((halves - people[:, :, None] - cells[:, None, :] + of_groups[:, None, None]) ** 2).sum()
    expected = [
        (ss_group / 1) / (ss_people / 10),
        (ss_levels / 2) / (ss_error / 20),
        (ss_both / 2) / (ss_error / 20),
    ]
    found = factorial_anova(scores, ("grip", "method"), group)
    assert [effect.F for effect in found] == pytest.approx(expected, rel=1e-9)
    assert [effect.df for effect in found] == [(1, 10), (2, 20), (2, 20)]
    assert found[0].p == pytest.approx(stats.f.sf(expected[0], 1, 10), rel=1e-9)


def test_a_mixed_anovas_group_effect_is_that_of_the_means_of_people():
    scores = drawn(10, 3)
    group = ["a"] * 5 + ["b"] * 5
    means = scores.mean(axis=1)
    assert (
        pytest.approx(stats.f_oneway(means[:5], means[5:]).statistic, rel=1e-9)
        == factorial_anova(scores, ("g", "m"), group)[0].F
    )


def test_with_one_level_more_of_nothing_it_is_the_one_factor_anova():
    scores = drawn(9, 3)
    both = np.stack([scores, scores + np.random.default_rng(1).normal(size=(9, 1))], axis=1)
    assert pytest.approx(float(rm_anova(both.mean(axis=1)).F), rel=1e-9) == factorial_anova(both, ("x", "y"))[1].F


@pytest.mark.parametrize("shape", [(1, 2, 2), (5, 1, 2), (5, 2)])
def test_too_few_of_anything_is_refused(shape):
    with pytest.raises(ValueError, match="scores must be"):
        factorial_anova(np.zeros(shape), ("a", "b"))


def test_groups_of_one_are_refused():
    with pytest.raises(ValueError, match="two groups of two"):
        factorial_anova(np.zeros((3, 2)), ("g", "m"), ["a", "a", "b"])


R = Path(__file__).parent / "golden" / "r"
SETS = json.loads((R / "factorial.json").read_text())
BY_AFEX = json.loads((R / "factorial_expected.json").read_text())["found"]


FACTORS = {"within": ("one", "two"), "mixed": ("two",), "three within": ("one", "two", "three"),
           "two within, one between": ("two", "three"), "between": ()}  # fmt: skip
"""Which factors of a set vary within people; where not all of those do that it has, `one` varies between them."""


def by_us(rows, kind):
    table, within = pd.DataFrame(rows), [*FACTORS[kind]]
    shape = [table[name].nunique() for name in ("who", *within)]
    scores = table.sort_values(["who", *within])["score"].to_numpy().reshape(shape)
    if "one" in within:
        return factorial_anova(scores, within)
    return factorial_anova(scores, ["one", *within], list(table.groupby("who")["one"].first()))


@pytest.mark.parametrize("name", SETS)
def test_the_numbers_are_those_of_afex(name):
    found = {":".join(effect.source): effect for effect in by_us(SETS[name]["rows"], SETS[name]["kind"])}
    assert set(found) == {row["effect"] for row in BY_AFEX[name]}
    for row in BY_AFEX[name]:
        ours = found[row["effect"]]
        assert list(ours.df) == row["df"]
        assert pytest.approx(row["F"], rel=1e-8) == ours.F
        assert ours.p == pytest.approx(row["p"], rel=1e-7)
        assert ours.size == pytest.approx(row["ges"], rel=1e-6)
        if isinstance(row["epsilon"], float):
            assert ours.epsilon == pytest.approx(row["epsilon"], rel=1e-6)
            assert ours.p_gg == pytest.approx(row["p_gg"], rel=1e-6)
