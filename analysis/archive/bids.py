"""Logs as the files of a BIDS data set of behavioural runs, and what the set says of itself. Pure.

Task and participant stand in the names of the files; every column is described in the data set itself. Nothing that
says when someone came, or in whose words, is in it: times count from the first pulse of a run, ages end at 89, and
free text is left out unless asked for.

Reference: the Brain Imaging Data Structure, version 1.11.1, https://bids-specification.readthedocs.io
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TypedDict, cast

import pandas as pd

from analysis.logs.cell_rules import as_moment
from analysis.logs.reading import Logs
from analysis.logs.texts import Cell
from device.messages import how_many
from experiments.design.units import long_name
from experiments.record import tables
from experiments.record.design_columns import columns
from experiments.record.shots_table import SHOTS
from experiments.record.tables import HANDS, Column, Row
from experiments.study.study import Member

TASKS = {
    "direction": "Two-alternative forced choice: which way did the gun shoot? One session a rendering method, in sets "
    "of trials; the direction of a trial is the one the gun pointed and shot.",
    "preference": "How do you like it? Each rendering method is presented and then rated from 0 (dislike very much) to "
    "10 (like very much).",
}

_LEVELS = {
    "participant": "the participant's own hand",
    "experimenter": "the experimenter's hand",
    "synthetic": "a synthetic participant: a simulation, no person",
    "0": "no",
    "1": "yes",
}
"""What levels mean that do not say it themselves."""

_FORMATS = {"integer": "integer", "number": "number", "flag": "integer", "text": "string", "level": "string"}


class ColumnDescription(TypedDict, total=False):
    """A column as BIDS describes it, in the words of its JSON files."""

    LongName: str
    Description: str
    Format: str
    Units: str
    Levels: dict[str, str]
    Minimum: int
    Maximum: int


_MORE: dict[str, ColumnDescription] = {
    "rating": {"Minimum": 0, "Maximum": 10},
    "onset": {
        "Format": "number",
        "Units": "s",
        "Description": "first pulse of the last presentation, counted from the earliest such pulse of this run; "
        "n/a if none, or once the computer's clock was set back (flag clock-set-back). The log has date and time; "
        "they are left out here",
    },
}
"""What the data dictionary does not say, or says of what stands in the log and not here."""

_EVENT_COLUMNS: dict[str, ColumnDescription] = {
    "onset": {
        "LongName": "Onset",
        "Description": "pulse of the shot, counted as the onsets of this run's trials are; n/a where not known",
        "Format": "number",
        "Units": "s",
    },
    "duration": {
        "LongName": "Duration",
        "Description": "of the shot; n/a, as no sensor measures it",
        "Format": "number",
        "Units": "s",
    },
}
"""The columns that BIDS wants first in a table of events."""

_CLEANED = "line breaks and tabs are blanks, double quotes single ones; a leading = + - @ or ' has a ' in front"

PARTICIPANT_COLUMNS: dict[str, ColumnDescription] = {
    "participant_id": {
        "LongName": "Participant",
        "Description": "sub- and the participant's code, as in the names of folders and files",
        "Format": "string",
    },
    "species": {
        "LongName": "Species",
        "Description": "species of a person who took part; n/a for a synthetic participant, or without any answer",
        "Format": "string",
    },
    "age": {
        "LongName": "Age",
        "Description": "age in whole years when joining; 89 stands for 89 and above; n/a if it was not asked",
        "Format": "integer",
        "Units": "year",
        "Maximum": 89,
    },
    "sex": {
        "LongName": "Sex",
        "Description": "as the participant said; n/a if it was not asked or not disclosed",
        "Format": "string",
        "Levels": {"female": "female", "male": "male", "other": "other"},
    },
    "handedness": {
        "LongName": "Handedness",
        "Description": "as the participant said; n/a if it was not asked",
        "Format": "string",
        "Levels": {"right": "right-handed", "left": "left-handed", "ambidextrous": "uses both hands alike"},
    },
    "synthetic": {
        "LongName": "Synthetic participant",
        "Description": "whether a simulation gave any of the answers; n/a without any answer",
        "Format": "boolean",
        "Levels": {"true": "a simulation answered", "false": "a person answered every time"},
    },
    "group": {
        "LongName": "Group",
        "Description": "the levels of what varied between participants, as the tables of their runs have them; n/a if "
        "they did nothing of the kind; without such a task this column is left out",
        "Format": "string",
    },
}
"""The columns of `participants.tsv`."""

_README = """# {people}{synthetic}

A data set of psychophysics experiments on a haptic gun, written by Recoil (`recoil export bids`) from its logs. It
keeps to the Brain Imaging Data Structure: one folder a participant, one table a run, and beside them the JSON files
that describe every column.

