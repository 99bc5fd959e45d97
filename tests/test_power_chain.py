"""What `recoil power` counts is what the whole chain would say: plans, sessions, journals, tables, statistics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from analysis.predict.power.planned import ANOVA
from experiments.load import load_setup
from tests.power_chain import counted, null_setup, said, through_the_chain


@pytest.mark.slow
@pytest.mark.parametrize(("experiment", "participants"), [("direction", 4), ("preference", 8)])
def test_the_claims_are_those_of_statistics_json(experiment: str, participants: int, tmp_path: Path) -> None:
    """With the config's own people, so that something is significant."""
    found = through_the_chain(load_setup(experiment), participants, 1, tmp_path)
    claims = {claim: bool(held[0]) for claim, held in counted(found).claims.items()}
    assert claims == said(found)
    assert claims[ANOVA]


@pytest.mark.slow
def test_null_participants_guess_in_their_logs_too(tmp_path: Path) -> None:
    found = through_the_chain(null_setup("direction"), 4, 1, tmp_path)
    pooled = [test["successes"] for tests in found["binomial"].values() for test in tests.values()]
    assert abs(sum(pooled) - 120) < 4 * np.sqrt(240 / 4)
    assert {claim: bool(held[0]) for claim, held in counted(found).claims.items()} == said(found)
