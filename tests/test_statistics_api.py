"""The statistics as a notebook calls them: tables and names in, tables out, and what is said of a wrong argument."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable, Sequence
from dataclasses import FrozenInstanceError
from typing import Any

import numpy as np
import pandas as pd
import pytest

import analysis
import recoil
from analysis import (
    cousineau_morey,
    discrimination,
    friedman,
    groups_of,
    logit_model,
    normality,
    one_way_anova,
    outliers,
    paired_t_tests,
    rm_anova,
    rm_tukey_hsd,
    rm_tukey_hsd_paired,
    signed_rank_tests,
    sphericity,
    studentized_range_isf,
    studentized_range_sf,
    tukey_hsd,
    wide,
    yes_no,
)
from tests.made_scores import RIGHT

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
WIDE = pd.DataFrame(RIGHT, columns=list(METHODS), index=[f"P{i:02d}" for i in range(1, 15)])
LONG = WIDE.rename_axis("who").reset_index().melt(id_vars="who", var_name="method", value_name="right")
AGES = {"old": [3.0, 4.0, 5.0, 4.0], "young": [6.0, 7.0, 9.0], "middle": [5.0, 6.0, 4.0]}


def _columns(scores: Any) -> dict[str, list[float]]:
    return {name: [float(value) for value in scores[name]] for name in METHODS}


@pytest.mark.parametrize(
    "scores",
    [WIDE, wide(LONG, participant="who", condition="method", score="right"), _columns(WIDE)],
    ids=["wide", "long", "mapping"],
)
@pytest.mark.parametrize("test", [rm_tukey_hsd, rm_tukey_hsd_paired, paired_t_tests, signed_rank_tests])
def test_pairs_have_the_names_of_the_columns_and_the_numbers_of_the_array(
    test: Callable[..., Sequence[Any]], scores: Any
) -> None:
    named, numbered = test(scores), test(RIGHT.tolist())
    assert [(pair.a, pair.b) for pair in numbered] == [(1, 0), (2, 0), (2, 1)]
    assert [(pair.a, pair.b) for pair in named] == [(METHODS[pair.a], METHODS[pair.b]) for pair in numbered]
    assert [(pair.p, pair.b) for pair in named] == [(pair.p, METHODS[pair.b]) for pair in numbered]
    assert test(scores, labels=["x", "y", "z"])[0].a == "y"


@pytest.mark.parametrize("scores", [WIDE, _columns(WIDE), RIGHT.tolist()], ids=["frame", "mapping", "lists"])
def test_tables_mappings_and_lists_are_taken_as_the_array_is(scores: Any) -> None:
    assert rm_anova(scores) == rm_anova(RIGHT)
    assert sphericity(scores) == sphericity(RIGHT)
    assert friedman(scores) == friedman(RIGHT)
    assert normality(scores) == normality(RIGHT)
    assert outliers(scores) == outliers(RIGHT)
    assert cousineau_morey(scores).half_widths.tolist() == cousineau_morey(RIGHT).half_widths.tolist()


def test_groups_of_a_mapping_or_a_long_table_are_named() -> None:
    long = pd.DataFrame([(name, value) for name, values in AGES.items() for value in values], columns=["age", "score"])
    for groups in (AGES, groups_of(long, group="age", score="score")):
        assert one_way_anova(groups) == one_way_anova(list(AGES.values()))
        assert [(pair.a, pair.b) for pair in tukey_hsd(groups)] == [
            ("young", "old"),
            ("middle", "old"),
            ("middle", "young"),
        ]


def test_conditions_of_a_logistic_model_have_the_names_of_the_table() -> None:
    found = logit_model(WIDE, WIDE * 0 + 11)
    assert tuple(one.label for one in found.conditions) == METHODS
    assert found.contrasts.to_frame()["a"].tolist() == ["asymmetric-1", "asymmetric-2", "asymmetric-2"]


def test_a_result_is_a_row_or_a_row_for_each_data_set() -> None:
    one, many = rm_anova(RIGHT), rm_anova(np.stack([RIGHT, RIGHT**2]))
    assert one.to_frame().iloc[0].to_dict() == {name: getattr(one, name) for name in type(one).__match_args__} | dict(
        one.rows()[0]
    )
    assert many.to_frame()["F"].tolist() == list(many.F)
    assert many.to_frame()["df_error"].tolist() == [26, 26]
    assert json.loads(json.dumps(one.to_dict()))["F"] == one.F
    assert "<table" in one._repr_html_()


def test_results_of_pairs_are_a_tuple_and_a_table() -> None:
    found = rm_tukey_hsd(WIDE)
    assert isinstance(found, tuple)
    assert found.to_frame().columns.tolist() == ["a", "b", "difference", "q", "p", "ci_low", "ci_high"]
    assert found.to_dict()["results"][0]["a"] == "asymmetric-1"
    assert "<td>vibration</td>" in found._repr_html_()


def test_within_subject_intervals_are_a_row_a_condition_with_its_name() -> None:
    table = cousineau_morey(WIDE).to_frame()
    assert table["conditions"].tolist() == list(METHODS)
    assert table["means"].tolist() == pytest.approx(WIDE.mean().tolist())


def test_results_within_a_result_stand_under_both_names() -> None:
    row = sphericity(RIGHT).rows()[0]
    assert row["greenhouse_geisser_epsilon"] == sphericity(RIGHT).greenhouse_geisser.epsilon  # type: ignore[union-attr]


def test_results_are_frozen_and_can_be_sent_to_another_process() -> None:
    found = rm_tukey_hsd(WIDE)
    with pytest.raises(FrozenInstanceError):
        found[0].p = 0.0  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(found)) == found  # noqa: S301 - our own


GAP = WIDE.astype(float)
GAP.iloc[2, 1] = np.nan
DOUBLED = pd.concat([LONG, LONG[:1]])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: rm_anova(GAP), r"scores\['asymmetric-1'\] must be finite, but the value at index \(2,\) is nan"),
        (lambda: rm_anova(LONG), r"scores\['who'\] must be numbers .* is 'P01'; a long table .* wide\(table"),
        (lambda: rm_anova({"a": [1, 2], "b": [1]}), r"scores must have as many participants .* a \(2,\), b \(1,\)"),
        (lambda: rm_anova({}), "at least 2 participants and 2 conditions"),
        (lambda: rm_tukey_hsd(WIDE, labels="abc"), "labels must be a list or column, not 'abc'"),
        (lambda: rm_tukey_hsd(RIGHT, confidence=95), "confidence must lie between 0 and 1, not 95"),
        (lambda: one_way_anova({"a": [1, 2], "b": ["x"]}), r"groups\['b'\] must be numbers .* is 'x'"),
        (lambda: one_way_anova({"a": [1, 2], "b": []}), r"groups\['b'\] must hold at least one value"),
        (lambda: one_way_anova("ab"), "groups must be a sequence or mapping of arrays"),
        (lambda: one_way_anova(3), "groups must be a sequence or mapping of arrays"),  # type: ignore[arg-type]
        (lambda: wide(LONG, participant="person", condition="method", score="right"), "participant='person': no such"),
        (
            lambda: wide(DOUBLED, participant="who", condition="method", score="right"),
            r"'P01' has two scores under 'vibration'; if their mean is meant, pass table\.groupby",
        ),
        (
            lambda: wide(LONG[1:], participant="who", condition="method", score="right"),
            "'P01' has no score under 'vibration'",
        ),
        (lambda: groups_of(LONG, group="age", score="right"), "group='age': no such column; the table has who"),
        (lambda: studentized_range_sf("x", 3, 10), "q must be numbers in a full rectangle, not 'x'"),
        (lambda: studentized_range_isf([0.1, 0.2], 3, [1, 2, 3]), r"p \(2,\), k \(\), df \(3,\)"),
        (lambda: yes_no([1, 2], 10, [1, 2, 3], 10), r"hits \(2,\), signal_trials \(\), false_alarms \(3,\)"),
        (lambda: discrimination(7, 10, "triangle"), "task must be one of two-interval, abx, oddity, not 'triangle'"),  # type: ignore[arg-type]
        (lambda: friedman(np.ones((2, 3, 4))), r"scores must have two axes \(participants, conditions\), not 3"),
    ],
)
def test_a_wrong_argument_is_named_with_what_is_wrong(call: Callable[[], object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        call()


def test_every_statistic_that_the_package_names_is_there() -> None:
    assert dir(analysis) == analysis.__all__ == sorted(analysis.__all__)
    with pytest.raises(AttributeError, match="no attribute 'anova'; it has Anova, "):
        analysis.anova  # noqa: B018 - the access is what fails


@pytest.mark.parametrize(
    "name",
    [f"analysis.{name}" for name in analysis.__all__]
    + [f"recoil.{name}" for name in recoil.__all__ if "_" not in name[:1]],
)
def test_every_public_name_has_an_example_that_runs(name: str) -> None:
    """What stands behind >>> is run with the tests, as a doctest of its module."""
    package, short = name.split(".")
    assert ">>> " in (getattr({"analysis": analysis, "recoil": recoil}[package], short).__doc__ or "")
