"""Participants who feel the gun in whole sessions: rates, speed against accuracy, ratings, and the example config."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from analysis.logs.reading import read_logs
from experiments.config.door import load
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of
from experiments.design.streams import Stream
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.answers import GivenAnswer, synthetic_participant_of
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import Lapses, People
from experiments.synthetic.laws import AppealLaw, DiffusionLaw, RatingsLaw, SyntheticAnswers
from experiments.synthetic.model_based import rates_by_instruction
from experiments.synthetic.percept import Percept, evidence, percepts_of
from experiments.synthetic.preference import feelings, felt_ratings
from tests.conftest import Recoil
from tests.designs import merged
from tests.felt_thresholds import VOLTAGES, Somebody, shares_right, voltage_at, whole_session, whole_setup
from tests.other_trials import with_levels

pytestmark = pytest.mark.slow

HURRY = shipped_folder() / "examples" / "hurry.toml"
PAPER = {"vibration": 0.557, "asymmetric-1": 0.793, "asymmetric-2": 0.929}
PEOPLE = 120


def felt(name: str, file: str, question: str, **values: object) -> Setup[DesignConfig]:
    """A design with somebody who feels the gun, and some of their numbers changed."""
    people = load(SyntheticAnswers, shipped_folder() / "synthetic" / file)
    laws = merged(people.model_dump(), {"questions": {question: values}})
    return replace(load_setup(name), laws=SyntheticAnswers.model_validate(laws))


def felt_direction(**values: object) -> Setup[DesignConfig]:
    return felt("direction", "direction-felt.toml", "response", **values)


def felt_preference(**values: object) -> Setup[DesignConfig]:
    return felt("preference", "preference-felt.toml", "rating", **values)


def law_of(setup: Setup[DesignConfig], question: str) -> Any:
    assert isinstance(setup.laws, SyntheticAnswers)
    return setup.laws.questions[question]


def percepts(setup: Setup[DesignConfig], law: DiffusionLaw | AppealLaw) -> dict[str, Percept]:
    """What the shots give to feel, by method."""
    return percepts_of(setup.gun.renderings(setup.config.methods), law.percept.leak_s)


DIRECTION, PREFERENCE = felt_direction(), felt_preference()
APPEAL: AppealLaw = law_of(PREFERENCE, "rating")
SCALE = PREFERENCE.config.questions["rating"].scale


def plans(setup: Setup[DesignConfig], count: int = PEOPLE) -> list[Plan]:
    return [plan_of(setup.config, f"P{number:03d}", 11) for number in range(count)]


def told(setup: Setup[DesignConfig], plan: Plan) -> list[GivenAnswer]:
    """The answers to all trials, in order."""
    someone = synthetic_participant_of(setup, plan)
    return [someone.answer(trial, "response") for trial in plan.trials]


def forward_shares(setup: Setup[DesignConfig], plan: Plan) -> dict[str, float]:
    """A person's share of right answers to forward shots, by method."""
    answers = list(zip(plan.trials, told(setup, plan), strict=True))
    return {
        name: float(
            np.mean(
                [
                    answer.response == "forward"
                    for trial, answer in answers
                    if (trial.method, trial.direction) == (name, "forward")
                ]
            )
        )
        for name in PAPER
    }


# experiment 1


def test_people_are_right_at_the_papers_forward_rates_in_the_mean() -> None:
    found = [forward_shares(DIRECTION, plan) for plan in plans(DIRECTION)]
    for name, rate in PAPER.items():
        assert np.mean([shares[name] for shares in found]) == pytest.approx(
            rate, abs=4.5 * math.sqrt(rate * (1 - rate) / (10 * PEOPLE)) + 1e-3
        )


def test_people_who_differ_and_lapse_are_right_at_the_mean_rate_of_theory() -> None:
    spreads = {"drift_factor_sd": 0.3, "log_boundary_sd": 0.2, "logit_start_sd": 0.3}
    setup = felt_direction(people=spreads, diffusion={"lapses": {"rate": 0.05}})
    mind = law_of(setup, "response").own
    assert (mind.people, mind.lapses) == (People(**spreads), Lapses(rate=0.05))
    found = [forward_shares(setup, plan) for plan in plans(setup, 100)]
    for name, percept in percepts(setup, law_of(setup, "response")).items():
        log_odds = evidence(percept, mind.percept)
        expected = float(forward_rates(log_odds, mind.percept.start, mind.people, lapse_rate=0.05))
        shares = [one[name] for one in found]
        error = np.std(shares, ddof=1) / math.sqrt(len(shares))
        assert np.mean(shares) == pytest.approx(expected, abs=4.5 * error)


