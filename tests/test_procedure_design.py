"""The table `[procedure]` at the door: what is refused, by name; what is planned, said and shown of what is taken."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from typing import Any

import pytest

from analysis.predict.check_design import check_design
from experiments.config.door import ConfigError, checked_table
from experiments.design.config import DesignConfig
from experiments.design.planned import planned_run
from experiments.design.planning import plan_of, practice_of
from experiments.design.procedures.choosing import ChosenLevels, posterior_rule, tracks_of_cell
from experiments.design.procedures.config import PosteriorConfig
from experiments.design.procedures.in_words import rule_words
from experiments.load import load_setup, shipped_folder
from experiments.screens import texts
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory
from experiments.session.steps import Ask, FireShot, step_after
from tests.designs import changed, merged
from tests.driven_designs import done

THRESHOLD, STAIRCASE = load_setup("threshold"), load_setup("staircase")
ONE, OTHER = THRESHOLD.config.model_dump(mode="json"), STAIRCASE.config.model_dump(mode="json")
SHRINKING = {"kind": "kesten", "target": 0.75, **dict.fromkeys(("up", "down", "steps", "ratio"))}
TWO = {"of": ["voltage_V", "pulse_s"], "rule": "entropy"}


def two_factors(**procedure: Any) -> dict[str, Any]:
    """What makes the shipped threshold one of a voltage and a pulse together."""
    few = {"threshold": {"points": 9}, "width": {"points": 3}, "rise": {"minimum": -1.5, "maximum": -0.5, "points": 3}}
    levels = {"minimum": 0.004, "maximum": 0.01, "grain": 0.001}
    return {"factors": {"pulse_s": {"levels": levels}}, "procedure": {**TWO, "scale": "log", **few, **procedure}}


def said(tables: dict[str, Any], changes: dict[str, Any]) -> str:
    with pytest.raises(ConfigError) as refused:
        checked_table(DesignConfig, _bare(merged(tables, changes)), "f.toml")
    return str(refused.value)


def _bare(tables: dict[str, Any]) -> dict[str, Any]:
    """Tables without the keys that are taken out by `None`, as a file has none."""
    return {key: _bare(one) if isinstance(one, dict) else one for key, one in tables.items() if one is not None}


REFUSED = [
    (ONE, {"procedure": {"of": ["direction"]}}, "procedure.of: the levels of direction are words"),
    (ONE, {"procedure": {"of": ["friction_N"]}}, "procedure names 'friction_N', which is no factor"),
    (ONE, {"factors": {"posture": {"levels": [1.0, 2.0]}}, "procedure": {"of": ["posture"]}}, "posture is set by hand"),
    (OTHER, {"procedure": {"steps": [0.0]}}, "procedure.steps.0 = 0.0: must be above 0"),
    (OTHER, {"procedure": {"steps": [1e-5]}}, "1e-05 does not leave the level 0.001 of pulse_s (grain 0.00025)"),
    (
        OTHER,
        {"procedure": {"starts": [0.0011]}},
        "procedure.starts: 0.0011 is none of the levels of pulse_s, 0.001 to 0.01",
    ),
    (OTHER, {"procedure": {"down": 1}}, "the rule settles where 0.5 are right, and who feels nothing is right in 0.5"),
    (
        OTHER,
        {"procedure": {"down": 10, "trials": 10, "reversals": 0, "least_trials": 0}},
        "down = 10 moves the level after 10 answers, and trials",
    ),
    (OTHER, {"procedure": {"reversals": 40}}, "reversals = 40 takes 81 trials or more, and trials = 50 end a track"),
    (OTHER, {"procedure": {"trials": None}}, "procedure.trials: is missing"),
    (OTHER, {"procedure": {"least_trials": 60}}, "least_trials = 60 is more than trials = 50"),
    (OTHER, {"factors": {"pulse_s": {"levels": [0.002, 0.006, 0.008]}}}, "need them at even distances"),
    (ONE, {"procedure": {"start": 1.0}}, "start = 1 is excluded by the prior of the threshold, 2 to 24"),
    (ONE, {"procedure": {"threshold": {"mean": 30.0, "sd": 2.0}}}, "mean = 30 is outside of 2 to 24"),
    (ONE, {"procedure": {"threshold": {"mean": 10.1, "sd": 1e-9}}}, "less than half the distance of the values, 0.25"),
    (ONE, {"procedure": {"threshold": {"minimum": 20.0, "maximum": 4.0}}}, "threshold.minimum = 20 is above maximum"),
    (ONE, {"procedure": {"threshold": {"points": 1}}}, "threshold.points = 1 is one value, which has minimum"),
    (
        ONE,
        {"procedure": {"threshold": {"minimum": 4.0, "maximum": 2e8}}},
        "has one value only among the levels of voltage_V, 4 to 20",
    ),
    (ONE, {"procedure": {"width": {"minimum": 1e-300}}}, "procedure.width.minimum = 1e-300 is less than a 100th of"),
    (ONE, {"procedure": {"width": {"maximum": 1e300}}}, "procedure.width.maximum = 1e+300 is more than 100 times the"),
    (ONE, {"procedure": {"credible_width": 22.0}}, "procedure.credible_width = 22: the interval of the prior is 21.14"),
    (ONE, {"procedure": {"credible_width": 1e-9}}, "too far apart for an interval narrower than 0.2375"),
    (ONE, {"procedure": {"lapse_either_way": True}}, "procedure.lapse_either_way: of 0.5 right by chance"),
    (OTHER, {"procedure": {"steps": [0.01]}}, "procedure.steps: 0.01 goes through all of pulse_s, 0.001 to 0.01"),
    (OTHER, {"procedure": {"ratio": 1e5}}, "procedure.ratio = 100000: a step up of 0.001 goes through all"),
    (OTHER, {"procedure": {"ratio": 1e5, "steps": [2.0], "step_as": "factor"}}, "procedure.ratio = 100000: a step up"),
    (
        OTHER,
        {"procedure": {**SHRINKING, "first_step": 0.001, "target": 0.999}},
        "procedure.target = 0.999: a track of 50 trials would hardly ever turn there; from 0.52 to 0.98 it does",
    ),
    (OTHER, {"procedure": {**SHRINKING, "first_step": 0.001, "target": 0.4}}, "who feels nothing is right in 0.5"),
    (
        OTHER,
        {"procedure": {**SHRINKING, "first_step": 0.001, "trials": 3, "reversals": 0, "least_trials": 0}},
        "procedure.trials = 3 are too few for any target",
    ),
    (OTHER, {"procedure": {**SHRINKING, "first_step": 1e-5}}, "first_step = 1e-05 is smaller than the grain"),
    (OTHER, {"procedure": {**SHRINKING, "first_step": 5.0}}, "first_step = 5 goes through all of pulse_s"),
    (OTHER, {"procedure": {**SHRINKING, "first_step": 5.0, "step_as": "factor"}}, "first_step = 5 goes through all of"),
    (OTHER, {"factors": {"pulse_s": {"levels": {"minimum": 0.02}}}}, "minimum = 0.02 is not below maximum = 0.01"),
    (OTHER, {"factors": {"pulse_s": {"levels": {"grain": 1e-320}}}}, "make far too many levels; they must make 2 to"),
    (ONE, {"procedure": {"threshold": {"minimum": 21.0, "maximum": 25.0}}}, "21 to 25, holds none of the levels"),
    (
        ONE,
        {"procedure": {"threshold": {"minimum": -5.0}}},
        "procedure.threshold.minimum = -5: no voltage_V is below 0; begin at 0 or above",
    ),
    (ONE, {"procedure": {"width": {"minimum": 0.0}}}, "width.minimum = 0 must be above 0"),
    (ONE, {"procedure": {"lapse": {"minimum": 0.0, "maximum": 0.6, "points": 3}}}, "leave nothing to feel"),
    (ONE, {"procedure": {"guess": {"minimum": 0.0, "maximum": 0.1, "points": 2}}}, "who feels nothing is right in 0.5"),
    (ONE, {"questions": {"response": {"correct": None}}}, "no answer is a success (response)"),
    (ONE, {"procedure": {"question": "other"}}, "procedure.question = 'other' is no question"),
    (ONE, {"procedure": {"mixed": ["voltage_V"]}}, "procedure.mixed: voltage_V is what is chosen"),
    (ONE, {"procedure": {"kind": "psi"}}, "kind = 'psi' is none of constant, up-down, kesten, posterior"),
    (ONE, {"order": {"repetitions": 2}}, "order.repetitions is of constant stimuli"),
    (ONE, {"order": {"session": ["voltage_V"]}}, "voltage_V must vary from trial to trial"),
    (
        ONE,
        {"procedure": {"of": ["voltage_V", "method"]}},
        "rule = 'variance' is of one factor, not of voltage_V and method",
    ),
    (ONE, {"procedure": {**TWO}}, "rise is missing"),
    (ONE, two_factors(threshold={"minimum": 40.0, "maximum": 200.0, "points": 9}), "holds none of the levels of"),
    (ONE, two_factors(rise={"minimum": -1e5, "maximum": -1e4, "points": 3}), "holds none of the levels of voltage_V"),
    (
        OTHER,
        {"factors": {"voltage_V": {"levels": [6.0, 8.0]}}, "procedure": {"of": ["pulse_s", "voltage_V"]}},
        "procedure.of = pulse_s, voltage_V: up-down chooses one factor",
    ),
    (OTHER, {"procedure": {"steps": [2.0, 0.5], "step_as": "factor"}}, "0.5 is a factor that right answers divide by"),
    (ONE, {"factors": {"voltage_V": {"levels": {"minimum": 4.0, "maximum": 4.4, "grain": 0.3}}}}, "does not divide"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("tables", "changes", "words"), REFUSED, ids=[words[:40] for _, _, words in REFUSED])
def test_what_cannot_be_is_refused_by_name(tables: dict[str, Any], changes: dict[str, Any], words: str) -> None:
    assert words in said(tables, changes)


def test_two_factors_whose_prior_agrees_with_the_levels_are_taken() -> None:
    assert checked_table(DesignConfig, _bare(merged(ONE, two_factors())), "f.toml").adapted == ("voltage_V", "pulse_s")


def test_lapses_of_yes_and_no_go_either_way_where_the_design_says_so() -> None:
    yes = {"kind": "yes-no", "text": "Felt?"}
    changes = {"questions": {"felt": yes, "response": None}, "procedure": {"lapse_either_way": True}}
    design = checked_table(DesignConfig, _bare(merged(ONE, changes)), "f.toml")
    table = design.adaptive
    assert isinstance(table, PosteriorConfig)
    known = posterior_rule(table, [(4.0, 20.0)], 0.0).grid
    assert known.chance.tolist() == table.lapse.values.tolist()
    assert "lapse rate 0 to 0.08, lapses either way)" in rule_words(table, [(4.0, 20.0)])


@pytest.mark.parametrize(("right", "end"), [(False, 20.0), (True, 4.0)])
def test_who_is_never_right_or_always_is_led_to_an_end_of_the_levels_and_the_journal_says_so(
    right: bool, end: float
) -> None:
    table = THRESHOLD.config.adaptive
    assert table is not None
    levels = tuple(float(level) for level in THRESHOLD.config.factors["voltage_V"].all_levels)
    track = tracks_of_cell(table, [levels], 0.5)[0]
    while not track.over:
        track, last = track.after(track.choice().levels, success=right), track.choice()
    assert last == ChosenLevels(levels=(end,), at_edge=True)


def test_a_message_about_a_key_of_the_procedure_has_that_key_and_its_line() -> None:
    text = (shipped_folder() / "staircase.toml").read_text()
    for key, wrong in {"reversals": "45", "trials": "3"}.items():
        bad = re.sub(rf"(?m)^{key} = \d+", f"{key} = {wrong}", text)
        line = next(at for at, one in enumerate(bad.splitlines(), start=1) if one.startswith("reversals"))
        with pytest.raises(ConfigError, match=rf"^f.toml:{line}: procedure\.reversals = "):
            checked_table(DesignConfig, tomllib.loads(bad), "f.toml", bad)


def test_a_list_of_wrong_elements_is_not_said_to_be_too_short() -> None:
    assert said(OTHER, {"procedure": {"steps": ["a", -1.0]}}).splitlines() == [
        "f.toml: procedure.steps.0 = 'a': must be a number",
        "f.toml: procedure.steps.1 = -1.0: must be above 0",
    ]


def test_a_grid_beyond_the_gun_is_refused_with_its_limit() -> None:
    from experiments.design.limits import check_limits

    levels = {"minimum": 20.0, "maximum": 25.0, "grain": 1.0}
    wide = {"threshold": {"minimum": 18.0, "maximum": 26.0, "points": 9}}
    setup = changed("threshold", factors={"voltage_V": {"levels": levels}}, procedure=wide)
    with pytest.raises(ConfigError, match=r"factors\.voltage_V\.levels: .*voltage_V = 25.*24"):
        check_limits(setup)


def test_a_plan_has_a_track_for_each_cell_and_start_and_no_level_of_what_is_chosen() -> None:
    plan = plan_of(THRESHOLD.config, "P01", 1)
    assert Counter(trial.track for trial in plan.trials) == {1: 40, 2: 40}
    assert {trial.level("voltage_V") for trial in plan.trials} == {None}
    each = Counter((trial.track, trial.direction) for trial in plan.trials)
    assert set(each.values()) == {20}
    rounds = [{one.track for one in plan.trials[at : at + 2]} for at in range(0, 80, 2)]
    assert rounds == [{1, 2}] * 40


def test_a_factor_that_was_forgotten_is_named_where_its_tracks_make_too_many_trials() -> None:
    levels = {"minimum": 0.004, "maximum": 0.01, "grain": 0.001}
    for breaks_s, words in ((20.0, "140 trials without a break"), (0.0, "560 trials without a break")):
        design = changed(
            "threshold", factors={"pulse_s": {"levels": levels}}, breaks={"between_sets_s": breaks_s}
        ).config
        with pytest.raises(ConfigError, match=f"{words}.* each level of pulse_s has tracks of its own"):
            planned_run(design, plan_of(design, "P01", 1))


def test_tracks_come_one_after_another_where_the_design_says_so() -> None:
    plan = plan_of(changed("staircase", procedure={"interleave": False}).config, "P01", 1)
    tracks = [trial.track for trial in plan.trials]
    assert tracks == sorted(tracks)


def test_catch_trials_and_practice_are_of_no_track() -> None:
    yes = {"kind": "yes-no", "text": "Felt?", "correct": "stimulus"}
    changes = {"trial": {"catch": 8}, "questions": {"felt": yes, "response": None}, "factors": {"direction": None}}
    changes |= {"procedure": {"mixed": []}, "practice": {"repetitions": 2, "of": ["method"]}}
    design = checked_table(DesignConfig, _bare(merged(ONE, changes)), "f.toml")
    plan, practice = plan_of(design, "P01", 1), practice_of(design, "P01", 1)
    assert Counter((trial.catch, trial.track > 0) for trial in plan.trials) == {(True, False): 8, (False, True): 80}
    assert all(isinstance(trial.level("voltage_V"), float) and not trial.track for trial in practice.trials)


def test_check_says_how_long_it_takes_at_the_least_and_at_the_most() -> None:
    found = check_design(STAIRCASE, 1, ["P01"])
    assert (found.least_trials, found.trials) == (42, 100)  # 10 reversals are 11 moves: 6 of one trial, 5 of three
    assert found.least_duration_s == pytest.approx(42 * 10.0)
    assert "42 trials and 7 min at the least, 100 trials and 17 min at the most" in " ".join(found.text)
    assert "3 down, 1 up, towards 79.4 %" in found.text[0]


@pytest.mark.parametrize("shown", [False, True])
def test_the_experimenter_sees_a_level_only_where_the_design_allows_it(shown: bool) -> None:
    setup = changed("threshold", procedure={"show_level": shown})
    plan, told = plan_of(setup.config, "P01", 1), GrowingHistory()
    session = design_session(plan, setup, told)
    step = next(session)
    while not isinstance(step, Ask):
        told.append((step, done(step, 0)))
        step = step_after(session, told[-1][1])
    fired = next(one for one, _ in told if isinstance(one, FireShot))
    level = dict(fired.chosen)["voltage_V"]
    assert texts.chosen_text(told, step.trial) == (f"voltage_V = {level:g}" if shown else "")
    assert texts.track_text(plan, told, step.trial) == f"Track {step.trial.track}: 0 of 40 trials"
    assert texts.place_text(plan, step.trial).startswith("Trial 1 of 80")


def test_trials_are_at_most_so_many_where_a_track_may_be_over_sooner() -> None:
    plan = plan_of(STAIRCASE.config, "P01", 1)
    assert texts.place_text(plan, plan.trials[0]).startswith("Trial 1 of at most 100")
    assert texts.track_text(plan, [], plan.trials[0]).endswith("0 of at most 50 trials")
