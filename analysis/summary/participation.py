"""Who is in which analysis: everybody that the logs, journals and registers know, in every experiment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from analysis.logs.exclusions import FINISHED, IN_NO_TEST, LeftOut, by_rule
from analysis.logs.kinds import NEVER_TOGETHER
from analysis.logs.reading import Logs
from device.messages import first_few, how_many
from experiments.study.study import by_code


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


def participation(logs: Logs, analysed: Mapping[str, Iterable[str]], excluded: Sequence[LeftOut]) -> Participation:
    """Look at everybody. `analysed`: by experiment, who is in its tests; `excluded`: who is not, and why."""
    within = {name: set(people) for name, people in analysed.items()}
    told = [one for one in reversed(excluded) if one.participant and one.experiment and one.rule != NEVER_TOGETHER]
    why = {(one.participant, one.experiment): one for one in told}
    begun = {(logs.person(run.file.study, run.file.participant), run.file.experiment): run for run in logs.begun}
    runs = [(logs.person(run.study, run.participant), run) for run in logs.runs]
    joined = {logs.person(study, one.participant_id): one for study, one in logs.joined}
    people = set().union(*within.values(), (who for who, _ in why), (who for who, _ in begun))
    nobody = {one.participant for one in excluded if one.rule == NEVER_TOGETHER} - people  # of another kind of data
    runs = [(who, run) for who, run in runs if who not in nobody]
    people |= (joined.keys() - nobody) | {who for who, _ in runs}
    done = [*why, *begun, *((who, run.experiment) for who, run in runs)]
    done += [(who, name) for name, some in within.items() for who in some]
    names = list(dict.fromkeys([*within, *(name for _, name in why), *(run.experiment for _, run in runs)]))
    there = {(_study_of(who), name) for who, name in done}

    def state(who: str, experiment: str) -> str:
        gone = f"; comes no more ({joined[who].left})" if who in joined and joined[who].left is not None else ""
        if who in within.get(experiment, ()):
            return ""
        if (who, experiment) in begun:
            return f"begun: {begun[who, experiment].far}{gone}"
        if (who, experiment) in why:
            one = why[who, experiment]
            return f"{'begun' if one.rule == FINISHED else 'left out'}: {one.reason}{gone}"
        if (_study_of(who), experiment) not in there:
            return ""
        out = who in joined and joined[who].excluded is not None
        return _EXCLUDED if out else f"not done{gone.replace(';', ':')}"

    order = sorted(people, key=by_code)
    absent = tuple(
        PersonInExperiment(participant=who, experiment=name, state=said)
        for who in order
        for name in names
        if (said := state(who, name))
    )
    kinds = Counter[tuple[str, str]]((run.experiment, run.kind) for _, run in runs if run.data in (None, logs.kind))
    counts = Counter((one.experiment, one.state.partition(":")[0]) for one in absent)
    return Participation(
        experiments={name: _counted(name, len(within.get(name, ())), counts, kinds) for name in names},
        absent=absent,
    )


_EXCLUDED = "excluded by hand, and not done"
"""Of whom nothing is waited for."""


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
