"""The studies behind `recoil power`: people as the laws of a design draw them, analysed as logs are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from scipy import stats

from analysis.paper.paper import load_paper
from analysis.paper.recurrence import WHOLE_PATTERN, answers_recur, recurs, with_whole_pattern
from analysis.predict.drawn import DirectionStudies, Drawn, RatingStudies, studies_of
from analysis.predict.power.grid import Chunk, PowerRequest, StudyDesign, make_grid, run_chunk
from analysis.predict.power.planned import (
    ALL_PAIRS,
    ANOVA,
    ANY_PAIR,
    Findings,
    Tally,
    analysed_directions,
    analysed_ratings,
    merged,
    precisions,
    shares,
    tallied,
    textbook_power,
)
from analysis.predict.synthetic_studies import (
    direction_counts,
    null_rates,
    pattern_odds,
    preference_scores,
    ratings_on_scale,
)
from analysis.stats.anova import rm_tukey_hsd
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.planning import plan_of
from experiments.design.streams import Stream, generator
from experiments.load import find, load_setup
from experiments.synthetic.answers import draw_ratings, synthetic_participant_of
from experiments.synthetic.laws import RatesLaw
from experiments.tasks.questions import on_scale as one_on_scale
from tests.designs import changed
from tests.power_chain import homogeneity_p


def directions(setup: Setup[DesignConfig]) -> DirectionStudies:
    found = studies_of(setup)
    assert isinstance(found, DirectionStudies)
    return found


def rated(setup: Setup[DesignConfig]) -> RatingStudies:
    found = studies_of(setup)
    assert isinstance(found, RatingStudies)
    return found


SETUP = load_setup("direction")
DIRECTION, PREFERENCE = directions(SETUP), rated(load_setup("preference"))
DRAWN: Mapping[str, Drawn] = {"direction": DIRECTION, "preference": PREFERENCE}
assert isinstance(DIRECTION.law, RatesLaw)
RATES, RATINGS = DIRECTION.law, PREFERENCE.law
METHODS = DIRECTION.methods
PAPER = load_paper(find("paper"))
FORWARD_ORDER = [0.557, 0.793, 0.929]


def draws(number: int = 1) -> np.random.Generator:
    return generator(number, "test")


# people


@pytest.mark.slow
def test_the_answers_are_distributed_as_those_of_the_observer_step_by_step() -> None:
    """Correct counts of a cell, and the sum over all cells, in which people's ability and bias show."""
    people = 200
    plan = plan_of(DIRECTION.design, "P01", 1)
    steps = np.zeros((people, 3, 2), dtype=np.int64)
    for person in range(people):
        someone = synthetic_participant_of(SETUP, replace(plan, seed=person, participant_id=f"P{person}"))
        for trial in plan.trials:
            right = someone.answer(trial, DIRECTION.question).response == trial.direction
            steps[person, METHODS.index(trial.method), int(trial.direction == "backward")] += right
    at_once = direction_counts(DIRECTION, 40, 500, draws())[..., :, :].reshape(-1, 3, 2)
    summaries = {
        **{str(cell): (steps[:, *cell], at_once[:, *cell]) for cell in np.ndindex(3, 2)},
        "ability": (steps.sum(axis=(1, 2)), at_once.sum(axis=(1, 2))),
        "bias": (*(np.diff(counts.sum(axis=1)).ravel() for counts in (steps, at_once)),),
    }
    for name, (one, other) in summaries.items():
        assert homogeneity_p(one, other) > 0.001, name


def test_mean_correct_rates_are_those_of_the_config() -> None:
    counts = direction_counts(DIRECTION, 100, 400, draws())
    wanted = np.array([[RATES.share[f"{m}/{way}"] for way in ("forward", "backward")] for m in METHODS])
    assert np.abs(counts.mean(axis=(0, 1)) / 10 - wanted).max() < 4 * 0.17 / 200


def test_the_effect_is_a_factor_on_the_probit_of_the_mean_rates() -> None:
    sharp, phi = replace(DIRECTION, law=RATES.model_copy(update={"ability_sd": 0.0, "bias": None})), NormalDist()
    for effect in (0.0, 0.5, 2.0):
        means = direction_counts(sharp, 100, 400, draws(), effect).mean(axis=(0, 1)) / 10
        for method, mean in zip(METHODS, means[:, 0], strict=True):
            wanted = phi.cdf(effect * phi.inv_cdf(RATES.share[f"{method}/forward"]))
            assert mean == pytest.approx(wanted, abs=4 * 0.5 / np.sqrt(400_000)), (effect, method)


