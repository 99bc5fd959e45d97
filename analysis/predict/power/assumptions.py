"""What simulated power rests on, in words: how the synthetic participants are drawn, and what is counted."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.predict.power.grid import FELT, Grid
from analysis.predict.synthetic_studies import rates_law, ratings_law, spread_sentence
from experiments.direction.config import DirectionConfig, Rates
from experiments.preference.config import PreferenceConfig, Ratings


def grid_assumptions(grid: Grid) -> list[str]:
    """What the numbers rest on."""
    config, null = grid.config, grid.request.null
    if isinstance(config, PreferenceConfig):
        law = list(_null_ratings(config.synthetic.ratings) if null else _ratings(config.synthetic.ratings))
    elif config.synthetic.observer == FELT:
        law = list(_felt(config, null=null))
    else:
        law = list(_null_rates(config.synthetic.rates) if null else _rates(config.synthetic.rates))
    return [
        *law,
        "All tests are at 5 %, two-sided; Tukey's test is on the pooled repeated-measures error. A comparison counts "
        "only if it comes out the way round that the config's means have it; where they are equal, either way counts.",
        "Every participant is complete: nobody drops out or misses an answer.",
        "Hours in the lab are participants times the config's own duration (trials and breaks, as `recoil check` has "
        "it), one participant after another, without practice, preparation and no-shows.",
        "Intervals are Wilson's, of 95 %: the Monte Carlo error of so many studies, not the uncertainty of the "
        "assumed participants.",
    ]


def _rates(rates: Rates) -> Iterator[str]:
    yield from rates_law(rates)
    yield "The effect is a factor on the probit of each mean correct rate, so on d′: 1 is the config, 0 guessing."


def _null_rates(rates: Rates) -> Iterator[str]:
    yield "Null participants feel no direction: each answer is right with a chance of one half in the mean over people."
    yield (
        "Those with the config's bias differ in their readiness to say forward (SD "
        f"{rates.bias_sd:g} around {rates.bias_mean:g}, probit units). The pooled binomial test takes trials as "
        "independent and rejects them more often than 5 %: trials come in people. The exact test of plain guessers "
        "stays at or below 5 %, as counts are whole numbers."
    )


def _felt(config: DirectionConfig, *, null: bool) -> Iterator[str]:
    percept, people, lapses = config.synthetic.percept, config.synthetic.people, config.synthetic.diffusion.lapses
    yield (
        f"People answer from what the gun does: exponent {percept.exponent:g}, leak {percept.leak_s:g} s, sensitivity "
        f"{percept.sensitivity:g}, confusion {percept.confusion:g}, start {percept.start:g} (`recoil fit`): a model's "
        "guess, not a measurement."
    )
    yield f"{spread_sentence(people.own)} Lapses {lapses.rate:g}."
    if config.design.instructions:
        yield (
            f"Instructions {', '.join(config.design.instructions)}: each takes an equal part of a session's sets and "
            "has its own boundary; the planned analysis counts all trials together."
        )
    if null:
        yield (
            "Null participants feel nothing: the evidence is 0, so each answers “forward” at the chance of their own "
            "start: 0.5 for those who guess, the config's and its spread for those with the config's bias. The pooled "
            "binomial test of the latter rejects as often as the bias is found, which is no false positive of a "
            "direction felt; the exact test of plain guessers stays at or below 5 %, as counts are whole numbers."
        )
    else:
        yield "The effect is a factor on the evidence (log odds of a right answer): 1 is the config, 0 nothing felt."


def _ratings(law: Ratings) -> Iterator[str]:
    yield from ratings_law(law, with_effect=True)
    yield "The effect is a factor on the distances of the methods' means from their common mean; 1 is the config."


def _null_ratings(law: Ratings) -> Iterator[str]:
    yield (
        f"Null participants like all methods alike: one mean, SD between people {law.person_sd:g}, within people "
        f"{law.noise_sd:g}, none of the habits that set methods apart."
    )
