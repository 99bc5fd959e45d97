import math
from collections import Counter
from dataclasses import replace
from functools import cache
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest

from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.streams import Stream
from experiments.direction.session import make_plan as direction_plan
from experiments.direction.synthetic import RatesParticipant, TableParticipant
from experiments.direction.synthetic import synthetic_participant as direction_participant
from experiments.load import load_setup
from experiments.preference.session import make_plan as preference_plan
from experiments.preference.synthetic import RatingsParticipant, draw_ratings
from experiments.preference.synthetic import synthetic_participant as preference_participant
from experiments.screens.synthetic import synthetic_screen
from experiments.tasks.questions import on_scale

pytestmark = pytest.mark.slow

DIRECTION, PREFERENCE = load_setup("direction"), load_setup("preference")
PLAN = direction_plan(DIRECTION.config, "P01", 1, None)
FELT = preference_plan(PREFERENCE.config, "P01", 1, None)
METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
PEOPLE = 120
PHI = NormalDist()


def changed(setup: Setup[Any], **tables: dict[str, object]) -> Setup[Any]:
    """The setup with some values of its `synthetic` tables, or of others, changed and checked again."""
    values = setup.config.model_dump()
    for path, changes in tables.items():
        table = values
        for key in path.split("__"):
            table = table[key]
        table |= changes
    return replace(setup, config=type(setup.config).model_validate(values))


# experiment 1: rates


def correct_shares(setup: Setup[Any]) -> dict[tuple[str, str], np.ndarray]:
    """Each person's share of correct answers, by method and direction."""
    shares = {(method, way): np.empty(PEOPLE) for method in METHODS for way in ("forward", "backward")}
    for person in range(PEOPLE):
        plan = replace(PLAN, seed=person, participant_id=f"P{person}")
        someone = RatesParticipant(setup.config, plan)
        right: Counter = Counter()
        for trial in plan.trials:
            right[trial.method, trial.direction] += someone.answer(trial).response == trial.direction
        for key, share in shares.items():
            share[person] = right[key] / 10
    return shares


LAWS = {
    "as shipped": {},
    "people alike": {"ability_sd": 0.0, "bias_sd": 0.0},
    "people of very different ability": {"ability_sd": 1.0, "bias_sd": 0.0},
    "people of very different bias": {"ability_sd": 0.0, "bias_sd": 1.0},
    "both, and a bias in the mean": {"ability_sd": 0.6, "bias_sd": 0.5, "bias_mean": 0.4},
    "a bias backward": {"bias_mean": -0.7},
}


Crowd = tuple[Any, dict[tuple[str, str], np.ndarray]]


@cache
def crowd_of(law: str) -> Crowd:
    setup = changed(DIRECTION, synthetic__rates=LAWS[law])
    return setup.config.synthetic.rates, correct_shares(setup)


@pytest.fixture(params=LAWS)
def crowd(request: pytest.FixtureRequest) -> Crowd:
    return crowd_of(request.param)


def test_people_are_right_at_the_configured_rates_in_the_mean(crowd: Crowd) -> None:
    # a bias in the mean comes on top, divided by S = sqrt(1 + sds^2), as P(a + b e > 0) = Phi(a / sqrt(1 + b^2))
    rates, shares = crowd
    shift = rates.bias_mean / math.sqrt(1 + rates.ability_sd**2 + rates.bias_sd**2)
    for (method, way), share in shares.items():
        rate = (rates.forward if way == "forward" else rates.backward)[method]
        expected = PHI.cdf(PHI.inv_cdf(rate) + (shift if way == "forward" else -shift))
        error = share.std(ddof=1) / math.sqrt(PEOPLE)
        assert share.mean() == pytest.approx(expected, abs=4 * error), (method, way)


def test_differences_in_ability_go_the_same_way_in_both_directions_and_bias_the_other_way(crowd: Crowd) -> None:
    rates, shares = crowd
    mean = {way: sum(shares[method, way] for method in METHODS) for way in ("forward", "backward")}
    correlation = np.corrcoef(mean["forward"], mean["backward"])[0, 1]
    if rates.ability_sd == rates.bias_sd == 0:
        assert abs(correlation) < 4 / math.sqrt(PEOPLE)
    elif rates.bias_sd == 0:
        assert correlation > 0.3
    elif rates.ability_sd == 0:
        assert correlation < -0.3


