"""What the experimenter can do: each command of a key or button ends here, as an event. Knows nothing of Qt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from device.words import Direction
from experiments import events
from experiments.clock import Clock
from experiments.entries import trial_at, value
from experiments.events import Event, Hand, Press
from experiments.live_run import LiveRun
from experiments.plan import Trial
from experiments.preference.config import RatingScale
from experiments.remarks import flag_word
from experiments.screens.console.keys import Name, why_not
from experiments.screens.texts import FLAG_RULE, short_place, typed_number
from experiments.states import State
from experiments.steps import Ask


class View(Protocol):
    """What the controls need of the window."""

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer."""

    def ask_line(self, question: str, enter: Callable[[str, Press], None]) -> None:
        """Ask for a line of text, and hand it over with the press that entered it, if one does."""


class Controls:
    """The experimenter's hands on a live run. `observer` is the synthetic participant, where it answers."""

    def __init__(
        self,
        live: LiveRun,
        clock: Clock,
        view: View,
        *,
        scale: RatingScale | None = None,
        hand: Hand = "experimenter",
        restart: Callable[[], None] = lambda: None,
        observer: Any = None,
    ) -> None:
        self._live, self._clock, self._view = live, clock, view
        self._scale, self._hand, self._restart = scale, hand, restart
        self._observer = observer

    def press(self, at_s: float | None = None) -> Press:
        """A press at this moment, or at an earlier one, for what is on the screen now."""
        return Press(at_s=self._clock.now() if at_s is None else at_s, serial=self._live.position.serial)

    def offer(self, event: Event, press: Press | None = None) -> bool:
        """Have an event judged, and say what there is to say of it; whether it was taken."""
        verdict = self._live.offer(event, press)
        if verdict.text:
            self._view.say(verdict.text, "wait" if verdict.taken else "bad")
        return verdict.taken

    def do(self, name: Name, press: Press) -> None:
        """Carry out a command that is one event, or that asks for a line first."""
        match name:
            case "forward" | "backward":
                self._answer(name, press)
            case "no answer":
                self._rate(None, press)
            case "end break" | "repeat" | "flag" | "note" | "reason" | "stop":
                self._ask_for(name)
            case "restart":
                self._restart()
            case _ if (event := _EVENTS.get(name)) is not None:
                self.offer(event, press)
            case _:
                raise KeyError(name)

    def _answer(self, response: Direction, press: Press) -> None:
        if self._live.position.state is State.CORRECTING:
            self.offer(events.Correct(value=response), press)
        else:
            drawn_s = self._drawn_s(response)
            self.offer(events.Answer(response=response, at_s=press.at_s, by=self._hand, response_time_s=drawn_s), press)

    def _drawn_s(self, response: Direction) -> float | None:
        """The synthetic participant's response time, if it is its answer that was entered."""
        step = self._live.position.step
        if self._observer is None or not isinstance(step, Ask):
            return None
        answer = self._observer.answer(step.trial)
        return float(answer.response_time_s) if answer.response == response else None

    def number(self, typed: str, press: Press) -> bool:
        """A rating as it was typed; whether it was taken."""
        scale = self._scale
        rating = None if scale is None else typed_number(typed, scale.minimum, scale.maximum)
        if rating is None:
            ends = "a number" if scale is None else f"a number from {scale.minimum:g} to {scale.maximum:g}"
            self._view.say(f"Not a rating: type {ends}.", "bad")
            return False
        return self._rate(rating, press)

    def _rate(self, rating: float | None, press: Press) -> bool:
        if self._live.position.state is State.CORRECTING:
            return self.offer(events.Correct(value=None if rating is None else float(rating)), press)
        return self.offer(events.Rating(rating=rating, by=self._hand), press)

    def words(self, text: str, press: Press) -> bool:
        """The participant's words; none is an answer as well."""
        if self._live.position.state is State.CORRECTING:
            return self.offer(events.Correct(value=text.strip()), press)
        return self.offer(events.Description(text=text.strip()), press)

    def finish(self, press: Press) -> None:
        """There is nothing left to correct."""
        self.offer(events.Finish(), press)

    def rearm(self, pressed: Press, held_s: float) -> None:
        """A key was held."""
        self.offer(events.Rearm(held_s=held_s), pressed)

    def entered_so_far(self) -> str:
        """What the open correction says now, to be typed over."""
        entry = self._live.position.correcting
        said = None if entry is None else value(self._live.told, entry)
        return "" if said is None else f"{said:g}" if isinstance(said, float) else said

    # lines

    def _ask_for(self, name: Name) -> None:
        """Ask for the line that a command needs, if it can do anything with it now."""
        refused = why_not(name, self._live.position)
        if name == "repeat" and not refused and self._live.repeated() is None:
            refused = "There is no trial of this set to repeat now."
        if refused:
            self._view.say(refused, "bad")
            return
        trial = self._live.trial
        self._view.ask_line(self._question(name, trial), lambda line, press: self._entered(name, trial, line, press))

    def _question(self, name: Name, trial: Trial) -> str:
        live = self._live
        place = short_place(trial, trial_at(live.plan, live.told, live.position.step))
        match name:
            case "end break":
                return "Why does the break end early?"
            case "repeat":
                return f"Why is trial {(live.repeated() or live.trial).trial} to be presented again?"
            case "flag":
                return f"Flag {place} as (a word such as noise or late)"
            case "note":
                return f"Note on {place}"
            case "reason":
                return "Why was there an emergency stop?"
            case _:
                return "Why does the run stop here? It can be resumed."

    def _entered(self, name: Name, trial: Trial, line: str, press: Press) -> None:
        match name:
            case "end break" if self._live.position.base is not State.RESTING:
                self.offer(events.Note(text=f"break: {line}", trial=trial))
                self._view.say("The break is over: what you typed is kept as a note.", "wait")
            case "end break":
                self.offer(events.EndBreak(reason=line), press)
            case "repeat":
                self.offer(events.Repeat(reason=line), press)
            case "flag":
                self._flag(line, trial)
            case "note":
                self.offer(events.Note(text=line, trial=trial))
            case "reason":
                self.offer(events.Reason(text=line), press)
            case _:
                self.offer(events.Stop(reason=line), press)

    def _flag(self, typed: str, trial: Trial) -> None:
        flag = flag_word(typed)
        if flag is None:
            self._view.say(FLAG_RULE, "bad")
        else:
            self.offer(events.Flag(flag=flag, trial=trial))


_EVENTS: dict[Name, Event] = {
    "fire": events.Fire(),
    "next": events.Next(),
    "damper": events.DamperSet(),
    "pause": events.Pause(),
    "go on": events.GoOn(),
    "undo": events.Undo(),
    "leave": events.Leave(),
    "emergency": events.EmergencyStop(),
}
