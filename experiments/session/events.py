"""What can happen to a live run, as frozen facts: by the experimenter's hand, by the participant's, by the world.

Who may do what when is not here but in `experiments.session.states`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from experiments.design.plan import Trial
from experiments.session.steps import RepeatedBy
from experiments.tasks.questions import AnswerValue

Hand = Literal["experimenter", "synthetic"]
"""Whose hand is at the console."""
OwnHand = Literal["participant", "synthetic"]
"""Whose hand is on the participant's own keys."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Press:
    """A press of a key or button at the experimenter's screen.

    `at_s` is when it went down; `serial` is the number of the position that was on the screen then.
    """

    at_s: float
    serial: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that can happen to a live run."""


# the experimenter's hand


@dataclass(frozen=True, slots=True, kw_only=True)
class DamperSet(Event):
    """The damper is set as the screen asks for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fire(Event):
    """The gun is in the participant's hand: fire."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer(Event):
    """The participant chose an answer; `at_s` is when the key for it went down, if there was one.

    A synthetic participant's `response_time_s` is drawn, not measured.
    """

    response: str
    at_s: float | None = None
    by: Hand = "experimenter"
    response_time_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Next(Event):
    """The participant said next."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rating(Event):
    """A rating that was told; `None` is no answer."""

    rating: float | None
    by: Hand = "experimenter"


@dataclass(frozen=True, slots=True, kw_only=True)
class Description(Event):
    """The participant's words that were told; may be empty."""

    text: str
    by: Hand = "experimenter"


@dataclass(frozen=True, slots=True, kw_only=True)
class Told(Event):
    """The participant was told what the screen says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EndBreak(Event):
    """The break is to end early."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Finish(Event):
    """There is nothing left to correct: the run ends."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rearm(Event):
    """A key was held for so long to go on after an emergency stop: a test shot is fired.

    `None`: two words were typed, where no key can be held.
    """

    held_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pause(Event):
    """Hold everything. `cause`: why, where nobody asked for it."""

    cause: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoOn(Event):
    """Go on after a pause."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Undo(Event):
    """Open the last entry for correction, or the one before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Correct(Event):
    """What the participant had said: one of the answers, a rating (`None`: no answer), or words."""

    value: str | float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Leave(Event):
    """Leave a correction as it was."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeat(Event):
    """The trial at hand, or the last one, was spoiled and is to be presented again; it is, if another is named."""

    reason: str
    trial: Trial | None = None
    by: RepeatedBy = "experimenter"


@dataclass(frozen=True, slots=True, kw_only=True)
class Flag(Event):
    """Mark a trial with a word: the one at hand if none is named."""

    flag: str
    trial: Trial | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Note(Event):
    """Words on a trial: the one at hand if none is named."""

    text: str
    trial: Trial | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason(Event):
    """Why there was an emergency stop, said afterwards."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop(Event):
    """The run is to stop here; it can be resumed."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EmergencyStop(Event):
    """Disarm, and arm no more in this run. `by` is at whose screen."""

    by: Literal["experimenter", "participant"] = "experimenter"


# the participant's hand


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantKey(Event):
    """A key of the participant's own; `step` is the number of the step that asked, `at_s` when it went down.

    `typed`: a line or a page was open on the console, which may have been what the key was for. `timed`: `at_s` is
    when it went down, and not when the program that stamps keys woke up.
    """

    response: str
    at_s: float
    step: int
    timed: bool = True
    by: OwnHand = "participant"
    typed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantRated(Event):
    """A rating on the participant's own screen; `step` is the number of the step that asked."""

    rating: float
    step: int
    by: OwnHand = "participant"


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantDescribed(Event):
    """A description on the participant's own screen, may be empty; `step` is the number of the step that asked."""

    text: str
    step: int
    by: OwnHand = "participant"


# the world


@dataclass(frozen=True, slots=True, kw_only=True)
class BreakOver(Event):
    """The time of a break is over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GunFault(Event):
    """The gun refused."""

    cause: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkLost(Event):
    """The gun did not answer, or not what it must."""

    cause: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantLost(Event):
    """The participant's screen is gone, or not to be seen."""

    cause: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantBack(Event):
    """The participant's screen is there again."""

    how: str = "The participant's screen was started again."


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplayLost(Event):
    """The display of the console is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultsGone(Event):
    """The journal is not where it was, or has not taken what the run goes by."""

    cause: str


_WORDS: dict[type[Event], str] = {
    DamperSet: "damper",
    Fire: "fire",
    Answer: "answer",
    Next: "next",
    Rating: "rating",
    Description: "description",
    Told: "told",
    EndBreak: "end of the break",
    Finish: "end",
    Rearm: "test shot",
    Pause: "pause",
    GoOn: "go on",
    Undo: "undo",
    Correct: "correction",
    Leave: "leave",
    Repeat: "repeat",
    Flag: "flag",
    Note: "note",
    Reason: "reason",
    Stop: "stop",
    EmergencyStop: "emergency stop",
    ParticipantKey: "participant's key",
    ParticipantRated: "participant's rating",
    ParticipantDescribed: "participant's description",
    BreakOver: "break over",
    GunFault: "gun fault",
    LinkLost: "link lost",
    ParticipantLost: "participant's screen lost",
    ParticipantBack: "participant's screen back",
    DisplayLost: "display lost",
    ResultsGone: "results folder gone",
}

KINDS: tuple[type[Event], ...] = tuple(_WORDS)
"""Every kind of event."""

OwnHandEvent = ParticipantKey | ParticipantRated | ParticipantDescribed
OWN_HAND_EVENTS = (ParticipantKey, ParticipantRated, ParticipantDescribed)
"""What the participant says by their own hand."""

ACTS: tuple[type[Event], ...] = (
    DamperSet,
    Fire,
    Answer,
    Next,
    Rating,
    Description,
    Told,
    EndBreak,
    Finish,
    Rearm,
    GoOn,
    Correct,
)
"""What carries the run on: by the experimenter's hand it counts only for the screen on which its press began."""

TO_FIRE = (Fire, GoOn)
"""What leads to a shot: pressed on a screen that stood still, it would come when nobody expects it any more."""

ENTERED = (Answer, Rating, Description)
"""What answers a question by the experimenter's hand."""

TYPED: tuple[type[Event], ...] = (Flag, Note, Reason)
"""What is typed in a line that lay over what stands there: its Enter is not to act a second time."""

DISARMS: tuple[type[Event], ...] = (Pause, Stop, EmergencyStop, ParticipantLost, DisplayLost, ResultsGone)
"""What has the gun disarmed at once, beside the run, where it may be armed; the emergency stop everywhere."""


def answer_said(event: Event) -> AnswerValue:
    """What an event says was answered; `None` if it says nothing, or that there is no answer."""
    match event:
        case Answer(response=said) | ParticipantKey(response=said):
            return said
        case Rating(rating=said) | ParticipantRated(rating=said) | Correct(value=said):
            return said
        case Description(text=said) | ParticipantDescribed(text=said):
            return said
        case _:
            return None


def word(kind: type[Event]) -> str:
    """What an event is called."""
    return _WORDS[kind]
