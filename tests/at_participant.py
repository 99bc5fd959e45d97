"""The participant's real window under Xvfb, with hands and an eye on its display: fixtures and what they need."""

import importlib.util
import os
import shutil
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.participant.messages import AskChoice, AskDescription, AskRating, KeyedAnswer, Look, arguments
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("Xvfb") is None, reason="Xvfb is not installed: a window needs a display"),
    pytest.mark.skipif(importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`"),
]
WIDTH, HEIGHT = 1280, 800

SCALE = AskRating(
    number=2,
    of=3,
    question="How much do you like such haptic feedback?",
    minimum=0.0,
    maximum=10.0,
    minimum_text="dislike very much",
    maximum_text="like very much",
    grain=0.1,
)
WORDS = AskDescription(number=2, of=3, question="Please describe this feedback in your own words.")
WHICH = AskChoice(
    question="Which way did it shoot?",
    answers=(
        KeyedAnswer(answer="forward", label="forward", key="f"),
        KeyedAnswer(answer="backward", label="backward", key="b"),
    ),
    onset_s=0.0,
)
LINE_Y, BUTTON_Y, OFF_LINE_Y = 0.56, 0.84, 0.30
HINT = (0.5, 0.90)
LEFT_END, RIGHT_END = 0.1428, 0.8572
FAR_S = 0.5
"""Further apart than the clocks' mapping is ever wrong."""
LOOK = Look(full_screen=False, width_px=WIDTH, height_px=HEIGHT)


@pytest.fixture(scope="module")
def display():
    ours, theirs = os.pipe()
    words = ["Xvfb", "-displayfd", str(theirs), "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "-nolisten", "tcp"]
    server = subprocess.Popen(words, pass_fds=[theirs], stderr=subprocess.DEVNULL)
    os.close(theirs)
    with os.fdopen(ours) as told:  # the server picks a free number and tells it
        yield f":{told.readline().strip()}"
    server.terminate()
    server.wait()


class Hands:
    """Two hands on keyboard and mouse, and an eye on the display."""

    def __init__(self, name):
        # imported when used: it comes with PsychoPy
        from Xlib import XK, X, display
        from Xlib.ext import xtest

        self._X, self._XK, self._fake = X, XK, xtest.fake_input
        self.display = display.Display(name)
        self._root = self.display.screen().root

    def key(self, name, *held):
        """Press a key by its X name while others are held; gives back when."""
        codes = [self.display.keysym_to_keycode(self._XK.string_to_keysym(each)) for each in (*held, name)]
        pressed_s = time.monotonic()
        for code in codes:
            self._fake(self.display, self._X.KeyPress, code)
        for code in reversed(codes):
            self._fake(self.display, self._X.KeyRelease, code)
        self.display.sync()
        return pressed_s

    def click(self, x, y):
        """Click at a place, in parts of the screen."""
        self._fake(self.display, self._X.MotionNotify, x=int(x * WIDTH), y=int(y * HEIGHT))
        self._fake(self.display, self._X.ButtonPress, 1)
        self._fake(self.display, self._X.ButtonRelease, 1)
        self.display.sync()

    def close_window(self):
        """Use the close button that a window manager would draw."""
        from Xlib.protocol import event

        shown = self._X.IsViewable
        window = next(w for w in self._root.query_tree().children if w.get_attributes().map_state == shown)
        delete, protocols = (self.display.intern_atom(f"WM_{name}") for name in ("DELETE_WINDOW", "PROTOCOLS"))
        window.send_event(event.ClientMessage(window=window, client_type=protocols, data=(32, [delete, 0, 0, 0, 0])))
        self.display.sync()

    def seen(self, left=0.0, top=0.0):
        """All that the display shows to the right of and below a place, in parts of the screen."""
        x, y = int(left * WIDTH), int(top * HEIGHT)
        return bytes(self._root.get_image(x, y, WIDTH - x, HEIGHT - y, self._X.ZPixmap, 0xFFFFFFFF).data)

    def is_drawn_on(self, left, top, right, bottom):
        """Whether the display shows more than one colour between places, in parts of the screen."""
        x, y, width, height = (
            int(part) for part in (left * WIDTH, top * HEIGHT, (right - left) * WIDTH, (bottom - top) * HEIGHT)
        )
        data = bytes(self._root.get_image(x, y, width, height, self._X.ZPixmap, 0xFFFFFFFF).data)
        return data != data[:4] * (len(data) // 4)

    def settled(self, *where):
        """What `seen` shows once nothing changes any more."""
        seen = None
        while seen != (seen := self.seen(*where)):
            time.sleep(0.15)
        return seen

    def changing(self, act, *where):
        """Do what changes what `seen` shows, and come back when it has; what that gives back."""
        before = self.settled(*where)
        done = act()
        wait_for(lambda: self.seen(*where) != before, "the display does not change")
        return done


@pytest.fixture(scope="module")
def hands(display):
    hands = Hands(display)
    yield hands
    hands.display.close()


@pytest.fixture(scope="module")
def console():
    """A thread that asks, as a console's would."""
    with ThreadPoolExecutor(1) as executor:
        yield executor


def started(display, home, look=LOOK):
    """The program on a display, with a home of its own."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("DISPLAY", display)
        environment.setenv("HOME", str(home))
        program = warm("-m", "experiments.screens.participant", *arguments(look))
        return ParticipantLink.start(look, command=program)


@pytest.fixture(scope="module")
def link(display, tmp_path_factory):
    with started(display, tmp_path_factory.mktemp("home")) as link:
        ready = link.wait_ready(PATIENCE_S)
        assert ready.window == f"{WIDTH}x{HEIGHT}"
        yield link


@pytest.fixture
def ask(link, hands, console):
    """Ask, and come back when the question stands on the display. Nothing is left of what was written before."""
    show(link, "Please wait")
    emptied = hands.changing(lambda: console.submit(link.ask_rating, replace(SCALE, draft=-1)))
    show(link, "Please wait")
    with pytest.raises(ParticipantError):
        emptied.result()

    def ask(question):
        show(link, "Please wait")
        how = link.ask_rating if isinstance(question, AskRating) else link.ask_description
        return hands.changing(lambda: console.submit(how, question))

    return ask


def show(link, text):
    """Show a text, and come back when it stands on the display: words are obeyed in their order."""
    link.show(text)
    link.noise(on=False)
