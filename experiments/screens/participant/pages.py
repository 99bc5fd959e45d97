"""The pages of the participant's window: a message, a direction by keys, a rating by mouse or keys, a description.

Pure: a place is a part of the scale's length from its left end; ratings are kept to the grain.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

from experiments.screens.participant import messages
from experiments.screens.participant.stage import KeyPresses, Page, Stage, TextBox, half_width
from experiments.tasks.questions import on_scale

Drafts = dict[int, float | str]
"""What was set or written on a page that was taken off before it was given, by the question's `draft`."""


class MessagePage(Page):
    """A plain message in the middle."""

    def __init__(self, stage: Stage, text: str) -> None:
        box = TextBox(y=0, width=2 * stage.half_width, height=0.9, anchor="center")
        self.message = stage.text(text, box, 0.06, stage.palette.ink)

    def draw(self) -> None:
        """The message."""
        self.message.draw()


class ChoicePage(Page):
    """Answers side by side, each with its key.

    Keys count from the onset on, even those that went down before the page stood. After a pause, or where a key was
    refused, only those that go down once it stands there again.
    """

    in_front = True

    def __init__(self, stage: Stage, asked: messages.AskChoice, keys: KeyPresses) -> None:
        self._asked, self._keys, self._now = asked, keys, stage.toolkit.now
        self._since_s = math.inf if asked.once_seen else asked.onset_s
        self._seen_s = math.inf
        all_across, ink = 2 * stage.half_width, stage.palette.ink
        width = all_across / len(asked.answers)
        question = TextBox(y=0.4, width=all_across, height=0.25)
        self._drawn = [stage.text(asked.question, question, 0.06, ink)]
        for place, answer in enumerate(asked.answers):
            x = (place + 0.5) * width - all_across / 2
            self._drawn.append(stage.panel(TextBox(x=x, y=-0.12, width=0.9 * width, height=0.4), stage.palette.panel))
            letter = TextBox(x=x, y=-0.06, width=0.8 * width, height=0.16, anchor="center")
            key = stage.look.messages.key(answer.key)
            self._drawn.append(stage.text(key, letter, 0.12, stage.palette.accent))
            words = TextBox(x=x, y=-0.22, width=0.8 * width, height=0.12, anchor="center")
            self._drawn.append(stage.text(answer.label, words, 0.055, ink))

    def draw(self) -> None:
        """The question and its answers."""
        for stimulus in self._drawn:
            stimulus.draw()
        self._seen_s = min(self._seen_s, self._now())
        if math.isinf(self._since_s):
            self._since_s = max(self._seen_s, self._asked.onset_s)

    @property
    def unseen_s(self) -> tuple[float, float]:
        """From when on it was asked, and since when it stands there."""
        return self._asked.onset_s, self._seen_s

    def outcome(self) -> messages.ChoiceGiven | None:
        """The first of the answers' keys since the onset."""
        said = {answer.key: answer.answer for answer in self._asked.answers}
        for press in self._keys.since(self._since_s):
            if press.name in said:
                return messages.ChoiceGiven(
                    response=said[press.name],
                    pressed_s=press.pressed_s,
                    step=self._asked.step,
                    ask=self._asked.ask,
                )
        return None


ENTER = ("RETURN", "ENTER", "NUM_ENTER")
"""Keys that confirm, as pyglet names them."""


class Button:
    """A button that can be pressed once there is something to confirm."""

    def __init__(self, stage: Stage, text: str) -> None:
        self._box = TextBox(y=-0.34, width=0.36, height=0.1, anchor="center")
        inner = TextBox(y=self._box.y, width=0.32, height=0.08, anchor="center")
        colors = stage.palette
        self._off = [stage.panel(self._box, colors.panel), stage.text(text, inner, 0.045, colors.muted)]
        self._on = [stage.panel(self._box, colors.accent), stage.text(text, inner, 0.045, colors.on_accent)]

    def draw(self, enabled: bool) -> None:
        """Lit or not."""
        for stimulus in self._on if enabled else self._off:
            stimulus.draw()

    def holds(self, x: float, y: float) -> bool:
        """Whether a place is on it."""
        return abs(x - self._box.x) <= self._box.width / 2 and abs(y - self._box.y) <= self._box.height / 2


def heading(stage: Stage, asked: messages.AskRating | messages.AskDescription) -> list[Any]:
    """Which stimulus is meant, by its order of presentation, and the question."""
    width = 2 * stage.half_width
    which = stage.look.messages.place.format(number=asked.number, of=asked.of)
    return [
        stage.text(which, TextBox(y=0.46, width=width, height=0.07), 0.05, stage.palette.accent),
        stage.text(asked.question, TextBox(y=0.37, width=width, height=0.3), 0.045, stage.palette.ink),
    ]


