"""The participant's window: what can be put on it, what happens on it, and the keys that it borrows.

Places are in parts of the window's height from its middle, `half_width` to either side and 0.5 up and down.

PsychoPy is imported here, all but its sound, and only when the program runs: it takes seconds and a display. Its
keyboard stamps keys as they happen and not as frames are drawn, and hears them whichever window has the focus: a
two-button box that acts as keys needs none; and so the console must not use the participant's keys for its own ends.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from experiments.screens.participant import messages
from experiments.screens.participant.focus import Focus
from experiments.screens.participant.lettering import laid_out

_SMALLEST = 0.018
_POINTS = 0.75
"""Of a letter's height: its size as PsychoPy hands it to pyglet."""
_SHRINK = 0.92
_MARGIN = 0.94
WINDOW_TITLE = "Recoil: participant"
EMERGENCY_KEY = "F12"
_STEADY_FLIPS, _MOST_FLIPS = 10, 60


class WindowClosed(Exception):  # noqa: N818 - somebody closed it; that is no error of ours
    """The participant's window was closed."""


STILL_S, MOVED_S = 0.1, 1 / 60
"""How often a page is drawn on which nothing moves, and at most while something does."""


class Page:
    """What fills the window, and hears what happens on it: nothing, but for what a page says of itself."""

    pointer = False
    typed = False
    in_front = False
    """Whether it is to be seen, though the keys are another window's."""

    def moves(self) -> object:
        """What of it moves, as it stands now."""
        return None

    def draw(self) -> None:
        """Draw one frame."""

    def pressed(self, x: float, y: float) -> None:
        """The mouse went down."""

    def dragged(self, x: float) -> None:
        """The mouse moved while it was down."""

    def released(self) -> None:
        """The mouse was let go."""

    def key(self, name: str, ctrl: bool) -> bool:
        """A key went down while the window had the focus; `name` as pyglet names it. True keeps it from PsychoPy."""
        del name, ctrl
        return True

    def motion(self, name: str) -> None:
        """A key that moves something went down, or is held."""

    def outcome(self) -> messages.FromParticipant | None:
        """What it comes to: a message to say, or nothing yet."""
        return None

    def draft(self) -> messages.Draft | None:
        """What was set or written on it so far, if anything was."""
        return None

    def leave(self) -> None:
        """It is taken off the window."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TextBox:
    """Where text goes: its anchor point, how large it may be, and what of it stands at the anchor."""

    x: float = 0.0
    y: float
    width: float
    height: float
    anchor: str = "top"


def half_width(width_px: int, height_px: int) -> float:
    """How far pages reach to either side, in parts of the window's height."""
    return _MARGIN * width_px / height_px / 2


