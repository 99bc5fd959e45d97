"""Answers of many participants who feel the gun at once: the draws behind `recoil power` and `recoil fit`.

A person is drawn as `diffusion.person` draws one, and answers "forward" with the diffusion's own probability, so counts
are binomial and no times are needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from experiments.config.setup import Setup
from experiments.direction.config import DirectionConfig, Synthetic
from experiments.direction.synthetic import model_parameters
from experiments.synthetic.diffusion import People, upper_probabilities
from experiments.synthetic.model_based import NEUTRAL
from experiments.synthetic.percept import Percept, evidence, own_start, percepts_of

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Felt:
    """What a study's participants are drawn from, `log_odds` a method: of "forward" after a forward shot.

    `cautions`: the boundary of each of the design's instructions, in units of the neutral one.
    """

    log_odds: tuple[float, ...]
    start: float
    people: People
    lapse_rate: float = 0.0
    cautions: tuple[float, ...] = (1.0,)


def percepts_of_setup(setup: Setup[DirectionConfig]) -> dict[str, Percept]:
    """What the gun's shots give to feel, by method."""
    config = setup.config
    return percepts_of(setup.gun.renderings(config.design.methods), model_parameters(config).percept.leak_s)


def felt_of(
    config: DirectionConfig, percepts: Mapping[str, Percept], methods: Sequence[str], effect: float = 1.0
) -> Felt:
    """The participants of a config; `effect` is a factor on the evidence, at 0 nothing is felt."""
    mind = model_parameters(config)
    instructions = config.design.instructions or (NEUTRAL,)
    return Felt(
        log_odds=tuple(effect * evidence(percepts[method], mind.percept) for method in methods),
        start=mind.percept.start,
        people=mind.people,
        lapse_rate=mind.lapses.rate,
        cautions=tuple(mind.boundaries[name] / mind.boundaries[NEUTRAL] for name in instructions),
    )


def null_felt(synthetic: Synthetic, *, biased: bool) -> Synthetic:
    """People who feel nothing (with effect 0), with the start that they have, or with one of 0.5 for everybody."""
    if biased:
        return synthetic
    percept = synthetic.percept.model_copy(update={"start": 0.5})
    people = synthetic.people.model_copy(update={"logit_start_sd": 0.0})
    return synthetic.model_copy(update={"percept": percept, "people": people})


def felt_counts(felt: Felt, trials: tuple[int, int], n: int, studies: int, draws: np.random.Generator) -> Counts:
    """Correct answers, (studies, n, methods, 2 directions), of `trials` forward and backward ones a method.

    With several instructions a person's trials fall under them as a shuffle of the session lays them: exact for
    `balance = "session"`, a little more scattered than `balance = "set"` has them.
    """
    shares = correct_shares(np.array(felt.log_odds), felt.start, felt, (studies, n), draws)
    if len(felt.cautions) == 1:
        return draws.binomial(trials, shares[..., 0])
    each = _under_each(trials, len(felt.cautions), shares.shape[:3], draws)
    return np.asarray(draws.binomial(each, shares).sum(axis=-1))


def correct_shares(
    log_odds: ArrayLike, start: ArrayLike, felt: Felt, size: tuple[int, int], draws: np.random.Generator
) -> Floats:
    """Each person's chances of being right, (studies, n, methods, 2 directions, instructions).

    `log_odds` (methods,) or (studies, 1, methods) and `start`, one or (studies, 1), stand in for those of `felt`.
    """
    drift, boundary, logit = (draws.standard_normal(size) for _ in range(3))
    people = felt.people
    strength = (1.0 + people.drift_factor_sd * drift) * np.exp(people.log_boundary_sd * boundary)
    product = (strength[..., None] * np.asarray(log_odds))[..., None, None]
    forward = own_start(start, people.logit_start_sd * logit)[..., None, None, None]
    towards = np.array([1.0, -1.0])[:, None]
    # a backward shot seen in a mirror: the same evidence, towards "backward", from the mirrored start
    upper = upper_probabilities(product * np.array(felt.cautions), 1.0, np.where(towards > 0, forward, 1.0 - forward))
    return np.asarray((1.0 - felt.lapse_rate) * upper + felt.lapse_rate / 2.0)


def _under_each(
    trials: tuple[int, int], instructions: int, size: tuple[int, ...], draws: np.random.Generator
) -> Counts:
    """Trials (*size, 2, instructions): a session's forward trials at random places of equal parts."""
    part = sum(trials) // instructions
    forward = draws.multivariate_hypergeometric([part] * instructions, trials[0], size=size)
    return np.stack([forward, part - forward], axis=-2)
