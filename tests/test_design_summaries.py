"""The statistics of designs, of data whose truth is known: drawn by laws, or spelled out."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.logs.exclusions import IN_NO_TEST, LeftOut
from analysis.report.figures import style
from analysis.stats.anova import rm_anova, rm_tukey_hsd
from analysis.stats.diagnostics import sphericity
from analysis.summary.assumptions import not_spherical
from analysis.summary.designs import summarise
from analysis.summary.figures.designs import figure_design
from analysis.summary.question_results import DesignTest
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.designs import lacking_conditions, result_sentences, sections_of_designs
from analysis.summary.sections.exclusion_words import people_left_out
from experiments.config.door import checked_table
from experiments.synthetic.laws import SyntheticAnswers
from tests.designs import design
from tests.figure_files import touching
from tests.tables_of_designs import loaded, simulated


def of(name, count=24):
    config, laws = loaded(name)
    return config, summarise(config, simulated(config, laws, count))


@pytest.mark.slow
def test_rates_by_condition_have_the_counts_and_the_exact_test_of_their_rows():
    config, laws = loaded("direction")
    table = simulated(config, laws, 14)
    found = summarise(config, table).questions["response"]
    assert len(found.cells) == 6
    for cell in found.cells:
        rows = table[(table["method"] == cell.levels["method"]) & (table["direction"] == cell.levels["direction"])]
        test = stats.binomtest(int(rows["correct"].sum()), len(rows), 0.5)
        assert (cell.right, cell.trials, cell.people) == (rows["correct"].sum(), 140, 14)
        assert cell.p == pytest.approx(test.pvalue, rel=1e-9)
        low, high = test.proportion_ci()
        assert (cell.ci_low, cell.ci_high) == pytest.approx((low, high), rel=1e-6)


def test_two_factors_within_people_give_three_effects():
    _, found = of("realism")
    tests = {test.effect: test for test in found.questions["realism"].tests}
    assert list(tests) == ["damper", "voltage_V", "damper × voltage_V"]
    assert tests["damper"].p < 0.001
    assert tests["voltage_V"].df == (2, 46)
    assert tests["voltage_V"].p < 0.001


def test_one_factor_within_people_is_its_anova_and_ranks():
    config, laws = loaded("preference")
    table = simulated(config, laws, 14)
    found = summarise(config, table).questions["rating"]
    methods = ["vibration", "asymmetric-1", "asymmetric-2"]  # in the order of the design
    scores = table.pivot_table(index="participant_id", columns="method", values="rating")[methods].to_numpy()
    anova, friedman, *pairs = found.tests
    by_hand = rm_tukey_hsd(scores, methods)
    assert [(one.name, one.effect) for one in pairs] == [("tukey", f"{one.a} – {one.b}") for one in by_hand]
    assert [one.p for one in pairs] == [float(one.p) for one in by_hand]
    assert pairs[0].df == (3, 26)
    assert anova.statistic == pytest.approx(float(rm_anova(scores).F), rel=1e-12)
    assert friedman.statistic == pytest.approx(stats.friedmanchisquare(*scores.T).statistic, rel=1e-9)
    assert "comment" not in summarise(config, table).questions


def test_groups_give_a_mixed_anova():
    _, found = of("grip")
    tests = {test.effect: test for test in found.questions["realism"].tests}
    assert list(tests) == ["grip", "method", "grip × method"]
    assert tests["grip"].df == (1, 22)
    assert tests["method"].p < 0.001


def test_the_exponent_of_numbers_is_found():
    _, found = of("magnitude")
    cells, tests = found.questions["strength"].cells, {test.name: test for test in found.questions["strength"].tests}
    assert tests["exponent"].ci_low < 1.2 < tests["exponent"].ci_high
    assert tests["exponent"].statistic == pytest.approx(1.2, abs=0.1)
    assert [cell.mean for cell in cells] == sorted(cell.mean for cell in cells)


def test_numbers_are_averaged_as_their_logarithms():
    config = design(
        factors={"method": {"levels": ["a"]}},
        questions={"q": {"kind": "number", "text": "?"}},
        order={"repetitions": 2},
    )
    table = pd.DataFrame({"participant_id": ["P1", "P1"], "method": ["a", "a"], "q": [2.0, 8.0]})
    (cell,) = summarise(config, table).questions["q"].cells
    assert cell.mean == pytest.approx(4.0)


@pytest.mark.slow
def test_detection_has_a_sensitivity_and_a_criterion():
    _, found = of("detection")
    tests = {test.name: test for test in found.questions["felt"].tests}
    assert tests["d_prime"].statistic > 1
    assert "criterion" in tests
    assert any(not cell.levels for cell in found.questions["felt"].cells)  # catch trials have no level


@pytest.mark.slow
def test_two_intervals_have_the_d_prime_of_their_task():
    config, laws = loaded("stronger")
    table = simulated(config, laws, 10)
    found = summarise(config, table).questions["stronger"]
    d_prime, *by_condition = [test for test in found.tests if test.name == "d_prime"]
    assert d_prime.statistic == pytest.approx(math.sqrt(2) * stats.norm.ppf(table["correct"].mean()), rel=1e-9)
    right = table.groupby("voltage_V")["correct"].mean()
    assert [one.effect for one in by_condition] == [f"voltage_V {level:g}" for level in right.index]
    within = [(one.statistic, share) for one, share in zip(by_condition, right, strict=True) if share < 1]
    assert within
    for statistic, share in within:
        assert statistic == pytest.approx(math.sqrt(2) * stats.norm.ppf(share), rel=1e-9)


@pytest.mark.slow
def test_pairs_are_described_in_the_order_in_which_they_were_felt():
    _, found = of("pairs")
    cells = found.questions["rather"].cells
    assert {tuple(cell.levels) for cell in cells} == {("method_1", "method_2")}
    assert sum(cell.trials for cell in cells) == 24 * 20


def test_pairs_that_came_in_one_order_leave_nobody_out():
    config, laws = loaded("pairs")
    table = simulated(config, laws, 4)
    once = table[table["method_1"] < table["method_2"]]
    found = summarise(
        config, pd.concat([once[once["participant_id"] != "P03"], table[table["participant_id"] == "P03"]])
    )
    assert found.questions["rather"].left_out == ()


def test_answers_are_counted_by_question_and_guns_by_trial():
    config, laws = loaded("realism")
    table = simulated(config, laws, 3)
    table["gun"] = "simulated"
    first, second = config.questions
    table[f"{first}_by"], table[f"{second}_by"] = "experimenter", "participant"
    table.loc[0, second] = np.nan
    found = summarise(config, table).origin
    assert found.answers == {"experimenter": len(table), "participant": len(table) - 1}
    assert found.guns == {"simulated": len(table)}


def test_whoever_lacks_a_condition_is_named_and_in_no_test():
    config, laws = loaded("preference")
    table = simulated(config, laws, 6)
    table.loc[0, "rating"] = np.nan
    summary = summarise(config, table)
    found = summary.questions["rating"]
    assert found.left_out == (table.loc[0, "participant_id"],)
    assert found.tests[0].df == (2, 8)
    assert sum(cell.trials for cell in found.cells) == 17
    told = next(result_sentences("preference", summary))
    assert "(6 participants, 5 in its tests): " in told
    assert [told.count(f", n = {people}") for people in (5, 6)] == [1, 2]
    gone = LeftOut(experiment="preference", participant="P00", reason="no answer", rule=IN_NO_TEST)
    report = ReportData(title="", statistics=StudyStatistics(excluded=(gone,)))
    assert people_left_out(report, "preference", frozenset({"P00", "P01"})).endswith("was left out of its tests.")
    assert people_left_out(report, "direction", frozenset({"P01"})) == "Nobody was left out."


def test_whoever_answered_a_question_never_is_named_as_well():
    config, laws = loaded("preference")
    table = simulated(config, laws, 6)
    table.loc[0, "rating"] = np.nan
    table.loc[table["participant_id"] == "P03", "rating"] = np.nan
    found = summarise(config, table)
    assert found.questions["rating"].left_out == ("P00", "P03")
    assert found.questions["rating"].tests[0].df == (2, 6)
    assert [*lacking_conditions(found)] == ["In no test of rating, with no answer in some condition: P00, P03."]


def test_numbers_of_0_or_less_are_told_and_no_missing_answers():
    config, laws = loaded("magnitude")
    table = simulated(config, laws, 6)
    level = table["pulse_s"].iloc[0]
    for who, number in (("P02", 0.0), ("P04", -3.0)):
        table.loc[(table["participant_id"] == who) & (table["pulse_s"] == level), "strength"] = number
    found = summarise(config, table)
    asked = found.questions["strength"]
    shots = int((table["pulse_s"] == level).sum()) // 6
    assert (asked.left_out, asked.not_above_0) == (("P02", "P04"), 2 * shots)
    assert [*lacking_conditions(found)] == [
        "In no test of strength, with no number above 0 in some condition: P02, P04.",
        f"In no mean and no test of strength: {2 * shots} numbers of 0 or less, which have no logarithm.",
    ]


def test_numbers_by_methods_have_no_exponent():
    questions = {"q": {"kind": "number", "text": "?"}}
    config = design(factors={"method": {"levels": ["a", "b", "c"]}}, questions=questions)
    rows = [(f"P{n}", method, float(n + k)) for n in range(1, 5) for k, method in enumerate("abc")]
    found = summarise(config, pd.DataFrame(rows, columns=["participant_id", "method", "q"]))
    assert [test.name for test in found.questions["q"].tests] == ["anova", "tukey", "tukey", "tukey"]


def test_an_effect_that_is_the_same_in_everybody_is_told_as_a_test():
    config, laws = loaded("preference")
    table = simulated(config, laws, 4)
    table["rating"] = table["method"].map({"vibration": 2.0, "asymmetric-1": 5.0, "asymmetric-2": 8.0})
    (told,) = result_sentences("preference", summarise(config, table))
    assert "significant effect of method, F(2, 6) = ∞, p < .001" in told
    assert "No test of method" not in told


def test_a_single_person_is_described_and_not_tested():
    config, laws = loaded("preference")
    found = summarise(config, simulated(config, laws, 1)).questions["rating"]
    assert [test.reason for test in found.tests] == ["fewer than two people have all conditions"]
    assert all(cell.sd is None for cell in found.cells)


def test_a_group_of_one_is_not_tested():
    config, laws = loaded("grip")
    (test,) = summarise(config, simulated(config, laws, 3)).questions["realism"].tests
    assert test.reason == "a group has fewer than two people"


RATED = {"q": {"kind": "rating", "text": "?", "minimum": 1.0, "maximum": 7.0, "grain": 1.0}}


def effects_of(count=6, **factors):
    """What is tested of a rating by these factors, each of two levels."""
    config = design(factors={"method": {"levels": ["a"]}, **factors}, questions=RATED)
    laws = {"questions": {"q": {"law": "ratings", "mean": {"all": 4.0}, "noise_sd": 1.0}}}
    table = simulated(config, checked_table(SyntheticAnswers, laws, "laws.toml"), count)
    return summarise(config, table).questions["q"].tests


def test_three_factors_within_people_give_seven_effects():
    levels = {"levels": [1.0, 2.0]}
    found = effects_of(posture=levels, voltage_V=levels, pulse_s=levels)
    assert [test.effect for test in found] == [
        "posture", "voltage_V", "pulse_s", "posture × voltage_V", "posture × pulse_s", "voltage_V × pulse_s",
        "posture × voltage_V × pulse_s",
    ]  # fmt: skip
    assert {test.df for test in found} == {(1, 5)}


def test_a_factor_that_varies_between_people_alone_is_tested():
    (found,) = effects_of(6, grip={"levels": ["one", "two"], "between": True})
    assert (found.effect, found.df) == ("grip", (1, 4))


def test_groups_and_two_factors_within_people_give_seven_effects():
    levels = {"levels": [1.0, 2.0]}
    found = effects_of(8, grip={"levels": ["one", "two"], "between": True}, posture=levels, voltage_V=levels)
    assert len(found) == 7
    assert {test.df for test in found} == {(1, 6)}


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ({name: {"levels": ["x", "y"]} for name in "abcde"}, "more than 4 factors within people are not tested here"),
        (
            {name: {"levels": ["x", "y"], "between": True} for name in "ab"},
            "several factors between people are not tested here; test_long.csv has everyone's scores",
        ),
    ],
)
def test_of_too_many_factors_it_is_said_what_is_not_tested_and_what_to_do(factors, said):
    (found,) = effects_of(**factors)
    assert said in found.reason


def test_nested_factors_are_described_and_not_tested():
    config = design(
        factors={
            "method": {"levels": ["a", "b"]},
            "voltage_V": {"within": "method", "levels": {"a": [1.0, 2.0], "b": [2.0, 3.0]}},
        },
        questions=RATED,
    )
    laws = {"questions": {"q": {"law": "ratings", "mean": {"all": 4.0}, "noise_sd": 1.0}}}
    table = simulated(config, checked_table(SyntheticAnswers, laws, "laws.toml"), 5)
    (test,) = summarise(config, table).questions["q"].tests
    assert "factors that are nested, not crossed, are not tested here" in test.reason


def test_levels_of_each_group_are_described_of_everybody_and_not_tested():
    config = design(
        factors={
            "method": {"levels": ["asymmetric-1"]},
            "grip": {"levels": ["one", "two"], "between": True},
            "voltage_V": {"within": "grip", "levels": {"one": [1.0, 2.0], "two": [3.0, 4.0]}},
        },
        questions=RATED,
    )
    laws = {"questions": {"q": {"law": "ratings", "mean": {"all": 4.0}, "noise_sd": 1.0}}}
    found = summarise(config, simulated(config, checked_table(SyntheticAnswers, laws, "laws.toml"), 6)).questions["q"]
    (test,) = found.tests
    assert (test.effect, found.left_out) == ("grip × voltage_V", ())
    assert "factors that are nested, not crossed, are not tested here" in test.reason


def test_levels_of_each_group_have_no_exponent_since_nobody_has_them_all_and_no_test_is_called_planned():
    config = design(
        factors={
            "method": {"levels": ["a"]},
            "grip": {"levels": ["one", "two"], "between": True},
            "voltage_V": {"within": "grip", "levels": {"one": [1.0, 2.0], "two": [3.0, 4.0]}},
        },
        questions={"q": {"kind": "number", "text": "How strong?"}},
    )
    rows = [
        (f"P{person}", grip, voltage, voltage)
        for person, (grip, voltages) in enumerate([("one", (1.0, 2.0)), ("two", (3.0, 4.0))] * 3)
        for voltage in voltages
    ]
    found = summarise(config, pd.DataFrame(rows, columns=["participant_id", "grip", "voltage_V", "q"]))
    (said,) = result_sentences("test", found)
    why = "No power-law exponent over voltage in V: each group of people has levels of its own, so nobody has them all."
    assert why in said
    (section,) = sections_of_designs(ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    assert [row[-1] for table in section.tables if "tests" in table.caption for row in table.rows] == ["–", "–"]


def test_nested_levels_have_no_exponent_and_the_report_says_why():
    config = design(
        factors={
            "method": {"levels": ["a", "b"]},
            "voltage_V": {"within": "method", "levels": {"a": [1.0, 2.0], "b": [2.0, 4.0]}},
        },
        questions={"q": {"kind": "number", "text": "How strong?"}},
    )
    rows = [
        (person, method, voltage, voltage * strength)  # the exponent is 1 in both methods, and would be 1.5 over all
        for person in ("P1", "P2", "P3")
        for method, strength, voltages in (("a", 1.0, (1.0, 2.0)), ("b", 2.0, (2.0, 4.0)))
        for voltage in voltages
    ]
    found = summarise(config, pd.DataFrame(rows, columns=["participant_id", "method", "voltage_V", "q"]))
    exponent, _ = found.questions["q"].tests
    assert (exponent.name, exponent.effect, exponent.statistic) == ("exponent", "voltage_V", None)
    (said,) = result_sentences("test", found)
    assert "No power-law exponent over voltage in V: factors are nested, so the means over its levels can" in said


@pytest.mark.slow
def test_more_than_two_levels_within_people_have_the_p_that_does_not_take_sphericity():
    config, laws = loaded("realism")
    table = simulated(config, laws, 24)
    tests = {test.effect: test for test in summarise(config, table).questions["realism"].tests}
    scores = table.pivot_table(index="participant_id", columns=["damper", "voltage_V"], values="realism").to_numpy()
    voltage = sphericity(scores.reshape(24, 2, 3).mean(axis=1)).greenhouse_geisser
    assert tests["voltage_V"].epsilon == pytest.approx(voltage.epsilon, rel=1e-9)
    assert tests["voltage_V"].p_gg == pytest.approx(voltage.p, rel=1e-6)
    assert (tests["damper"].epsilon, tests["damper"].p_gg) == (None, None)
    alone, laws = loaded("preference")
    rated = simulated(alone, laws, 14)
    scores = rated.pivot_table(index="participant_id", columns="method", values="rating").to_numpy()
    anova = summarise(alone, rated).questions["rating"].tests[0]
    assert anova.p_gg == pytest.approx(sphericity(scores).greenhouse_geisser.p, rel=1e-6)


def test_two_levels_have_nothing_to_correct_also_beside_three_groups():
    groups = {"P1": "a", "P2": "a", "P3": "b", "P4": "b", "P5": "c", "P6": "c", "P7": "c"}
    factors = {"hold": {"levels": ["a", "b", "c"], "between": True}, "method": {"levels": ["m"]}}
    factors |= {"voltage_V": {"levels": [1.0, 2.0]}, "pulse_s": {"levels": [0.006, 0.01, 0.014]}}
    random = np.random.default_rng(4)
    cells = itertools.product(groups.items(), (1.0, 2.0), (0.006, 0.01, 0.014))
    rows = [(person, group, "m", volts, pulse, random.normal(5, 1)) for (person, group), volts, pulse in cells]
    table = pd.DataFrame(rows, columns=["participant_id", "hold", "method", "voltage_V", "pulse_s", "q"])
    tests = summarise(design(factors=factors, questions=RATED), table).questions["q"].tests
    corrected = {test.effect for test in tests if test.epsilon is not None}
    assert {test.effect for test in tests} - corrected == {"hold", "voltage_V", "hold × voltage_V"}


def test_a_test_whose_own_p_misleads_is_named_in_a_warning():
    _, found = of("realism")
    question = found.questions["realism"]
    unlike = replace(question.tests[1], epsilon=0.55, p_gg=0.07)
    changed = replace(found, questions={"realism": replace(question, tests=(question.tests[0], unlike))})
    assert [*not_spherical("realism", changed)] == [
        "realism, realism, voltage_V: sphericity does not hold (Greenhouse-Geisser epsilon 0.55, below 0.75): read the "
        "corrected p = 0.07"
    ]
    pair = DesignTest(name="tukey", effect="a – b")
    compared = replace(found, questions={"realism": replace(question, tests=(unlike, pair))})
    (told,) = not_spherical("realism", compared)
    assert told.endswith("the corrected p = 0.07; Tukey's test of pairs takes sphericity too")


def test_factors_that_are_called_like_a_column_of_the_frame_stay_apart():
    _, found = of("realism")
    cells = [
        replace(cell, levels={"n": cell.levels["damper"], "question": cell.levels["voltage_V"]})
        for cell in found.questions["realism"].cells
    ]
    odd = replace(found, questions={"realism": replace(found.questions["realism"], cells=tuple(cells))})
    frame = StudyStatistics(designs={"odd": odd}).to_frame()
    assert set(frame["question"]) == {"realism"}
    assert set(frame["n"]) == {24}
    assert len(frame[["factor_n", "factor_question"]].drop_duplicates()) == 6
    assert frame["ci_low"].dtype == float


_AS_NUMBER = re.compile(r"\$(?:(?P<times>[0-9.]+) \\cdot )?10\^\{(?P<power>-?[0-9]+)\}\$")


def _number_at(label):
    power = _AS_NUMBER.fullmatch(label)
    return float(label) if power is None else float(power["times"] or 1.0) * 10.0 ** int(power["power"])


MODULI = {
    "x0.01 to x1000": lambda person, answer: answer * 10.0 ** (person % 6 - 2),
    "1e-9 to 1e12": lambda person, _: 10.0 ** (3 * (person % 8) - 9),
    "all the same": lambda _, __: 1.0,
    "one in a hundred": lambda _, answer: 3.4 + 0.01 * answer,
    "tiny": lambda _, answer: 1e-7 * answer,
}


@pytest.mark.slow
@pytest.mark.parametrize("said", MODULI.values(), ids=MODULI)
def test_numbers_at_the_ticks_of_a_logarithmic_axis_are_those_of_their_places(said, tmp_path, monkeypatch):
    config, laws = loaded("magnitude")
    table = simulated(config, laws, 12)
    person = table["participant_id"].str[1:].astype(int)
    table["strength"] = [said(*pair) for pair in zip(person, table["strength"], strict=True)]
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(summarise(config, table), tmp_path / "figure")
    drawn[0].draw_without_rendering()
    axis = drawn[0].axes[0].yaxis
    low, high = axis.get_view_interval()
    ticks = [(tick.get_loc(), tick.label1.get_text()) for tick in axis.get_major_ticks() if low < tick.get_loc() < high]
    assert len(ticks) >= 3
    assert [_number_at(label) for _, label in ticks] == pytest.approx([place for place, _ in ticks], rel=1e-5)
    assert not any(tick.label1.get_text() for tick in axis.get_minor_ticks())
    assert touching(drawn[0]) == []
