"""What a report says of a design: sentences, tables and the words for a paper, of data whose numbers are known."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pingouin
import pytest
from matplotlib.collections import PathCollection
from scipy import stats

from analysis.report import apa
from analysis.report.figures import style
from analysis.summary.announced import names_of_tests, sentences_of_tests
from analysis.summary.designs import summarise
from analysis.summary.figures.designs import figure_design
from analysis.summary.figures.functions import figure_functions
from analysis.summary.figures.tracks import figure_tracks
from analysis.summary.question_results import DesignTest
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.designs import result_sentences, sections_of_designs
from analysis.summary.sections.manuscript import manuscript_section
from analysis.summary.sections.thresholds import threshold_sections
from experiments.load import load_setup
from tests import figure_files
from tests.designs import design

VOLTS = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [6.0, 10.0]}}


def section_of(found):
    (section, *_) = sections_of_designs(ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    return section


def tables_of(found):
    return section_of(found).tables


def detection(factors, **more):
    question = {"kind": "yes-no", "text": "Felt?", "correct": "stimulus"}
    return design(factors=factors, trial={"catch": 4}, questions={"felt": question}, **more)


def answered(said):
    """Rows of detection: of each (person, voltage, or `None` of a catch trial) so many yes of so many trials."""
    rows = [
        {"participant_id": person, "method": None if volts is None else "a", "voltage_V": volts, "felt": answer}
        for (person, volts), (yes, trials) in said.items()
        for answer in ["yes"] * yes + ["no"] * (trials - yes)
    ]
    table = pd.DataFrame(rows)
    table["stimulus"] = table["method"].notna().astype(int)
    return table.assign(correct=((table["felt"] == "yes") == (table["stimulus"] == 1)).astype(int))


SAID = {
    ("P1", 6.0): (1, 24),
    ("P1", 10.0): (20, 24),
    ("P1", None): (1, 12),
    ("P2", 6.0): (4, 24),
    ("P2", 10.0): (22, 24),
    ("P2", None): (2, 12),
}


def test_hits_and_correct_rejections_have_intervals_and_are_held_against_no_chance():
    found = summarise(detection(VOLTS), answered(SAID))
    question = found.questions["felt"]
    assert question.chance is None
    told = [(cell.levels, cell.catch, cell.right, cell.trials, cell.p) for cell in question.cells]
    assert told == [
        ({"voltage_V": 6.0}, False, 5, 48, None),
        ({"voltage_V": 10.0}, False, 42, 48, None),
        ({}, True, 21, 24, None),
    ]
    for cell in question.cells:
        exact = stats.binomtest(cell.right, cell.trials).proportion_ci()
        assert (cell.ci_low, cell.ci_high) == pytest.approx((exact.low, exact.high), rel=1e-6)
    by_condition = tables_of(found)[0]
    assert "Hits (of catch trials: correct rejections)" in by_condition.header
    assert "p against chance" not in by_condition.header
    assert by_condition.rows[0] == ("6 V", "2", "48", "5", "43", "10.4 %", "3.5 % to 22.7 %")
    assert by_condition.rows[-1][0] == "catch trials"
    (said,) = result_sentences("test", found)
    assert "hits, 6 V: 10.4 % (5 of 48); 10 V: 87.5 % (42 of 48). Correct rejections, catch trials: 87.5 %" in said
    (announced,) = sentences_of_tests(detection(VOLTS))
    assert "chance" not in announced


def test_catch_trials_stand_apart_where_nothing_else_varies():
    said = {pair: counts for pair, counts in SAID.items() if pair[1] != 6.0}
    found = summarise(detection({"method": {"levels": ["a"]}}), answered(said))
    assert [(cell.catch, cell.right, cell.trials) for cell in found.questions["felt"].cells] == [
        (False, 42, 48),
        (True, 21, 24),
    ]
    (by_condition, _) = tables_of(found)
    assert [row[0] for row in by_condition.rows] == ["trials with a stimulus", "catch trials"]
    (sentence,) = result_sentences("test", found)
    assert "hits, trials with a stimulus: 87.5 % (42 of 48). Correct rejections, catch trials: 87.5 %" in sentence


def test_what_is_right_of_a_choice_is_held_against_chance_still():
    volts = {"direction": {"levels": ["forward", "backward"]}, "method": {"levels": ["a"]}}
    question = {"kind": "choice", "text": "?", "answers": ["forward", "backward"], "correct": "direction"}
    table = pd.DataFrame({"participant_id": ["P1"] * 4, "method": "a", "direction": ["forward", "backward"] * 2})
    table = table.assign(q="forward", correct=[1, 0, 1, 0])
    found = summarise(design(factors=volts, questions={"q": question}), table)
    assert found.questions["q"].chance == 0.5
    assert "p against chance" in tables_of(found)[0].header


def test_numbers_have_an_exponent_over_each_numeric_factor_also_beside_others():
    volts, pulses = [14.0, 18.0], [0.004, 0.008, 0.016]
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": volts}, "pulse_s": {"levels": pulses}}
    config = design(factors=factors, questions={"q": {"kind": "number", "text": "?"}}, order={"repetitions": 2})
    random = np.random.default_rng(3)
    exponents = {"P1": 0.6, "P2": 0.9, "P3": 1.0, "P4": 1.5}
    rows = [
        (person, "a", volt, pulse, volt * pulse**power * math.exp(random.normal(0.0, 0.1)))
        for person, power in exponents.items()
        for volt, pulse, _ in itertools.product(volts, pulses, range(2))
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "voltage_V", "pulse_s", "q"])
    found = summarise(config, table)
    (test,) = [test for test in found.questions["q"].tests if test.name == "exponent"]
    slopes = [np.polyfit(np.log(own["pulse_s"]), np.log(own["q"]), 1)[0] for _, own in table.groupby("participant_id")]
    assert (test.effect, test.df) == ("pulse_s", (3,))  # two voltages are no power law
    assert test.statistic == pytest.approx(np.mean(slopes), rel=1e-9)
    half = stats.t.ppf(0.975, 3) * np.std(slopes, ddof=1) / 2
    assert (test.ci_low, test.ci_high) == pytest.approx((np.mean(slopes) - half, np.mean(slopes) + half), rel=1e-9)
    assert set(names_of_tests(config, config.questions["q"])) == {one.name for one in found.questions["q"].tests}
    (said,) = result_sentences("test", found)
    ends = f"[{test.ci_low:.2f}, {test.ci_high:.2f}]"
    assert f"Power-law exponent over pulse in s: M = {test.statistic:.2f}, 95 % CI {ends}; against 0 p = " in said
    assert " ANOVA of natural logarithms: " in said
    (quoted, *_) = manuscript_section(ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    (results,) = [one for one in quoted.quotes if ", results. " in one]
    assert results.startswith(f"{found.title}, results. Q (4 participants): geometric means")
    assert "power law over pulse_s, tested against 0" in next(sentences_of_tests(config))


def test_groups_of_people_do_not_hide_the_exponent_of_their_numbers():
    factors = {"hand": {"levels": ["left", "right"], "between": True}, "pulse_s": {"levels": [0.004, 0.008, 0.016]}}
    factors |= {"method": {"levels": ["a"]}}
    config = design(factors=factors, questions={"q": {"kind": "number", "text": "?"}})
    powers = {"P1": ("left", 0.5), "P2": ("left", 0.9), "P3": ("right", 1.0), "P4": ("right", 1.6)}
    rows = [(p, hand, "a", s, 40 * s**power) for p, (hand, power) in powers.items() for s in (0.004, 0.008, 0.016)]
    table = pd.DataFrame(rows, columns=["participant_id", "hand", "method", "pulse_s", "q"])
    exponent = summarise(config, table).questions["q"].tests[0]
    assert (exponent.name, exponent.statistic) == ("exponent", pytest.approx(1.0))


def test_several_factors_between_people_do_not_hide_the_exponent_of_their_numbers():
    between = {name: {"levels": ["x", "y"], "between": True} for name in ("hand", "coat")}
    factors = {"method": {"levels": ["a"]}, "pulse_s": {"levels": [0.004, 0.008, 0.016]}} | between
    config = design(factors=factors, questions={"q": {"kind": "number", "text": "?"}})
    powers = {("x", "x"): 0.5, ("x", "y"): 0.9, ("y", "x"): 1.0, ("y", "y"): 1.6}
    rows = [
        (f"P{hand}{coat}", hand, coat, "a", s, 40 * s**power)
        for (hand, coat), power in powers.items()
        for s in (0.004, 0.008, 0.016)
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "hand", "coat", "method", "pulse_s", "q"])
    exponent, anova = summarise(config, table).questions["q"].tests
    assert (exponent.name, exponent.statistic) == ("exponent", pytest.approx(1.0))
    assert "several factors between people" in anova.reason
    assert names_of_tests(config, config.questions["q"]) == ("exponent",)
    alone = summarise(config, table[table["participant_id"] == "Pxx"])
    assert "No power-law exponent over pulse in s: fewer than two people" in next(result_sentences("test", alone))


def test_ranks_have_their_degrees_of_freedom_their_people_and_their_agreement():
    factors = {"method": {"levels": ["a", "b", "c"]}}
    question = {"kind": "rating", "text": "?", "minimum": 0, "maximum": 10, "grain": 1}
    scores = np.array([[1, 2, 3], [2, 3, 5], [1, 3, 2], [4, 6, 7], [5, 5, 9]])
    rows = [(f"P{i}", method, score) for i, row in enumerate(scores) for method, score in zip("abc", row, strict=True)]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "q"])
    found = summarise(design(factors=factors, questions={"q": question}), table)
    test = next(test for test in found.questions["q"].tests if test.name == "friedman")
    by_pingouin = pingouin.friedman(table, dv="q", within="method", subject="participant_id").iloc[0]
    assert (test.df, test.n) == ((by_pingouin["ddof1"],), 5)
    assert (test.statistic, test.p) == pytest.approx((by_pingouin["Q"], by_pingouin["p_unc"]), rel=1e-9)
    assert test.kendall_w == pytest.approx(by_pingouin["W"], rel=1e-9)
    statistics = f"χ²(2, N = 5) = {test.statistic:.2f}, p = {test.p:.3f}".replace("0.0", ".0")
    row = next(row for row in tables_of(found)[1].rows if row[0] == "Friedman, χ²")
    assert (row[3], row[5]) == ("2", f"Kendall's W = {test.kendall_w:.2f}, N = 5".replace("0.", "."))
    ranked = replace(found.questions["q"], kind="ranking")  # of which it is the planned test
    (said,) = result_sentences("test", replace(found, questions={"q": ranked}))
    assert f"Friedman's test of method: {statistics}, {row[5].removesuffix(', N = 5')}." in said


@pytest.mark.slow
def test_a_legend_stands_below_the_name_of_the_axis_however_low_the_panels_are(tmp_path, monkeypatch):
    name = "a long name of a level in four lines"
    coats = {"levels": [*"abcdefgh"], "labels": {level: f"{level} {name}"[:31] for level in "abcdefgh"}}
    factors = {"method": {"levels": ["a"]}, "coat": coats, "grip": {"levels": ["one", "two"]}}
    rating = {"kind": "rating", "text": "?", "minimum": 0, "maximum": 10, "grain": 1}
    rows = [("P1", "a", coat, grip) for coat in "abcdefgh" for grip in ("one", "two")]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "coat", "grip"]).assign(q=4, r=5, s=6)
    found = summarise(design(factors=factors, questions=dict.fromkeys("qrs", rating)), table)
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: (style.lay_out(figure), drawn.append(figure)))
    with figure_files.full_size():
        figure_design(found, tmp_path / "figure")
        for axes in drawn[0].axes[:3]:
            called, legend = axes.xaxis.label.get_window_extent(), axes.get_legend().get_window_extent()
            assert max(tick.get_text().count("\n") for tick in axes.get_xticklabels()) == 3
            assert legend.y1 < called.y0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "shown"),
    [
        ({}, "q (1 to 7)"),
        ({"minimum_text": "no $", "maximum_text": "yes"}, r"q (1 = no \$, 7 = yes)"),
        ({"maximum_text": "yes"}, "q (1, 7 = yes)"),
        (
            {"minimum_text": "not at all", "maximum_text": "completely so"},
            "q\n(1 = not at all, 7 = completely so)",
        ),
        ({"minimum_text": "a text as long as a sentence " * 4}, "q"),
    ],
)
def test_the_axis_of_a_rating_says_its_scale_where_that_is_short(ends, shown, tmp_path, monkeypatch):
    rating = {"kind": "rating", "text": "?", "minimum": 1, "maximum": 7, "grain": 1, **ends}
    table = pd.DataFrame({"participant_id": "P1", "method": ["a", "b"], "q": [3, 4]})
    found = summarise(design(factors={"method": {"levels": ["a", "b"]}}, questions={"q": rating}), table)
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found, tmp_path / "figure")
    assert drawn[0].axes[0].get_ylabel() == shown


@pytest.mark.parametrize(
    ("labels", "kick", "buzz"), [({}, "kick", "buzz"), ({"kick": "a hard kick"}, "a hard kick", "buzz")]
)
def test_the_share_of_an_unscored_choice_is_said_to_be_that_of_its_first_answer(
    labels, kick, buzz, tmp_path, monkeypatch
):
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [6.0, 10.0]}}
    asked = {"kind": "choice", "text": "?", "answers": ["kick", "buzz"], "labels": labels}
    table = pd.DataFrame({"participant_id": ["P1", "P1", "P2", "P2"], "method": "a", "voltage_V": [6.0, 10.0] * 2})
    found = summarise(design(factors=factors, questions={"feel": asked}), table.assign(feel=["kick", "buzz"] * 2))
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found, tmp_path / "figure")
    assert drawn[0].axes[0].get_ylabel() == f"share of {kick} [%]"
    (section, *_) = sections_of_designs(ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    assert f"Drawn is the share of {kick} (feel)." in section.pictures[0].caption
    assert {f"Share of {kick}", kick, buzz} <= {*section.tables[0].header}


def test_whiskers_of_numbers_are_said_to_be_of_their_logarithms():
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [6.0, 10.0]}}
    number, rating = {"kind": "number"}, {"kind": "rating", "minimum": 0, "maximum": 10, "grain": 1}
    asked = {"strength": {**number, "text": "?"}, "real": {**rating, "text": "?"}}
    table = pd.DataFrame({"participant_id": ["P1", "P1", "P2", "P2"], "method": "a", "voltage_V": [6.0, 10.0] * 2})
    found = summarise(design(factors=factors, questions=asked), table.assign(strength=[1, 3, 2, 9], real=[1, 2, 3, 4]))
    of_numbers = "the SD of ln between participants, up and down from the geometric mean"
    for shown, said in (
        (["strength"], of_numbers),
        (["real"], "the SD between participants"),
        (["strength", "real"], f"{of_numbers} of numbers, else the SD between participants"),
    ):
        some = replace(found, questions={name: found.questions[name] for name in shown})
        statistics = StudyStatistics(designs={"test": some})
        (section, *_) = sections_of_designs(ReportData(title="T", statistics=statistics))
        assert section.pictures[0].caption.endswith(f" Whiskers: {said}.")


@pytest.mark.parametrize(
    ("said", "cut"),
    [
        (["yes", "yes", "yes", "no"], True),  # 100 %, then 50 with an SD of 71
        (["yes", "yes", "no", "no"], False),  # 100 %, then 0, with an SD of 0
    ],
)
@pytest.mark.parametrize("kind", ["yes-no", "choice"])
def test_whiskers_of_shares_are_said_to_end_at_0_and_100_percent_where_they_do(kind, said, cut):
    answers = {"answers": ["yes", "no"]} if kind == "choice" else {}
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [6.0, 10.0]}}
    table = pd.DataFrame({"participant_id": ["P1", "P2"] * 2, "method": "a", "voltage_V": [6.0, 6.0, 10.0, 10.0]})
    asked = {"sure": {"kind": kind, "text": "?", **answers}}
    found = summarise(design(factors=factors, questions=asked), table.assign(sure=said))
    (section, *_) = sections_of_designs(ReportData(title="T", statistics=StudyStatistics(designs={"test": found})))
    ends = ", of shares cut off at 0 and 100 %" if cut else ""
    assert section.pictures[0].caption.endswith(f" Whiskers: the SD between participants{ends}.")


def d_prime(hits, signals, alarms, noises):  # Hautus 1995
    return float(np.diff(stats.norm.ppf([(alarms + 0.5) / (noises + 1), (hits + 0.5) / (signals + 1)]))[0])


def test_d_prime_is_said_to_be_pooled_and_stands_beside_the_mean_of_the_participants_own():
    found = summarise(detection(VOLTS), answered(SAID))
    tests = {(test.name, test.effect): test for test in found.questions["felt"].tests}
    assert tests["d_prime", "stimulus"].statistic == pytest.approx(d_prime(47, 96, 3, 24), rel=1e-9)
    assert tests["d_prime", "voltage_V 6"].statistic == pytest.approx(d_prime(5, 48, 3, 24), rel=1e-9)
    own, mean = np.array([d_prime(21, 48, 1, 12), d_prime(26, 48, 2, 12)]), tests["d_prime_mean", "stimulus"]
    half = stats.t.ppf(0.975, 1) * own.std(ddof=1) / math.sqrt(2)
    assert (mean.statistic, mean.df) == (pytest.approx(own.mean(), rel=1e-9), (1,))
    assert (mean.ci_low, mean.ci_high) == pytest.approx((own.mean() - half, own.mean() + half), rel=1e-9)
    assert "d_prime_mean" in names_of_tests(detection(VOLTS), detection(VOLTS).questions["felt"])
    (sentence,) = result_sentences("test", found)
    pooled = f"{tests['d_prime', 'stimulus'].statistic:.2f}"
    assert f"participants' answers together gave d′ = {pooled} with the log-linear correction; the part" in sentence
    assert f"participants' own: M = {own.mean():.2f}, 95 % CI [" in sentence
    by_test = tables_of(found)[1]
    assert by_test.caption.endswith(
        "pooled is what is of all participants' answers together, with the log-linear correction; false alarms of "
        "every condition: those of all catch trials"
    )
    assert [row[:2] for row in by_test.rows if row[0].startswith("d′")] == [
        ("d′, pooled", "all conditions"),
        ("d′, pooled", "6 V"),
        ("d′, pooled", "10 V"),
        ("d′, mean of participants", "all conditions"),
        ("d′, mean of participants", "6 V"),
        ("d′, mean of participants", "10 V"),
    ]


SAYS_YES_TO_THE_OTHER = {("P1", "a"): (9, 3), ("P2", "a"): (8, 2), ("P1", "b"): (12, 11), ("P2", "b"): (10, 9)}


def by_session(said):
    """Rows of detection by session: of each (person, method) so many yes to 12 shots of 6 V, and to 12 catch trials."""
    rows = [
        {"participant_id": person, "method": method, "voltage_V": volts, "felt": answer, "stimulus": int(volts > 0)}
        for (person, method), yes in said.items()
        for count, volts in zip(yes, (6.0, math.nan), strict=True)
        for answer in ["yes"] * count + ["no"] * (12 - count)
    ]
    table = pd.DataFrame(rows)
    return table.assign(correct=((table["felt"] == "yes") == (table["stimulus"] == 1)).astype(int))


def by_method(table):
    factors = {"method": {"levels": ["a", "b"]}, "voltage_V": {"levels": [6.0, 10.0]}}
    found = summarise(detection(factors, order={"session": ["method"]}), table)
    return found, {(test.name, test.effect): test for test in found.questions["felt"].tests}


def test_a_condition_has_the_false_alarms_of_its_own_session_and_not_of_all():
    """Who says yes to nearly everything in a session has a lower criterion there, and no higher d′."""
    found, tests = by_method(by_session(SAYS_YES_TO_THE_OTHER))
    for effect, counts in {"method a": (17, 24, 5, 24), "method b, voltage_V 6": (22, 24, 20, 24)}.items():
        assert tests["d_prime", effect].statistic == pytest.approx(d_prime(*counts), rel=1e-9)
    own = np.array([d_prime(12, 12, 11, 12), d_prime(10, 12, 9, 12)])
    assert tests["d_prime_mean", "method b, voltage_V 6"].statistic == pytest.approx(own.mean(), rel=1e-9)
    assert tests["d_prime", "stimulus"].statistic == pytest.approx(d_prime(39, 48, 25, 48), rel=1e-9)
    assert tables_of(found)[1].caption.endswith("false alarms of a condition: those of catch trials of the same method")
    (announced,) = sentences_of_tests(detection(VOLTS | {"method": {"levels": ["a", "b"]}}))
    assert "of each condition, with the false alarms of all catch trials;" in announced
    design = detection(VOLTS | {"method": {"levels": ["a", "b"]}}, order={"session": ["method"]})
    (announced,) = sentences_of_tests(design)
    assert "of each condition, with the false alarms of the same method;" in announced
    design = detection(VOLTS | {"method": {"levels": ["a", "b"]}}, order={"set": ["method"], "sets": 2})
    assert "of each condition, with the false alarms of the same method;" in next(sentences_of_tests(design))


def test_the_mean_of_those_who_had_catch_trials_there_says_that_it_is_of_them_alone():
    table = by_session({**SAYS_YES_TO_THE_OTHER, ("P3", "a"): (7, 2), ("P3", "b"): (7, 2)})
    without = (table["participant_id"] == "P3") & (table["method"] == "b") & (table["stimulus"] == 0)
    found, tests = by_method(table[~without])
    assert (tests["d_prime_mean", "method a"].n, tests["d_prime_mean", "method b"].n) == (None, 2)
    told = {row[1]: row[-2] for row in tables_of(found)[1].rows if row[0] == "d′, mean of participants"}
    assert told["b"].endswith("; of 2 participants with catch trials there")
    assert "participants with" not in told["a"]


def test_a_condition_without_catch_trials_of_its_own_has_the_false_alarms_of_all_and_the_table_says_so():
    table = by_session(SAYS_YES_TO_THE_OTHER)
    found, tests = by_method(table[(table["method"] == "a") | (table["stimulus"] == 1)])
    assert tests["d_prime", "method a, voltage_V 6"].statistic == pytest.approx(d_prime(17, 24, 5, 24), rel=1e-9)
    assert tests["d_prime", "method b, voltage_V 6"].statistic == pytest.approx(d_prime(22, 24, 5, 24), rel=1e-9)
    own = np.array([d_prime(12, 12, 3, 12), d_prime(10, 12, 2, 12)])
    assert tests["d_prime_mean", "method b, voltage_V 6"].statistic == pytest.approx(own.mean(), rel=1e-9)
    assert tables_of(found)[1].caption.endswith("the same method, but of all catch trials for b, 6 V, which had none")


def test_a_condition_of_several_factors_is_called_by_its_levels_beside_its_d_prime():
    pulses = VOLTS | {"pulse_s": {"levels": [0.003, 0.005]}}
    table = answered(SAID)
    pulse = pd.Series([0.003, 0.005] * (len(table) // 2)).where(table["stimulus"] == 1)
    (_, by_test) = tables_of(summarise(detection(pulses), table.assign(pulse_s=pulse)))
    of = list(dict.fromkeys(row[1] for row in by_test.rows if row[0] == "d′, pooled"))
    assert of == ["all conditions", "6 V, 0.003 s", "6 V, 0.005 s", "10 V, 0.003 s", "10 V, 0.005 s"]  # as designed


@pytest.mark.slow
def test_the_lowest_and_highest_of_many_conditions_are_those_of_the_shares_that_are_told():
    """Who has few trials moves the mean over people, and not the share of all: 6 V is lowest by the one alone."""
    factors = {"method": {"levels": ["a"]}, "direction": {"levels": ["forward"]}}
    factors["voltage_V"] = {"levels": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]}
    question = {"kind": "choice", "text": "?", "answers": ["forward", "backward"], "correct": "direction"}
    right = {volts: {"P1": (3, 4), "P2": (3, 4)} for volts in (1.0, 2.0, 3.0, 4.0, 5.0)}
    right |= {6.0: {"P1": (0, 1), "P2": (9, 10)}, 7.0: {"P1": (5, 10), "P2": (1, 2)}}
    rows = [
        (person, "a", "forward", volts, "forward" if trial < count else "backward", int(trial < count))
        for volts, people in right.items()
        for person, (count, trials) in people.items()
        for trial in range(trials)
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "direction", "voltage_V", "q", "correct"])
    (said,) = result_sentences("test", summarise(design(factors=factors, questions={"q": question}), table))
    assert "right answers of 7 conditions went from 50.0 % (6 of 12) (7 V) to 81.8 % (9 of 11) (6 V)." in said


def rated():
    """A rating of three methods by four people."""
    question = {"kind": "rating", "text": "?", "minimum": 0, "maximum": 10, "grain": 1}
    rows = [(f"P{i}", method, 2.0 * i % 5 + (method == "c")) for i in range(4) for method in "abc"]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "q"])
    return summarise(design(factors={"method": {"levels": ["a", "b", "c"]}}, questions={"q": question}), table)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("p", "corrected", "said"),
    [
        (0.031, 0.072, "significant effect of method (not significant once corrected for sphericity), F(2, 6)"),
        (0.031, 0.042, "ANOVA: significant effect of method, F(2, 6)"),
        (0.051, 0.072, "ANOVA: no significant effect of method, F(2, 6)"),
    ],
)
def test_an_effect_that_the_corrected_test_does_not_have_is_not_called_significant_without_a_word(p, corrected, said):
    found = rated()
    (question,) = found.questions.values()
    anova = DesignTest(name="anova", effect="method", statistic=5.0, df=(2, 6), p=p, epsilon=0.6, p_gg=corrected)
    changed = replace(found, questions={"q": replace(question, tests=(anova,))})
    (told,) = result_sentences("test", changed)
    assert said in told


@pytest.mark.parametrize(
    ("kind", "unit", "interval"),
    [
        ({"kind": "choice", "answers": ["yes", "no"]}, " in percentage points", (100.0, 1)),
        ({"kind": "number"}, " of natural logarithms", (1.0, 2)),
        ({"kind": "rating", "minimum": 0, "maximum": 10, "grain": 1}, "", (1.0, 2)),
    ],
)
def test_a_pair_is_called_by_its_levels_and_its_interval_has_a_unit(kind, unit, interval):
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [10.0, 13.0, 16.0]}}
    said = {"choice": ("yes", "no"), "number": (2.0, 5.0), "rating": (2.0, 5.0)}[kind["kind"]]
    rows = [
        (f"P{i}", "a", volts, said[(i * i + k * k) % 3 > 0])
        for i in range(5)
        for k, volts in enumerate((10.0, 13.0, 16.0))
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "voltage_V", "q"])
    found = summarise(design(factors=factors, questions={"q": {"text": "?", **kind}}), table)
    (test,) = [test for test in found.questions["q"].tests if test.effect == "13 – 10"]
    tests = tables_of(found)[-1]
    assert f"; intervals of pairs: the difference{unit}, 95 %, simultaneous" in tests.caption
    (row,) = [row for row in tests.rows if row[1] == "13 V − 10 V"]
    scale, digits = interval
    assert row[5] == apa.interval(scale * test.ci_low, scale * test.ci_high, digits)
    (sentence,) = result_sentences("test", found)
    assert "Planned comparisons (Tukey's HSD): 13 V − 10 V, q = " in sentence


@pytest.mark.slow
def test_reversals_of_an_up_down_track_are_ringed_and_explained_and_of_other_levels_there_are_none(
    monkeypatch, tmp_path
):
    config = load_setup("staircase").config  # three right answers go down; by reversal a step is 1, 0.5 and 0.25 ms
    ms = [8, 8, 8, 7, 7, 7.5, 8, 8, 8, 7.75]  # it turns with the 5th, the 9th and the last answer
    right = [1, 1, 1, 1, 0, 0, 1, 1, 1, 0]
    rows = [
        {"participant_id": "A", "method": "asymmetric-1", "track": 1, "pulse_s": level / 1000, "correct": said}
        | {"interval": "first"}
        for level, said in zip(ms, right, strict=True)
    ]
    found = summarise(config, pd.DataFrame(rows))
    of = found.questions["interval"].thresholds
    assert [track.reversals for track in of.tracks] == [(4, 8, 9)]
    shown = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    figure_tracks(found, of, tmp_path / "never")
    marked = [one.get_offsets().tolist() for one in shown[0].axes[0].collections]
    assert [[5, 0.007], [9, 0.008], [10, 0.00775]] in marked
    (section,) = threshold_sections("staircase", found)
    assert "Ringed: reversals; the threshold is fitted to all trials" in section.pictures[1].caption
    assert any("`recoil power` of this design says by how much" in text for text in section.paragraphs)
    fixed = summarise(config, pd.DataFrame(rows).assign(pulse_s=[0.002, *[0.008] * 9]))
    assert [track.reversals for track in fixed.questions["interval"].thresholds.tracks] == [()]


@pytest.mark.parametrize("varied", [{}, {"grip": {"levels": ["one", "two"], "between": True}}])
def test_a_figure_of_hits_has_the_false_alarms_beside_them(varied, tmp_path, monkeypatch):
    grips = {"P1": "one", "P2": "two"}
    table = answered(SAID)
    found = summarise(detection(VOLTS | varied), table.assign(grip=table["participant_id"].map(grips)))
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found, tmp_path / "figure")
    (axes,) = drawn[0].axes
    ticks = [(at, text.get_text()) for at, text in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)]
    assert [text for _, text in ticks] == ["none:\nfalse\nalarms", "6", "10"]
    bars = [bars.lines[0] for bars in axes.containers]
    alarms, hits = (
        [line for line in bars if (line.get_markerfacecolor() == "white") is hollow] for hollow in (True, False)
    )
    shares = {"one": 1 / 12, "two": 2 / 12} if varied else {"": 3 / 24}
    assert [line.get_ydata()[0] / 100 for line in alarms] == pytest.approx([*shares.values()])
    assert all(line.get_xdata()[0] < axes.spines["bottom"].get_bounds()[0] < 6.0 for line in alarms)
    assert [line.get_xdata()[0] for line in alarms] == pytest.approx([ticks[0][0]] * len(alarms), abs=0.05)
    looks = [[(line.get_color(), line.get_marker()) for line in lines] for lines in (alarms, hits)]
    assert looks[0] == looks[1]  # each as its hits
    assert axes.get_legend_handles_labels()[1] == [name for name in shares if name]
    assert axes.get_ylabel() == "hits and false alarms [%]"
    (picture,) = section_of(found).pictures
    assert "Drawn is the share of hits and, hollow, of false alarms in catch trials (felt)." in picture.caption
    said = {name or "alarms": share for name, share in shares.items()}
    assert all(f"{name}, catch trials {apa.percent(share)}" in picture.alt for name, share in said.items())


def test_false_alarms_stand_left_of_levels_of_which_one_alone_was_answered_too(tmp_path, monkeypatch):
    found = summarise(detection(VOLTS), answered({("P1", 6.0): (9, 12), ("P1", None): (3, 12)}))
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found, tmp_path / "figure")
    (axes,) = drawn[0].axes
    left, right = axes.spines["bottom"].get_bounds()
    assert axes.get_xticks()[0] < left < axes.get_xticks()[1] < right < axes.get_xlim()[1]


@pytest.mark.slow
def test_many_conditions_have_a_panel_for_each_level_of_a_factor_and_one_scale(tmp_path, monkeypatch):
    factors = {name: {"levels": ["one", "two"]} for name in ("grip", "coat")} | {"method": {"levels": ["a", "b"]}}
    rating = {"kind": "rating", "text": "?", "minimum": 0, "maximum": 10, "grain": 1}
    levels = [(8.0, 10.0, 12.0), ("one", "two"), ("one", "two"), ("a", "b")]
    table = pd.DataFrame([*itertools.product(["P1"], *levels)], columns=["participant_id", "voltage_V", *factors])
    table["q"] = range(len(table))
    several = {"voltage_V": {"levels": [8.0, 10.0, 12.0]}, **factors}
    found = summarise(design(factors=several, questions={"q": rating}), table)
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_design(found, tmp_path / "figure")
    panels = drawn[0].axes
    assert [axes.get_title(loc="left") for axes in panels] == ["q, one", "q, two"]
    assert panels[0].get_ylim() == panels[1].get_ylim()
    for axes in panels:
        assert axes.get_legend_handles_labels()[1] == ["one, a", "one, b", "two, a", "two, b"]
        assert axes.get_legend().get_title().get_text() == "coat, method"


@pytest.mark.slow
def test_a_figure_of_functions_of_yes_has_the_false_alarms(tmp_path, monkeypatch):
    said = {(one, volts): (yes, 24) for one in ("P1", "P2") for volts, yes in ((6.0, 4), (8.0, 12), (10.0, 22))}
    rows = answered(said | {("P1", None): (3, 12), ("P2", None): (6, 12)})
    found = summarise(detection(VOLTS | {"voltage_V": {"levels": [6.0, 8.0, 10.0]}}), rows)
    drawn = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure))
    figure_functions(found, found.questions["felt"].thresholds, tmp_path / "figure")
    assert [text.get_text() for text in drawn[0].axes[0].get_xticklabels()] == ["none", "6", "8", "10"]
    for axes, share in zip(drawn[0].axes, (9 / 24, 3 / 12, 6 / 12), strict=True):
        (marks,) = [some for some in axes.collections if isinstance(some, PathCollection)]
        assert marks.get_offsets()[0].tolist() == pytest.approx([axes.get_xticks()[0], 100 * share])
        assert marks.get_facecolors().sum(axis=1)[0] == 4.0  # white
    (section,) = threshold_sections("test", found)
    assert "Hollow, in one size, at none: false alarms in catch trials." in section.pictures[0].caption
    assert section.pictures[0].alt.endswith(". False alarms: 37.5 %.")
