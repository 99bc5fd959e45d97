"""The logs of designs: each is read by the design that stands in the first line of its journal, beside it."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from analysis.logs.cell_rules import FEWEST_ALIKE, all_alike, as_moment, cell_fault, cell_value, no_date, too_early
from analysis.logs.files import BadLogError, check_length, check_name, code_in_name, experiment_in_name
from analysis.logs.journals import Beside, check_journals_name, journal_beside, journal_of
from analysis.logs.names import gun_labels
from device.messages import first_few
from experiments.config.door import ConfigError, checked_table
from experiments.config.setup import sha256
from experiments.design.config import DesignConfig
from experiments.design.plan import Condition, Plan, Trial
from experiments.record import journal
from experiments.record.design_columns import columns
from experiments.record.head_design import began_with
from experiments.record.journal import Head, JournalError
from experiments.record.tables import CLOCK_SET_BACK, TABLES, Column, went_back
from experiments.study.changes import FileValues, changed_keys, plain_value
from experiments.study.preregistration import read_chain
from experiments.tasks.questions import correct_columns, is_right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DesignLogs:
    """All logs of one design: a row a trial, with the columns of the design and the study; empty cells are NA."""

    design: DesignConfig
    table: pd.DataFrame
    gun_labels: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignLog:
    """One log that keeps every rule; `key` is the same for logs that can be analysed together.

    `journal` is the one beside it.
    """

    code: str
    design: DesignConfig
    key: str
    journal: Beside
    rows: tuple[Mapping[str, object], ...]
    gun_labels: Mapping[str, str]


def is_of_design(path: str) -> bool:
    """Whether a file's name is that of a design's log: of any experiment but the two that have tables of their own."""
    return experiment_in_name(path) not in ("", *TABLES)


def read_design_log(path: str, content: bytes | BadLogError) -> DesignLog:
    """A log and its design. `BadLogError`: it breaks a rule, or nothing says what its columns mean."""
    if isinstance(content, BadLogError):
        raise content
    check_length(content)
    data, design, head = _design_of(path, content)
    rows = tuple(_rows(content, design))
    code = _code(path, rows)
    _check_plan(design, head.plan, rows)
    _check_times(design, rows)
    _check_onsets(rows)
    beside = journal_beside(data, path, content)
    return DesignLog(
        code=code,
        design=design,
        key=design_key(design),
        rows=rows,
        journal=beside,
        gun_labels=gun_labels(head),
    )


def _design_of(path: str, content: bytes) -> tuple[bytes, DesignConfig, Head]:
    """The bytes of the journal beside a log, the design in its first line, and that line."""
    beside = Path(journal_of(path))
    if not beside.is_file():
        check_name(path, _experiment_in(content) or experiment_in_name(path))
        raise BadLogError(f"there is no {beside.name} beside it, which says what the columns mean; keep both together")
    try:
        data = journal.journal_bytes(beside)
        head = journal.head_of(beside, data)
        if head is None:
            raise BadLogError(f"{beside.name} has no whole first line, so nothing says what the columns mean")
        check_journals_name(str(beside), head.plan, "its journal ")
        return data, began_with(head), head
    except JournalError as error:
        raise BadLogError(str(error)) from error


def _experiment_in(content: bytes) -> str:
    """Of which experiment the rows of a table say that it is; empty if they do not say one."""
    with suppress(UnicodeDecodeError, csv.Error):
        named = {row.get("experiment") or "" for row in csv.DictReader(content.decode("utf-8-sig").splitlines())}
        return next(iter(named)) if len(named) == 1 else ""
    return ""


_TOGETHER = ("design", "factors", "order", "procedure", "trial", "questions", "table")
"""What logs share that can be analysed together."""
ONE_DESIGN = "logs of one design are analysed together"
"""The rule that leaves out a sound log of another design."""
APART = "analyse it apart: name the logs of its design in a call of their own"
_KEYS_TOLD = 5


def design_key(design: DesignConfig) -> str:
    """The same for designs whose logs can be analysed together."""
    return sha256(_shared(design))


def _shared(design: DesignConfig) -> FileValues:
    return design.model_dump(mode="json", include=set(_TOGETHER))


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenDesign:
    """A design as a study's last preregistration freezes it; `by` names that."""

    design: DesignConfig
    key: str
    by: str


