import json
from collections import Counter
from dataclasses import fields
from types import NoneType, UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from experiments.config.setup import Setup, canonical_json
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planned import planned_run
from experiments.design.planning import plan_of
from experiments.load import load_setup
from experiments.session.design_session import design_session
from experiments.session.steps import (
    OUTCOME,
    STEP,
    Answered,
    Ask,
    Close,
    FireShot,
    Outcome,
    Prepare,
    Repeated,
    Rest,
    Step,
    step_record,
)
from tests.designs import changed
from tests.driven_designs import FAILED, FELT, FIRED, UNFELT, steps_of

SETUP = load_setup("direction")
PLAN = plan_of(SETUP.config, "P01", 1)
DAMPERS = {"vibration": "", "asymmetric-1": "off", "asymmetric-2": "on"}
ANSWERED = Answered(value="forward", by="synthetic", response_time_s=1.0, response_time_valid=True)


def driven(plan: Plan, setup: Setup[DesignConfig], troubles: dict[int, Outcome] | None = None) -> list[Step]:
    """All steps of a session but its close; the n-th is sent `troubles[n]` instead of what fits."""
    steps = to_the_end(plan, setup, troubles)
    assert steps[-1] == Close()
    return [step for step in steps if step != Close()]


def to_the_end(plan: Plan, setup: Setup[DesignConfig], troubles: dict[int, Outcome] | None = None) -> list[Step]:
    return steps_of(design_session(plan, setup), troubles)


def with_breaks(between_sets_s: float, between_sessions_s: float) -> Setup[DesignConfig]:
    return changed(
        "direction",
        breaks={"between_sets_s": between_sets_s, "between_sessions_s": between_sessions_s},
    )


def attempt_of(step: Step) -> int | None:
    """Which presentation of its trial a step is; `None` of a question."""
    return getattr(step, "attempt", None)


STEPS = driven(PLAN, SETUP)


def test_each_of_sixty_trials_is_prepared_fired_and_asked_in_the_order_of_the_plan() -> None:
    of_trials = [step for step in STEPS if not isinstance(step, Rest)]
    assert [type(step) for step in of_trials] == [Prepare, FireShot, Ask] * 60
    assert [step.trial for step in of_trials] == [trial for trial in PLAN.trials for _ in range(3)]
    assert {step.attempt for step in of_trials if not isinstance(step, Ask)} == {1}


def test_there_are_nine_rests_of_20_s_between_sets_and_two_of_300_s_between_sessions() -> None:
    rests = [step for step in STEPS if isinstance(step, Rest)]
    one_session = [("sets", 20.0)] * 3
    assert [(rest.between, rest.duration_s) for rest in rests] == [
        *one_session,
        ("sessions", 300.0),
        *one_session,
        ("sessions", 300.0),
        *one_session,
    ]
    assert sum(rest.duration_s for rest in rests) == planned_run(SETUP.config, PLAN).break_s == 780


def test_a_rest_follows_every_fifth_trial_but_the_last() -> None:
    places = [number for number, step in enumerate(STEPS) if isinstance(step, Rest)]
    assert places == [15 * k + k - 1 for k in range(1, 12)]
    assert isinstance(STEPS[-1], Ask)
    assert len(STEPS) == 60 * 3 + 11


def test_a_session_ends_with_a_close_before_which_the_last_trial_can_still_be_presented_again() -> None:
    last = len(STEPS)
    again = to_the_end(PLAN, SETUP, {last: Repeated(trial=PLAN.trials[-1], reason="noise")})
    assert again[:last] == STEPS
    assert [type(step) for step in again[last:]] == [Close, Prepare, FireShot, Ask, Close]
    assert {step.trial for step in again[last + 1 : -1]} == {PLAN.trials[-1]}


def test_a_trial_can_be_presented_again_in_the_break_that_follows_it_which_then_begins_anew() -> None:
    place = STEPS.index(Rest(between="sets", duration_s=20.0))
    again = driven(PLAN, SETUP, {place: Repeated(trial=PLAN.trials[4], reason="noise")})
    assert [type(step) for step in again[place : place + 5]] == [Rest, Prepare, FireShot, Ask, Rest]
    assert again[place + 5 :] == STEPS[place + 1 :]


def test_a_hand_over_names_the_damper_that_the_gun_file_names_for_the_method() -> None:
    hand_overs = [step for step in STEPS if isinstance(step, Prepare)]
    assert {step.trial.method: dict(step.settings).get("damper", "") for step in hand_overs} == DAMPERS


def test_the_question_and_its_answers_are_the_configs_and_name_no_method() -> None:
    asks = [step for step in STEPS if isinstance(step, Ask)]
    said = {(step.question, step.text, *(one.label for one in step.choices)) for step in asks}
    assert said == {("response", "Which way did the gun shoot?", "forward", "backward")}


@pytest.mark.slow
@pytest.mark.parametrize("trouble", [FAILED, FELT, UNFELT], ids=["failed", "felt", "unfelt"])
@pytest.mark.parametrize("part", [0, 1, 2], ids=["hand-over", "shot", "question"])
@pytest.mark.parametrize("trial", [0, 7, 59])
def test_a_trial_that_was_not_done_is_presented_again_from_the_hand_over(
    trouble: Outcome, part: int, trial: int
) -> None:
    rests = trial // 5
    number = trial * 3 + rests + part
    steps = driven(PLAN, SETUP, {number: trouble})
    again = steps[number + 1 : number + 4]
    assert [type(step) for step in again] == [Prepare, FireShot, Ask]
    assert {(step.trial, attempt_of(step)) for step in again} == {(PLAN.trials[trial], 2), (PLAN.trials[trial], None)}
    assert steps[: number + 1] + steps[number + 4 :] == STEPS[: number + 1] + STEPS[number - part + 3 :]


