"""Psychometric functions of designs: which answers count, whose they are, conditions, differences, and the pages."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from scipy.stats import norm

from analysis.psychometric.people import PersonFit
from analysis.psychometric.priors import default_priors
from analysis.report.figures import style
from analysis.report.figures.style import method_marker
from analysis.report.labels import labelled
from analysis.summary.announced import names_of_tests, sentences_of_tests
from analysis.summary.designs import summarise
from analysis.summary.figures.functions import figure_functions
from analysis.summary.figures.tracks import figure_tracks
from analysis.summary.results import DesignSummary
from analysis.summary.sections.designs import result_sentences
from analysis.summary.sections.thresholds import threshold_sections, threshold_sentences
from analysis.summary.thresholds import MOST_FITTED, Thresholds, priors_of, thresholds
from experiments.design.config import DesignConfig
from experiments.design.procedures.config import PosteriorConfig
from experiments.load import load_setup
from tests import figure_files
from tests.designs import design
from tests.tables_of_designs import loaded, simulated

METHODS = ("asymmetric-1", "asymmetric-2")
LEVELS = (6.0, 8.0, 10.0, 12.0, 14.0)


def share(level: Any, threshold: float, sd: float = 1.5) -> Any:
    return norm.cdf((np.asarray(level) - threshold) / sd)


def answered(config: DesignConfig, truths: dict[tuple[str, str], float], trials: int = 40) -> pd.DataFrame:
    """Right answers of people (code, method) with a threshold each, as often as the function has it, without chance."""
    rows = [
        {"participant_id": who, "method": method, "voltage_V": level, "direction": "forward"}
        | {"response": "forward" if right else "backward", "correct": int(right)}
        for (who, method), threshold in truths.items()
        for level in LEVELS
        for right in np.arange(trials) < round(trials * (0.5 + 0.5 * share(level, threshold)))
    ]
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def config() -> DesignConfig:
    return design(
        factors={
            "method": {"levels": ["asymmetric-1", "asymmetric-2"]},
            "voltage_V": {"levels": list(LEVELS)},
            "direction": {"levels": ["forward", "backward"]},
        },
        questions={
            "response": {
                "kind": "choice",
                "text": "Which way?",
                "answers": ["forward", "backward"],
                "correct": "direction",
            }
        },
    )


@pytest.fixture(scope="module")
def of_two(config: DesignConfig) -> pd.DataFrame:
    """Two people, whose threshold with the second method is 2 V higher."""
    truths = {(who, method): at + 2 * (method == "asymmetric-2") for who, at in (("A", 9.0), ("B", 9.4))
              for method in ("asymmetric-1", "asymmetric-2")}  # fmt: skip
    return answered(config, truths)


@pytest.fixture(scope="module")
def found(config: DesignConfig, of_two: pd.DataFrame) -> Thresholds:
    one = thresholds(config, "response", of_two)
    assert one is not None
    return one


def test_a_scored_choice_has_chance_as_its_guess_rate_and_a_function_each_condition(found: Thresholds) -> None:
    assert (found.factor, found.share, found.guess, found.falling) == ("voltage_V", "right", 0.5, False)
    assert [one.levels for one in found.conditions] == [{"method": "asymmetric-1"}, {"method": "asymmetric-2"}]
    first = found.conditions[0]
    assert [one.participant for one in first.people] == ["A", "B"]
    assert [point.trials for point in first.points] == [80] * len(LEVELS)
    assert first.people[0].fit is not None
    assert first.people[0].fit.threshold.median == pytest.approx(9.0, abs=0.5)


def test_conditions_stand_in_the_order_of_the_design(config: DesignConfig, of_two: pd.DataFrame) -> None:
    tables = config.model_dump()
    tables["factors"]["method"]["levels"] = METHODS[::-1]
    turned = thresholds(DesignConfig.model_validate(tables), "response", of_two)
    assert turned is not None
    assert [one.levels["method"] for one in turned.conditions] == [*METHODS[::-1]]
    assert [(one.a["method"], one.b["method"]) for one in turned.differences] == [METHODS[::-1]]


def test_the_difference_of_two_conditions_is_that_of_the_same_people(found: Thresholds) -> None:
    (one,) = found.differences
    assert (one.a, one.b) == ({"method": "asymmetric-1"}, {"method": "asymmetric-2"})
    assert (one.threshold.people, one.threshold.within) == (2, True)
    assert one.threshold.difference.low < -2 < one.threshold.difference.high < 0


def test_of_two_groups_it_is_that_of_their_means(config: DesignConfig) -> None:
    truths = {("A", "asymmetric-1"): 9.0, ("B", "asymmetric-1"): 9.2}
    truths |= {("C", "asymmetric-2"): 11.1, ("D", "asymmetric-2"): 11.3}
    one = thresholds(config, "response", answered(config, truths))
    assert one is not None
    (between,) = one.differences
    assert (between.threshold.people, between.threshold.within) == (4, False)
    assert between.threshold.difference.median == pytest.approx(-2.1, abs=0.6)


def test_one_person_has_differences_and_no_group(config: DesignConfig) -> None:
    truths = {("A", "asymmetric-1"): 9.0, ("A", "asymmetric-2"): 11.0}
    one = thresholds(config, "response", answered(config, truths))
    assert one is not None
    assert {condition.group for condition in one.conditions} == {None}
    assert one.differences[0].threshold.people == 1


def test_answers_that_never_rise_have_no_threshold_and_say_so(config: DesignConfig) -> None:
    truths = {("A", "asymmetric-1"): 9.0, ("B", "asymmetric-1"): 99.0}
    one = thresholds(config, "response", answered(config, truths))
    assert one is not None
    never = one.conditions[0].people[1]
    assert never.reason is not None
    assert "no threshold within the levels" in never.reason
    assert one.conditions[0].group is not None
    assert one.conditions[0].group.without == 1


@pytest.mark.slow
def test_a_share_that_falls_with_the_level_is_fitted_as_one(config: DesignConfig, of_two: pd.DataFrame) -> None:
    turned = of_two.assign(voltage_V=20.0 - of_two["voltage_V"])
    rising, falling = thresholds(config, "response", of_two), thresholds(config, "response", turned)
    assert rising is not None
    assert falling is not None
    assert falling.falling
    one, other = rising.conditions[0].people[0].fit, falling.conditions[0].people[0].fit
    assert one is not None
    assert other is not None
    assert other.threshold.median == pytest.approx(20.0 - one.threshold.median, abs=1e-9)
    assert (other.threshold.low, other.threshold.high) == pytest.approx(
        (20 - one.threshold.high, 20 - one.threshold.low)
    )
    assert other.slope.median == pytest.approx(-one.slope.median)
    assert np.all(np.diff(other.curve(LEVELS)[0]) < 0)


@pytest.mark.slow
def test_too_few_answers_are_no_fit_and_too_many_people_are_sampled(config: DesignConfig) -> None:
    few = answered(config, {("A", "asymmetric-1"): 9.0}, trials=1)
    one = thresholds(config, "response", few)
    assert one is not None
    assert one.conditions[0].people[0].reason == "5 trials at 5 levels; a fit needs at least 10 at two levels"
    crowd = answered(config, {(f"P{i:03d}", "asymmetric-1"): 10.0 for i in range(MOST_FITTED + 3)}, trials=1)
    many = thresholds(config, "response", crowd)
    assert many is not None
    assert (many.people, many.fitted) == (MOST_FITTED + 3, MOST_FITTED)
    assert sum(point.trials for point in many.conditions[0].points) == 5 * (MOST_FITTED + 3)
    twice = answered(config, {(f"P{i:03d}", "asymmetric-1"): 10.0 for i in range(MOST_FITTED + 3)}, trials=2)
    found = summarise(config, twice)
    (told,) = threshold_sentences(found, found.questions["response"])
    assert f", mean over {MOST_FITTED} of {MOST_FITTED + 3} people with its 95 % credible interval: " in told
    every = thresholds(config, "response", crowd, everybody=True)
    assert every is not None
    assert every.fitted == MOST_FITTED + 3


def test_a_column_that_an_adaptive_rule_filled_is_fitted_by_its_levels(config: DesignConfig) -> None:
    """Each trial at a level of its own, as a track goes: the truth, 10, lies in the interval."""
    stream = np.random.default_rng(6)
    levels = np.clip(10 + np.cumsum(stream.choice([-0.25, 0.25], 120)), 6, 14)
    right = stream.random(120) < 0.5 + 0.48 * share(levels, 10.0)
    table = pd.DataFrame(
        {"participant_id": "A", "method": "asymmetric-1", "voltage_V": levels, "response": "forward", "correct": right}
    )
    one = thresholds(config, "response", table)
    assert one is not None
    fit = one.conditions[0].people[0].fit
    assert fit is not None
    assert fit.threshold.low < 10 < fit.threshold.high


@pytest.fixture(scope="module")
def shipped() -> dict[str, Any]:
    """The summaries of the shipped designs that have functions, of two synthetic people each."""
    made = {}
    for name in ("detection", "stronger"):
        one, laws = loaded(name)
        made[name] = summarise(one, simulated(one, laws, 2))
    return made


@pytest.mark.slow
def test_yes_counts_with_the_catch_trials_as_guesses(shipped: dict[str, Any]) -> None:
    found = shipped["detection"].questions["felt"].thresholds
    assert (found.share, found.guess) == ("yes", None)
    person: PersonFit = found.conditions[0].people[0]
    assert person.catch is not None
    assert person.catch[1] == 60
    assert person.fit is not None
    assert person.fit.guess.median == pytest.approx(person.catch[0] / 60, abs=0.06)


@pytest.mark.slow
def test_a_comparison_with_a_standard_counts_how_often_the_level_was_chosen(shipped: dict[str, Any]) -> None:
    config, laws = loaded("stronger")
    found = shipped["stronger"].questions["stronger"].thresholds
    assert (found.share, found.guess, found.standard) == ("chosen", None, 14.0)
    table = simulated(config, laws, 2)
    for point in found.conditions[0].points:
        rows = table[table["voltage_V"] == point.level]
        chosen = rows["correct"] if point.level > 14.0 else 1 - rows["correct"]
        assert point.right == chosen.sum()


@pytest.mark.parametrize(("standard_interval", "of_level"), [("first", "second"), ("second", "first")])
def test_a_standard_with_an_interval_of_its_own_has_choices_over_itself_a_caution_and_no_d_prime(
    standard_interval: str, of_level: str
) -> None:
    """Of two equal shots the one that is judged is known; a lean to its answer is in every number."""
    one = design(
        factors={"method": {"levels": ["asymmetric-1"]}, "voltage_V": {"levels": [12.0, 14.0, 16.0]}},
        trial={
            "kind": "two-interval",
            "compare": "voltage_V",
            "standard": 14.0,
            "standard_interval": standard_interval,
        },
        questions={
            "which": {"kind": "choice", "text": "Which?", "answers": ["first", "second"], "correct": "larger"},
        },
    )
    of_standard = {"first": "second", "second": "first"}[of_level]
    rows = [
        {
            "participant_id": who,
            "method": "asymmetric-1",
            "voltage_V": level,
            "which": of_level if number < chosen else of_standard,
            "correct": None if level == 14.0 else int((number < chosen) == (level > 14.0)),
        }
        for who in ("A", "B")
        for level, chosen in ((12.0, 2), (14.0, 7), (16.0, 9))
        for number in range(10)
    ]
    summary = summarise(one, pd.DataFrame(rows))
    which = summary.questions["which"]
    assert which.thresholds is not None
    points = which.thresholds.conditions[0].points
    assert [(point.level, point.right, point.trials) for point in points] == [(12, 4, 20), (14, 14, 20), (16, 18, 20)]
    assert [test.statistic for test in which.tests if test.name == "d_prime"] == [None]
    assert "d_prime" not in names_of_tests(one, one.questions["which"])
    said = " ".join(result_sentences("made", summary))
    assert "No d′ and no test against chance: the standard is always in one interval, so a lean" in said
    assert {cell.p for cell in which.cells} == {None}
    assert not any("against chance" in words for words in sentences_of_tests(one))
    (section,) = threshold_sections("made", summary)
    assert any(f"always in the {standard_interval} interval" in words for words in section.paragraphs)


def test_yes_of_a_comparison_whose_interval_is_known_has_a_function_on_both_sides_of_the_standard() -> None:
    """Without a known place a yes could be of either shot."""
    trial = {"kind": "two-interval", "compare": "voltage_V", "standard": 14.0}
    rows = [
        {"participant_id": "A", "method": "asymmetric-1", "voltage_V": level, "stronger": "yes" if i < yes else "no"}
        for level, yes in ((12.0, 3), (14.0, 10), (16.0, 18))
        for i in range(20)
    ]
    for standard_interval, fitted in (("first", True), ("random", False)):
        one = design(
            factors={"method": {"levels": ["asymmetric-1"]}, "voltage_V": {"levels": [12.0, 14.0, 16.0]}},
            trial=trial | {"standard_interval": standard_interval},
            questions={"stronger": {"kind": "yes-no", "text": "Was the second stronger?"}},
        )
        found = thresholds(one, "stronger", pd.DataFrame(rows))
        assert found is not None
        assert (found.share, found.reason is None) == ("yes", fitted)


def of_a_standard(standard: float, *, above: bool) -> Any:
    """The summary of two people who say which interval held the comparison, all levels on one side of the standard."""
    one = design(
        factors={"method": {"levels": ["asymmetric-1"]}, "voltage_V": {"levels": list(LEVELS)}},
        trial={"kind": "two-interval", "compare": "voltage_V", "standard": standard},
        questions={
            "which": {"kind": "choice", "text": "Which?", "answers": ["first", "second"], "correct": "interval"}
        },
    )
    distance = {level: level - standard if above else standard - level for level in LEVELS}
    rows = [
        {"participant_id": who, "method": "asymmetric-1", "voltage_V": level, "which": "first", "correct": int(right)}
        for who in ("A", "B")
        for level in LEVELS
        for right in np.arange(60) < round(60 * (0.5 + 0.5 * share(distance[level], 4.0, 1.0)))
    ]
    return summarise(one, pd.DataFrame(rows))


@pytest.mark.slow
@pytest.mark.parametrize(("standard", "way"), [(5.0, "above"), (15.0, "below")])
def test_what_is_just_noticed_of_levels_told_from_a_standard_is_how_far_the_threshold_is_from_it(
    standard: float, way: str
) -> None:
    """Half the distance between the quarters is no JND of them: truth is a threshold 4 V from the standard."""
    summary = of_a_standard(standard, above=way == "above")
    (sentence,) = threshold_sentences(summary, summary.questions["which"])
    shown = re.search(
        rf", (\S+) \[(\S+), (\S+)\] {way} the standard of {standard:g} \(Weber fraction (\S+)\)", sentence
    )
    assert shown is not None, sentence
    far, low, high, weber = (float(number) for number in shown.groups())
    assert far == pytest.approx(4.0, abs=0.3)
    assert low < far < high
    assert weber == pytest.approx(far / standard, abs=0.006)
    (section,) = threshold_sections("made", summary)
    assert "JND" not in sentence + "".join(name for table in section.tables for name in table.header)


def test_what_has_no_success_or_no_single_function_is_not_fitted() -> None:
    for name in ("pairs", "magnitude", "realism", "hurry"):
        one, laws = loaded(name)
        table = simulated(one, laws, 1)
        assert [thresholds(one, asked, table) for asked in one.questions] == [None] * len(one.questions)
    stronger, laws = loaded("stronger")
    tables = stronger.model_dump()
    tables["questions"]["stronger"] |= {"correct": "interval"}
    both = DesignConfig.model_validate(tables)
    refused = thresholds(both, "stronger", simulated(both, laws, 1))
    assert refused is not None
    assert refused.reason is not None
    assert "both sides of the standard, 14" in refused.reason


@pytest.mark.slow
def test_the_pages_have_groups_differences_people_and_a_panel_each(
    config: DesignConfig, of_two: pd.DataFrame, tmp_path: Any
) -> None:
    summary = summarise(config, of_two)
    (section,) = threshold_sections("made", summary)
    assert [len(table.rows) for table in section.tables] == [2, 1, 4]
    assert {len(row) for table in section.tables for row in table.rows} == {8, 5, 12}
    assert all(len(row) == len(table.header) for table in section.tables for row in table.rows)
    (sentence,) = threshold_sentences(summary, summary.questions["response"])
    assert sentence.startswith(
        "Threshold in voltage in V, mean over people with its 95 % credible interval: Asymmetric Force I: 9.0"
    )
    assert section.tables[1].caption.endswith("own difference, which need not be that of the two means")
    assert not any("below 0" in paragraph for paragraph in section.paragraphs)
    figure_functions(summary, summary.questions["response"].thresholds, tmp_path / "functions")  # type: ignore[arg-type]
    assert (tmp_path / "functions.png").is_file()


@pytest.mark.slow
def test_a_mean_says_of_how_many_people_it_is_where_some_were_not_fitted(
    config: DesignConfig, of_two: pd.DataFrame
) -> None:
    """Who broke off after five trials has no function, and is one of the participants that the sentence begins with."""
    third = of_two[of_two["participant_id"] == "A"].groupby("method").head(5).assign(participant_id="C")
    summary = summarise(config, pd.concat([of_two, third]))
    (sentence,) = threshold_sentences(summary, summary.questions["response"])
    assert sentence.count(" (of 2 of 3 people)") == 2
    whole = summarise(config, of_two)
    assert "people)" not in next(threshold_sentences(whole, whole.questions["response"]))


@pytest.mark.slow
@pytest.mark.parametrize("people", [1, 4, 6])
@pytest.mark.parametrize("methods", [1, 2])
def test_in_figures_of_functions_and_tracks_nothing_that_is_written_touches(
    config: DesignConfig, people: int, methods: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: (style.lay_out(figure), shown.append(figure)))
    table = answered(config, {(f"P{one}", method): 9.0 for one in range(people) for method in METHODS[:methods]}, 10)
    summary = summarise(config, table)
    found = summary.questions["response"].thresholds
    assert found is not None
    tracks = thresholds(load_setup("threshold").config, "response", table.assign(track=1))
    assert tracks is not None
    names = ["asymmetric force of one kind", "asymmetric force of another kind"]
    with labelled(dict(zip(METHODS, names, strict=True))), figure_files.full_size():
        figure_functions(summary, found, tmp_path / "never")
        of_each = [
            replace(one, condition=(("method", method),)) for one in tracks.tracks for method in METHODS[:methods]
        ]
        figure_tracks(summary, replace(tracks, tracks=tuple(of_each)), tmp_path / "never")
    for figure, chance in zip(shown, (["chance"], []), strict=True):
        assert figure_files.touching(figure) == []
        legends = [legend.get_window_extent() for legend in figure.legends]
        told = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
        assert told == [*chance, *([] if methods == 1 else names)]
        assert all(0 <= box.x0 < box.x1 <= figure.bbox.width for box in legends)


@pytest.mark.slow
def test_conditions_are_told_apart_without_colours(
    config: DesignConfig, of_two: pd.DataFrame, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    summary = summarise(config, of_two)
    found = summary.questions["response"].thresholds
    assert found is not None
    figure_functions(summary, found, tmp_path / "never")
    axes = shown[0].axes[0]
    points = [some.get_offsets()[:, 0] for some in axes.collections if isinstance(some, PathCollection)]
    assert all(one < other for one, other in zip(*map(np.asarray, points), strict=True))  # none hides another
    assert np.mean(points, axis=0).tolist() == pytest.approx(LEVELS)
    at_the_foot = [line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1]  # type: ignore[arg-type]
    assert at_the_foot == [method_marker(0), method_marker(1)]
    (section,) = threshold_sections("made", summary)
    assert "those of one level side by side" in section.pictures[0].caption


@pytest.mark.slow
def test_few_levels_have_each_a_tick_below_their_functions(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    config = load_setup("detection").config
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    summary = summarise(config, simulated(config, loaded("detection")[1], 6))
    found = summary.questions["felt"].thresholds
    assert found is not None
    with figure_files.full_size():
        figure_functions(summary, found, tmp_path / "never")
        lowest = [axes for axes in shown[0].axes if axes.get_visible()][-1]
        assert [tick.get_text() for tick in lowest.get_xticklabels()] == ["none", "0.003", "0.004", "0.005"]
        assert lowest.get_xticks().tolist() == pytest.approx([0.0023, 0.003, 0.004, 0.005])
        assert figure_files.touching(shown[0]) == []


def of_tracks(*right_of_10: tuple[float, int]) -> DesignSummary:
    """Two people's right answers at the levels that a procedure chose, ten times each."""
    rows = [
        {"participant_id": who, "method": "asymmetric-1", "track": 1, "voltage_V": level, "direction": "forward"}
        | {"response": "forward" if place % 10 < right else "backward", "correct": int(place % 10 < right)}
        for who in ("A", "B")
        for level, right in right_of_10
        for place in range(10)
    ]
    return summarise(load_setup("threshold").config, pd.DataFrame(rows))


