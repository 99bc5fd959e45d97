"""Whether an event is taken at a moment of a live run, or why not, and what of it is kept as a remark. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from experiments.design.plan import Plan, Trial
from experiments.session import events, remarks
from experiments.session.events import ACTS, ENTERED, OWN_HAND_EVENTS, TO_FIRE, Event, Press
from experiments.session.history import History, entered_value, entries, ranks_of_others, repeatable, trial_at
from experiments.session.states import WHY_NOT, No, Position, State, after, why_after
from experiments.session.steps import Ask, Asking, Inform, Rate, is_answer, what
from experiments.tasks.questions import on_scale

REARM_HELD_S = 1.0
"""For so long a key is held to go on after an emergency stop."""
STOOD_STILL = "the program stood still for more than 1 s, and nothing was fired after it: look where the gun is"
HEARS_LATE = "this computer is too busy to hear a stop in time, so nothing fires: close what else runs on it"
HALTED_PRACTICE = "After the emergency stop nothing fires in this practice: close it, then do it again."
KEYS_ELSEWHERE = "another window had the keys, where F12 is not heard: click here, and keep it in front"
MINIMISED = "The participant's window is minimised, and they see nothing: bring it back first."
NOTHING_TO_UNDO = "There is nothing to undo in this set."
NOTHING_TO_REPEAT = "There is no trial of this set to repeat now."
STANDSTILL_S = 1.0
"""A screen that did not look at its keys for so long stood still: as long as a gun that was away may still be armed."""
_SETTLED = 3
"""So many beats in time after that, and what was pressed meanwhile has come."""
BEAT_S = 0.1
"""How often a screen looks at its keys."""
_PROMPT_S = 0.3
"""Beats further apart than that and a stop may wait to be heard: nothing fires before it (assumed)."""
DEAF_S = 0.5
"""Nor while another window has the keys for so long, from the beat before the last that heard them on: 0.6 s at the
most. The keys pass from window to window in 0.3 s (assumed)."""
_LATE_S = 3.0
"""Nor does anything if that goes on for so long, and the experimenter is told (assumed)."""


class Beats:
    """Since when a screen has looked at its keys without standing still, by a timer that beats in the same program.

    What was pressed in a standstill is dated in it, or as it comes. Where nothing beats, nothing stands still.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now, self._last_s, self._alive_s, self._in_time = now, math.inf, -math.inf, _SETTLED
        self._lately: tuple[float, ...] = ()
        self._late_s = self._deaf_s = math.inf
        self._was_deaf_s, self._heard_s = -math.inf, math.inf

    def beat(self, *, heard: bool = True) -> None:
        """The timer beats; `heard`: what is pressed comes here.

        The time is read once: wherever this itself stands still, the next beat is late.
        """
        now_s = self._now()
        self._note_deaf(self._last_s if heard else now_s)
        if heard:  # what the window system tells late, a beat may not know yet
            self._deaf_s, self._heard_s = math.inf, min(self._last_s, now_s)
        else:
            self._deaf_s = min(self._deaf_s, self._heard_s + BEAT_S, now_s)
        self._in_time = 0 if now_s - self._last_s > STANDSTILL_S else self._in_time + 1
        self._last_s = now_s
        self._lately = (*self._lately[-_SETTLED:], now_s)
        self._late_s = math.inf if self.prompt else min(self._late_s, now_s)
        if self._in_time == _SETTLED:
            self._alive_s = now_s

    def hear(self) -> None:
        """A key came here, or would have: so what is pressed is heard."""
        self._note_deaf(self._last_s)
        self._deaf_s, self._heard_s = math.inf, self._now()

    def _note_deaf(self, last_s: float) -> None:
        """If what is pressed has gone elsewhere for a while, it did so until then at the least."""
        if self.is_deaf:
            self._was_deaf_s = last_s

    @property
    def prompt(self) -> bool:
        """Whether the last beats came one soon after the other, so that what was pressed before them has come."""
        return all(later - sooner <= _PROMPT_S for sooner, later in pairwise((*self._lately, self._now())))

    @property
    def hears_late(self) -> bool:
        """Whether that was not so for a while, without a standstill."""
        return self._now() - self._late_s > _LATE_S

    @property
    def is_deaf(self) -> bool:
        """Whether what is pressed has gone elsewhere for a while."""
        return self._now() - self._deaf_s > DEAF_S

    def was_deaf_since(self, since_s: float) -> bool:
        """Whether that was so at any time from then on: F12 may have been pressed and not heard."""
        return self.is_deaf or self._was_deaf_s > since_s

    @property
    def alive_since_s(self) -> float:
        """Since when; infinity while it stands still, and until what was pressed meanwhile has come."""
        is_late = self._now() - self._last_s > STANDSTILL_S
        return math.inf if is_late or self._in_time < _SETTLED else self._alive_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """All that an event is judged by.

    `painted_s` is when the position was on the screen; a press within `guard_s` after that is ignored; `pauses`
    are begin and end of each; `alive_since_s` is since when the screen has looked at its keys without standing still;
    `gun_silence` is why the gun does not answer, as far as somebody looked; `minimised`: the participant's window is,
    on which they are asked.
    """

    plan: Plan
    history: History
    position: Position
    now_s: float
    painted_s: float | None
    guard_s: float
    pauses: Sequence[tuple[float, float]] = ()
    alive_since_s: float = -math.inf
    gun_silence: str = ""
    minimised: bool = False

    @property
    def trial(self) -> Trial:
        """The trial at hand: that of an open correction, else that of the step, else the last one."""
        entry = self.position.correcting
        return entry.trial if entry else trial_at(self.plan, self.history, self.position.step)

    @property
    def further_back(self) -> Asking | None:
        """The entry that undo opens: the last of the set, or the one before that which is open."""
        found, here = entries(self.history, self.trial), self.position.correcting
        if here in found:
            return found[max(0, found.index(here) - 1)]
        return found[-1] if found else None

    @property
    def repeatable(self) -> Trial | None:
        """The trial that would be presented again."""
        step = self.position.step
        return repeatable(self.history, step, trial_at(self.plan, self.history, step))

    @property
    def keys_from_s(self) -> float:
        """From when on a participant's key may answer; after another question a doubled press is none either."""
        return self.position.keys_from_s + (0.0 if self.position.asked_at_onset else self.guard_s)

    def is_ready(self, at_s: float) -> bool:
        """Whether a press at a time would be late enough for what stands there."""
        return self.painted_s is not None and at_s - self.painted_s >= self.guard_s

    def paused_between(self, from_s: float, to_s: float) -> bool:
        """Whether the run was paused at any time between two."""
        return any(began_s <= to_s and ended_s >= from_s for began_s, ended_s in self.pauses)


