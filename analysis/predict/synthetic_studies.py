"""Synthetic studies: the answers of many people at once, and how often a published pattern recurs among them.

People are drawn as the synthetic participants of a session are: by rates, by ratings, or from what they feel of the
gun's shots. The draws come from a generator that the caller names, so a piece of the studies is the same wherever and
whenever it is worked out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from analysis.paper.paper import PublishedDirection, PublishedExperiment
from analysis.paper.recurrence import PatternOdds, Recurrence, answers_recur, odds_of, recurs
from analysis.predict.drawn import DirectionStudies, Drawn, RatingStudies, rates_by_method
from analysis.stats.arrays import FloatArray
from device.words import DIRECTIONS, Direction
from experiments.config.setup import GunConfig
from experiments.design.streams import generator
from experiments.synthetic.decision import own_start, upper_probabilities
from experiments.synthetic.diffusion import People
from experiments.synthetic.laws import DiffusionLaw, RatesLaw, RatingsLaw
from experiments.synthetic.model_based import NEUTRAL
from experiments.synthetic.percept import Percept, evidence, percepts_of
from experiments.tasks.questions import Scale

Counts = NDArray[np.int64]

PEOPLE_A_PIECE = 70_000
"""Participants drawn together: 5000 studies of 14. It is part of what a seed means, so it never depends on workers."""


def piece_sizes(studies: int, participants: int) -> list[int]:
    """So many studies of so many participants in pieces, each of which has a stream of its own.

    >>> piece_sizes(12_000, 14)
    [5000, 5000, 2000]
    """
    each = max(1, PEOPLE_A_PIECE // participants)
    return [min(each, studies - first) for first in range(0, studies, each)]


def direction_counts(
    drawn: DirectionStudies, n: int, studies: int, draws: np.random.Generator, effect: float = 1.0
) -> Counts:
    """Correct answers, (studies, n, methods, 2 directions), of people drawn as `SyntheticParticipant` draws them.

    `effect` is a factor on the probit of each mean correct rate, so on d': at 0 directions are guessed.
    """
    law = rates_of(drawn)
    ability = law.ability_sd * draws.standard_normal((studies, n, 1, 1))
    bias = law.bias_sd * draws.standard_normal((studies, n, 1, 1))
    says_forward = [[felt_probit(law, method, way) for way in DIRECTIONS] for method in drawn.methods]
    felt = bias_mean(law) + effect * np.array(says_forward)
    towards = np.array([1.0, -1.0])  # a correct answer is "forward" on forward trials, not "forward" on backward ones
    correct = scipy.special.ndtr(towards * (felt + bias) + ability)
    return draws.binomial(drawn.trials, correct)


def felt_probit(law: RatesLaw, method: str, direction: Direction) -> float:
    """The probit of answering "forward", for a person without own ability and without any bias."""
    rate = rates_by_method(law, (method,), direction)[method]
    return law.spread * NormalDist().inv_cdf(rate if direction == "forward" else 1 - rate)


def bias_mean(law: RatesLaw) -> float:
    """The mean bias towards saying "forward", in probit units."""
    if law.bias is None:
        return 0.0
    return law.bias.mean if law.bias.answer == "forward" else -law.bias.mean


def preference_scores(
    drawn: RatingStudies, n: int, studies: int, draws: np.random.Generator, effect: float = 1.0
) -> FloatArray:
    """Ratings, (studies, n, methods), of people drawn as `draw_ratings` draws them.

    `effect` is a factor on the distances of the methods' means from their common mean, and, below 1, on the share of
    people who keep the lowest method below all others.
    """
    law, scale, methods = drawn.law, drawn.scale, drawn.methods
    person = law.person_sd * draws.standard_normal((studies, n, 1))
    noise = law.noise_sd * draws.standard_normal((studies, n, len(methods)))
    ratings = ratings_on_scale(scaled_means(law, methods, effect) + person + noise, scale)
    if law.same and set(law.same) <= set(methods):
        first, second = (methods.index(name) for name in law.same)
        alike = draws.random((studies, n)) < law.same_share
        ratings[..., second] = np.where(alike, ratings[..., first], ratings[..., second])
    if law.lowest is not None and law.lowest in methods:
        lowest = methods.index(law.lowest)
        below = ratings_on_scale(np.delete(ratings, lowest, axis=-1).min(axis=-1) - scale.grain, scale)
        kept = draws.random((studies, n)) < effect
        ratings[..., lowest] = np.where(kept, np.minimum(ratings[..., lowest], below), ratings[..., lowest])
    return ratings


def scaled_means(law: RatingsLaw, methods: tuple[str, ...], effect: float) -> FloatArray:
    """The methods' means, their distances from the common mean times `effect`."""
    means = np.array([law.mean[method] for method in methods])
    centre = means.mean()
    return means if effect == 1.0 else centre + effect * (means - centre)


