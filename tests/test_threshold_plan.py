"""Planning a threshold: procedures that meet people at the levels they may, what it comes to, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.predict.threshold_plan.page import plan_in_short, sections_of_plan
from analysis.predict.threshold_plan.people import SyntheticPeople, answers_by, procedures
from analysis.predict.threshold_plan.run import (
    ThresholdPower,
    ThresholdRequest,
    people_fitted,
    procedures_of,
    threshold_power,
)
from experiments.config.door import ConfigError
from tests.conftest import Recoil

LEVELS = (6.0, 8.0, 10.0, 12.0, 14.0, 18.0)
PEOPLE = SyntheticPeople(thresholds=np.full(40, 10.0), spread=0.05, lapse=0.0, guess=0.5, chance=True)


@pytest.fixture(scope="module")
def found() -> ThresholdPower:
    return threshold_power(ThresholdRequest(config="voltages", trials="10,20", people=6))


@pytest.mark.slow
@pytest.mark.parametrize("procedure", procedures("yes"))
def test_every_procedure_stays_at_levels_that_may_be_felt(procedure: str) -> None:
    made = answers_by(procedure, PEOPLE, LEVELS, 24, np.random.default_rng(2))
    assert made.levels.shape == made.right.shape == (40, 24)
    assert made.levels.min() >= 6.0
    assert made.levels.max() <= 18.0
    steps = (made.levels - 6.0) / (12.0 / 60)
    assert np.abs(steps - steps.round()).max() < 1e-6


@pytest.mark.slow
def test_what_adapts_ends_nearer_the_threshold_than_it_began() -> None:
    for procedure in ("2-down-1-up", "3-down-1-up", "posterior"):
        made = answers_by(procedure, PEOPLE, LEVELS, 40, np.random.default_rng(3))
        assert np.abs(made.levels[:, -10:] - 10.0).mean() < 1.5, procedure


def test_constant_stimuli_are_as_often_in_every_block() -> None:
    made = answers_by("constant stimuli", PEOPLE, LEVELS, 12, np.random.default_rng(4))
    assert all(sorted(row[:6]) == sorted(row[6:]) == list(LEVELS) for row in made.levels.tolist())


@pytest.mark.slow
def test_each_procedure_and_number_of_trials_has_its_figures(found: ThresholdPower) -> None:
    assert [(one.procedure, one.trials) for one in found.procedures] == [
        (name, count) for name in procedures("right") for count in (10, 20)
    ]
    assert set(found.best) == {"10", "20"}
    assert all(one.width > 0 and one.rms_error >= abs(one.bias) for one in found.procedures)
    assert found.procedures[0].minutes == pytest.approx(10 * 17 / 60)
    told: list[str] = []
    again = threshold_power(request := ThresholdRequest(config="voltages", trials="20", people=6), told.append)
    assert again.to_frame().shape == (4, 9)
    assert len(told) == people_fitted(request) == 24


@pytest.mark.slow
def test_a_plan_says_which_procedure_to_take_and_what_was_assumed(found: ThresholdPower, tmp_path: Path) -> None:
    assert plan_in_short(found).title.endswith(": threshold of response, voltage in V, 6 simulated people a procedure")
    assert plan_in_short(found).items[0].startswith(f"10 trials (3 min): take {found.best['10']} (interval ")
    parts = sections_of_plan(found, tmp_path)
    (table,) = parts[1].tables
    assert all(len(row) == len(table.header) for row in table.rows)
    assert "threshold 9.5, spread 0.25" in parts[2].items[0]
    assert "The posterior rule goes from 6 to 18 in sixtieths" in parts[2].items[1]
    assert (tmp_path / "figure-thresholds.png").is_file()


@pytest.mark.slow
def test_a_plan_does_not_say_of_a_designs_own_rule_what_another_would_do(tmp_path: Path) -> None:
    own = threshold_power(ThresholdRequest(config="threshold", trials="10", people=4))
    how = sections_of_plan(own, tmp_path)[2].items[1]
    assert how.endswith(" The posterior rule is that of the design, at its levels.")


def test_which_designs_have_a_threshold_to_plan() -> None:
    assert procedures_of("direction") == procedures_of("magnitude") == ()
    assert "1-down-1-up" in procedures_of("stronger")
    with pytest.raises(ConfigError, match="no question with a success over numbers"):
        threshold_power(ThresholdRequest(config="pairs"))


@pytest.mark.slow
def test_the_command_writes_the_plan_and_refuses_what_is_not_of_it(recoil: Recoil, tmp_path: Path) -> None:
    done = recoil("power", "voltages", "--trials", "10", "--studies", "4", "--out", "plan", "--json")
    assert json.loads(done.stdout)["factor"] == "voltage_V"
    assert {"power.json", "report.html", "figures"} <= {path.name for path in (tmp_path / "plan").iterdir()}
    refused = recoil("power", "voltages", "--participants", "8")
    assert refused.returncode == 2
    assert "--participants: voltages has a threshold" in refused.stderr
