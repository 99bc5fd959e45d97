"""What was done in a run so far, what became of each trial, and what of it can be corrected or repeated. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import UnionType
from typing import Literal, TypeVar

from experiments.design.plan import Plan, Trial
from experiments.session import steps
from experiments.session.remarks import AnswerCorrected, DescriptionCorrected, RatingCorrected, Remark

Word = TypeVar("Word")

History = Sequence[tuple[steps.Step | None, steps.Outcome | Remark]]
"""What a journal tells, in order: steps with their outcomes, and remarks, which have no step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialHistory:
    """What the journal tells of one trial, in order, and whether it was asked to be repeated."""

    items: list[tuple[steps.Step | None, steps.Outcome | Remark]]
    repeated: bool

    @property
    def words(self) -> list[steps.Outcome | Remark]:
        """The outcomes and remarks, in order."""
        return [word for _, word in self.items]

    def all(self, kind: type[Word]) -> list[Word]:
        """The outcomes or remarks of a kind."""
        return [word for word in self.words if isinstance(word, kind)]

    def last(self, kind: type[Word]) -> Word | None:
        """The last outcome or remark of a kind."""
        return next(reversed(self.all(kind)), None)


def by_trial(trials: Sequence[Trial], history: History) -> dict[Trial, TrialHistory]:
    """What the journal tells, by trial."""
    repeated = {word.trial for _, word in history if isinstance(word, steps.Repeated)}
    found = {trial: TrialHistory(items=[], repeated=trial in repeated) for trial in trials}
    for step, word in history:
        trial = _trial(step, word)
        if trial is not None:
            found[trial].items.append((step, word))
    return found


def _trial(step: steps.Step | None, word: steps.Outcome | Remark) -> Trial | None:
    """The trial that an event is about, if it is about one."""
    return getattr(word, "trial", None) if step is None else steps.trial_of(step)


def is_attempt(step: steps.Step | None, word: steps.Outcome | Remark) -> bool:
    """Whether a stimulus was felt, or may have been: what `attempts` counts."""
    return isinstance(step, steps.FireShot | steps.Present) and not (
        isinstance(word, steps.Failed | steps.Interrupted) and not word.presented
    )


What = Literal["answer", "rating", "description"]
Value = str | float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Something that was entered for a trial."""

    trial: Trial
    what: What


def trial_at(plan: Plan, history: History, step: steps.Step | None) -> Trial:
    """The trial of a step; if it has none, of the last step that has one; else the first of the plan."""
    backwards = (step, *(one for one, _ in reversed(history)))
    return next((trial for one in backwards if (trial := steps.trial_of(one)) is not None), plan.trials[0])


def entries(history: History, here: Trial) -> list[Entry]:
    """What was entered in the set of a trial, in order: what can be corrected.

    What is entered anew, because its trial was presented again, stands where it was entered first.
    """
    found = (entry for step, word in history if (entry := _entry(step, word)) is not None)
    return [entry for entry in dict.fromkeys(found) if of_one_set(entry.trial, here)]


def _entry(step: steps.Step | None, word: steps.Outcome | Remark) -> Entry | None:
    trial = steps.trial_of(step)
    if trial is None:
        return None
    match word:
        case steps.Answered():
            return Entry(trial=trial, what="answer")
        case steps.Rated():
            return Entry(trial=trial, what="rating")
        case steps.Described():
            return Entry(trial=trial, what="description")
        case _:
            return None


def fits(entry: Entry, value: Value) -> bool:
    """Whether a value is of an entry's kind."""
    match entry.what:
        case "answer":
            return value in ("forward", "backward")
        case "rating":
            return value is None or isinstance(value, float)
        case "description":
            return isinstance(value, str)


def entered_value(history: History, entry: Entry) -> Value:
    """What an entry says, as it counts: the last that was entered. `None`: no answer."""
    said = [_value(step, word, entry) for step, word in history]
    return next((one[0] for one in reversed(said) if one), None)


def _value(step: steps.Step | None, word: steps.Outcome | Remark, entry: Entry) -> tuple[Value] | None:
    if isinstance(word, AnswerCorrected | RatingCorrected | DescriptionCorrected):
        return _corrected(word, entry)
    return _given(word) if _entry(step, word) == entry else None


def _corrected(word: AnswerCorrected | RatingCorrected | DescriptionCorrected, entry: Entry) -> tuple[Value] | None:
    match word:
        case _ if word.trial != entry.trial:
            return None
        case AnswerCorrected() if entry.what == "answer":
            return (word.response,)
        case RatingCorrected() if entry.what == "rating":
            return (word.rating,)
        case DescriptionCorrected() if entry.what == "description":
            return (word.comment,)
        case _:
            return None


def _given(word: steps.Outcome | Remark) -> tuple[Value] | None:
    match word:
        case steps.Answered():
            return (word.response,)
        case steps.Rated():
            return (word.rating,)
        case steps.Described():
            return (word.comment,)
        case _:
            return None


def repeatable(history: History, step: steps.Step | None, here: Trial) -> Trial | None:
    """The trial that can be presented again: the one that is asked about, else the last of the set.

    It can be as long as its rating is not in.
    """
    if isinstance(step, steps.Ask | steps.Rate):
        return step.trial
    rated, shown = _trials(history, steps.Rated), _trials(history, steps.Answered | steps.Presented)
    return next((trial for trial in reversed(shown) if of_one_set(trial, here) and trial not in rated), None)


def done(history: History) -> set[Trial]:
    """The trials that were answered, or felt until next."""
    return set(_trials(history, steps.Answered | steps.Presented))


def answered(history: History) -> set[Trial]:
    """The trials that were answered or rated, whatever became of the answer."""
    return set(_trials(history, steps.Answered | steps.Rated))


def _trials(history: History, outcomes: type[steps.Outcome] | UnionType) -> list[Trial]:
    """The trials that came to such outcomes, in order."""
    return [trial for step, word in history if isinstance(word, outcomes) and (trial := steps.trial_of(step))]


def of_one_set(one: Trial, other: Trial) -> bool:
    """Whether two trials are of one set."""
    return (one.session, one.set) == (other.session, other.set)
