"""A model-based participant at the simulated gun: what their threshold is, and whole adaptive sessions with them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import logit, ndtri

from analysis.psychometric.fit import PsychometricFit
from analysis.summary.thresholds import thresholds
from device.methods import paper_methods
from device.parameters import GunParameters
from experiments.clock import VirtualClock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.laws import SyntheticAnswers
from experiments.synthetic.percept import PerceptParameters, evidence, percept_of
from tests.designs import changed

VOLTAGES = np.arange(2.0, 24.01, 0.5)


@dataclass(frozen=True)
class Somebody:
    """A model-based participant who says which way a method's shot went, forward as often as backward."""

    method: str
    sensitivity: float
    trials: int


def shares_right(someone: Somebody) -> np.ndarray:
    """How often they are right at each voltage: from the physics of the shot through the percept."""
    gun = paper_methods()[someone.method]
    assert isinstance(gun, GunParameters)
    percept = PerceptParameters(sensitivity=someone.sensitivity)
    felt = [percept_of(replace(gun, voltage_V=float(voltage)), percept.leak_s) for voltage in VOLTAGES]
    log_odds = np.array([evidence(one, percept) for one in felt])
    forward, backward = (forward_rates(sign * log_odds, percept.start, People()) for sign in (1, -1))
    return np.asarray((forward + 1 - backward) / 2)


def voltage_at(found: PsychometricFit, share: float) -> np.ndarray:
    """The voltage with so many right answers, lapses included: its 95 % interval around the median."""
    threshold, width, lapse, guess = found.draws.T[:4]
    felt = np.clip((share - guess) / (1 - guess - lapse), 1e-9, 1 - 1e-9)
    widths_off = ndtri(felt) / (2 * ndtri(0.95)) if found.shape == "normal" else logit(felt) / (2 * logit(0.95))
    return np.quantile(threshold + width * widths_off, [0.025, 0.5, 0.975])


def whole_setup(someone: Somebody) -> Setup[DesignConfig]:
    """The shipped threshold over 2 to 24 V, with priors as vague as the model's curve, answered from what is felt."""
    setup = changed(
        "threshold",
        below_break_away=True,
        factors={
            "method": {"levels": (someone.method,)},
            "voltage_V": {"levels": {"minimum": 2.0, "maximum": 24.0, "grain": 0.5}},
        },
        procedure={
            "trials": someone.trials // 2,
            "threshold": {"minimum": 0.0, "maximum": 30.0, "points": 61},
            "width": {"minimum": 3.0, "maximum": 80.0, "points": 20},
        },
        timing={"planned_s": 3000.0},
    )
    felt = {"law": "diffusion", "percept": {"sensitivity": someone.sensitivity}}
    return replace(setup, laws=SyntheticAnswers.model_validate({"questions": {"response": felt}}))


def whole_session(setup: Setup[DesignConfig], folder: Path, seed: int) -> tuple[PsychometricFit, int]:
    """A run from the engine to the table, and the report's fit of that; how many trials were answered."""
    request = RunRequest(setup=setup, participant_id="P01", results=folder, seed=seed)
    done = run(request, synthetic_screen, VirtualClock())
    assert done.place.journal.stat().st_size > 0
    table = pd.read_csv(done.place.table)
    found = thresholds(setup.config, "response", table)
    assert found is not None
    (one,) = found.conditions[0].people
    assert one.fit is not None
    return one.fit, int(table["response"].notna().sum())
