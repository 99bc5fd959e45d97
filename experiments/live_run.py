"""A live run between who may act and who acts: events come in from any thread, the table judges, the run obeys.

The emergency stop is a latch in here: the state is `halted`, under the lock, before the gun is told to disarm; the run
looks at the state after every `arm` and before every `fire`.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import NoReturn, Protocol

from device import DeviceError, Gun, GunStatus
from device.messages import RecoilError
from experiments.clock import Clock
from experiments.design.plan import Plan
from experiments.record.journal import Journal, JournalError, JournalGone
from experiments.session import events, judging
from experiments.session.events import DISARMS, TYPED, Event, Press
from experiments.session.history import GrowingHistory, History
from experiments.session.judging import Beats, Moment, refused, remark_of
from experiments.session.remarks import OF_HALT, EntryCorrected, Halted, Remark, remark_kind, remark_record
from experiments.session.states import ARMED, Position, State, entered
from experiments.session.steps import Answered, Asking, Interrupted, Outcome, Session, Step, step_after, step_record

DISARMED_S = 10.0
"""The longest that a run waits for a disarming that began beside it: a gun on a line gives up before."""
HALT_UNSAVED = (
    "The emergency stop is not on record: free the disk before you close the run. Else it begins without a test shot "
    "when it is resumed."
)
CORRECTION_UNSAVED = "a correction could not be saved: enter it anew (undo) when the run goes on"


def _unsaved_text(step: Asking) -> str:
    """What is said of an answer that the disk refused."""
    trial = step.trial
    where = f"session {trial.session}, set {trial.set}, trial {trial.trial}"
    return f"The answer “{step.question}” of {where} is not saved: it is to be given anew"


class RunStopped(RecoilError):  # noqa: N818 - a stop is not an error
    """The run stops here on purpose or for want of a gun; it can be resumed.

    `saved`: the answers that were read back from the disk afterwards; `None` if they were not. `halted`: it was an
    emergency stop that ended it.
    """

    saved: int | None = None
    halted = False


class Held(Exception):  # noqa: N818 - what is so, not what went wrong
    """No shot may be fired now: the run was paused."""


@dataclass(frozen=True, slots=True)
class EventVerdict:
    """Whether an event was taken, and what there is to say about it."""

    taken: bool
    text: str = ""

    def __bool__(self) -> bool:
        return self.taken


class Screen(Protocol):
    """Where a run is shown, and worked by a person, real or synthetic. All but `begin` and `act` come from any thread.

    Whoever works it offers events to the live run; nothing is decided here.
    """

    def begin(self, live: LiveRun) -> None:
        """Take the place before a run that stands where `live` says."""

    def show(self, position: Position) -> None:
        """Show a position; one of an earlier serial number than the last is out of date."""

    def act(self, position: Position, until_s: float | None) -> None:
        """The run waits now, until a time at most. A screen in the run's own thread acts here."""

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that something is safe: its record is on the disk. A remark has no step."""

    def trouble(self, text: str) -> None:
        """Show what went wrong."""

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says of its state, or why it says nothing."""


