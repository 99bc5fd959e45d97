import math
from collections import Counter
from dataclasses import replace
from functools import cache
from statistics import NormalDist

import numpy as np
import pytest

from experiments.clock import VirtualClock
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.design.planning import plan_of
from experiments.design.streams import Stream
from experiments.load import load_setup
from experiments.screens.synthetic import synthetic_screen
from experiments.synthetic.answers import GivenAnswer, draw_ratings, synthetic_participant_of
from experiments.synthetic.laws import RatesLaw, RatingsLaw, TableLaw
from experiments.tasks.questions import on_scale
from tests.designs import changed, laws_of

pytestmark = pytest.mark.slow

DIRECTION, PREFERENCE = load_setup("direction"), load_setup("preference")
PLAN = plan_of(DIRECTION.config, "P01", 1)
FELT = plan_of(PREFERENCE.config, "P01", 1)
METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
SCALE = PREFERENCE.config.questions["rating"].scale
PEOPLE = 120
PHI = NormalDist()


def with_law(name: str, question: str, **values: object) -> Setup[DesignConfig]:
    """A shipped setup with some numbers of a question's law changed and checked again."""
    return changed(name, laws={"questions": {question: values}})


def told(setup: Setup[DesignConfig], plan: Plan) -> list[GivenAnswer]:
    """The answers to all trials, in order."""
    someone = synthetic_participant_of(setup, plan)
    return [someone.answer(trial, "response") for trial in plan.trials]


# experiment 1: rates


def correct_shares(setup: Setup[DesignConfig]) -> dict[tuple[str, str], np.ndarray]:
    """Each person's share of correct answers, by method and direction."""
    shares = {(method, way): np.empty(PEOPLE) for method in METHODS for way in ("forward", "backward")}
    for person in range(PEOPLE):
        plan = replace(PLAN, seed=person, participant_id=f"P{person}")
        right: Counter = Counter()
        for trial, answer in zip(plan.trials, told(setup, plan), strict=True):
            right[trial.method, trial.direction] += answer.response == trial.direction
        for key, share in shares.items():
            share[person] = right[key] / 10
    return shares


LAWS = {
    "as shipped": {},
    "people alike": {"ability_sd": 0.0, "bias": {"sd": 0.0}},
    "people of very different ability": {"ability_sd": 1.0, "bias": {"sd": 0.0}},
    "people of very different bias": {"ability_sd": 0.0, "bias": {"sd": 1.0}},
    "both, and a bias in the mean": {"ability_sd": 0.6, "bias": {"sd": 0.5, "mean": 0.4}},
    "a bias backward": {"bias": {"mean": -0.7}},
    "the same bias, said of the other answer": {"bias": {"answer": "backward", "mean": 0.7}},
}


Crowd = tuple[RatesLaw, dict[tuple[str, str], np.ndarray]]


@cache
def crowd_of(law: str) -> Crowd:
    setup = with_law("direction", "response", **LAWS[law])
    rates = laws_of(setup).questions["response"]
    assert isinstance(rates, RatesLaw)
    return rates, correct_shares(setup)


@pytest.fixture(params=LAWS)
def crowd(request: pytest.FixtureRequest) -> Crowd:
    return crowd_of(request.param)


def test_people_are_right_at_the_configured_rates_in_the_mean(crowd: Crowd) -> None:
    # a bias in the mean comes on top, divided by S = sqrt(1 + sds^2), as P(a + b e > 0) = Phi(a / sqrt(1 + b^2))
    rates, shares = crowd
    assert rates.bias is not None
    shift = rates.bias.mean / math.sqrt(1 + rates.ability_sd**2 + rates.bias.sd**2)
    for (method, way), share in shares.items():
        rate = rates.share[f"{method}/{way}"]
        expected = PHI.cdf(PHI.inv_cdf(rate) + (shift if way == rates.bias.answer else -shift))
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
        rate = rates.share[f"{method}/{way}"]
        scatter.append(share.var(ddof=1) / (rate * (1 - rate) / 10))
    assert np.mean(scatter) == pytest.approx(1.0, abs=4 * math.sqrt(3 / (PEOPLE * len(scatter))))


def answers_of(setup: Setup[DesignConfig], order: list[Trial]) -> dict[Trial, GivenAnswer]:
    someone = synthetic_participant_of(setup, PLAN)
    return {trial: someone.answer(trial, "response") for trial in order}


def table_setup(
    rows: list[dict[str, str]], base: Setup[DesignConfig] = DIRECTION, question: str = "response"
) -> Setup[DesignConfig]:
    """The setup with a question's answers from a table of these lines."""
    by = ("method", "direction") if question == "response" else ("method",)
    table = TableLaw(law="table", file="answers.csv", by=by, rows=tuple(rows))
    laws = laws_of(base)
    return replace(base, laws=laws.model_copy(update={"questions": laws.questions | {question: table}}))


def count(correct: int | str, method: str = "vibration", way: str = "forward", who: str = "P01") -> dict[str, str]:
    return {"participant_id": who, "method": method, "direction": way, "correct": str(correct)}