FrozenByStudy = Mapping[str, Mapping[str, FrozenDesign]]
"""By the name of a study, its frozen designs by theirs."""


def frozen_designs(folder: Path) -> dict[str, FrozenDesign]:
    """The designs that are frozen in a study, as last amended, by their names."""
    found = dict[str, FrozenDesign]()
    last = read_chain(folder).last
    if last is None:
        return found
    for file in last.designs:
        with suppress(ConfigError):  # of a version that had other keys
            design = checked_table(DesignConfig, dict(last.files[file]), file)
            by = f"preregistration {last.number}"
            found[design.design] = FrozenDesign(design=design, key=design_key(design), by=by)
    return found


def _another_design(design: DesignConfig, kept: DesignConfig, whose: str, note: str = "") -> str:
    """What is said of a log of another design than one to be kept: the keys that differ, and which it is."""
    keys = [
        f"{change.key} = {plain_value(change.now)}, not {plain_value(change.frozen)}"
        for change in changed_keys(design.design, _shared(kept), _shared(design))
    ]
    return (
        f"was made with another design {design.design!r} than {whose}: {first_few(keys, _KEYS_TOLD)} "
        f"(rule: {ONE_DESIGN}){note}; {APART}"
    )


def _rows(content: bytes, design: DesignConfig) -> Iterator[dict[str, object]]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadLogError(f"byte {error.start} is not UTF-8") from error
    lines = csv.reader(text.splitlines(keepends=True), strict=True)
    table = columns(design)
    try:
        header = next(lines, [])
        if header != [column.name for column in table]:
            raise BadLogError(_header_fault(header, table), 1)
        for cells in lines:
            if len(cells) != len(table):
                message = f"{len(cells)} cells (rule: as many as the header's {len(table)})"
                raise BadLogError(message, lines.line_num)
            yield {column.name: _cell(column, cell, lines.line_num) for column, cell in zip(table, cells, strict=True)}
    except csv.Error as error:
        raise BadLogError(f"not CSV as RFC 4180 has it ({error})", lines.line_num) from error


def _header_fault(header: Sequence[str], table: Sequence[Column]) -> str:
    missing = [column.name for column in table if column.name not in header]
    surplus = [name for name in header if name not in {column.name for column in table}]
    said = [f"missing are {', '.join(missing)}"] if missing else []
    said += [f"surplus are {', '.join(surplus)}"] if surplus else []
    return f"the header is not that of the design: {'; '.join(said) or 'the order differs'}"


def _cell(column: Column, text: str, line: int) -> object:
    fault = cell_fault(column, text)
    if fault:
        raise BadLogError(fault, line, column.name)
    return cell_value(column, text)


def _code(path: str, rows: Sequence[Mapping[str, object]]) -> str:
    codes = {str(row["participant_id"]) for row in rows}
    if len(codes) != 1:
        raise BadLogError(
            f"participants are {', '.join(sorted(codes)) or 'none'} (rule: one a log)", None, "participant_id"
        )
    code, named = codes.pop(), code_in_name(path)
    if named is not None and named != code:
        raise BadLogError(f"participant {code!r} in a file named for {named!r}", None, "participant_id")
    return code


def _check_plan(design: DesignConfig, plan: Plan, rows: Sequence[Mapping[str, object]]) -> None:
    """Every planned trial has its row, and an answer is right where it says so."""
    if len(rows) != len(plan.trials):
        raise BadLogError(f"{len(rows)} rows (rule: one for each of the {len(plan.trials)} planned trials)")
    scored = correct_columns(design.questions)
    for line, (row, planned) in enumerate(zip(rows, plan.trials, strict=True), start=2):
        trial = planned.with_chosen(_chosen(design, planned, row))
        levels = {name: row[name] for name, _ in trial.levels if name in row}
        wrong = [name for name, level in trial.levels if name in levels and levels[name] != level]
        if wrong or row["trial"] != trial.trial:
            name = wrong[0] if wrong else "trial"
            raise BadLogError(f"{row[name]!r} is not what was planned for this row", line, name)
        for question, column in scored.items():
            said: object = row[question]
            right = is_right(design, design.questions[question], trial, said if isinstance(said, str) else None)
            if row[column] != (None if right is None else int(right)):
                raise BadLogError(f"{row[column]!r} does not follow from {question} {said!r}", line, column)


