"""The participant who answers from what the gun does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from device.methods import paper_methods
from experiments.load import load_setup
from experiments.synthetic.diffusion import Lapses, People
from experiments.synthetic.model_based import NEUTRAL, ModelBasedParticipant, ModelParameters
from experiments.synthetic.percept import evidence, forward_rates, percepts_of

CONFIG = load_setup("direction").config
MIND = ModelParameters()
FELT = percepts_of(paper_methods(), MIND.percept.leak_s)
PLANS = [make_plan(CONFIG, f"P{number:03d}", 5, None) for number in range(100)]


@pytest.mark.slow
def test_participants_who_differ_answer_at_the_mean_rate_of_theory() -> None:
    people = People(drift_factor_sd=0.3, log_boundary_sd=0.2, logit_start_sd=0.3)
    mind = replace(MIND, people=people, lapses=Lapses(rate=0.05))
    right: dict[str, list[float]] = {name: [] for name in FELT}
    for plan in PLANS:
        someone = ModelBasedParticipant(mind, FELT, plan)
        for name, shares in right.items():
            trials = [trial for trial in plan.trials if (trial.method, trial.direction) == (name, "forward")]
            shares.append(float(np.mean([someone.decide(trial, NEUTRAL).upper for trial in trials])))
    for name, shares in right.items():
        expected = float(forward_rates(evidence(FELT[name], mind.percept), mind.percept.start, people, lapse_rate=0.05))
        error = np.std(shares, ddof=1) / math.sqrt(len(PLANS))
        assert np.mean(shares) == pytest.approx(expected, abs=4.5 * error)


def test_an_answer_does_not_depend_on_what_was_answered_before() -> None:
    one, other = (ModelBasedParticipant(MIND, FELT, PLANS[0]) for _ in range(2))
    last = PLANS[0].trials[-1]
    for trial in PLANS[0].trials[:-1]:
        one.decide(trial)
    assert one.decide(last) == other.decide(last)