class Stage:
    """The open window with one page on it."""

    def __init__(self, toolkit: Toolkit, look: messages.Look) -> None:
        self.toolkit, self.look, self.palette = toolkit, look, messages.PALETTES[look.theme]
        self.window = _open(toolkit, look, self.palette.ground)
        self.width_px, self.height_px = (int(pixels) for pixels in self.window.clientSize)
        self.half_width = half_width(self.width_px, self.height_px)
        self.page = Page()
        self.focus = Focus(self.window.winHandle)
        self.drawn_s = 0.0
        """When the page was drawn last; 0 if it was not yet."""
        self._stood: object = None
        self._closed = self._minimised = False
        self.unasked: deque[messages.Unasked] = deque()
        """What is to be said without a question."""
        self._font_files = [str(path) for path in sorted(toolkit.fonts.glob("NotoSans-*.ttf"))]
        if look.font_file:
            self._font_files.append(look.font_file)
            toolkit.add_font(look.font_file)  # boxes to type in look for theirs elsewhere
        self._handlers = _Handlers(self)  # pyglet holds them weakly
        self.window.winHandle.push_handlers(self._handlers)
        if self.focus.here:  # that it came was told to nobody
            self._handlers.on_activate()

    def measure_refresh(self) -> float | None:
        """The refresh rate in Hz; `None` if frames do not come steadily."""
        measured = self.window.getActualFrameRate(
            nIdentical=_STEADY_FLIPS, nMaxFrames=_MOST_FLIPS, nWarmUpFrames=2, infoMsg=""
        )  # nothing of PsychoPy's to read
        return None if measured is None else round(float(measured), 2)

    def put(self, page: Page, *, keep_keys: bool = False) -> None:
        """Fill the window with another page; one that is typed on borrows the keys for as long as it stands.

        What was done before it stands is done to the page that stood there: a second click is no rating, and a key
        that is held still does nothing on this one.
        `keep_keys`: keys and front stay where they are, so that none of what is being typed goes to another window.
        """
        self.window.winHandle.dispatch_events()
        self._handlers.hear_new_keys()
        self.page.leave()
        self.page = page
        self.window.mouseVisible = page.pointer
        if not keep_keys:
            focus = self.focus
            (focus.take if page.typed else focus.take_front if page.in_front else focus.give_back)()
        self.drawn_s = 0.0

    def step(self) -> None:
        """Let happen what happens, and draw when it is time. `WindowClosed` if it is."""
        self.window.winHandle.dispatch_events()
        if self._closed:
            raise WindowClosed("the participant's window was closed")
        now_s, stands = self.toolkit.now(), self.page.moves()
        if now_s - self.drawn_s >= (STILL_S if stands == self._stood else MOVED_S):
            self.drawn_s, self._stood = now_s, stands
            self.page.draw()
            self.window.flip()
            if (minimised := self.focus.minimised) is not self._minimised:
                self._minimised = minimised
                self.unasked.append(messages.Minimised(on=minimised))

    def note_closed(self) -> None:
        """The window's own close button was used."""
        self._closed = True

    def at(self, x_px: float, y_px: float) -> tuple[float, float]:
        """A place in pixels from the lower left, as a place of this window."""
        return (x_px - self.width_px / 2) / self.height_px, y_px / self.height_px - 0.5

    def text(self, text: str, box: TextBox, size: float, color: str) -> Any:
        """Text that fits its box: smaller than asked if it must."""
        while True:
            stimulus = self.written(text, box, size, color)
            width_px, height_px = stimulus.boundingBox
            fits = width_px <= box.width * self.height_px and height_px <= box.height * self.height_px
            if fits or size * _SHRINK < _SMALLEST:
                return stimulus
            size *= _SHRINK

    def written(self, text: str, box: TextBox, size: float, color: str, align: str = "center") -> Any:
        """Text in letters of one size, however much room that takes; `align`: which side of it stands at `box.x`."""
        return self.toolkit.visual.TextStim(
            self.window,
            text=self._lines(text, box.width, size) or " ",  # PsychoPy cannot measure no text
            font=self.look.font,
            fontFiles=self._font_files,
            pos=(box.x, box.y),
            height=size,
            wrapWidth=box.width,
            anchorVert=box.anchor,
            anchorHoriz=align,
            alignText=align,
            color=color,
        )

    def _lines(self, text: str, width: float, size: float) -> str:
        """A text as it is drawn: from right to left, or with lines of its own, where the language asks for it."""
        right_to_left, kit = self.look.right_to_left, self.toolkit

        def measured(line: str) -> float:
            font = kit.load_font(self.look.font, int(size * self.height_px * _POINTS))
            return float(sum(glyph.advance for glyph in font.get_glyphs(line))) / self.height_px

        return laid_out(
            kit.shape(text) if right_to_left else text, width, measured, kit.turn if right_to_left else None
        )

    def panel(self, box: TextBox, fill: str) -> Any:
        """A filled rectangle; its box's place is its middle."""
        return self.toolkit.visual.Rect(
            self.window,
            width=box.width,
            height=box.height,
            pos=(box.x, box.y),
            fillColor=fill,
            lineColor=None,
            lineWidth=2,
        )

    def cross(self, x: float, y: float, size: float, color: str) -> Any:
        """A cross of two diagonal strokes with its middle at a place."""
        return self.toolkit.visual.ShapeStim(
            self.window, vertices="cross", ori=45, size=size, pos=(x, y), fillColor=color, lineColor=None
        )

    def close(self) -> None:
        """Close the window."""
        self.focus.give_back()
        self.window.close()


def _open(toolkit: Toolkit, look: messages.Look, ground: str) -> Any:
    window = toolkit.visual.Window(
        size=(look.width_px, look.height_px),
        screen=look.screen,
        fullscr=look.full_screen,
        allowGUI=not look.full_screen,
        units="height",
        color=ground,
        checkTiming=False,
        monitor=None,
    )
    window.winHandle.set_caption(WINDOW_TITLE)
    return window


