"""Many studies of synthetic participants at once: people drawn as the config's own observer draws them, then analysed.

A chunk of studies has a random stream of its own, so it comes out the same wherever and whenever it is worked out.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.paper.odds import WHOLE_PATTERN, Recurrence, chance_recurs, recurs
from analysis.paper.paper import PublishedDirection, PublishedExperiment
from analysis.predict.power.felt import Felt, felt_counts
from analysis.predict.power.planned import Findings, Tally, analysed_directions, analysed_ratings, tallied
from device.words import DIRECTIONS
from experiments.config.setup import canonical_json
from experiments.design.streams import generator
from experiments.direction.config import DirectionConfig, Rates
from experiments.direction.synthetic import probit_of_forward
from experiments.preference.config import PreferenceConfig, Ratings, RatingScale

Scores = NDArray[np.float64]
Counts = NDArray[np.int64]

Config = DirectionConfig | PreferenceConfig
People = Literal["own", "guessing", "guessing, with the config's bias", "without preference"]
"""Who takes part: the config's own synthetic participants, or null participants who feel no difference."""

PUBLISHED = "published"
"""What the names of the published claims begin with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """A cell of the grid; `effect` is the factor on what people feel, `trials` those of one method."""

    participants: int
    trials: int
    methods: tuple[str, ...]
    effect: float = 1.0
    people: People = "own"

    @property
    def key(self) -> str:
        """Its name, for the random streams."""
        return canonical_json(asdict(self)).decode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """So many studies of a design. `config` is that of the design: its methods and trials; `felt` who feel the gun."""

    config: Config
    design: Design
    published: PublishedExperiment | None
    seed: int
    number: int
    studies: int
    felt: Felt | None = None


def run_chunk(chunk: Chunk) -> Tally:
    """Draw and analyse a chunk's studies."""
    config, design = chunk.config, chunk.design
    draws = generator(chunk.seed, "power", config.experiment, design.key, str(chunk.number))
    if isinstance(config, DirectionConfig):
        return tallied(_directions(config, design, chunk, draws))
    return tallied(_ratings(config, design, chunk, draws))


def null_rates(rates: Rates, *, biased: bool) -> Rates:
    """People who feel nothing (with effect 0), with the bias that `rates` give them or without any."""
    bias = {} if biased else {"bias_mean": 0.0, "bias_sd": 0.0}
    return rates.model_copy(update={"ability_sd": 0.0} | bias)


def null_ratings(law: Ratings) -> Ratings:
    """People who like all methods alike (with effect 0): without the habits, which are differences."""
    return law.model_copy(update={"lowest": None, "same": None, "same_share": 0.0})


def direction_counts(
    config: DirectionConfig, n: int, studies: int, draws: np.random.Generator, effect: float = 1.0
) -> Counts:
    """Correct answers, (studies, n, methods, 2 directions), of people drawn as `RatesParticipant` draws them.

    `effect` is a factor on the probit of each mean correct rate, so on d': at 0 directions are guessed.
    """
    rates, design = config.synthetic.rates, config.design
    ability = rates.ability_sd * draws.standard_normal((studies, n, 1, 1))
    bias = rates.bias_sd * draws.standard_normal((studies, n, 1, 1))
    says_forward = [[probit_of_forward(rates, method, way) for way in DIRECTIONS] for method in design.methods]
    felt = rates.bias_mean + effect * (np.array(says_forward) - rates.bias_mean)
    towards = np.array([1.0, -1.0])  # a correct answer is "forward" on forward trials, not "forward" on backward ones
    correct = ndtr(towards * (felt + bias) + ability)
    return draws.binomial([design.forward_per_session, design.backward_per_session], correct)


