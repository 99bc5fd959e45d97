"""Who is in which analysis: everybody that the logs, journals and registers know, in every experiment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from analysis.logs.exclusions import FINISHED, IN_NO_TEST, LeftOut, by_rule
from analysis.logs.kinds import NEVER_TOGETHER
from analysis.logs.reading import Logs
from device.messages import first_few, how_many
from experiments.study.study import Member, by_code


@dataclass(frozen=True, slots=True, kw_only=True)
class PeopleOfExperiment:
    """How many people are in the analysis of an experiment, and how many are not, by the reason.

    `begun`: not finished; `not_done`: known from elsewhere in a study that has the experiment, and not excluded by
    hand. `practices` and `set_aside` count runs, which are not data; those of another kind, as of synthetic
    participants, are not counted.
    """

    analysed: int
    left_out: int
    begun: int
    not_done: int
    practices: int = 0
    set_aside: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonInExperiment:
    """Who is not in the analysis of an experiment, and why."""

    participant: str
    experiment: str
    state: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Participation:
    """Who is in which analysis: counts of every experiment, and everybody who is not in all of them."""

    experiments: Mapping[str, PeopleOfExperiment] = field(default_factory=dict)
    absent: tuple[PersonInExperiment, ...] = ()


@dataclass(frozen=True, slots=True)
class _Absence:
    """How somebody stands in an experiment whose analysis they are not in, and what there is to say of it."""

    state: Literal["left out", "begun", "not done", "excluded by hand, and not done"]
    why: str = ""

    def __str__(self) -> str:
        return f"{self.state}: {self.why}" if self.why else self.state


def participation(logs: Logs, analysed: Mapping[str, Iterable[str]], excluded: Sequence[LeftOut]) -> Participation:
    """Look at everybody. `analysed`: by experiment, who is in its tests; `excluded`: who is not, and why."""
    within = {name: set(people) for name, people in analysed.items()}
    known = _of_logs(logs, excluded)
    joined = {logs.person(study, one.participant_id): one for study, one in logs.joined}
    people = {who for who, _ in known}.union(*within.values())
    nobody = {one.participant for one in excluded if one.rule == NEVER_TOGETHER} - people  # of another kind of data
    every = ((logs.person(run.study, run.participant), run) for run in logs.runs)
    runs = [(who, run) for who, run in every if who not in nobody]
    people |= (joined.keys() - nobody) | {who for who, _ in runs}
    done = [(who, name) for name, some in within.items() for who in some]
    done += [*known, *((who, run.experiment) for who, run in runs)]
    names = list(dict.fromkeys([*within, *(name for _, name in done)]))
    there = {(_study_of(who), name) for who, name in done}
    absences = {
        (who, name): _with_register(known.get((who, name), _Absence("not done")), joined.get(who))
        for who in sorted(people, key=by_code)
        for name in names
        if who not in within.get(name, ()) and (_study_of(who), name) in there
    }
    kinds = Counter[tuple[str, str]]((run.experiment, run.kind) for _, run in runs if run.data in (None, logs.kind))
    counts = Counter[tuple[str, str]]((name, one.state) for (_, name), one in absences.items())
    return Participation(
        experiments={name: _counted(name, len(within.get(name, ())), counts, kinds) for name in names},
        absent=tuple(
            PersonInExperiment(participant=who, experiment=name, state=str(one))
            for (who, name), one in absences.items()
        ),
    )


def _of_logs(logs: Logs, excluded: Sequence[LeftOut]) -> dict[tuple[str, str], _Absence]:
    """Who is left out of which experiment, for the first of the reasons, and who has begun it."""
    left_out = {
        (one.participant, one.experiment): _Absence("begun" if one.rule == FINISHED else "left out", one.reason)
        for one in reversed(excluded)
        if one.participant and one.experiment and one.rule != NEVER_TOGETHER
    }
    return left_out | {
        (logs.person(run.file.study, run.file.participant), run.file.experiment): _Absence("begun", run.far)
        for run in logs.begun
    }


def _with_register(one: _Absence, member: Member | None) -> _Absence:
    """An absence with what the register says: of whom is excluded by hand nothing is waited for."""
    if member is None:
        return one
    if one.state == "not done" and member.excluded is not None:
        return _Absence("excluded by hand, and not done")
    if member.left is None:
        return one
    return replace(one, why="; ".join(filter(None, (one.why, f"comes no more ({member.left})"))))


def _counted(
    name: str, analysed: int, counts: Mapping[tuple[str, str], int], kinds: Mapping[tuple[str, str], int]
) -> PeopleOfExperiment:
    """How many people of an experiment are in which state, and how many runs of which kind there are."""
    return PeopleOfExperiment(
        analysed=analysed,
        left_out=counts[name, "left out"],
        begun=counts[name, "begun"],
        not_done=counts[name, "not done"],
        practices=kinds[name, "practice"],
        set_aside=kinds[name, "set aside"],
    )


def _study_of(who: str) -> str:
    """The study in a participant's name; empty where there is one study only."""
    return who.rpartition("/")[0]


def exclusion_lines(excluded: Iterable[LeftOut]) -> Iterator[str]:
    """Who is left out by what their answers are, for a terminal: a line a rule, with everybody and what to do.

    What could not be read is told by itself.
    """
    for some in by_rule(one for one in excluded if not one.file):
        experiment, rule = some[0].experiment, some[0].rule
        people = first_few([f"{one.participant} ({one.reason})" for one in some], _NAMED)
        people += ", all in statistics.json" if len(some) > _NAMED else ""
        count = how_many(len(some), "participant")
        what = f"tests of {experiment}" if rule == IN_NO_TEST else experiment
        yield f"left out of {what}: {count} (rule: {rule}): {people}; {some[0].remedy}"


_NAMED = 100
"""So many people are named on a line of a terminal."""