def test_a_threshold_beyond_every_level_that_was_presented_says_so() -> None:
    """Though it lies among those that the procedure could have chosen."""
    summary = of_tracks((9.0, 9), (10.0, 10), (11.0, 10))
    found = summary.questions["response"].thresholds
    assert found is not None
    fits = [one.fit for one in found.conditions[0].people if one.fit is not None]
    assert [(fit.where, fit.threshold.median < 9.0) for fit in fits] == [("within", True)] * 2
    (section,) = threshold_sections("made", summary)
    assert any(one.startswith("2 of 2 thresholds lie beyond every level that was ") for one in section.paragraphs)
    assert {row[-1] for row in section.tables[-1].rows} == {"below every level presented, 9"}


def test_an_interval_that_reaches_below_what_any_level_can_be_is_told() -> None:
    summary = of_tracks((4.0, 8), (6.0, 9))  # near the threshold at the lowest level already
    found = summary.questions["response"].thresholds
    assert found is not None
    assert [one.fit.threshold.low < 0 for one in found.conditions[0].people if one.fit is not None] == [True, True]
    (section,) = threshold_sections("made", summary)
    (said,) = (paragraph for paragraph in section.paragraphs if "below 0" in paragraph)
    assert said.startswith(("2 intervals of the threshold reach below 0", "3 intervals of the threshold reach below 0"))


