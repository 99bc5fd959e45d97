"""The keys of the console: which command each is, and which press counts. Pure: knows nothing of Qt.

A key acts when it goes down and was up before. Auto-repeat never acts, nor does a contact that bounces.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from experiments.design.config import DesignConfig
from experiments.design.language import QuestionConfig
from experiments.screens.phrases import phrase
from experiments.session import events
from experiments.session.events import Event, Press
from experiments.session.states import ARMED, No, Position, State, change_of
from experiments.session.steps import Ask, Describe, Rate
from experiments.tasks.questions import CONFIRMS, Choice, choices

BOUNCE_S = 0.02
"""A key that goes down again so soon was not let go by a hand: an auto-repeat told as two events, or a bounce."""

STRANGE_S = 2.0
"""An event whose time is further off than this is not dated by the clock that the others are."""

_Answer = Literal[
    "answer 1",
    "answer 2",
    "answer 3",
    "answer 4",
    "answer 5",
    "answer 6",
    "answer 7",
    "answer 8",
    "answer 9",
]
Name = Literal[
    "fire",
    "next",
    "damper",
    _Answer,
    "enter",
    "no answer",
    "end break",
    "rearm",
    "go on",
    "pause",
    "undo",
    "leave",
    "repeat",
    "flag",
    "note",
    "reason",
    "stop",
    "emergency",
    "restart",
    "list",
    "help",
    "theme",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyCommand:
    """Something that a key does. `kind` is the event that it offers, if it offers one."""

    name: Name
    key: str
    text: str
    does: str
    kind: type[Event] | None = None


ANSWERS: tuple[Name, ...] = get_args(_Answer)
"""What enters the first answer of a question, the second, ...: the question has its key, and what it says."""

_C = KeyCommand
KEY_COMMANDS: tuple[KeyCommand, ...] = (
    _C(
        name="emergency",
        key="F12",
        text=phrase("EMERGENCY STOP"),
        does=phrase("disarms; fires no more"),
        kind=events.EmergencyStop,
    ),
    _C(
        name="fire",
        key="Space",
        text=phrase("Fire"),
        does=phrase("fires, when the gun is handed over"),
        kind=events.Fire,
    ),
    _C(name="next", key="Space", text=phrase("“Next” was said"), does=phrase("ends the train"), kind=events.Next),
    _C(
        name="damper",
        key=CONFIRMS.upper(),
        text=phrase("It is set"),
        does=phrase("says that what is set by hand is set"),
        kind=events.DamperSet,
    ),
    *(_C(name=name, key="", text="", does=phrase("enters an answer"), kind=events.Answer) for name in ANSWERS),
    _C(
        name="enter",
        key="Enter",
        text="Enter",
        does=phrase("enters what is typed; at the end, ends the run"),
        kind=events.Finish,
    ),
    _C(
        name="no answer",
        key="Ctrl+X",
        text=phrase("No answer"),
        does=phrase("enters that there is no rating"),
        kind=events.Rating,
    ),
    _C(
        name="end break",
        key="E",
        text=phrase("End the break…"),
        does=phrase("ends a break early, for a reason"),
        kind=events.EndBreak,
    ),
    _C(
        name="rearm",
        key="T",
        text=phrase("Hold T: test shot"),
        does=phrase("held for 1 s: a test shot"),
        kind=events.Rearm,
    ),
    _C(name="pause", key="P", text=phrase("Pause"), does=phrase("holds everything; again, goes on"), kind=events.Pause),
    _C(name="go on", key="P", text=phrase("Go on"), does=phrase("goes on after a pause"), kind=events.GoOn),
    _C(
        name="undo",
        key="U",
        text=phrase("Undo"),
        does=phrase("opens the last entry, then the one before"),
        kind=events.Undo,
    ),
    _C(
        name="leave",
        key="Esc",
        text=phrase("Leave"),
        does=phrase("leaves a field or a correction; never stops"),
        kind=events.Leave,
    ),
    _C(
        name="repeat",
        key="R",
        text=phrase("Repeat…"),
        does=phrase("presents the trial again, for a reason"),
        kind=events.Repeat,
    ),
    _C(name="flag", key="G", text=phrase("Flag…"), does=phrase("marks the trial with a word"), kind=events.Flag),
    _C(name="note", key="N", text=phrase("Note…"), does=phrase("writes a note on the trial"), kind=events.Note),
    _C(
        name="reason",
        key="Y",
        text=phrase("Say why…"),
        does=phrase("says why there was an emergency stop"),
        kind=events.Reason,
    ),
    _C(
        name="stop", key="Q", text=phrase("Stop…"), does=phrase("stops the run, which can be resumed"), kind=events.Stop
    ),
    _C(name="restart", key="S", text=phrase("Start it again"), does=phrase("starts the participant's screen again")),
    _C(name="list", key="L", text=phrase("List"), does=phrase("lists flags, notes and corrections of the set")),
    _C(name="help", key="F1", text=phrase("Keys"), does=phrase("shows this page")),
    _C(name="theme", key="F2", text=phrase("Dark/light"), does=phrase("changes the colours")),
)
BY_NAME: dict[Name, KeyCommand] = {command.name: command for command in KEY_COMMANDS}


@dataclass(frozen=True, slots=True, kw_only=True)
class Typing:
    """What is being typed: a line that was asked for, or the field of the position."""

    line: bool = False
    field: bool = False

    @property
    def letters(self) -> bool:
        """Whether letters are text."""
        return self.line or self.field


def choices_at(position: Position) -> tuple[Choice, ...]:
    """The answers that are asked for now, or that an open correction chooses among; none if nothing is to be chosen."""
    if position.state not in (State.ASKING, State.CORRECTING):
        return ()
    asked = position.correcting or position.step
    return asked.choices if isinstance(asked, Ask) else ()


def command_for(key: str, *, ctrl: bool, typing: Typing, position: Position, choices: Sequence[Choice]) -> Name | None:
    """The command that a key is now; `None` if it is none, and so may be text. `choices` have keys of their own.

    Where letters are text, a letter is a command with Ctrl held; elsewhere Ctrl changes nothing, but answers take none:
    a command whose letter is an answer's is done with Ctrl as long as the question stands there.
    """
    if key in _ALWAYS:
        return _ALWAYS[key]
    if ctrl and key == "Space":
        return None  # it changes the input method: nobody fires by that
    if ctrl and key == "X":
        return "no answer" if field_at(position) == "number" and not typing.line else None
    if typing.letters and not ctrl:
        return None
    answers = [one.key.upper() for one in choices]
    if key in answers and not ctrl and (choices_at(position) or _comes_too_soon(key, position)):
        return ANSWERS[answers.index(key)]
    return _letter(key, position)


def _comes_too_soon(key: str, position: Position) -> bool:
    """Whether the letter of an answer that is not asked for now is one all the same, and is told that it is too soon.

    It is if no command has it. While a shot is fired, or an answer saved, a question is about to come or just gone:
    there a letter is no command but Pause.
    """
    return _letter(key, position) is None or (position.state in (State.FIRING, State.SAVING) and key != "P")


_ALWAYS: dict[str, Name] = {"F12": "emergency", "F1": "help", "F2": "theme", "Esc": "leave", "Enter": "enter"}


def _letter(key: str, position: Position) -> Name | None:
    match key:
        case "Space":
            return "next" if position.base is State.TRAIN else "fire"
        case "P":
            return "go on" if position.state is State.PAUSED else "pause"
        case _:
            return _LETTERS.get(key)


_LETTERS: dict[str, Name] = {
    command.key: command.name for command in KEY_COMMANDS if len(command.key) == 1 and command.key != "P"
}


def shared_keys(question: QuestionConfig, questions: Iterable[QuestionConfig]) -> list[str]:
    """The participant's own keys that the console takes as well, also for another question: whose hand was it?

    >>> asked = QuestionConfig(kind="yes-no", text="Was there one?", keys={"yes": "right", "no": "u"})
    >>> other = QuestionConfig(kind="choice", text="How was it?", answers=("hard", "weak"))
    >>> free = asked.model_copy(update={"keys": {"yes": "right", "no": "w"}})
    >>> shared_keys(asked, [asked]), shared_keys(free, [free]), shared_keys(free, [free, other])
    (['u'], [], ['w'])
    """
    heard = {one.key.upper() for any_one in questions for one in choices(any_one)}
    heard |= {command.key for command in KEY_COMMANDS}
    return [one.own_key for one in choices(question) if one.own_key.upper() in heard]


def own_arrows(design: DesignConfig) -> frozenset[str]:
    """The participant's keys that no text takes, by their names."""
    own = {one.own_key for question in design.questions.values() for one in choices(question)}
    return frozenset(key for key in own if len(key) > 1)


