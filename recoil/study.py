"""`recoil study`: the participants of a study as a table, who comes next, and changes to the register."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import ValidationError

from analysis.report.section import Section, Table
from analysis.report.terminal import with_tables
from device.messages import how_many
from experiments.clock import RealClock, date_text
from experiments.config.door import ConfigError
from experiments.screens.texts import doubt_text
from experiments.study import enrolment
from experiments.study.folders import Overview, StudyFolder, known_codes, open_study, overview
from experiments.study.register import read_register
from experiments.study.study import Facts, Participant, RunProgress, eligible, taking_part, why_nobody

_OPTIONS = {"age_years": "--age", "sex": "--sex", "handedness": "--handedness"}
_REASONED = {"exclude": enrolment.exclude, "left": enrolment.leave, "readmit": enrolment.readmit}
_UNDER_WAY = ("in progress", "open elsewhere", "synthetic")


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyChange:
    """What was asked for: someone joins with facts, or is excluded, gone or readmitted for a reason."""

    action: str
    participant_id: str
    facts: Facts
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyStatus:
    """A study and how it stands."""

    study: StudyFolder
    overview: Overview


def change(options: Mapping[str, str | None], facts: Mapping[str, object], reason: str | None) -> StudyChange | None:
    """What is to be changed; `None` for a look alone. `ConfigError` for options that do not go together."""
    given = [(action, code) for action, code in options.items() if code is not None]
    if len(given) > 1:
        raise ConfigError(f"{' and '.join(f'--{action}' for action, _ in given)}: give one of them at a time")
    action, code = given[0] if given else ("", "")
    _refuse_stray(action, facts, reason)
    if not action:
        return None
    return StudyChange(action=action, participant_id=code, facts=_facts(facts), reason=reason or "")


def _refuse_stray(action: str, facts: Mapping[str, object], reason: str | None) -> None:
    given = [_OPTIONS[fact] for fact, value in facts.items() if value is not None]
    if given and action != "join":
        raise ConfigError(f"{', '.join(given)}: facts go with --join CODE")
    if reason is None and action in _REASONED:
        raise ConfigError(f"--{action}: needs --reason TEXT, which is kept in the register; never a name")
    if reason is not None and action not in _REASONED:
        raise ConfigError("--reason: goes with --exclude CODE, --left CODE or --readmit CODE")


def _facts(values: Mapping[str, object]) -> Facts:
    try:
        return Facts.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigError(f"{_OPTIONS[str(first['loc'][0])]} {first['input']!r}: {first['msg']}") from error


def study(folder: Path, change: StudyChange | None) -> tuple[StudyStatus, tuple[str, ...]]:
    """How a folder's study stands after a change, and what there is to say of the change. Errors name what to do."""
    where = open_study(folder)
    shipped = f"{folder}: no study.toml here or in the folder above; shown by the study that comes with Recoil"
    notes = (*((shipped,) if where.is_shipped else ()), *(_carry_out(where, change) if change else ()))
    return StudyStatus(study=where, overview=overview(where)), notes


def _carry_out(where: StudyFolder, change: StudyChange) -> tuple[str, ...]:
    clock, code = RealClock(), change.participant_id
    if change.action == "join":
        known = known_codes(where.results, read_register(where.results))
        reasons = enrolment.join(where, code, change.facts, clock)
        doubt = enrolment.code_doubt(code, known, where.config.code_prefix)
        return (
            *([f"{doubt_text(doubt)} It is recorded; --left {code} says that it was nobody's"] if doubt else []),
            *(f"participant {code} is not eligible: {reason}; recorded, exclude?" for reason in reasons),
        )
    _REASONED[change.action](where.results, code, change.reason, clock)
    return ()


def study_json(found: StudyStatus) -> dict[str, object]:
    """The study as plain JSON values."""
    coming = found.overview.next
    return {
        "study": found.study.config.title,
        "planned_participants": found.study.config.participants,
        "participants": [_participant(found, one) for one in found.overview.participants],
        "next": coming
        and {"participant_id": coming.participant_id, "new": coming.new, "orders": found.overview.orders},
        "preregistration": found.overview.frozen.record(),
        "problems": list(found.overview.problems),
    }


