"""The terminal screen: the experimenter reads what to do and types the answers. Nothing but a terminal is needed.

A line counts for what stood there when it was typed, so what is typed ahead is refused. Times come from the
experimenter's hand and are logged as such. Neither correctness nor a score is ever shown.
"""

from __future__ import annotations

import io
import math
import os
import re
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

from device import GunStatus
from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages
from experiments.clock import Clock
from experiments.live_run import LiveRun
from experiments.record.tables import is_simulated
from experiments.screens import texts
from experiments.screens.practice_text import practice_text, round_before_text
from experiments.session import events
from experiments.session.events import Event, Press
from experiments.session.history import entered_value
from experiments.session.judging import BEAT_S
from experiments.session.remarks import Remark, flag_word
from experiments.session.states import ARMED, EMERGENCY, Position, State
from experiments.session.steps import Ask, Asking, Describe, Inform, Outcome, Prepare, Rate, Rest, Step

if TYPE_CHECKING:
    from experiments.design.config import DesignConfig
    from experiments.design.plan import Plan

_HELP = """At any time: `!` and Enter is the emergency stop, `stop` and a reason stops. `pause`, `undo`, `repeat` and
a reason; `flag` and a word, `note` and words. Where words are asked for, put a / in front: /stop, /note ..."""
_REARMING = (
    "\n  There was an emergency stop. Stand clear: a test shot comes first. Type `test shot` and Enter to fire it: "
)
_CLOSING = "\nEverything is answered. `undo` opens the last answer, `note` and `flag` mark.\n  Enter ends the run: "
_HALTED = (
    "\n  EMERGENCY STOP. Nothing fires in this run any more. "
    "Unless the gun says that it is disarmed, SWITCH OFF ITS POWER.\n"
    "  Type why, and Enter; Enter alone closes the run, which can be resumed: "
)
_COMMANDS = ("stop", "pause", "undo", "repeat", "flag", "note", "skip", "help")
_TICK_S = 1.0
_F12 = re.compile(r"\[24(;\d+)?[~^$@]")
"""What is left on a line of the console's key for an emergency stop. What is held beside stands behind a semicolon,
or is its last sign."""
_STOPS = ("!", "\uff01")
"""Input methods of Chinese and Japanese write the second, the wide one."""
_HELD_S = 0.3
"""Who writes for longer waits for the terminal, which Ctrl+S holds: nobody sees, or is heard (assumed)."""

_UNSEEN = "\r"
"""Changes nothing behind the Enter of a line."""


