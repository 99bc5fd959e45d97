"""Resume is replay: a journal's outcomes are sent into a fresh session, which then stands where the run broke off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from experiments.record.journal import Contents, JournalError
from experiments.session.history import Told
from experiments.session.remarks import Halted, Remark, TestShot, remark_from
from experiments.session.states import EMERGENCY
from experiments.session.steps import (
    Ask,
    Fire,
    History,
    Interrupted,
    Outcome,
    Present,
    Session,
    Step,
    outcome_from,
    record,
    step_from,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunPosition:
    """Where a run stands: its next step, `None` at the end, and what was told before.

    `halted`: an emergency stop ended it, and no test shot was fired since; one must come before anything else.
    """

    step: Step | None
    told: Told = ()
    halted: bool = False


def _halted(contents: Contents) -> bool:
    """Whether the last word on it is an emergency stop: its record, or, where the disk took none, the stop's reason."""
    halted = False
    for entry in contents.records:
        word = _read(contents, entry, remark_from) if entry["kind"] == "remark" else None
        if isinstance(word, Halted) or (entry["kind"] == "stopped" and entry.get("reason") == EMERGENCY):
            halted = True
        elif isinstance(word, TestShot) and not word.cause:
            halted = False
    return halted


def told(contents: Contents) -> Told:
    """All that a journal tells, in order: the steps that were done, each with its outcome, and remarks between them."""
    tale: list[tuple[Step | None, Outcome | Remark]] = []
    step: Step | None = None
    for entry in contents.records:
        if entry["kind"] == "step":
            step = _read(contents, entry, step_from)
        elif entry["kind"] == "remark":
            tale.append((None, _read(contents, entry, remark_from)))
        elif entry["kind"] == "outcome":
            if step is None:
                raise JournalError(f"{_place(contents, entry)}: an outcome without its step; a line was lost")
            tale.append((step, _read(contents, entry, outcome_from)))
            step = None
    return tale


def history(contents: Contents) -> History:
    """The steps that were done, each with its outcome."""
    return [(step, outcome) for step, outcome in told(contents) if step and not isinstance(outcome, Remark)]


def replay(session: Session, contents: Contents) -> RunPosition:
    """Send a journal's outcomes into a fresh session. `JournalError` if they are not those of this plan."""
    tale = told(contents)
    done = [(step, outcome) for step, outcome in tale if step and not isinstance(outcome, Remark)]
    step = next(session, None)
    for number, (recorded, outcome) in enumerate(done, start=1):
        _compare(contents, number, step, recorded)
        step = _send(session, outcome)
    return RunPosition(step=step, told=tale, halted=_halted(contents))


def go_on(session: Session, contents: Contents, standing: RunPosition, append: Callable[..., None]) -> RunPosition:
    """Where a replayed run goes on.

    A step at which the run broke off is given up, told to the journal through `append`, and its trial presented again:
    its stimulus was felt, may have been, or was about to be.
    """
    step, announced = standing.step, _last_step_is_open(contents)
    if step is None or not (announced or isinstance(step, Fire | Ask | Present)):
        return standing
    if not announced:
        append("step", body=record(step))
    felt = isinstance(step, Ask) or (announced and isinstance(step, Fire | Present))
    outcome = Interrupted(presented=felt)
    append("outcome", body=record(outcome))
    return replace(standing, step=_send(session, outcome), told=[*standing.told, (step, outcome)])


def _last_step_is_open(contents: Contents) -> bool:
    """Whether the last step has no outcome; a stop or a resumption may stand behind it."""
    kinds = [entry["kind"] for entry in contents.records if entry["kind"] in ("step", "outcome")]
    return bool(kinds) and kinds[-1] == "step"


def _send(session: Session, outcome: Outcome) -> Step | None:
    try:
        return session.send(outcome)
    except StopIteration:
        return None


def _compare(contents: Contents, number: int, planned: Step | None, told: Step) -> None:
    if planned is None or record(planned) != record(told):
        raise JournalError(
            f"{contents.path}: step {number} is {told.kind!r} and does not follow from the plan in line 1; "
            "the journal was changed, or another version of Recoil wrote it"
        )


def _read(contents: Contents, entry: dict[str, Any], reader: Any) -> Any:
    try:
        return reader(entry.get("body"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise JournalError(f"{_place(contents, entry)}: {where}: {first['msg']}; the record was changed") from error


def _place(contents: Contents, entry: dict[str, Any]) -> str:
    return f"{contents.path}: line {entry['n'] + 1}"
