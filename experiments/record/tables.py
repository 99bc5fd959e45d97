"""Log tables made of what a journal holds: pure, so that a table can be made again byte for byte."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from experiments.record import columns
from experiments.session.history import (
    AnswerCorrected,
    DescriptionCorrected,
    Flagged,
    Noted,
    RatingCorrected,
    Remark,
    TrialHistory,
    is_attempt,
)
from experiments.session.steps import Answered, Described, Failed, Fired, Interrupted, Outcome, Presented, Rated

Row = dict[str, object]


def presentation(events: TrialHistory, shown: type[Fired | Presented]) -> Row:
    """How a trial was presented: attempts, flags, note, onset of the last stimulus, gun. Empty if it never was."""
    attempts = sum(is_attempt(step, word) for step, word in events.items)
    notes = "; ".join(remark.text for remark in events.all(Noted))
    row: Row = {"attempts": attempts or None, "flags": " ".join(_flags(events)), "note": notes}
    stimulus = events.last(shown)
    return row | ({"onset_utc": stimulus.onset_utc, "gun": stimulus.gun} if stimulus else {})


def _flags(events: TrialHistory) -> list[str]:
    """What went wrong with the stimulus on the way, what was changed afterwards, and the experimenter's own marks."""
    found = {
        "device-error": bool(events.all(Failed)),
        "interrupted": any(one.presented and one.cause == "break-off" for one in events.all(Interrupted)),
        "paused": any(one.presented and one.cause == "pause" for one in events.all(Interrupted)),
        "repeated": events.repeated,
        "corrected": any(_is_corrected(events, given) for given in _CORRECTIONS),
    }
    own = [remark.flag for remark in events.all(Flagged)]
    return list(dict.fromkeys([flag for flag, there in found.items() if there] + own))


_CORRECTIONS: dict[type[Outcome], type[Remark]] = {
    Answered: AnswerCorrected,
    Rated: RatingCorrected,
    Described: DescriptionCorrected,
}


def _is_corrected(events: TrialHistory, given: type[Outcome]) -> bool:
    """Whether what counts is a correction: what was entered anew, because its trial was presented again, is none."""
    both = [word for word in events.words if isinstance(word, (given, _CORRECTIONS[given]))]
    return bool(both) and not isinstance(both[-1], given)


def table_bytes(experiment: str, rows: Iterable[Row]) -> bytes:
    """The table as RFC 4180 CSV in UTF-8: CRLF, quotes doubled, text guarded, an empty cell for what is missing."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    table = columns.TABLES[experiment]
    writer.writerow(column.name for column in table)
    writer.writerows([_cell(column, row.get(column.name)) for column in table] for row in rows)
    return text.getvalue().encode()


def _cell(column: columns.Column, value: object) -> str:
    if value is None:
        return columns.MISSING
    if column.type == "text":
        return columns.guard(str(value))
    return repr(value) if isinstance(value, float) else str(value)