def meant(moment: Moment, event: Event) -> tuple[Event, str]:
    """The event as it is meant, and a message: a rating is kept to the scale's grain, also where it is corrected.

    A correction that changes nothing does not count as one.
    """
    entry = moment.position.correcting
    if not isinstance(event, events.Correct) or entry is None:
        return event, ""
    if isinstance(entry, Rate) and isinstance(event.value, float) and is_answer(entry, event.value):
        event = replace(event, value=on_scale(event.value, entry))
    if event.value == entered_value(moment.history, entry):
        return events.Leave(), "That is what stands there: nothing was corrected."
    return event, ""


def event_refusal(moment: Moment, event: Event, press: Press | None) -> str:
    """Why an event is not taken; empty if it is. `press`: by the experimenter's hand."""
    judged = after(moment.position, type(event), moment.now_s)
    if isinstance(judged, No):
        halted_practice = moment.plan.practice and judged.because == WHY_NOT[State.HALTED]
        return HALTED_PRACTICE if halted_practice else _entered_first(moment, event) or judged.because
    return _mistimed(moment, event, press) or _impossible(moment, event)


def moved(moment: Moment, event: Event) -> Position:
    """The position after an event that is taken. `TypeError`: it is refused."""
    before = moment.position
    position = after(before, type(event), moment.now_s)
    if isinstance(position, No):
        raise TypeError(position.because)
    if isinstance(event, ENTERED):
        position = replace(position, entered=(before.number, event))
    if isinstance(event, events.Undo):
        entry = moment.further_back
        serial = position.serial + (entry != before.correcting and position.serial == before.serial)
        return replace(position, correcting=entry, serial=serial)
    if isinstance(event, events.Correct) and _is_told_of(before):
        position = replace(position, states=(State.SAVING, *position.states[1:]))
    why = why_after(before, event)
    return position if why is None else replace(position, why=why)