class TerminalScreen:
    """Says on a terminal what to do, and offers what is typed."""

    def __init__(
        self,
        plan: Plan,
        clock: Clock,
        lines: TextIO | None = None,
        out: TextIO | None = None,
        *,
        messages: ParticipantMessages = ENGLISH_MESSAGES,
        design: DesignConfig | None = None,
    ) -> None:
        self._plan, self._clock, self._messages, self._design = plan, clock, messages, design
        self._out = out or sys.stdout
        if isinstance(sys.stdin, io.TextIOWrapper):
            sys.stdin.reconfigure(errors="replace")  # a byte that is no UTF-8 is not to end the run
        self._source = lines or sys.stdin
        self._lock = threading.RLock()
        self._live: LiveRun | None = None
        self._shown, self._serial = Position(), -1
        self._gone, self._writing_s = False, math.inf
        self._doubted = "", -1

    def begin(self, live: LiveRun) -> None:
        """Say who it is, and begin to read."""
        self._live = live
        band = "SIMULATED GUN – nothing is felt.\n" if is_simulated(live.gun_name) else ""
        band += "PRACTICE – never analysed.\n" if self._plan.practice else ""
        self._say(f"{band}Participant {self._plan.participant_id}, experiment {self._plan.experiment}.\n{_HELP}")
        for target in (self._read, self._count_down, self._beat):
            threading.Thread(target=target, daemon=True, name="terminal").start()

    def act(self, position: Position, until_s: float | None) -> None:
        """Lines are typed whenever they are."""

    def show(self, position: Position) -> None:
        """Say what is to be done now; from then on a line counts for it."""
        with self._lock:
            if self._live is None or position.serial < self._shown.serial:
                return
            said, self._shown = self.text(self._shown), position
            self._live.painted(position.serial, self._clock.now())
            if position.serial != self._serial or self.text(position) != said:
                self._show(self.text(position))
            self._serial = position.serial

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Say that something is safe; say what the gun failed at."""
        text = texts.saved_text(self._plan, self._live.history if self._live else (), step, word)
        if text and step is None:
            self._say_beside(text)
        elif text:
            self._say(f"  {text}")

    def trouble(self, text: str) -> None:
        """Say what went wrong."""
        self._say_beside(text)

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Say what the gun itself says after it was told to disarm."""
        disarmed = status is not None and status.state == "disarmed"
        told = f"The gun says nothing ({fault})" if status is None else f"The gun says that it is {status.state}"
        self._say_beside(f"{told}{'.' if disarmed else ': SWITCH OFF ITS POWER.'}")

    # what is asked for

    def text(self, position: Position) -> str:  # noqa: C901, PLR0911, PLR0912 - one case a state
        """What is asked for at a position."""
        step = position.step
        match position.state:
            case State.REARMING:
                return _REARMING
            case State.SETTING if isinstance(step, Prepare):
                return f"{self._head(step)}\n  Set the {texts.settings_text(step)}. Then type d and Enter: "
            case State.PREPARING if isinstance(step, Prepare):
                is_set = f"\n  The {texts.settings_text(step)}." if step.settings else ""
                return f"{self._head(step)}{is_set}\n  {texts.turn_text(step)} and hand it over. Enter fires: "
            case State.INFORMING if isinstance(step, Inform):
                return f"\n  Tell the participant: “{step.text}”\n  Enter when that is done: "
            case State.TRAIN if position.onset_s is not None:
                return "\n  Enter when the participant says next: "
            case State.ASKING if isinstance(step, Ask):
                about = (
                    f"{texts.ordinal(self._plan, step.trial, self._messages)}. " if step.later else self._level(step)
                )
                return f"\n  {about}{step.text} {_keys(step)}: "
            case State.RATING if isinstance(step, Rate):
                none = "; `none` for no answer" if step.may_be_skipped else ""
                about = texts.about_text(self._plan, step, self._messages)
                return f"\n{about}. {step.text}\n  {texts.ends_text(step)}{none}: "
            case State.DESCRIBING if isinstance(step, Describe):
                return f"\n  {texts.about_text(self._plan, step, self._messages)}. {step.text} "
            case State.RESTING:
                said = f"{self._practised(over=False)}\nBreak {_between(position)}."
                return f"{said} (`skip` and a reason ends it early.)\n{' ' * _COUNTED}"
            case State.CLOSING:
                return f"{self._practised(over=True)}{_CLOSING}"
            case State.PAUSED:
                why = f": {position.why}" if position.why else ""
                return f"\n  Paused{why}. Type `go on` and Enter: "
            case State.CORRECTING if position.correcting is not None:
                return self._correction(position.correcting)
            case State.HALTED:
                return _HALTED
            case _:
                return ""

    def _practised(self, *, over: bool) -> str:
        told = self._live.history if self._live else ()
        said = practice_text(self._design, self._plan, told, over=over) if self._design is not None else ""
        return f"\n{said}" if said else ""

    def _head(self, step: Prepare) -> str:
        told = self._live.history if self._live else ()
        place, again = texts.place_text(self._plan, step.trial), texts.again_text(told, step)
        track = texts.track_text(self._plan, told, step.trial)
        before = round_before_text(self._design, self._plan, told, step.trial) if self._design is not None else ""
        said = "".join(f" {one}" for one in (f"{track}." if track else "", again) if one)
        here = f"{place}.{said}{texts.read_out_text(self._plan, step)}"
        return "".join(f"\n{line}" for line in (before, here) if line)

    def _level(self, step: Ask) -> str:
        """The levels that a procedure chose, where the experimenter may know them."""
        text = texts.chosen_text(self._live.history if self._live else (), step.trial)
        return f"({text}) " if text else ""

    def _correction(self, entry: Asking) -> str:
        told = self._live.history if self._live else ()
        was = texts.value_text(entry, entered_value(told, entry))
        undo = "/undo" if isinstance(entry, Describe) else "undo"
        return (
            f"\n  Correct the {texts.entry_name(told, entry)} of {texts.place_text(self._plan, entry.trial)} "
            f"(entered: {was}): {_how(entry)}; `{undo}` goes further back, Enter leaves it: "
        )

    # what is typed

    def _read(self) -> None:
        with suppress(OSError):  # a terminal that vanishes ends like one that is closed
            for line in self._source:
                self._typed(texts.typed_line(line))
        self._closed()

    def _typed(self, line: str) -> None:
        if _is_plain_stop(line):  # whoever shows may hold the lock
            self._offer(events.EmergencyStop())
            return
        with self._lock:
            position = self._shown
        now_s = self._clock.now()
        self._show(_UNSEEN if self._out.isatty() else "")  # where Ctrl+S holds the terminal, a line waits here
        event = self._meant(line, position, now_s)
        if isinstance(event, str):
            self._say(f"  {event}")
            self._show(self.text(position))
        elif event is not None:
            self._offer(event, Press(at_s=now_s, serial=position.serial))

    def _offer(self, event: Event, press: Press | None = None) -> None:
        if self._live is None:
            return
        verdict = self._live.offer(event, press)
        if verdict.text:
            self._say(f"  {verdict.text}")
            self._show(self.text(self._live.position))

    def _meant(self, line: str, position: Position, now_s: float) -> Event | str | None:
        """The event that a line means there, or what to say about it."""
        word, _, rest = line.removeprefix("/").partition(" ")
        word = word.lower()
        words = position.state in (State.DESCRIBING, State.HALTED) or _corrects_words(position)
        free = words or _answers(position, line)
        if word in _COMMANDS and (line.startswith("/") or not free):
            return _command(word, rest.strip())
        if words and line.lower() in _COMMANDS and self._doubted != (line, position.serial):
            self._doubted = line, position.serial
            return f"As a command that is `/{word}`. If it is what was said, type `{line}` again."
        if any(one in line for one in _STOPS) and not free:  # behind what was half typed
            return events.EmergencyStop()
        return _line(line, position, now_s)

    # showing

    def _count_down(self) -> None:
        """Say now and then how long a break still is."""
        tick = threading.Event()
        while self._shown.state is not State.STOPPED:
            tick.wait(_TICK_S)
            with self._lock:
                position = self._shown
                if position.state is State.RESTING and position.until_s is not None:
                    self._show(_counted(max(0.0, position.until_s - self._clock.now())))

    def _beat(self) -> None:
        """Beat: where the program stands still nothing does, and what was typed meanwhile is known by that.

        So it does where nothing can be shown: who reads what is typed may be waiting to answer. While shots follow each
        other nothing else is shown, so whether it can be is tried.
        """
        while self._live is not None and self._shown.state is not State.STOPPED:
            if self._shown.state in ARMED and self._out.isatty():
                self._show(_staying(""))
            if self._clock.now() - self._writing_s < _HELD_S:
                self._live.beats.beat()
            time.sleep(BEAT_S)

    def _say(self, text: str) -> None:
        self._show(f"{text}\n")

    def _say_beside(self, text: str) -> None:
        """Say what comes whenever it comes; what is asked for then stands there anew, and last."""
        with self._lock:
            still = self._live is not None and self._live.position.serial == self._shown.serial
            self._show(f"\n  {text}\n{self.text(self._shown) if still else ''}")

    def _show(self, text: str) -> None:
        try:
            with self._lock:
                self._writing_s = self._clock.now()
                self._out.write(text)
                self._out.flush()
                self._writing_s = math.inf
        except (OSError, ValueError):
            self._closed()

    def _closed(self) -> None:
        """Nobody sees or types anything any more. Stopped beside: whoever shows may hold what the run waits for."""
        if (live := self._live) is not None and not self._gone:
            self._gone = True
            stop = events.Stop(reason="the terminal was closed")
            threading.Thread(target=live.offer, args=(stop,), daemon=True).start()