def alike_hurry() -> Setup[DesignConfig]:
    """The example with people who are alike and never lapse, of whom theory says all."""
    alike = dict.fromkeys(("drift_factor_sd", "log_boundary_sd", "log_non_decision_sd", "logit_start_sd"), 0.0)
    return felt(str(HURRY), "hurry-felt.toml", "response", people=alike, diffusion={"lapses": {"rate": 0.0}})


@pytest.fixture(scope="module")
def hurried() -> tuple[Setup[DesignConfig], dict[tuple[str, str], list[tuple[bool, float]]]]:
    """Forward trials by method and instruction: whether the answer was right, and its time in s."""
    setup = alike_hurry()
    found: dict[tuple[str, str], list[tuple[bool, float]]] = {}
    for plan in plans(setup, 80):
        for trial, answer in zip(plan.trials, told(setup, plan), strict=True):
            if trial.direction == "forward":
                right = answer.response == "forward"
                found.setdefault((trial.method, trial.instruction), []).append((right, answer.response_time_s))
    return setup, found


def test_who_is_hurried_errs_as_much_more_as_the_law_says(hurried: Any) -> None:
    setup, found = hurried
    law = law_of(setup, "response")
    mind = law.own
    for method, percept in percepts(setup, law).items():
        for name, rate in rates_by_instruction(mind, percept).items():
            marks = [right for right, _ in found[method, name]]
            assert np.mean(marks) == pytest.approx(rate, abs=4.5 * math.sqrt(rate * (1 - rate) / len(marks)))
    speed, accuracy = (np.mean(found["asymmetric-1", name], axis=0)[0] for name in ("speed", "accuracy"))
    assert speed + 0.08 < accuracy


def test_who_is_hurried_is_as_much_faster_as_the_law_says(hurried: Any) -> None:
    # optional stopping: E[X] at the answer is z + v E[t], so E[t] = (a P - z) / v; and z (a - z) without drift
    setup, found = hurried
    law = law_of(setup, "response")
    mind = law.own
    start, neutral = mind.percept.start, mind.boundaries["neutral"]
    for method, percept in percepts(setup, law).items():
        drift = evidence(percept, mind.percept) / neutral
        for name, rate in rates_by_instruction(mind, percept).items():
            a, times = mind.boundaries[name], np.array([time for _, time in found[method, name]])
            decision_s = (a * rate - start * a) / drift if drift else start * (1 - start) * a * a
            error = times.std(ddof=1) / math.sqrt(len(times))
            assert times.mean() == pytest.approx(mind.non_decision_s + decision_s, abs=4.5 * error), (method, name)
    speed, accuracy = ([time for _, time in found["vibration", name]] for name in ("speed", "accuracy"))
    assert np.mean(speed) + 0.3 < np.mean(accuracy)


def test_times_are_whole_milliseconds_and_never_none() -> None:
    setup = felt_direction(diffusion={"non_decision_s": 0.0, "boundaries": {"neutral": 0.01}})
    times = [answer.response_time_s for answer in told(setup, plan_of(setup.config, "P01", 1))]
    assert min(times) == 0.001
    assert all(time == round(time, 3) for time in times)


def test_an_answer_depends_on_seed_and_person_and_not_on_what_was_answered_before() -> None:
    plan = plans(DIRECTION, 1)[0]
    there = told(DIRECTION, plan)
    someone = synthetic_participant_of(DIRECTION, plan)
    assert [someone.answer(trial, "response") for trial in reversed(plan.trials)] == there[::-1]
    for other in (replace(plan, seed=12), replace(plan, participant_id="P999")):
        assert told(DIRECTION, other) != there


def test_the_same_shot_told_otherwise_is_another_decision_of_the_same_person() -> None:
    setup = alike_hurry()
    plan = plans(setup, 1)[0]

    def if_told(name: str) -> list[GivenAnswer]:
        return told(setup, replace(plan, trials=tuple(with_levels(trial, instruction=name) for trial in plan.trials)))

    assert if_told("neutral") == if_told("")  # no instruction is neutral
    for hurried, neutral in zip(if_told("speed"), if_told("neutral"), strict=True):
        assert hurried != neutral


# experiment 2


def strengths(setup: Setup[DesignConfig]) -> Mapping[str, float]:
    """How strongly each method's shot is felt: its evidence, whichever way it points."""
    law = law_of(setup, "rating")
    return {name: abs(evidence(percept, law.percept.own)) for name, percept in percepts(setup, law).items()}