def field_at(position: Position) -> Literal["number", "words"] | None:
    """What is typed at a position, apart from a line that was asked for."""
    entry = position.correcting if position.state is State.CORRECTING else None
    match entry if entry is not None else position.state:
        case Rate() | State.RATING:
            return "number"
        case Describe() | State.DESCRIBING:
            return "words"
        case _:
            return None


def shown_key(name: Name, *, letters: bool, choices: Sequence[Choice] = ()) -> str:
    """The key of a command as it stands on its button: letters that are text, or an answer's, need Ctrl.

    A blank that is text needs Esc first.

    >>> shown_key("undo", letters=True), shown_key("help", letters=True), shown_key("fire", letters=True)
    ('Ctrl+U', 'F1', 'Esc, then Space')
    """
    answers = [one.key.upper() for one in choices]
    if name in ANSWERS:
        place = ANSWERS.index(name)
        return answers[place] if place < len(answers) else ""
    key = BY_NAME[name].key
    if letters and key == "Space":
        return phrase("Esc, then {key}", key=key)
    return phrase("Ctrl+{key}", key=key) if len(key) == 1 and (letters or key in answers) else key


_BUTTON_LETTERS = 18
"""So many letters have room side by side on the large buttons of one side."""
_BUTTON_LINES = 2


