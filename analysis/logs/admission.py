"""What was read so far: whose logs are taken, whose are left out, and why."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from analysis.logs.doubles import ToldRows, doubles_among, told_by_block
from analysis.logs.doubtful_times import doubts_of_block
from analysis.logs.files import (
    FULL_ONSET,
    BadLogError,
    Problem,
    check_name,
    code_in_name,
    experiment_in_name,
    results_above,
    seen_from,
)
from analysis.logs.journals import Beside, RunFile, begins_with, journal_of, with_data
from analysis.logs.kinds import IN_REGISTER, kept_out, kinds_of
from analysis.logs.rules import Log
from analysis.logs.setups import SetupOfLog, changed_setups
from analysis.logs.suspicions import copies, other_log
from analysis.logs.texts import Block
from experiments.record.tables import DataKind
from experiments.study import register
from experiments.study.study import Member

if TYPE_CHECKING:
    from analysis.logs.column_map import MappedLog

LOGS_A_FILE = 1 << 20
"""Numbers of logs are so far apart from file to file: a mapped file may hold several."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitingFile:
    """A file, its number, the folder that stands for its study, and its content, or why there is none."""

    number: int
    path: str
    study: str
    content: bytes | BadLogError

    @property
    def file(self) -> Path:
        """The same as a path: of ten thousand, few are asked for."""
        return Path(self.path)


@dataclass(slots=True, kw_only=True)
class Batch:
    """What is in some files: the rows of good logs, and by number each log, or what is wrong with it."""

    blocks: list[Block] = field(default_factory=list)
    logs: dict[int, Log | BadLogError] = field(default_factory=dict)
    mapped: dict[int, MappedLog] = field(default_factory=dict)
    """Logs of other programs."""
    journals: dict[int, Beside | None] = field(default_factory=dict)
    """The journals of logs of our own, `None` where there is none."""
    kinds: dict[int, DataKind | None] = field(default_factory=dict)
    """Whose data each good log holds; None where nobody answered."""
    told: dict[str, list[ToldRows]] = field(default_factory=dict)
    """What the rows of logs tell, by experiment: to see copies."""
    doubts: dict[int, str] = field(default_factory=dict)
    """What is wrong with the times of logs that keep every other rule."""

    def take(self, block: Block, logs: Mapping[int, Log | BadLogError]) -> None:
        """Take over checked rows, and how it is with each log."""
        self.blocks.append(block)
        self.logs |= logs
        self.kinds |= dict(kinds_of(block))
        self.doubts |= doubts_of_block(block)
        if told := told_by_block(block):
            self.told.setdefault(block.experiment, []).append(told)


