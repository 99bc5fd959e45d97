"""A study's folder as it stands: what the register and the journals say of every participant. Reads, never writes.

A journal is read without being held. Whether another process holds it is looked up in a moment, for which a run that
begins just then has patience; so looking never stands in the way of a run.
"""

from __future__ import annotations

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
from experiments.record import journal, replay, storage
from experiments.record.journal import Contents, Head, JournalError
from experiments.session.history import answered
from experiments.study import places, register
from experiments.study.places import Place, PlaceError
from experiments.study.register import Member, Register
from experiments.study.study import NextParticipant, Participant, RunProgress, by_code, who_is_next


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
    next: NextParticipant | None
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
    if not ((folder / register.REGISTER_FILE).exists() or places.known_codes(folder, register.read_register(folder))):
        raise PlaceError(
            f"{folder}: neither a study's folder (study.toml) nor a results folder "
            f"(sub-CODE or {register.REGISTER_FILE}); `recoil new STUDY` makes one"
        )
    return _loaded("study", folder)


def _loaded(name: str, results: Path) -> StudyFolder:
    config, folder = load_study(name)
    setups = tuple(load_setup(str(folder / experiment)) for experiment in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=results)


def overview(study: StudyFolder) -> Overview:
    """How a study stands. What cannot be read is a problem in the list, never an exception."""
    look = _Look(study, register.read_register(study.results))
    people = tuple(look.participants())
    next_one = who_is_next(people, study.config, study.experiments)
    orders_ahead = look.orders(next_one)
    problems = tuple(dict.fromkeys(filter(None, (look.registered.problem, *look.problems))))
    return Overview(participants=people, next=next_one, orders=orders_ahead, problems=problems)


def look_at(study: StudyFolder, participant_id: str) -> tuple[Participant, tuple[str, ...]]:
    """How one participant stands at this moment, and what could not be read; of somebody new, that nothing has begun.

    `PlaceError` if the code breaks a rule; `JournalError` if the register cannot be trusted.
    """
    look = _Look(study, register.read_register(study.results))
    if look.registered.problem:
        raise JournalError(look.registered.problem)
    return look.participant(participant_id), tuple(look.problems)


class _Look:
    """One look at a study: register and journals are read once each, and what cannot be read is kept as a problem."""

    def __init__(self, study: StudyFolder, registered: Register) -> None:
        self._study, self.registered, self._members = study, registered, registered.members
        self._codes = places.known_codes(study.results, registered)
        self._heads: dict[Path, Head | JournalError | None] = {}
        self.problems: list[str] = []

    def participants(self) -> Iterator[Participant]:
        """All who are known and have a code that keeps the rules."""
        for code in sorted(self._codes, key=by_code):
            try:
                yield self.participant(code)
            except PlaceError as error:
                self.problems.append(f"{self._study.results / f'sub-{code}'}: {error}")

    def participant(self, code: str) -> Participant:
        """How one stands. `PlaceError` if the code breaks a rule."""
        results = self._study.results
        places.check_code(code)
        places.check_case(results, code, self._codes)
        runs = [Place(results=results, participant_id=code, experiment=name) for name in self._study.experiments]
        member = self._members.get(code, Member(participant_id=code))
        return Participant(
            participant_id=code,
            runs=tuple(map(self._run, runs)),
            facts=member.facts,
            joined_utc=member.joined_utc,
            excluded=member.excluded,
        )

    def _run(self, where: Place) -> RunProgress:
        try:
            return replace(self._progress(where), practised=_practised(where))
        except JournalError as error:
            self.problems.append(str(error))
            return RunProgress(experiment=where.experiment, state="unreadable")

    def _progress(self, where: Place) -> RunProgress:
        if not where.journal.exists():
            return RunProgress(experiment=where.experiment, state="not begun")
        elsewhere = _is_held(where)
        data = self._data(where.journal)
        return progress_of(where, journal.contents_of(where.journal, data), elsewhere=elsewhere)

    def _data(self, path: Path) -> bytes:
        """The bytes of a journal, whose head is kept."""
        try:
            data = journal.journal_bytes(path)
            self._heads[path] = journal.head_of(path, data)
        except JournalError as error:
            self._heads[path] = error
            raise
        return data

    def _head(self, path: Path) -> Head | None:
        """The head of a journal, from when it was looked at if it was. Raises as `journal.head`."""
        seen = self._heads[path] if path in self._heads else journal.head(path)
        if isinstance(seen, JournalError):
            raise seen
        return seen

    def orders(self, next_one: NextParticipant | None) -> dict[str, tuple[str, ...] | None]:
        """The methods of who is next, by experiment; `None` where chance decides, or rows cannot be read."""
        if next_one is None:
            return {}
        setups = {setup.config.experiment: setup for setup in self._study.setups}
        found: dict[str, tuple[str, ...] | None] = {}
        for run in next_one.runs:
            ahead = None
            try:
                ahead = self._next_methods(setups[run.experiment], next_one.participant_id)
            except JournalError as error:
                self.problems.append(str(error))
            found[run.experiment] = run.methods or ahead
        return found

    def _next_methods(self, setup: Setup[Any], participant_id: str) -> tuple[str, ...] | None:
        """The methods of a participant's next run in their order; `None` if chance decides when the run begins."""
        row, seed = places.row_of_next_run(setup, self._study.results, self.registered, self._head), setup.config.seed
        if row is None and seed is None:
            return None
        return catalogue.experiment(setup).make_plan(setup.config, participant_id, seed or 0, row).methods


def progress_of(where: Place, contents: Contents | None, *, elsewhere: bool = False) -> RunProgress:
    """How far a run has come by its journal. `JournalError` if that cannot be trusted, or is another's.

    `contents` are `None` where nothing was acknowledged; `elsewhere`: another process is at it.
    """
    if contents is None:
        return RunProgress(experiment=where.experiment, state="open elsewhere" if elsewhere else "not begun")
    plan = contents.plan
    if (plan.participant_id, plan.experiment) != (where.participant_id, where.experiment):
        raise JournalError(
            f"{where.journal}: line 1: is of participant {plan.participant_id}, experiment {plan.experiment}; "
            "it was renamed or copied here, so put it back"
        )
    return RunProgress(
        experiment=where.experiment,
        state="done" if contents.finished else "open elsewhere" if elsewhere else "in progress",
        answered=len(answered(replay.history(contents))),
        planned=len(plan.trials),
        last_utc=contents.records[-1].utc,
        methods=plan.methods,
    )


def _is_held(where: Place) -> bool:
    try:
        return storage.is_held(where.journal)
    except OSError as error:
        raise JournalError(f"{where.journal}: cannot be opened ({error.strerror})") from error


def _practised(where: Place) -> bool:
    """Whether a practice was done to its end, also one that a later practice has set aside."""
    practice = replace(where, practice=True)
    for path in practice.folder.glob(f"{practice.journal.stem}*{practice.journal.suffix}"):
        with suppress(JournalError):  # a practice is not analysed, so a broken one is nobody's concern
            if journal.read_journal(path).finished:
                return True
    return False
