"""Instructions, one a set: balanced in the plan, told by the screens, kept in journal and table."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.clock import VirtualClock
from experiments.config.setup import Setup, canonical_json
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of, practice_of
from experiments.load import load_setup, shipped_folder
from experiments.record.journal import read_journal
from experiments.record.replay import history
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.console.instructions import instruction
from experiments.screens.console.progress import coming
from experiments.screens.console.view import About, Seen
from experiments.screens.synthetic import synthetic_screen
from experiments.screens.terminal import TerminalScreen
from experiments.screens.texts import read_out_text
from experiments.session.design_session import design_session
from experiments.session.states import Position, State
from experiments.session.steps import OUTCOME, STEP, Prepare, step_record
from tests.designs import direction_with
from tests.other_trials import with_levels

HURRY = load_setup(str(shipped_folder() / "examples" / "hurry.toml"))
PLAIN = load_setup("direction")
TEXTS = HURRY.config.factors["instruction"].texts
NAMES = ("speed", "neutral", "accuracy", "whisper")


def with_instructions(names: tuple[str, ...], sets: int) -> DesignConfig:
    """Experiment 1 with sets of two trials, each under one of these instructions."""
    told = {"levels": names, "texts": {name: f"{name}!" for name in names}}
    more = {"factors": {"instruction": told}, "order": {"set": ("instruction",)}} if names else {}
    return direction_with(sets=sets, repetitions=sets, **more).config


def by_set(plan: Plan) -> dict[tuple[int, int], set[str]]:
    found: dict[tuple[int, int], set[str]] = {}
    for trial in plan.trials:
        found.setdefault((trial.session, trial.set), set()).add(trial.instruction)
    return found


# the plan


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 2**63 - 1))
def test_each_instruction_comes_equally_often_in_every_session_one_a_set(count: int, each: int, seed: int) -> None:
    config = with_instructions(NAMES[:count], count * each)
    sets = by_set(plan_of(config, "P01", seed))
    assert all(len(names) == 1 for names in sets.values())
    for number in (1, 2, 3):
        found = Counter(next(iter(names)) for (session, _), names in sets.items() if session == number)
        assert found == dict.fromkeys(NAMES[:count], each)


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**63 - 1))
def test_instructions_change_nothing_else_of_a_plan(seed: int) -> None:
    names = ("speed", "accuracy")
    instructed = plan_of(with_instructions(names, 4), "P01", seed)
    plain = plan_of(with_instructions((), 4), "P01", seed)
    assert tuple(with_levels(trial, instruction="") for trial in instructed.trials) == plain.trials


@pytest.mark.slow
def test_every_order_of_instructions_comes_as_often_as_each_other() -> None:
    # six orders of three, in 3 x 400 sessions; chi-square with 5 degrees of freedom, p = 1e-4
    config = with_instructions(NAMES[:3], 3)
    plans = [by_set(plan_of(config, "P01", seed)) for seed in range(400)]
    orders = Counter(
        tuple(next(iter(sets[session, place])) for place in (1, 2, 3)) for sets in plans for session in (1, 2, 3)
    )
    assert len(orders) == 6
    assert sum((count - 200) ** 2 for count in orders.values()) / 200 < 25.74


def test_a_plan_without_instructions_says_nothing_of_them() -> None:
    plan = plan_of(PLAIN.config, "P01", 1)
    assert b"instruction" not in canonical_json(plan.record())
    assert Plan.from_record(plan.record()) == plan


def test_a_plan_with_instructions_is_read_back_and_has_a_hash_of_its_own() -> None:
    plan = plan_of(HURRY.config, "P01", 1, row=0)
    assert {trial.instruction for trial in plan.trials} == {"speed", "neutral", "accuracy"}
    assert Plan.from_record(plan.record()) == plan
    bare = replace(plan, trials=tuple(with_levels(trial, instruction="") for trial in plan.trials))
    assert bare.sha256() != plan.sha256()


def test_a_practice_has_no_instruction() -> None:
    practice = practice_of(HURRY.config, "P01", 1)
    assert {trial.instruction for trial in practice.trials} == {""}


# the screens


def prepares(setup: Setup[DesignConfig]) -> list[Prepare]:
    """The hand-overs of a run's first trials, as its session yields them."""
    plan = plan_of(setup.config, "P01", 1)
    return [next(design_session(replace(plan, trials=plan.trials[place:]), setup)) for place in range(7)]


