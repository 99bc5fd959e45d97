from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.design.planning import plan_of
from experiments.load import load_setup
from experiments.session.design_session import design_session
from experiments.session.steps import (
    Answered,
    Close,
    Describe,
    Outcome,
    Prepare,
    Present,
    Rate,
    Repeated,
    Step,
    step_record,
)
from tests.driven_designs import FAILED, FELT, UNFELT, steps_of

SETUP = load_setup("preference")
PLAN = plan_of(SETUP.config, "P01", 1)
QUESTION = (
    "How much do you like such haptic feedback for simulating shooting recoil in a first-person shooting game "
    "in virtual reality?"
)


def driven(troubles: dict[int, Outcome] | None = None) -> list[Step]:
    """All steps but the close at the end."""
    steps = steps_of(design_session(PLAN, SETUP), troubles)
    assert steps[-1] == Close()
    return steps[:-1]


STEPS = driven()


def test_three_stimuli_are_felt_before_any_is_rated() -> None:
    assert [type(step) for step in STEPS] == [Prepare, Present] * 3 + [Rate, Describe] * 3


def test_stimuli_are_felt_rated_and_described_in_the_order_of_presentation() -> None:
    assert [step.trial for step in STEPS[:6]] == [trial for trial in PLAN.trials for _ in range(2)]
    assert [step.trial for step in STEPS[6:]] == [trial for trial in PLAN.trials for _ in range(2)]
    assert [step.trial.trial for step in STEPS[6:]] == [1, 1, 2, 2, 3, 3]


def test_a_stimulus_is_repeated_as_the_config_says_until_next() -> None:
    presents = [step for step in STEPS if isinstance(step, Present)]
    assert {(step.repeat_every_s, step.max_shots, step.attempt) for step in presents} == {(1.0, 120, 1)}
    assert {step.trial.direction for step in presents} == {"forward"}


def test_the_question_is_the_papers_and_names_no_method() -> None:
    rates = [step for step in STEPS if isinstance(step, Rate)]
    assert {(step.question, step.text) for step in rates} == {("rating", QUESTION)}
    shown = {key: value for key, value in step_record(rates[0]).items() if key != "trial"}
    for method in PLAN.methods:
        for name in (method, SETUP.gun.methods[method].label):
            assert name.lower() not in str(shown).lower()


def test_the_scale_is_that_of_the_config() -> None:
    scale: Any = next(step for step in STEPS if isinstance(step, Rate))
    assert (scale.minimum, scale.maximum, scale.grain) == (0.0, 10.0, 0.1)
    assert (scale.minimum_text, scale.maximum_text) == ("dislike very much", "like very much")


@pytest.mark.parametrize("trouble", [FAILED, FELT, UNFELT], ids=["failed", "felt", "unfelt"])
@pytest.mark.parametrize("number", range(6))
def test_a_stimulus_that_was_not_felt_to_its_end_is_presented_again(trouble: Outcome, number: int) -> None:
    steps = driven({number: trouble})
    again = steps[number + 1 : number + 3]
    assert [type(step) for step in again] == [Prepare, Present]
    assert {(step.trial, step.attempt) for step in again} == {(STEPS[number].trial, 2)}
    assert steps[: number + 1] == STEPS[: number + 1]
    assert steps[number + 3 :] == STEPS[number - number % 2 + 2 :]


@pytest.mark.parametrize("number", range(6, 12))
def test_a_question_that_was_interrupted_is_asked_again_without_a_new_stimulus(number: int) -> None:
    steps = driven({number: UNFELT, number + 1: UNFELT})
    assert steps == [*STEPS[:number], *[STEPS[number]] * 3, *STEPS[number + 1 :]]


@pytest.mark.parametrize("rating", [0.0, None])
def test_0_is_a_rating_and_none_is_no_answer_and_both_are_answers(rating: float | None) -> None:
    assert driven({6: Answered(value=rating, by="participant")}) == STEPS


@pytest.mark.slow
@settings(deadline=None)
@given(st.dictionaries(st.integers(0, 40), st.sampled_from([FELT, UNFELT]), max_size=10))
def test_whatever_goes_wrong_each_method_is_felt_rated_and_described_once(troubles: dict[int, Outcome]) -> None:
    done = [step for number, step in enumerate(driven(troubles)) if number not in troubles]
    for kind in (Present, Rate, Describe):
        assert [step.trial for step in done if isinstance(step, kind)] == list(PLAN.trials)


def test_a_stimulus_can_be_presented_again_as_long_as_its_rating_is_not_in() -> None:
    steps = driven()
    place = next(number for number, step in enumerate(steps) if isinstance(step, Rate))
    again = driven({place: Repeated(trial=PLAN.trials[0], reason="a phone")})
    assert [type(step) for step in again[place : place + 4]] == [Rate, Prepare, Present, Rate]
    assert again[place + 3 :] == steps[place:]
