"""Whose data an experiment can use: participants with every answer under every method.

    [trials]                                   # trials that do not count
    drop_flags = ["device-error", "interrupted"]
    response_time_min_s = 0.2                  # bounds bind the participant's own times only
    response_time_max_s = 10.0
    drop_unanswered = true                     # without it, one unanswered trial leaves the participant out

    [participants]                             # participants who do not count
    min_kept_share = 0.8                       # of their trials, after dropping
    max_same_response_share = 0.95             # who says always the same

    [[accuracy]]                               # a method that everybody should feel
    method = "asymmetric-2"
    min_share = 0.6                            # of its answered trials correct, both directions

    [[excluded]]                               # by code; `study` if several are read
    code = "P03"
    reason = "left-handed"

Every key may be missing; `configs/examples/rules.toml` is there to copy. Trials are dropped first, of both experiments
where they have the columns; then participants.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from analysis.logs.files import Problem, below, folder_above, name_below
from analysis.logs.mapped_people import ShortText
from analysis.logs.measures import MEASURES
from analysis.logs.reading import Logs
from analysis.logs.texts import STUDY
from analysis.stats.arrays import BoolArray
from analysis.stats.cells import codes_of, places_among
from analysis.times.own_trials import timed
from experiments.config.door import Model, Seconds, Share
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
    seen = np.zeros((len(codes), len(methods)), dtype=np.bool_)
    seen[person[counted], method[counted]] = True
    absent = {
        codes[i]: (
            f"{measure.absent} {', '.join(name for name, there in zip(methods, seen[i], strict=True) if not there)}",
            *_ABSENT,
        )
        for i in np.flatnonzero(~seen.all(axis=1))
    }
    return absent | lacking


FINISHED = "a run is finished"
"""The rule that leaves out who has begun."""


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


_RULE = re.compile(r"\(rule: (.*)\)")
_COMMAND = re.compile(r"`((?:recoil |--|include_)[^`]*)`")


def _by_problem(logs: Logs, one: Problem, name: Path) -> LeftOut:
    """A problem in the words of an exclusion: its rule and the command it names, if it does."""
    said = below(one, name.parent)
    rule, command = _RULE.search(said), _COMMAND.search(said)
    correct = "correct it (DATA_DICTIONARY.md says what it may hold) and analyse again"
    return LeftOut(
        experiment=one.experiment,
        participant=logs.person(one.study, one.participant) if one.participant else "",
        reason=said,
        rule=rule[1] if rule else "a log can be read and trusted",
        remedy=f"`{command[1]}`" if command else correct,
        file=name.as_posix(),
    )


def by_study(logs: Logs) -> dict[str, Logs]:
    """The logs of each study with plain codes, by the study's name; nothing if there is one study only."""
    names = sorted({str(name) for table in logs.tables.values() for name in table[STUDY].unique()})
    if len(names) < 2:
        return {}
    alone = replace(logs, apart=())
    return {
        name: replace(alone, trials=_alone(logs.trials, name), ratings=_alone(logs.ratings, name)) for name in names
    }


def _alone(table: pd.DataFrame, study: str) -> pd.DataFrame:
    rows = tidied(table[table[STUDY] == study]).reset_index(drop=True)
    codes = rows["participant_id"].cat.rename_categories(lambda code: str(code).removeprefix(f"{study}/"))
    return rows.assign(participant_id=codes)


class TrialRules(Model):
    """Which trials do not count."""

    drop_flags: tuple[ShortText, ...] = ()
    response_time_min_s: Seconds | None = None
    response_time_max_s: Seconds | None = None
    drop_unanswered: bool = False

    @model_validator(mode="after")
    def _bounds_leave_something(self) -> Self:
        low, high = self.response_time_min_s, self.response_time_max_s
        if low is not None and high is not None and low >= high:
            raise ValueError(f"response_time_min_s = {low:g} must be below response_time_max_s = {high:g}")
        return self


class ParticipantRules(Model):
    """Which participants do not count."""

    min_kept_share: Share | None = None
    max_same_response_share: Share | None = None


class AccuracyRule(Model):
    """How much of a method's trials a participant has to get right."""

    method: ShortText
    min_share: Share


class ExcludedCode(Model):
    """A participant who does not count, and why."""

    code: Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,32}$")]
    study: ShortText | None = None
    reason: ShortText