class LiveRun:
    """Where a run is, and what was done so far. Every method but `enter`, `wait` and `sleep` from any thread.

    `told` is what the session reads: it grows in the order of the journal, and what screens see when that is synced.
    """

    def __init__(
        self,
        *,
        plan: Plan,
        gun: Gun,
        journal: Journal,
        clock: Clock,
        screen: Screen,
        guard_s: float,
        told: GrowingHistory | None = None,
    ) -> None:
        self.plan, self.clock, self.guard_s = plan, clock, guard_s
        self.gun, self.journal, self._screen = gun, journal, screen
        self.gun_name = gun.identify().name
        self._told: GrowingHistory = [] if told is None else told
        self._history = list(self._told)
        self._position = Position(since_s=clock.now())
        self._painted_s: float | None = None
        self._pauses: list[tuple[float, float]] = []
        self.shown_s: float | None = None
        self.inbox: deque[Event] = deque()
        self.news = threading.Condition(threading.RLock())
        self.disarming: list[threading.Thread] = []
        self.halted = self.halt_unsaved = self.correction_unsaved = False
        self._answer_unsaved = ""
        self._lost_halt: Halted | None = None
        self.beats, self._to_fire_s, self._held_s = Beats(clock.now), math.inf, 0.0
        self.gun_silence = ""
        """Why the gun does not answer, as whoever looks at it meanwhile has seen it last; empty if it does."""
        self.minimised = False
        """Whether the participant's window is, on which they are asked: no pause ends before it is seen again."""

    # for everybody

    @property
    def position(self) -> Position:
        """Where the run is."""
        return self._position

    @property
    def history(self) -> History:
        """What was done so far: steps with their outcomes, and remarks."""
        with self.news:
            return tuple(self._history)

    @property
    def moment(self) -> Moment:
        """What is so now, to judge by."""
        with self.news:
            began_s = self._position.paused_s
            return Moment(
                plan=self.plan,
                history=tuple(self._history),
                position=self._position,
                now_s=self.clock.now(),
                painted_s=self._painted_s,
                guard_s=self.guard_s,
                pauses=[*self._pauses, *([] if began_s is None else [(began_s, math.inf)])],
                alive_since_s=self.beats.alive_since_s,
                gun_silence=self.gun_silence,
                minimised=self.minimised,
            )

    def painted(self, serial: int, at_s: float) -> None:
        """Take when a position was painted: from then on, and the guard time later, it can be worked."""
        with self.news:
            if serial == self._position.serial and self._painted_s is None:
                self._painted_s = at_s
                self.shown_s = at_s if self.shown_s is None else self.shown_s

    def offer(self, event: Event, press: Press | None = None) -> EventVerdict:
        """Have an event judged, and taken if it may be. Never waits. `press`: by the experimenter's hand."""
        with self.news:
            moment = self.moment
            meant, text = judging.meant(moment, event)
            refusal = judging.event_refusal(moment, meant, press)
            if not refusal:
                self._take(meant, moment)
            before, position = moment.position, self._position
            found: list[Remark | None] = [refused(meant, before, refusal)] if refusal else []
            if not refusal:
                found += [remark_of(meant, before, position, self.moment.trial), judging.exchanged(moment, meant)]
            kept = [remark for remark in found if remark is not None]
            written = self._submit(kept) if kept else None
        self._watch(kept, written)  # outside: who shows it may wait for this lock
        if not refusal:
            self._screen.show(position)
        return EventVerdict(taken=not refusal, text=refusal or text)

    def _take(self, event: Event, moment: Moment) -> None:
        """Stand where an event leads; where it disarms, that begins when this is so, and before anything else."""
        before = moment.position
        self._position = judging.moved(moment, event)
        self.halted = self.halted or self._position.base is State.HALTED
        if isinstance(event, events.Fire | events.Rearm):
            self._to_fire_s = moment.now_s
            self._held_s = (event.held_s or 0.0) if isinstance(event, events.Rearm) else 0.0
        if isinstance(event, DISARMS) and (before.base in ARMED or isinstance(event, events.EmergencyStop)):
            self._disarm_beside()
        if before.paused_s is not None and self._position.paused_s is None:
            self._pauses.append((before.paused_s, self.clock.now()))
        if self._position.serial != before.serial:
            self._painted_s = None
        elif self._painted_s is not None and isinstance(event, TYPED):  # a second Enter is not for what stands behind
            self._painted_s = self.clock.now()
        if self._position.base not in (before.base, State.HALTED, State.STOPPED):
            self.inbox.append(event)
        self.news.notify_all()

    # for the run

    def enter(self, state: State, step: Step | None = None, until_s: float | None = None) -> None:
        """The session's next step is there. `RunStopped`: the run was stopped before. `Held`: no shot may be fired."""
        with self.news:
            self._check()
            if state in ARMED and self.inbox:
                self.inbox.clear()
                raise Held(self._position.why)  # paused since the key to fire, and perhaps gone on with
            new = step is not None and step is not self._position.step
            self._position = entered(self._position, state, self.clock.now(), step, until_s)
            self.inbox.clear()
            self._painted_s = None
            if new:
                self.shown_s = None
            position = self._position
        self._screen.show(position)

    def stimulus_begins(self, onset_s: float | None, *, least_s: float = 0.0) -> None:
        """A stimulus began, or is about to (`None`): what carries a train on is not taken before the least exposure."""
        not_before_s = math.inf if onset_s is None else onset_s + least_s
        with self.news:
            position = self._position = replace(self._position, onset_s=onset_s, not_before_s=not_before_s)
        self._screen.show(position)

    def wait(self, until_s: float | None = None) -> Event | None:
        """The event that ended the step; `None` when its time is over, which does not run while the run is held.

        `RunStopped`: the run was stopped, or halted; but what was taken before is done first.
        """
        self._screen.act(self._position, until_s)
        with self.news:
            while not self.inbox:
                self._check()
                left_s = self._left_s(until_s)
                if left_s is not None and left_s <= 0:
                    return None
                self.clock.wait(self.news, left_s)
            return self.inbox.popleft()

    def taken(self) -> Event | None:
        """What was taken meanwhile, without waiting. Raises as `wait`."""
        with self.news:
            self._check()
            return self.inbox.popleft() if self.inbox else None

    def stay_halted(self) -> str:
        """Wait until a halted run is closed; why."""
        while (halted := self._position).base is State.HALTED:
            self._screen.act(halted, None)
            with self.news:
                while self._position is halted:
                    self.clock.wait(self.news, None)
        return self._position.why

    def end(self, why: str) -> None:
        """The run is over: finished, or stopped for a reason. Nothing is taken any more."""
        with self.news:
            stopped = replace(self._position, states=(State.STOPPED,), correcting=None, paused_s=None)
            position = self._position = replace(stopped, serial=stopped.serial + 1, why=why)
        self._screen.show(position)

    def write_stop(self, why: str) -> None:
        """Have on the disk why the run stopped; an emergency stop that was not on record is so from then on."""
        try:
            self.journal.append("stopped", reason=why, **({"halted": True} if self.halted else {}))
        except JournalError as error:
            self.fail(error)

    def fail(self, error: JournalError) -> NoReturn:
        """Raise what went wrong with the journal; what people did that is on no record is named with it."""
        self.journal.catch_up()
        forgotten = [self._answer_unsaved] if self._answer_unsaved else []
        forgotten += [CORRECTION_UNSAVED.capitalize()] if self.correction_unsaved else []
        if self.halt_unsaved:
            forgotten += ["The emergency stop is not on record: note it; resumed, the run begins without a test shot"]
        if not forgotten:
            raise error
        raise JournalError(". ".join([str(error), *forgotten])) from error

    def allow_shot(self) -> None:
        """Nothing if a shot may be fired now. `RunStopped`, `Held`: it may not."""
        with self.news:
            self._check()
            if self._position.state not in ARMED:
                raise Held(self._position.why)

    def may_fire(self) -> bool:
        """As `allow_shot`; false, for a moment, while what was pressed in a standstill is still to come.

        It pauses if the program stood still for long since the key to fire: nobody expects a shot any more; and if it
        looks at its keys so seldom that nothing could be fired, or another window has them.
        """
        if self.beats.alive_since_s > self._to_fire_s:
            self.offer(events.Pause(cause=judging.STOOD_STILL))
        elif self.beats.hears_late:
            self.offer(events.Pause(cause=judging.HEARS_LATE))
        elif self.beats.was_deaf_since(self._to_fire_s - self._held_s):
            self.offer(events.Pause(cause=judging.KEYS_ELSEWHERE))
        self.allow_shot()
        return self.beats.prompt

    def settle(self) -> None:
        """Wait for a disarm that another thread began, so that it cannot land after the next arming."""
        while self.disarming:
            self.disarming.pop().join(DISARMED_S)

    def sleep(self, until_s: float) -> None:
        """Wait until a time, as long as a shot may be fired; raises as `allow_shot`."""
        with self.news:
            while True:
                self.allow_shot()
                left_s = until_s - self.clock.now()
                if left_s <= 0:
                    return
                self.clock.wait(self.news, left_s)

    def keep(self, step: Step, outcome: Outcome) -> None:
        """Have an outcome written, and when it is on the disk show that it is."""
        with self.news:
            painted = {} if self.shown_s is None else {"shown_s": self.shown_s}
            written = self.journal.submit("outcome", body=step_record(outcome), **painted)
            self._told.append((step, outcome))
        try:
            written.result()
        except JournalError as error:
            if isinstance(outcome, Answered) and isinstance(step, Asking) and not isinstance(error, JournalGone):
                self._answer_unsaved = _unsaved_text(step)
            raise
        with self.news:
            self._history.append((step, outcome))
        self._screen.acknowledge(step, outcome)

    def give_up(self, *, felt: bool) -> None:
        """Have on the disk what was felt of a stimulus at which the run ends."""
        self.journal.append("outcome", body=step_record(Interrupted(presented=felt)))

    def go_on(self, session: Session, outcome: Outcome) -> Step | None:
        """The session's next step, which the journal has when this returns; `None` at its end. `RunStopped`, as `wait`.

        Made and written under the lock: a correction lies before it, and counts for it, or behind it. A step of a run
        that was stopped is not written: it may follow from a correction that the disk refused.
        """
        with self.news:
            step = step_after(session, outcome)
            if step is None:
                return None
            self._check()
            written = self.journal.submit("step", body=step_record(step))
        written.result()
        return step

    def remark(self, remark: Remark) -> None:
        """Have a remark written behind what was written before, and shown when it is on the disk."""
        with self.news:
            written = self._submit([remark])
        self._watch([remark], written)

    def _submit(self, kept: Sequence[Remark]) -> Future[None] | None:
        """Have remarks of a kind written, all or none; `None` if the journal is closed, as the run has just ended."""
        try:
            bodies = [{"body": remark_record(remark)} for remark in kept]
            written = self.journal.submit_together(remark_kind(kept[0]), bodies)
        except RuntimeError:
            return None
        for remark in kept:
            self._told.append((None, remark))
            self._history.append((None, remark))
        return written

    # keeping

    def _watch(self, kept: Sequence[Remark], written: Future[None] | None) -> None:
        if written is not None:
            written.add_done_callback(lambda done: self._written(kept, done))

    def _written(self, kept: Sequence[Remark], done: Future[None]) -> None:
        error, corrected = done.exception(), isinstance(kept[0], EntryCorrected)
        if error is None:
            self.correction_unsaved = self.correction_unsaved and not corrected
            self.halt_unsaved = self.halt_unsaved and not isinstance(kept[0], OF_HALT)
            for remark in kept:
                self._screen.acknowledge(None, remark)
            self._write_halt_again()
        elif isinstance(error, JournalGone):  # it is where the journal is now
            self._screen.trouble(str(error))
            self.offer(events.ResultsGone(cause=str(error)))
        else:
            self._take_back(kept)
            self._screen.trouble(". ".join(filter(None, (str(error), self._lost(kept[0])))))
            if corrected:  # what comes next may follow from it, and would from nothing on record
                self.offer(events.ResultsGone(cause=CORRECTION_UNSAVED))

    def _write_halt_again(self) -> None:
        """A record was written: there is room for the emergency stop that the disk refused."""
        halt, self._lost_halt = self._lost_halt, None
        if halt is not None and self.halt_unsaved:
            self.remark(halt)

    def _lost(self, remark: Remark) -> str:
        """What there is to say of a remark that the disk refused."""
        if isinstance(remark, Halted):
            self.halt_unsaved, self._lost_halt = True, remark
            return HALT_UNSAVED
        if isinstance(remark, EntryCorrected):
            self.correction_unsaved = True
            return CORRECTION_UNSAVED.capitalize()
        return f"Not saved: “{text}”" if (text := getattr(remark, "text", "")) else ""

    def _take_back(self, kept: Sequence[Remark]) -> None:
        """Show nothing that the disk refused. The session has read it: a run that goes by it ends."""
        with self.news:
            self._history = [entry for entry in self._history if not any(entry[1] is one for one in kept)]

    # the run's side

    def _check(self) -> None:
        if self._position.base in (State.HALTED, State.STOPPED):
            raise RunStopped(self._position.why)

    def _left_s(self, until_s: float | None) -> float | None:
        """How long the step may still wait; `None` without an end, or while something lies over it."""
        end_s = until_s if self._position.until_s is None else self._position.until_s
        return None if end_s is None or self._position.held else end_s - self.clock.now()

    def _disarm_beside(self) -> None:
        thread = threading.Thread(target=self._disarm, daemon=True, name="disarm")
        self.disarming.append(thread)
        thread.start()

    def _disarm(self) -> None:
        """Disarm, and show what the gun itself then says."""
        try:
            self.gun.disarm()
            self._screen.gun_seen(self.gun.status(), "")
        except DeviceError as error:
            self._screen.gun_seen(None, str(error))
            self._screen.trouble(f"The gun does not say that it is disarmed ({error}): switch off its power!")
