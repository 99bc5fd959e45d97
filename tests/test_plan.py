"""The golden hashes in golden_plans.json were made once, in tests/, by

    ../.venv/bin/python -c "import json, test_plan as t; print(json.dumps([case | {'sha256':
    t.plan_of_case(case).sha256()} for case in t.CASES], indent=1))" > golden_plans.json

A plan that was made by one version of Recoil must be made by every other one: do not make them again.
"""

import json
import math
from collections import Counter
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from typing import NamedTuple

import pytest
from pydantic import ValidationError

from experiments.config.setup import canonical_json
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planning import plan_of
from tests.designs import changed
from tests.other_trials import turned

pytestmark = pytest.mark.slow

METHODS = ("vibration", "asymmetric-1", "asymmetric-2")
DIRECTION, PREFERENCE = changed("direction").config, changed("preference").config
LARGEST_SEED = 2**63 - 1
ORDERED_BY_SESSION = frozenset(["direction", "hurry", "realism"])
"""The designs whose order of methods or of dampers is one of sessions."""


def case(
    design: str,
    participant_id: str,
    seed: int,
    order: str = "",
    balance: str = "",
    *,
    row: int | None = None,
    group: int = 0,
) -> dict[str, object]:
    """A shipped design, with another order of its blocks and another balance where they are named."""
    return {
        "design": design,
        "participant_id": participant_id,
        "seed": seed,
        "order": order,
        "balance": balance,
        "row": row,
        "group": group,
    }


CASES = [
    case("direction", "P01", 1, "random", "session"),
    case("direction", "P02", 1, "random", "session"),
    case("direction", "P14", 1, "random", "session"),
    case("direction", "P01", 2, "random", "session"),
    case("direction", "P01", 0, "random", "session"),
    case("direction", "a", LARGEST_SEED, "random", "session"),
    case("direction", "P01", 1, "random", "set"),
    case("direction", "P02", 20240229, "random", "set"),
    case("direction", "P01", 1, "random", "set-exact"),
    case("direction", "P01", 1, "williams", "session", row=0),
    case("direction", "P06", 1, "williams", "session", row=5),
    case("direction", "P03", 7, "williams", "set", row=3),
    case("direction", "P01", 1, "latin-square", "session", row=0),
    case("direction", "P02", 7, "latin-square", "set", row=1),
    case("direction", "P03", 7, "latin-square", "set-exact", row=2),
    case("preference", "P01", 1, "random"),
    case("preference", "P02", 1, "random"),
    case("preference", "P01", LARGEST_SEED, "random"),
    case("preference", "P05", 1, "williams", row=4),
    case("preference", "P03", 9, "latin-square", row=2),
    case("voltages", "P01", 1),
    case("detection", "P01", 1),
    case("detection", "P02", 3, "random", "set"),
    case("stronger", "P01", 1),
    case("magnitude", "P01", 1),
    case("realism", "P01", 1, row=0),
    case("realism", "P02", 5, row=1),
    case("pairs", "P01", 1),
    case("pairs", "P02", LARGEST_SEED),
    case("grip", "P01", 1, row=0),
    case("grip", "P02", 1, row=1, group=1),
    case("hurry", "P01", 1, row=0),
    case("hurry", "P04", 9, "random", "set"),
]


def config_of(design: str, order: str, balance: str) -> DesignConfig:
    changes = {"sessions" if design in ORDERED_BY_SESSION else "trials": order} if order else {}
    changes |= {"balance": balance} if balance else {}
    changes |= {"sets": 5} if balance == "set-exact" else {}  # two and two in each set
    return changed(design, order=changes).config


def plan_of_case(wanted: dict[str, object]) -> Plan:
    config = config_of(wanted["design"], wanted["order"], wanted["balance"])
    return plan_of(config, wanted["participant_id"], wanted["seed"], row=wanted["row"], group=wanted["group"])


def direction_config(order: str, balance: str) -> DesignConfig:
    return config_of("direction", order, balance)


