"""What the console shows without its window: no method's name too many, text that stands out, the time to go."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from typing import Any

import pytest
from experiments.screens.console.state import State, coming, gun_text, instruction, place_text
from hypothesis import given
from hypothesis import strategies as st

from experiments import catalogue
from experiments.plan import Trial
from experiments.remarks import AnswerCorrected, Flagged, Noted
from experiments.screens.console import theme
from experiments.screens.console.messages import Saved, Waiting
from experiments.setup import Setup
from experiments.steps import Answered, Ask, Prepare, Repeat
from tests.at_controls import CORRECTNESS, DIRECTION


def state_at(setup: Setup[Any], trial: int, make_step: Callable[[Trial], Any]) -> State:
    plan = catalogue.experiment(setup).make_plan(setup.config, "P01", 1, None)
    state = State(setup=setup, plan=plan)
    state.take(Waiting(step=make_step(plan.trials[trial]), since_s=0.0, until_s=30.0), 0.0)
    return state


def ask(trial: Trial) -> Ask:
    return Ask(trial=trial, attempt=1, question="Which way?", forward="forward", backward="backward")


def shown_texts(state: State) -> list[str]:
    shown = instruction(state, 10.0)
    return [shown.title, shown.detail, place_text(state), *coming(state), gun_text(state.gun)[0]]


@pytest.mark.parametrize("number", range(12))
def test_a_method_is_named_only_where_its_damper_is_set_by_hand(number: int) -> None:
    def prepare(trial: Trial) -> Prepare:
        return Prepare(trial=trial, attempt=2, damper=DIRECTION.gun.methods[trial.method].damper)

    for make_step in (prepare, ask):
        state = state_at(DIRECTION, number, make_step)
        said = "\n".join(shown_texts(state)).lower()
        for name in DIRECTION.config.design.methods:
            method = DIRECTION.gun.methods[name]
            if not (method.damper and state.trial.method == name):
                assert name not in said
                assert method.label.lower() not in said
        assert not CORRECTNESS.search(said)


def test_a_method_without_a_damper_is_a_letter_everywhere() -> None:
    assert any(not method.damper for method in DIRECTION.gun.methods.values())
    for number in range(12):
        state = state_at(DIRECTION, number, ask)
        if not DIRECTION.gun.methods[state.trial.method].damper:
            assert "(Method " in place_text(state)


@pytest.mark.parametrize("name", ["dark", "light"])
def test_text_of_every_mood_stands_out_on_ground_and_panel_seven_to_one(name: theme.Theme) -> None:
    for ground in ("ground", "panel"):
        for colour in (*theme.MOODS, "text", "quiet"):
            assert theme.contrast(name, colour, ground) >= 7, (colour, ground)


@pytest.mark.parametrize("name", ["dark", "light"])
def test_the_text_of_the_stop_button_stands_out(name: theme.Theme) -> None:
    assert theme.contrast(name, "stop_text", "stop") >= 4.5  # WCAG 2 AA; it is large and bold


def test_contrast_is_that_of_the_published_definition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(theme._COLOURS["light"], "grey", "#767676")
    assert theme.contrast("light", "grey") == pytest.approx(4.54, abs=0.005)
    # WCAG 2: a colour on itself is 1 to 1; #767676 is the lightest grey with 4.5 to 1 on white
    assert theme.contrast("light", "ground", "ground") == 1
    assert theme.contrast("light", "stop_text", "ground") == 1


@given(durations=st.lists(st.floats(1, 300), max_size=11))
def test_the_time_to_go_is_the_trials_left_at_the_median_of_those_measured(durations: list[float]) -> None:
    plan = catalogue.experiment(DIRECTION).make_plan(DIRECTION.config, "P01", 1, None)
    state, now_s = State(setup=DIRECTION, plan=plan), 100.0
    for trial, duration in zip(plan.trials, durations, strict=False):
        state.take(Waiting(step=Prepare(trial=trial, attempt=1, damper=""), since_s=now_s), now_s)
        now_s += duration
        given = Answered(
            response="forward", response_time_s=1.0, response_source="experimenter", response_time_valid=False
        )
        state.take(Saved(step=ask(trial), word=given), now_s)
    config, left = DIRECTION.config, len(plan.trials) - len(durations)
    planned_s = (config.duration_s - config.break_s) / len(plan.trials)
    trial_s = statistics.median(durations) if durations else planned_s
    assert state.remaining_s() == pytest.approx(left * trial_s + config.break_s)


def test_a_trial_presented_again_is_done_when_it_is_answered_again_and_can_be_found_before() -> None:
    state = state_at(DIRECTION, 1, ask)
    first = state.plan.trials[0]
    given = Answered(response="forward", response_time_s=1.0, response_source="experimenter", response_time_valid=False)
    state.take(Saved(step=ask(first), word=given), 1.0)
    state.take(Saved(step=None, word=AnswerCorrected(trial=first, response="backward")), 2.0)
    assert state.said(first) == "BACKWARD"
    prepare = Prepare(trial=state.plan.trials[1], attempt=1, damper="")
    state.take(Saved(step=prepare, word=Repeat(trial=first, reason="noise")), 3.0)
    state.take(Saved(step=None, word=Flagged(trial=first, flag="noise")), 3.0)
    state.take(Saved(step=None, word=Noted(trial=first, text="a dog")), 3.0)
    assert state.said(first) == "BACKWARD"
    state.take(Saved(step=ask(first), word=given), 4.0)
    assert state.said(first) == "FORWARD"
    assert state.answered_in_set() == [first]


def test_no_time_has_gone_by_before_the_run_begins() -> None:
    state = state_at(DIRECTION, 0, ask)
    assert state.elapsed_s(5_000.0) == 0.0
    state.began_s = 5_000.0
    assert state.elapsed_s(5_030.0) == 30.0
