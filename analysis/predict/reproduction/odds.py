"""The odds that the published pattern recurs: many studies of synthetic participants, scored without a journal.

The participants are those of the config's own observer; only the writing of logs is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.paper.odds import Odds, chance_recurs, odds_of, recurs
from analysis.paper.paper import Paper
from analysis.predict.power import studies as power_studies
from experiments.design.streams import Stream, generator
from experiments.direction.config import DirectionConfig
from experiments.preference.config import PreferenceConfig
from experiments.preference.observer import draw_ratings

Scores = NDArray[np.float64]
Counts = NDArray[np.int64]


def direction_counts(config: DirectionConfig, methods: list[str], n: int, replications: int, seed: int) -> Counts:
    """Correct answers, (replications, n, methods, 2 directions), of people drawn as `RatesObserver` draws them."""
    counts = power_studies.direction_counts(config, n, replications, generator(seed, "odds", config.experiment))
    return counts[:, :, [config.design.methods.index(method) for method in methods]]


def preference_scores(config: PreferenceConfig, methods: list[str], n: int, replications: int, seed: int) -> Scores:
    """Ratings, (replications, n, methods), of people drawn as `RatingsObserver` draws them."""
    stream = Stream(seed, "odds", config.experiment)
    law, scale = config.synthetic.ratings, config.rating
    people = (draw_ratings(law, scale, methods, stream) for _ in range(replications * n))
    ratings = [person[method] for person in people for method in methods]
    return np.array(ratings).reshape(replications, n, len(methods))


def direction_odds(config: DirectionConfig, paper: Paper, replications: int, seed: int) -> Odds:
    """The odds of experiment 1's claims at the published rates."""
    published, rates, forward = paper.direction, config.synthetic.rates, config.design.forward_per_session
    counts = direction_counts(config, published.methods, published.n, replications, seed)
    claims = recurs(counts[..., 0] / forward, published)
    return odds_of(
        config.experiment,
        claims | chance_recurs(counts.sum(axis=1), published.n * forward, published),
        f"{published.n} people whose correct rates are, in the mean, the published ones; people differ by an ability "
        f"of SD {rates.ability_sd:g} and a bias of SD {rates.bias_sd:g} in probit units (assumed); "
        f"{forward} forward and as many backward trials a method; seed {seed}.",
    )


def preference_odds(config: PreferenceConfig, paper: Paper, replications: int, seed: int) -> Odds:
    """The odds of experiment 2's claims at the assumed ratings."""
    published, law = paper.preference, config.synthetic.ratings
    scores = preference_scores(config, published.methods, published.n, replications, seed)
    means = ", ".join(f"{method} {law.mean[method]:g}" for method in published.methods)
    return odds_of(
        config.experiment,
        recurs(scores, published),
        f"{published.n} people; the means and SDs are not published, so these are assumed: {means}; SD between people "
        f"{law.person_sd:g}, within {law.noise_sd:g}; a share of {law.same_share:g} give "
        f"{' and '.join(law.same or ())} the same score; seed {seed}.",
    )