def test_people_who_are_alike_scatter_as_coins_do() -> None:
    rates, shares = crowd_of("people alike")
    scatter = []
    for (method, way), share in shares.items():
        rate = (rates.forward if way == "forward" else rates.backward)[method]
        scatter.append(share.var(ddof=1) / (rate * (1 - rate) / 10))
    assert np.mean(scatter) == pytest.approx(1.0, abs=4 * math.sqrt(3 / (PEOPLE * len(scatter))))


def answers_of(setup: Setup[Any], order: list[Any]) -> dict[Any, Any]:
    someone = direction_participant(setup, PLAN)
    return {trial: someone.answer(trial) for trial in order}


def table_setup(rows: list[dict[str, str]], base: Setup[Any] = DIRECTION) -> Setup[Any]:
    return replace(changed(base, synthetic={"observer": "table", "table": "answers.csv"}), answers=tuple(rows))


def counts(forward: int | str, backward: int | str, method: str = "vibration", who: str = "P01") -> dict[str, str]:
    return {
        "participant_id": who,
        "method": method,
        "forward_correct": str(forward),
        "backward_correct": str(backward),
    }


ALL_COUNTS = [counts(0, 10, "vibration"), counts(7, 3, "asymmetric-1"), counts(10, 0, "asymmetric-2")]


@pytest.mark.parametrize("setup", [DIRECTION, table_setup(ALL_COUNTS)], ids=["rates", "table"])
def test_an_answer_does_not_depend_on_what_was_answered_before(setup: Setup[Any]) -> None:
    there = answers_of(setup, list(PLAN.trials))
    back = answers_of(setup, list(reversed(PLAN.trials)))
    assert there == back
    last = PLAN.trials[-1]
    assert direction_participant(setup, PLAN).answer(last) == there[last]


@pytest.mark.parametrize("setup", [DIRECTION, table_setup(ALL_COUNTS)], ids=["rates", "table"])
def test_response_times_are_positive_whole_milliseconds_beyond_the_shift(setup: Setup[Any]) -> None:
    times = [answer.response_time_s for answer in answers_of(setup, list(PLAN.trials)).values()]
    assert min(times) > DIRECTION.config.synthetic.response_time.shift_s > 0
    assert all(time == round(time, 3) for time in times)
    assert len(set(times)) > 50


def test_response_times_have_the_configured_median_and_spread() -> None:
    law = DIRECTION.config.synthetic.response_time
    logs = []
    for person in range(60):
        plan = replace(PLAN, seed=person)
        someone = RatesParticipant(DIRECTION.config, plan)
        logs += [math.log(someone.answer(trial).response_time_s - law.shift_s) for trial in plan.trials]
    assert np.mean(logs) == pytest.approx(math.log(law.median_s), abs=4 * law.sigma / math.sqrt(len(logs)))
    assert np.std(logs) == pytest.approx(law.sigma, rel=4 / math.sqrt(2 * len(logs)))


def test_seed_and_participant_make_the_person() -> None:
    def told(seed: int, who: str) -> list[Any]:
        plan = replace(PLAN, seed=seed, participant_id=who)
        someone = RatesParticipant(DIRECTION.config, plan)
        return [someone.answer(trial) for trial in plan.trials]

    assert told(1, "P01") == told(1, "P01")
    assert told(1, "P01") != told(2, "P01")
    assert told(1, "P01") != told(1, "P02")


# experiment 1: a table of counts


@pytest.mark.parametrize("seed", range(5))
def test_a_table_is_answered_with_exactly_its_counts(seed: int) -> None:
    plan = direction_plan(DIRECTION.config, "P01", seed, None)
    someone = direction_participant(table_setup(ALL_COUNTS), plan)
    assert isinstance(someone, TableParticipant)
    right = Counter(
        (trial.method, trial.direction) for trial in plan.trials if someone.answer(trial).response == trial.direction
    )
    for row in ALL_COUNTS:
        assert right[row["method"], "forward"] == int(row["forward_correct"])
        assert right[row["method"], "backward"] == int(row["backward_correct"])


