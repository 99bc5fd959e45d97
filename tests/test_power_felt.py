"""Studies of participants who feel the gun, drawn by the batch: the same people as those who sit through sessions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from analysis.predict.drawn import DirectionStudies, studies_of
from analysis.predict.power.grid import PowerRequest, make_grid, run_chunk
from analysis.predict.power.planned import ANOVA, ANY_PAIR, merged, shares
from analysis.predict.synthetic_studies import Felt, felt_counts, felt_people, percepts_of_methods
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.planning import plan_of
from experiments.design.streams import generator
from experiments.load import load_setup
from experiments.synthetic.answers import synthetic_participant_of
from experiments.synthetic.decision import forward_rates
from experiments.synthetic.diffusion import People
from experiments.synthetic.laws import DiffusionLaw
from tests.conftest import Recoil
from tests.felt_configs import felt_config
from tests.power_chain import homogeneity_p

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
SPREADS = {"drift_factor_sd": 0.3, "log_boundary_sd": 0.2, "logit_start_sd": 0.4}


def felt_of(setup: Setup[DesignConfig], effect: float = 1.0) -> Felt:
    """The participants of a setup, as power draws them."""
    found = studies_of(setup)
    assert isinstance(found, DirectionStudies)
    law = law_of(setup)
    return felt_people(law, found.instructions, percepts_of_methods(setup.gun, METHODS, law), METHODS, effect)


def law_of(setup: Setup[DesignConfig]) -> DiffusionLaw:
    law = studies_of(setup).law
    assert isinstance(law, DiffusionLaw)
    return law


def stepped(setup: Setup[DesignConfig], people: int) -> np.ndarray:
    """Correct answers (people, methods, 2 directions) of people who answer trial by trial."""
    steps = np.zeros((people, len(METHODS), 2), dtype=np.int64)
    for person in range(people):
        plan = plan_of(setup.config, f"P{person}", person)
        someone = synthetic_participant_of(setup, plan)
        for trial in plan.trials:
            right = someone.answer(trial, "response").response == trial.direction
            steps[person, METHODS.index(trial.method), int(trial.direction == "backward")] += right
    return steps


@pytest.mark.slow
@pytest.mark.parametrize("instructions", [pytest.param((), marks=pytest.mark.soak), ("speed", "accuracy")])
def test_the_answers_are_distributed_as_those_of_the_participant_step_by_step(
    instructions: tuple[str, ...], tmp_path: Path
) -> None:
    """Counts of a cell, and sums and differences over cells, in which people's differences show."""
    setup = load_setup(str(felt_config(tmp_path, instructions, SPREADS)))
    steps = stepped(setup, 50)
    at_once = felt_counts(felt_of(setup), (10, 10), 50, 400, generator(1, "test")).reshape(-1, 3, 2)
    summaries = {
        **{str(cell): (steps[:, *cell], at_once[:, *cell]) for cell in np.ndindex(3, 2)},
        "drift": (steps[:, 1:].sum(axis=(1, 2)), at_once[:, 1:].sum(axis=(1, 2))),
        "bias": (*(np.diff(counts.sum(axis=1)).ravel() for counts in (steps, at_once)),),
    }
    for name, (one, other) in summaries.items():
        assert homogeneity_p(one, other) > 0.001, name


def test_mean_rates_are_those_of_the_quadrature() -> None:
    people = People(drift_factor_sd=0.3, log_boundary_sd=0.2, logit_start_sd=0.4)
    felt = Felt(log_odds=(0.0, 1.1, 2.3), start=0.56, people=people, lapse_rate=0.1)
    means = felt_counts(felt, (10, 10), 100, 400, generator(2, "test")).mean(axis=(0, 1)) / 10
    forward = forward_rates([0.0, 1.1, 2.3], 0.56, people, lapse_rate=0.1)
    backward = 1.0 - forward_rates([-0.0, -1.1, -2.3], 0.56, people, lapse_rate=0.1)
    assert means == pytest.approx(np.column_stack([forward, backward]), abs=4 * 0.2 / 200)


def test_the_effect_is_a_factor_on_the_evidence(tmp_path: Path) -> None:
    setup = load_setup(str(felt_config(tmp_path)))
    one, half = (felt_of(setup, effect) for effect in (1.0, 0.5))
    assert half.log_odds == pytest.approx([0.5 * value for value in one.log_odds])
    assert half.log_odds[METHODS.index("vibration")] == 0.0


