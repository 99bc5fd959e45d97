"""Who is taken into a study, excluded and readmitted: the rules between a request and its record in the register."""

from __future__ import annotations

from pathlib import Path

from experiments import beginnings, places, register
from experiments.beginnings import Entered
from experiments.clock import Clock
from experiments.journal import JournalError
from experiments.places import PlaceError
from experiments.register import RegisterError
from experiments.standings import StudyFolder, look_at
from experiments.study import Facts, RunStanding, eligible, unanswered, unasked


def admit(study: StudyFolder, entered: Entered, clock: Clock, *, practice: bool = False) -> RunStanding:
    """Have what somebody said on record, and give back how their run stands.

    `PlaceError` and `JournalError` say why they may not run; then nothing is recorded.
    """
    run, facts = may_run(study, entered, practice=practice)
    if facts is not None:
        join(study, entered.participant_id, facts, clock)
    return run


def may_run(study: StudyFolder, entered: Entered, *, practice: bool = False) -> tuple[RunStanding, Facts | None]:
    """Check all that must hold before somebody runs: how their run stands, and what is new of what they said.

    `PlaceError` and `JournalError` say why they may not.
    """
    _refuse(beginnings.read_back_refusal(entered))
    person, problems = look_at(study, entered.participant_id)
    run = beginnings.run_of(person, entered.experiment)
    if run.state == "unreadable":
        raise JournalError("\n".join(problems))
    try:
        facts = beginnings.facts_of(entered.facts)
    except ValueError as error:
        raise PlaceError(str(error)) from error
    rules = study.config.eligibility
    _refuse(beginnings.refusal(person, entered, facts, rules, practice=practice))
    return run, facts if beginnings.is_news(person, facts, rules.ask) else None


def _refuse(reason: str) -> None:
    if reason:
        raise PlaceError(reason)


def join(study: StudyFolder, participant_id: str, facts: Facts, clock: Clock) -> tuple[str, ...]:
    """Take someone into a study, or correct the facts of one who joined. Why they are not eligible, if they are not.

    `PlaceError` if the code breaks a rule, a fact is missing or not asked for, or someone new is not eligible: then
    nothing is recorded. A correction is recorded whatever it says; whether to exclude is then for people to decide.
    """
    _refuse_wrong_facts(study, facts)
    places.place(study.results, participant_id, study.experiments[0])
    reasons = eligible(facts, study.config.eligibility)
    known = participant_id in places.known_codes(study.results)
    if reasons and not known:
        raise PlaceError(
            f"participant {participant_id} is not eligible: {'; '.join(reasons)} (rules: {study.source}); "
            "nothing was recorded"
        )
    register.append(study.results, register.entry("joined", participant_id, facts=facts), clock)
    return reasons


def _refuse_wrong_facts(study: StudyFolder, facts: Facts) -> None:
    missing, surplus = unanswered(facts, study.config.eligibility), unasked(facts, study.config.eligibility)
    if missing:
        raise PlaceError(f"not given: {', '.join(missing)}; {study.source} asks for it (eligibility.ask)")
    if surplus:
        raise PlaceError(f"{', '.join(surplus)}: {study.source} does not ask for it (eligibility.ask); leave it out")


def exclude(results: Path, participant_id: str, reason: str, clock: Clock) -> None:
    """Exclude someone; their row of the square is free again. `PlaceError` if they are not known, or excluded."""
    before = _excluded_before(results, participant_id)
    if before is not None:
        raise PlaceError(f"participant {participant_id} is excluded already ({before}); readmit them to change that")
    _record(results, "excluded", participant_id, reason, clock)


def readmit(results: Path, participant_id: str, reason: str, clock: Clock) -> None:
    """Count someone again who was excluded. `PlaceError` if they are not known, or not excluded."""
    if _excluded_before(results, participant_id) is None:
        raise PlaceError(f"participant {participant_id} is not excluded, so there is nothing to take back")
    _record(results, "readmitted", participant_id, reason, clock)


def _excluded_before(results: Path, participant_id: str) -> str | None:
    places.place(results, participant_id, "direction")
    known = places.known_codes(results)
    if participant_id not in known:
        shown = ", ".join(known) or "nobody"
        raise PlaceError(f"participant {participant_id} is not known in {results}; known are {shown}")
    return register.excluded(results).get(participant_id)


def _record(results: Path, kind: str, participant_id: str, reason: str, clock: Clock) -> None:
    try:
        one = register.entry(kind, participant_id, reason=reason)
    except RegisterError as error:
        raise PlaceError(f"participant {participant_id}: {error}; nothing was recorded") from error
    register.append(results, one, clock)
