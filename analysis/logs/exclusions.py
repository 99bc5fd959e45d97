"""Whose data an experiment can use: participants with every answer under every method."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.logs.design_logs import APART, ONE_DESIGN, DesignLogs
from analysis.logs.files import Problem, below, folder_above, name_below
from analysis.logs.measures import MEASURES
from analysis.logs.reading import Logs
from analysis.logs.texts import STUDY
from analysis.stats.cells import codes_of, places_among
from experiments.record.tables import is_rated


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """A participant who is left out of an experiment, why, by which rule, and what would take them in.

    `file`: of whom no more is known than the log that cannot be read. What is not known is empty.
    """

    experiment: str
    participant: str
    reason: str
    rule: str = ""
    remedy: str = ""
    file: str = ""


def by_rule(people: Iterable[LeftOut]) -> list[list[LeftOut]]:
    """The people whom one rule leaves out of an experiment, together."""

    def rule(one: LeftOut) -> tuple[str, str, str]:
        return one.experiment, one.rule, one.remedy

    return [[*some] for _, some in groupby(sorted(people, key=rule), key=rule)]


def complete_rows(table: pd.DataFrame, experiment: str, methods: Sequence[str]) -> tuple[pd.DataFrame, list[LeftOut]]:
    """The rows of the participants who answered everything, and the others.

    Every one of the methods must be there, and no other; in direction with forward trials, the only ones that its
    measure uses. `table` is coded.
    """
    reasons = _strayed(table, experiment, methods)
    reasons |= _incomplete(rows_without(table, reasons) if reasons else table, experiment, methods)
    left_out = [
        LeftOut(experiment=experiment, participant=code, reason=reason, rule=rule, remedy=remedy)
        for code, (reason, rule, remedy) in sorted(reasons.items())
    ]
    return (rows_without(table, reasons) if reasons else table), left_out


def rows_without(table: pd.DataFrame, participants: Iterable[str]) -> pd.DataFrame:
    """The rows of all other participants; categories that no longer occur are gone."""
    kept = table[~table["participant_id"].isin(list(participants))]
    return tidied(kept)


def tidied(table: pd.DataFrame) -> pd.DataFrame:
    """The table without categories that do not occur in it: so that none is counted."""
    categories = [name for name in table.columns if isinstance(table[name].dtype, pd.CategoricalDtype)]
    return table.assign(**{name: table[name].cat.remove_unused_categories() for name in categories})


_STRAY = (
    "a method is one that half of the people have",
    "if it is misspelt, correct it, or let [values.method] in the map say what it means; else analyse those who have "
    "other methods apart: name their folders or files in a call of its own",
)
_ABSENT = (
    "everybody has every method",
    "analyse those who have other methods apart: name their folders or files in a call of its own",
)


NOT_COUNTED = (
    "the measure is of forward trials",
    "see whether `direction` says which way each shot went; of backward shots alone there is no test",
)
"""The rule, and what to do, of who has trials with a method, and none of the direction that counts."""


def shared_methods(table: pd.DataFrame) -> set[str]:
    """The methods that a test compares: each is one of half of the people at least.

    What half of them have and half have not is none if it has fewer than half of a method's usual rows: a slip. Where
    no two share one, it is every method.
    """
    rows = table.groupby(["method", "participant_id"], observed=True).size()
    by_method = rows.groupby(level="method", observed=True)
    have, people = by_method.size(), table["participant_id"].nunique()
    slips = (2 * have == people) & (2 * by_method.median() < rows.median())
    shared = {str(method) for method in have.index[(2 * have >= people) & ~slips]}
    return shared or set(map(str, have.index))


def _strayed(table: pd.DataFrame, experiment: str, methods: Sequence[str]) -> dict[str, tuple[str, str, str]]:
    """Who has a method that is none of these, by which rule, and what to do, by code."""
    stray = table[~table["method"].isin(list(methods))]
    pairs = zip(stray["participant_id"].astype(str), stray["method"].astype(str), strict=True)
    rows, people = Counter(pairs), table["participant_id"].nunique()
    have = Counter(method for _, method in rows)
    noun = "ratings of" if is_rated(experiment) else "trials with"
    said: dict[str, list[str]] = {}
    for (code, method), count in rows.items():
        who = f"{have[method]} of {people} people {'has' if have[method] == 1 else 'have'}"
        said.setdefault(code, []).append(f"{noun} {method!r} ({count}), which {who}")
    return {code: ("; ".join(some), *_STRAY) for code, some in said.items()}


def _incomplete(table: pd.DataFrame, experiment: str, methods: Sequence[str]) -> dict[str, tuple[str, str, str]]:
    """Why participants are left out, by which rule, and what to do, by code."""
    measure = MEASURES[experiment]
    codes = table["participant_id"].cat.categories.tolist()
    person, method = codes_of(table["participant_id"]), places_among(table["method"], methods)
    rows = np.bincount(person, minlength=len(codes))
    missing = np.bincount(person[table[measure.score].isna()], minlength=len(codes))
    lacking = {
        codes[i]: (f"{missing[i]} of {rows[i]} {measure.missing}", measure.rule, measure.remedy)
        for i in np.flatnonzero(missing)
    }
    counted = slice(None) if measure.direction is None else np.asarray(table["direction"] == measure.direction)
    seen, there = (np.zeros((len(codes), len(methods)), dtype=np.bool_) for _ in range(2))
    seen[person[counted], method[counted]] = True
    there[person, method] = True
    absent = {
        codes[i]: (
            f"{measure.absent} {', '.join(name for name, has in zip(methods, seen[i], strict=True) if not has)}",
            *(NOT_COUNTED if there[i].all() else _ABSENT),
        )
        for i in np.flatnonzero(~seen.all(axis=1))
    }
    return absent | lacking


IN_NO_TEST = "a test takes who answered in every condition"
"""The rule that leaves somebody out of tests alone."""
FINISHED = "a run is finished"
"""The rule that leaves out who has begun."""
TRUSTED = "a log can be read and trusted"
"""The rule that leaves out whose log is of no use."""


def left_out_by_files(logs: Logs) -> tuple[LeftOut, ...]:
    """Whose logs could not be read, and whose runs are not finished. No path says on which machine.

    What is no log, as a register or a folder without one, leaves nobody out by itself.
    """
    problems = [one for one in logs.problems if one.study]
    if not problems and not logs.begun:
        return ()
    begun_files = [Path(run.file.path) for run in logs.begun]
    root = folder_above([*logs.files, *(one.file for one in problems), *begun_files])
    bad = (_by_problem(logs, one, name_below(one.file, root)) for one in problems)
    names = (name_below(file, root).as_posix() for file in begun_files)
    begun = (
        LeftOut(
            experiment=run.file.experiment,
            participant=logs.person(run.file.study, run.file.participant),
            reason=f"the run has begun and is not finished: {run.far}",
            rule=FINISHED,
            remedy=run.remedy.replace(run.file.path, name),
            file=name,
        )
        for run, name in zip(logs.begun, names, strict=True)
    )
    return (*bad, *begun)


def log_remarks(logs: Logs) -> tuple[str, ...]:
    """What there is to say of logs that count, and of files that leave nobody out. No path says on which machine."""
    said = [*(one for one in logs.problems if not one.study), *logs.remarks, *logs.notes]
    root = folder_above([*logs.files, *(one.file for one in (*logs.problems, *logs.remarks, *logs.notes))])
    return tuple(below(one, name_below(one.file, root).parent) for one in said)


_COMMAND = re.compile(r"`((?:recoil |--|include_)[^`]*)`")


def _by_problem(logs: Logs, one: Problem, name: Path) -> LeftOut:
    """A problem in the words of an exclusion: its rule and the command it names, if it does."""
    said = below(one, name.parent)
    command, rule = _COMMAND.search(said), one.rule or TRUSTED
    correct = "correct it (DATA_DICTIONARY.md says what it may hold) and analyse again"
    return LeftOut(
        experiment=one.experiment,
        participant=logs.person(one.study, one.participant) if one.participant else "",
        reason=said,
        rule=rule,
        remedy=APART if rule == ONE_DESIGN else f"`{command[1]}`" if command else correct,
        file=name.as_posix(),
    )


def by_study(logs: Logs) -> dict[str, Logs]:
    """The logs of each study with plain codes, by the study's name; nothing if there is one study only."""
    every = [*logs.tables.values(), *(one.table for one in logs.designs)]
    names = sorted({str(name) for table in every for name in table[STUDY].unique()})
    if len(names) < 2:
        return {}
    alone = replace(logs, apart=())
    return {
        name: replace(
            alone,
            trials=_alone(logs.trials, name),
            ratings=_alone(logs.ratings, name),
            designs=tuple(_designs_alone(logs, name)),
        )
        for name in names
    }


def _designs_alone(logs: Logs, study: str) -> Iterator[DesignLogs]:
    for one in logs.designs:
        rows = one.table[one.table[STUDY] == study].reset_index(drop=True)
        if len(rows):
            yield replace(one, table=rows.assign(participant_id=rows["participant_id"].str.removeprefix(f"{study}/")))


def _alone(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = tidied(table[table[STUDY] == study]).reset_index(drop=True)
    codes = rows["participant_id"].cat.rename_categories(lambda code: str(code).removeprefix(f"{study}/"))
    return rows.assign(participant_id=codes)
