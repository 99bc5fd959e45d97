"""What of an event is kept as a remark in the journal. Pure."""

from __future__ import annotations

from experiments.design.plan import Trial
from experiments.session import events
from experiments.session.entries import Entry
from experiments.session.events import ACTS, OWN, Event
from experiments.session.remarks import (
    AnswerCorrected,
    Continued,
    DescriptionCorrected,
    Flagged,
    Halted,
    HaltReason,
    Noted,
    Paused,
    RatingCorrected,
    Refused,
    Remark,
)
from experiments.session.states import Position, State


def remark_of(  # noqa: C901, PLR0911 - one case an event
    event: Event, before: Position, then: Position, trial: Trial
) -> Remark | None:
    """What is written of an event that was taken between two positions; `trial` is the one at hand."""
    match event:
        case events.Flag():
            return Flagged(trial=event.trial or trial, flag=event.flag)
        case events.Note():
            return Noted(trial=event.trial or trial, text=event.text)
        case events.Correct() if before.correcting is not None:
            return _corrected(before.correcting, event)
        case events.Reason():
            return HaltReason(text=event.text)
        case events.EmergencyStop() if before.base is not State.HALTED:
            return Halted(by=event.by)
        case events.Pause():
            return Paused()
        case events.ParticipantBack():
            return Noted(trial=None, text="The participant's screen was started again.")
        case events.ParticipantLost() if before.paused_s is None and then.paused_s is not None:
            return Paused(cause=event.cause)
        case events.GoOn():
            return Continued(paused_s=round(then.since_s - (before.paused_s or before.since_s), 3))
        case _:
            return None


def refused(event: Event, position: Position, because: str) -> Refused | None:
    """What is kept of an event that would have carried the run on, and was refused."""
    own = isinstance(event, OWN)
    if not (own or isinstance(event, ACTS)) or position.base is State.STOPPED:
        return None
    return Refused(
        event=events.word(type(event)),
        state=str(position.state),
        because=because,
        by="participant" if own else "experimenter",
    )


def _corrected(entry: Entry, event: events.Correct) -> Remark:
    match entry.what, event.value:
        case "answer", "forward" | "backward" as response:
            return AnswerCorrected(trial=entry.trial, response=response)
        case "rating", float() | None as rating:
            return RatingCorrected(trial=entry.trial, rating=rating)
        case "description", str() as comment:
            return DescriptionCorrected(trial=entry.trial, comment=comment)
        case _:
            raise TypeError(f"{event.value!r} is no {entry.what}")
