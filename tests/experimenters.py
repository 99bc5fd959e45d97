"""Experimenters that hypothesis draws, at the console's controls on a window of paper, and what is true of each run.

Whatever befalls the keys, the gun, the disk and the participant's screen, the run is then worked to its end.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from hypothesis import strategies as st

from device import LimitError, LinkError
from experiments.config.setup import Setup
from experiments.design.plan import Trial
from experiments.live_run import RunStopped
from experiments.record.journal import Contents
from experiments.record.replay import history
from experiments.screens.console.keys import ANSWERS, KEY_COMMANDS, Name
from experiments.session import events
from experiments.session.events import ACTS
from experiments.session.history import is_attempt
from experiments.session.remarks import EntryCorrected, Refused
from experiments.session.states import ARMED, State
from experiments.session.steps import Answered, what
from tests.at_controls import GUARD_S, Offered, Sitting, WatchedGun, gated, kept, remarks, tells_correctness

KEYS = (*"MFBPUERGNYLST7", "Space", "Enter", "Esc", "Tab", "F1", "F2")
BUTTONS = [one.name for one in KEY_COMMANDS if one.name not in ("rearm", "leave", "theme", *ANSWERS[2:])]
When = Literal["before", "within", "after"]
"""A press before what stands there was painted, within the guard's time after it, or later."""
MOST_SITTINGS = 60

_KEY, _WHEN, _YES = st.sampled_from(KEYS), st.sampled_from(("before", "within", "after")), st.booleans()
_SAID = st.sampled_from(("forward", "backward"))
_DRAWN: dict[str, tuple[int, tuple[st.SearchStrategy[Any], ...]]] = {
    "due": (26, ()),
    "press": (12, (_KEY, _WHEN, _YES)),
    "hold": (3, (_KEY, st.integers(1, 40))),
    "down": (3, (_KEY,)),
    "up": (3, (_KEY,)),
    "double": (4, (_KEY, st.sampled_from((0.005, 0.06, 0.3)), _YES)),
    "click": (6, (st.sampled_from(BUTTONS), _WHEN, _YES)),
    "double click": (3, (st.sampled_from(("fire", "answer 1", "next", "damper")), _YES)),
    "held button": (1, (st.sampled_from((0.1, 0.9, 1.2)),)),
    "line": (5, (st.sampled_from("NGREQY"), st.sampled_from(("late", "7", "müde", " ")), _YES)),
    "pause": (3, ()),
    "correct": (4, (st.integers(1, 3), _SAID)),
    "lose keys": (1, ()),
    "halt": (1, (st.sampled_from(("key", "participant")),)),
    "own": (4, (_SAID, st.sampled_from((-5.0, -0.3, 0.05, 0.6)), st.integers(-1, 0))),
    "own rating": (2, (st.sampled_from((0.0, 5.5, 10.0)),)),
    "own description": (2, (st.sampled_from(("by myself", "")), st.integers(-1, 0))),
    "gun": (3, (st.sampled_from(("refuses", "is silent", "hangs", "hangs at arm")),)),
    "disk": (2, (st.integers(0, 2),)),
    "release": (2, ()),
    "screen": (2, (_YES,)),
    "time": (3, (st.sampled_from((0.1, 1.5, 40.0)),)),
}
"""What there is to do: how often in a hundred, and with what."""
_KINDS = [kind for kind, (weight, _) in _DRAWN.items() for _ in range(weight)]
MOVES = st.lists(
    st.sampled_from(_KINDS).flatmap(lambda kind: st.tuples(st.just(kind), *_DRAWN[kind][1])), min_size=30, max_size=80
)

GUN_FAILS = ("beyond a limit", "no answer")
"""What the gun says when it refuses, and when it is silent."""


@dataclass
class Experimenter:
    """Somebody who makes moves, in as many sittings as it takes, and then only does what is due."""

    setup: Setup[Any]
    results: Path
    moves: list[tuple[Any, ...]]
    sittings: list[Sitting] = field(default_factory=list)
    repeats_s: set[float] = field(default_factory=set)
    """When the system repeated a key."""

    def work(self) -> None:
        """From the first hand-over to the end, through every stop."""
        left = iter(self.moves)
        for _ in range(MOST_SITTINGS):
            with gated() as gate:
                hand = Hand(Sitting(self.setup, self.results, resumed=bool(self.sittings), gate=gate), self.repeats_s)
                self.sittings.append(hand.sitting)
                hand.play(left)
                hand.finish()
            if hand.sitting.result is not None:
                return
            assert isinstance(hand.sitting.error, RunStopped), hand.sitting.error
        raise AssertionError("the run does not end")


