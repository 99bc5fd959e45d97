"""The log tables: their columns, once, with names, types, levels and meaning, and their rows from a journal. Pure.

Everything that writes, reads or describes a log takes its columns from here; the data dictionary is printed from it.
A table can be made again byte for byte; no text in it becomes a formula.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Literal, TypeVar

from device import twin

ColumnType = Literal["text", "level", "integer", "number", "flag"]

MISSING = ""
"""What an empty cell says: there is none. 0 is a value."""

ANTICIPATION_S = 0.1
"""A key that comes sooner was not pressed for what was felt: simple reactions to touch take longer (assumed)."""

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "'")


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a log table. `levels` are all values a `level` column may hold; empty where the config decides.

    `least` and `most` bound a number, which is a multiple of `grain` above the least, if there is a grain.
    """

    name: str
    type: ColumnType
    description: str
    levels: tuple[str, ...] = ()
    unit: str = ""
    required: bool = False
    least: float | None = None
    most: float | None = None
    grain: float = 0.0


def level_column(name: str, levels: tuple[str, ...], description: str, *, required: bool = False) -> Column:
    """A column of named values."""
    return Column(name=name, type="level", levels=levels, description=description, required=required)


LONGEST_TIME_S = 86_400.0
"""A day: nobody feels, or thinks, for longer (assumed)."""
MOST_OFTEN = 100_000
"""No stimulus is repeated, and no train goes on, for more presentations or shots than this (assumed)."""


def integer_column(
    name: str, description: str, *, required: bool = False, least: float = 1, most: float | None = None
) -> Column:
    """A column of whole numbers, from 1 unless said otherwise."""
    return Column(name=name, type="integer", description=description, required=required, least=least, most=most)


def number_column(name: str, unit: str, description: str) -> Column:
    """A column of numbers in a unit."""
    return Column(name=name, type="number", unit=unit, description=description)


def bounded_column(name: str, description: str, least: float, most: float, grain: float = 0.0) -> Column:
    """A column of numbers on a scale."""
    return Column(name=name, type="number", description=description, least=least, most=most, grain=grain)


def seconds_column(name: str, description: str) -> Column:
    """A column of durations: none is negative."""
    return Column(name=name, type="number", unit="s", description=description, least=0.0, most=LONGEST_TIME_S)


def text_column(name: str, description: str, *, required: bool = False) -> Column:
    """A column of words."""
    return Column(name=name, type="text", description=description, required=required)


def flag_column(name: str, description: str) -> Column:
    """A column of 1 and 0."""
    return Column(name=name, type="flag", levels=("0", "1"), description=description)


PARTICIPANT = text_column("participant_id", "participant's code, letters and digits", required=True)
_METHOD = level_column("method", (), "rendering method, as the config names it", required=True)
_DIRECTION = level_column("direction", ("forward", "backward"), "which way the gun pointed and shot", required=True)
KNOWN_FACTORS = {column.name: column.description for column in (_METHOD, _DIRECTION)}
"""What the factors are that every design knows."""
SET = integer_column("set", "set within the session, from 1", required=True)
HANDS = ("participant", "experimenter", "synthetic")
ATTEMPTS = integer_column(
    "attempts",
    "how often the stimulus was presented; more than 1 after a fault, pause or repeat; answers are to the last one",
    most=MOST_OFTEN,
)
FLAGS = text_column(
    "flags",
    "marks set on the trial, separated by a blank: `device-error`, `interrupted` (the run broke off), `paused`, "
    "`repeated`, `corrected`, `anticipation` (the participant's key within 0.1 s of the onset), `clock-set-back` (the "
    "computer's date and time went back since the trial before), `at-edge` (a procedure chose the end of its levels, "
    "and may have gone on), `track-over` (not presented, or not again: the track had ended), `not-delivered` (a sensor "
    "says so of the last presentation), `key-time-lost` (the program of the participant's screen stood still for more "
    "than 0.1 s as the key went down, or 0.5 s as its question came), and the experimenter's own",
)
TIME_VALID = (
    "1 if the time is the participant's own; 0 if corrected, by the experimenter's hand, over a pause or flagged "
    "`key-time-lost`"
)
NOTE = text_column("note", "the experimenter's note")
ONSET = text_column(
    "onset_utc",
    "date and time (UTC, ISO 8601) of the first pulse of the last presentation; empty if none",
)
GUN = text_column("gun", "who rendered it: model and serial number of the gun, `simulated` for the simulated one")

DataKind = Literal["real", "simulated gun", "synthetic"]
"""Whose data: of people at a gun, of people at a gun that is only simulated, or of synthetic participants."""
_SIMULATED_GUNS = frozenset(["simulated", f"{twin.MODEL}:{twin.SERIAL}"])
"""As they stand in the column `gun`: the simulated gun, and its twin on a line."""


def is_simulated(gun: object) -> bool:
    """Whether a gun by this name is none."""
    return gun in _SIMULATED_GUNS


def data_kind(*, synthetic: bool, simulated: bool) -> DataKind:
    """Whose data they are: did a synthetic participant give any answer, did a simulated gun render any trial?"""
    return "synthetic" if synthetic else "simulated gun" if simulated else "real"


