"""The participant who answers from what the gun does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from device.methods import paper_methods
from experiments.direction.session import make_plan
from experiments.load import load_setup
from experiments.synthetic.diffusion import Lapses, People
from experiments.synthetic.model_based import NEUTRAL, ModelBasedParticipant, ModelParameters
from experiments.synthetic.percept import evidence, forward_rates, percepts_of

CONFIG = load_setup("direction").config
MIND = ModelParameters()
FELT = percepts_of(paper_methods(), MIND.percept.leak_s)
PLANS = [make_plan(CONFIG, f"P{number:03d}", 5, None) for number in range(250)]


def rates(mind: ModelParameters, instruction: str = NEUTRAL) -> dict[str, float]:
    """The share of right answers to forward shots."""
    right: dict[str, list[bool]] = {name: [] for name in FELT}
    for plan in PLANS:
        someone = ModelBasedParticipant(mind, FELT, plan)
        for trial in plan.trials:
            if trial.direction == "forward":
                right[trial.method].append(someone.decide(trial, instruction).upper)
    return {name: float(np.mean(marks)) for name, marks in right.items()}


def test_participants_answer_at_the_paper_s_rates() -> None:
    for name, rate in rates(MIND).items():
        expected = CONFIG.synthetic.rates.forward[name]
        assert rate == pytest.approx(expected, abs=4.5 * math.sqrt(expected * (1 - expected) / 2_500) + 1e-3)


def test_participants_who_differ_answer_at_the_mean_rate_of_theory() -> None:
    people = People(drift_factor_sd=0.3, log_boundary_sd=0.2, logit_start_sd=0.3)
    mind = replace(MIND, people=people, lapses=Lapses(rate=0.05))
    for name, rate in rates(mind).items():
        expected = float(forward_rates(evidence(FELT[name], mind.percept), mind.percept.start, people, lapse_rate=0.05))
        assert rate == pytest.approx(expected, abs=0.045)


def test_a_hurried_participant_is_faster_and_errs_more() -> None:
    hurried, careful = rates(MIND, "speed"), rates(MIND, "accuracy")
    assert hurried["asymmetric-1"] < careful["asymmetric-1"]
    someone = ModelBasedParticipant(MIND, FELT, PLANS[0])
    mean_s = [np.mean([someone.decide(t, how).time_s for t in PLANS[0].trials]) for how in ("speed", "accuracy")]
    assert mean_s[0] < mean_s[1]


def test_an_answer_does_not_depend_on_what_was_answered_before() -> None:
    one, other = (ModelBasedParticipant(MIND, FELT, PLANS[0]) for _ in range(2))
    last = PLANS[0].trials[-1]
    for trial in PLANS[0].trials[:-1]:
        one.decide(trial)
    assert one.decide(last) == other.decide(last)