class _Handlers:
    """What pyglet calls, told to the page. Before PsychoPy's own handlers, which a true answer keeps out."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._names = stage.toolkit.key
        self._new = False

    def hear_new_keys(self) -> None:
        """From now on a key counts that goes down; what one repeats that is held does not."""
        self._new = False

    def on_activate(self) -> None:
        self._stage.focus.find_held()
        self.hear_new_keys()
        self._stage.unasked.append(messages.Focused(on=not self._stage.focus.grabbed))

    def on_deactivate(self) -> None:
        self._stage.unasked.append(messages.Focused(on=False))

    def on_close(self) -> bool:
        self._stage.note_closed()
        return True

    def on_mouse_press(self, x: int, y: int, button: int, _: int) -> None:
        if button == 1:
            self._stage.page.pressed(*self._stage.at(x, y))

    def on_mouse_drag(self, x: int, y: int, *_: int) -> None:
        self._stage.page.dragged(self._stage.at(x, y)[0])

    def on_mouse_release(self, _x: int, _y: int, button: int, _: int) -> None:
        if button == 1:
            self._stage.page.released()

    def on_key_press(self, symbol: int, modifiers: int) -> bool:
        self._new = True
        name = self._names.symbol_string(symbol)
        if name == EMERGENCY_KEY:
            self._stage.unasked.append(messages.EmergencyPressed())
            return True
        return self._stage.page.key(name, bool(modifiers & self._names.MOD_CTRL))

    def on_text(self, _: str) -> bool:
        return not self._new

    def on_text_motion(self, motion: int) -> bool:
        if self._new:
            self._stage.page.motion(self._names.motion_string(motion))
        return not self._new


@dataclass(frozen=True, slots=True, kw_only=True)
class Toolkit:
    """The parts of PsychoPy that this program uses. It has no types."""

    version: str
    visual: Any
    keyboard: Any
    key_epoch_s: float
    key: Any
    fonts: Path
    load_font: Any
    add_font: Any
    shape: Callable[[str], str]
    turn: Callable[[str], str]
    now: Any


@contextmanager
def writable_home() -> Iterator[None]:
    """A home folder for PsychoPy, which writes to it when it is imported: another if this one takes nothing.

    On Windows it does not ask for `HOME`.
    """
    if sys.platform == "win32" or _takes_files(Path(os.environ.get("HOME", "")) / ".psychopy3"):
        yield
        return
    with tempfile.TemporaryDirectory(prefix="recoil-home-", ignore_cleanup_errors=True) as home:
        os.environ["HOME"] = home
        yield


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def load_toolkit() -> Toolkit:
    """Import PsychoPy. What it raises without a display or without a part of itself passes through."""
    # imported when used: see above
    import psychopy  # noqa: PLC0415
    from arabic_reshaper import reshape  # noqa: PLC0415
    from bidi import get_display  # noqa: PLC0415
    from psychopy import clock, logging, visual  # noqa: PLC0415
    from psychopy.hardware import keyboard  # noqa: PLC0415
    from psychopy.visual.textbox2.textbox2 import allFonts  # noqa: PLC0415
    from pyglet import font  # noqa: PLC0415
    from pyglet.window import key  # noqa: PLC0415

    logging.console.setLevel(logging.ERROR)
    return Toolkit(
        version=psychopy.__version__,
        visual=visual,
        keyboard=keyboard,
        key_epoch_s=logging.defaultClock.getLastResetTime(),
        key=key,
        fonts=Path(psychopy.__file__).parent / "assets" / "fonts",
        load_font=font.load,
        add_font=allFonts.addFontFile,
        shape=reshape,
        turn=partial(get_display, base_dir="R"),
        now=clock.getTime,
    )


_KEPT = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyDown:
    """A key by PsychoPy's name, and when it went down on the clock of this process."""

    name: str
    pressed_s: float


def key_named(name: str) -> str:
    """A key as answers have it, by PsychoPy's name: a digit is one on the number pad as well.

    >>> key_named("num_2"), key_named("num_enter"), key_named("left")
    ('2', 'num_enter', 'left')
    """
    digit = name.removeprefix("num_")
    return digit if digit.isdecimal() else name


class KeyPresses:
    """The last keys that went down, oldest first."""

    def __init__(self, toolkit: Toolkit) -> None:
        self._board = toolkit.keyboard.Keyboard()
        self._epoch_s = toolkit.key_epoch_s
        self._presses: deque[KeyDown] = deque(maxlen=_KEPT)

    def since(self, onset_s: float) -> Iterator[KeyDown]:
        """The keys that went down from a moment on."""
        self.poll()
        return (
            press for press in sorted(self._presses, key=lambda press: press.pressed_s) if press.pressed_s >= onset_s
        )

    def poll(self) -> None:
        """Take what PsychoPy holds. It gives keys still down and keys let go apart, a key that was both twice."""
        for released in (False, True):
            for found in self._board.getKeys(waitRelease=released):
                press = KeyDown(name=key_named(str(found.name)), pressed_s=float(found.tDown) + self._epoch_s)
                if press not in self._presses:
                    self._presses.append(press)
