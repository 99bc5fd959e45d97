"""The words between the run, which works in a thread of its own, and the window: told one way, replied the other."""

from __future__ import annotations

from dataclasses import dataclass

from device import GunStatus
from device.words import Direction
from experiments.plan import Trial
from experiments.remarks import Remark
from experiments.runner import Desk
from experiments.steps import Outcome, Step
from experiments.tables import Told


@dataclass(frozen=True, slots=True, kw_only=True)
class Began:
    """The run is at its desk; what was told before, if it is resumed: steps with their outcomes, and remarks."""

    desk: Desk
    told: Told


@dataclass(frozen=True, slots=True, kw_only=True)
class Waiting:
    """A step waits for somebody; `until_s` is when it ends by itself, if it does."""

    step: Step
    since_s: float
    until_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Working:
    """A step is carried out by the gun."""

    step: Step


@dataclass(frozen=True, slots=True, kw_only=True)
class Saved:
    """A step's outcome, or a remark, is on the disk."""

    step: Step | None
    word: Outcome | Remark


@dataclass(frozen=True, slots=True, kw_only=True)
class GunSeen:
    """The gun as it was a moment ago, or why it does not answer."""

    status: GunStatus | None
    fault: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """The run is over: finished (no reason), or stopped or failed for one."""

    reason: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """Something could not be kept, and why."""

    text: str


Message = Began | Waiting | Working | Saved | GunSeen | Ended | Trouble


@dataclass(frozen=True, slots=True, kw_only=True)
class Go:
    """The gun is in the participant's hand: fire."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The participant said which way; `at_s` is when the key went down."""

    response: Direction
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Again:
    """A trial was spoiled and is to be presented again."""

    trial: Trial
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Next:
    """The participant said next."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EndBreak:
    """The break is to end early."""

    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rating:
    """A rating entered by the experimenter; `None` is no answer."""

    rating: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Comment:
    """The participant's words, entered by the experimenter."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantAnswered:
    """The participant's own hand said which way; `at_s` is when the key went down, on the console's clock."""

    response: Direction
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantRated:
    """The participant rated and described on their own screen."""

    rating: float
    comment: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """The run is to stop here."""

    reason: str


Reply = Go | Answer | Again | Next | EndBreak | Rating | Comment | ParticipantAnswered | ParticipantRated | Stop
