"""The questions of a design: their keys, what may be answered, what is right, and chance. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from string import ascii_lowercase, digits
from typing import Protocol

from experiments.design.config import DesignConfig
from experiments.design.language import (
    INTERVAL_NAMES,
    NO,
    YES,
    QuestionConfig,
    shown_level,
)
from experiments.design.plan import Trial

AnswerValue = str | float | None
"""What was said: a named answer or words, a number, or `None` for no answer. 0 is a rating; words may be empty."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """One of the answers to choose among: what it is called, the experimenter's key for it, and the participant's."""

    answer: str
    label: str
    key: str
    own_key: str

    @property
    def told(self) -> str:
        """What an experimenter reads: the label, and the answer's own name after one without a letter from a to z.

        >>> [one.told for one in choices_of({"forward": "vorwärts", "backward": "向后", "3": "3"}, {})]
        ['vorwärts', '向后 (backward)', '3']
        """
        foreign = self.answer != self.label and not any(letter in ascii_lowercase for letter in self.label.casefold())
        return f"{self.label} ({self.answer})" if foreign else self.label


def choices_of(labels: Mapping[str, str], own_keys: Mapping[str, str]) -> tuple[Choice, ...]:
    """The answers by their labels, the experimenter's keys by `free_keys`.

    >>> [one.key for one in choices_of({"forward": "vorwärts", "backward": "rückwärts"}, {})]
    ['v', 'r']
    """
    keys = free_keys(labels, {}, reserved=CONFIRMS)
    return tuple(
        Choice(answer=answer, label=label, key=keys[answer], own_key=own_keys.get(answer, keys[answer]))
        for answer, label in labels.items()
    )


def choices(question: QuestionConfig) -> tuple[Choice, ...]:
    """The answers of a question to choose among; none of one without."""
    return choices_of({one: question.label(one) for one in question.named_answers}, answer_keys(question))


def first_choices(design: DesignConfig) -> tuple[Choice, ...]:
    """The answers of the first question that has some to choose among; none if there is none."""
    return next(filter(None, map(choices, design.questions.values())), ())


CONFIRMS = "m"
"""The experimenter's key that says that the damper is set: no answer has it, as a second press would say so as well."""


_ARTICLES = frozenset(["a", "an", "the"])


def free_keys(labels: Mapping[str, str], given: Mapping[str, str], *, reserved: str = "") -> dict[str, str]:
    """A key for each answer: the one given, or the first letter of its label that is free, or a digit.

    That of the first word that tells it from the others and is no article; then letters that begin no other's word.

    >>> free_keys({"fast": "fast", "faster": "faster", "1": "№"}, {"fast": "x"})
    {'fast': 'x', 'faster': 'f', '1': '1'}
    >>> free_keys({"kick": "a kick", "knock": "a knock", "nothing": "nothing"}, {})
    {'kick': 'k', 'knock': 'o', 'nothing': 'n'}
    """
    keys = dict(given)
    for answer, label in labels.items():
        if answer not in keys:
            others = {word for other in labels.values() if other != label for word in _words(other)}
            taken = {*keys.values(), *reserved}
            keys[answer] = next(key for key in _wished(_words(label), others) if key not in taken)
    return {answer: keys[answer] for answer in labels}


def _wished(words: Sequence[str], others: Set[str]) -> Iterator[str]:
    """The keys that an answer could have, the best first: its words, and those of the other answers."""
    own = [word for word in words if word not in others] or words
    told = [word for word in own if len(word) > 1 and word not in _ARTICLES] or own
    letters = [letter for word in (*told, *words) for letter in word if letter in _TYPED]
    begun = {word[0] for word in others}
    yield from letters[:1]
    yield from (key for key in (*letters, *_DIGITS, *ascii_lowercase) if key not in begun)
    yield from (*_DIGITS, *ascii_lowercase)


_TYPED, _DIGITS = ascii_lowercase + digits, digits[1:]


def _words(label: str) -> list[str]:
    return re.findall(r"[^\W_]+", label.casefold())


def mistaken_keys(question: QuestionConfig) -> list[tuple[Choice, Choice]]:
    """Answers, each with one whose key it could be taken to have: the key begins a word of its label.

    >>> ways = QuestionConfig(kind="choice", text="?", answers=("kick", "knock", "tap"))
    >>> [(heard.label, pressed.label) for heard, pressed in mistaken_keys(ways)]
    [('knock', 'kick')]
    """
    every = choices(question)
    return [
        (heard, pressed)
        for heard in every
        for pressed in every
        if heard != pressed and any(word.startswith(pressed.key) for word in _words(heard.label))
    ]


