"""What the experimenter can do, at every state: each key and button ends here. Knows nothing of Qt."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

from device import DeviceError
from device.words import Direction
from experiments.clock import Clock
from experiments.journal import JournalError
from experiments.plan import Trial
from experiments.preference.scale import on_scale
from experiments.remarks import AnswerCorrected, Continued, Flagged, Noted, Paused, RatingCorrected, Remark, record
from experiments.runner import Desk
from experiments.screens.console.messages import (
    Again,
    Answer,
    Comment,
    EndBreak,
    Go,
    Message,
    Next,
    Rating,
    Reply,
    Saved,
    Stop,
    Trouble,
)
from experiments.screens.console.state import State, ordinal
from experiments.steps import Ask, Describe, Prepare, Present, Rate, Rest

EMERGENCY = "emergency stop"
MAX_FLAG = 32


class View(Protocol):
    """What the controls need of the window."""

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer."""

    def ask_line(self, question: str, enter: Callable[[str], None]) -> None:
        """Ask for a line of text, and hand it over if one is entered."""

    def refresh(self) -> None:
        """Show what has changed."""


class Controls:
    """The experimenter's hands. `reply` goes to the run, `tell` to the window from any thread."""

    def __init__(
        self, state: State, clock: Clock, view: View, reply: Callable[[Reply], None], tell: Callable[[Message], None]
    ) -> None:
        self._state, self._clock, self._view = state, clock, view
        self._reply, self._tell = reply, tell
        self.desk: Desk | None = None
        self.paused_at_s: float | None = None
        self.correcting: Trial | None = None

    def main(self) -> None:
        """The main key: fire at a hand-over, next during a stimulus."""
        if self._at(Prepare):
            self._reply(Go())
        elif self._at(Present):
            self._reply(Next())

    def answer(self, response: Direction) -> None:
        """What the participant said, of the trial at hand or of the one that is corrected."""
        at_s = self._clock.now()
        if self.correcting is not None:
            self._remark(AnswerCorrected(trial=self.correcting, response=response))
            self.correcting = None
            self._view.refresh()
        elif self._at(Ask):
            self._reply(Answer(response=response, at_s=at_s))

    def rating(self, typed: str) -> None:
        """A rating as it was typed."""
        if self._at(Rate):
            self._with_rating(typed, lambda rating: self._reply(Rating(rating=rating)))

    def no_rating(self) -> None:
        """The participant gives no rating."""
        if self._at(Rate):
            self._reply(Rating(rating=None))

    def words(self, text: str) -> None:
        """The participant's words; none is an answer as well."""
        if self._at(Describe):
            self._reply(Comment(text=text.strip()))

    def end_break(self) -> None:
        """End a break early, for a reason that is kept."""
        if isinstance(self._state.step, Rest):
            self._view.ask_line("Why does the break end early?", lambda why: self._reply(EndBreak(reason=why)))

    def undo(self) -> None:
        """Go to the last answer of the set to correct it, or one further back."""
        if self._state.plan.experiment == "preference":
            self._undo_rating()
            return
        answered = self._state.answered_in_set()
        if not answered:
            self._view.say("Nothing to undo in this set.", "bad")
            return
        place = answered.index(self.correcting) if self.correcting in answered else len(answered)
        self.correcting = answered[max(0, place - 1)]
        self._view.refresh()

    def _undo_rating(self, back: int = 1) -> None:
        """Correct the last rating, or one further back."""
        rated = list(dict.fromkeys(self._state.rated()))
        if not rated:
            self._view.say("There is no rating to undo yet.", "bad")
            return
        trial = rated[max(0, len(rated) - back)]
        question = (
            f"{ordinal(self._state, trial)} was rated {self._state.said(trial)}. What did the participant say? "
            "A number, X for no answer, U to go further back."
        )
        self._view.ask_line(question, lambda typed: self._correct_rating(trial, typed, back))

    def _correct_rating(self, trial: Trial, typed: str, back: int) -> None:
        word = typed.strip().lower()
        if word == "u":
            self._undo_rating(back + 1)
        elif word == "x":
            self._remark(RatingCorrected(trial=trial, rating=None))
        else:
            self._with_rating(typed, lambda rating: self._remark(RatingCorrected(trial=trial, rating=rating)))

    def _with_rating(self, typed: str, use: Callable[[float], None]) -> None:
        scale = self._state.setup.config.rating
        rating = typed_number(typed, scale.minimum, scale.maximum)
        if rating is None:
            self._view.say(f"Not a rating: type a number from {scale.minimum:g} to {scale.maximum:g}.", "bad")
        else:
            use(on_scale(rating, scale.minimum, scale.maximum, scale.grain))

    def repeat(self) -> None:
        """Present the trial at hand again, or at a hand-over the last one of the set."""
        trial = self._repeatable()
        if trial is None:
            self._view.say("There is no trial of this set to repeat now.", "bad")
            return
        question = f"Why is trial {trial.trial} to be repeated?"
        self._view.ask_line(question, lambda why: self._reply(Again(trial=trial, reason=why)))

    def _repeatable(self) -> Trial | None:
        if self._at(Ask):
            return self._state.trial
        answered = self._state.answered_in_set()
        return answered[-1] if self._at(Prepare) and answered else None

    def flag(self) -> None:
        """Mark the trial at hand, or the one that is corrected."""
        trial = self.correcting or self._state.trial
        question = f"Flag trial {trial.trial} as (a word such as noise or late)"
        self._view.ask_line(question, lambda word: self._set_flag(trial, word))

    def _set_flag(self, trial: Trial, word: str) -> None:
        flag = "-".join(word.lower().split())
        plain = flag.isascii() and flag.replace("-", "").isalnum() and flag[0].isalpha()
        if plain and len(flag) <= MAX_FLAG:
            self._remark(Flagged(trial=trial, flag=flag))
        else:
            self._view.say(f"A flag is a word of at most {MAX_FLAG} letters, digits and hyphens.", "bad")

    def note(self) -> None:
        """Write a note on the trial at hand, or on the one that is corrected."""
        trial = self.correcting or self._state.trial
        self._view.ask_line(f"Note on trial {trial.trial}", lambda text: self._remark(Noted(trial=trial, text=text)))

    def pause(self) -> None:
        """Pause, or go on."""
        now_s = self._clock.now()
        if self.paused_at_s is None:
            self.paused_at_s = now_s
            self._remark(Paused())
        else:
            self._remark(Continued(paused_s=round(now_s - self.paused_at_s, 3)))
            self.paused_at_s = None
        self._view.refresh()

    def stop(self) -> None:
        """Stop the run, for a reason that is kept."""
        self._view.ask_line("Why does the run stop here? It can be resumed.", self.stop_for)

    def stop_for(self, reason: str) -> None:
        """Stop the run for this reason; what was answered is safe."""
        self._reply(Stop(reason=reason))

    def emergency_stop(self) -> None:
        """Disarm the gun from every state, at once and beside everything else, and stop the run."""
        if self.desk is not None:
            threading.Thread(target=self._disarm, args=(self.desk,), daemon=True).start()
        self.stop_for(EMERGENCY)

    def _disarm(self, desk: Desk) -> None:
        try:
            desk.gun.disarm()
        except DeviceError as error:
            self._tell(Trouble(text=f"The gun cannot be disarmed ({error}): switch off its power!"))

    def leave_correction(self) -> bool:
        """Leave the correction that is open; false if none is."""
        was_open = self.correcting is not None
        self.correcting = None
        return was_open

    def _at(self, kind: type) -> bool:
        return isinstance(self._state.step, kind) and self.paused_at_s is None and self.correcting is None

    def _remark(self, remark: Remark) -> None:
        """Have a remark written, and say when it is on the disk."""
        if self.desk is None:
            return
        try:
            written = self.desk.journal.submit("remark", body=record(remark))
        except RuntimeError:  # the journal is closed
            self._view.say("The run has ended; nothing can be added.", "bad")
            return
        written.add_done_callback(lambda done: self._tell(_word_on(remark, done.exception())))


def _word_on(remark: Remark, error: BaseException | None) -> Message:
    """What to tell of a remark that was written, or was not."""
    if error is None:
        return Saved(step=None, word=remark)
    return Trouble(text=str(error) if isinstance(error, JournalError) else f"the remark was not kept: {error}")


def typed_number(text: str, minimum: float, maximum: float) -> float | None:
    """A number as people type it, comma or point, if it lies on the scale.

    >>> typed_number("7,5", 0, 10), typed_number("11", 0, 10), typed_number("nan", 0, 10)
    (7.5, None, None)
    """
    try:
        value = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return value if minimum <= value <= maximum else None