def test_an_instruction_changes_the_rate_by_its_boundary(tmp_path: Path) -> None:
    setup = load_setup(str(felt_config(tmp_path, ("speed", "accuracy"))))
    boundaries, felt = law_of(setup).diffusion.boundaries, felt_of(setup)
    assert felt.cautions == pytest.approx([boundaries[n] / boundaries["neutral"] for n in ("speed", "accuracy")])
    means = felt_counts(felt, (10, 10), 100, 400, generator(3, "test")).mean(axis=(0, 1)) / 10
    rates = [forward_rates(np.array(felt.log_odds) * caution, felt.start, felt.people) for caution in felt.cautions]
    assert means[:, 0] == pytest.approx(np.mean(rates, axis=0), abs=4 * 0.2 / 200)


@pytest.mark.slow
def test_null_participants_give_five_percent(tmp_path: Path) -> None:
    config = felt_config(tmp_path, spreads=SPREADS)
    grid = make_grid(PowerRequest(config=str(config), participants="14", null=True, studies=20_000))
    assert [cell.design.people for cell in grid.cells] == ["guessing", "guessing, with the config's bias"]
    for cell in grid.cells:
        found = {one.claim: one.share for one in shares(merged([run_chunk(c) for c in grid.chunks_of(cell)]))}
        for claim in (ANOVA, ANY_PAIR, *(f"d′, {method}" for method in METHODS)):
            assert abs(found[claim] - 0.05) < 4 * np.sqrt(0.05 * 0.95 / 20_000) + 0.003, (cell.design.people, claim)


@pytest.mark.slow
def test_those_who_guess_without_bias_keep_the_exact_test_at_its_size(tmp_path: Path) -> None:
    """The size by its definition: all outcomes of 140 that the test rejects."""
    config = felt_config(tmp_path, spreads=SPREADS)
    grid = make_grid(PowerRequest(config=str(config), participants="14", null=True, studies=20_000))
    guessing = merged([run_chunk(chunk) for chunk in grid.chunks_of(grid.cells[0])])
    outcomes = range(141)
    size = sum(stats.binom.pmf(k, 140, 0.5) for k in outcomes if stats.binomtest(k, 140).pvalue < 0.05)
    for claim in (name for name in guessing.held if name.startswith("binomial")):
        assert abs(guessing.held[claim] / 20_000 - size) < 4 * np.sqrt(size * (1 - size) / 20_000)


def test_a_piece_travels_with_all_that_it_needs(tmp_path: Path) -> None:
    """No config file, gun or physics at the worker: the evidence is in the piece."""
    grid = make_grid(PowerRequest(config=str(felt_config(tmp_path)), participants="14", effects="0.5", studies=10))
    chunk = grid.chunks()[0]
    assert chunk.felt is not None
    gone = chunk.config.design.model_copy(update={"gun": "gone.toml", "synthetic": "gone.toml"})
    again = run_chunk(replace(chunk, config=replace(chunk.config, design=gone)))
    assert again == run_chunk(chunk)


def test_trials_must_give_every_instruction_its_sets(tmp_path: Path) -> None:
    config = str(felt_config(tmp_path, ("speed", "accuracy")))
    grid = make_grid(PowerRequest(config=config, participants="14", trials="10-40", studies=10))
    assert {cell.design.trials for cell in grid.cells} == {10, 20, 30, 40}


@pytest.mark.slow
def test_the_command_says_who_they_are_and_two_processes_give_the_same_bytes(recoil: Recoil, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    config = felt_config(folder, spreads={"drift_factor_sd": 0.2})
    words = ("power", config, "--participants", "8,14", "--effect", "1", "--studies", "200", "--out")
    for workers in ("1", "2"):
        done = recoil(*words, workers, "--workers", workers)
        assert done.returncode == 0, done.stderr
    one, two = ((tmp_path / name / "power.json").read_bytes() for name in ("1", "2"))
    assert one == two
    page = (tmp_path / "1" / "report.md").read_text(encoding="utf-8")
    assert "People answer from what the gun does" in page
    assert "SD 0.2 of the factor on the drift" in page
