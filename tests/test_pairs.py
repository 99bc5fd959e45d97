"""Paired comparison in a design: counts, scores, ties, circles, what cannot be scored, and the pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.psychometric.paired import paired_scores
from analysis.summary.designs import summarise
from analysis.summary.figures.pairs import figure_pairs, has_scores
from analysis.summary.pairs import PairedComparison, paired_comparison
from analysis.summary.results import StudyStatistics
from analysis.summary.sections.content import ReportData
from analysis.summary.sections.designs import result_sentences, sections_of_designs
from analysis.summary.sections.pairs import pair_sections, pair_sentences
from experiments.design.config import DesignConfig
from tests.designs import design
from tests.tables_of_designs import loaded, simulated


@pytest.fixture(scope="module")
def config() -> DesignConfig:
    return loaded("pairs")[0]


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return simulated(*loaded("pairs"), 4)


@pytest.fixture(scope="module")
def found(config: DesignConfig, table: pd.DataFrame) -> PairedComparison:
    one = paired_comparison(config, "rather", table)
    assert one is not None
    return one


def test_wins_are_counted_in_both_orders_and_scored(found: PairedComparison, table: pd.DataFrame) -> None:
    (condition,) = found.conditions
    first = table[(table["method_1"] == "strong") & (table["method_2"] == "vibration")]
    second = table[(table["method_2"] == "strong") & (table["method_1"] == "vibration")]
    wins = (first["rather"] == "first").sum() + (second["rather"] == "second").sum()
    assert condition.wins[found.items.index("strong")][found.items.index("vibration")] == wins
    assert (condition.trials, found.people) == (80, 4)
    by_hand = paired_scores(found.items, np.array(condition.wins))
    assert [one.score for one in condition.scores[0].scores] == pytest.approx([one.score for one in by_hand.scores])
    assert len(condition.participants) == 4


@pytest.mark.slow
def test_a_third_answer_is_a_tie_and_half_a_choice(config: DesignConfig, table: pd.DataFrame) -> None:
    values = config.model_dump()
    values["questions"]["rather"] |= {"answers": ("first", "second", "neither"), "keys": {}}
    three = DesignConfig.model_validate(values)
    all_ties = table.assign(rather="neither")
    one = summarise(three, all_ties).questions["rather"]
    assert one.pairs is not None
    assert sum(map(sum, one.pairs.conditions[0].ties)) == 2 * len(table)
    assert one.preferred is not None
    assert {cell.mean for cell in (*one.preferred, *one.cells)} == {0.5}
    some = table["rather"].where(np.arange(len(table)) % 4 > 0, "neither")
    scores = summarise(three, table.assign(rather=some)).questions["rather"].pairs
    assert scores is not None
    assert scores.conditions[0].scores[0].tie > 0


def test_conditions_stand_in_the_order_of_the_design(config: DesignConfig, table: pd.DataFrame) -> None:
    tables = config.model_dump()
    tables["factors"]["hand"] = tables["factors"]["method"] | {"levels": ("one", "both"), "labels": {}, "sets": {}}
    turned = paired_comparison(
        DesignConfig.model_validate(tables), "rather", table.assign(hand=["both", "one"] * (len(table) // 2))
    )
    assert turned is not None
    assert [one.levels["hand"] for one in turned.conditions] == ["one", "both"]


def test_items_that_were_never_chosen_are_named(config: DesignConfig, table: pd.DataFrame) -> None:
    never = table[(table["method_1"] != "soft") & (table["method_2"] != "soft")]
    summary = summarise(config, never)
    (sentence,) = pair_sentences(summary, summary.questions["rather"])
    assert sentence == "No scores: never compared with each other: vibration, short, paper, strong | soft."
    (section,) = pair_sections("pairs", summary)
    assert section.pictures == ()


@pytest.mark.slow
def test_the_pages_have_scores_of_both_models_and_everybodys_circles(
    config: DesignConfig, table: pd.DataFrame, tmp_path: Path
) -> None:
    summary = summarise(config, table)
    (section,) = pair_sections("pairs", summary)
    assert [len(one.rows) for one in section.tables] == [5, 4]
    assert all(len(row) == len(one.header) for one in section.tables for row in one.rows)
    of: Any = summary.questions["rather"].pairs
    assert has_scores(of)
    figure_pairs(summary, of, tmp_path / "scores")
    assert (tmp_path / "scores.png").is_file()


@pytest.mark.slow
def test_that_a_tie_counts_as_half_a_choice_is_said_where_there_may_be_one(
    config: DesignConfig, table: pd.DataFrame
) -> None:
    """The table of scores counts choices and ties apart."""
    values = config.model_dump()
    values["questions"]["rather"] |= {"answers": ("first", "second", "neither"), "keys": {}}
    some = table["rather"].where(np.arange(len(table)) % 4 > 0, "neither")
    for one, answers, said in (
        (config, table, ""),
        (DesignConfig.model_validate(values), table.assign(rather=some), ", a tie as half"),
    ):
        summary = summarise(one, answers)
        (sentence,) = result_sentences("pairs", summary)
        assert f": chosen, in the mean over people{said}, Vibration: " in sentence
        (section, *_) = sections_of_designs(
            ReportData(title="T", statistics=StudyStatistics(designs={"pairs": summary}))
        )
        assert section.tables[0].caption == f"rather: how often each was chosen{said}, by condition"
        assert f"Share of first{said}" in section.tables[1].header
        (of_pairs,) = pair_sections("pairs", summary)
        assert ("Tied" in of_pairs.tables[0].header) == bool(said)
        drawn = "Drawn is how often each was chosen, a tie as half (rather)."
        assert (drawn in section.pictures[0].caption) == bool(said)


def test_a_picture_is_told_by_the_scores_of_its_own_question() -> None:
    asked = {"kind": "choice", "text": "?", "answers": ["first", "second"]}
    factors = {"method": {"levels": ["a", "b", "c"]}}
    twice = design(factors=factors, questions={"q": asked, "r": asked}, trial={"kind": "pair", "compare": "method"})
    pairs = [("a", "b"), ("b", "c"), ("c", "a")]
    answers = ("first", "second"), ("second", "first"), ("first", "second")
    rows = [(f"P{i}", one, other, *said) for i, said in enumerate(answers) for one, other in pairs]
    found = summarise(twice, pd.DataFrame(rows, columns=["participant_id", "method_1", "method_2", "q", "r"]))
    for asked_of, section in zip("qr", pair_sections("test", found), strict=True):
        (told,) = pair_sentences(found, found.questions[asked_of])
        assert [one.alt for one in section.pictures] == [f"Scores with intervals. {told}"]


def test_the_items_of_a_parameter_are_headed_by_its_name_and_unit() -> None:
    asked = {"kind": "choice", "text": "?", "answers": ["first", "second"]}
    factors = {"method": {"levels": ["a"]}, "voltage_V": {"levels": [10.0, 13.0, 16.0]}}
    volts = design(factors=factors, questions={"q": asked}, trial={"kind": "pair", "compare": "voltage_V"})
    pairs = [(10.0, 13.0), (13.0, 16.0), (16.0, 10.0)]
    rows = [(f"P{i}", "a", one, other, answer) for i, answer in enumerate(("first", "second")) for one, other in pairs]
    table = pd.DataFrame(rows, columns=["participant_id", "method", "voltage_V_1", "voltage_V_2", "q"])
    (section,) = pair_sections("test", summarise(volts, table))
    assert section.tables[0].header[0] == "Voltage in V"
