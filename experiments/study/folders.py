"""A study's folders: where a participant's files lie, and how far everybody is by the register and the journals.

A journal is read without being held. Whether another process holds it is looked up in a moment, for which a run that
begins just then has patience; so looking never stands in the way of a run.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from device.messages import RecoilError
from experiments.config.door import ConfigError, StudyConfig
from experiments.config.setup import Setup
from experiments.design import planning
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan
from experiments.design.planned import order_shown
from experiments.load import load_setup, load_study, shipped_folder
from experiments.record import journal, storage, tables
from experiments.record.head_design import began_with
from experiments.record.journal import Contents, Head, JournalError
from experiments.record.names import Place, is_code, participant_folder, twin_text
from experiments.study import register
from experiments.study.balance import group_of_next_run, is_balanced, row_of_next_run
from experiments.study.preregistration import (
    STUDY_FILE,
    FreezeStatus,
    files_now,
    missing,
    read_chain,
    status_beside,
    study_folder,
)
from experiments.study.register import Register
from experiments.study.study import Member, NextParticipant, Participant, RunProgress, RunState, by_code, who_is_next


class PlaceError(RecoilError):
    """A participant or folder that cannot be used; the message names value and rule."""


RETEST = "a retest is a copy of the config under another name (key design), and somebody else has a code of their own"


def check_code(participant_id: str) -> None:
    """`PlaceError`, if it is no participant's code."""
    if not is_code(participant_id):
        shown = participant_id if len(participant_id) <= 40 else f"{participant_id[:40]}..."
        raise PlaceError(
            f"participant code {shown!r} ({len(participant_id)} characters): must be 1 to 32 letters and digits "
            "(A-Z, a-z, 0-9), no blanks, dots or slashes; use a code, not a name"
        )


def place(results: Path, participant_id: str, experiment: str, registered: Register | None = None) -> Place:
    """The place of a run. `PlaceError` if the code breaks a rule or differs from a known one in case alone.

    `registered` is the folder's register, where it has been read.
    """
    check_code(participant_id)
    check_case(results, participant_id, known_codes(results, registered or register.read_register(results)))
    return Place(results=results, participant_id=participant_id, experiment=experiment)


def check_case(results: Path, participant_id: str, known: Iterable[str]) -> None:
    """`PlaceError`, if a code differs from a known one in case alone."""
    if said := twin_text(participant_id, known, results):
        raise PlaceError(said)


def known_codes(results: Path, registered: Register) -> list[str]:
    """The participants who have a folder, or stand in the register as far as it can be trusted."""
    folders = {path.name.removeprefix("sub-") for path in results.glob("sub-*") if path.is_dir()}
    return sorted(folders | set(registered.members))


def files_of_people(results: Path) -> set[Path]:
    """The register of a results folder and the folders of its participants."""
    return {path for path in (results / register.REGISTER_FILE, *results.glob("sub-*")) if path.exists()}


def refuse_gone(results: Path, had: Collection[Path], participant_id: str) -> None:
    """`PlaceError` if all `files_of_people` that a folder had are gone, or somebody's own: they would begin anew.

    Also if the register is, which says who is excluded. Without a code it is asked whether all are.
    """
    own = [participant_folder(results, participant_id), results / register.REGISTER_FILE] if participant_id else []
    own = [path for path in own if path in had]
    if own and all(path.exists() for path in own):  # then not all is gone, either: of many people that is quick
        return
    gone = [path for path in had if not path.exists()]
    if gone and len(gone) == len(had):
        raise PlaceError(
            f"{results.resolve()}: all that was in it is gone: it was moved, or its disk is away. Put it back; or "
            "quit, and start Recoil again, to begin with nobody"
        )
    for lost in (path for path in own if path in gone):
        lacks, anew = f"{participant_id} would begin as somebody new", "if they are to"
        if lost.name == register.REGISTER_FILE:
            lacks, anew = "nothing else says who joined, and who is excluded", "to begin a new one"
        raise PlaceError(
            f"{lost.resolve()}: was there, and is gone: {lacks}. Put it back; or quit, and start Recoil again, {anew}"
        )


