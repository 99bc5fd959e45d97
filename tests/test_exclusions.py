"""Rules leave out trials and participants, and everything left out is counted and named."""

from __future__ import annotations

from dataclasses import replace
from math import gcd
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import recoil
from analysis.logs.exclusion_rules import ExclusionEffect, KeptTrials, Rules, apply_rules
from analysis.logs.exclusions import by_study
from analysis.logs.reading import Logs, read_logs
from analysis.summary.summary import summarize
from experiments.config.door import ConfigError, load
from tests.log_files import TextRow, rating_rows, ratings_path, trial_rows, trials_path, write_rows, write_study

EXAMPLE = Path(__file__).parent.parent / "configs" / "examples" / "rules.toml"


def _rules(folder: Path, text: str) -> Rules:
    path = folder / "rules.toml"
    path.write_text(text, encoding="utf-8")
    return load(Rules, path)


def _spoilt(folder: Path) -> Logs:
    """Four people: P02 has a quick, a slow, a flagged and an unanswered trial, P03 says always forward."""
    write_study(folder, participants=4)
    rows = trial_rows("P02", 1002)
    rows[0]["response_time_s"], rows[1]["response_time_s"], rows[2]["flags"] = "0.01", "30", "repeated interrupted"
    rows[3].update(response="", correct="", response_time_s="", response_time_valid="")
    rows[4].update(response_time_s="0.01", response_time_valid="0")
    rows[5].update(response_time_s="0.02", flags="interrupted")
    write_rows(trials_path(folder, "P02"), rows)
    write_rows(trials_path(folder, "P03"), [_forward(row) for row in trial_rows("P03", 1003)])
    return read_logs([folder])


def _forward(row: TextRow) -> TextRow:
    return row | {"response": "forward", "correct": str(int(row["direction"] == "forward"))}


@pytest.fixture
def effect(tmp_path: Path) -> ExclusionEffect:
    return apply_rules(_spoilt(tmp_path), load(Rules, EXAMPLE))


def test_dropped_trials_are_counted_by_participant_and_the_first_rule_that_drops_them(effect: ExclusionEffect) -> None:
    assert effect.dropped == {
        "direction": {
            "P02": {"drop_flags": 2, "response_time_min_s": 1, "response_time_max_s": 1, "drop_unanswered": 1}
        },
        "preference": {},
    }
    assert effect.trials["direction"] == KeptTrials(recorded=240, kept=235)


@pytest.mark.slow
def test_statistics_are_over_the_trials_and_people_that_are_kept(effect: ExclusionEffect) -> None:
    found = summarize(effect.logs).to_dict()
    assert found["excluded"] == []
    assert (found["direction"]["n"], found["preference"]["n"]) == (3, 4)
    tested = [test["trials"] for tests in found["direction"]["binomial"].values() for test in tests.values()]
    assert sum(tested) == 180 - 5


def test_who_says_always_the_same_is_left_out_with_rule_and_reason(effect: ExclusionEffect) -> None:
    reason = "1 of the answers to 'response' are the same (rule: at most 0.95)"
    (found,) = effect.excluded
    assert (found.experiment, found.participant, found.reason) == ("direction", "P03", reason)
    assert (found.rule, found.remedy.split("`")[1]) == ("max_same_response_share", "max_same_response_share")


def test_participants_need_a_share_of_their_trials_and_of_correct_answers(tmp_path: Path) -> None:
    rules = _rules(
        tmp_path,
        """
trials.response_time_max_s = 20
trials.drop_unanswered = true
participants.min_kept_share = 0.98
accuracy = [{method = "vibration", min_share = 0.51}, {method = "ramp", min_share = 0.5}]
""",
    )
    effect = apply_rules(_spoilt(tmp_path), rules)
    found = {one.participant: (one.rule, one.reason) for one in effect.excluded}
    assert found["P02"] == ("min_kept_share", "58 of 60 trials kept (rule: at least 0.98 of them)")
    assert found["P03"] == ("accuracy", "0.5 correct with vibration (rule: at least 0.51)")
    assert effect.warnings == ("the rules ask for accuracy with ramp, which no log with right answers has",)