@dataclass
class Hand:
    """A hand at one sitting."""

    sitting: Sitting
    repeats_s: set[float]
    down: set[str] = field(default_factory=set)

    def play(self, moves: Iterator[tuple[Any, ...]]) -> None:
        """Make moves as long as the run is on; where nothing goes on, two are enough."""
        stood = 0
        for move in moves:
            stood = stood + 1 if self.sitting.state in (State.HALTED, State.REARMING) else 0
            if stood > 2:
                self.due()
            _MOVES[move[0]](self, *move[1:])
            self.sitting.settle()
            if self.sitting.ended.is_set():
                return

    def finish(self) -> None:
        """Let everything go, leave what is open, and do what is due until the run ends."""
        for key in self.down:
            self.sitting.window.up(key)
        self.down.clear()
        while not self.sitting.ended.is_set():
            self.due()
            self.sitting.settle()
        self.sitting.finish()

    # moves

    def due(self) -> None:
        """What somebody does who looks and takes their time."""
        sitting = self.sitting
        if sitting.gun.hangs.is_set() or sitting.gate.holds.is_set():  # type: ignore[union-attr]
            self.release()
        elif sitting.controls.page or sitting.controls.typing.line:
            sitting.press("Esc")
        elif sitting.state not in (State.SAVING, State.FIRING, State.STOPPED):
            sitting.paint()
            sitting.window.fields["number"] = sitting.window.fields["words"] = ""
            sitting.go_on()

    def press(self, key: str, when: When, ctrl: bool) -> None:
        self._come(when)
        if key not in self.down:
            self.sitting.window.press(key, ctrl=ctrl)

    def hold(self, key: str, times: int) -> None:
        """A key is held, and repeated by the system while the run goes on and is drawn."""
        if key in self.down:
            return
        window, clock = self.sitting.window, self.sitting.clock
        self._come("after")
        window.down(key)
        for _ in range(times):
            clock.skip(0.035)
            self.sitting.settle()
            window.paint()
            self.repeats_s.add(clock.now())
            window.up(key, repeated=True)
            window.down(key, repeated=True)
            self.sitting.controls.tick()
        clock.skip(0.035)
        window.up(key)

    def key_down(self, key: str) -> None:
        self._come("after")
        if key not in self.down:
            self.down.add(key)
            self.sitting.window.down(key)

    def key_up(self, key: str) -> None:
        if key in self.down:
            self.down.discard(key)
            self.sitting.window.up(key)

    def double(self, key: str, gap_s: float, drawn: bool) -> None:
        if key in self.down:
            return
        self._come("after")
        for _ in range(2):
            self.sitting.window.down(key)
            self.sitting.clock.skip(0.02)
            self.sitting.window.up(key)
            self.sitting.clock.skip(gap_s)
            self.sitting.settle()
            if drawn:
                self.sitting.window.paint()

    def click(self, name: Name, when: When, moved_on: bool) -> None:
        self._come(when)
        self.sitting.window.click(name, moved_on=moved_on)

    def double_click(self, name: Name, drawn: bool) -> None:
        self._come("after")
        for _ in range(2):
            self.sitting.window.click(name)
            self.sitting.clock.skip(0.12)
            self.sitting.settle()
            if drawn:
                self.sitting.window.paint()

    def held_button(self, seconds: float) -> None:
        """The button of the test shot goes down and is let go."""
        controls = self.sitting.controls
        self._come("after")
        controls.hold(controls.press())
        self.sitting.look_for(seconds)
        controls.let_go()

    def line(self, key: str, text: str, whole: bool) -> None:
        """A note, a flag or a reason, whole or left half typed."""
        self._come("after")
        if key in self.down:
            return
        self.sitting.window.press(key, ctrl=self.sitting.controls.typing.letters)
        self.sitting.settle()
        self.sitting.window.paint()
        if self.sitting.controls.typing.line:
            self.sitting.window.type_text(text)
            if whole:
                self.sitting.press("Enter")

    def pause(self) -> None:
        self.press("P", "after", self.sitting.controls.typing.letters)

    def correct(self, back: int, said: str) -> None:
        """What was said before, so far back, is corrected."""
        for _ in range(back):
            self.press("U", "after", self.sitting.controls.typing.letters)
        self._come("after")
        if self.sitting.state is State.CORRECTING:
            if self.sitting.controls.typing.field:
                self.sitting.window.fields["number"] = self.sitting.window.fields["words"] = ""
                self.sitting.type("7")
            else:
                self.press(said[0].upper(), "after", False)

    def lose_keys(self) -> None:
        self.sitting.window.lose_keys()
        self.down.clear()

    def halt(self, by: str) -> None:
        if by == "key":
            self.sitting.window.press("F12")
        else:
            self.sitting.live.offer(events.EmergencyStop(by="participant"))
        self._disarmed()

    def own(self, response: Literal["forward", "backward"], late_s: float, earlier: int) -> None:
        """A key of the participant's own: so long after the onset, for the question at hand or an earlier one."""
        position = self.sitting.position
        onset_s = position.since_s if position.onset_s is None else position.onset_s
        at_s = min(onset_s + late_s, self.sitting.clock.now())
        typed = self.sitting.controls.covered
        key = events.ParticipantKey(response=response, at_s=at_s, step=position.number + earlier, typed=typed)
        self.sitting.live.offer(key)

    def own_rating(self, rating: float) -> None:
        step = self.sitting.position.number
        self.sitting.live.offer(events.ParticipantRated(rating=rating, step=step))

    def own_description(self, text: str, earlier: int) -> None:
        """The participant's own words, to the question at hand or an earlier one."""
        step = self.sitting.position.number + earlier
        self.sitting.live.offer(events.ParticipantDescribed(text=text, step=step))

    def gun(self, what: str) -> None:
        gun = self.sitting.gun
        match what:
            case "refuses":
                gun.fails.append(LimitError(GUN_FAILS[0]))
            case "is silent":
                gun.fails.append(LinkError(GUN_FAILS[1]))
            case _ if not gun.hangs.is_set():
                gun.hang = "arm" if what == "hangs at arm" else "fire"

    def disk(self, after: int) -> None:
        """The disk is slow from now on, or soon."""
        self.sitting.gate.shut(after)  # type: ignore[union-attr]

    def release(self) -> None:
        """What hangs in the gun or waits for the disk goes on; a disarming that began beside it is done by then."""
        self._disarmed()
        self.sitting.gate.open()  # type: ignore[union-attr]
        self.sitting.gun.release()

    def screen(self, lost: bool) -> None:
        """The participant's screen goes, or is there again."""
        self.sitting.live.offer(events.ParticipantLost(cause="it was closed") if lost else events.ParticipantBack())
        self._disarmed()

    def time(self, seconds: float) -> None:
        self.sitting.clock.skip(seconds)

    def _come(self, when: When) -> None:
        """Be there before the window is drawn, or so long after it."""
        if when == "before":
            return
        self.sitting.paint()
        self.sitting.clock.skip(GUARD_S * 0.3 if when == "within" else GUARD_S + 0.01)

    def _disarmed(self) -> None:
        for thread in tuple(self.sitting.live.disarming):
            thread.join()