def test_a_procedures_tracks_are_told_level_by_level_and_drawn(tmp_path: Path) -> None:
    config = load_setup("threshold").config
    told = [(1, 12.0, 1), (2, 12.0, 0), (1, 10.0, 0), (2, 14.0, 1), (1, 11.0, 1)]
    rows = [
        {"participant_id": "A", "method": "asymmetric-1", "track": track, "voltage_V": level, "direction": "forward"}
        | {"response": "forward" if right else "backward", "correct": right}
        | {"flags": "repeated at-edge" if level > 13 else "at-edges" if level < 11 else float("nan")}
        for track, level, right in told * 4
    ]
    summary = summarise(config, pd.DataFrame(rows))
    found = summary.questions["response"].thresholds
    assert found is not None
    first, second = found.tracks
    assert (first.track, first.levels[:3], first.successes[:3]) == (1, (12.0, 10.0, 11.0), (True, False, True))
    assert (second.track, second.levels[:2], second.successes[:2]) == (2, (12.0, 14.0), (False, True))
    (section,) = threshold_sections("threshold", summary)
    assert "4 of 20 trials had a level at an end of those that there were" in section.paragraphs[-1]
    figure_tracks(summary, found, tmp_path / "tracks")
    assert (tmp_path / "tracks.png").stat().st_size > 5000