@pytest.mark.slow
@pytest.mark.parametrize("percent", range(1, 101))
def test_who_keeps_just_the_share_that_the_rule_asks_for_stays(percent: int, tmp_path: Path) -> None:
    """Of so many trials as make it a whole number of them; who has one less kept goes."""
    write_study(tmp_path, participants=1)
    logs = read_logs([tmp_path])
    step = 100 // gcd(percent, 100)
    kept = {f"A{n}": (n * percent // 100, n) for n in range(step, 201, step)}
    kept |= {code.replace("A", "B"): (some - 1, n) for code, (some, n) in kept.items()}
    people = np.repeat([*kept], [n for _, n in kept.values()])
    flags = [flag for some, n in kept.values() for flag in [""] * some + ["noise"] * (n - some)]
    row = logs.ratings.iloc[np.zeros(len(people), dtype=int)].reset_index(drop=True)
    table = row.assign(participant_id=pd.Categorical(people), flags=flags)
    rules = _rules(tmp_path, f'trials.drop_flags = ["noise"]\nparticipants.min_kept_share = {percent / 100}')
    effect = apply_rules(replace(logs, ratings=table), rules)
    assert {one.participant for one in effect.excluded} == {code for code in kept if code.startswith("B")}


def test_listed_participants_are_left_out_of_both_experiments_and_unknown_ones_are_named(tmp_path: Path) -> None:
    write_study(tmp_path, participants=2)
    entries = '[[excluded]]\ncode = "P02"\nreason = "left-handed"\n[[excluded]]\ncode = "P9"\nreason = "typing error"'
    effect = apply_rules(read_logs([tmp_path]), _rules(tmp_path, entries))
    assert [(one.experiment, one.participant, one.reason) for one in effect.excluded] == [
        ("direction", "P02", "left-handed"),
        ("preference", "P02", "left-handed"),
    ]
    assert set(effect.logs.trials["participant_id"]) == set(effect.logs.ratings["participant_id"]) == {"P01"}
    assert effect.warnings == ("the rules exclude P9, who has no log here",)


def test_of_several_studies_the_one_that_is_named(tmp_path: Path) -> None:
    for number, site in enumerate(("kyoto", "oslo")):
        write_study(tmp_path / site, participants=2, seed=number + 1)
    entry = '[[excluded]]\ncode = "P02"\nstudy = "oslo"\nreason = "left-handed"'
    effect = apply_rules(read_logs([tmp_path]), _rules(tmp_path, entry))
    assert set(effect.logs.ratings["participant_id"]) == {"kyoto/P01", "kyoto/P02", "oslo/P01"}


def test_an_entry_of_a_study_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    for number, site in enumerate(("kyoto", "oslo")):
        write_study(tmp_path / site / "results", participants=2, seed=number + 1)
    entry = '[[excluded]]\ncode = "P02"\nstudy = "results"\nreason = "left-handed"'
    effect = apply_rules(read_logs([tmp_path]), _rules(tmp_path, entry))
    assert (effect.excluded, effect.warnings) == (
        (),
        ("the rules exclude P02 of study 'results', who has no log here; studies here are kyoto, oslo",),
    )


def test_who_has_no_trial_left_is_listed(tmp_path: Path) -> None:
    write_study(tmp_path, participants=2)
    write_rows(ratings_path(tmp_path, "P02"), [row | {"flags": "noise"} for row in rating_rows("P02")])
    effect = apply_rules(read_logs([tmp_path]), _rules(tmp_path, 'trials.drop_flags = ["noise"]'))
    assert [(one.participant, one.reason) for one in effect.excluded] == [
        ("P02", "0 of 3 trials kept (rule: at least one)")
    ]


@pytest.mark.slow
def test_no_rules_change_nothing(tmp_path: Path) -> None:
    logs = _spoilt(tmp_path)
    effect = apply_rules(logs, Rules())
    assert summarize(effect.logs).to_dict() == summarize(logs).to_dict()
    assert effect.excluded == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("trials.response_time_min_s = 2.0\ntrials.response_time_max_s = 1.0", "must be below response_time_max_s = 1"),
        ("participants.min_kept_share = 80", "participants.min_kept_share = 80"),
        ('excluded = [{code = "P 1", reason = "x"}]', "excluded.0.code = 'P 1'"),
        ('excluded = [{code = "P1"}]', "excluded.0.reason: is missing"),
        ("trials.drop = 1", "trials.drop = 1: unknown key"),
    ],
)
def test_bad_rules_are_refused_with_file_key_value_and_rule(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"rules[.]toml:(\d+:)? ") as refused:
        _rules(tmp_path, text)
    assert words in str(refused.value)


OF_A_DESIGN = """
[trials]
response_time_min_s = 0.9
[participants]
max_same_response_share = 0.9
[[excluded]]
code = "P02"
reason = "left-handed"
"""


