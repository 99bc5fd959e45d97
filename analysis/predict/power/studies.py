"""A chunk of simulated studies of a design: its people drawn, their answers analysed as the study's will be."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from analysis.paper.paper import PublishedExperiment
from analysis.paper.recurrence import with_whole_pattern
from analysis.predict.power.planned import Findings, Tally, analysed_directions, analysed_ratings, tallied
from analysis.predict.synthetic_studies import (
    Counts,
    Felt,
    direction_counts,
    felt_counts,
    preference_scores,
    published_claims,
    scaled_means,
)
from analysis.stats.arrays import FloatArray
from device.words import DIRECTIONS
from experiments.config.setup import canonical_json
from experiments.design.streams import generator
from experiments.direction.config import DirectionConfig, Rates
from experiments.direction.synthetic import probit_of_forward
from experiments.preference.config import PreferenceConfig

DrawnConfig = DirectionConfig | PreferenceConfig
PeopleKind = Literal["own", "guessing", "guessing, with the config's bias", "without preference"]
"""Who takes part: the config's own synthetic participants, or null participants who feel no difference."""

PUBLISHED = "published"
"""What the names of the published claims begin with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDesign:
    """A cell of the grid; `effect` is the factor on what people feel, `trials` those of one method."""

    participants: int
    trials: int
    methods: tuple[str, ...]
    effect: float = 1.0
    people: PeopleKind = "own"

    @property
    def key(self) -> str:
        """Its name, for the random streams."""
        return canonical_json(asdict(self)).decode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """So many studies of a design. `config` is that of the design: its methods and trials; `felt` who feel the gun."""

    config: DrawnConfig
    design: StudyDesign
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


def _directions(config: DirectionConfig, design: StudyDesign, chunk: Chunk, draws: np.random.Generator) -> Findings:
    trials = config.design.forward_per_session, config.design.backward_per_session
    if chunk.felt is None:
        correct = direction_counts(config, design.participants, chunk.studies, draws, design.effect)
        expected, expected_d = _expected(config.synthetic.rates, design)
    else:
        correct = felt_counts(chunk.felt, trials, design.participants, chunk.studies, draws)
        expected = expected_d = np.asarray(chunk.felt.log_odds).tolist()  # rates rise with it, and d' has its sign
    found = analysed_directions(correct, trials, design.methods, expected, expected_d)
    return _with_published(found, correct, trials, chunk)


def _expected(rates: Rates, design: StudyDesign) -> tuple[list[float], list[float]]:
    """What is expected of the correct rates on forward shots (their order), and of d' (its sign), by method."""
    felt = [
        [design.effect * (probit_of_forward(rates, m, way) - rates.bias_mean) for way in DIRECTIONS]
        for m in design.methods
    ]
    return [row[0] for row in felt], [row[0] - row[1] for row in felt]


def _ratings(config: PreferenceConfig, design: StudyDesign, chunk: Chunk, draws: np.random.Generator) -> Findings:
    scores = preference_scores(config, design.participants, chunk.studies, draws, design.effect)
    expected = scaled_means(config.synthetic.ratings, design.methods, design.effect)
    found = analysed_ratings(scores, design.methods, expected.tolist())
    return _with_published(found, scores, (0, 0), chunk)


def _with_published(found: Findings, answers: Counts | FloatArray, trials: tuple[int, int], chunk: Chunk) -> Findings:
    """With the published claims, if there are any of these methods, and their whole pattern."""
    if chunk.published is None:
        return found
    claims = with_whole_pattern(published_claims(answers, trials, chunk.design.methods, chunk.published))
    named = {f"{PUBLISHED}, {claim}": held for claim, held in claims.items()}
    return Findings(claims=dict(found.claims) | named, half_widths=found.half_widths)
