"""What was told of a run so far, in order, and of each of its trials. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.design.plan import Trial
from experiments.session.remarks import Remark
from experiments.session.steps import Failed, Fire, Interrupted, Outcome, Present, Repeat, Step, trial_of

Word = TypeVar("Word")

Told = Sequence[tuple[Step | None, Outcome | Remark]]
"""What a journal tells, in order: steps with their outcomes, and remarks, which have no step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Story:
    """What the journal tells of one trial, in order, and whether it was asked to be repeated."""

    events: list[tuple[Step | None, Outcome | Remark]]
    repeated: bool

    @property
    def words(self) -> list[Outcome | Remark]:
        """The outcomes and remarks, in order."""
        return [word for _, word in self.events]

    def all(self, kind: type[Word]) -> list[Word]:
        """The outcomes or remarks of a kind."""
        return [word for word in self.words if isinstance(word, kind)]

    def last(self, kind: type[Word]) -> Word | None:
        """The last outcome or remark of a kind."""
        return next(reversed(self.all(kind)), None)


def stories(trials: Sequence[Trial], told: Told) -> dict[Trial, Story]:
    """What the journal tells, by trial."""
    repeated = {word.trial for _, word in told if isinstance(word, Repeat)}
    found = {trial: Story(events=[], repeated=trial in repeated) for trial in trials}
    for step, word in told:
        trial = _trial(step, word)
        if trial is not None:
            found[trial].events.append((step, word))
    return found


def _trial(step: Step | None, word: Outcome | Remark) -> Trial | None:
    """The trial that an event is about, if it is about one."""
    return getattr(word, "trial", None) if step is None else trial_of(step)


def is_attempt(step: Step | None, word: Outcome | Remark) -> bool:
    """Whether a stimulus was felt, or may have been: what `attempts` counts."""
    return isinstance(step, Fire | Present) and not (isinstance(word, Failed | Interrupted) and not word.presented)