class Fed(Stream):
    """A stream that gives numbers drawn beforehand."""

    def __init__(self, normals: Iterator[float], uniforms: Iterator[float]) -> None:
        self.normal, self.uniform = lambda: next(normals), lambda: next(uniforms)  # type: ignore[method-assign]


def test_ratings_are_those_of_the_observer_for_the_same_draws() -> None:
    """The very numbers: the observer is fed what the generator draws, in its own order (methods by name)."""
    people = 3000
    at_once = preference_scores(PREFERENCE, people, 1, draws())[0]
    same = draws()
    person, noise = same.standard_normal(people), same.standard_normal((people, 3))
    alike = same.random(people)
    by_name = [METHODS.index(name) for name in sorted(METHODS)]
    for i in range(people):
        fed = Fed(iter([person[i], *noise[i][by_name]]), iter([alike[i]]))
        assert list(draw_ratings(RATINGS, PREFERENCE.scale, METHODS, fed).values()) == at_once[i].tolist()


@pytest.mark.parametrize("grain", [0.1, 0.5, 1.0, 0.025, 1e-4])
def test_a_scale_of_many_ratings_is_the_scale_of_one(grain: float) -> None:
    scale = PREFERENCE.scale._replace(grain=grain)
    values = draws().uniform(-2, 12, 2000)
    assert ratings_on_scale(values, scale).tolist() == [one_on_scale(value, scale) for value in values]


def test_half_the_effect_halves_the_distances_and_the_habit() -> None:
    wide = rated(changed("preference", questions={"rating": {"minimum": -1000.0, "maximum": 1000.0}}))
    scores = preference_scores(wide, 200, 500, draws(), 0.5).reshape(-1, 3)
    lowest = (scores[:, 0] < scores[:, 1:].min(axis=1)).mean()
    free = replace(wide, law=RATINGS.model_copy(update={"lowest": None}))
    without = preference_scores(free, 200, 500, draws(), 0.5).reshape(-1, 3)
    unforced = (without[:, 0] < without[:, 1:].min(axis=1)).mean()
    assert lowest == pytest.approx(0.5 + 0.5 * unforced, abs=0.01)
    assert without[:, 1].mean() - without[:, 0].mean() == pytest.approx(0.5 * (6.0 - 2.4), abs=0.04)


# the planned analysis


@pytest.mark.slow
def test_claims_are_those_of_the_tests_study_by_study() -> None:
    counts = direction_counts(DIRECTION, 9, 60, draws(), 0.6)
    found = analysed_directions(counts, (10, 10), METHODS, FORWARD_ORDER, [1.0, 1.0, 1.0])
    for i, study in enumerate(counts):
        tukey = rm_tukey_hsd(study[..., 0] / 10, METHODS)
        significant = [pair.p < 0.05 and pair.difference > 0 for pair in tukey]
        names = [f"Tukey, {pair.a} above {pair.b}" for pair in tukey]
        assert [bool(found.claims[name][i]) for name in names] == significant
        assert bool(found.claims[ALL_PAIRS][i]) == all(significant)
        assert bool(found.claims[ANY_PAIR][i]) == any(pair.p < 0.05 for pair in tukey)
        assert found.half_widths["difference of two methods"][i] == pytest.approx(
            tukey[0].ci_high - tukey[0].difference
        )
        pooled = stats.binomtest(int(study[:, 1, 1].sum()), 90)
        assert bool(found.claims["binomial, asymmetric-1 backward"][i]) == (pooled.pvalue < 0.05)