- Participants and tasks stand in the names of the files: `sub-<code>` and `task-<experiment>`.
- `session` is a block of trials with one rendering method. It is no session in the sense of BIDS.
- One row a planned trial, also those that were not reached. `n/a` says that there is no value; 0 is a value.
- Participants who were excluded, practice runs and logs that break a rule are not in it.
- For privacy there are no dates (`onset` counts from the first pulse of the run), and ages above 89 are given as 89.
- {text}
- Where a sensor on the gun measured the shots, `..._events.tsv` has one row a shot.
- Where `gun` says `simulated`, a simulated gun rendered the shots.

Please add what a program cannot know to `dataset_description.json`: Authors, License, Funding, EthicsApprovals. Keys
that are added to it, or to a `task-*_beh.json` (Instructions, InstitutionName), and a Name that was changed stay when
the data set is exported again; everything else, this page too, is then written anew.
"""
_LEFT_OUT = "Free text (notes, and participants' own words) is left out: it might say who someone is."
_LEFT_IN = (
    "Free text (notes, and participants' own words) is in it: read it before you pass the data set on, it might say "
    "who someone is."
)


def described(column: Column, name: str) -> ColumnDescription:
    """A column as BIDS describes it, from the data dictionary. `name` is what it is called in the data set."""
    text = re.sub(r"\bempty\b", "n/a", column.description).replace("`", "'")
    found: ColumnDescription = {
        "LongName": long_name(name),
        "Description": f"{text}; {_CLEANED}" if _is_free_text(column) else text,
        "Format": _FORMATS[column.type],
    }
    if column.unit:
        found["Units"] = column.unit
    if column.levels:
        found["Levels"] = {tables.guard(level): _LEVELS.get(level, level) for level in column.levels}
    return found | _MORE.get(name, {})


def readme(people: int, synthetic: int, *, free_text: bool) -> str:
    """The page of a data set: who is in it, how to read it, what is left out, what to add."""
    simulated = f", {synthetic} of them synthetic: simulations, not people" if synthetic else ""
    text = _LEFT_IN if free_text else _LEFT_OUT
    return _README.format(people=how_many(people, "participant"), synthetic=simulated, text=text)


BIDS_VERSION = "1.11.1"
GENERATOR = "Recoil"
DESCRIPTION = "dataset_description.json"
NOT_AVAILABLE = "n/a"
OLDEST_AGE = 89
"""Ages above are given as this one: people so old are so few that their age might tell who they are."""

_NO_FREE_TEXT = ("participant_id", "flags", "onset_utc", "gun", "status", "method", "because")
_IN_THE_NAME = ("participant_id", "experiment")
_NAMES = {"response_time_s": "response_time", "onset_utc": "onset"}
"""Columns that BIDS has a name for, and what it means by it."""
_SEX = {"female": "female", "male": "male", "other": "other"}
_HANDEDNESS = {"right": "right", "left": "left", "both": "ambidextrous"}
_OURS = re.compile(
    r"README|participants\.(tsv|json)|dataset_description\.json|task-[a-z]+_(?:beh|events)\.json"
    r"|sub-([A-Za-z0-9]+)(/beh(/sub-\2_task-[a-z]+_(?:beh|events)\.tsv)?)?"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One participant's rows of one experiment, with the table's columns; `None` where the log has none."""

    participant_id: str
    experiment: str
    rows: tuple[Mapping[str, Cell], ...]
    columns: tuple[Column, ...]
    task: str
    between: tuple[str, ...] = ()
    """The columns that vary between participants alone."""
    shots: tuple[Row, ...] = ()
    """What a sensor measured of each shot, where there was one."""

    @property
    def group(self) -> str:
        """The participant's levels of what varies between participants; empty if nothing does."""
        return ", ".join(str(self.rows[0][name]) for name in self.between)

    @property
    def hands(self) -> set[str]:
        """Whose hands gave the answers."""
        said = [column.name for column in self.columns if column.levels == HANDS]
        return {str(row[name]) for row in self.rows for name in said if row[name]}


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """The runs that a data set is made of, and what of the logs could not be taken over."""

    runs: tuple[Run, ...]
    problems: tuple[str, ...] = ()

    @property
    def by_code(self) -> dict[str, tuple[Run, ...]]:
        """The runs of each participant, in order of their codes."""
        found: dict[str, tuple[Run, ...]] = {}
        for run in sorted(self.runs, key=lambda run: run.participant_id):
            found[run.participant_id] = (*found.get(run.participant_id, ()), run)
        return found

    @property
    def tasks(self) -> dict[str, Run]:
        """The experiments that anyone has done, each with the first run of it."""
        found: dict[str, Run] = {}
        for run in self.runs:
            found.setdefault(run.experiment, run)
        return found


