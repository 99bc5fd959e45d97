"""The table of states of a live run: what each event does in each state, or the sentence that says why nothing.

Pure. Every screen asks it, and the runner obeys it; nothing beside it decides who may act. A position is a stack of
states: what the session's step is at, and a pause or a correction laid over it. The state on top counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from experiments.session import events
from experiments.session.events import Event
from experiments.session.steps import Ask, Asking, FireShot, Step


class State(StrEnum):
    """Where a live run is."""

    SAVING = "saving"
    REARMING = "rearming"
    SETTING = "setting"
    PREPARING = "preparing"
    FIRING = "firing"
    TRAIN = "train"
    ASKING = "asking"
    RATING = "rating"
    DESCRIBING = "describing"
    INFORMING = "informing"
    RESTING = "resting"
    CLOSING = "closing"
    PAUSED = "paused"
    CORRECTING = "correcting"
    HALTED = "halted"
    STOPPED = "stopped"


S = State
EMERGENCY = "emergency stop"
ARMED = (S.FIRING, S.TRAIN)
"""The states in which the gun may be armed, and no others."""


@dataclass(frozen=True, slots=True)
class To:
    """The step's state is left for another, with everything that lay over it."""

    state: State


@dataclass(frozen=True, slots=True)
class Over:
    """A state is laid over the one there is; `under` takes the place of that one, if it is named."""

    state: State
    under: State | None = None


@dataclass(frozen=True, slots=True)
class Back:
    """The state on top is taken away."""


@dataclass(frozen=True, slots=True)
class Stay:
    """It is done, and the state is the same."""


@dataclass(frozen=True, slots=True)
class Beneath:
    """It is as the state beneath says, and the one on top stays."""


@dataclass(frozen=True, slots=True)
class No:
    """Nothing happens, because."""

    because: str


Change = To | Over | Back | Stay | Beneath | No

BACK, STAY, BENEATH = Back(), Stay(), Beneath()

WHY_NOT: dict[State, str] = {
    S.SAVING: "One moment: the last step is being saved.",
    S.REARMING: "After an emergency stop a test shot comes first.",
    S.SETTING: "Set the damper first, and confirm it.",
    S.PREPARING: "Nothing was fired yet.",
    S.FIRING: "The shot is on its way.",
    S.TRAIN: "The gun is firing until the participant says next.",
    S.ASKING: "The answer is awaited.",
    S.RATING: "The answer is awaited.",
    S.DESCRIBING: "The answer is awaited.",
    S.INFORMING: "The participant is to be told something first.",
    S.RESTING: "It is a break.",
    S.CLOSING: "Everything is answered: the run can be ended.",
    S.PAUSED: "The run is paused: go on first.",
    S.CORRECTING: "A correction is open: enter it, or leave it.",
    S.HALTED: "After the emergency stop nothing fires in this run: close it, then resume it.",
    S.STOPPED: "The run has ended.",
}
"""Why something does not happen, where no better reason is known."""

_NOT_HELD = "There is no pause."
_NOT_OPEN = "No correction is open."
_STEPS = (S.SAVING, S.SETTING, S.PREPARING, S.ASKING, S.RATING, S.DESCRIBING, S.INFORMING, S.RESTING)
_LIVE = tuple(state for state in State if state is not S.STOPPED)


def _each(states: tuple[State, ...], change: Change) -> dict[State, Change]:
    return dict.fromkeys(states, change)