def test_d_prime_is_tested_over_people_by_student() -> None:
    counts = direction_counts(DIRECTION, 9, 60, draws(), 0.3)
    either = analysed_directions(counts, (10, 10), METHODS, FORWARD_ORDER, [0.0, 0.0, 0.0])
    upward = analysed_directions(counts, (10, 10), METHODS, FORWARD_ORDER, [1.0, 1.0, 1.0])
    for i, study in enumerate(counts):
        hits, rejections = study[:, 0, 0], study[:, 0, 1]
        d = stats.norm.ppf((hits + 0.5) / 11) - stats.norm.ppf((10 - rejections + 0.5) / 11)
        t = stats.ttest_1samp(d, 0.0)
        assert bool(either.claims["d′, vibration"][i]) == (t.pvalue < 0.05)
        assert bool(upward.claims["d′, vibration"][i]) == (t.pvalue < 0.05 and t.statistic > 0)
        interval = t.confidence_interval()
        assert 2 * upward.half_widths["d′, vibration"][i] == pytest.approx(interval.high - interval.low)


def test_where_nothing_varies_nothing_is_found() -> None:
    found = analysed_ratings(np.full((2, 5, 3), 7.0), METHODS, [1.0, 2.0, 3.0])
    assert not any(held.any() for held in found.claims.values())


def test_methods_that_are_expected_equal_count_either_way_and_have_no_order_to_hold() -> None:
    found = analysed_ratings(draws().normal(size=(4, 5, 3)), METHODS, [1.0, 1.0, 1.0])
    assert ALL_PAIRS not in found.claims
    assert "Tukey, asymmetric-1 other than vibration" in found.claims


def test_without_backward_trials_there_is_no_d_prime() -> None:
    counts = direction_counts(DIRECTION, 6, 3, draws())
    counts[..., 1] = 0
    found = analysed_directions(counts, (10, 0), METHODS, FORWARD_ORDER, [1.0, 1.0, 1.0])
    assert not any("d′" in claim or "backward" in claim for claim in found.claims)


def test_tallies_add_up_in_any_order() -> None:
    flags = draws().random((2, 1000)) < 0.3
    widths = draws(2).random(1000)
    squares = draws(3).random((2, 1000))

    def tally(s: slice) -> Tally:
        return tallied(
            Findings(
                claims={"a": flags[0, s], "b": flags[1, s]},
                half_widths={"w": widths[s]},
                mean_squares=squares[:, s],
            )
        )

    whole = tally(slice(0, 1000))
    parts = [tally(s) for s in (slice(0, 400), slice(400, 401), slice(401, 1000))]
    assert merged(parts) == merged(parts[::-1])
    assert merged(parts).held == whole.held
    assert merged(parts).mean_squares == pytest.approx(whole.mean_squares)
    row = precisions(merged(parts))[0]
    assert (row.half_width, row.mc_error) == pytest.approx((widths.mean(), widths.std(ddof=1) / np.sqrt(1000)))
    with pytest.raises(ValueError, match="different claims"):
        merged([whole, Tally(studies=1, held={"a": 1}, sums={})])


def test_the_power_from_f_is_the_simulated_one_of_normal_scores() -> None:
    """Means 0, 0.5 and 1 with an error of 1: f^2 = 14 * 0.5 / (14 * 3), whatever sets people apart."""
    people = 3.0 * draws(4).normal(size=(4_000, 14, 1))
    scores = people + draws(5).normal(size=(4_000, 14, 3)) + np.array([0.0, 0.5, 1.0])
    tally = tallied(analysed_ratings(scores, METHODS, [0.0, 0.5, 1.0]))
    found = textbook_power(tally, 14, 3)
    assert found is not None
    assert found.f == pytest.approx(np.sqrt(0.5 / 3.0), rel=0.03)
    assert found.power == pytest.approx(tally.held["ANOVA"] / 4_000, abs=0.03)
    assert textbook_power(tallied(analysed_ratings(np.zeros((2, 5, 3)), METHODS, [0.0, 0.5, 1.0])), 5, 3) is None


# agreement


def tally_of(experiment: str, studies: int) -> Mapping[str, float]:
    design = StudyDesign(participants=14, trials=20, methods=METHODS)
    published = getattr(PAPER, experiment)
    chunk = Chunk(config=DRAWN[experiment], design=design, published=published, seed=1, number=0, studies=studies)
    return {share.claim: share.share for share in shares(run_chunk(chunk))}