_MOVES: dict[str, Callable[..., None]] = {
    "due": Hand.due,
    "press": Hand.press,
    "hold": Hand.hold,
    "down": Hand.key_down,
    "up": Hand.key_up,
    "double": Hand.double,
    "click": Hand.click,
    "double click": Hand.double_click,
    "held button": Hand.held_button,
    "line": Hand.line,
    "pause": Hand.pause,
    "correct": Hand.correct,
    "lose keys": Hand.lose_keys,
    "halt": Hand.halt,
    "own": Hand.own,
    "own rating": Hand.own_rating,
    "own description": Hand.own_description,
    "gun": Hand.gun,
    "disk": Hand.disk,
    "release": Hand.release,
    "screen": Hand.screen,
    "time": Hand.time,
}

# what must be true of every run


def check(someone: Experimenter) -> Counter[str]:
    """The rules of every run; how much there was of what they are about."""
    name = str(someone.setup.config.experiment)
    _, contents, rows = kept(someone.results, name)
    for sitting in someone.sittings:
        check_gun(sitting.gun)
        check_hand(sitting.window.offered, someone.repeats_s)
        assert not [text for text in set(sitting.window.heard) if tells_correctness(text)]
    offered = [one for sitting in someone.sittings for one in sitting.window.offered]
    assert Counter(taken(offered)) == Counter(written(contents))
    told = [word for word in remarks(contents, Refused) if word.because not in GUN_FAILS]  # that was taken before
    assert Counter(refused(offered)) == Counter((word.event, word.state) for word in told)
    check_rows(rows, contents)
    check_attempts(rows, contents, [call for sitting in someone.sittings for call in sitting.gun.felt])
    return Counter(one.event.__class__.__name__ for one in offered if one.taken) + Counter(
        {"refused": len(refused(offered)), "sittings": len(someone.sittings)}
    )