def _is_told_of(position: Position) -> bool:
    """Whether the participant is being told of the answer that is corrected, which is not true any more.

    Not after an emergency stop: what is halted stays so.
    """
    entry, told = position.correcting, position.step
    if position.base is not State.INFORMING or not isinstance(told, Inform):
        return False
    return entry is not None and told.trial == entry.trial


def _mistimed(moment: Moment, event: Event, press: Press | None) -> str:
    if not isinstance(event, ACTS):
        return ""
    not_before_s = moment.position.not_before_s
    if isinstance(event, events.Next) and not_before_s is not None and moment.now_s < not_before_s:
        return "Too soon: it is to be felt for longer."
    if press is None:
        return ""
    if press.serial != moment.position.serial or moment.painted_s is None:
        return "That was pressed for what stood there before: press again."
    if _fires(event) and press.at_s < moment.alive_since_s:
        return "The console stood still as that was pressed: look where the gun is, and press again."
    return "" if moment.is_ready(press.at_s) else "Too soon after the change: press again."


def _fires(event: Event) -> bool:
    """Whether an event leads to a shot by the press alone; a key that is held counts only while it is looked at."""
    return isinstance(event, TO_FIRE) or (isinstance(event, events.Rearm) and event.held_s is None)


def _impossible(moment: Moment, event: Event) -> str:  # noqa: C901, PLR0911 - one case an event
    match event:
        case _ if isinstance(event, OWN_HAND_EVENTS):
            return _not_asked(moment, event)
        case events.Correct(value=value) if (entry := moment.position.correcting) and not is_answer(entry, value):
            return f"That is no {what(entry)}."
        case events.Rating(rating=None) if isinstance(step := moment.position.step, Rate) and not step.may_be_skipped:
            return "An answer is needed here."
        case events.Rating(rating=rank):
            return _taken(moment, rank)
        case events.Answer(response=response) if not _is_choice(moment, response):
            return f"“{response}” is not among the answers."
        case events.Fire() | events.Rearm() | events.GoOn():
            return _not_ready(moment, event)
        case events.Undo() if moment.further_back is None:
            return NOTHING_TO_UNDO
        case events.Undo() if moment.further_back == moment.position.correcting:
            return "There is nothing further back in this set."
        case events.Repeat() if moment.repeatable is None:
            return NOTHING_TO_REPEAT
        case events.Repeat(trial=Trial() as trial) if trial != moment.repeatable:
            return f"Trial {trial.trial} cannot be presented again any more."
        case _:
            return ""


def _not_ready(moment: Moment, event: events.Fire | events.Rearm | events.GoOn) -> str:
    """What is to be seen to before anything is fired, or goes on."""
    if isinstance(event, events.GoOn):
        return MINIMISED if moment.minimised else ""
    if moment.gun_silence:
        return f"See to the gun first: {moment.gun_silence.rstrip('.')}."
    too_short = isinstance(event, events.Rearm) and event.held_s is not None and event.held_s < REARM_HELD_S
    return f"Hold it for {REARM_HELD_S:g} s." if too_short else ""


def _not_asked(moment: Moment, event: events.OwnHandEvent) -> str:
    """Why what the participant did is no answer to what is asked."""
    if event.step != moment.position.number:
        return _entered_first(moment, event) or "It was the answer to an earlier question."
    if isinstance(event, events.ParticipantRated):
        return _taken(moment, event.rating)
    if isinstance(event, events.ParticipantDescribed):
        return ""
    if not _is_choice(moment, event.response):
        return f"“{event.response}” is not among the answers."
    if event.typed:
        return "It went into what is open on the console: leave that (Esc), then have it pressed again."
    if event.at_s >= moment.keys_from_s and not moment.paused_between(event.at_s, event.at_s):
        return ""
    return f"It went down before the {'stimulus' if moment.position.asked_at_onset else 'question'}, or in a pause."


