"""The console as the run sees it: each step is told to the window, and the reply waited for. Knows nothing of Qt."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from device import DeviceError
from experiments.clock import Clock
from experiments.journal import read
from experiments.preference.scale import on_scale
from experiments.remarks import Noted
from experiments.remarks import record as remark_record
from experiments.replay import told
from experiments.runner import Desk, RunStopped
from experiments.screens.console.messages import (
    Again,
    Answer,
    Began,
    Comment,
    EndBreak,
    Go,
    GunSeen,
    Message,
    Next,
    ParticipantAnswered,
    ParticipantRated,
    Rating,
    Reply,
    Saved,
    Stop,
    Waiting,
    Working,
)
from experiments.setup import Setup
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Described,
    Outcome,
    Prepare,
    Prepared,
    Present,
    Rate,
    Rated,
    Repeat,
    Rest,
    Rested,
    Standing,
    Step,
)

if TYPE_CHECKING:
    from experiments.screens.console.beside import ParticipantSide

GUN_LOOK_S = 0.2
"""How often the gun's state is looked at."""

A = TypeVar("A", bound=Reply)
B = TypeVar("B", bound=Reply)
C = TypeVar("C", bound=Reply)


Hand = Literal["experimenter", "synthetic"]
OwnHand = Literal["participant", "synthetic"]