def answer_keys(question: QuestionConfig) -> dict[str, str]:
    """The participant's key for each answer: its own, or one by `free_keys`.

    >>> q = QuestionConfig(kind="choice", text="?", answers=("f", "b"), labels={"f": "vorwärts", "b": "rückwärts"})
    >>> answer_keys(q)
    {'f': 'v', 'b': 'r'}
    """
    return free_keys({one: question.label(one) for one in question.named_answers}, question.keys)


def right_answer(design: DesignConfig, question: QuestionConfig, trial: Trial) -> str | None:
    """What is right for a trial; `None` where nothing is, as with equal levels when the larger one is asked for."""
    match question.correct:
        case None:
            return None
        case "stimulus":
            return NO if trial.catch else YES
        case "interval":
            places = ("a", "b") if design.trial.kind == "abx" else INTERVAL_NAMES
            return None if trial.odd is None else places[trial.odd]
        case "larger":
            return _larger(trial)
        case factor:
            level = trial.level(factor)
            return None if level is None else shown_level(level)


def _larger(trial: Trial) -> str | None:
    numbers = [level for level in trial.intervals if isinstance(level, float)]
    if len(numbers) != len(trial.intervals) or numbers.count(max(numbers)) > 1:
        return None
    return INTERVAL_NAMES[numbers.index(max(numbers))]


def chance(question: QuestionConfig) -> float | None:
    """How often who does not know is right; `None` of a question that nothing is right for.

    `None`, too, of stimuli and catch trials: who does not know says yes as often to the ones as to the others, and how
    often that is, is theirs to choose.
    """
    return None if question.correct in {None, "stimulus"} else 1.0 / len(question.named_answers)


class Scale(Protocol):
    """The ends of a scale, and how fine a rating is kept."""

    @property
    def minimum(self) -> float:
        """The lower end."""

    @property
    def maximum(self) -> float:
        """The upper end."""

    @property
    def grain(self) -> float:
        """The distance of two ratings, a part of the scale; 0 where any number will do."""


def on_scale(value: float, scale: Scale) -> float:
    """The nearest value of the scale, in whole grains from its minimum.

    A grain such as 0.1 has no exact binary form; rounding to its decimals gives the number a person would write.
    """
    value = min(max(value, scale.minimum), scale.maximum)
    if not scale.grain:
        return value
    steps = round((value - scale.minimum) / scale.grain)
    decimals = max(0, -math.floor(math.log10(scale.grain))) + 2
    return round(float(scale.minimum + steps * scale.grain), decimals)


def is_right(design: DesignConfig, question: QuestionConfig, trial: Trial, answer: AnswerValue) -> bool | None:
    """Whether an answer is right; `None` without one, or where nothing is right."""
    right = right_answer(design, question, trial)
    return None if right is None or answer is None else answer == right


def is_success(design: DesignConfig, question: QuestionConfig, trial: Trial, answer: AnswerValue) -> bool:
    """Whether an answer is what a psychometric function rises to: yes, “the comparison is larger”, or what is right.

    `trial` is as it was felt.
    """
    if question.kind == "yes-no" and question.correct in (None, "stimulus"):
        return answer == YES
    if question.correct == "larger" and trial.odd is not None:
        return answer == INTERVAL_NAMES[trial.odd]
    return bool(is_right(design, question, trial, answer))


def share_of_first(question: QuestionConfig, answer: AnswerValue) -> float:
    """How much the first of a pair was chosen: 1 by the first answer, 0 by the second, 0.5 by another, a tie.

    >>> q = QuestionConfig(kind="choice", text="?", answers=("this", "that", "neither"))
    >>> [share_of_first(q, answer) for answer in q.answers]
    [1.0, 0.0, 0.5]
    """
    first, second, *_ = question.named_answers
    return {first: 1.0, second: 0.0}.get(str(answer), 0.5)


def correct_columns(questions: Mapping[str, QuestionConfig]) -> dict[str, str]:
    """The column of each scored question that says whether its answer was right: `correct` for the first.

    >>> q = QuestionConfig(kind="yes-no", text="?", correct="stimulus")
    >>> correct_columns({"felt": q, "sure": q})
    {'felt': 'correct', 'sure': 'sure_correct'}
    """
    scored: Sequence[str] = [name for name, one in questions.items() if one.correct is not None]
    return {name: "correct" if place == 0 else f"{name}_correct" for place, name in enumerate(scored)}