def test_a_hand_over_carries_the_text_of_its_sets_instruction() -> None:
    for step in prepares(HURRY):
        assert step.instruction == TEXTS[step.trial.instruction]
        assert STEP.validate_python(step_record(step)) == step


def test_a_hand_over_without_an_instruction_is_recorded_as_before_there_were_any() -> None:
    step = prepares(PLAIN)[0]
    assert set(step_record(step)) == {"trial", "attempt", "settings", "kind"}
    assert set(step_record(step)["trial"]) == {"session", "set", "trial", "levels"}


def seen(setup: Setup[DesignConfig], plan: Plan, step: Prepare) -> Seen:
    """A console at a hand-over."""
    return Seen(about=About(setup=setup, plan=plan), position=Position(states=(State.PREPARING,), step=step))


def test_every_screen_has_it_read_out_before_a_set_and_shows_it_at_its_other_trials() -> None:
    plan = plan_of(HURRY.config, "P01", 1)
    for step in prepares(HURRY):
        how = "READ OUT" if step.trial.trial in (1, 6) else "Instruction of this set"
        shown = instruction(seen(HURRY, plan, step)).detail
        assert shown.startswith(f"{how}: “{step.instruction}”\n")
        assert read_out_text(plan, step) in typed(plan, step)
        if step.trial.trial == 4:
            assert f"instruction: {plan.trials[5].instruction}" in coming(seen(HURRY, plan, step), 5)


def test_the_console_and_the_terminal_say_nothing_where_there_is_none() -> None:
    step, plan = prepares(PLAIN)[0], plan_of(PLAIN.config, "P01", 1)
    here = seen(PLAIN, plan, step)
    shown = [instruction(here).detail, *coming(here), typed(plan, step)]
    assert not any("READ OUT" in text or "nstruction" in text for text in shown)


def typed(plan: Plan, step: Prepare) -> str:
    """What the terminal says at a hand-over."""
    screen = TerminalScreen(plan, VirtualClock(), io.StringIO(), io.StringIO())
    return screen.text(Position(states=(State.PREPARING,), step=step))


# journal and table


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A run of the example: its journal and its table."""
    request = RunRequest(setup=HURRY, participant_id="P01", results=tmp_path_factory.mktemp("results"), seed=1)
    finished = run(request, synthetic_screen, VirtualClock())
    return finished.place.journal, finished.place.table


@pytest.mark.slow
def test_the_first_record_and_the_table_hold_each_trials_instruction(done: tuple[Path, Path]) -> None:
    contents = read_journal(done[0])
    planned = [trial.instruction for trial in contents.plan.trials]
    with done[1].open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["instruction"] for row in rows] == planned
    assert Counter(planned) == {"speed": 30, "neutral": 30, "accuracy": 30}
    read_out = [step.instruction for step, _ in history(contents) if isinstance(step, Prepare)]
    assert read_out == [TEXTS[name] for name in planned]


@pytest.mark.slow
def test_the_answers_of_the_hurried_are_quicker(done: tuple[Path, Path]) -> None:
    with done[1].open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    means = {}
    for name in TEXTS:
        times = [float(row["response_time_s"]) for row in rows if row["instruction"] == name]
        means[name] = sum(times) / len(times)
    assert means["speed"] < means["neutral"] < means["accuracy"]
    assert {(row["response_source"], row["response_time_valid"]) for row in rows} == {("synthetic", "1")}


def test_the_time_of_a_key_is_in_the_record_only_where_there_is_one() -> None:
    body = {
        "kind": "answered", "value": "forward", "by": "synthetic", "response_time_s": 0.5, "response_time_valid": True,
    }  # fmt: skip
    answered = OUTCOME.validate_python(body)
    assert step_record(answered) == body
    assert step_record(replace(answered, key_time_s=0.0))["key_time_s"] == 0.0
    assert math.isclose(OUTCOME.validate_python(body | {"key_time_s": 0.51}).key_time_s, 0.51)
