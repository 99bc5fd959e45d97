"""What is asked: keys, what may be answered, what is right, and the columns that keep it."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.config.door import ConfigError
from experiments.design.language import QuestionConfig
from experiments.design.planning import plan_of
from experiments.record import design_columns, tables
from experiments.tasks import questions
from tests.designs import design

WAYS = ["forward", "backward"]


def question(**keys):
    return design(questions={"q": {"text": "?", **keys}}).questions["q"]


@given(
    st.lists(st.text(st.characters(categories=["L", "N"]), min_size=1, max_size=6), min_size=2, max_size=9, unique=True)
)
def test_every_answer_has_a_key_of_its_own_in_any_alphabet(labels):
    names = tuple(f"a{place}" for place in range(len(labels)))
    asked = QuestionConfig(kind="choice", text="?", answers=names, labels=dict(zip(names, labels, strict=True)))
    keys = questions.answer_keys(asked)
    assert tuple(keys) == names
    assert len(set(keys.values())) == len(names)
    assert all(key.isascii() and key.isalnum() for key in keys.values())


def test_keys_follow_the_labels_and_the_owner():
    ways = {"answers": WAYS, "kind": "choice"}
    assert questions.answer_keys(question(**ways)) == {"forward": "f", "backward": "b"}
    german = question(**ways, labels={"forward": "vorwärts", "backward": "rückwärts"})
    assert questions.answer_keys(german) == {"forward": "v", "backward": "r"}
    assert questions.answer_keys(question(**ways, keys={"backward": "f"})) == {"forward": "o", "backward": "f"}
    japanese = question(**ways, labels={"forward": "前", "backward": "後"})
    assert questions.answer_keys(japanese) == {"forward": "1", "backward": "2"}


def labelled(*labels):
    """The experimenter's keys of answers with these labels, one a letter."""
    names = tuple(f"a{place}" for place in range(len(labels)))
    asked = QuestionConfig(kind="choice", text="?", answers=names, labels=dict(zip(names, labels, strict=True)))
    return "".join(one.key for one in questions.choices(asked))


def test_a_key_is_of_the_word_that_tells_an_answer_from_the_others_and_never_of_an_article():
    assert labelled("a kick", "a push", "the buzz", "an echo") == "kpbe"
    assert labelled("X was A", "X was B") == "ab"
    assert labelled("a little stronger", "a little weaker") == "sw"
    assert labelled("a", "the") == "at"


def test_no_key_is_given_to_one_answer_that_begins_a_word_of_another_if_there_is_a_better_one():
    assert labelled("a kick", "a knock", "a push", "a tap", "a buzz", "nothing") == "koptbn"
    assert labelled("0", "1", "2", "10") == "0123"  # of levels by number each has its own
    assert labelled("12 V", "16 V", "20 V") == "162"


@pytest.mark.parametrize(
    ("kind", "standard", "correct", "answers"),
    [
        ("two-interval", 16.0, "larger", ["first", "second"]),
        ("two-interval", 16.0, "interval", ["first", "second"]),
        ("two-interval", "none", "interval", ["first", "second"]),
        ("abx", 16.0, "interval", ["a", "b"]),
        ("oddity", 16.0, "interval", ["first", "second", "third"]),
    ],
)
def test_what_is_right_of_several_intervals_follows_from_what_they_held(kind, standard, correct, answers):
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [12.0, 20.0]}},
        order={"repetitions": 12},
        trial={"kind": kind, "compare": "voltage_V", "standard": standard},
        questions={"q": {"kind": "choice", "text": "?", "answers": answers, "correct": correct}},
    )
    asked, found = config.questions["q"], Counter()
    for trial in plan_of(config, "P01", 1).trials:
        right = questions.right_answer(config, asked, trial)
        found[right] += 1
        if correct == "larger":
            assert trial.intervals[answers.index(right)] == max(trial.intervals)
        elif kind == "abx":
            assert trial.intervals[answers.index(right)] == trial.intervals[2]
        else:
            assert Counter(trial.intervals)[trial.intervals[answers.index(right)]] == 1
            assert trial.intervals[answers.index(right)] == trial.level("voltage_V")
    assert set(found.values()) == {24 // len(answers)}
    assert questions.chance(asked) == 1 / len(answers)


def test_equal_levels_have_no_larger_one():
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [16.0]}},
        trial={"kind": "two-interval", "compare": "voltage_V", "standard": 16.0},
        questions={"q": {"kind": "choice", "text": "?", "answers": ["first", "second"], "correct": "larger"}},
    )
    (trial,) = plan_of(config, "P01", 1).trials
    assert questions.right_answer(config, config.questions["q"], trial) is None
    assert questions.is_right(config, config.questions["q"], trial, "first") is None


def test_catch_trials_are_answered_right_with_no():
    config = design(
        trial={"catch": 2},
        factors={"method": {"levels": ["a"]}},
        order={"repetitions": 2},
        questions={"felt": {"kind": "yes-no", "text": "?", "correct": "stimulus"}},
    )
    felt = config.questions["felt"]
    for trial in plan_of(config, "P01", 1).trials:
        assert questions.is_right(config, felt, trial, "no") is trial.catch
        assert questions.is_right(config, felt, trial, None) is None


@given(st.floats(-5, 15), st.sampled_from([0.1, 0.25, 0.5, 1.0]))
def test_a_rating_is_the_nearest_grain_of_its_scale(value, grain):
    kept = questions.on_scale(value, question(kind="rating", minimum=0.0, maximum=10.0, grain=grain).scale)
    assert 0 <= kept <= 10
    assert abs(kept - min(max(value, 0), 10)) <= grain / 2 + 1e-9
    assert abs(kept / grain - round(kept / grain)) < 1e-9


def test_the_papers_two_tables_have_their_columns():
    ways = {"kind": "choice", "text": "?", "answers": WAYS, "correct": "direction"}
    config = design(
        design="direction",
        factors={"method": {"levels": ["a", "b"]}, "direction": {"levels": WAYS}},
        order={"session": ["method"]},
        questions={"response": ways},
    )
    assert [one.name for one in design_columns.columns(config)] == tables.names("direction")[
        :-1
    ]  # instructions: a factor
    scale = {"kind": "rating", "text": "?", "minimum": 0.0, "maximum": 10.0, "grain": 0.1, "when": "block"}
    config = design(
        design="preference",
        table="ratings",
        factors={"method": {"levels": ["a", "b"]}},
        trial={"kind": "train"},
        questions={"rating": scale, "comment": {"kind": "text", "text": "?", "when": "block"}},
    )
    assert [one.name for one in design_columns.columns(config)] == tables.names("preference")


def test_no_two_columns_of_a_table_have_one_name():
    config = design(
        factors={"method": {"levels": ["a"]}, "voltage_V": {"levels": [12.0]}},
        trial={"kind": "two-interval", "compare": "voltage_V", "standard": 16.0},
        questions={
            name: {"kind": "choice", "text": "?", "answers": ["first", "second"], "correct": "larger"}
            for name in ("q", "r")
        },
    )
    names = [one.name for one in design_columns.columns(config)]
    assert len(names) == len(set(names))
    assert {"voltage_V", "voltage_V_1", "voltage_V_2", "q", "correct", "r", "r_correct", "r_time_s"} <= set(names)


@pytest.mark.parametrize("name", ["trial", "participant_id", "gun", "q_time_s", "correct"])
def test_names_that_would_be_two_columns_are_refused(name):
    ways = {"kind": "choice", "text": "?", "answers": WAYS}
    with pytest.raises(ConfigError, match=name):
        design(questions={"q": ways, name: {"kind": "text", "text": "?"}})