class Rules(Model):
    """All rules of a file."""

    trials: TrialRules = TrialRules()
    participants: ParticipantRules = ParticipantRules()
    accuracy: tuple[AccuracyRule, ...] = ()
    excluded: tuple[ExcludedCode, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptTrials:
    """How many trials of an experiment were recorded, and how many of them are kept."""

    recorded: int
    kept: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ExclusionEffect:
    """What rules did: the logs that are left, who was left out, and of each experiment how many trials were kept.

    `dropped` counts dropped trials by experiment, person and rule.
    """

    logs: Logs
    excluded: tuple[LeftOut, ...]
    dropped: Mapping[str, Mapping[str, Mapping[str, int]]]
    trials: Mapping[str, KeptTrials]
    warnings: tuple[str, ...]


def apply_rules(logs: Logs, rules: Rules) -> ExclusionEffect:
    """Leave out what the rules say. A trial that several rules drop counts for the first of them."""
    excluded: list[LeftOut] = []
    dropped: dict[str, dict[str, dict[str, int]]] = {}
    trials: dict[str, KeptTrials] = {}
    tables = logs.tables
    for experiment, table in logs.tables.items():
        if len(table):
            kept, dropped[experiment] = _without_trials(table, rules.trials, experiment)
            found = [*_reasons(table, kept, rules, experiment)]
            reasons = {code: (rule, reason) for code, rule, reason in reversed(found)}  # the first rule is told
            excluded += [
                LeftOut(
                    experiment=experiment,
                    participant=code,
                    reason=reason,
                    rule=rule,
                    remedy=f"change or remove `{rule}` in the file given with --rules",
                )
                for code, (rule, reason) in sorted(reasons.items())
            ]
            tables[experiment] = rows_without(kept, reasons) if reasons else kept
            trials[experiment] = KeptTrials(recorded=len(table), kept=len(kept))
    return ExclusionEffect(
        logs=replace(logs, trials=tables["direction"], ratings=tables["preference"]),
        excluded=tuple(excluded),
        dropped=dropped,
        trials=trials,
        warnings=tuple(_idle(logs, rules)),
    )


def _without_trials(
    table: pd.DataFrame, rules: TrialRules, experiment: str
) -> tuple[pd.DataFrame, dict[str, dict[str, int]]]:
    gone = np.zeros(len(table), dtype=np.bool_)
    counts: dict[str, dict[str, int]] = {}
    for rule, breaks in _trial_rules(table, rules, experiment):
        new = breaks & ~gone
        gone |= new
        for code, count in table.loc[new, "participant_id"].astype(str).value_counts(sort=False).items():
            counts.setdefault(str(code), {})[rule] = int(count)
    kept = tidied(table[~gone]) if gone.any() else table
    return kept, dict(sorted(counts.items()))


def _trial_rules(table: pd.DataFrame, rules: TrialRules, experiment: str) -> Iterator[tuple[str, BoolArray]]:
    """Each rule's name, and the rows that break it."""
    if rules.drop_flags:
        unwanted = set(rules.drop_flags)
        marks = table["flags"].fillna("").astype(str)
        bad = {text for text in marks.unique() if unwanted & set(text.split())}
        yield "drop_flags", marks.isin(bad).to_numpy(dtype=np.bool_)
    if not is_rated(experiment):
        own = timed(table).by_own_hand
        time = table["response_time_s"].to_numpy(dtype=np.float64)
        if rules.response_time_min_s is not None:
            yield "response_time_min_s", own & (time < rules.response_time_min_s)
        if rules.response_time_max_s is not None:
            yield "response_time_max_s", own & (time > rules.response_time_max_s)
    if rules.drop_unanswered:
        yield "drop_unanswered", table[MEASURES[experiment].score].isna().to_numpy(dtype=np.bool_)


BY_HAND = "excluded"
"""The rule that lists people."""


def _reasons(table: pd.DataFrame, kept: pd.DataFrame, rules: Rules, experiment: str) -> Iterator[tuple[str, str, str]]:
    """Participant, rule and reason; who is listed by hand is told so, whatever else holds of them."""
    for listed in rules.excluded:
        for code in _codes(table, listed):
            yield code, BY_HAND, listed.reason
    yield from _too_few(table, kept, rules.participants.min_kept_share)
    if not is_rated(experiment):
        yield from _too_uniform(kept, rules.participants.max_same_response_share)
        for accuracy in rules.accuracy:
            yield from _too_often_wrong(kept, accuracy)


def _too_few(table: pd.DataFrame, kept: pd.DataFrame, least: float | None) -> Iterator[tuple[str, str, str]]:
    """Who has too few trials left; whoever has none is gone in any case, and is to be listed."""
    recorded = table["participant_id"].astype(str).value_counts(sort=False)
    left = kept["participant_id"].astype(str).value_counts(sort=False).reindex(recorded.index, fill_value=0)
    rule = f"at least {least:g} of them" if least else "at least one"
    for code, count, of in zip(recorded.index, left.to_list(), recorded.to_list(), strict=True):
        if count == 0 or count < (least or 0.0) * of:
            yield str(code), "min_kept_share", f"{count} of {of} trials kept (rule: {rule})"


def _too_uniform(kept: pd.DataFrame, most: float | None) -> Iterator[tuple[str, str, str]]:
    if most is None:
        return
    forward = (kept["response"] == "forward").where(kept["response"].notna())
    shares = forward.astype("float64").groupby(kept["participant_id"].astype(str)).mean()
    same = shares.where(shares >= 0.5, 1.0 - shares)
    for code, share in same[same > most].items():
        yield str(code), "max_same_response_share", f"{share:.4g} of the answers are the same (rule: at most {most:g})"


def _too_often_wrong(kept: pd.DataFrame, rule: AccuracyRule) -> Iterator[tuple[str, str, str]]:
    rows = kept[kept["method"] == rule.method]
    shares = rows["correct"].astype("float64").groupby(rows["participant_id"].astype(str)).mean()
    for code, share in shares[shares < rule.min_share].items():
        yield str(code), "accuracy", f"{share:.4g} correct with {rule.method} (rule: at least {rule.min_share:g})"


def _codes(table: pd.DataFrame, listed: ExcludedCode) -> list[str]:
    """The participants of a table that an entry means."""
    people = table[["participant_id", STUDY]].drop_duplicates().astype(str).itertuples(index=False)
    return [
        str(person)
        for person, study in people
        if str(person).rpartition("/")[2] == listed.code and listed.study in (None, study)
    ]


def _idle(logs: Logs, rules: Rules) -> Iterator[str]:
    """Entries that mean nobody: a code that is mistyped must not go unseen."""
    for listed in rules.excluded:
        if not any(_codes(table, listed) for table in logs.tables.values()):
            yield f"the rules exclude {listed.code}, who has no log here"
    for accuracy in rules.accuracy:
        if accuracy.method not in set(logs.trials["method"]):
            yield f"the rules ask for accuracy with {accuracy.method}, which no direction log has"