class ConsoleScreen:
    """Carries steps out through a window. `tell` takes messages to it; it replies through `reply`, from any thread.

    `hand` is whose hand is at the console; `beside` is the participant's own screen, where there is one; `observer` is
    the synthetic participant, where it answers.
    """

    def __init__(
        self,
        clock: Clock,
        tell: Callable[[Message], None],
        *,
        setup: Setup[Any],
        hand: Hand = "experimenter",
        beside: ParticipantSide | None = None,
        observer: Any = None,
    ) -> None:
        self._clock, self._tell, self._setup = clock, tell, setup
        self._hand, self._beside, self._observer = hand, beside, observer
        self._own_hand: OwnHand = "synthetic" if hand == "synthetic" else "participant"
        self._replies: queue.Queue[Reply] = queue.Queue()
        self._stop_looking = threading.Event()
        self._comment: str | None = None
        self._presenting: Present | None = None
        self.shown_s: float | None = None
        if beside is not None:
            beside.sit(self.reply, tell)

    def reply(self, reply: Reply) -> None:
        """Take what somebody did."""
        self._replies.put(reply)

    def shown(self, at_s: float) -> None:
        """Take when the step that waits was painted."""
        self.shown_s = at_s

    def begin(self, desk: Desk, standing: Standing) -> None:
        """Show where the run stands, and look after the gun from now on."""
        before = told(read(desk.journal.path)) if standing.history else []
        self._tell(Began(desk=desk, told=before))
        noise = self._beside.begin() if self._beside is not None else ""
        if noise:
            desk.journal.append("remark", body=remark_record(Noted(trial=None, text=noise)))
        threading.Thread(target=self._look, args=(desk,), daemon=True, name="gun-look").start()

    def end(self) -> None:
        """Look no more, and let the participant's screen go."""
        self._stop_looking.set()
        if self._beside is not None:
            threading.Thread(target=self._beside.close, daemon=True).start()

    def prepare(self, step: Prepare) -> Prepared | Repeat:
        """Wait until the gun is handed over, or until an earlier trial is to be repeated."""
        self._drop_early()
        reply = self._ask(step, Go, Again, Again)
        if isinstance(reply, Again):
            return Repeat(trial=reply.trial, reason=reply.reason)
        self._tell(Working(step=step))
        return Prepared()

    def ask(self, step: Ask, onset_s: float) -> Answered | Repeat:
        """Wait for the answer. A time from the experimenter's hand is marked so: it is no response time.

        A synthetic participant's time is its observer's, as in data mode; when its key went down is kept beside it.
        """
        if self._beside is not None:
            self._beside.judge(step, onset_s)
        reply = self._ask(step, Answer, ParticipantAnswered, Again)
        if isinstance(reply, Again):
            return Repeat(trial=reply.trial, reason=reply.reason)
        own, key_time_s = isinstance(reply, ParticipantAnswered), round(reply.at_s - onset_s, 6)
        synthetic = self._observer.answer(step.trial) if self._observer is not None else None
        if synthetic is not None and reply.response == synthetic.response:
            return Answered(
                response=reply.response,
                response_time_s=synthetic.response_time_s,
                response_source="synthetic",
                response_time_valid=True,
                key_time_s=key_time_s,
            )
        return Answered(
            response=reply.response,
            response_time_s=key_time_s,
            response_source=self._own_hand if own else self._hand,
            response_time_valid=own,
        )

    def rest(self, step: Rest) -> Rested:
        """Wait until the break is over, or ended early for a reason."""
        start_s = self._clock.now()
        end_s = start_s + step.duration_s
        self._show(Waiting(step=step, since_s=start_s, until_s=end_s))
        reply = self._wait(end_s, EndBreak)
        rested_s = round(self._clock.now() - start_s, 6)
        return Rested(rested_s=rested_s, cut_reason=reply.reason if reply else "")

    def said_next(self, step: Present, onset_s: float, until_s: float) -> bool:
        """Wait until next is said or the next shot is due."""
        del onset_s
        if self._presenting is not step:
            self._presenting = step
            self._show(Waiting(step=step, since_s=self._clock.now()))
        return self._wait(until_s, Next) is not None

    def rate(self, step: Rate) -> Rated:
        """Wait for the rating, from the participant's own screen or as they tell it."""
        self._comment = None
        if self._beside is not None:
            config = self._setup.config
            self._beside.rate(step, of=config.design.trials, describe=config.description.text)
        reply = self._ask(step, Rating, ParticipantRated, ParticipantRated)
        if isinstance(reply, ParticipantRated):
            self._comment = reply.comment
            return Rated(rating=reply.rating, rating_by=self._own_hand)
        if reply.rating is None:
            return Rated(rating=None, rating_by=self._hand)
        kept = on_scale(reply.rating, step.minimum, step.maximum, step.grain)
        return Rated(rating=kept, rating_by=self._hand)

    def describe(self, step: Describe) -> Described:
        """Wait for the description that the participant tells, if they have not written it themselves."""
        if self._comment is not None:
            return Described(comment=self._comment)
        return Described(comment=self._ask(step, Comment, Comment, Comment).text)

    def acknowledge(self, step: Step, outcome: Outcome) -> None:
        """Show that it is safe."""
        self._tell(Saved(step=step, word=outcome))

    def _show(self, message: Waiting) -> None:
        self.shown_s = None
        self._tell(message)

    def _drop_early(self) -> None:
        """Drop what was replied before a hand-over was shown: a key pressed twice is not to fire by itself."""
        while self._next_reply(-math.inf) is not None:
            pass

    def _ask(self, step: Step, first: type[A], second: type[B], third: type[C]) -> A | B | C:
        """The reply that a step waits for, one of three kinds; others came too late for theirs and are dropped."""
        self._show(Waiting(step=step, since_s=self._clock.now()))
        while True:
            reply = self._next_reply(None)
            if isinstance(reply, first | second | third):
                self._call_off()
                return reply

    def _call_off(self) -> None:
        if self._beside is not None:
            self._beside.call_off()

    def _wait(self, until_s: float | None, wanted: type[A]) -> A | None:
        """The next reply of a kind, `None` after the time. Others came too late for their step and are dropped."""
        while (reply := self._next_reply(until_s)) is not None:
            if isinstance(reply, wanted):
                return reply
        return None

    def _next_reply(self, until_s: float | None) -> Reply | None:
        """The next reply, `None` after the time. `RunStopped` if it is to stop."""
        timeout_s = None if until_s is None else max(0.0, until_s - self._clock.now())
        try:
            reply = self._replies.get(timeout=timeout_s)
        except queue.Empty:
            return None
        if isinstance(reply, Stop):
            self._call_off()
            raise RunStopped(reply.reason)
        return reply

    def _look(self, desk: Desk) -> None:
        """Look at the gun until the run ends."""
        while not self._stop_looking.wait(GUN_LOOK_S):
            try:
                self._tell(GunSeen(status=desk.gun.status()))
            except DeviceError as error:
                self._tell(GunSeen(status=None, fault=str(error)))