ALL_COUNTS = [
    count(right, method, way)
    for method, each in zip(METHODS, ((0, 10), (7, 3), (10, 0)), strict=True)
    for way, right in zip(("forward", "backward"), each, strict=True)
]


@pytest.mark.parametrize("setup", [DIRECTION, table_setup(ALL_COUNTS)], ids=["rates", "table"])
def test_an_answer_does_not_depend_on_what_was_answered_before(setup: Setup[DesignConfig]) -> None:
    there = answers_of(setup, list(PLAN.trials))
    back = answers_of(setup, list(reversed(PLAN.trials)))
    assert there == back
    last = PLAN.trials[-1]
    assert synthetic_participant_of(setup, PLAN).answer(last, "response") == there[last]


@pytest.mark.parametrize("setup", [DIRECTION, table_setup(ALL_COUNTS)], ids=["rates", "table"])
def test_response_times_are_positive_whole_milliseconds_beyond_the_shift(setup: Setup[DesignConfig]) -> None:
    times = [answer.response_time_s for answer in answers_of(setup, list(PLAN.trials)).values()]
    assert min(times) > laws_of(DIRECTION).times.shift_s > 0
    assert all(time == round(time, 3) for time in times)
    assert len(set(times)) > 50


def test_response_times_have_the_configured_median_and_spread() -> None:
    law = laws_of(DIRECTION).times
    logs = []
    for person in range(60):
        answers = told(DIRECTION, replace(PLAN, seed=person))
        logs += [math.log(answer.response_time_s - law.shift_s) for answer in answers]
    assert np.mean(logs) == pytest.approx(math.log(law.median_s), abs=4 * law.sigma / math.sqrt(len(logs)))
    assert np.std(logs) == pytest.approx(law.sigma, rel=4 / math.sqrt(2 * len(logs)))


def test_seed_and_participant_make_the_person() -> None:
    def of(seed: int, who: str) -> list[GivenAnswer]:
        return told(DIRECTION, replace(PLAN, seed=seed, participant_id=who))

    assert of(1, "P01") == of(1, "P01")
    assert of(1, "P01") != of(2, "P01")
    assert of(1, "P01") != of(1, "P02")


# experiment 1: a table of counts


@pytest.mark.parametrize("seed", range(5))
def test_a_table_is_answered_with_exactly_its_counts(seed: int) -> None:
    plan = plan_of(DIRECTION.config, "P01", seed)
    answers = told(table_setup(ALL_COUNTS), plan)
    right = Counter(
        (trial.method, trial.direction)
        for trial, answer in zip(plan.trials, answers, strict=True)
        if answer.response == trial.direction
    )
    for row in ALL_COUNTS:
        assert right[row["method"], row["direction"]] == int(row["correct"])


def test_which_trials_are_right_is_random() -> None:
    setup, patterns = table_setup(ALL_COUNTS), set()
    trials = [t for t in PLAN.trials if (t.method, t.direction) == ("asymmetric-1", "forward")]
    for seed in range(20):
        someone = synthetic_participant_of(setup, replace(PLAN, seed=seed))
        patterns.add(tuple(someone.answer(trial, "response").response == "forward" for trial in trials))
    assert len(patterns) > 15


def changed_to(row: dict[str, str], at: int = 0) -> list[dict[str, str]]:
    """All counts, one of them another one."""
    return [*ALL_COUNTS[:at], row, *ALL_COUNTS[at + 1 :]]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([], ("0 rows for participant P01, ", "there must be one")),
        (ALL_COUNTS[:-1], ("0 rows for participant P01, asymmetric-2/backward", "there must be one")),
        ([*ALL_COUNTS, count(1)], ("2 rows for participant P01, vibration/forward", "there must be one")),
        (changed_to(count(1, who="p01")), ("0 rows for participant P01, vibration/forward",)),
        (changed_to(count(11)), ("P01, vibration/forward, correct is 11", "0 to 10")),
        (changed_to(count(11, way="backward"), 1), ("P01, vibration/backward, correct is 11", "0 to 10")),
        (changed_to(count("")), ("P01, vibration/forward, correct is ''", "not a whole number")),
        (changed_to(count("-1")), ("P01, vibration/forward, correct is '-1'", "not a whole number")),
        (changed_to(count("5.0")), ("P01, vibration/forward, correct is '5.0'", "not a whole number")),
        (changed_to(count("²")), ("P01, vibration/forward, correct is '²'", "not a whole number")),
        (changed_to(count("9" * 5000)), ("P01, vibration/forward, correct is", "not a whole number")),
    ],
    ids=["empty", "missing", "double", "other case", "too many", "too many back", "blank", "negative", "fraction",
         "superscript", "endless"],
)  # fmt: skip
def test_a_bad_table_is_refused_with_participant_cell_value_and_rule(
    rows: list[dict[str, str]], said: tuple[str, ...]
) -> None:
    with pytest.raises(ConfigError) as refused:
        synthetic_screen(table_setup(rows), PLAN, VirtualClock())
    for words in said:
        assert words in str(refused.value)


# experiment 2