@pytest.mark.slow
def test_rules_hold_for_the_trials_and_people_of_any_design(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("stronger"), ["P01", "P02", "P03"], tmp_path / "results", seed=1)
    logs = read_logs([tmp_path / "results"])
    effect = apply_rules(logs, _rules(tmp_path, OF_A_DESIGN))
    (before,), (after,) = logs.designs, effect.logs.designs
    assert [(one.participant, one.rule, one.reason) for one in effect.excluded] == [("P02", "excluded", "left-handed")]
    assert effect.warnings == ()
    quick = before.table[before.table["stronger_time_s"] < 0.9]
    assert len(quick) > 10
    assert effect.trials["stronger"] == KeptTrials(recorded=len(before.table), kept=len(before.table) - len(quick))
    assert sum(one["response_time_min_s"] for one in effect.dropped["stronger"].values()) == len(quick)
    assert set(after.table["participant_id"]) == {"P01", "P03"}
    assert after.table["stronger_time_s"].min() >= 0.9


@pytest.mark.slow
def test_who_says_the_same_to_every_trial_of_a_design_is_left_out_where_the_rules_say_so(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("stronger"), ["P01", "P02"], tmp_path / "results", seed=1)
    logs = read_logs([tmp_path / "results"])
    (one,) = logs.designs
    same = one.table.assign(stronger=one.table["stronger"].where(one.table["participant_id"] == "P01", "first"))
    effect = apply_rules(replace(logs, designs=(replace(one, table=same),)), _rules(tmp_path, OF_A_DESIGN))
    assert ("P02", "excluded") in [(gone.participant, gone.rule) for gone in effect.excluded]
    alone = _rules(tmp_path, "[participants]\nmax_same_response_share = 0.9\n")
    effect = apply_rules(replace(logs, designs=(replace(one, table=same),)), alone)
    assert [(gone.participant, gone.rule) for gone in effect.excluded] == [("P02", "max_same_response_share")]
    assert effect.excluded[0].reason == "1 of the answers to 'stronger' are the same (rule: at most 0.9)"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pairs", "staircase", "stronger"])
def test_rules_that_leave_nobody_leave_a_report_of_nobody(name: str, tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config(name), ["P01", "P02"], tmp_path / "results", seed=1)
    everybody = "".join(f'[[excluded]]\ncode = "{code}"\nreason = "left-handed"\n' for code in ("P01", "P02"))
    effect = apply_rules(read_logs([tmp_path / "results"]), _rules(tmp_path, everybody))
    found = summarize(effect.logs)
    assert found.designs[name].n == 0
    assert [one.participant for one in effect.excluded] == ["P01", "P02"]


def test_what_was_planned_is_what_a_share_of_trials_kept_is_of(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("realism"), ["P01", "P02"], tmp_path / "results", seed=1)
    logs = read_logs([tmp_path / "results"])
    (one,) = logs.designs
    table = one.table.astype(object)
    stopped = (table["participant_id"] == "P02") & (table["trial"] > 3)  # a run that was stopped: never presented
    table.loc[stopped, ["realism", "comfort", "attempts", "onset_utc"]] = None
    rules = _rules(tmp_path, "[trials]\ndrop_unanswered = true\n[participants]\nmin_kept_share = 0.8\n")
    effect = apply_rules(replace(logs, designs=(replace(one, table=table),)), rules)
    assert [(gone.participant, gone.rule) for gone in effect.excluded] == [("P02", "min_kept_share")]


@pytest.mark.slow
def test_trials_after_the_end_of_a_track_are_no_trials_to_rules(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("staircase"), ["P01"], tmp_path / "results", seed=3)
    logs = read_logs([tmp_path / "results"])
    table = logs.designs[0].table
    presented = int(table["attempts"].notna().sum())
    assert presented < len(table)
    rules = _rules(tmp_path, "[trials]\ndrop_unanswered = true\n[participants]\nmin_kept_share = 1.0\n")
    effect = apply_rules(logs, rules)
    assert effect.trials["staircase"] == KeptTrials(recorded=presented, kept=presented)
    assert (effect.excluded, len(effect.logs.designs[0].table)) == ((), len(table))


@pytest.mark.slow
def test_each_study_has_its_own_people_in_the_statistics_of_designs_too(tmp_path: Path) -> None:
    for study, codes in (("a", ["P01", "P02", "P03"]), ("b", ["P01", "P02"])):
        recoil.run_synthetic(recoil.load_config("grip"), codes, tmp_path / study, seed=1)
    found = by_study(read_logs([tmp_path / "a", tmp_path / "b"]))
    people = {name: sorted(set(alone.designs[0].table["participant_id"])) for name, alone in found.items()}
    assert people == {"a": ["P01", "P02", "P03"], "b": ["P01", "P02"]}