def hint(stage: Stage, text: str) -> Any:
    """How to answer, small, at the foot."""
    return stage.text(text, TextBox(y=-0.425, width=2 * stage.half_width, height=0.05), 0.034, stage.palette.muted)


Move = Literal["left", "right", "far left", "far right", "first", "last"]

GRAINS_FAR = 10
"""Grains of a far move: a tenth of a scale of 0 to 10 in grains of 0.1."""

_STEPS: dict[Move, Callable[[messages.AskRating, float], float]] = {
    "left": lambda scale, rating: rating - scale.grain,
    "right": lambda scale, rating: rating + scale.grain,
    "far left": lambda scale, rating: rating - GRAINS_FAR * scale.grain,
    "far right": lambda scale, rating: rating + GRAINS_FAR * scale.grain,
    "first": lambda scale, _: scale.minimum,
    "last": lambda scale, _: scale.maximum,
}


def put(scale: messages.AskRating, part: float) -> float:
    """The rating where the marker is put by hand; beyond an end it is that end."""
    return on_scale(scale.minimum + part * (scale.maximum - scale.minimum), scale)


def move(scale: messages.AskRating, rating: float | None, step: Move) -> float:
    """The rating after a key; from nowhere the first key puts the marker in the middle, or at the end it names."""
    middle = on_scale((scale.minimum + scale.maximum) / 2, scale)
    if rating is None and step not in ("first", "last"):
        return middle
    return on_scale(_STEPS[step](scale, middle if rating is None else rating), scale)


_SCALE_Y = -0.06
_CROSS_Y = 0.005
_LENGTH = 0.76
"""The scale's, as a part of the page's width."""
_REACH = 0.06
"""How far above and below the line a press still takes the marker."""

_MOVES: dict[str, Move] = {
    "MOTION_LEFT": "left",
    "MOTION_DOWN": "left",
    "MOTION_RIGHT": "right",
    "MOTION_UP": "right",
    "MOTION_PREVIOUS_PAGE": "far left",
    "MOTION_NEXT_PAGE": "far right",
    "MOTION_BEGINNING_OF_LINE": "first",
    "MOTION_END_OF_LINE": "last",
}


def spot_px(part: float, width_px: int, height_px: int) -> tuple[int, int]:
    """Where a part of the scale's length lies on the window, in pixels from its upper left.

    >>> spot_px(0.0, 1280, 800), spot_px(0.5, 1280, 800)
    ((183, 448), (640, 448))
    """
    half = _LENGTH * half_width(width_px, height_px)
    return round(width_px / 2 + (2 * part - 1) * half * height_px), round((0.5 - _SCALE_Y) * height_px)


