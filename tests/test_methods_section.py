"""A design in the words of a Methods section."""

from __future__ import annotations

import pytest

from analysis.predict.check_design import check_design
from analysis.summary.designs import summarise
from experiments.config.door import load
from experiments.design.config import DesignConfig
from experiments.design.methods_section import methods_section
from experiments.design.planned import planned_run, runs_of_groups
from experiments.design.planning import plan_of, square_size
from experiments.load import load_gun, load_setup
from tests.designs import changed, design, path_of
from tests.tables_of_designs import loaded, simulated


def said(name):
    config = load(DesignConfig, path_of(name))
    plan = plan_of(config, "P01", 1, row=0 if square_size(config) else None)
    return "\n".join(methods_section(config, [planned_run(config, plan)]))


def test_the_papers_first_experiment_reads_as_in_the_paper():
    assert said("direction") == (
        "Method (vibration, asymmetric-1, asymmetric-2) and direction (forward, backward) varied within participants.\n"
        "There were 3 sessions, each of one method, in random order. In each session every condition came 10 times, in "
        "random order: 20 trials in 4 sets of 5.\n"
        "A trial was one shot. There was no feedback. 1 of each method and direction could be practised first; that "
        "was not analysed.\n"
        "After each trial participants were asked: “Which way did the gun shoot?” (forward or backward).\n"
        "Sets were 20 s apart. Sessions were 300 s apart. The 60 trials were planned to take 30 min."
    )


def test_what_nesting_makes_differ_is_told_of_every_group_and_session():
    nested = design(
        factors={
            "grip": {"levels": ["one", "two"], "between": True},
            "method": {"levels": ["a"]},
            "voltage_V": {"within": "grip", "levels": {"one": [9.0, 12.0], "two": [9.0, 12.0, 16.0]}},
            "direction": {"levels": ["forward", "backward"]},
        },
        order={"session": ["voltage_V"]},
    )
    runs = [planned_run(nested, plan_of(nested, "P01", 1, group=group)) for group in (0, 1)]
    text = "\n".join(methods_section(nested, runs))
    assert "Voltage in V (one: 9, 12; two: 9, 12, 16) and direction" in text
    assert "There were 2 or 3 sessions, each of one voltage in V" in text
    assert "In each session every condition came once, in random order: 2 trials." in text
    assert "The 4 or 6 trials were planned to take 4 or 6 s." in text


def test_methods_are_called_as_the_gun_does_unless_the_design_has_a_label_of_its_own():
    own = design(
        factors={"method": {"levels": ["asymmetric-1", "vibration"], "labels": {"vibration": "Buzz"}}},
        trial={"kind": "oddity", "compare": "method", "standard": "asymmetric-2"},
        questions={"odd": {"kind": "choice", "text": "?", "answers": ["first", "second", "third"]}},
    )
    labels = load_gun(path_of("gun")).labels
    text = "\n".join(methods_section(own, [planned_run(own, plan_of(own, "P01", 1))], labels))
    assert "Method (Asymmetric Force I, Buzz) varied within participants." in text
    assert "two at the standard (method: Asymmetric Force II)" in text
    assert "Method (Asymmetric Force I) was the same" in "\n".join(check_design(load_setup("voltages"), 1, ["P1"]).text)


def test_the_words_for_a_paper_call_methods_as_their_gun_does():
    config, laws = loaded("voltages")
    found = summarise(config, simulated(config, laws, 2), {"asymmetric-1": "Asymmetric Force I"})
    assert "Method (Asymmetric Force I) was the same in all trials." in found.protocol[0]


def test_a_ranking_says_what_rank_1_means():
    ranked = design(
        factors={"method": {"levels": ["a", "b"]}},
        questions={"best": {"kind": "ranking", "text": "Which?", "when": "block", "minimum_text": "most comfortable"}},
    )
    text = "\n".join(methods_section(ranked, [planned_run(ranked, plan_of(ranked, "P01", 1))]))
    assert "“Which?” (an order of the set's trials, 1 = most comfortable)" in text


def test_the_trials_of_one_track_are_told_once():
    one = changed("staircase", order={"sets": 1}, procedure={"starts": (0.008,), "trials": 30, "reversals": 8}).config
    (_, order, *_) = methods_section(one, runs_of_groups(one))
    assert order == "In the session there was one track of at most 30 trials, which ended with reversal 8."


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("preference", "until the participant said next (after 1 s at the earliest, 120 shots at the most)"),
        ("preference", "After a set, about each of its trials, participants were asked: “How much"),
        ("voltages", "Voltage in V (6, 7, 8, 9, 10, 12, 14, 16, 18) and direction (forward, backward) varied"),
        ("voltages", "Method (asymmetric-1) was the same in all trials."),
        ("voltages", "each condition as evenly over the sets as it goes"),
        ("voltages", "No level of direction came more than 4 times in a row."),
        ("detection", "Of the trials of a session 60 were catch trials, without a stimulus."),
        ("stronger", "two shots 1.5 s apart, one at the standard (voltage in V: 14), each equally often first"),
        ("magnitude", "each condition equally often in every set"),
        ("realism", "The experimenter set damper by hand."),
        (
            "realism",
            "2 sessions, each of one damper, in an order balanced over participants by a Latin square.",
        ),
        ("pairs", "that differed in method: all pairs"),
        ("grip", "varied between participants. Grip was shown to the experimenter, who confirmed it."),
        ("grip", "Grip (one hand, two hands) varied between participants."),
        ("hurry", "Instruction was constant in a set."),
    ],
)
def test_what_a_design_does_is_said(name, words):
    assert words in said(name)


def test_of_a_practice_beside_catch_trials_it_is_said_that_it_has_none():
    detection = changed("detection", practice={"repetitions": 2, "of": ("method",)})
    said_of_it = " ".join(methods_section(detection.config, runs_of_groups(detection.config)))
    assert "2 of each method could be practised first; that had no catch trials and was not analysed." in said_of_it