def preference_scores(
    config: PreferenceConfig, n: int, studies: int, draws: np.random.Generator, effect: float = 1.0
) -> Scores:
    """Ratings, (studies, n, methods), of people drawn as `draw_ratings` draws them.

    `effect` is a factor on the distances of the methods' means from their common mean, and, below 1, on the share of
    people who keep the lowest method below all others.
    """
    law, scale, methods = config.synthetic.ratings, config.rating, config.design.methods
    person = law.person_sd * draws.standard_normal((studies, n, 1))
    noise = law.noise_sd * draws.standard_normal((studies, n, len(methods)))
    ratings = on_scale(scaled_means(law, methods, effect) + person + noise, scale)
    if law.same and set(law.same) <= set(methods):
        first, second = (methods.index(name) for name in law.same)
        alike = draws.random((studies, n)) < law.same_share
        ratings[..., second] = np.where(alike, ratings[..., first], ratings[..., second])
    if law.lowest in methods:
        lowest = methods.index(law.lowest)
        below = on_scale(np.delete(ratings, lowest, axis=-1).min(axis=-1) - scale.grain, scale)
        kept = draws.random((studies, n)) < effect
        ratings[..., lowest] = np.where(kept, np.minimum(ratings[..., lowest], below), ratings[..., lowest])
    return ratings


def scaled_means(law: Ratings, methods: tuple[str, ...], effect: float) -> Scores:
    """The methods' means, their distances from the common mean times `effect`."""
    means = np.array([law.mean[method] for method in methods])
    centre = means.mean()
    return means if effect == 1.0 else centre + effect * (means - centre)


def on_scale(values: Scores, scale: RatingScale) -> Scores:
    """`experiments.session.steps.on_scale` of many values."""
    steps = np.rint((np.clip(values, scale.minimum, scale.maximum) - scale.minimum) / scale.grain)
    decimals = max(0, -int(np.floor(np.log10(scale.grain)))) + 2
    return np.round(scale.minimum + steps * scale.grain, decimals)


def _directions(config: DirectionConfig, design: Design, chunk: Chunk, draws: np.random.Generator) -> Findings:
    trials = config.design.forward_per_session, config.design.backward_per_session
    if chunk.felt is None:
        correct = direction_counts(config, design.participants, chunk.studies, draws, design.effect)
        expected, expected_d = _expected(config.synthetic.rates, design)
    else:
        correct = felt_counts(chunk.felt, trials, design.participants, chunk.studies, draws)
        expected = expected_d = list(chunk.felt.log_odds)  # rates rise with the evidence, and d' has its sign
    found = analysed_directions(correct, trials, design.methods, expected, expected_d)
    if isinstance(chunk.published, PublishedDirection):
        places = [design.methods.index(method) for method in chunk.published.methods]
        claims = published_directions(correct[:, :, places], trials, chunk.published)
        return _with_published(found, claims)
    return found


def _expected(rates: Rates, design: Design) -> tuple[list[float], list[float]]:
    """What is expected of the correct rates on forward shots (their order), and of d' (its sign), by method."""
    felt = [
        [design.effect * (probit_of_forward(rates, m, way) - rates.bias_mean) for way in DIRECTIONS]
        for m in design.methods
    ]
    return [row[0] for row in felt], [row[0] - row[1] for row in felt]


def published_directions(
    correct: Counts, trials: tuple[int, int], published: PublishedDirection
) -> dict[str, Recurrence]:
    """Which published claims recur; `correct` (studies, n, methods, 2) has the methods in the published order."""
    claims = recurs(correct[..., 0] / trials[0], published)
    pooled, n = correct.sum(axis=1), correct.shape[1]
    # one direction at a time: there may be more trials of the one than of the other
    for direction, each in zip(DIRECTIONS, trials, strict=True):
        of_direction = [claim for claim in published.binomial if claim.direction == direction]
        claims |= chance_recurs(pooled, n * each, published.model_copy(update={"binomial": of_direction}))
    return claims


def _ratings(config: PreferenceConfig, design: Design, chunk: Chunk, draws: np.random.Generator) -> Findings:
    scores = preference_scores(config, design.participants, chunk.studies, draws, design.effect)
    expected = scaled_means(config.synthetic.ratings, design.methods, design.effect)
    found = analysed_ratings(scores, design.methods, expected.tolist())
    if chunk.published is None:
        return found
    places = [design.methods.index(method) for method in chunk.published.methods]
    return _with_published(found, recurs(scores[..., places], chunk.published))


def _with_published(found: Findings, claims: dict[str, Recurrence]) -> Findings:
    """With the published claims, and all of them together: the paper's whole pattern of significance."""
    together = claims | {WHOLE_PATTERN: np.logical_and.reduce(list(claims.values()))}
    named = {f"{PUBLISHED}, {claim}": held for claim, held in together.items()}
    return Findings(claims=dict(found.claims) | named, half_widths=found.half_widths)