def draws(setup: Setup[DesignConfig], count: int = 600) -> list[dict[str, float]]:
    law, scale = laws_of(setup).questions["rating"], setup.config.questions["rating"].scale
    assert isinstance(law, RatingsLaw)
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
    people = {"questions": {"rating": SPREADS[law]}}
    for ratings in draws(changed("preference", laws=people, questions={"rating": scale}), 200):
        assert set(ratings) == set(METHODS)
        for rating in ratings.values():
            assert minimum <= rating <= maximum
            assert rating == round(rating, decimals)
            steps = (rating - minimum) / grain
            assert steps == pytest.approx(round(steps), abs=1e-9)


@pytest.mark.parametrize("law", SPREADS)
def test_the_lowest_method_is_a_grain_below_all_others_as_far_as_the_scale_goes(law: str) -> None:
    for ratings in draws(with_law("preference", "rating", **SPREADS[law])):
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
    people = draws(with_law("preference", "rating", **law), 2000)
    same = np.mean([ratings["asymmetric-1"] == ratings["asymmetric-2"] for ratings in people])
    assert same == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / 2000))


def test_without_habits_ratings_have_the_configured_means_and_spreads() -> None:
    mean = {"vibration": 4.0, "asymmetric-1": 5.0, "asymmetric-2": 6.0}
    law = {"mean": mean, "person_sd": 0.6, "noise_sd": 0.8, "lowest": None, "same": None, "same_share": 0.0}
    people = draws(
        changed("preference", laws={"questions": {"rating": law}}, questions={"rating": {"grain": 0.01}}), 2000
    )
    table = np.array([[ratings[method] for method in METHODS] for ratings in people])
    assert table.mean(axis=0) == pytest.approx(list(mean.values()), abs=4 / math.sqrt(2000))
    assert table.std(axis=0) == pytest.approx(1.0, rel=4 / math.sqrt(4000))  # sqrt(0.6^2 + 0.8^2)
    # what two methods of one person share is the person: 0.6^2 of a variance of 1
    assert np.corrcoef(table.T)[np.triu_indices(3, k=1)] == pytest.approx(0.36, abs=4 / math.sqrt(2000))


def test_the_order_of_presentation_does_not_change_a_rating() -> None:
    law = laws_of(PREFERENCE).questions["rating"]
    assert isinstance(law, RatingsLaw)
    for seed in range(50):
        there = draw_ratings(law, SCALE, METHODS, Stream(seed, "ratings"))
        assert there == draw_ratings(law, SCALE, METHODS[::-1], Stream(seed, "ratings"))
    turned = replace(FELT, trials=FELT.trials[::-1])
    one, other = (synthetic_participant_of(PREFERENCE, plan) for plan in (FELT, turned))
    for trial in FELT.trials:
        assert one.rate(trial, "rating") == other.rate(trial, "rating")


def test_a_single_method_can_be_the_lowest_of_all() -> None:
    people = {"questions": {"rating": {"same": None}}}
    setup = changed("preference", laws=people, factors={"method": {"levels": ("vibration",)}})
    plan = plan_of(setup.config, "P01", 1)
    rating = synthetic_participant_of(setup, plan).rate(plan.trials[0], "rating")
    assert rating is not None
    assert 0 <= rating <= 10


@pytest.mark.parametrize(
    ("value", "rating"), [(-3.0, 0.0), (0.0, 0.0), (0.04, 0.0), (0.06, 0.1), (0.3, 0.3), (9.96, 10.0), (99.0, 10.0)]
)
def test_the_nearest_value_of_the_scale_is_as_a_person_would_write_it(value: float, rating: float) -> None:
    assert on_scale(value, SCALE) == rating


def test_exposures_are_positive_last_as_long_as_planned_in_the_mean_and_depend_on_nothing_before() -> None:
    times = []
    for seed in range(400):
        someone = synthetic_participant_of(PREFERENCE, replace(FELT, seed=seed))
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
    someone = synthetic_participant_of(table_setup(rating_rows("0", "", "7.35"), PREFERENCE, "rating"), FELT)
    ratings = {trial.method: someone.rate(trial, "rating") for trial in FELT.trials}
    assert ratings == {"vibration": 0.0, "asymmetric-1": None, "asymmetric-2": 7.35}


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        (("1", "2"), ("0 rows for participant P01, asymmetric-2",)),
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
    setup = table_setup(rating_rows(*cells), PREFERENCE, "rating")
    with pytest.raises(ConfigError) as refused:
        synthetic_screen(setup, FELT, VirtualClock())
    for words in said:
        assert words in str(refused.value)


@pytest.mark.parametrize(
    ("setup", "plan"),
    [
        (table_setup(ALL_COUNTS[:-1]), PLAN),
        (table_setup(rating_rows("1", "2"), PREFERENCE, "rating"), FELT),
        (table_setup(rating_rows("good", "2", "3"), PREFERENCE, "rating"), FELT),
    ],
    ids=["a count is missing", "a rating is missing", "a rating is none"],
)
def test_a_bad_table_is_refused_by_its_name(setup: Setup[DesignConfig], plan: Plan) -> None:
    with pytest.raises(ConfigError, match=r"answers\.csv: "):
        synthetic_screen(setup, plan, VirtualClock())
