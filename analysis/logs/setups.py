"""Runs of one experiment that were made with several setups: configs or guns that were changed meanwhile."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from analysis.logs.files import Problem
from analysis.logs.journals import journal_of
from device.messages import first_few, how_many
from experiments.record import journal
from experiments.record.journal import JournalError
from experiments.record.tables import DataKind
from experiments.study.changes import Files, plain_value, setup_changes, setup_key

_NAMED = 20
"""So many people, and so many keys, are named."""
_SETUPS, _FEW = 3, 5
"""Of more setups than these so many are told, each by so many people and keys."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PooledSetups(Problem):
    """Runs of an experiment that count together though their setups differ; `said` without what to do about it."""

    said: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SetupOfLog:
    """With which setup a log was made: the study's folder, experiment, code, the log's path, and the setup's hash.

    Logs of another `kind` of data do not count together. How synthetic participants answer is of their setup, too.
    """

    study: str
    kind: DataKind | None
    experiment: str
    code: str
    path: str
    setup: str


def changed_setups(logs: Iterable[SetupOfLog]) -> list[Problem]:
    """Of each study's experiment whose logs were made with several setups: whose, and what differs between them."""
    groups: dict[tuple[str, str, DataKind | None], dict[str, list[SetupOfLog]]] = {}
    for log in logs:
        if log.setup:
            groups.setdefault((log.study, log.experiment, log.kind), {}).setdefault(log.setup, []).append(log)
    differing = [_differing(setups) for setups in groups.values() if len(setups) > 1]
    return [_told(setups) for setups in differing if len(setups) > 1]


def _differing(setups: Mapping[str, list[SetupOfLog]]) -> dict[str, list[SetupOfLog]]:
    """The logs by setup, those of one that two versions of Recoil recorded together."""
    found: dict[str, list[SetupOfLog]] = {}
    for setup, logs in setups.items():
        key = setup
        with suppress(JournalError):
            key = setup_key(_setup(logs[0]))
        found.setdefault(key, []).extend(logs)
    return found


def _told(setups: Mapping[str, list[SetupOfLog]]) -> Problem:
    """The setup of most logs, and how each other one differs from it."""
    first, *others = sorted(setups.values(), key=len, reverse=True)
    one, count = first[0], sum(map(len, setups.values()))
    most = _NAMED if len(others) <= _SETUPS else _FEW
    differing = "; ".join(f"{_people(some, most)} with {_differences(one, some[0], most)}" for some in others[:_SETUPS])
    if len(others) > _SETUPS:
        more, rest = how_many(sum(map(len, others[_SETUPS:])), "run"), len(others) - _SETUPS
        differing += f"; and {more} with {rest} other setups, which the first line of each journal holds"
    what = "config, gun and synthetic participants" if one.kind == "synthetic" else "config and gun"
    said = (
        f"{how_many(count, 'run')} of {one.experiment} were made with {len(setups)} setups ({what}) and count "
        f"together: {_people(first, most)} with one, {differing}"
    )
    message = f"{said}; if that matters, analyse them apart: name their folders in a call of its own"
    place = Path(one.study)
    return PooledSetups(file=place, line=None, column=None, message=message, experiment=one.experiment, said=said)


def pooled_setups(remarks: Iterable[Problem], experiment: str) -> tuple[str, ...]:
    """What remarks say of an experiment's runs that count together though their setups differ, a sentence a study."""
    return tuple(f"{one.said}." for one in remarks if isinstance(one, PooledSetups) and one.experiment == experiment)


def _people(logs: Sequence[SetupOfLog], most: int) -> str:
    return first_few([log.code for log in logs], most)


def _differences(first: SetupOfLog, other: SetupOfLog, most: int) -> str:
    """What differs between the setups of two logs, as far as their journals can be read."""
    with suppress(JournalError):
        return setup_differences(_setup(first), _setup(other), most)
    return "another setup"


def setup_differences(before: Files, after: Files, most: int = _NAMED) -> str:
    """The keys that differ between two setups, each with both values; so many at most."""
    changes = [
        f"{change.file} {change.key} = {plain_value(change.now)}, not {plain_value(change.frozen)}"
        for change in setup_changes(before, after)
    ]
    return first_few(changes, most)


def _setup(log: SetupOfLog) -> Files:
    head = journal.head(Path(journal_of(log.path)))
    if head is None or not isinstance(head.setup_json, dict):
        return {}
    laws = head.laws_json if log.kind == "synthetic" and isinstance(head.laws_json, dict) else {}
    return {**head.setup_json, "synthetic": laws}