def set_aside(run: Place) -> list[Path]:
    """Rename a run's files so that a fresh one can begin; nothing is lost. Returns the new names."""
    return storage.set_aside_files(run.journal, run.table, run.shots)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFolder:
    """A study: its config and the file it stands in, its experiments' setups, and where its results lie."""

    config: StudyConfig
    source: Path
    setups: tuple[Setup[DesignConfig], ...]
    results: Path

    @property
    def is_shipped(self) -> bool:
        """Whether it is the study that comes with Recoil, for want of one that the results belong to."""
        own = self.source.parent.resolve()
        return own == shipped_folder().resolve() != self.results.resolve().parent

    @property
    def experiments(self) -> tuple[str, ...]:
        """The experiments in the order of the study."""
        return tuple(setup.config.experiment for setup in self.setups)

    def setup_of(self, experiment: str) -> Setup[DesignConfig]:
        """The setup of one of its experiments."""
        return next(setup for setup in self.setups if setup.config.experiment == experiment)


@dataclass(frozen=True, slots=True, kw_only=True)
class Overview:
    """The participants in order of their codes, who comes next, in which orders, and what could not be read.

    `orders` are the methods of the next participant's open runs; `None` where chance decides when the run begins, or
    where the rows that are taken cannot be read. `frozen`: whether the study is, and what has changed since.
    """

    participants: tuple[Participant, ...]
    next: NextParticipant | None
    orders: dict[str, tuple[str, ...] | None]
    problems: tuple[str, ...]
    frozen: FreezeStatus


def open_study(folder: Path) -> StudyFolder:
    """The study of a folder: one with `study.toml`, or a results folder, which belongs to the study it lies in.

    A results folder without a study is taken for one of the shipped study, which `is_shipped` then says. `PlaceError`
    for any other folder, `ConfigError` for a broken config.
    """
    if not folder.is_dir():
        raise PlaceError(f"{folder}: no such folder; name a study's folder or a results folder")
    if (folder / "study.toml").is_file():
        return _loaded(str(folder / "study.toml"), folder / "results")
    beside = Path(os.path.normpath(folder / ".." / "study.toml"))
    has_runs = (folder / register.REGISTER_FILE).exists() or known_codes(folder, register.read_register(folder))
    if beside.is_file() and (has_runs or folder.resolve().name == "results"):
        return _loaded(str(beside), folder)
    if not has_runs:
        raise PlaceError(
            f"{folder}: neither a study's folder (study.toml) nor a results folder "
            f"(sub-CODE or {register.REGISTER_FILE}); `recoil new STUDY` makes one"
        )
    return _loaded("study", folder)


def _loaded(name: str, results: Path) -> StudyFolder:
    config, folder = load_study(name)
    setups = tuple(load_setup(folder / experiment) for experiment in config.experiments)
    return StudyFolder(config=config, source=folder / "study.toml", setups=setups, results=results)


def read_anew(study: StudyFolder) -> StudyFolder:
    """A study by its files as they are now. `ConfigError`, if they cannot be used."""
    config, _ = load_study(study.source)
    return replace(study, config=config, setups=tuple(load_setup(setup.source) for setup in study.setups))


def overview(study: StudyFolder) -> Overview:
    """How a study stands. What cannot be read is a problem in the list, never an exception."""
    look = _Look(study, register.read_register(study.results))
    people = tuple(look.participants())
    next_one = who_is_next(people, study.config, study.experiments)
    orders_ahead = look.orders(next_one)
    frozen = look.frozen()
    problems = tuple(dict.fromkeys(filter(None, (look.registered.problem, *look.problems, *frozen.problems))))
    return Overview(participants=people, next=next_one, orders=orders_ahead, problems=problems, frozen=frozen)


def look_at(study: StudyFolder, participant_id: str) -> tuple[Participant, tuple[str, ...]]:
    """How one participant stands at this moment, and what could not be read; of somebody new, that nothing has begun.

    `PlaceError` if the code breaks a rule; `JournalError` if the register cannot be trusted.
    """
    look = _Look(study, register.read_register(study.results))
    if look.registered.problem:
        raise JournalError(look.registered.problem)
    return look.participant(participant_id), tuple(look.problems)


