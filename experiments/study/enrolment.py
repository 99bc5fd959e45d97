"""Who is taken into a study, excluded, gone and readmitted, and which experiment somebody comes to."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import get_args

from pydantic import ValidationError

from experiments.clock import Clock
from experiments.config.door import ConfigError, EligibilityConfig, Fact
from experiments.load import load_study
from experiments.record.journal import JournalError
from experiments.record.names import is_code
from experiments.study import folders, register
from experiments.study.folders import RETEST, PlaceError, StudyFolder, look_at
from experiments.study.preregistration import STUDY_FILE
from experiments.study.register import RegisterError
from experiments.study.study import Facts, Member, Participant, RunProgress, eligible, unanswered, unasked


@dataclass(frozen=True, slots=True, kw_only=True)
class Entered:
    """What was entered before a run: the code and its read-back, the experiment, the facts as they were typed."""

    participant_id: str
    read_back: str
    experiment: str
    facts: Mapping[str, str]


def run_of(person: Participant, experiment: str) -> RunProgress:
    """How somebody stands in an experiment."""
    return next(run for run in person.runs if run.experiment == experiment)


def next_experiment(person: Participant | None, experiments: Sequence[str]) -> str:
    """The first experiment in the order of the study that somebody has not done; the first of all if nothing is left.

    >>> runs = [RunProgress(experiment=name, state=state) for name, state in [("a", "done"), ("b", "not begun")]]
    >>> next_experiment(Participant(participant_id="P01", runs=tuple(runs)), ["a", "b"])
    'b'
    """
    ahead = left_to_do(person, experiments)
    return ahead[0] if ahead else experiments[0]


def left_to_do(person: Participant | None, experiments: Sequence[str]) -> list[str]:
    """The experiments that somebody has not done, in the order of the study."""
    return [one for one in experiments if person is None or run_of(person, one).state != "done"]


def passed_over(person: Participant | None, experiment: str, experiments: Sequence[str]) -> list[str]:
    """The experiments that come before one in the study and that somebody has not done: doing it breaks the order."""
    return left_to_do(person, experiments[: experiments.index(experiment)])


def order_broken(person: Participant) -> tuple[str, ...]:
    """Which runs of somebody's began before one that comes earlier in the study was done."""
    return tuple(
        f"{then.experiment} was begun before {first.experiment} was done"
        for first, then in combinations(person.runs, 2)
        if then.state in ("done", "in progress", "open elsewhere")
        and first.state != "unreadable"
        and (first.state != "done" or "" < then.began_utc < first.last_utc)
    )


def facts_of(typed: Mapping[str, str]) -> Facts:
    """Facts from what was typed; what is empty was not given. `ValueError` names fact, value and rule.

    >>> facts_of({"age_years": " 25", "sex": ""})
    Facts(age_years=25, sex=None, handedness=None)
    """
    given: dict[str, str | int] = {fact: text.strip() for fact, text in typed.items() if text.strip()}
    age = given.get("age_years")
    if isinstance(age, str) and age.isdecimal() and len(age) <= _AGE_DIGITS:
        given["age_years"] = int(age)
    try:
        return Facts.model_validate(given)
    except ValidationError as error:
        fact = str(error.errors()[0]["loc"][0])
        rule = "whole years from 1 to 120" if fact == "age_years" else "one of the levels that are offered"
        raise ValueError(f"{fact} = {given.get(fact)!r}: must be {rule}") from error


_AGE_DIGITS = 3


def typed_facts(facts: Facts | None) -> dict[str, str]:
    """Facts on record as they would be typed."""
    values = facts.model_dump() if facts is not None else {}
    return {fact: "" if values.get(fact) is None else str(values[fact]) for fact in get_args(Fact)}


def is_news(person: Participant, facts: Facts, asked: Sequence[Fact]) -> bool:
    """Whether facts say something that is not on record; so does anyone who is not on record at all."""
    known = person.facts
    return known is None or any(getattr(facts, fact) != getattr(known, fact) for fact in asked)


