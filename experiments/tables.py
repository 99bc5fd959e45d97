"""Log tables made of what a journal holds: pure, so that a table can be made again byte for byte."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from experiments import columns
from experiments.plan import Trial
from experiments.steps import Failed, Fire, Fired, History, Interrupted, Outcome, Present, Presented, Rest

Row = dict[str, object]


def where(history: History, trial: Trial) -> History:
    """The part of a history that belongs to one trial."""
    return [(step, outcome) for step, outcome in history if not isinstance(step, Rest) and step.trial == trial]


def presentation(history: History, shown: type[Fired | Presented]) -> Row:
    """How a trial was presented: attempts, flags, onset of the last stimulus, gun. Empty if it never was."""
    attempts = sum(isinstance(step, Fire | Present) and not _unfelt(outcome) for step, outcome in history)
    stimuli = [outcome for _, outcome in history if isinstance(outcome, shown)]
    row: Row = {"attempts": attempts or None, "flags": " ".join(_flags(history))}
    if stimuli:
        row |= {"onset_utc": stimuli[-1].onset_utc, "gun": stimuli[-1].gun}
    return row


def _unfelt(outcome: Outcome) -> bool:
    return isinstance(outcome, Interrupted) and not outcome.presented


def _flags(history: History) -> list[str]:
    """What went wrong with the stimulus on the way, each once."""
    outcomes = [outcome for _, outcome in history]
    failed = any(isinstance(outcome, Failed) for outcome in outcomes)
    interrupted = any(isinstance(outcome, Interrupted) and outcome.presented for outcome in outcomes)
    return ["device-error"] * failed + ["interrupted"] * interrupted


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