def freeze_status(folder: Path, carried: Sequence[tuple[str, str]] = ()) -> FreezeStatus:
    """How the study of a folder stands beside what was frozen; that its files cannot be read is among the problems."""
    try:
        if not (folder / STUDY_FILE).is_file():
            raise ConfigError(f"{folder / STUDY_FILE}: is missing, so nothing says what has changed in it; put it back")
        study = _loaded(str(folder / STUDY_FILE), folder / "results")
    except ConfigError as error:
        chain = read_chain(folder)
        return FreezeStatus(chain=chain, missing=(*map(str, missing(chain, carried)), *str(error).splitlines()))
    return status_beside(folder, lambda: files_now(study.source, study.config, study.setups), carried)


class _Look:
    """One look at a study: register and journals are read once each, and what cannot be read is kept as a problem."""

    def __init__(self, study: StudyFolder, registered: Register) -> None:
        self._study, self.registered, self._members = study, registered, registered.members
        self._codes = known_codes(study.results, registered)
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
        check_code(code)
        check_case(results, code, self._codes)
        runs = [
            Place(results=results, participant_id=code, experiment=one.config.experiment, suffix=one.config.table)
            for one in self._study.setups
        ]
        member = self._members.get(code, Member(participant_id=code))
        return Participant(
            participant_id=code,
            runs=tuple(map(self._run, runs)),
            facts=member.facts,
            joined_utc=member.joined_utc,
            excluded=member.excluded,
            left=member.left,
        )

    def _run(self, where: Place) -> RunProgress:
        try:
            missed = _missed(where)
            return replace(self._progress(where), practised=bool(missed), practice_missed=bool(missed) and all(missed))
        except JournalError as error:
            self.problems.append(str(error))
            return RunProgress(experiment=where.experiment, state="unreadable")

    def _progress(self, where: Place) -> RunProgress:
        if not where.journal.exists():
            return RunProgress(experiment=where.experiment, state="not begun")
        elsewhere = _is_held(where.journal)
        contents = journal.contents_of(where.journal, self._data(where.journal))
        if contents is not None and contents.finished and not elsewhere and not where.table.exists():
            self.problems.append(
                f"{where.table}: is missing, though the run is finished; `recoil rebuild {where.journal}` makes it "
                "again; until then analyses make it from the journal"
            )
        return progress_of(where, contents, elsewhere=elsewhere)

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

    def frozen(self) -> FreezeStatus:
        """Whether the study is frozen, by its files and by the journals that were looked at."""
        study = self._study
        heads = [head for head in self._heads.values() if isinstance(head, Head)]
        carried = [(head.plan.participant_id, head.preregistration_sha256) for head in heads]
        folder = study_folder(study.results, study.source)
        return status_beside(folder, lambda: files_now(study.source, study.config, study.setups), carried)

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
            except JournalError as error:  # the register's, which says who is excluded
                self.problems.append(str(error))
            found[run.experiment] = run.methods or ahead
        return found

    def _next_methods(self, setup: Setup[DesignConfig], participant_id: str) -> tuple[str, ...] | None:
        """The methods of a participant's next run in their order; `None` if chance decides when the run begins."""
        row, seed = row_of_next_run(setup, self._study.results, self.registered, self._head), setup.config.seed
        if row is None and seed is None:
            return None
        group = group_of_next_run(setup, self._study.results, self.registered, self._head)
        return order_shown(
            setup.config, planning.plan_of(setup.config, participant_id, seed or 0, row=row, group=group)
        )