_ROWS: dict[type[Event], dict[State, Change]] = {
    events.DamperSet: {S.SETTING: To(S.PREPARING), S.PREPARING: No("The damper is set already.")},
    events.Fire: {S.PREPARING: To(S.FIRING)},
    events.Answer: {S.ASKING: To(S.SAVING)},
    events.Next: {S.TRAIN: To(S.SAVING)},
    events.Rating: {S.RATING: To(S.SAVING)},
    events.Description: {S.DESCRIBING: To(S.SAVING)},
    events.Told: {S.INFORMING: To(S.SAVING)},
    events.EndBreak: {S.RESTING: To(S.SAVING)},
    events.Finish: {S.CLOSING: To(S.SAVING)},
    events.Rearm: {S.REARMING: To(S.FIRING)},
    events.Pause: {
        **_each(_STEPS, Over(S.PAUSED)),
        **_each(ARMED, Over(S.PAUSED, under=S.SAVING)),
        S.CORRECTING: No("Nothing fires while a correction is open; leave it, then pause."),
        S.CLOSING: No("Everything is answered, so there is nothing to hold: the run can be ended."),
        S.PAUSED: No("The run is paused already."),
    },
    events.GoOn: {**_each(_LIVE, No(_NOT_HELD)), S.PAUSED: BACK},
    events.Undo: {
        **_each(
            (
                *(S.SETTING, S.PREPARING, S.ASKING, S.RATING, S.DESCRIBING, S.INFORMING),
                *(S.RESTING, S.CLOSING, S.PAUSED, S.HALTED),
            ),
            Over(S.CORRECTING),
        ),
        S.CORRECTING: STAY,
    },
    events.Correct: {**_each(_LIVE, No(_NOT_OPEN)), S.CORRECTING: BACK},
    events.Leave: {**_each(_LIVE, No(_NOT_OPEN)), S.CORRECTING: BACK},
    events.Repeat: {
        **_each((S.SETTING, S.PREPARING, S.ASKING, S.RATING, S.INFORMING, S.RESTING, S.CLOSING), To(S.SAVING)),
        S.DESCRIBING: No("It is being described: it cannot be presented again now."),
        S.TRAIN: No("End the train first (“next”); then it can be presented again."),
    },
    events.Flag: _each(_LIVE, STAY),
    events.Note: _each(_LIVE, STAY),
    events.Reason: {**_each(_LIVE, No("There was no emergency stop.")), S.HALTED: STAY},
    events.Stop: _each(_LIVE, To(S.STOPPED)),
    events.EmergencyStop: {**_each(_LIVE, To(S.HALTED)), S.HALTED: STAY},
    events.ParticipantKey: {S.ASKING: To(S.SAVING), S.CORRECTING: BENEATH},
    events.ParticipantRated: {S.RATING: To(S.SAVING), S.CORRECTING: BENEATH},
    events.ParticipantDescribed: {S.DESCRIBING: To(S.SAVING), S.CORRECTING: BENEATH},
    events.BreakOver: {S.RESTING: To(S.SAVING)},
    events.GunFault: {**_each(_LIVE, STAY), **_each(ARMED, To(S.SAVING))},
    events.LinkLost: {**_each(_LIVE, STAY), **_each(ARMED, To(S.SAVING))},
    events.ParticipantLost: {
        **_each(_LIVE, STAY),
        **_each((S.REARMING, *_STEPS), Over(S.PAUSED)),
        **_each(ARMED, Over(S.PAUSED, under=S.SAVING)),
        S.CORRECTING: BENEATH,
    },
    events.ParticipantBack: _each(_LIVE, STAY),
    events.DisplayLost: _each(_LIVE, To(S.STOPPED)),
    events.ResultsGone: {**_each(_LIVE, To(S.STOPPED)), S.HALTED: STAY},
}

TABLE: dict[type[Event], dict[State, Change]] = {
    kind: {state: _ROWS[kind].get(state, No(WHY_NOT[state])) for state in State} for kind in events.KINDS
}
"""What each event does in each state."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Where a live run is. `serial` counts the positions, `number` the steps.

    `since_s` is since when the states are as they are; `until_s` is when a break ends, but for the pause that is on;
    `onset_s` is when the last stimulus began; `not_before_s` is from when on the participant's next is taken at all;
    `keys_from_s` is from when on a participant's key may answer what is asked: the onset, if `asked_at_onset`, right
    after one stimulus, else when it was asked; `paused_s` is since when the run is paused; `correcting` is what asked
    for the entry that is open; `entered` is what the experimenter entered last, behind the number of its step; `why` is
    the reason of a pause that nobody asked for, of a halt or of a stop.
    """

    states: tuple[State, ...] = (S.SAVING,)
    serial: int = 0
    number: int = 0
    step: Step | None = None
    since_s: float = 0.0
    until_s: float | None = None
    onset_s: float | None = None
    not_before_s: float | None = None
    keys_from_s: float = 0.0
    asked_at_onset: bool = False
    paused_s: float | None = None
    correcting: Asking | None = None
    entered: tuple[int, Event] | None = None
    why: str = ""

    @property
    def state(self) -> State:
        """The state that counts."""
        return self.states[-1]

    @property
    def base(self) -> State:
        """What the session's step is at, whatever lies over it."""
        return self.states[0]

    def entered_for(self, number: int) -> Event | None:
        """What the experimenter entered for a step, if that was the last that they did."""
        return self.entered[1] if self.entered is not None and self.entered[0] == number else None

    @property
    def held(self) -> bool:
        """Whether something lies over the step, so that its time does not run out."""
        return len(self.states) > 1