def one_by_one(experiment: str, studies: int) -> Mapping[str, float]:
    """The claims' shares among people who are drawn one after the other, as a session draws them."""
    stream, published = Stream(5, "test"), getattr(PAPER, experiment)
    if experiment == "preference":
        people = [
            draw_ratings(RATINGS, PREFERENCE.scale, published.methods, stream) for _ in range(studies * published.n)
        ]
        ratings = [[person[method] for method in published.methods] for person in people]
        claims = recurs(np.array(ratings).reshape(studies, published.n, 3), published)
    else:
        people = [chances_of(RATES, stream) for _ in range(studies * published.n)]
        shares = np.array(people).reshape(studies, published.n, 3, 2)
        correct = draws(6).random((*shares.shape, 10)) < shares[..., None]
        claims = answers_recur(correct.sum(axis=-1), (10, 10), published)
    return {claim: float(held.mean()) for claim, held in with_whole_pattern(claims).items()}


def chances_of(rates: RatesLaw, stream: Stream) -> list[list[float]]:
    """A person's chances of being right, by method and direction: own ability and bias around the mean rates."""
    assert rates.bias is not None
    phi, spread = NormalDist(), np.sqrt(1 + rates.ability_sd**2 + rates.bias.sd**2)
    ability, bias = rates.ability_sd * stream.normal(), rates.bias.mean + rates.bias.sd * stream.normal()
    return [
        [
            phi.cdf(spread * phi.inv_cdf(rates.share[f"{method}/{way}"]) + ability + towards * bias)
            for way, towards in (("forward", 1), ("backward", -1))
        ]
        for method in METHODS
    ]


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["direction", "preference"])
def test_every_published_claim_recurs_as_often_as_among_people_drawn_one_by_one(experiment: str) -> None:
    theirs, ours = one_by_one(experiment, 2000), tally_of(experiment, 10_000)
    odds = {row.claim: row.share for row in pattern_odds(DRAWN[experiment], getattr(PAPER, experiment), 5000, 1).rows}
    assert WHOLE_PATTERN in theirs
    assert odds.keys() == theirs.keys()
    for claim, share in theirs.items():
        error = np.sqrt(share * (1 - share) * (1 / 2000 + 1 / 5000))
        assert abs(ours[f"published, {claim}"] - share) <= 4 * error + 1e-3, claim
        assert abs(odds[claim] - share) <= 4 * error + 1e-3, claim


@pytest.mark.slow
def test_null_participants_give_five_percent_and_the_exact_test_its_own_size() -> None:
    """The size of the exact test by its definition: all outcomes of 140 that it rejects."""
    grid = make_grid(PowerRequest(config="direction", participants="14", null=True, studies=20_000))
    guessing, biased = (merged([run_chunk(c) for c in grid.chunks_of(cell)]) for cell in grid.cells)
    for tally in (guessing, biased):
        found = {share.claim: share for share in shares(tally)}
        for claim in (ANOVA, ANY_PAIR, *(f"d′, {method}" for method in METHODS)):
            assert abs(found[claim].share - 0.05) < 4 * np.sqrt(0.05 * 0.95 / 20_000) + 0.003, claim
    outcomes = np.arange(141)
    size = sum(stats.binom.pmf(k, 140, 0.5) for k in outcomes if stats.binomtest(int(k), 140).pvalue < 0.05)
    for claim in (name for name in guessing.held if name.startswith("binomial")):
        assert abs(guessing.held[claim] / 20_000 - size) < 4 * np.sqrt(size * (1 - size) / 20_000)
        assert biased.held[claim] / 20_000 > size + 0.01


def test_null_people_differ_in_their_bias_alone() -> None:
    assert null_rates(RATES, biased=False).bias_sd == null_rates(RATES, biased=True).ability_sd == 0
    assert null_rates(RATES, biased=True).bias_sd == RATES.bias_sd > 0


def test_a_chunk_has_a_stream_of_its_own() -> None:
    design = StudyDesign(participants=8, trials=20, methods=METHODS)
    chunks = [
        Chunk(config=DIRECTION, design=d, published=None, seed=seed, number=number, studies=200)
        for d, seed, number in [(design, 1, 0), (design, 1, 1), (design, 2, 0), (replace(design, effect=0.9), 1, 0)]
    ]
    found = [run_chunk(chunk).sums["mean, vibration"] for chunk in chunks]
    assert len(set(found)) == 4
    assert run_chunk(chunks[0]).sums["mean, vibration"] == found[0]
    assert Counter(found).most_common(1)[0][1] == 1