def _chosen(design: DesignConfig, planned: Trial, row: Mapping[str, object]) -> Condition:
    """The levels that a procedure chose for a trial, as its row has them."""
    felt = ((name, row[name]) for name in design.chosen_names) if planned.track else ()
    return tuple((name, level) for name, level in felt if isinstance(level, str | float))


def _check_times(design: DesignConfig, rows: Sequence[Mapping[str, object]]) -> None:
    for name in (f"{name}_time_s" for name, question in design.questions.items() if question.named_answers):
        times = [row[name] for row in rows if row[name] is not None]
        if len(times) >= FEWEST_ALIKE and len(set(times)) == 1:
            raise BadLogError(all_alike(len(times), float(str(times[0]))), 2, name)


def _check_onsets(rows: Sequence[Mapping[str, object]]) -> None:
    onsets = [str(row["onset_utc"] or "") for row in rows]
    for line, text in enumerate(onsets, start=2):
        if text and as_moment(text) is None:
            raise BadLogError(no_date(text), line, "onset_utc")
    for place in went_back(rows, as_moment):
        if CLOCK_SET_BACK not in str(rows[place]["flags"] or "").split():
            raise BadLogError(too_early(onsets[place]), place + 2, "onset_utc")


def logs_by_design(
    logs: Sequence[tuple[DesignLog, str]], frozen: FrozenByStudy, *, several: bool
) -> tuple[list[DesignLogs], dict[tuple[str, str], str]]:
    """The logs by design, each with its study; and by study and key what is said of those of another design.

    A study that froze a design is there with the logs of that alone. Of several designs of a name then one that is
    frozen is analysed, else that of most logs. With several studies a participant is `study/code`.
    """
    named = dict[str, list[tuple[DesignLog, str]]]()
    for log, study in logs:
        named.setdefault(log.design.design, []).append((log, study))
    found, others = [], dict[tuple[str, str], str]()
    for name, some in named.items():
        own = {study: of_study[name] for study, of_study in frozen.items() if name in of_study}
        kept = [(log, study) for log, study in some if study not in own or log.key == own[study].key] or some
        key = _main(kept, own)
        used = [(log, study) for log, study in kept if log.key == key]
        used_keys = {(study, log.key) for log, study in used}
        rest = [(log, study) for log, study in some if (study, log.key) not in used_keys]
        others |= _told_of_others(rest, used[0][0], own, several=several)
        found.append(_together(used, several=several))
    return found, others


def _main(logs: Sequence[tuple[DesignLog, str]], own: Mapping[str, FrozenDesign]) -> str:
    """The key of the design that is analysed."""
    counts, frozen = Counter(log.key for log, _ in logs), {one.key for one in own.values()}
    return max(counts, key=lambda key: (key in frozen, counts[key]))


def _told_of_others(
    logs: Sequence[tuple[DesignLog, str]], main: DesignLog, own: Mapping[str, FrozenDesign], *, several: bool
) -> dict[tuple[str, str], str]:
    """By study and key, why logs are left out: their study froze another design, or another design is analysed."""

    def by(study: str) -> str:
        return f"{own[study].by} of {study!r}" if several else own[study].by

    frozen = next((f"{by(study)} freezes" for study, one in own.items() if one.key == main.key), None)
    told = {}
    for log, study in logs:
        if study in own and log.key != own[study].key:
            told[study, log.key] = _another_design(log.design, own[study].design, f"{by(study)} freezes")
        else:
            note = f", though it is as {by(study)} freezes it" if study in own else ""
            whose = frozen or "most logs of that name"
            told[study, log.key] = _another_design(log.design, main.design, whose, note)
    return told


def _together(logs: Sequence[tuple[DesignLog, str]], *, several: bool) -> DesignLogs:
    """Logs of one design as one table."""
    rows = [
        {**row, "participant_id": f"{study}/{log.code}" if several else log.code, "study": study}
        for log, study in logs
        for row in log.rows
    ]
    first = logs[0][0]
    names = [column.name for column in columns(first.design)]
    table = pd.DataFrame(rows, columns=["study", *names])
    return DesignLogs(design=first.design, table=table, gun_labels=first.gun_labels)
