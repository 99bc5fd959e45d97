"""Procedures: next levels follow from the answers alone, tracks meet their targets, the best stimulus is the best."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy.special import ndtr
from scipy.stats import norm

from experiments.design.language import Shape
from experiments.design.procedures import posterior, psychometric
from experiments.design.procedures.up_down import Kesten, LevelRange, TrackEnd, UpDown, track_after, track_of
from tests.threshold_bound import width_of

WIDE = LevelRange(low=-1e6, high=1e6)
SHAPES: tuple[Shape, ...] = ("normal", "logistic", "gumbel", "reversed-gumbel")


# the functions


@pytest.mark.parametrize("shape", SHAPES)
def test_a_function_is_a_half_at_its_threshold_and_its_tails_are_a_width_apart(shape: Shape) -> None:
    levels = np.linspace(-50, 70, 1201)
    shares = psychometric.share_felt(levels, 10.0, 4.0, shape)
    assert psychometric.share_felt(10.0, 10.0, 4.0, shape) == pytest.approx(0.5)
    assert np.all(np.diff(shares) >= 0)
    assert shares[0] == pytest.approx(0, abs=1e-12)
    low, high = np.interp([0.05, 0.95], shares, levels)
    assert high - low == pytest.approx(4.0, abs=0.01)


def test_a_cumulative_normal_is_that_of_scipy() -> None:
    levels = np.linspace(-3, 3, 13)
    assert psychometric.share_felt(levels, 0.5, width_of(0.7)) == pytest.approx(norm.cdf(levels, 0.5, 0.7))


# up and down

some_answers = some.lists(some.booleans(), max_size=60)


@some.composite
def up_downs(draw: some.DrawFn) -> UpDown:
    return UpDown(
        start=draw(some.floats(0, 20)),
        steps=tuple(draw(some.lists(some.floats(0.1, 3), min_size=1, max_size=3))),
        within=LevelRange(
            low=0, high=20, grain=draw(some.sampled_from([0.0, 0.5])), easier=draw(some.sampled_from([-1, 1]))
        ),
        stop=TrackEnd(trials=draw(some.integers(0, 40)), reversals=draw(some.integers(1, 12))),
        up=draw(some.integers(1, 3)),
        down=draw(some.integers(1, 4)),
        ratio=draw(some.floats(0.3, 3)),
    )


@pytest.mark.slow
@given(up_downs(), some_answers)
def test_a_track_stays_in_its_range_on_its_grid_and_stops_when_it_is_told(rule: UpDown, answers: list[bool]) -> None:
    found = track_after(rule, answers)
    for level in (*found.levels, *(() if found.next_level is None else (found.next_level,))):
        assert 0 <= level <= 20
        assert not rule.within.grain or level / rule.within.grain == pytest.approx(round(level / rule.within.grain))
    assert len(found.reversals) <= rule.stop.reversals
    assert not rule.stop.trials or len(found.levels) <= rule.stop.trials
    assert (found.next_level is None) == rule.stop.reached(len(found.levels), len(found.reversals))


@pytest.mark.slow
@given(up_downs(), some_answers, some.data())
def test_what_comes_next_is_that_of_the_answers_however_they_came(
    rule: UpDown, answers: list[bool], data: some.DataObject
) -> None:
    """An answer that is corrected counts as if it had been given so at once: what comes before is as it was."""
    place = data.draw(some.integers(0, max(0, len(answers) - 1)))
    other = [right != (number == place) for number, right in enumerate(answers)]
    found, corrected = track_after(rule, answers).levels, track_after(rule, other).levels
    assert found[: place + 1] == corrected[: place + 1]


def test_a_track_turns_where_it_should() -> None:
    """Two down, one up, by hand; levels at which the direction changed."""
    rule = UpDown(start=10.0, steps=(2.0, 1.0), within=WIDE, stop=TrackEnd(reversals=3), down=2)
    found = track_after(rule, [True, True, True, False, True, True, False])
    assert found.levels == (10.0, 10.0, 8.0, 8.0, 9.0, 9.0, 8.0)
    assert (found.reversals, found.next_level) == ((8.0, 9.0, 8.0), None)


def test_a_track_at_the_end_of_its_range_says_so() -> None:
    rule = UpDown(start=1.0, steps=(2.0,), within=LevelRange(low=0, high=9), stop=TrackEnd(trials=9))
    assert (track_after(rule, [True]).next_level, track_after(rule, [True]).at_edge) == (0.0, True)
    assert not track_after(rule, [True, False]).at_edge


def test_a_track_that_was_held_at_the_end_of_its_levels_is_there_until_it_takes_a_step() -> None:
    rule = UpDown(start=1.0, steps=(2.0,), within=LevelRange(low=0, high=9), stop=TrackEnd(trials=9), down=2)
    told = [track_after(rule, [True] * count).at_edge for count in range(5)]
    assert told == [False, False, True, True, True]
    assert not track_after(rule, [True, True, True, False]).at_edge


def test_factors_multiply_and_a_higher_level_may_be_harder() -> None:
    within = LevelRange(low=0.1, high=100, factors=True, easier=-1)
    rule = UpDown(start=10.0, steps=(2.0,), within=within, stop=TrackEnd(trials=9), ratio=3.0)
    assert track_after(rule, [True]).next_level == 20.0
    assert track_after(rule, [False]).next_level == 1.25


@pytest.mark.parametrize(
    ("down", "up", "ratio", "target"),
    [(1, 1, 1, 0.5), (2, 1, 1, 0.5**0.5), (3, 1, 1, 0.5 ** (1 / 3)), (1, 2, 1, 1 - 0.5**0.5), (1, 1, 3, 0.75)],
)
def test_targets_are_those_of_the_books(down: int, up: int, ratio: float, target: float) -> None:
    """Levitt (1971, table I) and Kaernbach (1991, equation 1)."""
    rule = UpDown(start=0.0, steps=(1.0,), within=WIDE, stop=TrackEnd(trials=9), down=down, up=up, ratio=ratio)
    assert rule.target == pytest.approx(target, abs=1e-12)


@pytest.mark.parametrize(
    "rule",
    [
        UpDown(start=1.0, steps=(0.1,), within=WIDE, stop=TrackEnd(trials=3000), down=2),
        UpDown(start=1.0, steps=(0.1,), within=WIDE, stop=TrackEnd(trials=3000), ratio=3.0),
        Kesten(start=1.0, first_step=4.0, target=0.8, within=WIDE, stop=TrackEnd(trials=3000)),
    ],
)
def test_tracks_come_to_their_target(rule: UpDown | Kesten) -> None:
    """The level with that share on a cumulative normal: small steps stay near it."""
    stream = np.random.default_rng(17)
    found = track_of(rule, lambda level: bool(stream.random() < ndtr(level)))
    assert np.mean(found.levels[200:]) == pytest.approx(norm.ppf(rule.target), abs=0.15)


def test_shrinking_steps_come_to_their_target_on_a_coarse_grid_too() -> None:
    """Rounded off step by step, the smaller steps would be lost, and tracks would only go up, here to 2.7."""
    within, stop = LevelRange(low=-5.0, high=5.0, grain=0.5), TrackEnd(trials=200)
    rule, draws = Kesten(start=3.0, first_step=4.0, target=0.75, within=within, stop=stop), np.random.default_rng(18)
    last = [track_of(rule, lambda level: bool(draws.random() < ndtr(level))).levels[-1] for _ in range(60)]
    assert np.mean(last) == pytest.approx(norm.ppf(0.75), abs=0.25)


@pytest.mark.slow
@given(up_downs(), some_answers)
def test_a_track_of_somebody_is_that_of_their_answers(rule: UpDown, answers: list[bool]) -> None:
    """Somebody who answers so, trial by trial: the same track, and asked no oftener than it goes on."""
    waiting, asked = list(answers), list[float]()

    def answer(level: float) -> bool | None:
        asked.append(level)
        return waiting.pop(0) if waiting else None

    found = track_of(rule, answer)
    assert found == track_after(rule, answers)
    assert tuple(asked) == (*found.levels, *(() if found.next_level is None else (found.next_level,)))


# the posterior


def test_a_lapse_goes_either_way_where_it_is_said_so() -> None:
    known = posterior.parameter_grid(
        stimuli=np.array([-99.0, 99.0]),
        thresholds=np.zeros(1),
        widths=np.ones(1),
        lapses=np.array([0.0, 0.04]),
        guesses=np.zeros(1),
        either_way=True,
    )
    shares = known.chance + known.slack * known.felt[..., None]
    assert shares[:, 0].tolist() == [[0.0, 0.04], [1.0, 0.96]]


@given(some.integers(0, 40), some.booleans())
def test_an_interval_is_as_wide_as_its_cells(place: int, log: bool) -> None:
    """Of one value that is certain 95 % of its cell; of all alike 95 % of the range of the cells."""
    values = np.linspace(1.0, 3.0, 41)
    one = float(posterior.credible_span(values, np.eye(41)[place], log=log))
    ends = values[place] + np.array([-0.475, 0.475]) * 0.05
    assert one == pytest.approx(float(np.ptp(np.exp(ends) if log else ends)))
    assert float(posterior.credible_span(values, np.ones(41))) == pytest.approx(0.95 * 2.05)


KNOWN = posterior.parameter_grid(
    stimuli=np.linspace(-4, 4, 9),
    thresholds=np.linspace(-3, 3, 7),
    widths=np.array([1.0, 3.0, 5.0]),
    lapses=np.array([0.0, 0.05]),
    guesses=np.array([0.0, 0.1, 0.2]),
    prior=np.random.default_rng(3).random((7, 3, 2, 3)),
)
some_trials = some.lists(some.tuples(some.integers(0, 8), some.booleans()), max_size=12)


def after(trials: list[tuple[int, bool]]) -> posterior.Shares:
    known = KNOWN.start()
    for stimulus, right in trials:
        known = posterior.posterior_after(KNOWN, known, stimulus, right)
    return known


def by_hand(trials: list[tuple[int, bool]]) -> np.ndarray:
    """The posterior by its definition, trial by trial over all nodes."""
    threshold, width, lapse, guess = np.meshgrid(
        *(KNOWN.axes[name] for name in ("threshold", "width", "lapse", "guess")), indexing="ij"
    )
    weights = KNOWN.prior.copy()
    for stimulus, right in trials:
        felt = norm.cdf((KNOWN.stimuli[stimulus] - threshold) / width * 2 * norm.ppf(0.95))
        share = guess + (1 - guess - lapse) * felt
        weights *= share if right else 1 - share
    return weights / weights.sum()


@pytest.mark.slow
@given(some_trials)
def test_a_posterior_is_prior_times_likelihood(trials: list[tuple[int, bool]]) -> None:
    assert after(trials).reshape(KNOWN.prior.shape) == pytest.approx(by_hand(trials), rel=1e-9, abs=1e-15)


@pytest.mark.slow
@given(some_trials, some.sampled_from([("threshold",), ("width",), ("threshold", "width")]))
def test_the_variance_rule_takes_what_leaves_the_least_variance(
    trials: list[tuple[int, bool]], wanted: tuple[posterior.WantedParameter, ...]
) -> None:
    known, rule = after(trials), posterior.variance_rule(KNOWN, wanted)
    left = [sum(variance_left(known, stimulus, name) for name in wanted) for stimulus in range(9)]
    gains = rule.gains(known)
    assert gains - gains[0] == pytest.approx(left[0] - np.array(left), abs=1e-9)
    assert left[int(posterior.best_stimulus(gains))] == pytest.approx(min(left), abs=1e-9)


def variance_left(known: np.ndarray, stimulus: int, wanted: posterior.WantedParameter) -> float:
    """What is expected after an answer, in units of the prior's variance."""
    values = np.broadcast_to(KNOWN.values(wanted)[:, None], known.shape)
    prior = KNOWN.start()
    scale = (prior * values**2).sum() - (prior * values).sum() ** 2
    share = KNOWN.chance + KNOWN.slack * KNOWN.felt[stimulus][:, None]
    left = 0.0
    for likely in (known * share, known * (1 - share)):
        weight = likely.sum()
        mean = (likely * values).sum() / weight
        left += (likely * values**2).sum() - weight * mean**2
    return float(left / scale)


