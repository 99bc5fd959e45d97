"""Active pairing in a design: what is refused, planned and said; whole runs and what is made of their logs."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from scipy.stats import spearmanr

import recoil
from analysis.predict.check_design import check_design
from experiments.config.door import ConfigError, checked_table
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.limits import check_limits
from experiments.design.planning import plan_of
from experiments.design.stimuli import settings
from experiments.load import load_gun, load_setup, shipped_folder
from experiments.record.journal import read_journal
from experiments.record.rebuild import rebuild
from experiments.record.replay import history
from experiments.screens import texts
from experiments.session.steps import FireShot
from tests.designs import changed, merged

PAIRING = {"kind": "pairing", "of": ["method"], "trials": 12}
PAIRS = merged(
    load_setup("pairs").config.model_dump(mode="json"),
    {"order": {"repetitions": 1, "sets": 1}, "procedure": PAIRING, "synthetic": "synthetic/pairs.toml"},
)
STAIRCASE = {"kind": "up-down", "starts": [1.0], "steps": [1.0], "trials": 9}
ANSWERS = {"kind": "choice", "text": "Which?", "answers": ["a", "b", "c", "d"]}

REFUSED = [
    (
        {"trial": {"kind": "single", "compare": None, "gap_s": 1.5}},
        "trial.kind = 'single': the procedure chooses",
    ),
    ({"procedure": STAIRCASE}, "a procedure needs a standard, or is of the kind pairing"),
    ({"questions": {"rather": ANSWERS | {"keys": None}}}, "no answer says which of the pair it is (rather)"),
    ({"procedure": {"question": "other"}}, "procedure.question = 'other' is no question; they are rather"),
    ({"factors": {"method": {"levels": ["soft", "strong"]}}}, "2 items; pairs are chosen of 3 to 30"),
    ({"procedure": {"trials": 3}}, "procedure.trials = 3 cannot connect the 5 levels of method, which takes 4"),
    ({"procedure": {"of": ["voltage_V"]}}, "procedure names 'voltage_V', which is no factor"),
    ({"procedure": {"spread": 0.0}}, "procedure.spread = 0.0"),
    ({"procedure": {"least_trials": 5}}, "procedure.least_trials = 5: unknown key"),
    ({"order": {"repetitions": 2}}, "order.repetitions is of constant stimuli"),
    (
        {"factors": {"voltage_V": {"levels": [8.0, 9.0, 10.0]}}, "procedure": {"of": ["method", "voltage_V"]}},
        "a pair differs in one factor",
    ),
    (
        {"factors": {"grip": {"levels": ["a", "b", "c"]}}, "trial": {"compare": "grip"}, "procedure": {"of": ["grip"]}},
        "grip is set by hand, before the answers are known",
    ),
    ({"factors": {"method": {"levels": ["chosen", "soft", "strong"]}}}, "'chosen' stands for what is not chosen yet"),
]


@pytest.mark.parametrize(("changes", "words"), REFUSED, ids=[words[:40] for _, words in REFUSED])
def test_what_cannot_be_is_refused_by_name(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError) as refused:
        checked_table(DesignConfig, without_none(merged(PAIRS, changes)), "f.toml")
    assert words in str(refused.value)


def without_none(tables: dict[str, Any]) -> dict[str, Any]:
    return {key: without_none(one) if isinstance(one, dict) else one for key, one in tables.items() if one is not None}


def test_items_that_hands_set_differently_are_refused_with_what_differs() -> None:
    methods = {"factors": {"method": {"levels": ["vibration", "asymmetric-1", "asymmetric-2"]}}}
    config = checked_table(DesignConfig, without_none(merged(PAIRS, methods)), "f.toml")
    setup = replace(load_setup("pairs"), config=config, gun=load_gun(shipped_folder() / "gun.toml"))
    with pytest.raises(
        ConfigError, match=r"method = vibration has nothing to set, method = \S+ damper off; take levels"
    ):
        check_limits(setup)


def test_what_hands_set_is_known_before_the_pair_is() -> None:
    design = checked_table(DesignConfig, without_none(PAIRS), "f.toml")
    gun = load_gun(shipped_folder() / "gun-five.toml")
    assert {settings(design, gun, one.levels_at(0) or ()) for one in plan_of(design, "P01", 1).trials} == {()}
    damped = {name: one.model_copy(update={"damper": "on"}) for name, one in gun.methods.items()}
    alike = gun.model_copy(update={"methods": damped})
    held = {settings(design, alike, one.levels_at(0) or ()) for one in plan_of(design, "P01", 1).trials}
    assert held == {(("damper", "on"),)}


VOLTS = (8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0)


def ranked() -> Setup[DesignConfig]:
    """Seven voltages, each worth half as much again as the next in logits, in pairs of one track for each direction."""
    worth = {f"{volts:g}": math.exp(0.5 * volts) for volts in VOLTS}
    return changed(
        "pairs",
        factors={
            "method": {"levels": ("paper",)},
            "voltage_V": {"levels": VOLTS},
            "direction": {"levels": ("forward", "backward")},
        },
        trial={"compare": "voltage_V"},
        order={"repetitions": 1, "sets": 2},
        procedure={"kind": "pairing", "of": ("voltage_V",), "trials": 14, "show_level": True},
        laws={"questions": {"rather": {"factor": "voltage_V", "worth": worth, "log_worth_sd": 0.0}}},
    )


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ranked")
    recoil.run_synthetic(ranked(), ["P01", "P02", "P03", "P04"], folder, seed=3)
    return folder


def test_a_plan_has_a_track_for_each_cell_and_no_pair_before_it_is_chosen() -> None:
    plan = plan_of(ranked().config, "P01", 1)
    tracks = Counter((trial.track, trial.direction) for trial in plan.trials)
    assert {direction for _, direction in tracks} == {"forward", "backward"}
    assert [*tracks.values()] == [14, 14]
    assert {trial.intervals for trial in plan.trials} == {("chosen", "chosen")}


def test_check_says_how_pairs_are_chosen_and_counts_the_two_that_shake_most() -> None:
    setup = ranked()
    found = check_design(setup, 1, ["P01"])
    assert "(8, 10, 12, 14, 16, 18, 20) was compared in pairs. The pair was chosen after each answer" in found.text[0]
    assert "were 2 tracks of 14 trials, interleaved in random order: 28 trials" in found.text[1]
    assert found.least_trials == found.trials == 28
    strongest = changed("pairs", factors={"method": {"levels": ("paper", "strong")}}, order={"repetitions": 28})
    assert found.exposure.a8_m_s2 > check_design(strongest, 1, ["P01"]).exposure.a8_m_s2


@pytest.mark.slow
def test_synthetic_participants_are_ranked_as_they_were_made(logs: Path) -> None:
    found = recoil.analyze(logs)
    assert not found.excluded
    assert not recoil.read_logs(logs).problems
    (pairs,) = [one.pairs for one in found.designs["pairs"].questions.values()]
    assert pairs is not None
    question = found.designs["pairs"].questions["rather"]
    assert (question.preferred, question.drawn) == (None, False)  # who meets equals is chosen half the time
    for condition in pairs.conditions:
        assert condition.trials == 4 * 14
        assert spearmanr([one.score for one in condition.scores[0].scores], VOLTS).statistic > 0.9


@pytest.mark.slow
def test_a_table_has_the_pair_that_was_felt_and_is_made_again_byte_for_byte(logs: Path) -> None:
    path = logs / "sub-P01" / "sub-P01_task-pairs_trials.csv"
    table, contents = pd.read_csv(path), read_journal(path.with_name("sub-P01_task-pairs_journal.jsonl"))
    fired = [step for step, _ in history(contents) if isinstance(step, FireShot)]
    felt = {(step.trial.trial, name): level for step in fired for name, level in step.chosen}
    for row in table.itertuples():
        assert (row.voltage_V_1, row.voltage_V_2) == tuple(felt[row.trial, f"voltage_V_{place}"] for place in (1, 2))
    for _, rows in table.groupby("track"):
        shown = [frozenset(pair) for pair in zip(rows["voltage_V_1"], rows["voltage_V_2"], strict=True)]
        assert all(len(pair) == 2 for pair in shown)
        assert all(one != other for one, other in pairwise(shown))
        assert frozenset.union(*shown[: len(VOLTS) - 1]) == set(VOLTS)  # the first pairs connect all items
    assert rebuild(contents.path)[1] == path.read_bytes()


def test_people_and_tracks_have_pairs_of_their_own(logs: Path) -> None:
    firsts = {
        tuple(pd.read_csv(path).query("track == @track")[["voltage_V_1", "voltage_V_2"]].iloc[0])
        for path in logs.glob("sub-*/*_trials.csv")
        for track in (1, 2)
    }
    assert len(firsts) > 4


def test_the_experimenter_sees_the_pair_where_the_design_allows_it(logs: Path) -> None:
    contents = read_journal(logs / "sub-P01" / "sub-P01_task-pairs_journal.jsonl")
    told = history(contents)
    last = next(step for step, _ in reversed(told) if isinstance(step, FireShot))
    (_, one), (_, other) = last.chosen
    assert texts.chosen_text(told, last.trial) == f"voltage_V_1 = {one:g}, voltage_V_2 = {other:g}"
