"""What the shipped designs of the paper say, and the rules that hold for every config."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from experiments.config.door import ConfigError, StudyConfig, leaves, participant_codes, tables
from experiments.design.config import DesignConfig
from experiments.design.planned import PlannedRun, planned_run
from experiments.design.planning import plan_of
from experiments.load import load_setup, load_study, shipped_folder
from experiments.synthetic.laws import RatesLaw
from tests.designs import changed, direction_with, laws_of

SETUPS = {name: load_setup(name) for name in ("direction", "preference")}
DIRECTION, PREFERENCE = SETUPS["direction"].config, SETUPS["preference"].config


def run_of(config: DesignConfig) -> PlannedRun:
    """What a run comes to; `ConfigError` for more than the design lets a participant be asked for."""
    return planned_run(config, plan_of(config, "P01", 1))


# what the paper fixes (section III)


def test_experiment_1_has_three_sessions_of_four_sets_of_five_trials() -> None:
    assert DIRECTION.methods == ("vibration", "asymmetric-1", "asymmetric-2")
    assert (DIRECTION.order.session, DIRECTION.order.sessions) == (("method",), "random")
    assert DIRECTION.order.balance == "session"
    plan = plan_of(DIRECTION, "P01", 1)
    sessions = Counter((trial.session, trial.method) for trial in plan.trials)
    assert sorted(number for number, _ in sessions) == [1, 2, 3]
    assert set(sessions.values()) == {20}
    assert set(Counter((trial.session, trial.set) for trial in plan.trials).values()) == {5}
    assert set(Counter((trial.session, trial.direction) for trial in plan.trials).values()) == {10}
    planned = run_of(DIRECTION)
    assert (planned.sessions, planned.sets, planned.trials) == (3, 12, 60)


def test_its_breaks_are_nine_of_20_s_and_two_of_300_s() -> None:
    assert DIRECTION.breaks.between_sets_s == 20
    assert DIRECTION.breaks.between_sessions_s == 300
    assert run_of(DIRECTION).break_s == 9 * 20 + 2 * 300 == 780


def test_it_takes_30_minutes_which_leaves_17_s_a_trial() -> None:
    assert run_of(DIRECTION).duration_s == DIRECTION.timing.planned_s == 30 * 60
    assert DIRECTION.trial_s == (30 * 60 - 780) / 60 == 17


def test_experiment_2_takes_8_minutes() -> None:
    planned = run_of(PREFERENCE)
    assert planned.duration_s == PREFERENCE.timing.planned_s == 8 * 60
    assert planned.break_s == 0


def test_experiment_2_has_one_forward_trial_a_method_and_the_papers_question() -> None:
    trials = plan_of(PREFERENCE, "P01", 1).trials
    assert sorted(trial.method for trial in trials) == ["asymmetric-1", "asymmetric-2", "vibration"]
    assert {trial.direction for trial in trials} == {"forward"}
    rating = PREFERENCE.questions["rating"]
    assert rating.when == "block"
    assert (rating.minimum, rating.maximum) == (0, 10)
    assert (rating.minimum_text, rating.maximum_text) == ("dislike very much", "like very much")
    assert rating.text == (
        "How much do you like such haptic feedback for simulating shooting recoil in a first-person shooting game "
        "in virtual reality?"
    )


def test_synthetic_participants_answer_forward_trials_at_the_published_rates() -> None:
    law = laws_of(SETUPS["direction"]).questions["response"]
    assert isinstance(law, RatesLaw)
    forward = {cell: share for cell, share in law.share.items() if cell.endswith("/forward")}
    assert law.by == ("method", "direction")
    assert forward == {"vibration/forward": 0.557, "asymmetric-1/forward": 0.793, "asymmetric-2/forward": 0.929}


@pytest.mark.parametrize("name", SETUPS)
def test_what_the_paper_does_not_give_is_marked_assumed(name: str) -> None:
    config = SETUPS[name].config
    assert {"fatigue", "console.guard_s", "timing.hand_over_s", "timing.answer_s"} <= set(config.assumed)
    assert set(config.assumed) <= set(leaves(config))
    assert laws_of(SETUPS[name]).assumed


def test_the_study_is_of_fourteen_people_with_codes_of_one_length() -> None:
    study, folder = load_study("study")
    assert folder == shipped_folder()
    assert study.codes() == [f"P{number:02d}" for number in range(1, 15)]


@pytest.mark.parametrize(("count", "last"), [(1, "P01"), (99, "P99"), (100, "P100"), (999, "P999")])
def test_codes_are_unique_sort_as_they_count_and_have_one_length(count: int, last: str) -> None:
    codes = participant_codes(count)
    assert codes[-1] == last
    assert codes == sorted(set(codes))
    assert len({len(code) for code in codes}) == 1


# rules


@pytest.mark.parametrize("model", [DIRECTION.breaks, PREFERENCE.questions["rating"], laws_of(SETUPS["direction"])])
def test_a_config_is_never_changed(model: Any) -> None:
    name = next(iter(type(model).model_fields))
    with pytest.raises(ValidationError, match="frozen"):
        setattr(model, name, getattr(model, name))


def test_leaves_are_the_dotted_keys_of_tables_and_values() -> None:
    keys = list(leaves(DIRECTION))
    assert {"title", "factors", "breaks.between_sets_s", "questions.response.keys.forward"} <= set(keys)
    assert len(keys) == len(set(keys))


@pytest.mark.slow
@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 24))
def test_a_design_is_taken_exactly_if_its_trials_fill_its_sets(sets: int, repetitions: int) -> None:
    config = direction_with(sets=sets, repetitions=repetitions).config
    if 2 * repetitions % sets == 0:
        assert run_of(config).trials == 3 * 2 * repetitions
    else:
        with pytest.raises(ConfigError, match=rf"order.sets = {sets}: the {2 * repetitions} trials of a session"):
            run_of(config)


@pytest.mark.parametrize(("repetitions", "possible"), [(10, False), (8, True), (12, True), (2, False), (20, True)])
def test_set_exact_is_possible_only_if_every_set_can_hold_as_many(repetitions: int, possible: bool) -> None:
    config = direction_with(repetitions=repetitions, order={"balance": "set-exact"}).config
    if possible:
        run_of(config)
    else:
        with pytest.raises(ConfigError, match=r"set-exact.*impossible"):
            run_of(config)


@pytest.mark.parametrize(
    ("between_sets_s", "between_sessions_s", "longest"),
    [(20.0, 300.0, 5), (0.0, 300.0, 20), (20.0, 0.0, 10), (0.0, 0.0, 60)],
)
def test_the_longest_stretch_of_trials_ends_at_the_next_break(
    between_sets_s: float, between_sessions_s: float, longest: int
) -> None:
    breaks = {"between_sets_s": between_sets_s, "between_sessions_s": between_sessions_s}
    assert run_of(direction_with(breaks=breaks).config).trials_without_break == longest


def test_breaks_between_sets_spare_nobody_if_a_session_is_one_set() -> None:
    breaks, fatigue = {"between_sessions_s": 0.0}, {"max_trials_without_break": 10}
    with pytest.raises(ConfigError, match="30 trials without a break"):
        run_of(direction_with(sets=1, repetitions=5, breaks=breaks, fatigue=fatigue).config)


@pytest.mark.parametrize("name", SETUPS)
def test_a_plan_may_take_exactly_as_long_as_the_limit(name: str) -> None:
    duration_s = run_of(SETUPS[name].config).duration_s
    assert run_of(changed(name, fatigue={"max_planned_s": duration_s}).config).duration_s == duration_s
    with pytest.raises(ConfigError, match="planned duration"):
        run_of(changed(name, fatigue={"max_planned_s": duration_s - 0.5}).config)


def rated(**values: float) -> Any:
    """The question for a rating with some values changed, checked again."""
    return changed("preference", questions={"rating": values}).config.questions["rating"]


@pytest.mark.parametrize("grain", [0.1, 0.5, 1.0, 0.01, 10.0, 2.5, 10 / 3])
def test_a_grain_that_divides_the_scale_is_taken(grain: float) -> None:
    assert rated(grain=grain).grain == grain


@pytest.mark.parametrize("grain", [0.3, 3.0, 11.0, 0.0, -0.1, 1e300])
def test_another_grain_is_refused(grain: float) -> None:
    with pytest.raises(ValidationError, match="grain"):
        rated(grain=grain)


@pytest.mark.parametrize(("minimum", "maximum"), [(10.0, 0.0), (5.0, 5.0), (-1e7, 10.0), (0.0, 1e7)])
def test_a_scale_runs_upwards_within_a_million(minimum: float, maximum: float) -> None:
    with pytest.raises(ValidationError, match="need -1e6 <= minimum < maximum <= 1e6"):
        rated(minimum=minimum, maximum=maximum)


@pytest.mark.parametrize("seed", [0, 1, 2**63 - 1])
def test_a_config_may_hold_a_seed(seed: int) -> None:
    assert changed("direction", seed=seed).config.seed == seed


@pytest.mark.parametrize("seed", [-1, 2**63, 1.0, "1", True])
def test_a_seed_that_is_none_is_refused(seed: object) -> None:
    with pytest.raises(ValidationError, match="seed"):
        changed("preference", seed=seed)


@pytest.mark.parametrize("prefix", ["", "P-", "sub P", "../", "Ä", "P" * 30, "P\n"])
def test_a_prefix_that_makes_no_code_is_refused(prefix: str) -> None:
    with pytest.raises(ValidationError, match="code_prefix"):
        StudyConfig(title="t", participants=1, experiments=("direction.toml",), code_prefix=prefix)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\nmean = 3,47\n", "some.toml:2: not TOML: "),
        ("a = 1\nmean = 3,47\n", "a decimal comma? write 3.47"),
        ("a = 1\nfeedback = no\n", "some.toml:2: not TOML: Invalid value (column 12); write true or false"),
        ("feedback = True # always", "some.toml:1: not TOML: Invalid value (column 12); write true or false"),
        ("may = [TRUE]", "write true or false"),
        ("kind = yes-no", "some.toml:1: not TOML: Invalid value (column 8); put words in quotes"),
        ("levels = [“on”, “off”]", "put words in straight quotes"),
        ("share = .5", "write a digit before the point"),
        ("pulse_s = 10 ms\n", "a unit? write 10 alone, in the unit that the key's name says"),
        ("[order]\na = 1\n[order]\nb = 2", "some.toml:3: not TOML: the table [order] stands there twice"),
        ("[questions.felt]\n[questions.felt]", "the table [questions.felt] stands there twice; put all of it into one"),
        ("a = 1\na = 2\n", "some.toml:2: not TOML: a key or table of that name stands there already"),
        ("a = 1\r\nb = no\r\n", "some.toml:2: not TOML: Invalid value (column 5); write true or false"),
        ("a" + ".a" * 50_000 + " = 1", "some.toml:1: a key has too many parts"),
        ('x = 1\n["a"' + '."a"' * 50_000 + "]", "some.toml:2: a key has too many parts"),
        ("x = " + "[" * 5_000, "too deep in each other"),
        ("x = " + "[" * 100 + "]" * 100, "too deep in each other"),
        ("x = " + "{a = " * 50 + "1" + "}" * 50, "too deep in each other"),
        ("#" * 1_000_001, "rule: at most 1000000"),
        ("a = " + "9" * 5_000, "not TOML"),
        ("a = [1", "some.toml: not TOML: Unclosed array (at end of document)"),
    ],
)
def test_what_is_no_toml_or_beyond_reason_is_told_with_its_line_and_what_to_write_instead(text: str, said: str) -> None:
    with pytest.raises(ConfigError) as refused:
        tables(text, "some.toml")
    assert said in str(refused.value)