def _is_plain_stop(line: str) -> bool:
    return line.startswith(_STOPS) or bool(_F12.search(line))


_COUNTED = len("  1800 s ")


def _counted(left_s: float) -> str:
    """A count at the start of a line that leaves what is typed behind it as it stands, where a terminal can do that."""
    return _staying(f"\r  {left_s:4.0f} s ")


def _staying(text: str) -> str:
    """A text behind which the cursor goes back to where it was, where a terminal can do that."""
    return text or _UNSEEN if os.environ.get("TERM", "dumb") == "dumb" else f"\x1b7{text}\x1b8"


def _corrects_words(position: Position) -> bool:
    return isinstance(position.correcting, Describe)


def _answers(position: Position, line: str) -> bool:
    """Whether a line is one of the answers that are asked for, whatever command has the same name."""
    step = position.correcting or position.step
    return isinstance(step, Ask) and _chosen(step, line) is not None


def _keys(asked: Ask) -> str:
    """The answers with what is typed for each, as in “f = forward, b = backward”."""
    return ", ".join(f"{one.key} = {one.told}" for one in asked.choices)


def _chosen(asked: Ask, line: str) -> str | None:
    """The answer that a line means: by its key, which is what is shown, else by its label or its name."""
    typed = line.casefold()
    names = [
        *((one.key, one.answer) for one in asked.choices),
        *((one.label.casefold(), one.answer) for one in asked.choices),
        *((one.answer.casefold(), one.answer) for one in asked.choices),
    ]
    return next((answer for name, answer in names if name == typed), None)