def enrolment_refusal(
    person: Participant, entered: Entered, facts: Facts, rules: EligibilityConfig, *, practice: bool
) -> str:
    """Why no run begins, in one sentence; empty if one may. A practice may be done before and after every run."""
    code = person.participant_id
    elsewhere = [run.experiment for run in person.runs if run.state == "open elsewhere"]
    missing, reasons = unanswered(facts, rules), eligible(facts, rules)
    if person.gone:
        return f"{code} {person.gone}: readmit them first; somebody else has a code of their own."
    if elsewhere:
        return f"{code} sits at another console, where {elsewhere[0]} is open: close it there first."
    if not practice and run_of(person, entered.experiment).state == "done":
        return (
            f"{code} has finished {entered.experiment}; one finished run a participant and experiment: choose another "
            f"experiment; {RETEST}."
        )
    if missing:
        return f"The study asks for what was not given: {', '.join(map(fact_text, missing))}."
    if reasons:
        return f"{code} is not eligible: {'; '.join(reasons)}. Correct what was entered, or let somebody else come."
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeDoubt:
    """A new code that may be mistyped: it looks like the known `other`, or else lacks the study's `prefix`."""

    code: str
    other: str = ""
    prefix: str = ""


def code_doubt(code: str, known: Sequence[str], prefix: str) -> CodeDoubt | None:
    """Why a code may be mistyped, by those that are known and by the study's prefix."""
    if other := _look_alike(code, known):
        return CodeDoubt(code=code, other=other)
    if is_code(code) and code not in known and not code.startswith(prefix):
        return CodeDoubt(code=code, prefix=prefix)
    return None


_LEADING_ZEROS = re.compile(r"(?<![0-9])0+(?=[0-9])")
_READ_ALIKE = str.maketrans("oil", "011")


def _look_alike(participant_id: str, known: Iterable[str]) -> str:
    """The known code from which a new one differs by case, leading zeros or letters read as digits alone; else empty.

    >>> _look_alike("P1", ["P01", "P10"]), _look_alike("P10", ["P01", "P1"]), _look_alike("P1", ["P1", "P01"])
    ('P01', '', '')
    >>> _look_alike("PO1", ["P01"]), _look_alike("Pl2", ["P12"])
    ('P01', 'P12')
    """
    known, plain = tuple(known), _plain(participant_id)
    return "" if participant_id in known else next((code for code in known if _plain(code) == plain), "")


def _plain(code: str) -> str:
    """A code as it is heard and read: small letters, digits for letters that look like them, no leading zeros."""
    return _LEADING_ZEROS.sub("", code.lower().translate(_READ_ALIKE))


def fact_text(name: str) -> str:
    """A fact of a person as people call it: `age_years` is an age."""
    return name.removesuffix("_years")


def read_back_refusal(entered: Entered) -> str:
    """Why the code is not sure yet; empty if it is."""
    if not entered.participant_id:
        return "Type the participant's code, and read it back."
    if not entered.read_back:
        return "Read the code back: type it a second time, just as it stands above."
    if entered.participant_id != entered.read_back:
        return f"The two codes differ: {entered.participant_id} and {entered.read_back}. Type the second one again."
    return ""


def admit(study: StudyFolder, entered: Entered, clock: Clock, *, practice: bool = False) -> RunProgress:
    """Have what somebody said on record, and give back how their run stands.

    `PlaceError` and `JournalError` say why they may not run; then nothing is recorded.
    """
    run, facts = may_run(study, entered, practice=practice)
    if facts is not None:
        join(study, entered.participant_id, facts, clock)
    return run


def may_run(study: StudyFolder, entered: Entered, *, practice: bool = False) -> tuple[RunProgress, Facts | None]:
    """Check all that must hold before somebody runs: how their run stands, and what is new of what they said.

    `PlaceError` and `JournalError` say why they may not.
    """
    _refuse(read_back_refusal(entered))
    if practice:
        folders.refuse_without_practice(study.setup_of(entered.experiment))
    person, problems = look_at(study, entered.participant_id)
    run = run_of(person, entered.experiment)
    if run.state == "unreadable":
        raise JournalError("\n".join(problems))
    try:
        facts = facts_of(entered.facts)
    except ValueError as error:
        raise PlaceError(str(error)) from error
    rules = study.config.eligibility
    _refuse(enrolment_refusal(person, entered, facts, rules, practice=practice))
    return run, facts if is_news(person, facts, rules.ask) else None


def _refuse(reason: str) -> None:
    if reason:
        raise PlaceError(reason)


def join(study: StudyFolder, participant_id: str, facts: Facts, clock: Clock) -> tuple[str, ...]:
    """Take someone into a study, or correct the facts of one who joined. Why they are not eligible, if they are not.

    `PlaceError` if the code breaks a rule, a fact is missing or not asked for, or someone new is not eligible: then
    nothing is recorded. A correction is recorded whatever it says; whether to exclude is then for people to decide.
    """
    _refuse_wrong_facts(study, facts)
    registered = register.read_register(study.results)
    folders.place(study.results, participant_id, study.experiments[0], registered)
    reasons = eligible(facts, study.config.eligibility)
    if reasons and not _is_known(study, participant_id, registered):
        raise PlaceError(
            f"participant {participant_id} is not eligible: {'; '.join(reasons)} (rules: {study.source}); "
            "nothing was recorded"
        )
    register.append(study.results, register.entry("joined", participant_id, facts=facts), clock)
    return reasons