def progress_of(where: Place, contents: Contents | None, *, elsewhere: bool = False) -> RunProgress:
    """How far a run has come by its journal. `JournalError` if that cannot be trusted, or is another's.

    `contents` are `None` where nothing was acknowledged; `elsewhere`: another process is at it.
    """
    if contents is None:
        return RunProgress(experiment=where.experiment, state="open elsewhere" if elsewhere else "not begun")
    from experiments.record.rebuild import trials_answered  # noqa: PLC0415 - slow, and who reads tables needs none of it

    check_whose(where, contents.plan)
    head, plan, design = contents.head, contents.plan, began_with(contents.head)
    state: RunState = "done" if contents.finished else "open elsewhere" if elsewhere else "in progress"
    return RunProgress(
        experiment=where.experiment,
        state="synthetic" if head.participant == "synthetic" and state != "open elsewhere" else state,
        answered=trials_answered(contents),
        planned=len(plan.trials),
        began_utc=head.utc,
        last_utc=contents.records[-1].utc,
        methods=order_shown(design, plan),
        data=data_of(head),
        language="" if head.language is None else f"{head.language.code} ({head.language.name})",
    )


def check_whose(where: Place, plan: Plan) -> None:
    """`JournalError` if the journal that stands there has the plan of another participant or experiment."""
    if (plan.participant_id, plan.experiment) != (where.participant_id, where.experiment):
        raise JournalError(
            f"{where.journal}: line 1: is of participant {plan.participant_id}, experiment {plan.experiment}; "
            "it was renamed or copied here, so put it back"
        )


def data_of(head: Head) -> tables.DataKind:
    """Whose data a run gives, by the first record of its journal."""
    simulated = head.gun is not None and tables.is_simulated(head.gun.name)
    return tables.data_kind(synthetic=head.participant == "synthetic", simulated=simulated)


def refuse_open_run(results: Path, participant_id: str) -> None:
    """`PlaceError` while somebody sits at a run or a practice; `JournalError`, if nobody can say."""
    for path in sorted(participant_folder(results, participant_id).glob("*_journal.jsonl")):
        if _is_held(path):
            raise PlaceError(
                f"participant {participant_id} sits at another console, where {path.name} is open: close it there first"
            )


def _is_held(path: Path) -> bool:
    try:
        return storage.is_held(path)
    except OSError as error:
        raise JournalError(f"{path}: cannot be opened ({error.strerror})") from error


def _missed(where: Place) -> list[bool]:
    """Of each practice that was done to its end, also of those set aside: whether it missed what the design wants."""
    from experiments.record import replay  # noqa: PLC0415 - slow, and who reads tables needs none of it
    from experiments.session.practice_rounds import is_to_be_repeated  # noqa: PLC0415 - the same

    practice, found = replace(where, practice=True), list[bool]()
    for path in practice.folder.glob(f"{practice.journal.stem}*{practice.journal.suffix}"):
        with suppress(JournalError):  # a practice is not analysed, so a broken one is nobody's concern
            contents = journal.read_journal(path)
            if contents.finished and contents.head.participant == "person":
                design = began_with(contents.head)
                found.append(is_to_be_repeated(design, contents.plan, replay.history(contents)))
    return found


def refuse_without_practice(setup: Setup[DesignConfig]) -> None:
    """`PlaceError` if a design has no practice."""
    if not setup.config.practice.repetitions:
        raise PlaceError(
            f"{setup.source}: there is no practice (repetitions in the table [practice]); begin the run itself"
        )


def make_results(folder: Path) -> None:
    """Make a folder for results. `PlaceError`: it cannot be made."""
    try:
        storage.make_folder(folder)
    except OSError as error:
        raise PlaceError(f"{folder}: cannot be made ({error.strerror}); choose another --results") from error


_TURN_S = 20.0
"""So long a run waits for another one that begins; with a sensor and a participant's screen that takes some seconds."""


@contextmanager
def own_turn(results: Path, config: DesignConfig) -> Iterator[None]:
    """Keep others from beginning a run here, where what it gets hangs on the journals of those before it.

    `PlaceError`: somebody else has been beginning one for too long.
    """
    if not is_balanced(config):
        yield
        return
    make_results(results)
    with storage.folder_held(results, _TURN_S) as is_ours:
        if not is_ours:
            raise PlaceError(
                f"{results}: another console has been beginning a run here for {_TURN_S:g} s, and the order of this "
                "one hangs on that; see to it, and begin again"
            )
        yield