def _entered_first(moment: Moment, event: Event) -> str:
    """Of what the participant did: that the experimenter entered an answer to that question, which was taken first."""
    entered = moment.position.entered_for(event.step) if isinstance(event, OWN_HAND_EVENTS) else None
    if entered is None:
        return ""
    said, own = events.answer_said(entered), events.answer_said(event)
    if said == own:
        return f"“{said}” was entered at the console first: it is the same."
    earlier_s = 0.0
    if isinstance(entered, events.Answer) and isinstance(event, events.ParticipantKey) and event.timed:
        earlier_s = (entered.at_s or -math.inf) - event.at_s
    though = f", though that went down {earlier_s:.2f} s earlier" if earlier_s > 0 else ""
    corrected = "undo corrects it until its set is over, then a note says it"
    return f"“{said}” was entered at the console and taken before “{own}” came{though}: {corrected}."


def _taken(moment: Moment, rank: float | None) -> str:
    """Why a trial cannot have a rank: another one of the set has it, and each has one of its own."""
    asked = moment.position.step
    if rank is None or not isinstance(asked, Rate):
        return ""
    rank = on_scale(rank, asked)
    if rank not in ranks_of_others(moment.history, asked):
        return ""
    return f"{rank:g} was given to another one of this set: each has a rank of its own; undo corrects that one first."


def _is_choice(moment: Moment, response: str) -> bool:
    """Whether an answer is among those that the step asks for."""
    step = moment.position.step
    return isinstance(step, Ask) and response in step.answers


def remark_of(  # noqa: C901, PLR0911 - one case an event
    event: Event, before: Position, then: Position, trial: Trial
) -> remarks.Remark | None:
    """What is written of an event that was taken between two positions; `trial` is the one at hand."""
    match event:
        case events.Flag():
            return remarks.Flagged(trial=event.trial or trial, flag=event.flag)
        case events.ParticipantKey(timed=False):
            return remarks.Flagged(trial=trial, flag=remarks.KEY_TIME_LOST)
        case events.Note():
            return remarks.Noted(trial=event.trial or trial, text=event.text)
        case events.Correct() if before.correcting is not None:
            return _corrected(before.correcting, event)
        case events.Reason():
            return remarks.HaltReason(text=event.text)
        case events.EmergencyStop() if before.base is not State.HALTED:
            return remarks.Halted(by=event.by)
        case events.Pause(cause=cause):
            return remarks.Paused(cause=cause)
        case events.ParticipantBack():
            return remarks.Noted(trial=None, text=event.how)
        case events.ParticipantLost() if before.paused_s is None and then.paused_s is not None:
            return remarks.Paused(cause=event.cause)
        case events.ParticipantLost():
            return remarks.Noted(trial=None, text=event.cause)
        case events.GoOn():
            return remarks.Continued(paused_s=round(then.since_s - (before.paused_s or before.since_s), 3))
        case _:
            return None


def exchanged(moment: Moment, event: Event) -> remarks.EntryCorrected | None:
    """What is corrected along with a rank that another trial of the set has: that one gets the rank that was."""
    entry = moment.position.correcting
    if not isinstance(event, events.Correct) or not isinstance(entry, Rate):
        return None
    other = ranks_of_others(moment.history, entry).get(event.value)
    if other is None:
        return None
    was = entered_value(moment.history, entry)
    return remarks.EntryCorrected(trial=other.trial, question=other.question, value=was)


def refused(event: Event, position: Position, because: str) -> remarks.Refused | None:
    """What is kept of an event that would have carried the run on, and was refused."""
    own = isinstance(event, OWN_HAND_EVENTS)
    if not (own or isinstance(event, ACTS)) or position.base is State.STOPPED:
        return None
    return remarks.Refused(
        event=events.word(type(event)),
        state=str(position.state),
        because=because,
        by="participant" if own else "experimenter",
        answer=events.answer_said(event),
    )


def _corrected(entry: Asking, event: events.Correct) -> remarks.EntryCorrected:
    if not is_answer(entry, event.value):
        raise TypeError(f"{event.value!r} is no {what(entry)}")
    return remarks.EntryCorrected(trial=entry.trial, question=entry.question, value=event.value)
