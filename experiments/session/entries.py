"""What was entered in a run so far: what of it can be corrected or presented again. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from experiments.design.plan import Plan, Trial
from experiments.session.history import Told
from experiments.session.remarks import AnswerCorrected, DescriptionCorrected, RatingCorrected, Remark
from experiments.session.steps import Answered, Ask, Described, Outcome, Presented, Rate, Rated, Step, trial_of

What = Literal["answer", "rating", "description"]
Value = str | float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Something that was entered for a trial."""

    trial: Trial
    what: What


def trial_at(plan: Plan, told: Told, step: Step | None) -> Trial:
    """The trial of a step, else the last one that was, else the first."""
    steps = (step, *(one for one, _ in reversed(told)))
    return next((trial for one in steps if (trial := trial_of(one)) is not None), plan.trials[0])


def entries(told: Told, here: Trial) -> list[Entry]:
    """What was entered in the set of a trial, in order: what can be corrected.

    What is entered anew, because its trial was presented again, stands where it was entered first.
    """
    found = (entry for step, word in told if (entry := _entry(step, word)) is not None)
    return [entry for entry in dict.fromkeys(found) if together(entry.trial, here)]


def _entry(step: Step | None, word: Outcome | Remark) -> Entry | None:
    trial = trial_of(step)
    if trial is None:
        return None
    match word:
        case Answered():
            return Entry(trial=trial, what="answer")
        case Rated():
            return Entry(trial=trial, what="rating")
        case Described():
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


def value(told: Told, entry: Entry) -> Value:
    """What an entry says, as it counts: the last that was entered. `None`: no answer."""
    said = [_value(step, word, entry) for step, word in told]
    return next((one[0] for one in reversed(said) if one), None)


def _value(step: Step | None, word: Outcome | Remark, entry: Entry) -> tuple[Value] | None:
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


def _given(word: Outcome | Remark) -> tuple[Value] | None:
    match word:
        case Answered():
            return (word.response,)
        case Rated():
            return (word.rating,)
        case Described():
            return (word.comment,)
        case _:
            return None


def repeatable(told: Told, step: Step | None, here: Trial) -> Trial | None:
    """The trial that can be presented again: the one that is asked about, else the last of the set.

    It can be as long as its rating is not in.
    """
    if isinstance(step, Ask | Rate):
        return step.trial
    rated = {trial_of(one) for one, word in told if isinstance(word, Rated)}
    shown = [trial_of(one) for one, word in told if isinstance(word, Answered | Presented)]
    return next((trial for trial in reversed(shown) if trial and together(trial, here) and trial not in rated), None)


def done(told: Told) -> set[Trial]:
    """The trials that were answered, or felt until next."""
    return {trial for step, word in told if isinstance(word, Answered | Presented) and (trial := trial_of(step))}


def together(one: Trial, other: Trial) -> bool:
    """Whether two trials are of one set."""
    return (one.session, one.set) == (other.session, other.set)