def is_ours(path: str) -> bool:
    """Whether a path inside a data set, with slashes, is one that an export writes.

    >>> is_ours("sub-P01/beh/sub-P01_task-direction_beh.tsv"), is_ours("derivatives")
    (True, False)
    """
    return bool(_OURS.fullmatch(path))


def runs_of(*logs: Logs, shots: Mapping[tuple[str, str], tuple[Row, ...]] | None = None) -> Runs:
    """The runs in the logs, with what a sensor measured by participant and experiment.

    A code that differs from another in case alone would share its folder: it is left out.
    """
    runs, problems, known = [], list[str](), dict[str, str]()
    for run in (run for part in logs for run in _all_runs(part)):
        first = known.setdefault(run.participant_id.casefold(), run.participant_id)
        if first != run.participant_id:
            rule = f"differs from {first!r} in case alone (rule: one code a participant)"
            problems.append(f"participant {run.participant_id!r}, {run.experiment}: {rule}")
            continue
        runs.append(replace(run, shots=(shots or {}).get((run.participant_id, run.experiment), ())))
    return Runs(runs=tuple(runs), problems=tuple(problems))


def _all_runs(logs: Logs) -> Iterator[Run]:
    for experiment, table in logs.tables.items():
        yield from _runs(experiment, table, tables.TABLES[experiment], TASKS[experiment])
    for one in logs.designs:
        asked = " ".join(question.text for question in one.design.questions.values())
        task = f"{one.design.title.rstrip('.?!')}. {asked}"
        yield from _runs(one.design.design, one.table, columns(one.design), task, one.design.between)


def _runs(
    experiment: str, table: pd.DataFrame, of: tuple[Column, ...], task: str, between: tuple[str, ...] = ()
) -> Iterator[Run]:
    names = [column.name for column in of]
    plain = table[names].astype(object).where(table[names].notna(), None)
    for code, rows in plain.groupby("participant_id", sort=False):
        cells = rows.itertuples(index=False, name=None)
        named = tuple(dict(zip(names, row, strict=True)) for row in cells)
        yield Run(participant_id=str(code), experiment=experiment, rows=named, columns=of, task=task, between=between)


def data_set(
    runs: Runs, members: Mapping[str, Member], name: str, version: str, *, free_text: bool = False
) -> dict[str, bytes]:
    """Every file of the data set by its path in it. `members` is what the register says, `version` is Recoil's."""
    people = [_participant(code, done, members.get(code)) for code, done in runs.by_code.items()]
    grouped = any(person["group"] != NOT_AVAILABLE for person in people)
    shown = [name for name in PARTICIPANT_COLUMNS if name != "group" or grouped]
    synthetic = sum(person["synthetic"] == "true" for person in people)
    return {
        DESCRIPTION: json_bytes(_description(name, version)),
        "README": readme(len(people), synthetic, free_text=free_text).encode(),
        "participants.tsv": _tsv(shown, ([person[name] for name in shown] for person in people)),
        "participants.json": json_bytes({name: PARTICIPANT_COLUMNS[name] for name in shown}),
        **{f"task-{task}_beh.json": json_bytes(_sidecar(run, free_text)) for task, run in runs.tasks.items()},
        **{_path(run): _beh(run, free_text) for run in runs.runs},
        **_events(runs, version, free_text),
    }


def json_bytes(values: object) -> bytes:
    """JSON for people to read and to fill in."""
    return (json.dumps(values, indent=2, ensure_ascii=False) + "\n").encode()


def _description(name: str, version: str) -> dict[str, object]:
    generator = {"Name": GENERATOR, "Version": version, "Description": "recoil export bids"}
    return {"Name": name, "BIDSVersion": BIDS_VERSION, "DatasetType": "raw", "GeneratedBy": [generator]}


def _participant(code: str, done: Sequence[Run], member: Member | None) -> dict[str, str]:
    """The participant's row. A person is of the species that BIDS takes for granted; a synthetic participant is not."""
    facts = member.facts if member else None
    hands = set[str]().union(*(run.hands for run in done))
    synthetic = {True: "true", False: "false"}["synthetic" in hands] if hands else NOT_AVAILABLE
    return {
        "participant_id": f"sub-{code}",
        "species": "homo sapiens" if synthetic == "false" else NOT_AVAILABLE,
        "age": str(min(facts.age_years, OLDEST_AGE)) if facts and facts.age_years is not None else NOT_AVAILABLE,
        "sex": _SEX.get(facts.sex or "", NOT_AVAILABLE) if facts else NOT_AVAILABLE,
        "handedness": _HANDEDNESS.get(facts.handedness or "", NOT_AVAILABLE) if facts else NOT_AVAILABLE,
        "synthetic": synthetic,
        "group": "; ".join(dict.fromkeys(run.group for run in done if run.group)) or NOT_AVAILABLE,
    }


