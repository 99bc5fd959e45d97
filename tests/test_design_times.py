"""Speed and accuracy of a design's question: against pandas and scipy, by conditions and instructions of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.logs.design_logs import DesignLogs
from analysis.logs.exclusion_rules import Rules, TrialRules, anticipations, apply_rules
from analysis.logs.reading import Logs
from analysis.report.section import Section
from analysis.summary.design_times import question_times
from analysis.summary.designs import summarise
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.designs import result_sentences
from analysis.summary.sections.pictures import write_figures
from analysis.summary.sections.trade import trade_details, trade_sections
from analysis.times.speed_accuracy import NoSpeedAccuracy, SpeedAccuracy
from experiments.design.config import DesignConfig
from tests.designs import design
from tests.tables_of_designs import loaded, simulated

FACTORS: dict[str, Any] = {
    "method": {"levels": ["asymmetric-2", "asymmetric-1"]},
    "grip": {"levels": ["tight", "loose"], "labels": {"tight": "Firm grip"}},
    "instruction": {
        "levels": ["accuracy", "speed"],
        "labels": {"speed": "In haste"},
        "texts": {"accuracy": "Be sure.", "speed": "Be fast."},
    },
    "direction": {"levels": ["forward", "backward"]},
}
WHICH = {"kind": "choice", "text": "Which way?", "answers": ["backward", "forward"], "correct": "direction"}
FIRM, LOOSE = "method asymmetric-2, grip tight", "method asymmetric-1, grip loose"


def timed(table: pd.DataFrame, hand: str = "participant") -> pd.DataFrame:
    """A table with times: half a second in haste, and a second else, each with an exponential tail."""
    rng = np.random.default_rng(3)
    base = np.where(table.get("instruction", "") == "speed", 0.5, 1.0)
    return table.assign(
        response_time_s=base + rng.exponential(0.3, len(table)), response_source=hand, response_time_valid=1
    )


def answered(people: int = 5, repetitions: int = 12) -> tuple[DesignConfig, pd.DataFrame]:
    """A design of two conditions by two, whose people are right as often as the dice say: less so in haste."""
    rng = np.random.default_rng(7)
    levels = [factor["levels"] for factor in FACTORS.values()]
    rows = pd.DataFrame(
        [
            (f"P{who}", *some)
            for who in range(people)
            for some in pd.MultiIndex.from_product(levels)
            for _ in range(repetitions)
        ],
        columns=["participant_id", *FACTORS],
    )
    right = rng.random(len(rows)) < np.where(rows["instruction"] == "speed", 0.6, 0.9)
    other = rows["direction"].map({"forward": "backward", "backward": "forward"})
    told = rows.assign(response=rows["direction"].where(right, other), correct=right.astype(int))
    return design(factors=FACTORS, order={"set": ["instruction"], "sets": 2}, questions={"response": WHICH}), timed(
        told
    )


def measured(config: DesignConfig, table: pd.DataFrame) -> SpeedAccuracy:
    found = question_times(config, "response", table, fits=False)
    assert isinstance(found, SpeedAccuracy)
    return found


def shown(config: DesignConfig, table: pd.DataFrame, *, fits: bool = False) -> ReportData:
    found = summarise(config, table.assign(gun="real"))
    questions = {
        name: replace(one, speed_accuracy=question_times(config, name, table, fits=fits))
        for name, one in found.questions.items()
    }
    statistics = StudyStatistics(designs={"test": replace(found, title="A test", questions=questions)})
    return ReportData(title="T", statistics=statistics)


def cells(section: Section, table: int) -> list[tuple[str, ...]]:
    return [*section.tables[table].rows]


def test_each_condition_and_instruction_has_the_means_over_people() -> None:
    config, table = answered()
    found = measured(config, table)
    assert list(found.methods) == [
        FIRM,
        "method asymmetric-2, grip loose",
        "method asymmetric-1, grip tight",
        LOOSE,
    ]
    assert found.instructions == ("speed", "accuracy")
    assert (found.n, found.people, found.refused) == (len(table), 5, {})
    cell = table[(table["method"] == "asymmetric-1") & (table["grip"] == "loose") & (table["instruction"] == "speed")]
    own = cell.groupby("participant_id").agg(rate=("correct", "mean"), mean=("response_time_s", "mean"))
    one = found.methods[LOOSE]["speed"]
    assert one.n == len(cell)
    assert (one.accuracy.mean, one.mean_s.mean) == pytest.approx((own["rate"].mean(), own["mean"].mean()))
    low, high = stats.t.interval(0.95, 4, own["mean"].mean(), stats.sem(own["mean"]))
    assert (one.mean_s.ci_low, one.mean_s.ci_high) == pytest.approx((low, high))


def test_the_effect_of_the_instruction_is_paired_by_person() -> None:
    config, table = answered()
    effect = next(one for one in measured(config, table).instruction_effects if one.method == LOOSE)
    mine = table[(table["method"] == "asymmetric-1") & (table["grip"] == "loose")]
    own = mine.pivot_table(index="participant_id", columns="instruction", values="response_time_s")
    test = stats.ttest_rel(own["speed"], own["accuracy"])
    interval = test.confidence_interval()
    assert (effect.a, effect.b) == ("speed", "accuracy")
    told = effect.mean_s.mean, effect.mean_s.ci_low, effect.mean_s.ci_high
    assert told == pytest.approx(((own["speed"] - own["accuracy"]).mean(), interval.low, interval.high))


def test_instructions_stand_in_the_order_of_the_design() -> None:
    """By the alphabet it would be 'care' less 'rush'."""
    config, table = answered(people=2)
    names = {"speed": "rush", "accuracy": "care"}
    told = {"levels": ["rush", "care"], "texts": {"rush": "Be fast.", "care": "Be sure."}}
    factors = {**FACTORS, "instruction": told}
    config = design(factors=factors, order={"set": ["instruction"], "sets": 2}, questions={"response": WHICH})
    found = measured(config, table.assign(instruction=table["instruction"].map(names)))
    assert found.instructions == ("rush", "care")
    assert {(one.a, one.b) for one in found.instruction_effects} == {("rush", "care")}
    assert found.methods[FIRM]["rush"].mean_s.mean < found.methods[FIRM]["care"].mean_s.mean


def test_the_results_say_in_a_sentence_what_haste_gave() -> None:
    config, table = answered()
    (said,) = result_sentences("test", shown(config, table).statistics.designs["test"])
    own = table.groupby(["participant_id", "method", "grip", "instruction"])["response_time_s"].mean()
    own = own.groupby(["participant_id", "instruction"]).mean().unstack()
    interval = stats.ttest_rel(own["speed"], own["accuracy"]).confidence_interval()
    mean = (own["speed"] - own["accuracy"]).mean()
    told = f"mean time −{-mean:.3f} [−{-interval.low:.3f}, −{-interval.high:.3f}] s, right answers −"
    assert f"Told “In haste” instead of “accuracy” (paired by participant, n = 5): {told}" in said


def test_the_mean_over_conditions_is_of_those_that_a_person_meets_where_a_factor_varies_between_people() -> None:
    """No person holds the gun both ways: asked for all conditions, nobody had a mean, and nothing was said of it."""
    config, table = answered(people=6)
    grip = {**FACTORS, "grip": {**FACTORS["grip"], "between": True}}
    config = design(factors=grip, order={"set": ["instruction"], "sets": 2}, questions={"response": WHICH})
    table = table[(table["grip"] == "tight") == table["participant_id"].isin(["P0", "P1", "P2"])]
    lost = (table["participant_id"] == "P0") & (table["method"] == "asymmetric-1")
    found = measured(config, table[~lost])  # who lacks a condition of their own group has no mean
    over = next(one for one in found.instruction_effects if one.method is None)
    own = table[table["participant_id"] != "P0"].groupby(["participant_id", "method", "grip", "instruction"])
    own = own["response_time_s"].mean().groupby(["participant_id", "instruction"]).mean().unstack()
    assert (over.mean_s.people, over.mean_s.mean) == (5, pytest.approx((own["speed"] - own["accuracy"]).mean()))
    cells = [(name, cell) for name, by_told in found.methods.items() for cell in by_told.values()]
    assert {(name, cell.balanced_integration.people) for name, cell in cells} == {
        (name, 2 if "tight" in name else 3) for name in found.methods
    }
    scores = [cell.balanced_integration for _, cell in cells]
    assert sum((one.mean or 0.0) * one.people for one in scores) == pytest.approx(0.0, abs=1e-9)
    assert "Told “In haste” instead of “accuracy” (paired by participant, n = 6)" in "".join(
        result_sentences("test", shown(config, table).statistics.designs["test"])
    )


def test_a_level_with_a_comma_changes_nothing_of_who_meets_what() -> None:
    _, table = answered(people=4)
    surface = {"levels": ["wet, cold", "dry"]}
    factors = {"surface": surface, **FACTORS, "grip": {**FACTORS["grip"], "between": True}}
    config = design(factors=factors, order={"set": ["instruction"], "sets": 2}, questions={"response": WHICH})
    table = table.assign(surface=np.array(surface["levels"])[np.arange(len(table)) % 2])
    table = table[(table["grip"] == "tight") == table["participant_id"].isin(["P0", "P1"])]
    over = next(one for one in measured(config, table).instruction_effects if one.method is None)
    own = table.groupby(["participant_id", "surface", "method", "instruction"])["response_time_s"].mean()
    own = own.groupby(["participant_id", "instruction"]).mean().unstack()
    assert (over.mean_s.people, over.mean_s.mean) == (4, pytest.approx((own["speed"] - own["accuracy"]).mean()))


def test_the_first_answer_is_where_the_start_leans_to() -> None:
    """Somebody who says "backward" sooner than "forward", and the first answer is that."""
    config, table = answered(people=2, repetitions=20)
    sooner = (table["response"] == "backward") * 0.2
    found = question_times(
        config, "response", table.assign(response_time_s=table["response_time_s"] - sooner), fits=True
    )
    assert isinstance(found, SpeedAccuracy)
    assert found.diffusion.together is not None
    start = found.diffusion.together.estimates["start"].value
    assert start is not None
    assert start > 0.5


def test_a_design_without_other_factors_and_without_instructions_has_one_condition() -> None:
    only = {"method": {"levels": ["asymmetric-1"]}, "direction": FACTORS["direction"]}
    config, (_, table) = design(factors=only, questions={"response": WHICH}), answered()
    found = measured(config, table.drop(columns=["grip", "instruction"]))
    assert {name: list(one) for name, one in found.methods.items()} == {"all trials": ["neutral"]}
    assert found.methods["all trials"]["neutral"].n == len(table)


def test_times_from_the_experimenters_hand_are_refused() -> None:
    config, table = answered()
    found = question_times(config, "response", timed(table, hand="experimenter"), fits=False)
    assert isinstance(found, NoSpeedAccuracy)
    assert "the experimenter's hand" in (found.reason or "")
    (section,) = trade_sections(shown(config, timed(table, hand="experimenter")))
    assert section.title == "Speed and accuracy (A test, response)"


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["detection", "pairs", "realism"],
)
def test_of_other_questions_there_are_no_such_measures(name: str) -> None:
    config, laws = loaded(name)
    table = simulated(config, laws, 1)
    assert {question_times(config, asked, table, fits=False) for asked in config.questions} == {None}


@pytest.mark.slow
def test_a_report_names_conditions_and_instructions_as_the_design_does(tmp_path: Path) -> None:
    report = shown(*answered(), fits=True)
    (section,) = trade_sections(report)
    (details,) = trade_details(report)
    assert section.title == "Speed and accuracy (A test, response)"
    assert [row[0] for row in cells(section, 0)][:2] == [
        "Asymmetric Force II, Firm grip, In haste",
        "Asymmetric Force II, Firm grip, accuracy",
    ]
    assert cells(section, 1)[0][:2] == ("In haste − accuracy", "all conditions")
    fitted = [row[0] for row in cells(details, -1)]
    assert fitted[0] == "drift Asymmetric Force II, Firm grip"
    assert fitted[-4:] == ["boundary In haste", "boundary accuracy", "start (towards backward)", "non-decision time"]
    write_figures(tmp_path, report)
    stems = [picture.stem for picture in section.pictures]
    assert stems == ["figure-test-response-conditional-accuracy", "figure-test-response-quantile-probability"]
    assert all((tmp_path / f"{stem}.png").is_file() for stem in stems)


@pytest.mark.slow
def test_levels_with_commas_and_answers_have_their_labels_too() -> None:
    grip = {"levels": ["wet, tight", "loose"], "labels": {"wet, tight": "Firm, wet"}}
    which = WHICH | {"labels": {"backward": "to me", "forward": "away"}}
    order, (_, table) = {"set": ["instruction"], "sets": 2}, answered()
    told = design(factors=FACTORS | {"grip": grip}, order=order, questions={"response": which})
    table = table.assign(grip=table["grip"].replace("tight", "wet, tight"))
    (details,) = trade_details(shown(told, table, fits=True))
    fitted = [row[0] for row in cells(details, -1)]
    assert fitted[0] == "drift Asymmetric Force II, Firm, wet"
    assert "start (towards to me)" in fitted


def test_a_report_without_measures_has_no_such_section() -> None:
    config, table = answered()
    found = summarise(config, table.assign(gun="real"))
    report = ReportData(title="T", statistics=StudyStatistics(designs={"test": found}))
    assert [*trade_sections(report), *trade_details(report)] == []


def test_answers_sooner_than_anybody_reacts_are_named_and_a_rule_drops_them() -> None:
    config, table = answered(people=2)
    table.loc[[0, 1, len(table) - 1], "response_time_s"] = 0.05
    table.loc[2, ["response_time_s", "response_time_valid"]] = 0.05, 0  # nobody's own
    empty = pd.DataFrame(columns=["participant_id", "study"])
    logs = Logs(
        trials=empty,
        ratings=empty,
        problems=(),
        paths=(),
        designs=(DesignLogs(design=config, table=table.assign(flags="", study=""), gun_labels={}),),
    )
    (said,) = anticipations(logs)
    assert said.startswith("test: 3 anticipations, answers within 0.1 s of the onset (P0 2, P1 1; response_time_s)")
    ruled = apply_rules(logs, Rules(trials=TrialRules(response_time_min_s=0.1)))
    assert ruled.dropped["test"] == {"P0": {"response_time_min_s": 2}, "P1": {"response_time_min_s": 1}}
    assert [*anticipations(ruled.logs)] == []