def _participant(found: StudyStatus, one: Participant) -> dict[str, object]:
    return {
        "participant_id": one.participant_id,
        "facts": one.facts and one.facts.model_dump(mode="json"),
        "joined_utc": one.joined_utc or None,
        "excluded": one.excluded,
        "left": one.left,
        "not_eligible": list(_not_eligible(found, one)),
        "order_broken": list(enrolment.order_broken(one)),
        "experiments": {run.experiment: _run(run) for run in one.runs},
    }


def _run(run: RunProgress) -> dict[str, object]:
    return {key: value for key, value in asdict(run).items() if key != "experiment"}


def _not_eligible(found: StudyStatus, one: Participant) -> tuple[str, ...]:
    return eligible(one.facts, found.study.config.eligibility) if one.facts else ()


def study_text(found: StudyStatus) -> str:
    """The study for people at a terminal: a table, then who comes next."""
    header = ("code", "age", "sex", "hand", *found.study.experiments, "remark")
    rows = tuple(tuple(_cells(found, one)) for one in found.overview.participants)
    section = Section(
        title=found.study.config.title,
        tables=(Table(caption="", header=header, rows=rows),),
        items=(*_count_lines(found), *found.overview.frozen.lines(), *_next_lines(found)),
    )
    return with_tables(section)


def _cells(found: StudyStatus, one: Participant) -> Iterator[str]:
    facts = one.facts or Facts()
    yield one.participant_id
    for fact in (facts.age_years, facts.sex, facts.handedness):
        yield "" if fact is None else str(fact)
    for run in one.runs:
        yield _state(run)
    excluded = [] if one.excluded is None else [f"excluded: {one.excluded}"]
    left = [] if one.left is None else [f"comes no more: {one.left}"]
    ineligible = [f"not eligible: {reason}" for reason in _not_eligible(found, one)]
    broken = [f"order broken: {how}" for how in enrolment.order_broken(one)]
    yield "\n".join([*excluded, *left, *ineligible, *broken])


def _state(run: RunProgress) -> str:
    counts = f", {run.answered} of {how_many(run.planned, 'trial')}"
    if run.state != "synthetic":  # whose clock is that of a simulation, often ahead of the world's
        counts += f", last record {date_text(run.last_utc)}"
    lines = [f"{run.state}{counts if run.state in _UNDER_WAY and run.planned else ''}", " > ".join(run.methods)]
    gun = "on a simulated gun" if run.data == "simulated gun" else ""
    practice = f"practice done{', too little right' if run.practice_missed else ''}" if run.practised else ""
    return "\n".join(filter(None, [*lines, gun, practice]))


def _count_lines(found: StudyStatus) -> Iterator[str]:
    people = found.overview.participants
    done = sum(all(run.state == "done" for run in one.runs) for one in taking_part(people))
    excluded = sum(one.excluded is not None for one in people)
    left = f", {gone} left" if (gone := sum(one.excluded is None and one.left is not None for one in people)) else ""
    yield f"{done} of {how_many(found.study.config.participants, 'participant')} done, {excluded} excluded{left}"
    if synthetic := [run for one in people for run in one.runs if run.state == "synthetic"]:
        runs = f"{how_many(len(synthetic), 'run')} of synthetic participants"
        yield f"{runs}: not counted, and set aside when a person comes to that code and experiment"


def _next_lines(found: StudyStatus) -> Iterator[str]:
    coming = found.overview.next
    if coming is None:
        yield f"Next: {_nobody(found.overview.participants)}"
        return
    yield f"Next: {coming.participant_id}{' (new)' if coming.new else ''}"
    for run in coming.runs:
        methods = found.overview.orders[run.experiment]
        go_on = " (go on with --resume)" if run.state == "in progress" else ""
        yield f"  {run.experiment}: {' > '.join(methods) if methods else 'order drawn when the run begins'}{go_on}"


def _nobody(people: tuple[Participant, ...]) -> str:
    match why_nobody(people):
        case "unreadable", _:
            return "nobody who can be named, see what could not be read"
        case "elsewhere", codes:
            return f"nobody waits; at a console now: {', '.join(codes)}"
        case _:
            return "nobody, the study is done"
