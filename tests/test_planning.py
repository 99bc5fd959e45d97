"""Plans of designs: what is balanced is balanced, what is limited is limited, and the same plan comes again."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from math import comb

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from experiments.config.door import ConfigError
from experiments.design.config import DesignConfig
from experiments.design.contents import cells
from experiments.design.plan import Plan
from experiments.design.planning import groups, plan_of, square_size
from tests.designs import design

WAYS = {"levels": ["forward", "backward"]}


def held(trials, *names):
    return Counter(tuple(trial.level(name) for name in names) for trial in trials)


def by_place(plan, *, sets=False):
    key = (lambda t: (t.session, t.set)) if sets else (lambda t: t.session)
    return [list(some) for _, some in groupby(plan.trials, key)]


@pytest.mark.slow
@given(
    voltages=st.integers(1, 5),
    repetitions=st.integers(1, 6),
    sets=st.integers(1, 6),
    balance=st.sampled_from(["session", "set", "set-exact"]),
    seed=st.integers(0, 2**63 - 1),
)
def test_each_cell_stands_equally_often_in_a_session_and_as_evenly_as_it_gets_in_a_set(
    voltages, repetitions, sets, balance, seed
):
    config = design(
        factors={
            "method": {"levels": ["a", "b"]},
            "voltage_V": {"levels": [10.0 + v for v in range(voltages)]},
            "direction": WAYS,
        },
        order={"session": ["method"], "sets": sets, "repetitions": repetitions, "balance": balance},
    )
    each = 2 * voltages
    possible = each * repetitions % sets == 0 and (balance != "set-exact" or repetitions % sets == 0)
    if not possible:
        with pytest.raises(ConfigError, match="nearest"):
            plan_of(config, "P01", seed)
        return
    plan = plan_of(config, "P01", seed)
    assert len(plan.trials) == 2 * each * repetitions
    for trials in by_place(plan):
        assert set(held(trials, "voltage_V", "direction").values()) == {repetitions}
        assert len({trial.level("method") for trial in trials}) == 1
    for trials in by_place(plan, sets=True):
        counts = held(trials, "voltage_V", "direction")
        assert len(trials) == each * repetitions // sets
        if balance != "session":
            assert max(counts.values()) - min((*counts.values(), *[0] * (len(counts) < each))) <= 1
        if balance == "set-exact":
            assert set(counts.values()) == {repetitions // sets}
            assert len(counts) == each


@pytest.mark.slow
@given(
    most=st.integers(1, 4),
    repetitions=st.integers(2, 12),
    sets=st.sampled_from([1, 2]),
    seed=st.integers(0, 2**63 - 1),
)
def test_no_level_follows_itself_more_often_than_is_allowed(most, repetitions, sets, seed):
    assume(repetitions % sets == 0)
    config = design(
        factors={"method": {"levels": ["a"]}, "direction": WAYS},
        order={"repetitions": repetitions, "sets": sets, "balance": "set", "longest_run": {"direction": most}},
    )
    plan = plan_of(config, "P01", seed)
    runs = [len(list(run)) for _, run in groupby(plan.trials, lambda trial: trial.level("direction"))]
    assert max(runs) <= most
    assert set(held(plan.trials, "direction").values()) == {repetitions}


def test_a_run_that_no_order_keeps_is_refused():
    config = design(
        factors={"method": {"levels": ["a"]}, "direction": {"levels": ["forward"]}},
        order={"repetitions": 3, "longest_run": {"direction": 2}},
    )
    with pytest.raises(ConfigError, match="longest_run"):
        plan_of(config, "P01", 1)


@given(count=st.integers(2, 5), repetitions=st.integers(1, 5), seed=st.integers(0, 2**63 - 1))
def test_pairs_are_all_there_and_each_comes_first_as_often_as_it_gets(count, repetitions, seed):
    methods = [f"m{at}" for at in range(count)]
    config = design(
        factors={"method": {"levels": methods}},
        order={"repetitions": repetitions},
        trial={"kind": "pair", "compare": "method"},
        questions={"preferred": {"kind": "choice", "text": "Which?", "answers": ["first", "second"]}},
    )
    plan = plan_of(config, "P01", seed)
    assert len(plan.trials) == comb(count, 2) * repetitions
    pairs = Counter(trial.intervals for trial in plan.trials)
    for (one, other), times in pairs.items():
        assert times + pairs[other, one] == repetitions
        assert abs(times - pairs[other, one]) == repetitions % 2


@pytest.mark.parametrize(("kind", "forms"), [("two-interval", 2), ("abx", 4), ("oddity", 3)])
@pytest.mark.parametrize("repetitions", [1, 4, 7, 12])
def test_the_comparison_is_in_every_place_as_often_as_it_gets(kind, forms, repetitions):
    answers = {"two-interval": ["first", "second"], "abx": ["a", "b"], "oddity": ["first", "second", "third"]}[kind]
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [12.0, 20.0]}},
        order={"repetitions": repetitions},
        trial={"kind": kind, "compare": "voltage_V", "standard": 16.0},
        questions={"answer": {"kind": "choice", "text": "Which?", "answers": answers, "correct": "interval"}},
    )
    plan = plan_of(config, "P01", 3)
    for level in (12.0, 20.0):
        of_it = [trial for trial in plan.trials if trial.level("voltage_V") == level]
        found = Counter((trial.intervals, trial.odd) for trial in of_it)
        assert sum(found.values()) == repetitions
        assert max(found.values()) - min((*found.values(), *[0] * (len(found) < forms))) <= 1
    for trial in plan.trials:
        at = trial.odd if kind != "abx" else 2
        assert trial.intervals[at] == (trial.level("voltage_V") if kind != "abx" else trial.intervals[trial.odd])
        assert {*trial.intervals} == {16.0, trial.level("voltage_V")}


UP_DOWN = {"kind": "up-down", "of": ["voltage_V"], "starts": [20.0], "steps": [2.0], "trials": 12}


@pytest.mark.parametrize(("standard_interval", "standard_at"), [("first", 0), ("second", 1)])
@pytest.mark.parametrize("chosen", [{}, {"procedure": UP_DOWN}])
def test_a_standard_with_an_interval_of_its_own_is_always_there(standard_interval, standard_at, chosen):
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [12.0, 14.0, 16.0, 18.0, 20.0]}},
        order={"repetitions": 1 if chosen else 3},
        trial={
            "kind": "two-interval",
            "compare": "voltage_V",
            "standard": 16.0,
            "standard_interval": standard_interval,
        },
        questions={
            "answer": {"kind": "choice", "text": "?", "answers": ["first", "second"], "correct": "larger"},
        },
        **chosen,
    )
    for seed in range(5):
        trials = plan_of(config, "P01", seed).trials
        assert len(trials) == (12 if chosen else 15)
        assert {trial.intervals[standard_at] for trial in trials} == {16.0}
        assert {trial.odd for trial in trials} == {1 - standard_at}


def test_a_nested_factor_has_the_levels_of_the_one_that_it_is_nested_in():
    config = design(
        factors={
            "method": {"levels": ["a", "b"]},
            "voltage_V": {"within": "method", "levels": {"a": [10.0], "b": [12.0, 14.0]}},
        },
        order={"session": ["method"], "repetitions": 2},
    )
    plan = plan_of(config, "P01", 1)
    assert held(plan.trials, "method", "voltage_V") == {("a", 10.0): 2, ("b", 12.0): 2, ("b", 14.0): 2}


def test_groups_are_the_combinations_of_what_varies_between_people():
    config = design(
        factors={
            "method": {"levels": ["a", "b"]},
            "grip": {"levels": ["one", "two"], "between": True},
        }
    )
    assert groups(config) == [(("grip", "one"),), (("grip", "two"),)]
    for group, grip in enumerate(("one", "two")):
        assert held(plan_of(config, "P01", 1, group=group).trials, "grip") == {(grip,): 2}
    with pytest.raises(ConfigError, match="group = 2"):
        plan_of(config, "P01", 1, group=2)


@pytest.mark.parametrize("order", ["latin-square", "williams"])
def test_a_square_has_each_session_at_each_place_equally_often(order):
    config = design(factors={"method": {"levels": ["a", "b", "c"]}}, order={"session": ["method"], "sessions": order})
    rows = [plan_of(config, "P01", 1, row=row) for row in range(square_size(config))]
    for place in range(3):
        assert len(set(Counter(plan.trials[place].level("method") for plan in rows).values())) == 1
    with pytest.raises(ConfigError, match="order_row"):
        plan_of(config, "P01", 1, row=len(rows))


def test_instructions_share_the_sets_equally_or_the_nearest_numbers_are_named():
    texts = {"speed": "Be fast.", "accuracy": "Be sure."}
    factors = {"method": {"levels": ["a"]}, "instruction": {"levels": [*texts], "texts": texts}, "direction": WAYS}
    config = design(factors=factors, order={"set": ["instruction"], "sets": 4, "repetitions": 4})
    sets = by_place(plan_of(config, "P01", 1), sets=True)
    assert Counter(trials[0].level("instruction") for trials in sets) == {"speed": 2, "accuracy": 2}
    assert all(len(held(trials, "instruction")) == 1 for trials in sets)
    with pytest.raises(ConfigError, match="nearest: 2 or 6"):
        plan_of(design(factors=factors, order={"set": ["instruction"], "sets": 3, "repetitions": 3}), "P01", 1)


def test_catch_trials_have_no_level_that_varies():
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [9.0, 10.0]}},
        order={"repetitions": 5},
        trial={"catch": 4},
        questions={"felt": {"kind": "yes-no", "text": "Was there one?", "correct": "stimulus"}},
    )
    plan = plan_of(config, "P01", 1)
    caught = [trial for trial in plan.trials if trial.catch]
    assert len(caught) == 4
    assert all(trial.levels == (("method", "a"),) for trial in caught)


@pytest.mark.slow
@given(seed=st.integers(0, 2**63 - 1), code=st.from_regex(r"[A-Za-z0-9]{1,8}", fullmatch=True))
def test_the_same_comes_again_and_reads_back(seed, code):
    config = design(
        factors={"method": {"levels": ["a", "b"]}, "direction": WAYS}, order={"session": ["method"], "repetitions": 3}
    )
    plan = plan_of(config, code, seed)
    assert plan == plan_of(config, code, seed)
    assert Plan.from_record(plan.record()) == plan
    assert Plan.from_record(plan.record()).sha256() == plan.sha256()


def test_the_order_of_one_factor_does_not_hang_on_what_another_one_is_called():
    plans = [
        plan_of(
            design(
                factors={
                    "method": {"levels": ["a", "b", "c"]},
                    name: WAYS if name == "direction" else {"levels": ["x", "y"]},
                },
                order={"session": ["method"], "repetitions": 3},
            ),
            "P01",
            7,
        )
        for name in ("direction", "grip")
    ]
    first, second = ([trials[0].level("method") for trials in by_place(plan)] for plan in plans)
    assert first == second


def test_cells_are_every_combination_in_the_order_of_the_file():
    config: DesignConfig = design(factors={"method": {"levels": ["a", "b"]}, "direction": WAYS})
    assert cells(config, ["direction", "method"]) == [
        (("method", method), ("direction", way)) for way in WAYS["levels"] for method in ("a", "b")
    ]
