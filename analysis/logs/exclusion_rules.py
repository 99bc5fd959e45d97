"""The rules of a file: which trials and which participants do not count.

    [trials]                                   # trials that do not count
    drop_flags = ["device-error", "interrupted"]
    response_time_min_s = 0.2                  # bounds bind the participant's own times only
    response_time_max_s = 10.0
    drop_unanswered = true                     # else one leaves a person out of direction and preference

    [participants]                             # participants who do not count
    min_kept_share = 0.8                       # of their trials, after dropping
    max_same_response_share = 0.95             # who says always the same

    [[accuracy]]                               # a method that everybody should feel
    method = "asymmetric-2"
    min_share = 0.6                            # of its answered trials correct, both directions

    [[excluded]]                               # by code; `study` if several are read
    code = "P03"
    reason = "left-handed"

Every key may be missing; `configs/examples/rules.toml` is there to copy. Trials are dropped first, of every experiment
where they have the columns; then participants.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Self

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from analysis.logs.design_logs import DesignLogs
from analysis.logs.exclusions import LeftOut, rows_without, tidied
from analysis.logs.mapped_people import ShortText
from analysis.logs.measures import MEASURES
from analysis.logs.reading import Logs
from analysis.logs.texts import STUDY
from analysis.stats.arrays import BoolArray
from analysis.times.own_trials import timed
from device.messages import first_few
from experiments.config.door import Model, Seconds, Share
from experiments.config.findings import CODE
from experiments.design.config import DesignConfig
from experiments.design.language import METHOD_FACTOR
from experiments.record.tables import ANTICIPATION_S, TRACK_OVER
from experiments.tasks.questions import correct_columns


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

    code: Annotated[str, Field(pattern=f"^{CODE}$")]
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ruled:
    """A table that rules are applied to, and where in it they find what they are about.

    `answers` are the columns of answers, `choices` those of a few named ones, `scored` those of whether one was right;
    `own_times` gives each column of times with the rows in which it is the participant's own. Trials that were not
    presented, as their track had ended, are none that rules are about.
    """

    experiment: str
    table: pd.DataFrame
    answers: tuple[str, ...]
    choices: tuple[str, ...] = ()
    scored: tuple[str, ...] = ()
    own_times: Callable[[pd.DataFrame], Mapping[str, BoolArray]] = lambda _: {}


def _planned(table: pd.DataFrame) -> BoolArray:
    """Which rows are of trials that were to be presented."""
    over = table["flags"].fillna("").astype(str).str.split().map(lambda flags: TRACK_OVER in flags)
    return ~over.to_numpy(dtype=np.bool_)


def _ruled(logs: Logs) -> Iterator[_Ruled]:
    """Every table of the logs that has rows."""
    direction = _Ruled(
        experiment="direction",
        table=logs.trials,
        answers=(MEASURES["direction"].score,),
        choices=("response",),
        scored=("correct",),
        own_times=lambda table: {"response_time_s": timed(table).by_own_hand},
    )
    preference = _Ruled(experiment="preference", table=logs.ratings, answers=(MEASURES["preference"].score,))
    yield from (one for one in (direction, preference, *map(_ruled_design, logs.designs)) if len(one.table))


def _ruled_design(logs: DesignLogs) -> _Ruled:
    """The table of a design, by its questions."""
    questions = logs.design.questions
    choices = tuple(name for name, question in questions.items() if question.named_answers)

    def own_times(table: pd.DataFrame) -> dict[str, BoolArray]:
        valid = {name: table[f"{name}_time_valid"] == 1 for name in choices}
        return {f"{name}_time_s": rows.fillna(value=False).to_numpy(dtype=np.bool_) for name, rows in valid.items()}

    return _Ruled(
        experiment=logs.design.design,
        table=logs.table,
        answers=tuple(questions),
        choices=choices,
        scored=tuple(correct_columns(questions).values()),
        own_times=own_times,
    )


def anticipations(logs: Logs) -> Iterator[str]:
    """Answers by the participant's own hand that came sooner than anybody reacts, by experiment and column of times."""
    for one in _ruled(logs):
        for name, own in one.own_times(one.table).items():
            hasty = own & (one.table[name].to_numpy(dtype=np.float64, na_value=np.nan) < ANTICIPATION_S)
            if hasty.any():
                yield _anticipated(one.experiment, name, one.table["participant_id"][hasty])


