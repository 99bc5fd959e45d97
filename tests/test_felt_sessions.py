"""Participants who feel the gun in whole sessions: rates, speed against accuracy, ratings, and the example config."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from experiments.direction.synthetic import ModelParticipant, model_parameters
from experiments.direction.synthetic import synthetic_participant as direction_participant
from experiments.preference.session import make_plan as preference_plan
from experiments.preference.synthetic import strengths
from experiments.preference.synthetic import synthetic_participant as preference_participant

from analysis.logs.reading import read_logs
from experiments.config.setup import Setup
from experiments.design.plan import Plan
from experiments.design.streams import Stream
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.model_based import rates_by_instruction
from experiments.synthetic.percept import evidence, percepts_of
from experiments.synthetic.preference import feelings, felt_ratings
from tests.conftest import Recoil
from tests.felt_configs import felt_text, written
from tests.other_trials import with_levels

HURRY = shipped_folder() / "examples" / "hurry.toml"
PAPER = {"vibration": 0.557, "asymmetric-1": 0.793, "asymmetric-2": 0.929}
PEOPLE = 120


def felt(setup: Setup[Any], **tables: dict[str, object]) -> Setup[Any]:
    """The setup with somebody who feels the gun, and some of their numbers changed."""
    values = setup.config.model_dump()
    values["synthetic"] |= {"observer": "felt"}
    for name, changes in tables.items():
        values["synthetic"][name] |= changes
    return replace(setup, config=type(setup.config).model_validate(values))


DIRECTION, PREFERENCE = felt(load_setup("direction")), felt(load_setup("preference"))


def plans(setup: Setup[Any], count: int = PEOPLE) -> list[Plan]:
    return [make_plan(setup.config, f"P{number:03d}", 11, None) for number in range(count)]


# experiment 1


@pytest.mark.slow
def test_people_are_right_at_the_papers_forward_rates_in_the_mean() -> None:
    right: dict[str, list[bool]] = {name: [] for name in PAPER}
    for plan in plans(DIRECTION):
        someone = direction_participant(DIRECTION, plan)
        for trial in plan.trials:
            if trial.direction == "forward":
                right[trial.method].append(someone.answer(trial).response == "forward")
    for name, rate in PAPER.items():
        assert len(right[name]) == 10 * PEOPLE
        assert np.mean(right[name]) == pytest.approx(
            rate, abs=4.5 * math.sqrt(rate * (1 - rate) / (10 * PEOPLE)) + 1e-3
        )


def alike_hurry() -> Setup[Any]:
    """The example with people who are alike and never lapse, of whom theory says all."""
    return felt(
        load_setup(str(HURRY)),
        people=dict.fromkeys(("drift_factor_sd", "log_boundary_sd", "log_non_decision_sd", "logit_start_sd"), 0.0),
        diffusion={"lapses": {"rate": 0.0}},
    )


@pytest.fixture(scope="module")
def hurried() -> tuple[Setup[Any], dict[tuple[str, str], list[tuple[bool, float]]]]:
    """Forward trials by method and instruction: whether the answer was right, and its time in s."""
    setup = alike_hurry()
    found: dict[tuple[str, str], list[tuple[bool, float]]] = {}
    for plan in plans(setup, 80):
        someone = direction_participant(setup, plan)
        for trial in plan.trials:
            if trial.direction == "forward":
                answer = someone.answer(trial)
                told = (answer.response == "forward", answer.response_time_s)
                found.setdefault((trial.method, trial.instruction), []).append(told)
    return setup, found


@pytest.mark.slow
def test_who_is_hurried_errs_as_much_more_as_the_law_says(hurried: Any) -> None:
    setup, found = hurried
    mind = model_parameters(setup.config)
    methods = setup.gun.renderings(setup.config.design.methods)
    for method, percept in percepts_of(methods, mind.percept.leak_s).items():
        for name, rate in rates_by_instruction(mind, percept).items():
            marks = [right for right, _ in found[method, name]]
            assert np.mean(marks) == pytest.approx(rate, abs=4.5 * math.sqrt(rate * (1 - rate) / len(marks)))
    speed, accuracy = (np.mean(found["asymmetric-1", name], axis=0)[0] for name in ("speed", "accuracy"))
    assert speed + 0.08 < accuracy


@pytest.mark.slow
def test_who_is_hurried_is_as_much_faster_as_the_law_says(hurried: Any) -> None:
    # optional stopping: E[X] at the answer is z + v E[t], so E[t] = (a P - z) / v; and z (a - z) without drift
    setup, found = hurried
    mind = model_parameters(setup.config)
    methods = setup.gun.renderings(setup.config.design.methods)
    start, neutral = mind.percept.start, mind.boundaries["neutral"]
    for method, percept in percepts_of(methods, mind.percept.leak_s).items():
        drift = evidence(percept, mind.percept) / neutral
        for name, rate in rates_by_instruction(mind, percept).items():
            a, times = mind.boundaries[name], np.array([time for _, time in found[method, name]])
            decision_s = (a * rate - start * a) / drift if drift else start * (1 - start) * a * a
            error = times.std(ddof=1) / math.sqrt(len(times))
            assert times.mean() == pytest.approx(mind.non_decision_s + decision_s, abs=4.5 * error), (method, name)
    speed, accuracy = ([time for _, time in found["vibration", name]] for name in ("speed", "accuracy"))
    assert np.mean(speed) + 0.3 < np.mean(accuracy)


def test_times_are_whole_milliseconds_and_never_none(tmp_path: Path) -> None:
    text = felt_text(non_decision_s=0.0, boundaries="{ neutral = 0.01 }")
    setup = load_setup(str(written(tmp_path, text)))
    plan = make_plan(setup.config, "P01", 1, None)
    times = [direction_participant(setup, plan).answer(trial).response_time_s for trial in plan.trials]
    assert min(times) == 0.001
    assert all(time == round(time, 3) for time in times)


def test_an_answer_depends_on_seed_and_person_and_not_on_what_was_answered_before() -> None:
    plan = plans(DIRECTION, 1)[0]
    there = [direction_participant(DIRECTION, plan).answer(trial) for trial in plan.trials]
    someone = direction_participant(DIRECTION, plan)
    assert isinstance(someone, ModelParticipant)
    assert [someone.answer(trial) for trial in reversed(plan.trials)] == there[::-1]
    for other in (replace(plan, seed=12), replace(plan, participant_id="P999")):
        assert [direction_participant(DIRECTION, other).answer(trial) for trial in plan.trials] != there


def test_the_same_shot_told_otherwise_is_another_decision_of_the_same_person() -> None:
    setup = alike_hurry()
    plan = plans(setup, 1)[0]
    someone = direction_participant(setup, plan)
    for trial in plan.trials:
        told = [someone.answer(with_levels(trial, instruction=name)) for name in ("speed", "neutral", "")]
        assert told[1] == told[2]  # no instruction is neutral
        assert told[0] != told[1]


# experiment 2


@pytest.fixture(scope="module")
def ratings() -> np.ndarray:
    """Ratings, (people, methods)."""
    law, scale, felt_as = PREFERENCE.config.synthetic.appeal, PREFERENCE.config.rating, strengths(PREFERENCE)
    people = (felt_ratings(law, scale, felt_as, Stream(person, "ratings")) for person in range(4_000))
    return np.array([[person[name] for name in PAPER] for person in people])


@pytest.mark.slow
def test_mean_ratings_are_near_those_that_the_config_assumes_for_the_paper(ratings: np.ndarray) -> None:
    assumed = [PREFERENCE.config.synthetic.ratings.mean[name] for name in PAPER]
    error = ratings.std(axis=0, ddof=1) / math.sqrt(len(ratings))
    assert np.all(np.abs(ratings.mean(axis=0) - assumed) < 0.2 + 4.5 * error)


def test_as_many_rate_both_shots_alike_as_in_the_paper(ratings: np.ndarray) -> None:
    # 2 of 14; by chance some others come to the same grain
    share = (ratings[:, 1] == ratings[:, 2]).mean()
    assert share == pytest.approx(2 / 14, abs=0.015 + 4.5 * math.sqrt(2 / 14 * 12 / 14 / len(ratings)))
    assert (ratings[:, 0] < ratings[:, 1:].min(axis=1)).mean() > 0.85


def test_half_of_all_studies_of_fourteen_exceed_the_published_f(ratings: np.ndarray) -> None:
    from analysis import rm_anova

    found = rm_anova(ratings[: 285 * 14].reshape(285, 14, 3)).F
    assert (found > 33.810).mean() == pytest.approx(0.5, abs=4.5 * math.sqrt(0.25 / 285))


def test_ratings_are_on_the_scale_and_its_grain(ratings: np.ndarray) -> None:
    assert ratings.min() >= 0
    assert ratings.max() <= 10
    assert np.all(ratings == np.round(ratings, 1))


def test_a_vibration_is_not_felt_as_a_shot() -> None:
    found = strengths(PREFERENCE)
    assert found["vibration"] == 0.0 < found["asymmetric-1"] < found["asymmetric-2"]


def test_without_noise_a_rating_is_the_law() -> None:
    still = felt(PREFERENCE, appeal={"jnd": 0.0, "person_sd": 0.0, "criterion_sd": 0.0}).config
    found = felt_ratings(still.synthetic.appeal, still.rating, strengths(PREFERENCE), Stream(1, "ratings"))
    for name, strength in strengths(PREFERENCE).items():
        assert found[name] == pytest.approx(min(10.0, 2.3 + 4.9 * math.log(1 + strength)), abs=0.05 + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("jnd", [0.1, 0.33, 1.0])
def test_three_of_four_people_tell_which_of_two_shots_a_jnd_apart_is_stronger(jnd: float) -> None:
    # with a criterion as still as can be, a rating tells what is felt; ties of what is felt alike are half right
    law = PREFERENCE.config.synthetic.appeal.model_copy(update={"jnd": jnd, "criterion_sd": 0.0, "person_sd": 0.0})
    fine = PREFERENCE.config.rating.model_copy(update={"grain": 1e-6})
    spread = math.log1p(jnd) / (math.sqrt(2) * NormalDist().inv_cdf(0.75))
    above = below = 0
    for person in range(3_000):
        found = felt_ratings(law, fine, {"a": 1.0, "b": 1.0 + jnd}, Stream(person, "ratings"))
        above += found["b"] > found["a"]
        below += found["b"] < found["a"]
    # stronger by more than a jnd: z > 0, as the means are a jnd apart; weaker by more: z < -2 jnd
    assert above / 3_000 == pytest.approx(0.5, abs=4.5 * math.sqrt(0.25 / 3_000))
    expected = NormalDist().cdf(-2 * math.log1p(jnd) / (math.sqrt(2) * spread))
    assert below / 3_000 == pytest.approx(expected, abs=4.5 * math.sqrt(expected / 3_000))


def test_what_is_felt_alike_is_rated_alike_and_nothing_feels_like_something() -> None:
    assert feelings({"a": 0.0, "b": 0.0, "c": 1e-9}, 0.33) == [["a", "b"], ["c"]]
    law = PREFERENCE.config.synthetic.appeal
    for person in range(50):
        found = felt_ratings(law, PREFERENCE.config.rating, {"a": 0.0, "b": 0.0}, Stream(person, "ratings"))
        assert found["a"] == found["b"]


def test_seed_and_person_make_the_ratings() -> None:
    def told(seed: int, who: str) -> list[Any]:
        plan = preference_plan(PREFERENCE.config, who, seed, None)
        someone = preference_participant(PREFERENCE, plan)
        return [someone.rate(trial) for trial in sorted(plan.trials, key=lambda trial: trial.method)]

    assert told(1, "P01") == told(1, "P01")
    assert told(1, "P01") != told(2, "P01")
    assert told(1, "P01") != told(1, "P02")


# the example, as its user runs it


@pytest.mark.slow
def test_the_example_is_checked_run_and_read_with_its_instructions_and_without(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("configs", "--copy", "mine").returncode == 0
    config = "mine/examples/hurry.toml"
    checked = recoil("check", config)
    assert checked.returncode == 0
    assert "each in 2 of a session's 6 sets" in checked.stdout
    assert "“Answer as fast as you can. Mistakes do not matter.”" in checked.stdout
    assert "Felt      right answers to forward shots" in checked.stdout
    words = ("--screen", "synthetic", "--seed", "1", "--results", "results")
    assert recoil("run", config, "--participant", "P01", *words).returncode == 0
    table = next(tmp_path.glob("results/sub-P01/*_trials.csv"))
    logs = read_logs([table])
    assert not logs.problems
    assert logs.trials["instruction"].value_counts().to_dict() == {"speed": 30, "neutral": 30, "accuracy": 30}
    with table.open(newline="", encoding="utf-8") as file:
        rows = [row[:-1] for row in csv.reader(file)]
    older = tmp_path / "older" / "sub-P01" / table.name
    older.parent.mkdir(parents=True)
    older.write_text("".join(f"{','.join(row)}\r\n" for row in rows), encoding="utf-8", newline="")
    before = read_logs([older])
    assert not before.problems
    assert len(before.trials) == 90
    assert before.trials["instruction"].isna().all()