class RatingPage(Page):
    """The scale. No marker stands on it until the participant puts one there, and nothing is confirmed before.

    Nor is what another one has. `drafts` holds where it stood when the page was taken off: it stands there again.
    """

    pointer = True
    typed = True

    def __init__(self, stage: Stage, asked: messages.AskRating, drafts: Drafts) -> None:
        self._stage, self._asked, self._drafts = stage, asked, drafts
        self._rating = None if asked.draft not in drafts else float(drafts[asked.draft])
        self._dragging = self._done = False
        self._half = _LENGTH * stage.half_width
        self._slider = self._scale()
        said = stage.look.messages
        self._button = Button(stage, said.confirm)
        self._drawn = [*heading(stage, asked), *self._numbers(), *self._ends()]
        self._hints = {False: hint(stage, said.rating_how), True: hint(stage, said.rating_taken)}

    def moves(self) -> float | None:
        """The marker."""
        return self._rating

    def draw(self) -> None:
        """The question, the scale with its marker if there is one, the button."""
        self._slider.markerPos = self._rating
        for stimulus in (*self._drawn, self._slider, self._hints[self._rating in self._asked.taken]):
            stimulus.draw()
        self._button.draw(enabled=self._is_free())

    def pressed(self, x: float, y: float) -> None:
        """On the scale: put the marker there. On the button: confirm."""
        if abs(y - _SCALE_Y) <= _REACH and abs(x) <= self._half + _REACH:
            self._dragging = True
            self.dragged(x)
        elif self._button.holds(x, y):
            self._confirm()

    def dragged(self, x: float) -> None:
        """Take the marker along."""
        if self._dragging:
            self._rating = put(self._asked, (x / self._half + 1) / 2)

    def released(self) -> None:
        """Let the marker stand."""
        self._dragging = False

    def key(self, name: str, ctrl: bool) -> bool:
        """Enter confirms."""
        del ctrl
        if name in ENTER:
            self._confirm()
        return True

    def motion(self, name: str) -> None:
        """Arrows move the marker by grains, page keys by ten, Home and End to the ends."""
        if name in _MOVES:
            self._rating = move(self._asked, self._rating, _MOVES[name])

    def outcome(self) -> messages.RatingGiven | None:
        """The rating, once it is confirmed. 0 is a rating."""
        if not self._done or self._rating is None:
            return None
        return messages.RatingGiven(rating=self._rating, ask=self._asked.ask)

    def draft(self) -> messages.Draft | None:
        """Where the marker stands."""
        return None if self._rating is None else messages.Draft(value=self._rating, draft=self._asked.draft)

    def leave(self) -> None:
        """Where the marker stands is kept."""
        if self._rating is not None:
            self._drafts[self._asked.draft] = self._rating

    def _is_free(self) -> bool:
        """Whether there is a marker, and no other one's place."""
        return self._rating is not None and self._rating not in self._asked.taken

    def _confirm(self) -> None:
        self._done = self._is_free()

    def _scale(self) -> Any:
        """PsychoPy's slider draws; the mouse is heard here, as a click between two frames would be lost on it."""
        colors = self._stage.palette
        return self._stage.toolkit.visual.Slider(
            self._stage.window,
            ticks=self._places(),
            pos=(0, _SCALE_Y),
            size=(2 * self._half, 0.05),
            units="height",
            style="rating",
            granularity=0,
            readOnly=True,
            font=self._stage.look.font,
            lineColor=colors.ink,
            markerColor=colors.accent,
            labelColor=colors.ink,
        )

    def _places(self) -> list[float]:
        """What has a number: the ends of a scale, every one of the ranks."""
        low, high, grain = self._asked.minimum, self._asked.maximum, self._asked.grain
        if not self._asked.distinct or low == high:
            return [low, high]
        return [low + grain * n for n in range(round((high - low) / grain) + 1)]

    def _numbers(self) -> list[Any]:
        """The numbers below the line, and a cross above it where another one has the place: a shape, not only a hue."""
        places, colors = self._places(), self._stage.palette
        width = min(2 * self._half / (len(places) - 1), 2 * (self._stage.half_width - self._half))
        drawn = []
        for number in places:
            x = self._half * (2 * (number - places[0]) / (places[-1] - places[0] or 1.0) - 1)
            is_taken = number in self._asked.taken
            box = TextBox(x=x, y=-0.105, width=0.9 * width, height=0.06)
            drawn.append(self._stage.text(f"{number:g}", box, 0.04, colors.muted if is_taken else colors.ink))
            drawn += [self._stage.cross(x, _CROSS_Y, 0.04, colors.ink)] if is_taken else []
        return drawn

    def _ends(self) -> list[Any]:
        """The words under each end, no wider than twice the way to the window's edge."""
        width, ink = 2 * (self._stage.half_width - self._half), self._stage.palette.ink
        ends = ((-self._half, self._asked.minimum_text), (self._half, self._asked.maximum_text))
        return [self._stage.text(said, TextBox(x=x, y=-0.155, width=width, height=0.12), 0.04, ink) for x, said in ends]


MOST_CHARACTERS = 1_000
"""What a description may hold: PsychoPy lays the text out anew at every key, and beyond this typing would lag."""

STOOD_S = 0.5
"""Done is taken from so long after the page was drawn: it lies where Confirm was, and people click twice."""

_PADDING = 0.02
_BELOW = 0.3  # of a letter: what a line may have below its base
_SIZES = (0.04, 0.034, 0.029, 0.025, 0.021)