def _anticipated(experiment: str, column: str, codes: pd.Series) -> str:
    people = [f"{who} {count}" for who, count in sorted(codes.astype(str).value_counts(sort=False).items())]
    return (
        f"{experiment}: {len(codes)} anticipations, answers within {ANTICIPATION_S:g} s of the onset "
        f"({first_few(people, _NAMED)}; {column}); they count, and `response_time_min_s = {ANTICIPATION_S:g}` "
        "under [trials] in a file for --rules drops them"
    )


_NAMED = 20
"""So many people are named in a sentence."""


def apply_rules(logs: Logs, rules: Rules) -> ExclusionEffect:
    """Leave out what the rules say. A trial that several rules drop counts for the first of them."""
    excluded: list[LeftOut] = []
    dropped: dict[str, dict[str, dict[str, int]]] = {}
    trials: dict[str, KeptTrials] = {}
    tables: dict[str, pd.DataFrame] = {}
    for one in _ruled(logs):
        kept, dropped[one.experiment] = _without_trials(one, rules.trials)
        found = [*_reasons(one, kept, rules)]
        reasons = {code: (rule, reason) for code, rule, reason in reversed(found)}  # the first rule is told
        excluded += [
            LeftOut(
                experiment=one.experiment,
                participant=code,
                reason=reason,
                rule=rule,
                remedy=f"change or remove `{rule}` in the file given with --rules",
            )
            for code, (rule, reason) in sorted(reasons.items())
        ]
        tables[one.experiment] = rows_without(kept, reasons) if reasons else kept
        recorded, left = (int(np.count_nonzero(_planned(table))) for table in (one.table, kept))
        trials[one.experiment] = KeptTrials(recorded=recorded, kept=left)
    return ExclusionEffect(
        logs=replace(
            logs,
            trials=tables.get("direction", logs.trials),
            ratings=tables.get("preference", logs.ratings),
            designs=tuple(replace(one, table=tables.get(one.design.design, one.table)) for one in logs.designs),
        ),
        excluded=tuple(excluded),
        dropped=dropped,
        trials=trials,
        warnings=tuple(_idle(logs, rules)),
    )


def _without_trials(one: _Ruled, rules: TrialRules) -> tuple[pd.DataFrame, dict[str, dict[str, int]]]:
    gone = np.zeros(len(one.table), dtype=np.bool_)
    counts: dict[str, dict[str, int]] = {}
    for rule, breaks in _trial_rules(one, rules):
        new = breaks & ~gone
        gone |= new
        for code, count in one.table.loc[new, "participant_id"].astype(str).value_counts(sort=False).items():
            counts.setdefault(str(code), {})[rule] = int(count)
    kept = tidied(one.table[~gone]) if gone.any() else one.table
    return kept, dict(sorted(counts.items()))


def _trial_rules(one: _Ruled, rules: TrialRules) -> Iterator[tuple[str, BoolArray]]:
    """Each rule's name, and the rows that break it; of several times in a row, one that does is enough."""
    if rules.drop_flags:
        unwanted = set(rules.drop_flags)
        marks = one.table["flags"].fillna("").astype(str)
        bad = {text for text in marks.unique() if unwanted & set(text.split())}
        yield "drop_flags", marks.isin(bad).to_numpy(dtype=np.bool_)
    for name, own in one.own_times(one.table).items():
        time = one.table[name].to_numpy(dtype=np.float64, na_value=np.nan)
        if rules.response_time_min_s is not None:
            yield "response_time_min_s", own & (time < rules.response_time_min_s)
        if rules.response_time_max_s is not None:
            yield "response_time_max_s", own & (time > rules.response_time_max_s)
    if rules.drop_unanswered:
        unanswered = one.table[[*one.answers]].isna().all(axis=1).to_numpy(dtype=np.bool_)
        yield "drop_unanswered", unanswered & _planned(one.table)


