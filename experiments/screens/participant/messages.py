"""The words between a console and the participant's screen: one JSON object a line, both ways.

Moments ending in `_s` are on the clock of the side that took them. On the wire `onset_s` and `pressed_s` are on the
participant's clock: the link, which knows both clocks, maps them. `ask` numbers what wants an answer and comes back
with it, so that an answer that is late is never taken for that of the next question.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages

_Finite = Annotated[float, Field(allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
_Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]

REPLY_S = 5.0
"""How long the screen may take over what no person has a hand in."""

NOISE_S = 15.0
"""How long the sound system may take to start."""

BETWEEN = ENGLISH_MESSAGES.between
"""What stands between two questions: put there by the window at once, and then by the console until it asks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Show:
    """Show a plain message; whatever was asked is asked no longer. Keys in `tell` are told if they go down.

    `keep_keys`: the next page is likely one to type on, so the window gives the keys to nobody meanwhile.
    """

    text: str
    tell: tuple[str, ...] = ()
    keep_keys: bool = False
    kind: Literal["show"] = "show"


@dataclass(frozen=True, slots=True, kw_only=True)
class AskRating:
    """Ask for a rating of one of several stimuli, named by its order of presentation.

    Asked again with the same `draft`, it begins with the marker where it stood; so does a description with its words.
    `distinct`: each has one of its own, as ranks are; `taken`: those that were given to others. `keep_keys`: the window
    does not take the keys, as whoever has them may still type.
    """

    number: int
    of: int
    question: str
    minimum: _Finite
    maximum: _Finite
    minimum_text: str
    maximum_text: str
    grain: _Positive
    distinct: bool = False
    taken: tuple[_Finite, ...] = ()
    keep_keys: bool = False
    draft: int = 0
    ask: int = 0
    kind: Literal["ask-rating"] = "ask-rating"


@dataclass(frozen=True, slots=True, kw_only=True)
class AskDescription:
    """Ask for a description of one of several stimuli, named by its order of presentation. `keep_keys` as there."""

    number: int
    of: int
    question: str
    keep_keys: bool = False
    draft: int = 0
    ask: int = 0
    kind: Literal["ask-description"] = "ask-description"


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyedAnswer:
    """An answer with what it is called and its key, by PsychoPy's name."""

    answer: str
    label: str
    key: str


@dataclass(frozen=True, slots=True, kw_only=True)
class AskChoice:
    """Ask for one of several answers; a key pressed before `onset_s` is none.

    `once_seen`: nor is one that was pressed before the question stood there. `step` names it in the answer.
    `keep_keys`: the window does not come to the front for it.
    """

    question: str
    answers: tuple[KeyedAnswer, ...]
    onset_s: _Finite
    once_seen: bool = False
    keep_keys: bool = False
    step: int = 0
    ask: int = 0
    kind: Literal["ask-choice"] = "ask-choice"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ping:
    """What time is it there?"""

    sent_s: _Finite
    kind: Literal["ping"] = "ping"


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Turn the masking noise on or off; `level` is a part of full scale."""

    on: bool
    level: _Share = 0.3
    ask: int = 0
    kind: Literal["noise"] = "noise"


@dataclass(frozen=True, slots=True, kw_only=True)
class CloseScreen:
    """Close the window and end."""

    kind: Literal["close"] = "close"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ready:
    """The window is open: PsychoPy's version, its size in pixels, its measured refresh rate if that is steady."""

    psychopy: str
    window: str
    refresh_Hz: _Finite | None
    kind: Literal["ready"] = "ready"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pong:
    """It was `there_s` here when the ping came that was sent at `sent_s`."""

    sent_s: _Finite
    there_s: _Finite
    kind: Literal["pong"] = "pong"


@dataclass(frozen=True, slots=True, kw_only=True)
class Beat:
    """The window is drawn, and F12 heard on it; the next beat comes within a time."""

    within_s: _Positive = REPLY_S
    kind: Literal["beat"] = "beat"


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingGiven:
    """A confirmed rating, of which 0 is one."""

    rating: _Finite
    ask: int = 0
    kind: Literal["rating-given"] = "rating-given"


@dataclass(frozen=True, slots=True, kw_only=True)
class DescriptionGiven:
    """The participant's own words; may be empty."""

    comment: str
    ask: int = 0
    kind: Literal["description-given"] = "description-given"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChoiceGiven:
    """Which answer, and when its key went down; `stood_still_s`: by how much that may be too late, as nobody looked.

    Or by how much too late the question may have been seen. `step` is the question's.
    """

    response: str
    pressed_s: _Finite
    stood_still_s: _Finite = 0.0
    step: int = 0
    ask: int = 0
    kind: Literal["choice-given"] = "choice-given"


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseIs:
    """Whether the noise plays; if it cannot, the message says why and what to do."""

    on: bool
    message: str
    ask: int = 0
    kind: Literal["noise-is"] = "noise-is"