def _no_answer(asked: Ask) -> str:
    return f"Not an answer: type {' or '.join(one.key for one in asked.choices)} and Enter."


def _between(position: Position) -> str:
    step = position.step
    return f"between {step.between}: {step.duration_s:g} s" if isinstance(step, Rest) else ""


def _command(word: str, rest: str) -> Event | str:  # noqa: C901, PLR0911 - one case a command
    match word:
        case "stop":
            return events.Stop(reason=rest or "stopped by the experimenter")
        case "pause":
            return events.Pause()
        case "undo":
            return events.Undo()
        case "help":
            return _HELP
        case "flag":
            flag = flag_word(rest)
            return events.Flag(flag=flag) if flag else texts.FLAG_RULE
        case "skip" if not rest:
            return "To end the break early type `skip` and the reason."
        case "repeat" if not rest:
            return "To present the trial again type `repeat` and the reason."
        case "note" if not rest:
            return "Type `note` and the words."
        case "skip":
            return events.EndBreak(reason=rest)
        case "repeat":
            return events.Repeat(reason=rest)
        case _:
            return events.Note(text=rest)


def _line(line: str, position: Position, now_s: float) -> Event | str | None:  # noqa: C901, PLR0911, PLR0912 - one case a state
    """What a line that is no command means: it is for what is asked there."""
    match position.state:
        case State.SETTING:
            return events.DamperSet() if line.lower() == "d" else "Set it, then type d and Enter."
        case State.REARMING:
            return events.Rearm(held_s=None) if line.lower() == "test shot" else "Type `test shot` and Enter."
        case State.ASKING if isinstance(position.step, Ask):
            response = _chosen(position.step, line)
            return _no_answer(position.step) if response is None else events.Answer(response=response, at_s=now_s)
        case State.RATING:
            return _rating(line, position)
        case State.DESCRIBING:
            return events.Description(text=line)
        case State.PAUSED:
            return events.GoOn() if line.lower() == "go on" else "Paused: type `go on` and Enter."
        case State.CORRECTING:
            return _correction(line, position)
        case State.HALTED:
            return events.Reason(text=line) if line else events.Stop(reason=EMERGENCY)
        case State.RESTING:
            return "To end the break early type `skip` and the reason." if line else None
        case State.SAVING | State.FIRING if line:  # refused, and on record as what was typed
            response = _chosen(position.step, line) if isinstance(position.step, Ask) else None
            return events.Answer(response=response or line, at_s=now_s)
        case State.TRAIN | State.CLOSING | State.PREPARING | State.INFORMING if line:
            return "Only Enter, or one of the commands (`help`)."
        case State.TRAIN:
            return events.Next()
        case State.INFORMING:
            return events.Told()
        case State.CLOSING:
            return events.Finish()
        case _:
            return events.Fire()


def _rating(line: str, position: Position) -> Event | str:
    if not isinstance(position.step, Rate):
        return "No rating is asked for."
    rating = _typed_rating(line, position.step)
    return rating if isinstance(rating, str) else events.Rating(rating=rating)


def _typed_rating(line: str, asked: Rate) -> float | str | None:
    """The rating that a line says, `None` for no answer; or what to say if it is none."""
    if line.lower() == "none":
        return None
    said = texts.typed_rating(line, asked)
    return f"{said} `none` is no answer." if isinstance(said, str) and asked.may_be_skipped else said


def _how(entry: Asking) -> str:
    """How an entry is corrected."""
    match entry:
        case Ask():
            return _keys(entry)
        case Rate():
            return "a number, or none" if entry.may_be_skipped else "a number"
        case Describe():
            return "the words"


def _correction(line: str, position: Position) -> Event | str:
    """What a line means for the entry that is open."""
    entry = position.correcting
    match entry:
        case Describe() if line:
            return events.Correct(value=line)
        case Rate() if line:
            rating = _typed_rating(line, entry)
            return rating if isinstance(rating, str) else events.Correct(value=rating)
        case Ask() if line:
            response = _chosen(entry, line)
            return _no_answer(entry) if response is None else events.Correct(value=response)
        case _:
            return events.Leave()