PRESENTATION = (ATTEMPTS, FLAGS, NOTE, ONSET, GUN)
"""How a trial was presented: the last columns of every table."""
REPEATED = "repeated"
"""The flag of a trial that was asked to be presented again."""
CLOCK_SET_BACK = "clock-set-back"
"""The flag of a trial whose stimulus has an earlier date and time than the one before it."""
AT_EDGE = "at-edge"
"""The flag of a trial whose level is the end of those that its procedure can choose."""
TRACK_OVER = "track-over"
"""The flag of a trial that was not presented, or not again, as its track had ended by the answers before."""
EXPOSURE = (
    integer_column("shots", "shots presented until the participant said next", least=0, most=MOST_OFTEN),
    seconds_column("exposure_s", "from the first pulse until the participant said next, at the last presentation"),
    seconds_column(
        "earlier_exposure_s",
        "how long the same trial was felt before, at presentations that a pause ended, that were repeated, or at which "
        "the gun failed or the run, as far as the last shot; empty if it was not",
    ),
)
"""How long a train of shots was felt."""

TRIALS: tuple[Column, ...] = (
    PARTICIPANT,
    level_column("experiment", ("direction",), "which experiment", required=True),
    integer_column("session", "block of trials with one method, 1 to 3 in order of presentation", required=True),
    _METHOD,
    SET,
    integer_column("trial", "trial within the session, from 1", required=True),
    _DIRECTION,
    level_column("response", ("forward", "backward"), "which way the participant said; empty if never answered"),
    flag_column("correct", "1 if the response is the direction, 0 if not; empty without a response"),
    seconds_column("response_time_s", "time from the onset of the pulse to the answer; empty if there is none"),
    level_column("response_source", HANDS, "whose hand gave the answer"),
    flag_column("response_time_valid", TIME_VALID),
    *PRESENTATION,
    level_column(
        "instruction",
        (),
        "what the participant was told for this set (`speed`, `accuracy`, ...), as the config names it; empty if "
        "nothing. Of synthetic people only those with the law `diffusion` heed it",
    ),
)

RATINGS: tuple[Column, ...] = (
    PARTICIPANT,
    level_column("experiment", ("preference",), "which experiment", required=True),
    integer_column("trial", "order of presentation, from 1", required=True),
    _METHOD,
    bounded_column(
        "rating",
        "0 (dislike very much) to 10 (like very much); 0 is a rating, empty means none was given",
        least=0.0,
        most=10.0,
    ),
    level_column("rating_by", HANDS, "whose hand entered the rating"),
    text_column("comment", "the participant's own words"),
    *EXPOSURE,
    *PRESENTATION,
)

TABLES: dict[str, tuple[Column, ...]] = {"direction": TRIALS, "preference": RATINGS}
"""The tables that other programs know by the name of their design."""
MAY_LACK = frozenset(["instruction"])
"""Columns that a design has only if it says so."""

FILE_SUFFIX: dict[str, str] = {"direction": "trials", "preference": "ratings"}
"""How the table's file name ends: `sub-P01_task-direction_trials.csv`."""


def names(experiment: str) -> list[str]:
    """The header of an experiment's table."""
    return [column.name for column in TABLES[experiment]]


def is_rated(experiment: str) -> bool:
    """Whether a table holds ratings; else it holds answers that are right or wrong."""
    return "rating" in names(experiment)


def guard(text: str) -> str:
    """Text that no spreadsheet takes for a formula: a `'` in front of a leading `=`, `+`, `-`, `@`, tab, CR or `'`.

    >>> guard("=1+1"), guard("'quoted"), guard("plain")
    ("'=1+1", "''quoted", 'plain')
    """
    return f"'{text}" if text.startswith(_FORMULA_STARTS) else text


def unguard(cell: str) -> str:
    """The text that `guard` was given.

    >>> unguard("'=1+1"), unguard("''quoted"), unguard("plain")
    ('=1+1', "'quoted", 'plain')
    """
    return cell.removeprefix("'")


Row = dict[str, object]


def table_bytes(table: tuple[Column, ...], rows: Iterable[Row]) -> bytes:
    """The table as RFC 4180 CSV in UTF-8: CRLF, quotes doubled, text guarded, an empty cell for what is missing."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(column.name for column in table)
    writer.writerows([_cell(column, row.get(column.name)) for column in table] for row in rows)
    return text.getvalue().encode()


def _cell(column: Column, value: object) -> str:
    if value is None:
        return MISSING
    if column.type in ("text", "level"):
        return guard(str(value))
    return repr(value) if isinstance(value, float) else str(value)


_Moment = TypeVar("_Moment", str, datetime)


def went_back(rows: Iterable[Mapping[str, object]], moment: Callable[[str], _Moment | None]) -> Iterator[int]:
    """Where the stimulus has an earlier date and time than the last one before: the clock was set back.

    Of adaptive tracks the last one before in the track, as one that goes on after a correction comes late in its set. A
    trial that was repeated may come later than those behind it, so that these are not compared with it.
    """
    before: dict[object, _Moment] = {}
    for place, row in enumerate(rows):
        onset, track = moment(str(row.get("onset_utc") or "")), row.get("track")
        if onset is None:
            continue
        if track in before and onset < before[track]:
            yield place
        if REPEATED not in str(row["flags"] or "").split():
            before[track] = onset