BY_HAND = "excluded"
"""The rule that lists people."""


def _reasons(one: _Ruled, kept: pd.DataFrame, rules: Rules) -> Iterator[tuple[str, str, str]]:
    """Participant, rule and reason; who is listed by hand is told so, whatever else holds of them."""
    for listed in rules.excluded:
        for code in _codes(one.table, listed):
            yield code, BY_HAND, listed.reason
    yield from _too_few(one.table, kept, rules.participants.min_kept_share)
    for name in one.choices:
        yield from _too_uniform(kept, name, rules.participants.max_same_response_share)
    for accuracy in rules.accuracy:
        for name in one.scored:
            yield from _too_often_wrong(kept, name, accuracy)


def _too_few(table: pd.DataFrame, kept: pd.DataFrame, least: float | None) -> Iterator[tuple[str, str, str]]:
    """Who has too few trials left; whoever has none is gone in any case, and is to be listed."""
    recorded, remaining = (
        rows.loc[_planned(rows), "participant_id"].astype(str).value_counts(sort=False) for rows in (table, kept)
    )
    left = remaining.reindex(recorded.index, fill_value=0)
    rule = f"at least {least:g} of them" if least else "at least one"
    for code, count, of in zip(recorded.index, left.to_list(), recorded.to_list(), strict=True):
        if count == 0 or count / of < (least or 0.0):  # rounded as the share itself is
            yield str(code), "min_kept_share", f"{count} of {of} trials kept (rule: {rule})"


def _too_uniform(kept: pd.DataFrame, name: str, most: float | None) -> Iterator[tuple[str, str, str]]:
    if most is None:
        return
    said = kept[kept[name].notna()]
    people = said["participant_id"].astype(str)
    counts = said[name].astype(str).groupby([people, said[name].astype(str)]).size()
    same = counts.groupby(level=0).max() / counts.groupby(level=0).sum()
    for code, share in same[same > most].items():
        same_said = f"{share:.4g} of the answers to {name!r} are the same (rule: at most {most:g})"
        yield str(code), "max_same_response_share", same_said


def _too_often_wrong(kept: pd.DataFrame, name: str, rule: AccuracyRule) -> Iterator[tuple[str, str, str]]:
    if METHOD_FACTOR not in kept:
        return
    rows = kept[kept[METHOD_FACTOR] == rule.method]
    shares = rows[name].astype("float64").groupby(rows["participant_id"].astype(str)).mean()
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
    """Entries that mean nobody: a code or a study that is mistyped must not go unseen."""
    there = [*_ruled(logs)]
    studies = sorted({str(name) for one in there for name in one.table[STUDY].unique()})
    for listed in rules.excluded:
        if not any(_codes(one.table, listed) for one in there):
            of_study, known = "", ""
            if listed.study is not None:
                of_study, known = f" of study {listed.study!r}", f"; studies here are {', '.join(studies)}"
            yield f"the rules exclude {listed.code}{of_study}, who has no log here{known}"
    scored = (one.table for one in there if one.scored and METHOD_FACTOR in one.table)
    methods = {str(method) for table in scored for method in table[METHOD_FACTOR].dropna().unique()}
    for _, method in without_trials_of(rules, methods):
        yield f"the rules ask for accuracy with {method}, which no log with right answers has"


def without_trials_of(rules: Rules, methods: Collection[str]) -> Iterator[tuple[int, str]]:
    """The rules of accuracy that mean none of these methods: the place of each, and its own method."""
    for place, accuracy in enumerate(rules.accuracy):
        if accuracy.method not in methods:
            yield place, accuracy.method


def methods_with_right_answers(designs: Iterable[DesignConfig]) -> tuple[str, ...]:
    """The methods that rules of accuracy can be about in the data of these designs."""
    scored = [design.factors for design in designs if correct_columns(design.questions)]
    levels = (level for factors in scored if METHOD_FACTOR in factors for level in factors[METHOD_FACTOR].all_levels)
    return tuple(dict.fromkeys(map(str, levels)))