def ratings_on_scale(values: FloatArray, scale: Scale) -> FloatArray:
    """`experiments.tasks.questions.on_scale` of many values."""
    steps = np.rint((np.clip(values, scale.minimum, scale.maximum) - scale.minimum) / scale.grain)
    decimals = max(0, -int(np.floor(np.log10(scale.grain)))) + 2
    return np.round(scale.minimum + steps * scale.grain, decimals)


@dataclass(frozen=True, slots=True, kw_only=True)
class Felt:
    """What participants who feel the gun are drawn from; all but `people` may differ from study to study.

    `log_odds`: (methods,) or (studies, 1, methods), of "forward" after a forward shot; `start`: one, or (studies, 1).
    `cautions`: the boundary of each of the design's instructions, in units of the neutral one.
    """

    log_odds: ArrayLike
    start: ArrayLike
    people: People
    lapse_rate: float = 0.0
    cautions: tuple[float, ...] = (1.0,)


def percepts_of_methods(gun: GunConfig, methods: Sequence[str], law: DiffusionLaw) -> dict[str, Percept]:
    """What the gun's shots give to feel, by method."""
    return percepts_of(gun.renderings(tuple(methods)), law.percept.leak_s)


def felt_people(
    law: DiffusionLaw,
    instructions: Sequence[str],
    percepts: Mapping[str, Percept],
    methods: Sequence[str],
    effect: float = 1.0,
) -> Felt:
    """The participants of a law; `effect` is a factor on the evidence, at 0 nothing is felt."""
    mind = law.own
    return Felt(
        log_odds=tuple(effect * evidence(percepts[method], mind.percept) for method in methods),
        start=mind.percept.start,
        people=mind.people,
        lapse_rate=mind.lapses.rate,
        cautions=tuple(mind.boundaries[name] / mind.boundaries[NEUTRAL] for name in instructions or (NEUTRAL,)),
    )


def felt_counts(felt: Felt, trials: tuple[int, int], n: int, studies: int, draws: np.random.Generator) -> Counts:
    """Correct answers, (studies, n, methods, 2 directions), of `trials` forward and backward ones a method.

    A person is drawn as `diffusion.person` draws one, and answers "forward" with the diffusion's own probability, so
    counts are binomial and no times are needed.

    With several instructions a person's trials fall under them as a shuffle of the session lays them: exact for
    `balance = "session"`, a little more scattered than `balance = "set"` has them.
    """
    shares = _correct_shares(felt, (studies, n), draws)
    if len(felt.cautions) == 1:
        return draws.binomial(trials, shares[..., 0])
    each = _under_each(trials, len(felt.cautions), shares.shape[:3], draws)
    return np.asarray(draws.binomial(each, shares).sum(axis=-1))


def _correct_shares(felt: Felt, size: tuple[int, int], draws: np.random.Generator) -> FloatArray:
    """Each person's chances of being right, (studies, n, methods, 2 directions, instructions)."""
    drift, boundary, logit = (draws.standard_normal(size) for _ in range(3))
    people = felt.people
    strength = (1.0 + people.drift_factor_sd * drift) * np.exp(people.log_boundary_sd * boundary)
    product = (strength[..., None] * np.asarray(felt.log_odds))[..., None, None]
    forward = own_start(felt.start, people.logit_start_sd * logit)[..., None, None, None]
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


# Null participants, in whom there is nothing to be found


def null_rates(law: RatesLaw, *, biased: bool) -> RatesLaw:
    """People who feel nothing (with effect 0), with the bias that `law` gives them or without any."""
    return law.model_copy(update={"ability_sd": 0.0} | ({} if biased else {"bias": None}))


