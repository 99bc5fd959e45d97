"""Log tables made of what a journal holds: pure, so that a table can be made again byte for byte."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.record import columns
from experiments.design.plan import Trial
from experiments.session.remarks import AnswerCorrected, DescriptionCorrected, Flagged, Noted, RatingCorrected, Remark
from experiments.session.steps import (
    Answered,
    Described,
    Failed,
    Fire,
    Fired,
    Interrupted,
    Outcome,
    Present,
    Presented,
    Rated,
    Repeat,
    Step,
    trial_of,
)

Row = dict[str, object]
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


def presentation(story: Story, shown: type[Fired | Presented]) -> Row:
    """How a trial was presented: attempts, flags, note, onset of the last stimulus, gun. Empty if it never was."""
    attempts = sum(is_attempt(step, word) for step, word in story.events)
    notes = "; ".join(remark.text for remark in story.all(Noted))
    row: Row = {"attempts": attempts or None, "flags": " ".join(_flags(story)), "note": notes}
    stimulus = story.last(shown)
    return row | ({"onset_utc": stimulus.onset_utc, "gun": stimulus.gun} if stimulus else {})


def is_attempt(step: Step | None, word: Outcome | Remark) -> bool:
    """Whether a stimulus was felt, or may have been: what `attempts` counts."""
    return isinstance(step, Fire | Present) and not (isinstance(word, Failed | Interrupted) and not word.presented)


def _flags(story: Story) -> list[str]:
    """What went wrong with the stimulus on the way, what was changed afterwards, and the experimenter's own marks."""
    found = {
        "device-error": bool(story.all(Failed)),
        "interrupted": any(one.presented and one.cause == "break-off" for one in story.all(Interrupted)),
        "paused": any(one.presented and one.cause == "pause" for one in story.all(Interrupted)),
        "repeated": story.repeated,
        "corrected": any(_is_corrected(story, given) for given in _CORRECTIONS),
    }
    own = [remark.flag for remark in story.all(Flagged)]
    return list(dict.fromkeys([flag for flag, there in found.items() if there] + own))


_CORRECTIONS: dict[type[Outcome], type[Remark]] = {
    Answered: AnswerCorrected,
    Rated: RatingCorrected,
    Described: DescriptionCorrected,
}


def _is_corrected(story: Story, given: type[Outcome]) -> bool:
    """Whether what counts is a correction: what was entered anew, because its trial was presented again, is none."""
    both = [word for word in story.words if isinstance(word, (given, _CORRECTIONS[given]))]
    return bool(both) and not isinstance(both[-1], given)


def table_bytes(experiment: str, rows: Iterable[Row], without: Sequence[str] = ()) -> bytes:
    """The table as RFC 4180 CSV in UTF-8: CRLF, quotes doubled, text guarded, an empty cell for what is missing.

    Columns `without` are left out.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    table = [column for column in columns.TABLES[experiment] if column.name not in without]
    writer.writerow(column.name for column in table)
    writer.writerows([_cell(column, row.get(column.name)) for column in table] for row in rows)
    return text.getvalue().encode()


def _cell(column: columns.Column, value: object) -> str:
    if value is None:
        return columns.MISSING
    if column.type == "text":
        return columns.guard(str(value))
    return repr(value) if isinstance(value, float) else str(value)
