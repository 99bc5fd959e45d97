"""The full figures of active pairing: which share of a full design's trials finds the order of the items as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import rankdata

from experiments.design.procedures.pairing import item_posterior, next_pair, pairing_rule
from experiments.design.streams import Stream
from tests.conftest import Soak

pytestmark = pytest.mark.soak

MARKS = np.arange(0.3, 1.001, 0.05)
PROMISED = 0.6


@dataclass(frozen=True)
class Study:
    """So many items whose true scores are normal with a spread in logits, each pair of the full design so often."""

    items: int
    spread: float
    times: int
    studies: int

    @property
    def trials(self) -> int:
        return self.times * self.items * (self.items - 1) // 2


def rank_correlations(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Spearman's, study by study; 0 where scores are all the same."""
    ranks = [rankdata(scores, axis=-1) - (scores.shape[-1] + 1) / 2 for scores in (one, other)]
    length = np.sqrt((ranks[0] ** 2).sum(-1) * (ranks[1] ** 2).sum(-1))
    return np.asarray((ranks[0] * ranks[1]).sum(-1) / np.where(length > 0, length, 1.0))


def of_full_design(study: Study, true: np.ndarray, stream: np.random.Generator) -> np.ndarray:
    one, other = np.triu_indices(study.items, 1)
    wins = np.zeros((study.studies, study.items, study.items))
    wins[:, one, other] = stream.binomial(study.times, expit(true[:, one] - true[:, other]))
    wins[:, other, one] = study.times - wins[:, one, other]
    return rank_correlations(true, item_posterior(wins, 2.0)[0])


def of_active_pairing(study: Study, true: np.ndarray, stream: np.random.Generator) -> dict[int, np.ndarray]:
    """Rank correlations (studies,) after so many trials, for every mark."""
    rules = [pairing_rule(study.items, Stream(seed, "pairs")) for seed in range(20)]
    groups = np.array_split(np.arange(study.studies), len(rules))
    wins = np.zeros((study.studies, study.items, study.items))
    last, marks, found = np.full(study.studies, -1), {round(mark * study.trials) for mark in MARKS}, {}
    for trial in range(1, study.trials + 1):
        for rule, who in zip(rules, groups, strict=True):
            last[who] = next_pair(rule, wins[who], last[who])
            one, other = rule.pairs[last[who]].T
            chosen = stream.random(len(who)) < expit(true[who, one] - true[who, other])
            wins[who, np.where(chosen, one, other), np.where(chosen, other, one)] += 1
        if trial in marks:
            found[trial] = rank_correlations(true, item_posterior(wins, 2.0)[0])
    return found


@pytest.mark.parametrize(
    ("study", "promised"),
    [
        (Study(12, 2.0, 3, 400), True),
        (Study(12, 2.0, 10, 200), True),
        (Study(12, 4.0, 3, 400), True),
        (Study(12, 4.0, 1, 400), False),
        (Study(12, 2.0, 1, 400), False),
        (Study(12, 1.0, 3, 400), False),
        (Study(12, 1.0, 10, 200), False),
        (Study(5, 2.0, 3, 1000), False),
        (Study(5, 2.0, 10, 1000), False),
        (Study(5, 4.0, 3, 1000), False),
    ],
    ids=str,
)
def test_the_share_of_a_full_designs_trials(study: Study, promised: bool, soak: Soak) -> None:
    stream = np.random.default_rng(study.items * 100 + study.times)
    true = stream.normal(0, study.spread, (study.studies, study.items))
    full, active = of_full_design(study, true, stream), of_active_pairing(study, true, stream)
    enough = next((trials for trials, one in active.items() if one.mean() >= full.mean()), None)
    less = active[round(PROMISED * study.trials)] - full
    error = 1.96 * less.std() / np.sqrt(study.studies)
    times = "once" if study.times == 1 else f"{study.times} times"
    soak(
        f"{study.items} items, true scores of sd {study.spread:g} logits, each pair {times}: trials that are enough",
        "more than all" if enough is None else f"{100 * enough / study.trials:.0f} %, {enough} of {study.trials}",
        "60 %" if promised else "stated",
        f"{study.studies} studies; Spearman's correlation with the true scores: full design {full.mean():.4f}, active"
        f" pairing at 60 % {full.mean() + less.mean():.4f} (difference {less.mean():+.4f} ± {error:.4f}); steps of 5 %",
    )
    assert not promised or less.mean() + error >= 0
    assert not promised or (enough is not None and enough <= PROMISED * study.trials + 0.5)
