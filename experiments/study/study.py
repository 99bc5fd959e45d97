"""A study's participants: who may take part, how far each has come, and who comes next. Pure."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Literal, get_args

from experiments.config.door import (
    AgeYears,
    EligibilityConfig,
    Fact,
    Handedness,
    Model,
    Sex,
    StudyConfig,
    numbered_code,
)
from experiments.record.tables import DataKind

RunState = Literal["done", "in progress", "open elsewhere", "not begun", "unreadable", "synthetic"]
"""How a run stands.

`open elsewhere`: another process is carrying it out at this moment; `synthetic`: a synthetic participant has begun it,
so for people it is not begun, and it gives way to theirs.
"""


class Facts(Model):
    """What a participant said before a run; `None` where it was not asked."""

    age_years: AgeYears | None = None
    sex: Sex | None = None
    handedness: Handedness | None = None

    def known(self) -> tuple[Fact, ...]:
        """The facts that were given."""
        return tuple(fact for fact in get_args(Fact) if getattr(self, fact) is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunProgress:
    """How far a participant has come in one experiment.

    `answered` of `planned` trials, `began_utc` and `last_utc` the times of the first and the last record, `methods` in
    the order of the run, and whose `data` they are. All six are empty where no run has begun, or where its journal
    cannot be read. `practised`: a practice was done to its end; `practice_missed`: in none was enough right, as the
    design wants it. `language`: the participant's, where that is not English.
    """

    experiment: str
    state: RunState
    answered: int = 0
    planned: int = 0
    began_utc: str = ""
    last_utc: str = ""
    methods: tuple[str, ...] = ()
    data: DataKind | None = None
    practised: bool = False
    practice_missed: bool = False
    language: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """What the register says of one code: facts and when they joined, if they did; why excluded, why they left."""

    participant_id: str
    facts: Facts | None = None
    joined_utc: str = ""
    excluded: str | None = None
    left: str | None = None

    @property
    def gone(self) -> str:
        """Why nobody may run under this code; empty if somebody may."""
        if self.excluded is not None:
            return f"is excluded ({self.excluded})"
        return "" if self.left is None else f"comes no more ({self.left})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Participant(Member):
    """Who takes part, and how far they are in each experiment."""

    runs: tuple[RunProgress, ...]

    @property
    def open_runs(self) -> tuple[RunProgress, ...]:
        """The runs to go on with or to begin."""
        return tuple(run for run in self.runs if run.state in ("in progress", "not begun", "synthetic"))

    @property
    def in_progress(self) -> bool:
        """Whether a run has begun and not ended."""
        return any(run.state == "in progress" for run in self.runs)

    @property
    def is_synthetic(self) -> bool:
        """Whether nobody but a synthetic participant had this code so far, so that it is free for a person."""
        states = {run.state for run in self.runs}
        on_record = bool(self.joined_utc) or self.facts is not None or bool(self.gone)
        return "synthetic" in states and states <= {"synthetic", "not begun"} and not on_record

    @property
    def is_elsewhere(self) -> bool:
        """Whether they sit at another console."""
        return any(run.state == "open elsewhere" for run in self.runs)


@dataclass(frozen=True, slots=True, kw_only=True)
class NextParticipant:
    """Who comes next: a participant with open runs, or a new code for whom all experiments are open."""

    participant_id: str
    new: bool
    runs: tuple[RunProgress, ...]


def eligible(facts: Facts, eligibility: EligibilityConfig) -> tuple[str, ...]:
    """Why someone may not take part: each reason names fact, value and rule. Nothing if they may.

    >>> eligible(Facts(age_years=31), EligibilityConfig(ask=("age_years",), age_years_max=29))
    ('age_years = 31: must be at most 29',)
    """
    return (
        *_age_reasons(facts.age_years, eligibility.age_years_min, eligibility.age_years_max),
        *_level_reasons("sex", facts.sex, eligibility.sex),
        *_level_reasons("handedness", facts.handedness, eligibility.handedness),
    )


def _age_reasons(age: int | None, low: int | None, high: int | None) -> Iterator[str]:
    shown = "is not known" if age is None else f"= {age}"
    if low is not None and (age is None or age < low):
        yield f"age_years {shown}: must be at least {low}"
    if high is not None and (age is None or age > high):
        yield f"age_years {shown}: must be at most {high}"


def _level_reasons(fact: Fact, level: str | None, allowed: Sequence[str]) -> Iterator[str]:
    if allowed and level not in allowed:
        shown = "is not known" if level is None else f"= {level}"
        yield f"{fact} {shown}: must be {' or '.join(allowed)}"


def unanswered(facts: Facts, eligibility: EligibilityConfig) -> tuple[Fact, ...]:
    """The facts that the study asks for and that were not given."""
    return tuple(fact for fact in eligibility.ask if fact not in facts.known())


def unasked(facts: Facts, eligibility: EligibilityConfig) -> tuple[Fact, ...]:
    """The facts that were given though the study does not ask for them."""
    return tuple(fact for fact in facts.known() if fact not in eligibility.ask)


def taking_part(people: Sequence[Participant]) -> list[Participant]:
    """Those who count: people who are not excluded, and did not leave before they were done with everything."""
    counted = [one for one in people if one.excluded is None and not one.is_synthetic]
    return [one for one in counted if one.left is None or not one.open_runs]


def who_is_next(
    people: Sequence[Participant], study: StudyConfig, experiments: Sequence[str]
) -> NextParticipant | None:
    """Who is in progress, else who joined and is not finished, else the next free code; in order of their codes.

    `None` when the study has its participants and none of them waits. Who is excluded or left does not count: a new
    participant takes their place. Who sits at another console does not wait.
    """
    counted = sorted(taking_part(people), key=lambda one: by_code(one.participant_id))
    waiting = [one for one in counted if one.open_runs and not one.is_elsewhere]
    for one in sorted(waiting, key=lambda one: not one.in_progress):  # stable: codes stay in order
        return NextParticipant(participant_id=one.participant_id, new=False, runs=one.open_runs)
    if len(counted) >= study.participants:
        return None
    runs = tuple(RunProgress(experiment=experiment, state="not begun") for experiment in experiments)
    taken = [one.participant_id for one in people if not one.is_synthetic]
    return NextParticipant(participant_id=free_code(study, taken), new=True, runs=runs)


def why_nobody(people: Sequence[Participant]) -> tuple[Literal["unreadable", "elsewhere", "done"], list[str]]:
    """Why nobody is next, and whom that is about: runs cannot be read, people sit at other consoles, or all is done.

    Of a study of which nobody is seen, nothing could be read.
    """
    counted = taking_part(people)
    unread = [one.participant_id for one in counted if any(run.state == "unreadable" for run in one.runs)]
    elsewhere = [one.participant_id for one in counted if one.is_elsewhere]
    if unread or not counted:
        return "unreadable", unread
    return ("elsewhere", elsewhere) if elsewhere else ("done", [])


def free_code(study: StudyConfig, taken: Collection[str]) -> str:
    """The first code of the study that nobody has, upper and lower case alike; also beyond the planned number.

    >>> free_code(StudyConfig(title="T", participants=2, experiments=("direction.toml",)), ["p01", "P02", "P04"])
    'P03'
    """
    lowered = {code.lower() for code in taken}
    codes = (numbered_code(number, study.participants, study.code_prefix) for number in count(1))
    return next(code for code in codes if code.lower() not in lowered)


def by_code(code: str) -> tuple[tuple[str, int], ...]:
    """A key that sorts codes as people count: P2 before P10.

    >>> sorted(["P10", "P2", "A1"], key=by_code)
    ['A1', 'P2', 'P10']
    """
    parts = re.findall(r"([^0-9]*)([0-9]*)", code)
    return tuple((letters.lower(), int(digits or "-1")) for letters, digits in parts)