def test_attempts_count_on_until_a_trial_is_done_and_start_at_1_for_the_next() -> None:
    # the first shot fails, the second hand-over is broken off, and so is the third question
    steps = driven(PLAN, SETUP, {1: FAILED, 2: UNFELT, 5: FELT})
    assert [(step.kind, step.trial.trial, attempt_of(step)) for step in steps[:10]] == [
        ("prepare", 1, 1),
        ("fire", 1, 1),
        ("prepare", 1, 2),
        ("prepare", 1, 3),
        ("fire", 1, 3),
        ("ask", 1, None),
        ("prepare", 1, 4),
        ("fire", 1, 4),
        ("ask", 1, None),
        ("prepare", 2, 1),
    ]


def test_a_break_that_was_interrupted_is_taken_again_in_full() -> None:
    steps = driven(PLAN, SETUP, {15: UNFELT, 16: UNFELT})
    assert steps[15:18] == [Rest(between="sets", duration_s=20.0)] * 3
    assert steps[18:] == STEPS[16:]


@pytest.mark.parametrize(
    ("between_sets_s", "between_sessions_s", "rests"),
    [(0.0, 300.0, {"sessions": 2}), (20.0, 0.0, {"sets": 9}), (0.0, 0.0, {})],
)
def test_a_break_of_no_length_is_no_step(
    between_sets_s: float, between_sessions_s: float, rests: dict[str, int]
) -> None:
    steps = driven(PLAN, with_breaks(between_sets_s, between_sessions_s))
    assert Counter(step.between for step in steps if isinstance(step, Rest)) == rests
    assert [step for step in steps if not isinstance(step, Rest)] == [
        step for step in STEPS if not isinstance(step, Rest)
    ]


def test_a_session_of_one_trial_has_no_rest() -> None:
    plan = Plan(experiment="direction", participant_id="P01", seed=1, order_row=None, trials=PLAN.trials[:1])
    assert [type(step) for step in driven(plan, SETUP)] == [Prepare, FireShot, Ask]


@pytest.mark.slow
@settings(deadline=None, max_examples=40)
@given(st.dictionaries(st.integers(0, 250), st.sampled_from([FELT, UNFELT]), max_size=12))
def test_whatever_goes_wrong_every_trial_is_answered_once_in_order(troubles: dict[int, Outcome]) -> None:
    steps = driven(PLAN, SETUP, troubles)
    done = [step for number, step in enumerate(steps) if number not in troubles]
    assert [step.trial for step in done if isinstance(step, Ask)] == list(PLAN.trials)
    assert [step for step in done if isinstance(step, Rest)] == [step for step in STEPS if isinstance(step, Rest)]


# steps and outcomes in the journal

finite = st.floats(allow_nan=False, allow_infinity=False)
words = st.text(st.characters(codec="utf-8"))


def of_type(hint: Any) -> st.SearchStrategy[Any]:
    if get_origin(hint) is Literal:
        return st.sampled_from(get_args(hint))
    if get_origin(hint) is UnionType:
        return st.one_of([of_type(part) for part in get_args(hint)])
    if get_origin(hint) is tuple:
        kinds = get_args(hint)
        if kinds[-1] is not Ellipsis:
            return st.tuples(*map(of_type, kinds))
        return st.lists(of_type(kinds[0]), max_size=2).map(tuple)
    known = {NoneType: st.none(), str: words, int: st.integers(), float: finite, bool: st.booleans()}
    return known[hint] if hint in known else facts(hint)


def facts(kind: type) -> st.SearchStrategy[Any]:
    hints = get_type_hints(kind)
    return st.builds(kind, **{field.name: of_type(hints[field.name]) for field in fields(kind)})


steps_of_any_kind = st.one_of([facts(kind) for kind in get_args(Step)])
outcomes_of_any_kind = st.one_of([facts(kind) for kind in get_args(Outcome)])


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@given(steps_of_any_kind)
def test_any_step_reads_back_from_the_journal(step: Step) -> None:
    assert STEP.validate_python(json.loads(canonical_json(step_record(step)))) == step


@pytest.mark.slow
@settings(deadline=None, max_examples=200)
@given(outcomes_of_any_kind)
def test_any_outcome_reads_back_from_the_journal(outcome: Outcome) -> None:
    assert OUTCOME.validate_python(json.loads(canonical_json(step_record(outcome)))) == outcome


def test_kinds_are_told_apart_by_one_word_each() -> None:
    kinds = [kind.__dataclass_fields__["kind"].default for kind in (*get_args(Step), *get_args(Outcome))]
    assert len(set(kinds)) == len(kinds)


@pytest.mark.parametrize(
    "body",
    [
        None,
        [],
        {},
        {"kind": "leap"},
        {"kind": "fire"},
        {"kind": "fire", "trial": {}, "attempt": 1},
        step_record(STEPS[1]) | {"attempt": "twice"},
        step_record(STEPS[1])
        | {"trial": {"session": 1, "method": "vibration", "set": 1, "trial": 1, "direction": "up"}},
        step_record(FIRED),
    ],
)
def test_what_is_no_step_is_refused(body: object) -> None:
    with pytest.raises(ValidationError):
        STEP.validate_python(body)


@pytest.mark.parametrize(
    "body",
    [
        None,
        {},
        {"kind": "answered"},
        step_record(ANSWERED) | {"value": ["left"]},
        step_record(ANSWERED) | {"by": "nobody"},
        {"kind": "answered", "value": {}, "by": "participant"},
        step_record(STEPS[0]),
    ],
)
def test_what_is_no_outcome_is_refused(body: object) -> None:
    with pytest.raises(ValidationError):
        OUTCOME.validate_python(body)