@dataclass(frozen=True, slots=True, kw_only=True)
class EmergencyPressed:
    """The key of the emergency stop went down while this window had the keys."""

    kind: Literal["emergency-pressed"] = "emergency-pressed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Focused:
    """Whether this window has the keys."""

    on: bool
    kind: Literal["focused"] = "focused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimised:
    """Whether this window is minimised, or on another desktop: nobody sees what stands on it."""

    on: bool
    kind: Literal["minimised"] = "minimised"


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyPressed:
    """A key went down that was to be told, while nothing was asked."""

    name: str
    kind: Literal["key-pressed"] = "key-pressed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """What is set or written so far on the page of a question, which `draft` names as the question did."""

    value: _Finite | str
    draft: int
    kind: Literal["draft"] = "draft"


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseEnded:
    """The noise played and plays no more; the message says why and what to do."""

    message: str
    kind: Literal["noise-ended"] = "noise-ended"


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseBroken:
    """The program that plays the noise stood still for so long, and the noise may have as well."""

    stood_still_s: float
    kind: Literal["noise-broken"] = "noise-broken"


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenFailed:
    """The participant's screen ends, and why."""

    message: str
    kind: Literal["failed"] = "failed"


ToParticipant = Show | AskRating | AskDescription | AskChoice | Ping | Noise | CloseScreen
Unasked = EmergencyPressed | Focused | Minimised | KeyPressed | Draft | NoiseEnded | NoiseBroken
"""What the participant's screen says without being asked."""
Heard = Unasked | ChoiceGiven
"""What nobody waits for: also an answer to a question that was called off."""
FromParticipant = Ready | Pong | Beat | RatingGiven | DescriptionGiven | ChoiceGiven | NoiseIs | Unasked | ScreenFailed

_TO: TypeAdapter[ToParticipant] = TypeAdapter(Annotated[ToParticipant, Field(discriminator="kind")])
_FROM: TypeAdapter[FromParticipant] = TypeAdapter(Annotated[FromParticipant, Field(discriminator="kind")])


def line(word: ToParticipant | FromParticipant) -> bytes:
    r"""A word as a line of the wire: JSON in ASCII. `ValueError` for a number that is none.

    >>> line(Show(text="one\ntwo"))
    b'{"text": "one\\ntwo", "tell": [], "keep_keys": false, "kind": "show"}\n'
    """
    return json.dumps(asdict(word), allow_nan=False).encode("ascii") + b"\n"


def to_participant_from(wire: bytes) -> ToParticipant:
    """The word to the participant that a line holds; `pydantic.ValidationError` if it holds none."""
    return _TO.validate_json(wire)


def from_participant_from(wire: bytes) -> FromParticipant:
    """The word from the participant that a line holds; `pydantic.ValidationError` if it holds none."""
    return _FROM.validate_json(wire)


Theme = Literal["dark", "light"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Screen by index, full or a window of a size; dark or light; a font that has all letters of the texts.

    `font_file` is empty of a font that PsychoPy brings along. `messages` are what stands there beside the questions.
    """

    screen: int = 0
    full_screen: bool = True
    width_px: int = 1280
    height_px: int = 800
    theme: Theme = "dark"
    font: str = "Noto Sans"  # PsychoPy brings it along
    font_file: str = ""
    right_to_left: bool = False
    messages: ParticipantMessages = ENGLISH_MESSAGES


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """Colours of one theme, as PsychoPy takes them."""

    ground: str
    ink: str
    muted: str
    panel: str
    accent: str
    on_accent: str


PALETTES: dict[Theme, Palette] = {
    "dark": Palette(
        ground="#101418", ink="#F2F4F5", muted="#A9B4BC", panel="#242C33", accent="#5CC8FF", on_accent="#06202E"
    ),
    "light": Palette(
        ground="#F6F7F8", ink="#14191D", muted="#4E5A63", panel="#DFE4E8", accent="#005A9C", on_accent="#FFFFFF"
    ),
}


_LOOK = TypeAdapter(Look)


def arguments(look: Look) -> list[str]:
    """A look as arguments of the program.

    >>> look_from(arguments(Look(screen=1, theme="light"))) == Look(screen=1, theme="light")
    True
    """
    return [json.dumps(asdict(look))]


def look_from(words: Sequence[str]) -> Look:
    """The look that arguments ask for, as `arguments` writes it."""
    return _LOOK.validate_json(" ".join(words) or "{}")