@pytest.mark.slow
@given(some_trials)
def test_the_entropy_rule_takes_what_tells_most(trials: list[tuple[int, bool]]) -> None:
    known = after(trials)
    told = posterior.entropy_rule(KNOWN).gains(known)
    for stimulus in (0, 4, 8):
        left = 0.0
        for right in (True, False):
            share = KNOWN.chance + KNOWN.slack * KNOWN.felt[stimulus][:, None]
            weight = (known * (share if right else 1 - share)).sum()
            left += weight * entropy(posterior.posterior_after(KNOWN, known, stimulus, right))
        assert told[stimulus] == pytest.approx(entropy(known) - left, abs=1e-9)


def entropy(weights: np.ndarray) -> float:
    kept = weights[weights > 0]
    return float(-(kept * np.log(kept)).sum())


def test_many_observers_at_once_are_each_their_own() -> None:
    draws = np.random.default_rng(5)
    stimuli, right = draws.integers(0, 9, (6, 4)), draws.random((6, 4)) < 0.5
    rule, many = posterior.variance_rule(KNOWN), np.broadcast_to(KNOWN.start(), (4, *KNOWN.shape))
    for stimulus, answer in zip(stimuli, right, strict=True):
        many = posterior.posterior_after(KNOWN, many, stimulus, answer)
    for person in range(4):
        own = after([(int(one), bool(said)) for one, said in zip(stimuli[:, person], right[:, person], strict=True)])
        assert many[person] == pytest.approx(own, rel=1e-12)
        assert rule.gains(many)[person] == pytest.approx(rule.gains(own), rel=1e-9)


