"""Designs at random: each is refused in words, or planned, and then it keeps what it states."""

from __future__ import annotations

from collections import Counter
from itertools import groupby

import pytest
from hypothesis import given, settings

from experiments.config.door import ConfigError
from experiments.design.limits import limits
from experiments.design.plan import Plan
from experiments.design.planned import planned_run
from experiments.design.planning import groups, plan_of, square_size
from experiments.load import load_gun, shipped_folder
from experiments.record.design_columns import columns
from experiments.record.design_table import design_rows
from experiments.record.tables import table_bytes
from experiments.session.steps import Interrupted
from experiments.tasks.questions import answer_keys, right_answer
from tests.designs import design
from tests.driven_designs import driven, session_of
from tests.random_designs import tables

GUN = load_gun(shipped_folder() / "gun.toml")


def planned_from(given_tables):
    """The design and its plan; `None` if it was refused in words."""
    try:
        config = design(**given_tables)
        rows = square_size(config)
        return config, plan_of(config, "P01", 5, row=rows - 1 if rows else None, group=len(groups(config)) - 1)
    except ConfigError as refused:
        return None if str(refused).strip() else pytest.fail("it was refused without a word")


def check(given_tables):
    found = planned_from(given_tables)
    if found is None:
        return False
    config, plan = found
    assert Plan.from_record(plan.record()) == plan
    names = [column.name for column in columns(config)]
    assert len(names) == len(set(names))
    assert planned_run(config, plan).trials == len(plan.trials)
    for _, some in groupby(plan.trials, lambda trial: trial.session):
        check_session(config, list(some))
    check_right_answers(config, plan)
    check_run(config, plan)
    return True


def check_session(config, trials):
    order, compared = config.order, config.trial.compare if config.trial.kind == "pair" else None
    varying = [name for name in config.varying if name != compared]
    assert [trial.trial for trial in trials] == list(range(1, len(trials) + 1))
    for name in (*order.session, *config.between):
        assert len({trial.level(name) for trial in trials}) == 1
    assert len(set(Counter(trial.set for trial in trials).values())) == 1
    real = [trial for trial in trials if not trial.catch]
    assert set(Counter(condition(trial, varying, compared) for trial in real).values()) == {order.repetitions}
    assert len(trials) - len(real) == config.trial.catch
    for name, most in order.longest_run.items():
        assert longest_run(trials, name) <= most
    if order.balance == "set-exact":
        check_sets(real, varying, compared)


def longest_run(trials, name):
    return max(len(list(run)) for _, run in groupby(trials, lambda trial: trial.level(name)))


def condition(trial, varying, compared):
    """The levels of a trial, and its pair."""
    pair = tuple(sorted(map(str, trial.intervals))) if compared else ()
    return tuple((name, trial.level(name)) for name in varying), pair


def check_sets(trials, varying, compared):
    for _, some in groupby(trials, lambda trial: trial.set):
        assert len(set(Counter(condition(trial, varying, compared) for trial in some).values())) == 1


def check_right_answers(config, plan):
    for question in config.questions.values():
        assert set(answer_keys(question)) == set(question.named_answers)
        for trial in plan.trials:
            right = right_answer(config, question, trial)
            assert right is None or right in question.named_answers


def check_run(config, plan):
    """Worked to its end it has all answers, also if it breaks off anywhere; what was done before is done again."""
    try:
        limits(config, GUN)
    except ConfigError:  # the gun cannot: test_stimuli has its words
        return
    whole = list(driven(session_of(config, GUN, plan)))
    check_rows(config, plan, whole)
    for part in range(5):
        place = (plan.seed * 31 + part * len(whole)) // 5 % len(whole)
        outcomes = [outcome for _, outcome in whole[:place]]
        assert list(driven(session_of(config, GUN, plan), *outcomes)) == whole
        broken = list(driven(session_of(config, GUN, plan), *outcomes, Interrupted(presented=True)))
        assert [step for step, _ in broken[: place + 1]] == [step for step, _ in whole[: place + 1]]
        check_rows(config, plan, broken)


def check_rows(config, plan, told):
    rows = design_rows(plan, told, config)
    table = columns(config)
    assert {name for row in rows for name in row} >= {column.name for column in table if column.required}
    assert len(table_bytes(table, rows).splitlines()) >= len(rows) + 1
    for row in rows:
        assert all(row.get(name) is not None for name in config.questions)
        assert row["attempts"] >= 1


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(tables())
def test_a_design_is_refused_in_words_or_planned_as_it_states(given_tables):
    check(given_tables)


@pytest.mark.soak
def test_two_thousand_designs_are_refused_in_words_or_planned_as_they_state():
    planned = Counter()

    @settings(max_examples=2000, deadline=None)
    @given(tables())
    def all_of_them(given_tables):
        planned[check(given_tables)] += 1

    all_of_them()
    assert planned[True] >= 100