@dataclass(slots=True, kw_only=True)
class LogsSoFar:
    """What was read so far. Logs are numbered in the order of their files."""

    problems: list[Problem]
    blocks: list[Block] = field(default_factory=list)
    studies: dict[int, str] = field(default_factory=dict)
    """The study's folder of each good log."""
    codes: dict[int, str] = field(default_factory=dict)
    experiments: dict[int, str] = field(default_factory=dict)
    kinds: dict[int, DataKind | None] = field(default_factory=dict)
    """Whose data each good log holds; None where nobody answered."""
    earlier: dict[tuple[str, str, str], tuple[int, ...]] = field(default_factory=dict)
    """The logs of each study, experiment and code, upper and lower case alike."""
    paths: dict[int, str] = field(default_factory=dict)
    """The files of good logs, numbered."""
    mapped: set[int] = field(default_factory=set)
    """The numbers of the logs that other programs wrote."""
    given: Mapping[str, int]
    """For each path its place among those that were given: of copies, the one that was named first stays."""
    contents: dict[int, str] = field(default_factory=dict)
    """The file that first held each content."""
    same: dict[str, set[str]] = field(default_factory=dict)
    """The files that hold what the first does, with the first."""
    copied: set[tuple[str, str, str]] = field(default_factory=set)
    """Folder, code and experiment of the logs that are files copied: nobody took part in these."""
    members: dict[str, Mapping[str, Member]] = field(default_factory=dict)
    """Who stands in the register of each results folder."""
    remarks: list[Problem] = field(default_factory=list)
    proven: dict[int, tuple[str, str, bool]] = field(default_factory=dict)
    """Folder and code of each good log of our own, and whether it has a journal."""
    setups: dict[int, str] = field(default_factory=dict)
    """The hash of the setup of each good log that has a journal."""
    originals: dict[int, str] = field(default_factory=dict)
    """Of each good log whose journal is redacted, the hash of the first line of the original."""
    told: dict[str, list[ToldRows]] = field(default_factory=dict)
    """What the rows of logs tell, by experiment."""

    def add(self, waiting: Sequence[WaitingFile], batch: Batch) -> None:
        """Take over the logs of some files."""
        self.blocks += batch.blocks
        self.kinds |= batch.kinds
        self.mapped |= batch.mapped.keys()
        for experiment, told in batch.told.items():
            self.told.setdefault(experiment, []).extend(told)
        files = {one.number: one for one in waiting}
        for number, log in sorted(batch.logs.items()):
            one, mapped = files[number // LOGS_A_FILE], batch.mapped.get(number)
            study = (mapped and mapped.study) or one.study
            try:
                if isinstance(log, BadLogError):
                    raise log
                if number in batch.journals:
                    check_name(one.path, log.experiment)
                self.doubt(one, log, batch.doubts.get(number, ""), proven=batch.journals.get(number) is not None)
                self.admit(number, one, log, study)
            except BadLogError as bad:
                code = mapped.participant if mapped else code_in_name(one.path) or ""
                experiment = mapped.experiment if mapped else experiment_in_name(one.path)
                self.problems.append(bad.of(one.file, code, experiment, study))
            else:
                if number in batch.journals:
                    self.note(number, one, log, batch.journals[number])

    def doubt(self, one: WaitingFile, log: Log, said: str, *, proven: bool) -> None:
        """Doubtful times leave a log out by `BadLogError`, unless its journal has proven it."""
        if said and not proven:
            raise BadLogError(said)
        if said:
            self.remarks.append(BadLogError(said).of(one.file, log.code, log.experiment, one.study))

    def note(self, number: int, one: WaitingFile, log: Log, beside: Beside | None) -> None:
        """The journal of a log that was admitted: whether there is one, its setup, and what there is to say of it."""
        self.proven[number] = one.study, log.code, beside is not None
        if beside is not None:
            is_synthetic = self.kinds.get(number) == "synthetic"
            self.setups[number] = f"{beside.setup}{beside.laws if is_synthetic else ''}"
            if beside.original:
                self.originals[number] = beside.original
            if beside.said:
                self.remarks.append(BadLogError(beside.said).of(one.file, log.code, log.experiment, one.study))

    def changed_setups(self) -> list[Problem]:
        """Which logs that count together were made with several setups, and what differs."""
        return changed_setups(
            SetupOfLog(
                study=study,
                kind=self.kinds[number],
                experiment=self.experiments[number],
                code=self.codes[number],
                path=self.paths[number // LOGS_A_FILE],
                setup=self.setups.get(number, ""),
            )
            for number, study in self.studies.items()
            if number // LOGS_A_FILE in self.paths
        )

    def admit(self, number: int, one: WaitingFile, log: Log, study: str) -> None:
        """Take a participant's log of an experiment. `BadLogError`: they are excluded, or have one already."""
        results = results_above(one.path) or str(one.file.parent.parent)
        member = self.known(results).get(log.code)
        if member is not None and (reason := member.excluded) is not None:
            how = f"`recoil study DIR --readmit {log.code} --reason TEXT`"
            said = f"participant {log.code} is excluded: {reason} ({how} readmits them)"
            raise BadLogError(f"{said} (rule: {IN_REGISTER})")
        self._check_new(study, log, number)
        self._note_copy(one)
        self.studies[number], self.codes[number], self.experiments[number] = study, log.code, log.experiment
        self.paths[number // LOGS_A_FILE] = one.path

    def known(self, results: str) -> Mapping[str, Member]:
        """Who stands in the register of a results folder, as far as it can be read; what cannot is a problem."""
        if results not in self.members:
            found = register.read_register(Path(results))
            if found.problem:
                said = f"{found.problem.removeprefix(f'{found.path}: ')}; whom it excludes there is not known"
                self.problems.append(Problem(file=found.path, line=None, column=None, message=said))
            self.members[results] = found.members
        return self.members[results]

    def _check_new(self, study: str, log: Log, number: int) -> None:
        key = study, log.experiment, log.code.casefold()
        earlier = self.earlier.get(key, ())
        first = next((one for one in earlier if self._go_together(one, number)), None)
        if first is not None:
            there = self.codes[first]
            name = f"participant {log.code!r}" if log.code == there else f"participant {log.code!r} (there {there!r})"
            rule = "(rule: one log a participant and experiment, upper and lower case alike)"
            message = f"{name} has a {log.experiment} log already in {self.paths[first // LOGS_A_FILE]} {rule}"
            raise BadLogError(message, None, "participant_id")
        self.earlier[key] = (*earlier, number)

    def _note_copy(self, one: WaitingFile) -> None:
        """The same table, with onsets to the µs, may stand elsewhere, as in a copy of the folder."""
        if isinstance(one.content, bytes):
            first = self.contents.setdefault(hash(one.content), one.path)
            if first != one.path and FULL_ONSET.search(one.content):
                self.same.setdefault(first, {first}).add(one.path)

    def leave_copies(self, runs: Iterable[RunFile]) -> None:
        """Leave out the logs that hold what others hold; `runs` are those whose journals were found."""
        self._leave_redacted(runs)
        self._leave_same()
        proven = {number for number, (_, _, has_journal) in self.proven.items() if has_journal}

        def rank(number: int) -> tuple[bool, int]:
            return number not in proven, self.given.get(self.paths[number // LOGS_A_FILE], 0)

        for experiment, told in self.told.items():
            mine = [number for number in self.studies if self.experiments[number] == experiment]
            for number, said in copies(doubles_among(told, mine), proven, rank, self._seen_from):
                self._leave(number, said)

    def _leave_same(self) -> None:
        """Of files that are alike byte for byte the one named first stays, of these the one in fewest folders."""
        stays = dict[str, str]()
        for paths in self.same.values():
            first, *others = sorted(paths, key=self._in_order)
            stays |= dict.fromkeys(others, first)
        for number in [*self.studies] if stays else ():
            path = self.paths[number // LOGS_A_FILE]
            if path in stays:
                self._leave_copy(number, f"holds what {seen_from(stays[path], path)} holds, byte for byte")

    def _leave_redacted(self, runs: Iterable[RunFile]) -> None:
        """A log of an archive goes where the journal is that its own was made from, or another that was made from it.

        The original may be of somebody who is left out, or set aside: nobody comes back by a copy. Of several archives
        the one that has most of the run stays.
        """
        stays, journals = dict[str, str](), self._journals(runs) if self.originals else {}
        redacted = ((self.paths[number // LOGS_A_FILE], number) for number in self.originals if number in self.studies)
        for path, number in sorted(redacted, key=lambda one: (-_size(journal_of(one[0])), *self._in_order(one[0]))):
            line, others = self.originals[number], journals[self.codes[number], self.experiments[number]]
            there = (one for one in others - {journal_of(path)} if begins_with(one, line))
            first = min(there, key=self._in_order, default="") or stays.setdefault(line, path)
            if first != path:
                self._leave_copy(number, f"is a redacted copy of the run in {seen_from(first, path)}")

    def _journals(self, runs: Iterable[RunFile]) -> Mapping[tuple[str, str], set[str]]:
        """The journals that were found, and those beside logs, good or not, by code and experiment."""
        there = [((run.participant, run.experiment), run.path) for run in runs]
        there += [((one.participant, one.experiment), journal_of(str(one.file))) for one in self.problems]
        for number in self.studies:
            path = journal_of(self.paths[number // LOGS_A_FILE])
            there.append(((self.codes[number], self.experiments[number]), path))
        found: dict[tuple[str, str], set[str]] = {}
        for key, path in there:
            found.setdefault(key, set()).add(path)
        return found

    def _in_order(self, path: str) -> tuple[int, int, str]:
        """Of copies the first in this order stays."""
        return self.given.get(path, 0), path.count(os.sep), path

    def _leave_copy(self, number: int, said: str) -> None:
        """Leave out a copy, which is nobody's: whoever it is of stands in the analysis, or among those left out."""
        self.copied.add((self.studies[number], self.codes[number], self.experiments[number]))
        self._leave(number, f"{said} (rule: a run counts once); read one of both", nobody=True)
        self.proven.pop(number, None)

    def _seen_from(self, number: int, other: int) -> str:
        """What the person of a log is called in what is said of another."""
        return other_log(self.codes[number], self.paths[number // LOGS_A_FILE], self.paths[other // LOGS_A_FILE])

    def _leave(self, number: int, said: str, *, nobody: bool = False) -> None:
        """Leave out a log that was admitted; of `nobody`, its person is not left out with it."""
        if number in self.studies:
            file, study = Path(self.paths[number // LOGS_A_FILE]), self.studies.pop(number)
            code = "" if nobody else self.codes[number]
            problem = BadLogError(said).of(file, code, self.experiments[number], study)
            self.problems.append(replace(problem, data=self.kinds[number]))

    def keep_out(self, first: DataKind) -> None:
        """Leave out the logs of other kinds of data than the first that is there."""
        for number in [*self.studies]:
            kind = self.kinds[number] or first
            if kind != first:
                self._leave(number, kept_out(kind, first))

    def runs_by_kind(self, runs: Iterable[RunFile], first: DataKind) -> Mapping[DataKind, list[RunFile]]:
        """The runs that journals tell of, by the kind of data that they gave; without any, they are of the first.

        Practices and runs that were set aside are with logs of their own kind, if there are any. The runs of logs that
        are copies are those of the logs that stay.
        """
        kinds = {
            (study, self.codes[number], self.experiments[number]): self.kinds[number] or first
            for number, study in self.studies.items()
        }
        there = set(kinds.values())
        found: dict[DataKind, list[RunFile]] = {kind: [] for kind in get_args(DataKind)}
        for run in map(with_data, runs):
            key = run.study, run.participant, run.experiment
            if key not in self.copied:
                found[run.data if run.data in there else kinds.get(key, first)].append(run)
        return found

    def _go_together(self, one: int, other: int) -> bool:
        """Whether two logs may come into one table; where nobody answered, a log goes with all."""
        return self.kinds[one] == self.kinds[other] or None in (self.kinds[one], self.kinds[other])


def _size(path: str) -> int:
    """How long a file is; 0 if that cannot be known."""
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0