def _path(run: Run, suffix: str = "beh") -> str:
    return f"sub-{run.participant_id}/beh/sub-{run.participant_id}_task-{run.experiment}_{suffix}.tsv"


def _events(runs: Runs, version: str, free_text: bool) -> dict[str, bytes]:
    """What a sensor measured, one event a shot, of the runs that had one."""
    measured = [run for run in runs.runs if run.shots]
    shown = [
        column
        for column in SHOTS
        if column.name not in (*_IN_THE_NAME, "onset_utc") and (free_text or not _is_free_text(column))
    ]
    columns = _EVENT_COLUMNS | {column.name: described(column, column.name) for column in shown}
    made_by = {"StimulusPresentation": {"SoftwareName": GENERATOR, "SoftwareVersion": version}}
    return {
        **{f"task-{run.experiment}_events.json": json_bytes(_task(run) | made_by | columns) for run in measured},
        **{_path(run, "events"): _event_table(run, shown) for run in measured},
    }


def _event_table(run: Run, shown: Sequence[Column]) -> bytes:
    start, set_back = _first_pulse(run)
    onsets = (as_moment(str(shot["onset_utc"] or "")) for shot in run.shots)
    cells = (
        [
            repr((onset - start).total_seconds()) if onset and start and not set_back else NOT_AVAILABLE,
            NOT_AVAILABLE,
            *(_cell(column, cast("Cell", shot[column.name])) for column in shown),
        ]
        for shot, onset in zip(run.shots, onsets, strict=True)
    )
    return _tsv([*_EVENT_COLUMNS, *(column.name for column in shown)], cells)


def _first_pulse(run: Run) -> tuple[datetime | None, bool]:
    """The earliest pulse in a run's rows, and whether its clock was set back."""
    back = any(tables.CLOCK_SET_BACK in str(row["flags"] or "").split() for row in run.rows)
    moments = (as_moment(str(row["onset_utc"] or "")) for row in run.rows)
    return min(filter(None, moments), default=None), back


def _exported(run: Run, free_text: bool) -> list[Column]:
    shown = [column for column in run.columns if column.name not in _IN_THE_NAME]
    return [column for column in shown if free_text or not _is_free_text(column)]


def _is_free_text(column: Column) -> bool:
    """Whether somebody's own words stand in a column."""
    return column.type == "text" and column.name not in _NO_FREE_TEXT


def _name(column: Column) -> str:
    return _NAMES.get(column.name, column.name)


def _sidecar(run: Run, free_text: bool) -> dict[str, object]:
    found = {_name(column): described(column, _name(column)) for column in _exported(run, free_text)}
    return {**_task(run), **found}


def _task(run: Run) -> dict[str, object]:
    return {"TaskName": run.experiment, "TaskDescription": run.task}


def _beh(run: Run, free_text: bool) -> bytes:
    table = _exported(run, free_text)
    rows = [{**row, "onset_utc": onset} for row, onset in zip(run.rows, _onsets(run), strict=True)]
    cells = ([_cell(column, row[column.name]) for column in table] for row in rows)
    return _tsv([_name(column) for column in table], cells)


def _onsets(run: Run) -> list[float | None]:
    """Seconds since the first pulse in the rows; `None` without a pulse, and once the clock was set back."""
    moments = [as_moment(str(row["onset_utc"] or "")) for row in run.rows]
    back = (n for n, row in enumerate(run.rows) if tables.CLOCK_SET_BACK in str(row["flags"] or "").split())
    known = moments[: next(back, None)]
    start = min(filter(None, known), default=None)
    since = [(moment - start).total_seconds() if moment and start else None for moment in known]
    return [*since, *(None for _ in moments[len(known) :])]


def _cell(column: Column, value: Cell) -> str:
    if value is None:
        return NOT_AVAILABLE
    if isinstance(value, float):
        whole = column.type in ("integer", "flag")  # beside empty cells they are floats
        return str(int(value)) if whole else repr(float(value))
    text = one_line(str(value))
    return tables.guard(text) or NOT_AVAILABLE


def one_line(text: str) -> str:
    """Text that stays in its cell wherever it is read: one line, single blanks, no double quotes.

    >>> one_line(f'strong,{chr(9)}like "a kick"')
    "strong, like 'a kick'"
    """
    printable = "".join(letter if letter.isprintable() else " " for letter in text)
    return " ".join(printable.replace('"', "'").split())


def _tsv(header: Sequence[str], rows: Iterable[Iterable[str]]) -> bytes:
    return "".join("\t".join(cells) + "\n" for cells in (header, *rows)).encode()