def change_of(position: Position, kind: type[Event]) -> To | Over | Back | Stay | No:
    """What an event does at a position, all the way down to the state that decides."""
    for state in reversed(position.states):
        change = TABLE[kind][state]
        if not isinstance(change, Beneath):
            return change
    return No(WHY_NOT[position.state])


def after(position: Position, kind: type[Event], now_s: float) -> Position | No:
    """The position after an event, or why there is none."""
    change = change_of(position, kind)
    if isinstance(change, No):
        return change
    states = _states(position.states, change, TABLE[kind][position.state])
    return replace(
        position,
        states=states,
        serial=position.serial + (states != position.states),
        since_s=now_s if states != position.states else position.since_s,
        until_s=_until_s(position, states, now_s),
        paused_s=_paused_s(position, states, now_s),
        correcting=position.correcting if S.CORRECTING in states else None,
    )


def _states(states: tuple[State, ...], change: To | Over | Back | Stay, on_top: Change) -> tuple[State, ...]:
    """The stack after a change; a state that hands down to the one beneath it stays on top."""
    if isinstance(on_top, Beneath):
        return (*_states(states[:-1], change, change), states[-1])
    match change:
        case To(state):
            return (state,)
        case Over(state, None):
            return (*states, state)
        case Over(state, under):
            return (under or states[0], state)
        case Back():
            return states[:-1]
        case Stay():
            return states


def _paused_s(position: Position, states: tuple[State, ...], now_s: float) -> float | None:
    """Since when a run is paused: a pause counts from its beginning, whatever happens in it."""
    if S.PAUSED not in states:
        return None
    return now_s if position.paused_s is None else position.paused_s


def _until_s(position: Position, states: tuple[State, ...], now_s: float) -> float | None:
    """When a break ends: what a pause took of it is given back."""
    if position.until_s is None or position.paused_s is None or S.PAUSED in states:
        return position.until_s
    return position.until_s + now_s - position.paused_s


def entered(position: Position, state: State, now_s: float, step: Step | None, until_s: float | None) -> Position:
    """The position at which the session's next step stands; what lay over the last one still lies over it.

    A break that comes in a pause ends by as much later as the pause lasts from now on.
    """
    new = step is not None and step is not position.step
    at_onset = _is_asked_at_onset(position, step) if new else position.asked_at_onset
    asked_s = position.onset_s if at_onset and position.onset_s is not None else now_s
    if until_s is not None and position.paused_s is not None:
        until_s -= now_s - position.paused_s  # the whole pause is given back at its end
    return replace(
        position,
        states=(state, *position.states[1:]),
        serial=position.serial + 1,
        number=position.number + new,
        step=step if new else position.step,
        since_s=now_s,
        until_s=until_s,
        onset_s=None if state in ARMED else position.onset_s,
        not_before_s=None,
        keys_from_s=asked_s if new else position.keys_from_s,
        asked_at_onset=at_onset,
    )


def _is_asked_at_onset(position: Position, step: Step | None) -> bool:
    """What was pressed in a train, or for the question before, is no answer to one that nobody had asked yet."""
    after_shot = isinstance(position.step, FireShot) and position.onset_s is not None
    return after_shot and isinstance(step, Ask) and not step.later


def why_after(before: Position, event: Event) -> str | None:
    """The reason that belongs to the position after an event; `None`: that which was there before.

    After an emergency stop the run stopped for that, whatever closed it.
    """
    match event:
        case events.EmergencyStop():
            return EMERGENCY
        case events.Stop() | events.DisplayLost() if before.base is State.HALTED:
            return EMERGENCY
        case events.Stop():
            return event.reason
        case events.DisplayLost():
            return "the display was lost"
        case events.ResultsGone() if before.base is State.HALTED:
            return None
        case events.Pause() | events.ParticipantLost() | events.ResultsGone():
            return event.cause
        case events.GoOn() | events.ParticipantBack():
            return ""
        case _:
            return None