def button_lines(told: str, has_room: Callable[[str], bool]) -> str:
    r"""An answer in the lines of a button, as few as hold it; empty if it has no room.

    >>> eight = lambda line: len(line) <= 8
    >>> button_lines("rather far", eight), button_lines("far", eight), button_lines("astonishing", eight)
    ('rather\nfar', 'far', '')
    """
    lines = list[str]()
    for word in told.split():
        joined = f"{lines[-1]} {word}" if lines else word
        lines[-1:] = [joined] if has_room(joined) else [*lines[-1:], word]
    return "\n".join(lines) if len(lines) <= _BUTTON_LINES and all(map(has_room, lines)) else ""


def is_on_buttons(choices: Sequence[Choice]) -> bool:
    """Whether every answer stands whole on its button, in large type."""
    beside = (len(choices) + 1) // 2
    room = _BUTTON_LETTERS // beside - 2 * (beside > 1)
    return all(button_lines(one.told, lambda line: len(line) <= room) for one in choices)


def why_not(name: Name, position: Position) -> str:
    """Why a command does nothing at a position; empty if it does something."""
    kind = BY_NAME[name].kind
    if name in ANSWERS and position.state is State.CORRECTING:
        kind = events.Correct if field_at(position) is None else kind
    if name == "no answer" and position.state is State.CORRECTING:
        kind = events.Correct
    if name == "enter" and position.state is State.INFORMING:
        kind = events.Told
    if kind is None:
        return ""
    change = change_of(position, kind)
    return change.because if isinstance(change, No) else ""


LOOKED_S = 0.3
"""A key that nobody looked at for longer may have been let go meanwhile."""


