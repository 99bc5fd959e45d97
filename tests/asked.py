"""What is asked of a participant, as tests put it: which way, how much, and why."""

from __future__ import annotations

from experiments.design.plan import Trial
from experiments.session.steps import Ask, Describe, Rate
from experiments.tasks.questions import choices_of

WAYS = choices_of({"forward": "forward", "backward": "backward"}, {"forward": "up", "backward": "down"})
"""The answers of the first experiment, with the keys f and b, and the arrows."""


def ask(trial: Trial) -> Ask:
    """Which way did it shoot?"""
    return Ask(trial=trial, question="response", text="Which way?", choices=WAYS)


def rate(trial: Trial) -> Rate:
    """From 0 to 10, after all were felt."""
    return Rate(
        trial=trial,
        question="rating",
        text="?",
        minimum=0,
        maximum=10,
        minimum_text="low",
        maximum_text="high",
        grain=0.1,
        later=True,
    )


def describe(trial: Trial) -> Describe:
    """In words, after all were felt."""
    return Describe(trial=trial, question="comment", text="?", later=True)