def test_which_trials_are_right_is_random() -> None:
    setup, patterns = table_setup(ALL_COUNTS), set()
    for seed in range(20):
        someone = direction_participant(setup, replace(PLAN, seed=seed))
        trials = [t for t in PLAN.trials if (t.method, t.direction) == ("asymmetric-1", "forward")]
        patterns.add(tuple(someone.answer(trial).response == trial.direction for trial in trials))
    assert len(patterns) > 15


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([], ("0 rows for participant P01, method", "there must be one")),
        ([*ALL_COUNTS[:2]], ("0 rows for participant P01, method asymmetric-2", "there must be one")),
        ([*ALL_COUNTS, counts(1, 1)], ("2 rows for participant P01, method vibration", "there must be one")),
        ([counts(1, 1, who="p01"), *ALL_COUNTS[1:]], ("0 rows for participant P01, method vibration",)),
        ([counts(11, 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is 11", "0 to 10")),
        ([counts(1, 11), *ALL_COUNTS[1:]], ("P01, vibration, backward_correct is 11", "0 to 10")),
        ([counts("", 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is ''", "not a whole number")),
        ([counts("-1", 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is '-1'", "not a whole number")),
        ([counts("5.0", 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is '5.0'", "not a whole number")),
        ([counts("²", 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is '²'", "not a whole number")),
        ([counts("9" * 5000, 1), *ALL_COUNTS[1:]], ("P01, vibration, forward_correct is", "not a whole number")),
    ],
    ids=["empty", "missing", "double", "other case", "too many", "too many back", "blank", "negative", "fraction",
         "superscript", "endless"],
)  # fmt: skip
def test_a_bad_table_is_refused_with_participant_method_value_and_rule(
    rows: list[dict[str, str]], said: tuple[str, ...]
) -> None:
    setup = table_setup(rows)
    with pytest.raises(ConfigError, match=r"answers\.csv: ") as refused:
        synthetic_screen(setup, PLAN, VirtualClock())
    for words in said:
        assert words in str(refused.value)


# experiment 2


def draws(setup: Setup[Any], count: int = 600) -> list[dict[str, float]]:
    law, scale = setup.config.synthetic.ratings, setup.config.rating
    return [draw_ratings(law, scale, METHODS, Stream(seed, "ratings")) for seed in range(count)]


SPREADS = {
    "as shipped": {},
    "wild": {"noise_sd": 30.0},
    "all alike": {"noise_sd": 0.0, "person_sd": 0.0, "mean": dict.fromkeys(METHODS, 5.0)},
    "all disliked": {"mean": dict.fromkeys(METHODS, -50.0)},
    "all liked": {"mean": dict.fromkeys(METHODS, 50.0)},
}


@pytest.mark.parametrize("law", SPREADS)
@pytest.mark.parametrize(("minimum", "maximum", "grain"), [(0.0, 10.0, 0.1), (0.0, 10.0, 0.5), (1.0, 7.0, 1.0)])
def test_ratings_are_on_the_scale_and_its_grain(law: str, minimum: float, maximum: float, grain: float) -> None:
    scale = {"minimum": minimum, "maximum": maximum, "grain": grain}
    decimals = 1 if grain < 1 else 0
    for ratings in draws(changed(PREFERENCE, synthetic__ratings=SPREADS[law], rating=scale), 200):
        assert set(ratings) == set(METHODS)
        for rating in ratings.values():
            assert minimum <= rating <= maximum
            assert rating == round(rating, decimals)
            steps = (rating - minimum) / grain
            assert steps == pytest.approx(round(steps), abs=1e-9)


@pytest.mark.parametrize("law", SPREADS)
def test_the_lowest_method_is_a_grain_below_all_others_as_far_as_the_scale_goes(law: str) -> None:
    for ratings in draws(changed(PREFERENCE, synthetic__ratings=SPREADS[law])):
        others = min(ratings["asymmetric-1"], ratings["asymmetric-2"])
        if others == 0:
            assert ratings["vibration"] == 0
        else:
            assert others - ratings["vibration"] >= 0.1 - 1e-9


@pytest.mark.parametrize("share", [0.0, 0.143, 0.5, 1.0])
def test_so_many_people_give_both_methods_the_same_rating(share: float) -> None:
    # means 4 apart and noise of 0.3: nobody gives both the same rating by chance
    mean = {"vibration": 1.0, "asymmetric-1": 3.0, "asymmetric-2": 7.0}
    law = {"mean": mean, "noise_sd": 0.3, "person_sd": 0.3, "same_share": share}
    people = draws(changed(PREFERENCE, synthetic__ratings=law), 2000)
    same = np.mean([ratings["asymmetric-1"] == ratings["asymmetric-2"] for ratings in people])
    assert same == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / 2000))


def test_without_habits_ratings_have_the_configured_means_and_spreads() -> None:
    mean = {"vibration": 4.0, "asymmetric-1": 5.0, "asymmetric-2": 6.0}
    law = {"mean": mean, "person_sd": 0.6, "noise_sd": 0.8, "lowest": None, "same": None, "same_share": 0.0}
    people = draws(changed(PREFERENCE, synthetic__ratings=law, rating={"grain": 0.01}), 2000)
    table = np.array([[ratings[method] for method in METHODS] for ratings in people])
    assert table.mean(axis=0) == pytest.approx(list(mean.values()), abs=4 / math.sqrt(2000))
    assert table.std(axis=0) == pytest.approx(1.0, rel=4 / math.sqrt(4000))  # sqrt(0.6^2 + 0.8^2)
    # what two methods of one person share is the person: 0.6^2 of a variance of 1
    assert np.corrcoef(table.T)[np.triu_indices(3, k=1)] == pytest.approx(0.36, abs=4 / math.sqrt(2000))


def test_the_order_of_presentation_does_not_change_a_rating() -> None:
    law, scale = PREFERENCE.config.synthetic.ratings, PREFERENCE.config.rating
    for seed in range(50):
        there = draw_ratings(law, scale, METHODS, Stream(seed, "ratings"))
        assert there == draw_ratings(law, scale, METHODS[::-1], Stream(seed, "ratings"))


def test_a_single_method_can_be_the_lowest_of_all() -> None:
    setup = changed(PREFERENCE, design={"methods": ("vibration",)}, synthetic__ratings={"same": None})
    plan = preference_plan(setup.config, "P01", 1, None)
    rating = preference_participant(setup, plan).rate(plan.trials[0])
    assert 0 <= rating <= 10


@pytest.mark.parametrize(
    ("value", "rating"), [(-3.0, 0.0), (0.0, 0.0), (0.04, 0.0), (0.06, 0.1), (0.3, 0.3), (9.96, 10.0), (99.0, 10.0)]
)
def test_the_nearest_value_of_the_scale_is_as_a_person_would_write_it(value: float, rating: float) -> None:
    assert on_scale(value, PREFERENCE.config.rating) == rating


def test_exposures_are_positive_last_as_long_as_planned_in_the_mean_and_depend_on_nothing_before() -> None:
    times = []
    for seed in range(400):
        someone = preference_participant(PREFERENCE, replace(FELT, seed=seed))
        there = [someone.exposure_s(trial) for trial in FELT.trials]
        assert there == [someone.exposure_s(trial) for trial in reversed(FELT.trials)][::-1]
        times += there
    assert min(times) > 0
    # log-normal with sigma 0.3: standard deviation 0.307 of the mean
    assert np.mean(times) == pytest.approx(40.0, abs=4 * 0.307 * 40.0 / math.sqrt(1200))


def rating_rows(*cells: str, who: str = "P01") -> list[dict[str, str]]:
    return [
        {"participant_id": who, "method": method, "rating": cell} for method, cell in zip(METHODS, cells, strict=False)
    ]


def test_a_table_of_ratings_is_given_back_as_it_is_with_0_a_rating_and_empty_no_answer() -> None:
    someone = preference_participant(table_setup(rating_rows("0", "", "7.35"), PREFERENCE), FELT)
    assert isinstance(someone, RatingsParticipant)
    told = {trial.method: someone.rate(trial) for trial in FELT.trials}
    assert told == {"vibration": 0.0, "asymmetric-1": None, "asymmetric-2": 7.35}


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (("1", "2"), ("0 rows for participant P01, method asymmetric-2",)),
        (("10.1", "2", "3"), ("P01, vibration, rating is '10.1'", "0 to 10", "empty for no answer")),
        (("-0.1", "2", "3"), ("P01, vibration, rating is '-0.1'", "0 to 10")),
        (("nan", "2", "3"), ("P01, vibration, rating is 'nan'", "0 to 10")),
        (("inf", "2", "3"), ("P01, vibration, rating is 'inf'", "0 to 10")),
        (("good", "2", "3"), ("P01, vibration, rating is 'good'", "0 to 10")),
        (("5,5", "2", "3"), ("P01, vibration, rating is '5,5'", "0 to 10")),
    ],
)
def test_a_bad_table_of_ratings_is_refused_with_participant_method_value_and_rule(
    cells: tuple[str, ...], said: tuple[str, ...]
) -> None:
    setup = table_setup(rating_rows(*cells), PREFERENCE)
    with pytest.raises(ConfigError, match=r"answers\.csv: ") as refused:
        synthetic_screen(setup, FELT, VirtualClock())
    for words in said:
        assert words in str(refused.value)
