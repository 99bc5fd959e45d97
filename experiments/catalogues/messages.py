"""All that a participant sees or is read and that no design says, in English: what the catalogues translate. Pure.

Names in braces stay as they are in every language. What the console says to the experimenter is not in here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from string import Formatter

from device.messages import first_few


def _said(text: str, note: str) -> str:
    """A message, with a note for whoever translates it."""
    made: str = field(default=text, metadata={"note": note})
    return made


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantMessages:
    """The messages, in English where nothing else is said. `notes` has what translators are told of each."""

    wait: str = _said("Please wait.", "alone on the screen, while there is nothing to do")
    paused: str = _said("Paused. Please wait.", "alone on the screen")
    between: str = _said("Thank you. Please wait.", "alone on the screen, between two questions")
    thanks: str = _said("Thank you.", "alone on the screen, at the very end")
    place: str = _said("Trial {number} of {of}", "heads a question: the trial, by its order; also read out")
    numbered: str = _said("{number}. {question}", "a question that comes later, behind the number of its trial")
    confirm: str = _said("Confirm", "a button, short")
    done: str = _said("Done", "a button, short")
    rating_how: str = _said("Click on the line or use the arrow keys, then Confirm or Enter", "how to rate")
    rating_taken: str = _said("Another one has this place: each has one of its own", "of ranks: that rank is given")
    writing_how: str = _said(
        "Enter begins a new line. When you are done: the button, or Ctrl and Enter", "below a box to type in"
    )
    writing_full: str = _said(
        "There is no more room. When you are done: the button, or Ctrl and Enter", "below a box to type in"
    )
    right: str = _said("That was right.", "after an answer, in a practice; also read out")
    wrong: str = _said("That was wrong.", "after an answer, in a practice; also read out")
    key_left: str = _said("LEFT", "the arrow key, as people call it")
    key_right: str = _said("RIGHT", "the arrow key, as people call it")
    key_up: str = _said("UP", "the arrow key, as people call it")
    key_down: str = _said("DOWN", "the arrow key, as people call it")

    @property
    def every(self) -> tuple[str, ...]:
        """All of them."""
        return tuple(getattr(self, one.name) for one in fields(self))

    def key(self, name: str) -> str:
        """A key as it is printed on the keyboard, by PsychoPy's name.

        >>> ParticipantMessages().key("f"), ParticipantMessages().key("left"), ParticipantMessages().key("num_1")
        ('F', 'LEFT', '1')
        """
        arrows = {"left": self.key_left, "right": self.key_right, "up": self.key_up, "down": self.key_down}
        return arrows.get(name, name.removeprefix("num_").upper())


ENGLISH_MESSAGES = ParticipantMessages()
NAMED_ANSWERS = ("yes", "no", "first", "second", "third", "forward", "backward")
"""Answers that Recoil itself names: shown as they stand where a design has no labels for them."""


def notes() -> dict[str, str]:
    """Everything that a catalogue must have, with what translators are told of it."""
    own = {str(one.default): str(one.metadata["note"]) for one in fields(ParticipantMessages)}
    return own | dict.fromkeys(NAMED_ANSWERS, "an answer, where the design has no label for it")


def translated(translate: Callable[[str], str]) -> ParticipantMessages:
    """The messages in another language. `ValueError` names those that are missing, or whose braces differ."""
    found = {one.name: translate(str(one.default)) for one in fields(ParticipantMessages)}
    for problem in _problems({text: translate(text) for text in notes()}):
        raise ValueError(problem)
    return ParticipantMessages(**found)


_MOST_NAMED = 5


def _problems(texts: dict[str, str]) -> Iterator[str]:
    missing = [repr(text) for text, found in texts.items() if not found.strip()]
    if missing:
        yield f"lacks {first_few(missing, _MOST_NAMED)}"
    for text, found in texts.items():
        if placeholders(text) != placeholders(found):
            yield f"{found!r}: must have the names in braces that {text!r} has, and no others"


def placeholders(text: str) -> list[str]:
    """The names in braces of a message, with whatever else stands in the braces, in the alphabet's order.

    >>> placeholders("{of} 个反馈中的第 {number} 个"), placeholders("{of:>9}"), placeholders("50 %"), placeholders("{")
    (['number', 'of'], ['of:>9'], [], ['{'])
    """
    try:
        parts = [(name, form, how) for _, name, form, how in Formatter().parse(text) if name is not None]
        return sorted(name + (f"!{how}" if how else "") + (f":{form}" if form else "") for name, form, how in parts)
    except ValueError:
        return [text]