def null_ratings(law: RatingsLaw) -> RatingsLaw:
    """People who like all methods alike (with effect 0): without the habits, which are differences."""
    return law.model_copy(update={"lowest": None, "same": None, "same_share": 0.0})


def null_felt(law: DiffusionLaw, *, biased: bool) -> DiffusionLaw:
    """People who feel nothing (with effect 0), with the start that they have, or with one of 0.5 for everybody."""
    if biased:
        return law
    percept = law.percept.model_copy(update={"start": 0.5})
    people = law.people.model_copy(update={"logit_start_sd": 0.0})
    return law.model_copy(update={"percept": percept, "people": people})


# What is assumed of people, in words


def rates_words(law: RatesLaw, methods: Sequence[str]) -> Iterator[str]:
    """People with correct rates of their own."""
    for direction in DIRECTIONS:
        values = rates_by_method(law, methods, direction)
        yield f"Mean correct rates, {direction}: {', '.join(f'{name} {value:g}' for name, value in values.items())}."
    yield (
        f"People differ by an ability of SD {law.ability_sd:g} and a bias of SD {law.bias_sd:g} around "
        f"{bias_mean(law):g}, in probit units; the same in all methods. Trials are independent given the person."
    )


def ratings_words(law: RatingsLaw, methods: Sequence[str], *, with_effect: bool = False) -> Iterator[str]:
    """People who rate these methods, also where the distances of the methods are multiplied by an effect."""
    yield f"Mean ratings: {', '.join(f'{name} {law.mean[name]:g}' for name in law.mean if name in methods)}."
    yield f"SD between people {law.person_sd:g}, within people {law.noise_sd:g}; kept to the scale and its grain."
    if law.lowest in methods:
        less = " at effect 1, by a smaller share below it" if with_effect else ""
        yield f"{law.lowest} is rated below all others, by everybody{less}."
    if law.same and set(law.same) <= set(methods):
        yield f"A share of {law.same_share:g} rates {' and '.join(law.same)} alike."


def spread_sentence(people: People) -> str:
    """How people who feel the gun differ."""
    if people == People():
        return "People are taken to be alike."
    return (
        f"People differ (assumed): SD {people.drift_factor_sd:g} of the factor on the drift, "
        f"{people.log_boundary_sd:g} of the log boundary, {people.logit_start_sd:g} of the logit of the start."
    )


# How often the published pattern recurs


def published_claims(
    answers: ArrayLike, trials: tuple[int, int], methods: Sequence[str], published: PublishedExperiment
) -> dict[str, Recurrence]:
    """Which published claims hold in which study, whatever the order of `methods`.

    `answers`: correct answers (studies, n, methods, 2 directions) of experiment 1, of so many `trials` each; ratings
    (studies, n, methods) of experiment 2, for which `trials` say nothing.
    """
    places = [methods.index(method) for method in published.methods]
    if isinstance(published, PublishedDirection):
        return answers_recur(np.asarray(answers)[:, :, places], trials, published)
    return recurs(np.asarray(answers)[:, :, places], published)


def pattern_odds(drawn: Drawn, published: PublishedExperiment, replications: int, seed: int) -> PatternOdds:
    """How often the published claims recur among people of a design, in a study of the paper's size."""
    name, n, methods = drawn.design.design, published.n, drawn.methods
    draws = generator(seed, "odds", name)
    if isinstance(drawn, RatingStudies):
        answers: Counts | FloatArray = preference_scores(drawn, n, replications, draws)
        trials, law, size = (0, 0), ratings_words(drawn.law, methods), "one rating a method"
        known = "neither means nor SDs are published, so these are assumed"
    else:
        answers, trials = direction_counts(drawn, n, replications, draws), drawn.trials
        law, size = (
            rates_words(rates_of(drawn), methods),
            f"{trials[0]} forward and {trials[1]} backward trials a method",
        )
        known = "of their rates only those that the paper prints are its own, all else is assumed"
    claims = published_claims(answers, trials, methods, published)
    return odds_of(name, claims, f"{n} people, {size}, seed {seed}; {known}. {' '.join(law)}")


def rates_of(drawn: DirectionStudies) -> RatesLaw:
    """The rates at which people are right. `TypeError`: they answer from what the gun does."""
    if not isinstance(drawn.law, RatesLaw):
        raise TypeError(f"{drawn.question}: the law {drawn.law.law} has no rates")
    return drawn.law
