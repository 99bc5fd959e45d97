"""Who and what of a study is in an archive, and what is left out for which reason: nobody without a word."""

from __future__ import annotations

import csv
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from analysis.logs.design_logs import ONE_DESIGN
from analysis.logs.exclusions import FINISHED, TRUSTED, LeftOut
from analysis.logs.files import Problem, code_in_name, experiment_in_name
from analysis.logs.journals import RunFile, journal_of
from analysis.logs.kinds import IN_REGISTER, NEVER_TOGETHER
from analysis.logs.reading import Logs
from experiments.record import journal, storage, tables
from experiments.record.journal import JournalError
from experiments.record.tables import Column, DataKind
from experiments.study.folders import PlaceError, data_of
from experiments.study.study import Member

CONTENTS = "contents.csv"
Here = Literal["finished", "not finished"]
Left = Literal["excluded", "begun", "practice", "set aside", "kept out", "no journal", "other design", "broken"]
EntryState = Here | Left | Literal["no run"]
"""How a run stands; only the first two are in an archive."""
MEANINGS: Mapping[EntryState, str] = {
    "finished": "in the archive",
    "not finished": "in the archive as far as it came: the run was stopped before its end",
    "excluded": "left out: the participant was excluded; the reason stands in the study's register alone",
    "begun": "left out: the run broke off and has no table",
    "practice": "left out: a practice, which is never analysed",
    "set aside": "left out: an unfinished run that was set aside for a fresh one",
    "kept out": "left out: data of another kind (real, simulated gun, synthetic) than the archive's",
    "no journal": "left out: a table that no journal proves",
    "other design": "left out: a sound run of another design than the one that is frozen, or that most runs have",
    "broken": "left out: table or journal is missing, breaks a rule, or was changed since the run",
    "no run": "the participant joined and has no run",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A run of a participant, or a participant without one, and how it stands."""

    participant_id: str
    experiment: str
    state: EntryState
    kind: DataKind | None = None

    @property
    def archived(self) -> bool:
        """Whether it is in the archive."""
        return self.state in get_args(Here)


CONTENT_COLUMNS: tuple[Column, ...] = (
    tables.text_column("participant_id", "participant's code; empty where no file says whose it is"),
    tables.text_column("experiment", "which experiment; empty where there is no run"),
    tables.flag_column("in_archive", "1 if the run is in the archive, 0 if it is left out"),
    tables.level_column("state", tuple(MEANINGS), "how the run stands, or why it is left out", required=True),
    tables.level_column(
        "data", ("real", "simulated gun", "synthetic"), "whose data they are; empty where nothing says so"
    ),
)


def contents_table(entries: Iterable[Entry]) -> bytes:
    """The table of an archive's runs and of those that are left out."""
    rows = (
        tables.Row(
            participant_id=one.participant_id,
            experiment=one.experiment,
            in_archive=int(one.archived),
            state=one.state,
            data=one.kind,
        )
        for one in sorted(entries, key=lambda one: (one.participant_id, one.experiment, one.state))
    )
    return tables.table_bytes(CONTENT_COLUMNS, rows)


def left_out_entries(
    logs: Logs, members: Mapping[str, Member], without_journal: Collection[Problem]
) -> Iterator[Entry]:
    """What of a study is not in its archive. `logs` are all of it, `without_journal` those that no journal proves."""
    excluded = {code for code, member in members.items() if member.excluded is not None}
    runs = [run for part in (logs, *logs.apart) for run in part.runs]
    for run in runs:
        if run.kind != "run":
            yield _of_run(run, run.kind, excluded)
    for begun in logs.begun:
        yield _of_run(replace(begun.file, data=begun.data), "begun", excluded)
    for problem in (*logs.problems, *without_journal):
        state: EntryState = "no journal" if problem in without_journal else _why(problem)
        code = problem.participant or code_in_name(str(problem.file)) or ""
        experiment = problem.experiment or experiment_in_name(str(problem.file))
        state = "excluded" if code in excluded else state
        yield Entry(participant_id=code, experiment=experiment, state=state, kind=_data(problem))
    files = {code_in_name(str(file)) for part in (logs, *logs.apart) for file in part.files}
    seen = {run.participant for run in runs} | files | {problem.participant for problem in logs.problems}
    for code in members:
        if code not in seen:
            yield Entry(participant_id=code, experiment="", state="excluded" if code in excluded else "no run")


_RULES: Mapping[EntryState, str] = {
    "excluded": IN_REGISTER,
    "begun": FINISHED,
    "no journal": TRUSTED,
    "other design": ONE_DESIGN,
    "broken": TRUSTED,
}
"""The states in which a run leaves somebody out, with the rule; practices, runs set aside and other kinds do not."""


def left_out_in(folder: Path) -> tuple[LeftOut, ...]:
    """Who of a study is not in its archive, by its list of runs; no more is said of why than there.

    `PlaceError` if the list cannot be read.
    """
    path = folder / CONTENTS
    try:
        rows = [*csv.DictReader(storage.read_whole(path).decode().splitlines())]
    except FileNotFoundError:
        return ()
    except (OSError, ValueError, csv.Error) as error:
        raise PlaceError(f"{path}: cannot be read ({error})") from error
    states = ((row, state) for row in rows for state in _RULES if row.get("state") == state)
    found = (_as_left_out(row, state) for row, state in states if row.get("participant_id") and row.get("experiment"))
    return tuple(dict.fromkeys(found))  # of a person and an experiment there may be several runs


def _as_left_out(row: Mapping[str, str], state: EntryState) -> LeftOut:
    return LeftOut(
        experiment=row["experiment"],
        participant=row["participant_id"],
        reason=MEANINGS[state].removeprefix("left out: "),
        rule=_RULES[state],
        file=CONTENTS if _RULES[state] == TRUSTED else "",
    )


def _of_run(run: RunFile, state: EntryState, excluded: Collection[str]) -> Entry:
    why = "excluded" if run.participant in excluded else state
    return Entry(participant_id=run.participant, experiment=run.experiment, state=why, kind=run.data)


def _why(problem: Problem) -> EntryState:
    return _BY_RULE.get(problem.rule, "broken")


def _data(problem: Problem) -> DataKind | None:
    """Whose data a log holds that is left out: as was read, or as its journal says, if it does."""
    if problem.data is not None:
        return problem.data
    head = None
    with suppress(JournalError):
        head = journal.head(Path(journal_of(str(problem.file))))
    return None if head is None else data_of(head)


_BY_RULE: Mapping[str, EntryState] = {ONE_DESIGN: "other design", NEVER_TOGETHER: "kept out"}
"""The states of logs that are sound, and left out by a rule."""