@pytest.mark.slow
def test_tracks_call_conditions_as_the_design_does(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tables = load_setup("threshold").config.model_dump()
    grips = {"levels": ("one", "both"), "labels": {"one": "with one hand", "both": "with both hands"}}
    tables["factors"]["grip"] = tables["factors"]["method"] | grips
    rows = [
        {"participant_id": "A", "method": "asymmetric-1", "grip": grip, "track": 1, "voltage_V": level}
        | {"direction": "forward", "response": "forward", "correct": 1}
        for grip in ("both", "one")
        for level in (12.0, 10.0)
    ]
    shown: list[Figure] = []
    monkeypatch.setattr(style, "save", lambda figure, _: shown.append(figure))
    summary = summarise(DesignConfig.model_validate(tables), pd.DataFrame(rows))
    figure_tracks(summary, summary.questions["response"].thresholds, tmp_path / "never")  # type: ignore[arg-type]
    (legend,) = shown[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["with one hand", "with both hands"]


def test_shares_that_a_procedure_held_are_neither_drawn_nor_compared_between_tracks() -> None:
    """Of conditions within a track they still tell a preference for one answer."""
    shipped = load_setup("threshold").config
    rows = [
        {"participant_id": who, "method": method, "track": 1, "voltage_V": level, "direction": direction}
        | {"response": direction if right else "backward", "correct": right or int(direction == "backward")}
        for who in ("A", "B")
        for method in ("asymmetric-1", "asymmetric-2")
        for level in (8.0, 12.0)
        for direction in ("forward", "backward")
        for right in (1, 0)
    ]
    factors = {**shipped.factors, "method": shipped.factors["method"].model_copy(update={"levels": METHODS})}
    both, table = shipped.model_copy(update={"factors": factors}), pd.DataFrame(rows)
    apart = summarise(both, table).questions["response"]
    within = summarise(shipped, table[table["method"] == METHODS[0]]).questions["response"]
    assert [apart.drawn, within.drawn] == [False, False]
    assert {cell.p for one in (apart, within) for cell in one.cells} == {None}
    reasons = [str(test.reason) for found in (apart, within) for test in found.tests if test.name == "anova"]
    assert ["each method by the answers" in one for one in reasons] == [True, False]


def test_a_fit_has_the_priors_of_the_procedure_that_chose_its_levels() -> None:
    """Trials at the threshold tell little of lapses and width: what is thought of them moves the threshold."""
    shipped = load_setup("threshold").config
    table, levels = shipped.adaptive, np.array([4.0, 20.0])
    assert isinstance(table, PosteriorConfig)
    own = priors_of(shipped, levels)
    assert (own.lapse.low, own.lapse.most) == (0.0, 0.08)
    assert (own.width.low, own.width.high) == (pytest.approx(1.0), pytest.approx(16.0))
    assert own.threshold == default_priors(levels).threshold
    of_log = shipped.model_copy(update={"procedure": table.model_copy(update={"scale": "log"})})
    assert priors_of(of_log, levels).width == default_priors(levels).width
    assert priors_of(load_setup("staircase").config, levels) == default_priors(levels)


def test_levels_that_followed_answers_are_no_sign_that_successes_fall_with_the_level() -> None:
    """Who is always right is led to the lowest levels, and who never is to the highest."""
    rows = [
        {"participant_id": who, "method": METHODS[0], "track": 1, "voltage_V": level, "direction": "forward"}
        | {"response": "forward" if right else "backward", "correct": right}
        for who, right, levels in (("A", 1, (4.0, 5.0)), ("B", 0, (19.0, 20.0)))
        for level in levels * 20
    ]
    found = thresholds(load_setup("threshold").config, "response", pd.DataFrame(rows))
    assert found is not None
    assert not found.falling
    assert [one.fit and one.fit.where for one in found.conditions[0].people] == ["below", "above"]


def test_levels_of_two_factors_have_no_single_function() -> None:
    config = load_setup("threshold").config
    both = config.adaptive.model_copy(update={"of": ("voltage_V", "pulse_s")})
    found = thresholds(config.model_copy(update={"procedure": both}), "response", pd.DataFrame({"voltage_V": [12.0]}))
    assert found is not None
    assert found.reason == "the procedure chose levels of voltage_V and pulse_s together, and a function is of one"