def check_gun(gun: WatchedGun) -> None:
    """Nothing is armed or fired but where the table allows it, nor rendered once a halt or a pause has disarmed.

    A shot that was asked for before it was halted or held may be rendered as long as the gun was not disarmed.
    """
    disarmed = False
    for call in gun.calls:
        if call.word in ("arm", "fire"):
            assert call.position.state in ARMED, call
        if call.word == "fire":
            disarmed = False
        elif call.word == "disarmed":
            disarmed = True
        elif call.word == "rendered":
            assert not (disarmed and (call.position.held or call.position.base is State.HALTED)), call


def check_hand(offered: list[Offered], repeats_s: set[float]) -> None:
    """What carried the run on by the hand: pressed for what stood there, after the guard's time, and not repeated."""
    for one in offered:
        if one.taken and one.press is not None and isinstance(one.event, ACTS):
            assert one.painted_s is not None, one
            assert one.press.serial == one.position.serial, one
            assert one.press.at_s - one.painted_s >= GUARD_S, one
            assert one.press.at_s not in repeats_s, one
        if one.taken and isinstance(one.event, events.ParticipantKey):
            assert one.position.onset_s is None or one.event.at_s >= one.position.onset_s, one


def taken(offered: list[Offered]) -> Iterator[tuple[str, Trial, Any]]:
    """Everything that the participant said, as it was taken."""
    for one in offered:
        if not one.taken:
            continue
        trial = one.position.step.trial if hasattr(one.position.step, "trial") else None
        match one.event:
            case events.Answer() | events.ParticipantKey():
                yield "answered", trial, one.event.response
            case events.Rating() | events.ParticipantRated():
                yield "rated", trial, one.event.rating
            case events.Description() | events.ParticipantDescribed():
                yield "described", trial, one.event.text
            case events.Correct() if one.position.correcting is not None and not one.text:
                yield "corrected", one.position.correcting.trial, one.event.value


def written(contents: Contents) -> Iterator[tuple[str, Trial, Any]]:
    """Everything that the participant said, as it is in the journal."""
    for step, word in history(contents):
        match word:
            case Answered():
                kind = {"answer": "answered", "description": "described"}.get(what(step), "rated")
                yield kind, step.trial, word.value
            case EntryCorrected():
                yield "corrected", word.trial, word.value


def refused(offered: list[Offered]) -> list[tuple[str, str]]:
    """What would have carried the run on and was refused, each with the state; not after the run."""
    return [
        (events.word(type(one.event)), str(one.position.state))
        for one in offered
        if not one.taken
        and isinstance(one.event, (*events.OWN_HAND_EVENTS, *ACTS))
        and one.position.base is not State.STOPPED
    ]


def check_rows(rows: list[dict[str, str]], contents: Contents) -> None:
    """One valid row a planned trial, with the last word on it; no time of another hand or of what was corrected."""
    trials = contents.plan.trials
    assert [row["trial"] for row in rows] == [str(trial.trial) for trial in trials]
    last: dict[Trial, Any] = {}
    for kind, trial, value in written(contents):
        if kind in ("answered", "rated") or (kind == "corrected" and _belongs(value, contents)):
            last[trial] = (kind, value)
    column = "response" if "response" in rows[0] else "rating"
    for row, trial in zip(rows, trials, strict=True):
        kind, value = last[trial]
        said = row[column] if column == "response" else (None if row[column] in ("", "NA") else float(row[column]))
        assert said == value, row
        if column == "response" and (kind == "corrected" or row["response_source"] == "experimenter"):
            assert row["response_time_valid"] == "0", row


def _belongs(value: Any, contents: Contents) -> bool:
    """Whether a correction was of an answer or a rating, not of words."""
    return value in ("forward", "backward") if contents.plan.experiment == "direction" else not isinstance(value, str)


def check_attempts(rows: list[dict[str, str]], contents: Contents, felt: list[Trial]) -> None:
    """`attempts` counts what was felt, or may have been: by the gun's own book where a shot is a trial."""
    told_felt = Counter(step.trial for step, word in history(contents) if step is not None and is_attempt(step, word))
    trials = contents.plan.trials
    assert [row["attempts"] for row in rows] == [str(told_felt[trial]) for trial in trials]
    if "response" in rows[0]:
        assert told_felt == Counter(felt)


__all__ = ["MOVES", "Experimenter", "check"]
