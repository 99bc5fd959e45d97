"""What a study did otherwise than it was frozen: every key, run, person, exclusion, rule and test that differs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import JsonValue

from analysis.logs.design_logs import APART
from analysis.logs.journals import RunFile, journal_of
from analysis.logs.reading import Logs
from analysis.summary.found_studies import FoundStudy, real_place
from device.messages import how_many
from experiments.config.door import read_toml
from experiments.record.journal import Head
from experiments.record.provenance import recoil_version
from experiments.study.changes import FileValues, changed_keys
from experiments.study.enrolment import order_broken
from experiments.study.preregistration import (
    SHORT,
    Chain,
    FreezeStatus,
    Preregistration,
    as_frozen,
    changes_of_run,
    read_chain,
)
from experiments.study.study import Participant, RunProgress, eligible

DeviationKind = Literal[
    "preregistration", "amended", "changed since", "run", "order", "participants", "exclusion", "analysis", "version"
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
        looked = FoundStudy.at(Path(results), logs, some) if Path(results).is_absolute() else None
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


def _of_study(looked: FoundStudy, used: AnalysisFiles) -> StudyDeviations:
    last = looked.chain.last
    listed = [*_problems(looked)]
    if last is not None:
        listed += [*_amended(looked.chain), *_changed(looked.stand), *_runs(looked), *_orders(looked, last)]
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


def _problems(looked: FoundStudy) -> Iterator[Deviation]:
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


def _runs(looked: FoundStudy) -> Iterator[Deviation]:
    """What runs did otherwise: each difference once, with everybody of whom it holds."""
    found: dict[str, Deviation] = {}
    for one, code in _each_difference(looked):
        key = repr(one)
        who = (*found[key].who, code) if key in found else (code,)
        found[key] = replace(one, who=tuple(dict.fromkeys(who)))
    yield from found.values()


def _each_difference(looked: FoundStudy) -> Iterator[tuple[Deviation, str]]:
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


def _participants(looked: FoundStudy, last: Preregistration) -> Iterator[Deviation]:
    study = last.study
    for experiment in dict.fromkeys(last.designs.values()):
        done = _finished(looked, experiment)
        if len(done) != study.participants:
            yield Deviation(
                kind="participants",
                what=f"participants who finished {experiment}, given to this analysis and not excluded by hand",
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
    came = {run.code for run in (*looked.runs, *looked.elsewhere)}
    for code, member in looked.registered.members.items():
        if member.left is not None:
            yield Deviation(kind="participants", what=f"comes no more: {member.left}", who=(code,))
        judged = None if member.left is not None and code not in came else member.facts
        for reason in () if judged is None else eligible(judged, study.eligibility):
            yield Deviation(kind="participants", what=f"took part, not eligible: {reason}", who=(code,))


def _orders(looked: FoundStudy, last: Preregistration) -> Iterator[Deviation]:
    """Which experiments people did not do in the order of the study, each with everybody of whom it holds."""
    order, found = list(dict.fromkeys(last.designs.values())), dict[str, list[str]]()
    runs = [run for run in (*looked.runs, *looked.elsewhere) if _counts(looked, run.file, run.file.experiment)]
    for code in dict.fromkeys(run.code for run in runs):
        unread = [one.experiment for one in (*looked.unread, *looked.unread_elsewhere) if one.participant == code]
        states = {name: RunProgress(experiment=name, state="unreadable") for name in unread}
        states |= {run.file.experiment: run.progress for run in runs if run.code == code}
        every = tuple(states.get(name, RunProgress(experiment=name, state="not begun")) for name in order)
        for how in order_broken(Participant(participant_id=code, runs=every)):
            found.setdefault(how, []).append(code)
    for how, codes in found.items():
        yield Deviation(kind="order", what=f"{how}, which comes first", who=tuple(codes))


def _finished(looked: FoundStudy, experiment: str) -> list[str]:
    """Who finished an experiment and is not excluded by hand, in the order in which they began."""
    return [run.code for run in looked.runs if run.finished and _counts(looked, run.file, experiment)]


def _unfinished(looked: FoundStudy, experiment: str) -> list[str]:
    """Who began an experiment, did not finish it, with a table or without, and is not excluded by hand."""
    files = [*(run.file for run in looked.runs if not run.finished), *looked.blank]
    return [file.participant for file in files if _counts(looked, file, experiment)]


def _counts(looked: FoundStudy, file: RunFile, experiment: str) -> bool:
    return file.kind == "run" and file.experiment == experiment and file.participant not in looked.excluded


def _exclusions(looked: FoundStudy) -> Iterator[Deviation]:
    """Exclusions by hand, logs that cannot be used, and runs that were set aside."""
    for code, reason in looked.excluded.items():
        yield Deviation(kind="exclusion", what=f"excluded by hand: {reason}", who=(code,))
    for run in looked.runs:
        if run.file.kind == "set aside":
            what = f"an unfinished run of {run.file.experiment} was set aside"
            yield Deviation(kind="exclusion", what=what, who=(run.code,))
    for problem in looked.logs.problems:
        person, place = (problem.participant, problem.experiment), real_place(journal_of(str(problem.file)))
        mine = problem.study == str(looked.results) and all(person) and place not in looked.strangers
        if mine and problem.participant not in looked.excluded:
            why = problem.message.removesuffix(f"; {APART}").replace(f"{problem.file.parent}{os.sep}", "")
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