class Hold:
    """A press that is held, of a key or of the mouse: after a while in which nobody looked it begins anew."""

    def __init__(self, press: Press, now_s: float, *, by_key: bool) -> None:
        self.press, self._by_key = press, by_key
        self._from_s = self._seen_s = now_s

    def held_s(self, now_s: float, *, down: bool) -> float:
        """For how long, as somebody looks now; 0 while its key is not `down`: whether it was let go is known later."""
        if now_s - self._seen_s > LOOKED_S:
            self._from_s = now_s
        self._seen_s = now_s
        return now_s - self._from_s if down or not self._by_key else 0.0


def not_held_text(held_s: float, *, by_hand: bool) -> str:
    """Why a press did not last: it was let go, or something else was pressed."""
    if by_hand:
        return phrase("Let go too soon: hold it for {held_s:g} s.", held_s=held_s)
    return phrase("Something else was pressed meanwhile: hold it alone for {held_s:g} s.", held_s=held_s)


class Presses:
    """Which keys are down, so that a press acts once.

    Times are the window system's stamps: what was pressed while the program stood still is seen all at once.
    """

    def __init__(self) -> None:
        self._down: set[str] = set()
        self._up_s: dict[str, float] = {}
        self._ups: dict[str, int] = {}

    def down(self, key: str, at_s: float, *, repeated: bool) -> bool:
        """Whether this press acts: the key was up, and a hand let it go."""
        fresh = key not in self._down and not 0 <= at_s - self._up_s.get(key, -math.inf) < BOUNCE_S
        if not repeated:
            self._down.add(key)
        return fresh and not repeated

    def up(self, key: str, at_s: float, *, repeated: bool) -> int:
        """A key was let go, unless the system only repeats it. Gives back the number of the release."""
        if not repeated:
            self._down.discard(key)
            self._up_s[key] = at_s
            self._ups[key] = self._ups.get(key, 0) + 1
        return self._ups.get(key, 0)

    def is_down(self, key: str) -> bool:
        """Whether a key is down, for all that was told until now."""
        return key in self._down

    def was_let_go(self, key: str, number: int) -> bool:
        """Whether a hand let a key go by a release a while ago: it was the last one, and the key is not down again.

        A busy machine tells an auto-repeat as two events, a release and a press that may come apart.
        """
        return key not in self._down and self._ups.get(key) == number

    def lost(self) -> set[str]:
        """The window has lost the keys: what was down, which may be let go unseen."""
        were, self._down = self._down, set()
        return were


class EventClock:
    """When events happened, on the run's clock, from the stamps of the window system, whose zero is its own.

    The stamp can be no later than the event is seen: the smallest difference ever seen is that of the clocks.
    """

    def __init__(self) -> None:
        self._offset_s = math.inf

    def at(self, stamp_s: float, now_s: float) -> float:
        """When an event with a stamp happened that is seen now."""
        self._offset_s = min(self._offset_s, now_s - stamp_s)
        at_s = stamp_s + self._offset_s
        return at_s if now_s - at_s < STRANGE_S else now_s


EVENTS: dict[Name, Event] = {
    "fire": events.Fire(),
    "next": events.Next(),
    "damper": events.DamperSet(),
    "pause": events.Pause(),
    "go on": events.GoOn(),
    "undo": events.Undo(),
    "emergency": events.EmergencyStop(),
}
"""What a command offers to the run that is no answer and asks for no line."""

_PAGE_COMMANDS: tuple[Name, ...] = ("help", "list", "leave", "emergency", "theme")
"""What is done while a page covers the run."""
_HOLDS: tuple[Name, ...] = ("pause", "next")
"""What makes the gun silent: done from a page as well, which goes. The rest would be done unseen."""


def is_for_pages(name: Name, position: Position) -> bool:
    """Whether a command is done while a page covers the run: a stop is where it makes the gun silent first."""
    return name in _PAGE_COMMANDS + _HOLDS or (name == "stop" and position.base in ARMED)
