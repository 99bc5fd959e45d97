"""A study's folder as it stands: what the register and the journals say of every participant. Reads, never writes.

A journal is read without being held. Whether another process holds it is looked up in a moment, for which a run that
begins just then has patience; so looking never stands in the way of a run.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments import catalogue
from experiments.config.models import StudyConfig
from experiments.config.setup import Setup
from experiments.load import load_setup, load_study
from experiments.rebuild import plan_of, rebuild
from experiments.record import journal, storage
from experiments.record.journal import JournalError
from experiments.study import places, register
from experiments.study.places import PlaceError
from experiments.study.register import Member
from experiments.study.study import Next, Participant, RunStanding, by_code, who_is_next

ANSWERED_BY = {"direction": "response_source", "preference": "rating_by"}
"""The column that says, by not being empty, that a trial was answered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFolder:
    """A study: its config and the file it stands in, its experiments' setups, and where its results lie."""

    config: StudyConfig
    source: Path
    setups: tuple[Setup[Any], ...]
    results: Path

    @property
    def experiments(self) -> tuple[str, ...]:
        """The experiments in the order of the study."""
        return tuple(setup.config.experiment for setup in self.setups)


@dataclass(frozen=True, slots=True, kw_only=True)
class Overview:
    """The participants in order of their codes, who comes next, in which orders, and what could not be read.

    `orders` are the methods of the next participant's open runs; `None` where chance decides when the run begins, or
    where the rows that are taken cannot be read.
    """

    participants: tuple[Participant, ...]
    next: Next | None
    orders: dict[str, tuple[str, ...] | None]
    problems: tuple[str, ...]


def open_study(folder: Path) -> StudyFolder:
    """The study of a folder: one with `study.toml`, or a results folder, which belongs to the study it lies in.

    A results folder without a study is taken for one of the shipped study. `PlaceError` for any other folder,
    `ConfigError` for a broken config.
    """
    if not folder.is_dir():
        raise PlaceError(f"{folder}: no such folder; name a study's folder or a results folder")
    if (folder / "study.toml").is_file():
        return _loaded(str(folder / "study.toml"), folder / "results")
    beside = Path(os.path.normpath(folder / ".." / "study.toml"))
    if folder.resolve().name == "results" and beside.is_file():
        return _loaded(str(beside), folder)
    if not ((folder / register.NAME).exists() or places.known_codes(folder)):
        raise PlaceError(
            f"{folder}: neither a study's folder (study.toml) nor a results folder (sub-CODE or {register.NAME}); "
            "`recoil new STUDY` makes one"
        )
    return _loaded("study", folder)


def _loaded(name: str, results: Path) -> StudyFolder:
    config, folder = load_study(name)
    setups = tuple(load_setup(str(folder / experiment)) for experiment in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=results)


def overview(study: StudyFolder) -> Overview:
    """How a study stands. What cannot be read is a problem in the list, never an exception."""
    found, problems = register.read(study.results), list[str]()
    if found.problem:
        problems.append(found.problem)
    people = tuple(_participants(study, found.members, problems))
    next_one = who_is_next(people, study.config, study.experiments)
    orders_ahead = _orders(study, next_one, problems)
    return Overview(participants=people, next=next_one, orders=orders_ahead, problems=tuple(dict.fromkeys(problems)))


def _participants(study: StudyFolder, members: dict[str, Member], problems: list[str]) -> Iterator[Participant]:
    for code in sorted(places.known_codes(study.results), key=by_code):
        try:
            yield _participant(study, members.get(code, Member(participant_id=code)), problems)
        except PlaceError as error:
            problems.append(f"{study.results / f'sub-{code}'}: {error}")


def _participant(study: StudyFolder, member: Member, problems: list[str]) -> Participant:
    where = [places.place(study.results, member.participant_id, experiment) for experiment in study.experiments]
    return Participant(
        participant_id=member.participant_id,
        runs=tuple(_run(one, problems) for one in where),
        facts=member.facts,
        joined_utc=member.joined_utc,
        excluded=member.excluded,
    )


def look_at(study: StudyFolder, participant_id: str) -> tuple[Participant, tuple[str, ...]]:
    """How one participant stands at this moment, and what could not be read; of somebody new, that nothing has begun.

    `PlaceError` if the code breaks a rule; `JournalError` if the register cannot be trusted.
    """
    found, problems = register.read(study.results), list[str]()
    if found.problem:
        raise JournalError(found.problem)
    member = found.members.get(participant_id, Member(participant_id=participant_id))
    return _participant(study, member, problems), tuple(problems)


def _run(where: places.Place, problems: list[str]) -> RunStanding:
    try:
        return replace(run_standing(where), practised=_practised(where))
    except JournalError as error:
        problems.append(str(error))
        return RunStanding(experiment=where.experiment, state="unreadable")


def run_standing(where: places.Place) -> RunStanding:
    """How far a run has come. `JournalError` if its journal cannot be trusted."""
    if not where.journal.exists():
        return RunStanding(experiment=where.experiment, state="not begun")
    elsewhere = _is_held(where)
    if journal.is_empty(where.journal):
        return RunStanding(experiment=where.experiment, state="open elsewhere" if elsewhere else "not begun")
    begun = _begun(where)
    return replace(begun, state="open elsewhere") if elsewhere and begun.state != "done" else begun


def _is_held(where: places.Place) -> bool:
    try:
        return storage.is_held(where.journal)
    except OSError as error:
        raise JournalError(f"{where.journal}: cannot be opened ({error.strerror})") from error


def _practised(where: places.Place) -> bool:
    """Whether a practice was done to its end, also one that a later practice has set aside."""
    practice = replace(where, practice=True)
    for path in practice.folder.glob(f"{practice.journal.stem}*{practice.journal.suffix}"):
        with suppress(JournalError):  # a practice is not analysed, so a broken one is nobody's concern
            if journal.read(path).finished:
                return True
    return False


def _begun(where: places.Place) -> RunStanding:
    _, table, contents = rebuild(where.journal)
    plan = plan_of(contents)
    if (plan.participant_id, plan.experiment) != (where.participant_id, where.experiment):
        raise JournalError(
            f"{where.journal}: line 1: is of participant {plan.participant_id}, experiment {plan.experiment}; "
            "it was renamed or copied here, so put it back"
        )
    rows = list(csv.DictReader(io.StringIO(table.decode(), newline="")))
    return RunStanding(
        experiment=where.experiment,
        state="done" if contents.finished else "in progress",
        answered=sum(row[ANSWERED_BY[where.experiment]] != "" for row in rows),
        planned=len(rows),
        last_utc=str(contents.records[-1].get("utc", "")),
        methods=plan.methods,
    )


def _orders(study: StudyFolder, next_one: Next | None, problems: list[str]) -> dict[str, tuple[str, ...] | None]:
    if next_one is None:
        return {}
    setups = {setup.config.experiment: setup for setup in study.setups}
    found: dict[str, tuple[str, ...] | None] = {}
    for run in next_one.runs:
        try:
            ahead = next_methods(setups[run.experiment], study.results, next_one.participant_id)
        except JournalError as error:
            problems.append(str(error))
            ahead = None
        found[run.experiment] = run.methods or ahead
    return found


def next_methods(setup: Setup[Any], results: Path, participant_id: str) -> tuple[str, ...] | None:
    """The methods of a participant's next run in their order; `None` if chance decides when the run begins."""
    row, seed = places.next_row(setup, results), setup.config.seed
    if row is None and seed is None:
        return None
    made = catalogue.experiment(setup).make_plan(setup.config, participant_id, seed or 0, row)
    return made.methods