class DescriptionPage(Page):
    """A box to type in. Letters get smaller as it fills; a key that finds no room is not taken, and that is said.

    `drafts` holds what was written so far: it stands there at first, and is kept at last.
    """

    pointer = True
    typed = True

    def __init__(self, stage: Stage, asked: messages.AskDescription, drafts: Drafts) -> None:
        self._asked, self._drafts = asked, drafts
        self._now, self._drawn_s = stage.toolkit.now, math.inf
        self._done = self._full = False
        place = TextBox(y=-0.03, width=2 * stage.half_width, height=0.44)
        self._size = 0
        self._height_px = stage.height_px
        self._room_px = (place.height - 2 * _PADDING) * stage.height_px
        self._box = _text_box(stage, place, str(drafts.get(asked.draft, "")))
        self._turned = Turned(stage, self._box, place) if stage.look.right_to_left else None
        said = stage.look.messages
        self._button = Button(stage, said.done)
        self._drawn = [*heading(stage, asked), *([self._box] if self._turned is None else [])]
        self._hints = {False: hint(stage, said.writing_how), True: hint(stage, said.writing_full)}

    def moves(self) -> tuple[str, int]:
        """Letters and caret."""
        return self._box.text, self._box.caret.index

    def draw(self) -> None:
        """The question, what was typed, the button."""
        for stimulus in (*self._drawn, self._hints[self._full]):
            stimulus.draw()
        if self._turned is not None:
            self._turned.draw(_SIZES[self._size])
        self._button.draw(enabled=True)
        self._drawn_s = min(self._drawn_s, self._now())
        self._fit()

    def pressed(self, x: float, y: float) -> None:
        """On the button: done, once the page has stood there."""
        stood = self._now() - self._drawn_s >= STOOD_S
        self._done = self._done or (stood and self._button.holds(x, y))

    def key(self, name: str, ctrl: bool) -> bool:
        """Enter with Ctrl: done. Tab does nothing; all else is PsychoPy's."""
        self._done = self._done or (ctrl and name in ENTER)
        return self._done or name == "TAB"

    def outcome(self) -> messages.DescriptionGiven | None:
        """The description, once it is done."""
        return messages.DescriptionGiven(comment=self._box.text.strip(), ask=self._asked.ask) if self._done else None

    def draft(self) -> messages.Draft:
        """What was written so far."""
        return messages.Draft(value=self._box.text.strip(), draft=self._asked.draft)

    def leave(self) -> None:
        """No more typing; what was written is kept."""
        self._box.editable = False
        self._drafts[self._asked.draft] = self._box.text

    def _fit(self) -> None:
        """Smaller letters if the text is too high; where there are none, the last letter goes again."""
        too_high = self._too_high()
        if too_high and self._size + 1 < len(_SIZES):
            self._size += 1
            self._write_in(_SIZES[self._size])
        elif too_high or len(self._box.text) > MOST_CHARACTERS:
            self._full = True
            self._box.deleteCaretLeft()

    def _too_high(self) -> bool:
        """Whether the text as it was last drawn, measured in pixels, is higher than the box within its padding."""
        height_px = self._box.boundingBox.size[1] if self._turned is None else self._turned.height_px
        return bool(height_px > self._room_px - _BELOW * _SIZES[self._size] * self._height_px)

    def _write_in(self, size: float) -> None:
        """PsychoPy fetches letters of a new size only with the font, and lays out only with the text."""
        self._box.letterHeight = size
        self._box.font = self._box.font
        self._box.text = self._box.text


_CARET, _EDGE = "|", 0.005


class Turned:
    """What is typed from right to left, with a caret, on a panel. PsychoPy's box takes the keys, and is not drawn.

    It would keep what it draws, in the order that it draws it, and so lose what was typed.
    """

    def __init__(self, stage: Stage, box: Any, place: TextBox) -> None:
        self._stage, self._box = stage, box
        right, top = place.x + place.width / 2 - _PADDING, place.y + place.height / 2 - _PADDING
        edge = replace(place, width=place.width + _EDGE, height=place.height + _EDGE)
        self._panel = [stage.panel(edge, stage.palette.muted), stage.panel(place, stage.palette.panel)]
        self._place = TextBox(x=right, y=top, width=place.width - 2 * _PADDING, height=place.height)
        self._drawn: Any = None
        self._stood: object = None

    @property
    def height_px(self) -> float:
        """How high the text is as it was drawn."""
        return 0.0 if self._drawn is None else float(self._drawn.boundingBox[1])

    def draw(self, size: float) -> None:
        """The text as it stands, in letters of a size."""
        text, caret = str(self._box.text), int(self._box.caret.index)
        if (stands := (text, caret, size)) != self._stood:
            self._stood = stands
            shown = f"{text[:caret]}{_CARET}{text[caret:]}"
            self._drawn = self._stage.written(shown, self._place, size, self._stage.palette.ink, "right")
        for stimulus in (*self._panel, self._drawn):
            stimulus.draw()


def _text_box(stage: Stage, place: TextBox, text: str) -> Any:
    return stage.toolkit.visual.TextBox2(
        stage.window,
        text=text,
        font=stage.look.font,
        pos=(place.x, place.y),
        size=(place.width, place.height),
        units="height",
        letterHeight=_SIZES[0],
        padding=_PADDING,
        alignment="top left",
        color=stage.palette.ink,
        fillColor=stage.palette.panel,
        borderColor=stage.palette.muted,
        placeholder="",
        formattingSyntax="none",  # the participant's asterisks are their own
        editable=True,
    )
