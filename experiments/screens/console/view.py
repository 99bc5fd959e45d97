"""What the run, which works in a thread of its own, tells the console, and what is shown of it. Pure: no Qt, no clock.

Neither correctness nor a score is in here. The method's name appears only where a damper is set by hand, else a code.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from device import GunStatus
from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Plan, Trial
from experiments.live_run import LiveRun
from experiments.screens import texts
from experiments.screens.console.keys import Name, choices_at, shown_key
from experiments.screens.phrases import phrase
from experiments.session.history import History, trial_at
from experiments.session.remarks import Remark
from experiments.session.states import Position, State
from experiments.session.steps import Asking, Describe, Outcome, Rate, Step

THANK_PARTICIPANT = phrase("Thank the participant.")
"""The last sentence, where nothing else comes next."""


UNANSWERED_S = 1.0
"""What a gun said so long ago is not its state any more: it is asked five times a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """Something that the run tells the window."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Began(Message):
    """The run is there, and can be worked."""

    live: LiveRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown(Message):
    """There is a new position to be shown: the window takes it from the run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Saved(Message):
    """A step's outcome, or a remark, is on the disk."""

    step: Step | None
    word: Outcome | Remark


@dataclass(frozen=True, slots=True, kw_only=True)
class GunSeen(Message):
    """What the gun said of itself, or why it does not answer; `asked_s` is when it was asked."""

    status: GunStatus | None
    asked_s: float
    fault: str = ""

    @property
    def trouble(self) -> str:
        """Why the gun is not to be handed over: it has a fault, or does not answer; empty if neither is so."""
        return self.fault if self.status is None else self.status.fault or ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantSeen(Message):
    """Whether the participant's screen has the keys, or why it is gone; whether noise that is wanted does not play.

    `starting`: one that is gone is being started again.
    """

    focused: bool = False
    failure: str = ""
    starting: bool = False
    noise_off: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble(Message):
    """Something went wrong, and what; or, by its mood, what is done about it.

    Of a `trial` it stands also below what is saved, until something is said of another trial.
    """

    text: str
    mood: str = "bad"
    trial: Trial | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended(Message):
    """The run is over: finished (no reason), or stopped or failed for one.

    `saved`: the answers that were read back from the disk; `None` if none were looked for.
    """

    reason: str | None
    saved: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class About:
    """What does not change during a run.

    `band` says that it is a practice or a training; `participant_rates` and `participant_keys` what the participant
    does on a screen of their own; `messages` are in their language, as the setup's texts are.
    """

    setup: Setup[DesignConfig]
    plan: Plan
    band: str = ""
    last: str = THANK_PARTICIPANT
    simulated: bool = False
    participant_rates: bool = False
    participant_keys: bool = False
    messages: ParticipantMessages = ENGLISH_MESSAGES

    @property
    def rated_last(self) -> bool:
        """Whether all stimuli of a block are rated after all were felt."""
        return bool(self.setup.config.judged_later)


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Everything that is looked at to be shown."""

    about: About
    position: Position = field(default_factory=Position)
    told: History = ()
    gun: GunSeen | None = None
    participant: ParticipantSeen | None = None
    ended: Ended | None = None
    over: frozenset[int] = frozenset()
    """The adaptive tracks that have ended."""
    letters: bool = False
    """Whether letters are text now."""
    halt_unsaved: bool = False
    """Whether an emergency stop could not be written."""
    now_s: float = 0.0

    def key(self, name: Name) -> str:
        """The key of a command as it is now."""
        return shown_key(name, letters=self.letters, choices=choices_at(self.position))

    @property
    def gun_trouble(self) -> str:
        """Why the gun is not to be handed over, as it was seen last; empty if nothing is wrong."""
        return "" if self.gun is None else self.gun.trouble

    @property
    def gun_silent_s(self) -> float:
        """For how long the gun has not answered; 0 if it has just now, or is not asked any more."""
        silent_s = 0.0 if self.gun is None or self.ended is not None else self.now_s - self.gun.asked_s
        return silent_s if silent_s > UNANSWERED_S else 0.0

    @property
    def gun_silence(self) -> str:
        """Why nothing may be fired: the gun does not answer, or has not for a while; empty if it does."""
        if self.gun is None:
            return ""
        if self.gun.fault or not self.gun_silent_s:
            return self.gun.fault
        return phrase("the gun has not answered for {silent_s:.0f} s", silent_s=self.gun_silent_s)

    @property
    def participant_gone(self) -> bool:
        """Whether there was a participant's screen, and is none now."""
        return self.participant is not None and bool(self.participant.failure)

    @property
    def participant_starting(self) -> bool:
        """Whether it is being started again meanwhile."""
        return self.participant is not None and self.participant.starting

    @property
    def here(self) -> Trial:
        """The trial at hand, whatever is corrected."""
        return trial_at(self.about.plan, self.told, self.position.step)


def has_a_page(step: Step | None) -> bool:
    """Whether something can be asked on the participant's own screen: a scale or words, not any number."""
    return isinstance(step, Describe) or (isinstance(step, Rate) and step.grain > 0)


def typed_there(about: About, position: Position) -> bool:
    """Whether the participant's own screen has the keys, for as long as one rating or description follows the other."""
    asked = position.base in (State.RATING, State.DESCRIBING, State.SAVING)
    return about.participant_rates and asked and has_a_page(position.step)


def method_code(plan: Plan, trial: Trial) -> str:
    """The name under which the experimenter meets a method: A, B, C in the order of the run."""
    return phrase("Method {letter}", letter=chr(ord("A") + plan.methods.index(trial.method)))


def method_text(about: About, trial: Trial) -> str:
    """The method's name where its damper is set by hand, else its code; in brackets, as it stands behind others."""
    if not all(other.method for other in about.plan.set_of(trial)):  # it varies within trials, or would tell of others
        return ""
    method = about.setup.gun.methods[trial.method]
    return f" ({method.label if method.damper else method_code(about.plan, trial)})"


def where_text(seen: Seen) -> str:
    """Where the run stands: trial, set, session; nowhere, if it ended before it began.

    A question after the set is headed by its trial, in the participant's words: in the same ones it is not named twice.
    """
    if seen.ended is not None and seen.position.step is None:
        return ""
    plan, step, here = seen.about.plan, seen.position.step, seen.here
    asked = isinstance(step, Asking) and step.later and seen.position.state in _ASKED
    headed = asked and seen.about.messages.place == ENGLISH_MESSAGES.place
    place = texts.set_text(plan, here) if headed else texts.place_text(plan, here)
    method = method_text(seen.about, here) if plan.trials[-1].session > 1 else ""
    track = texts.track_text(plan, seen.told, here), texts.chosen_text(seen.told, here)
    return " · ".join(filter(None, (f"{place}{method}", *track)))


_ASKED = (State.ASKING, State.RATING, State.DESCRIBING, State.SAVING)


def bands(seen: Seen) -> list[tuple[str, str]]:
    """What must not be overlooked, each with its colour's name."""
    found = [(seen.about.band, "practice")] if seen.about.band else []
    if seen.about.simulated:
        found.append((phrase("SIMULATED GUN – nothing is felt"), "simulated"))
    return found