@pytest.fixture(scope="module")
def golden() -> list[dict[str, object]]:
    return json.loads((Path(__file__).parent / "golden_plans.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("number", range(len(CASES)))
def test_a_plan_has_the_hash_that_it_had_in_the_first_release(golden: list[dict[str, object]], number: int) -> None:
    assert plan_of_case(golden[number]).sha256() == golden[number]["sha256"]


def test_there_are_golden_hashes_of_ten_designs_and_all_of_them_differ(golden: list[dict[str, object]]) -> None:
    assert len({entry["design"] for entry in golden}) == 10
    assert len({entry["sha256"] for entry in golden}) == 33
    assert [{key: entry[key] for key in entry if key != "sha256"} for entry in golden] == CASES


class Facts(NamedTuple):
    """What a plan of experiment 1 looks like from outside."""

    methods: tuple[str, ...]
    numbered: bool
    forward: tuple[tuple[int, ...], ...]  # in each set of each session


SESSIONS_SETS_TRIALS = [(session, 1 + trial // 5, 1 + trial) for session in (1, 2, 3) for trial in range(20)]


def facts(plan: Plan) -> Facts:
    trials = plan.trials
    numbered = [(trial.session, trial.set, trial.trial) for trial in trials] == SESSIONS_SETS_TRIALS
    one_method_each = all(len({trial.method for trial in trials[start : start + 20]}) == 1 for start in (0, 20, 40))
    ways = [trial.direction == "forward" for trial in trials]
    known = {trial.direction for trial in trials} == {"forward", "backward"}
    forward = tuple(
        tuple(sum(ways[start : start + 5]) for start in range(first, first + 20, 5)) for first in (0, 20, 40)
    )
    return Facts(plan.methods, numbered and one_method_each and known, forward)


def all_plans(balance: str, seeds: int) -> list[Facts]:
    config = direction_config("random", balance)
    return [facts(plan_of(config, "P01", seed)) for seed in range(seeds)]


@pytest.fixture(scope="module", params=[600, pytest.param(2000, marks=pytest.mark.soak)])
def seeds(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def over_sessions(seeds: int) -> list[Facts]:
    return all_plans("session", seeds)


@pytest.fixture(scope="module")
def over_sets(seeds: int) -> list[Facts]:
    return all_plans("set", seeds)


@pytest.fixture(scope="module", params=["session", "set"])
def either(request: pytest.FixtureRequest, over_sessions: list[Facts], over_sets: list[Facts]) -> list[Facts]:
    return over_sessions if request.param == "session" else over_sets


def test_all_plans_have_three_sessions_of_four_sets_of_five_trials(either: list[Facts], seeds: int) -> None:
    assert len(either) == seeds
    assert all(plan.numbered for plan in either)


def test_all_plans_have_each_method_in_one_session(either: list[Facts]) -> None:
    assert all(sorted(plan.methods) == sorted(METHODS) for plan in either)


def test_all_plans_have_ten_forward_and_ten_backward_trials_a_session(either: list[Facts]) -> None:
    assert all(sum(session) == 10 for plan in either for session in plan.forward)


def test_a_set_of_five_holds_two_or_three_forward_trials_if_balanced_over_sets(over_sets: list[Facts]) -> None:
    assert all(count in (2, 3) for plan in over_sets for session in plan.forward for count in session)


def test_which_sets_hold_three_is_random(over_sets: list[Facts]) -> None:
    # two sets of four: six choices, as often as each other; chi-square with 5 degrees of freedom, p = 1e-4
    choices = Counter(session for plan in over_sets for session in plan.forward)
    expected = 3 * len(over_sets) / 6
    assert len(choices) == 6
    assert sum((count - expected) ** 2 for count in choices.values()) / expected < 25.74


def test_only_a_third_of_sessions_has_two_or_three_in_every_set_if_balanced_over_sessions(
    over_sessions: list[Facts],
) -> None:
    # 6 * 10^4 of the 184,756 orders: C(4, 2) choices of the sets with three times C(5, 2) orders in each of four sets
    share = math.comb(4, 2) * math.comb(5, 2) ** 4 / math.comb(20, 10)
    even = sum(set(session) <= {2, 3} for plan in over_sessions for session in plan.forward)
    assert share == pytest.approx(1 / 3, abs=0.01)
    sessions = 3 * len(over_sessions)
    assert even / sessions == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / sessions))


def test_sets_take_every_possible_count_if_balanced_over_sessions(over_sessions: list[Facts]) -> None:
    # hypergeometric: 10 forward among 20, 5 drawn
    counts = Counter(count for plan in over_sessions for session in plan.forward for count in session[:1])
    for forward in range(6):
        share = math.comb(10, forward) * math.comb(10, 5 - forward) / math.comb(20, 5)
        tolerance = 4 * math.sqrt(share * (1 - share) / (3 * len(over_sessions)))
        assert counts[forward] / (3 * len(over_sessions)) == pytest.approx(share, abs=tolerance)


def test_a_random_order_meets_all_six_orders_of_methods_as_often(over_sessions: list[Facts]) -> None:
    orders = Counter(plan.methods for plan in over_sessions)
    assert set(orders) == set(permutations(METHODS))
    expected = len(over_sessions) / 6
    assert sum((count - expected) ** 2 for count in orders.values()) / expected < 25.74


def test_balance_over_sets_leaves_the_order_of_methods_as_it_is(
    over_sessions: list[Facts], over_sets: list[Facts]
) -> None:
    assert [plan.methods for plan in over_sessions] == [plan.methods for plan in over_sets]


def test_sessions_have_directions_of_their_own(over_sessions: list[Facts]) -> None:
    alike = sum(plan.forward[0] == plan.forward[1] for plan in over_sessions)
    assert alike < len(over_sessions) / 10


def test_the_same_seed_and_participant_make_the_same_plan_and_others_another() -> None:
    config = direction_config("random", "session")
    hashes = [plan_of(config, who, seed).sha256() for seed in range(60) for who in ("P01", "P02")]
    again = [plan_of(config, who, seed).sha256() for seed in range(60) for who in ("P01", "P02")]
    assert hashes == again
    assert len(set(hashes)) == 120


def test_another_participant_has_other_directions_not_only_another_name() -> None:
    config = direction_config("random", "session")
    same = sum(
        [trial.direction for trial in plan_of(config, "P01", seed).trials]
        == [trial.direction for trial in plan_of(config, "P02", seed).trials]
        for seed in range(60)
    )
    assert same == 0


def test_a_row_of_a_square_fixes_the_methods_whatever_the_seed() -> None:
    config = direction_config("williams", "session")
    orders = [{plan_of(config, "P01", seed, row=row).methods for seed in range(20)} for row in range(6)]
    assert all(len(met) == 1 for met in orders)
    assert set.union(*orders) == set(permutations(METHODS))


def test_preference_meets_each_method_once_in_one_direction() -> None:
    for seed in range(50):
        plan = plan_of(PREFERENCE, "P01", seed)
        assert sorted(plan.methods) == sorted(METHODS)
        assert [(trial.session, trial.set, trial.trial) for trial in plan.trials] == [(1, 1, 1), (1, 1, 2), (1, 1, 3)]
        assert {trial.direction for trial in plan.trials} == {"forward"}


def test_the_orders_of_both_experiments_are_independent() -> None:
    # each of the 36 pairs of orders about 720 / 36 times; agreement alone would be 1 in 6
    seeds = 720
    pairs = Counter(
        (plan_of(DIRECTION, "P01", seed).methods, plan_of(PREFERENCE, "P01", seed).methods) for seed in range(seeds)
    )
    assert len(pairs) == 36
    assert sum((count - seeds / 36) ** 2 for count in pairs.values()) / (seeds / 36) < 78  # chi-square, 35 df, p = 4e-5


@pytest.mark.parametrize("number", range(0, len(CASES), 4))
def test_a_plan_reads_back_from_its_record(number: int) -> None:
    made = plan_of_case(CASES[number])
    assert Plan.from_record(json.loads(canonical_json(made.record()))) == made


def test_the_hash_covers_every_trial_and_field() -> None:
    made = plan_of_case(CASES[0])
    flipped = turned(made.trials[-1])
    others = [
        replace(made, trials=(*made.trials[:-1], flipped)),
        replace(made, trials=made.trials[:-1]),
        replace(made, seed=made.seed + 1),
        replace(made, order_row=0),
        replace(made, participant_id="P99"),
        replace(made, format=3),
        replace(made, group=1),
    ]
    assert len({made.sha256(), *(other.sha256() for other in others)}) == 8


@pytest.mark.parametrize("record", [None, [], {}, {"experiment": "direction"}, "plan"])
def test_what_is_no_plan_is_refused(record: object) -> None:
    with pytest.raises(ValidationError):
        Plan.from_record(record)