@pytest.mark.slow
@given(some_trials, some.sampled_from(["threshold", "width", "lapse", "guess"]))
def test_a_credible_span_is_that_of_the_marginal_with_each_value_spread_over_its_cell(
    trials: list[tuple[int, bool]], name: str
) -> None:
    known = after(trials)
    values, weights = KNOWN.axes[name], KNOWN.marginal(known, name)
    middles = (values[1:] + values[:-1]) / 2
    edges = [2 * values[0] - middles[0], *middles, 2 * values[-1] - middles[-1]]
    assert weights == pytest.approx(
        np.moveaxis(known.reshape(KNOWN.prior.shape), list(KNOWN.axes).index(name), 0).reshape(len(values), -1).sum(-1)
    )
    ends = np.interp([0.025, 0.975], [0, *np.cumsum(weights)], edges)
    assert posterior.credible_span(values, weights) == pytest.approx(
        np.diff(ends)[0], abs=1e-6 * (edges[-1] - edges[0])
    )


def test_a_parameter_with_one_value_has_no_span() -> None:
    known = posterior.parameter_grid(
        stimuli=np.array([0.0, 1.0]),
        thresholds=np.array([0.0, 1.0]),
        widths=np.array([2.0]),
        lapses=np.array([0.0]),
        guesses=np.array([0.5]),
    )
    many = np.broadcast_to(known.start(), (3, *known.shape))
    width, threshold = (
        posterior.credible_span(known.axes[one], known.marginal(many, one)) for one in ("width", "threshold")
    )
    assert width.tolist() == [0.0] * 3
    assert threshold.tolist() == pytest.approx([1.9] * 3)


def test_of_stimuli_that_are_alike_the_first_is_taken() -> None:
    assert posterior.best_stimulus(np.array([[1.0, 2.0, 2.0 + 1e-13], [3.0, 1.0, 0.0]])).tolist() == [1, 0]
    assert posterior.best_stimulus(np.zeros(4)) == 0


@pytest.mark.parametrize("prior", [np.ones((7, 3)), -np.ones((7, 3, 2, 3)), np.zeros((7, 3, 2, 3))])
def test_a_prior_that_is_none_is_refused(prior: np.ndarray) -> None:
    with pytest.raises(ValueError, match="prior: it must have the shape"):
        posterior.parameter_grid(
            stimuli=KNOWN.stimuli,
            thresholds=KNOWN.axes["threshold"],
            widths=KNOWN.axes["width"],
            lapses=KNOWN.axes["lapse"],
            guesses=KNOWN.axes["guess"],
            prior=prior,
        )
