"""What a study did otherwise than it was frozen: every key, run, person, exclusion, rule and test that differs."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from pydantic import JsonValue

from analysis.logs.files import ARCHIVE_FILE
from analysis.logs.journals import RunFile, journal_of, run_file
from analysis.logs.reading import Logs
from device.messages import how_many
from experiments.config.door import read_toml
from experiments.record import journal, storage
from experiments.record.journal import Head, JournalError
from experiments.record.provenance import recoil_version
from experiments.study.changes import FileValues, changed_keys
from experiments.study.folders import freeze_status
from experiments.study.preregistration import (
    SHORT,
    Chain,
    FreezeStatus,
    Preregistration,
    as_frozen,
    changes_of_run,
    read_chain,
)
from experiments.study.register import Register, read_register
from experiments.study.study import eligible

DeviationKind = Literal[
    "preregistration", "amended", "changed since", "run", "participants", "exclusion", "analysis", "version"
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """One thing that differs: what was frozen, what there is instead, and of whom, as far as that is said.

    `None` stands where there is nothing.
    """

    kind: DeviationKind
    what: str
    frozen: JsonValue = None
    instead: JsonValue = None
    who: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenAs:
    """A preregistration of a study, by its hash: why it amends an earlier one, after how many runs of people."""

    number: int
    sha256: str
    written_utc: str
    reason: str
    begun: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDeviations:
    """The preregistrations of a study that can be trusted, and every deviation from them."""

    study: str
    preregistrations: tuple[FrozenAs, ...]
    deviations: tuple[Deviation, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisFiles:
    """The files that an analysis was made with, and whether with fits of the diffusion model.

    `answered`: without a file of requests, the frozen tests that were made all the same.
    """

    rules: Path | None = None
    requests: Path | None = None
    answered: tuple[JsonValue, ...] = ()
    codebook: Path | None = None
    paper: Path | None = None
    fits: bool = False


def deviations(logs: Logs, used: AnalysisFiles) -> tuple[tuple[StudyDeviations, ...], tuple[str, ...]]:
    """The deviations of each study that is frozen, or whose journals name a preregistration.

    Beside them what was edited or is missing, with its place, and what was not made, for whoever made the analysis.
    """
    found, said = list[StudyDeviations](), list[str]()
    runs: dict[str, list[RunFile]] = {name: [] for name in logs.names}
    for run in logs.runs:
        runs.setdefault(run.study, []).append(run)
    for results, some in runs.items():
        looked = _Looked.at(Path(results), logs, some) if Path(results).is_absolute() else None
        if looked is not None:
            said += looked.stand.problems
            one = _of_study(looked, used)
            found.append(one)
            said += _not_made(looked.chain.folder, one)
    return tuple(found), tuple(said)


def _not_made(folder: Path, found: StudyDeviations) -> Iterator[str]:
    count = sum(one.what.startswith(_NOT_MADE) for one in found.deviations)
    if count:
        yield f"{folder}: {how_many(count, 'frozen test')} not made; the report names each, and its warnings why"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """A run by its journal: the first record, and whether the last one says that it came to its end."""

    file: RunFile
    head: Head
    finished: bool

    @property
    def code(self) -> str:
        return self.file.participant


@dataclass(frozen=True, kw_only=True)
class _Looked:
    """One study as it was found: its register, its runs in the order in which they began, and how it stands.

    `blank`: runs that were killed before anything was acknowledged; `unread`: those whose journal cannot be read.
    `strangers`: the journals of whoever else has runs, as synthetic participants beside people. `elsewhere`: runs that
    lie in the study's results and were not given to the analysis; `unread_elsewhere` as `unread`.
    """

    results: Path
    logs: Logs
    stand: FreezeStatus
    registered: Register
    runs: tuple[_Run, ...]
    blank: tuple[RunFile, ...]
    unread: tuple[RunFile, ...]
    strangers: frozenset[str]
    elsewhere: tuple[_Run, ...]
    unread_elsewhere: tuple[RunFile, ...]

    @classmethod
    def at(cls, results: Path, logs: Logs, runs: Sequence[RunFile]) -> _Looked | None:
        """`None` of a study that was never frozen, and of an archive, which has not what it is held against."""
        folder = logs.folder_of(str(results))
        if (folder / ARCHIVE_FILE).exists():
            return None
        chain = read_chain(folder)
        if not (chain.every or chain.problems or any(_names_one(run.path) for run in runs)):
            return None
        given = _given(results, logs, runs)
        read = [(run, _read(run)) for run in given.values()]
        began = [one for _, one in read if isinstance(one, _Run)]
        carried = [(one.head.plan.participant_id, one.head.preregistration_sha256) for one in began]
        mine = [one for one in began if logs.kind == "synthetic" or one.head.participant == "person"]
        whose = "synthetic" if logs.kind == "synthetic" else "person"
        others = [(run, _read(run)) for run in _not_given(results, logs, given)]
        return cls(
            results=results,
            logs=logs,
            stand=freeze_status(folder, carried),
            registered=read_register(results),
            runs=tuple(sorted(mine, key=lambda one: one.head.utc)),
            blank=tuple(run for run, one in read if one == "blank"),
            unread=tuple(run for run, one in read if one == "unread"),
            strangers=frozenset(_place(one.file.path) for one in began if one not in mine),
            elsewhere=tuple(one for _, one in others if isinstance(one, _Run) and one.head.participant == whose),
            unread_elsewhere=tuple(run for run, one in others if one == "unread"),
        )

    @property
    def chain(self) -> Chain:
        return self.stand.chain

    @cached_property
    def excluded(self) -> dict[str, str]:
        """Who is excluded by hand, with the reason."""
        members = self.registered.members.items()
        return {code: member.excluded for code, member in members if member.excluded is not None}


def _names_one(path: str) -> bool:
    """Whether a journal names a preregistration: a look that is cheap enough for ten thousand of them."""
    try:
        return b'"preregistration_sha256":' in storage.first_line(path)
    except OSError:
        return False


def _given(results: Path, logs: Logs, runs: Iterable[RunFile]) -> dict[str, RunFile]:
    """By the place of its journal every run that the analysis knows, also where its table alone was given."""
    found = {_place(run.path): run for run in runs}
    for place in map(_place, map(journal_of, logs.paths)):
        run = run_file(place, str(results))
        if run is not None and Path(place).parent.parent == results:
            found.setdefault(place, run)
    return found


def _not_given(results: Path, logs: Logs, given: Collection[str]) -> Sequence[RunFile]:
    """The runs that it does not know."""
    known = {*given, *(_place(journal_of(str(problem.file))) for problem in logs.problems)}
    there = map(str, sorted(results.glob("sub-*/sub-*_journal.jsonl")))
    return [file for path in there if path not in known and (file := run_file(path, str(results)))]


def _place(path: str) -> str:
    """A file by its real folder; its own name stays, also where it is a link."""
    folder, name = os.path.split(path)
    return f"{os.path.realpath(folder)}{os.sep}{name}"


def _read(file: RunFile) -> _Run | Literal["blank", "unread"]:
    path = Path(file.path)
    try:
        data = journal.journal_bytes(path)
        head = journal.head_of(path, data)
    except JournalError:  # why it cannot be read is said elsewhere
        return "unread"
    return "blank" if head is None else _Run(file=file, head=head, finished=any(journal.ending_of(data)))


def _of_study(looked: _Looked, used: AnalysisFiles) -> StudyDeviations:
    last = looked.chain.last
    listed = [*_problems(looked)]
    if last is not None:
        listed += [*_amended(looked.chain), *_changed(looked.stand), *_runs(looked)]
        listed += [*_participants(looked, last), *_exclusions(looked), *_analysis(last, used)]
    return StudyDeviations(
        study=looked.logs.names.get(str(looked.results), looked.chain.folder.name),
        preregistrations=tuple(
            FrozenAs(
                number=one.number,
                sha256=one.sha256,
                written_utc=one.written_utc,
                reason=one.reason,
                begun=len(one.begun),
            )
            for one in looked.chain.every
        ),
        deviations=tuple(listed),
    )


def _problems(looked: _Looked) -> Iterator[Deviation]:
    """What was edited or is missing, without the place on this machine."""
    folder = looked.chain.folder
    for text in looked.stand.problems:
        yield Deviation(kind="preregistration", what=text.replace(f"{folder}/", "").replace(str(folder), "STUDY"))


def _amended(chain: Chain) -> Iterator[Deviation]:
    for one in chain.every[1:]:
        for change in one.changes:
            what = f"{change.file}: {change.key}, by preregistration {one.number}"
            yield Deviation(kind="amended", what=what, frozen=change.frozen, instead=change.now)


def _changed(stand: FreezeStatus) -> Iterator[Deviation]:
    for change in stand.changes:
        what = f"{change.file}: {change.key}"
        yield Deviation(kind="changed since", what=what, frozen=change.frozen, instead=change.now)


# the runs


def _runs(looked: _Looked) -> Iterator[Deviation]:
    """What runs did otherwise: each difference once, with everybody of whom it holds."""
    found: dict[str, Deviation] = {}
    for one, code in _each_difference(looked):
        key = repr(one)
        who = (*found[key].who, code) if key in found else (code,)
        found[key] = replace(one, who=tuple(dict.fromkeys(who)))
    yield from found.values()


def _each_difference(looked: _Looked) -> Iterator[tuple[Deviation, str]]:
    for run in looked.runs:
        if run.file.kind != "practice":
            yield from ((one, run.head.plan.participant_id) for one in _of_run(looked.chain, run.head))
    for files, aside in ((looked.unread, ""), (looked.unread_elsewhere, ", not given to this analysis")):
        for file in files:
            if file.kind != "practice":
                yield Deviation(kind="run", what=f"run of {file.experiment}{aside}: {_UNREAD}"), file.participant


_UNREAD = (
    "there is no journal that can be read: under which preregistration, and whether it was finished, cannot be known"
)


def _of_run(chain: Chain, head: Head) -> Iterator[Deviation]:
    own = chain.by_hash(head.preregistration_sha256)
    name = head.plan.experiment
    yield from _named_otherwise(chain, own, head)
    frozen = own or _in_force_at(chain, head.utc)
    for change in changes_of_run(frozen, head.setup_json):
        what = f"run of {name}, {change.file}: {change.key}"
        yield Deviation(kind="run", what=what, frozen=change.frozen, instead=change.now)
    yield from _version(f"Recoil in a run of {name}", frozen, head.provenance.get("recoil", "unknown"))


def _in_force_at(chain: Chain, utc: str) -> Preregistration:
    """What was frozen last at a time; before anything was, what was frozen first."""
    earlier = [one for one in chain.every if one.written_utc <= utc]
    return earlier[-1] if earlier else chain.every[0]


def _named_otherwise(chain: Chain, own: Preregistration | None, head: Head) -> Iterator[Deviation]:
    """A run that began before, or under none, another or an earlier preregistration."""
    first, named, what = chain.every[0], head.preregistration_sha256, f"run of {head.plan.experiment}"
    if own is None and not named and head.utc < first.written_utc:
        yield Deviation(kind="run", what=f"{what} begun before the freeze", frozen=first.written_utc, instead=head.utc)
    elif own is None:
        yield Deviation(
            kind="run",
            what=f"{what} under {'another preregistration' if named else 'no preregistration'}",
            frozen=_in_force_at(chain, head.utc).short,
            instead=named[:SHORT] or None,
        )
    elif later := [one for one in chain.every if one.number > own.number and one.written_utc < head.utc]:
        what = f"{what} under an earlier preregistration than was in force"
        yield Deviation(kind="run", what=what, frozen=later[-1].number, instead=own.number)


def _version(what: str, frozen: Preregistration, now: str) -> Iterator[Deviation]:
    then = frozen.provenance.get("recoil", "unknown")
    if then != now:
        yield Deviation(kind="version", what=what, frozen=then, instead=now)


# the people


def _participants(looked: _Looked, last: Preregistration) -> Iterator[Deviation]:
    study = last.study
    for experiment in dict.fromkeys(last.designs.values()):
        done = _finished(looked, experiment)
        if len(done) != study.participants:
            yield Deviation(
                kind="participants",
                what=f"participants who finished {experiment}",
                frozen=study.participants,
                instead=len(done),
                who=tuple(done[study.participants :]),
            )
        missing = [run.code for run in looked.elsewhere if run.finished and _counts(looked, run.file, experiment)]
        if missing:
            what = f"finished {experiment} and not given to this analysis"
            yield Deviation(kind="participants", what=what, who=tuple(missing))
        if stopped := _unfinished(looked, experiment):
            yield Deviation(kind="participants", what=f"began {experiment} and did not finish it", who=tuple(stopped))
    for code, member in looked.registered.members.items():
        for reason in () if member.facts is None else eligible(member.facts, study.eligibility):
            yield Deviation(kind="participants", what=f"took part, not eligible: {reason}", who=(code,))


def _finished(looked: _Looked, experiment: str) -> list[str]:
    """Who finished an experiment and is not excluded by hand, in the order in which they began."""
    return [run.code for run in looked.runs if run.finished and _counts(looked, run.file, experiment)]


def _unfinished(looked: _Looked, experiment: str) -> list[str]:
    """Who began an experiment, did not finish it, with a table or without, and is not excluded by hand."""
    files = [*(run.file for run in looked.runs if not run.finished), *looked.blank]
    return [file.participant for file in files if _counts(looked, file, experiment)]


def _counts(looked: _Looked, file: RunFile, experiment: str) -> bool:
    return file.kind == "run" and file.experiment == experiment and file.participant not in looked.excluded


def _exclusions(looked: _Looked) -> Iterator[Deviation]:
    """Exclusions by hand, logs that cannot be used, and runs that were set aside."""
    for code, reason in looked.excluded.items():
        yield Deviation(kind="exclusion", what=f"excluded by hand: {reason}", who=(code,))
    for run in looked.runs:
        if run.file.kind == "set aside":
            what = f"an unfinished run of {run.file.experiment} was set aside"
            yield Deviation(kind="exclusion", what=what, who=(run.code,))
    for problem in looked.logs.problems:
        person, place = (problem.participant, problem.experiment), _place(journal_of(str(problem.file)))
        mine = problem.study == str(looked.results) and all(person) and place not in looked.strangers
        if mine and problem.participant not in looked.excluded:
            why = problem.message.partition(";")[0].replace(f"{problem.file.parent}{os.sep}", "")
            yield Deviation(kind="exclusion", what=f"log of {problem.experiment} not used: {why}", who=person[:1])


# the analysis


def _analysis(last: Preregistration, used: AnalysisFiles) -> Iterator[Deviation]:
    """Rules and codes that differ, tests that were added or left out, and another version of Recoil."""
    own = last.study.preregistration
    yield from _file(last, "--rules", own.rules, used.rules)
    yield from _file(last, "--codebook", own.codebook, used.codebook)
    if last.study.paper is not None and used.paper is not None:
        yield from _file(last, "--paper", last.study.paper, used.paper)
    yield from _requests(last, used)
    if own.fits != used.fits:
        yield Deviation(kind="analysis", what="--fits: the diffusion model", frozen=own.fits, instead=used.fits)
    yield from _version("Recoil in this analysis", last, recoil_version())


def _file(last: Preregistration, option: str, name: str | None, path: Path | None) -> Iterator[Deviation]:
    if path is None:
        if name is not None:
            yield Deviation(kind="analysis", what=f"{option} was not given", frozen=name)
        return
    frozen: FileValues = {} if name is None else last.files.get(name, {})
    for change in changed_keys(path.name, frozen, as_frozen(path)):
        what = f"{option} {path.name}: {change.key}"
        yield Deviation(kind="analysis", what=what, frozen=change.frozen, instead=change.now)


_NOT_MADE = "a frozen test that was not made"


def _requests(last: Preregistration, used: AnalysisFiles) -> Iterator[Deviation]:
    """Tests that were not frozen, which are exploratory, and those that were and are not made."""
    frozen = _frozen_tests(last)
    made = used.answered if used.requests is None else _tests(read_toml(used.requests))
    for one in made:
        if one not in frozen:
            yield Deviation(kind="analysis", what="a test that was not frozen: exploratory", instead=one)
    others = "" if used.requests is None else " (--requests)"
    for one in frozen:
        if one not in made:
            yield Deviation(kind="analysis", what=f"{_NOT_MADE}{others}", frozen=one)


def frozen_tests(logs: Logs) -> Sequence[JsonValue]:
    """The tests that the one study of these logs has frozen last; of several studies none."""
    folders = [logs.folder_of(results) for results in logs.names if Path(results).is_absolute()]
    last = read_chain(folders[0]).last if len(folders) == 1 else None
    return [] if last is None else _frozen_tests(last)


def _frozen_tests(last: Preregistration) -> Sequence[JsonValue]:
    name = last.study.preregistration.requests
    return [] if name is None else _tests(last.files.get(name, {}))


def _tests(values: FileValues) -> Sequence[JsonValue]:
    found = values.get("requests")
    return found if isinstance(found, list) else []