def rated(setup: Setup[DesignConfig], plan: Plan) -> dict[str, float | None]:
    """A person's ratings by method."""
    someone = synthetic_participant_of(setup, plan)
    return {trial.method: someone.rate(trial, "rating") for trial in plan.trials}


@pytest.fixture(scope="module")
def ratings() -> np.ndarray:
    """Ratings, (people, methods)."""
    plan = plan_of(PREFERENCE.config, "P01", 1)
    people = [rated(PREFERENCE, replace(plan, seed=person)) for person in range(4_000)]
    return np.array([[person[name] for name in PAPER] for person in people], dtype=np.float64)


def test_mean_ratings_are_near_those_that_the_config_assumes_for_the_paper(ratings: np.ndarray) -> None:
    drawn = law_of(load_setup("preference"), "rating")
    assert isinstance(drawn, RatingsLaw)
    assumed = [drawn.mean[name] for name in PAPER]
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
    still = felt_preference(appeal={"jnd": 0.0, "person_sd": 0.0, "criterion_sd": 0.0})
    found = rated(still, plan_of(still.config, "P01", 1))
    for name, strength in strengths(still).items():
        assert found[name] == pytest.approx(min(10.0, 2.3 + 4.9 * math.log(1 + strength)), abs=0.05 + 1e-9)


@pytest.mark.parametrize("jnd", [0.1, 0.33, 1.0])
def test_three_of_four_people_tell_which_of_two_shots_a_jnd_apart_is_stronger(jnd: float) -> None:
    # with a criterion as still as can be, a rating tells what is felt; ties of what is felt alike are half right
    law = APPEAL.appeal.model_copy(update={"jnd": jnd, "criterion_sd": 0.0, "person_sd": 0.0})
    fine = SCALE._replace(grain=1e-6)
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
    for person in range(50):
        found = felt_ratings(APPEAL.appeal, SCALE, {"a": 0.0, "b": 0.0}, Stream(person, "ratings"))
        assert found["a"] == found["b"]


def test_seed_and_person_make_the_ratings() -> None:
    def of(seed: int, who: str) -> dict[str, float | None]:
        return rated(PREFERENCE, plan_of(PREFERENCE.config, who, seed))

    assert of(1, "P01") == of(1, "P01")
    assert of(1, "P01") != of(2, "P01")
    assert of(1, "P01") != of(1, "P02")


# the example, as its user runs it


def test_the_example_is_checked_run_and_read_with_its_instructions_and_without(recoil: Recoil, tmp_path: Path) -> None:
    assert recoil("configs", "--copy", "mine").returncode == 0
    config = "mine/examples/hurry.toml"
    checked = recoil("check", config)
    assert checked.returncode == 0
    said = " ".join(checked.stdout.split())
    assert "instruction (speed, neutral, accuracy)" in said
    assert "30 trials in 6 sets of 5" in said
    assert "Instruction was constant in a set." in said
    assert "Felt: right answers to forward shots" in said
    words = ("--screen", "synthetic", "--seed", "1", "--results", "results")
    assert recoil("run", config, "--participant", "P01", *words).returncode == 0
    table = next(tmp_path.glob("results/sub-P01/*_trials.csv"))
    logs = read_logs([table])
    assert not logs.problems
    assert logs.trials["instruction"].value_counts().to_dict() == {"speed": 30, "neutral": 30, "accuracy": 30}
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    older = tmp_path / "older" / "sub-P01" / table.name
    older.parent.mkdir(parents=True)
    with older.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [name for name in rows[0] if name != "instruction"], extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    before = read_logs([older])
    assert not before.problems
    assert len(before.trials) == 90
    assert before.trials["instruction"].isna().all()


def test_a_check_of_the_example_has_the_words_that_are_read_out(recoil: Recoil) -> None:
    said = " ".join(recoil("check", HURRY).stdout.split())
    for text in load_setup(str(HURRY)).config.factors["instruction"].texts.values():
        assert text in said


@pytest.mark.parametrize("seed", range(2))
def test_an_adaptive_session_brackets_the_voltage_that_the_percept_gives(seed: int, tmp_path: Path) -> None:
    """`make soak` has 500 of them (gun_threshold)."""
    someone = Somebody("asymmetric-2", 0.213, 160)
    fit, answers = whole_session(whole_setup(someone), tmp_path, seed)
    low, _, high = voltage_at(fit, 0.75)
    assert low <= np.interp(0.75, shares_right(someone), VOLTAGES) <= high
    assert answers == someone.trials