def _is_known(study: StudyFolder, participant_id: str, registered: register.Register) -> bool:
    """Whether a person has had a code before; a synthetic participant does not count."""
    known = participant_id in folders.known_codes(study.results, registered)
    return known and not look_at(study, participant_id)[0].is_synthetic


def _refuse_wrong_facts(study: StudyFolder, facts: Facts) -> None:
    missing, surplus = unanswered(facts, study.config.eligibility), unasked(facts, study.config.eligibility)
    if missing:
        raise PlaceError(f"not given: {', '.join(missing)}; {study.source} asks for it (eligibility.ask)")
    if surplus:
        raise PlaceError(f"{', '.join(surplus)}: {study.source} does not ask for it (eligibility.ask); leave it out")


def not_on_record(results: Path, participant_id: str) -> str:
    """Why somebody would not be taken in who runs all the same: what the study asks for and nobody said, or its rules.

    Empty if all is well, and where the results lie in no study.
    """
    source = _study_file(results)
    if not source.is_file():
        return ""
    try:
        rules = load_study(str(source))[0].eligibility
    except ConfigError as error:
        return str(error)
    member = register.read_register(results).members.get(participant_id)
    facts = (member and member.facts) or Facts()
    missing, reasons = unanswered(facts, rules), eligible(facts, rules)
    if not (missing or reasons):
        return ""
    said = f"{', '.join(map(fact_text, missing))} not on record" if missing else f"not eligible: {'; '.join(reasons)}"
    then = "with their facts puts them on record" if missing else "corrects facts, --exclude leaves them out"
    return (
        f"participant {participant_id}: {said} (rules: {source}); the run goes on all the same; "
        f"`recoil study {results} --join {participant_id}` {then}"
    )


def code_prefix_of(results: Path) -> str:
    """What codes begin with in the study that results lie in; empty where there is none, or none that can be read."""
    try:
        return load_study(_study_file(results))[0].code_prefix
    except ConfigError:
        return ""


def _study_file(results: Path) -> Path:
    return Path(os.path.normpath(results / ".." / STUDY_FILE))


def exclude(results: Path, participant_id: str, reason: str, clock: Clock) -> None:
    """Exclude someone; their row of the square is free again.

    `PlaceError` if they are not known, excluded, or at a run now. `JournalError`: a journal cannot be opened.
    """
    before = _on_record(results, participant_id).excluded
    if before is not None:
        raise PlaceError(f"participant {participant_id} is excluded already ({before}); readmit them to change that")
    folders.refuse_open_run(results, participant_id)
    _record(results, "excluded", participant_id, reason, clock)


def leave(results: Path, participant_id: str, reason: str, clock: Clock) -> None:
    """Record that someone comes no more, or that a code was nobody's; what was done under it still counts.

    Raises as `exclude`.
    """
    before = _on_record(results, participant_id).gone
    if before:
        raise PlaceError(f"participant {participant_id} {before} already; readmit them to change that")
    folders.refuse_open_run(results, participant_id)
    _record(results, "left", participant_id, reason, clock)


def readmit(results: Path, participant_id: str, reason: str, clock: Clock) -> None:
    """Count someone again who was excluded or had left. `PlaceError` if they are not known, or neither."""
    if not _on_record(results, participant_id).gone:
        raise PlaceError(
            f"participant {participant_id} is not excluded and has not left: there is nothing to take back"
        )
    _record(results, "readmitted", participant_id, reason, clock)


def _on_record(results: Path, participant_id: str) -> Member:
    registered = register.read_register(results)
    known = folders.known_codes(results, registered)
    folders.check_code(participant_id)
    folders.check_case(results, participant_id, known)
    if participant_id not in known:
        shown = ", ".join(known) or "nobody"
        raise PlaceError(f"participant {participant_id} is not known in {results}; known are {shown}")
    return registered.trusted().get(participant_id, Member(participant_id=participant_id))


def _record(results: Path, kind: str, participant_id: str, reason: str, clock: Clock) -> None:
    try:
        one = register.entry(kind, participant_id, reason=reason)
    except RegisterError as error:
        raise PlaceError(f"participant {participant_id}: {error}; nothing was recorded") from error
    register.append(results, one, clock)
