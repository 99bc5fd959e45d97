"""The participant's real window under Xvfb, answered by real key and mouse events."""

import importlib.util
import os
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.participant.messages import AskDescription, AskDirection, AskRating, Look
from tests.waiting import PATIENCE_S, wait_for

pytestmark = [
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
WHICH = AskDirection(
    question="Which way did it shoot?",
    forward="forward",
    backward="backward",
    forward_key="f",
    backward_key="b",
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
        return ParticipantLink.start(look)


@pytest.fixture(scope="module")
def link(display, tmp_path_factory):
    with started(display, tmp_path_factory.mktemp("home")) as link:
        ready = link.wait_ready(PATIENCE_S)
        assert ready.window == f"{WIDTH}x{HEIGHT}"
        yield link


@pytest.fixture
def ask(link, hands, console):
    """Ask, and come back when the question stands on the display. Nothing is left of what was written before."""
    with pytest.raises(ParticipantError, match="no answer"):
        link.ask_rating(replace(SCALE, draft=-1), 0.0)

    def ask(question):
        show(link, "Please wait")
        how = link.ask_rating if isinstance(question, AskRating) else link.ask_description
        return hands.changing(lambda: console.submit(how, question, PATIENCE_S))

    return ask


def show(link, text):
    """Show a text, and come back when it stands on the display: words are obeyed in their order."""
    link.show(text)
    link.noise(on=False)


def test_the_left_end_of_the_scale_is_a_rating_of_0(ask, hands):
    answer = ask(SCALE)
    hands.click(LEFT_END, LINE_Y)
    hands.click(0.5, BUTTON_Y)
    assert answer.result(PATIENCE_S).rating == 0.0


@pytest.mark.parametrize(("x", "rating"), [(RIGHT_END, 10.0), (0.95, None), (0.5, 5.0), (0.643, 7.0)])
def test_a_click_rates_where_it_falls_and_beyond_the_line_nowhere(ask, hands, link, x, rating):
    answer = ask(SCALE)
    hands.click(x, LINE_Y)
    hands.click(0.5, BUTTON_Y)
    if rating is None:  # then what comes after it counts
        hands.key("Home")
        hands.key("Return")
        rating = 0.0
    assert answer.result(PATIENCE_S).rating == rating


def test_nothing_is_confirmed_before_there_is_a_marker(ask, hands):
    answer = ask(SCALE)
    hands.key("Return")
    hands.click(0.5, BUTTON_Y)
    hands.click(0.5, OFF_LINE_Y)
    hands.key("Return")
    hands.key("End")
    hands.key("Return")
    assert answer.result(PATIENCE_S).rating == 10.0  # neither none, nor the middle


def test_a_scale_is_answered_by_keys_alone(ask, hands):
    answer = ask(SCALE)
    for name in ("Right", "Right", "Right", "Left", "Next", "KP_Enter"):  # to the middle, then by grains, then by ten
        hands.key(name)
    assert answer.result(PATIENCE_S).rating == 6.1


def test_a_description_keeps_its_quotes_lines_and_asterisks(ask, hands):
    answer = ask(WORDS)
    for name in ("a", "quotedbl", "Return", "asterisk", "b", "x", "BackSpace", "asterisk", "Tab", "backslash"):
        hands.key(name, *(["Shift_L"] if name in ("quotedbl", "asterisk") else []))
    hands.key("Return", "Control_L")
    assert answer.result(PATIENCE_S).comment == 'a"\n*b*\\'


def test_a_description_longer_than_its_box_is_taken_as_long_as_there_is_room(ask, hands, link):
    answer = ask(WORDS)
    hint, typed = hands.seen(*HINT), ""
    while hands.seen(*HINT) == hint:  # until it says that there is no more room
        assert len(typed) < 120
        before = hands.seen()
        hands.key("Return")
        hands.key(letter := "abc"[len(typed) // 2 % 3])
        typed += f"\n{letter}"
        wait_for(lambda before=before: hands.seen() != before)
    hands.settled()
    call_off(link, answer)
    again = ask(WORDS)  # as it was
    hands.settled()
    hands.key("Return", "Control_L")
    comment = again.result(PATIENCE_S).comment
    assert len(comment.split()) > 8
    assert len(comment) < len(typed.strip())
    assert comment.split()[:4] == ["a", "b", "c", "a"]


def test_an_empty_description_is_one_and_the_button_ends_it(ask, hands):
    answer = ask(WORDS)

    def clicked_again():  # the first may be the second click on Confirm, which lay there
        hands.click(0.5, BUTTON_Y)
        return answer.done()

    wait_for(clicked_again, "it does not end")
    assert answer.result(PATIENCE_S).comment == ""


def call_off(link, answer):
    """Call off a question, as a pause does."""
    show(link, "Paused. Please wait.")
    with pytest.raises(ParticipantError, match="called off"):
        answer.result(PATIENCE_S)


def type_on(hands, *names):
    for name in names:
        hands.key(name)


def describe(hands, answer, *names):
    """Type on, confirm, and give back the description."""
    type_on(hands, *names)
    hands.key("Return", "Control_L")
    return answer.result(PATIENCE_S).comment


def test_a_description_that_was_called_off_goes_on_where_it_was(ask, hands, link):
    answer = ask(WORDS)
    type_on(hands, "a", "space")
    call_off(link, answer)
    answer = ask(WORDS)
    type_on(hands, "b", "Return")
    call_off(link, answer)
    assert describe(hands, ask(WORDS), "c") == "a b\nc"


def test_a_description_that_was_given_but_not_taken_goes_on_where_it_was_until_the_next_rating(ask, hands):
    assert describe(hands, ask(WORDS), "a") == "a"
    assert describe(hands, ask(WORDS), "b") == "ab"
    answer = ask(SCALE)
    type_on(hands, "End", "Return")
    assert answer.result(PATIENCE_S).rating == 10.0
    assert describe(hands, ask(WORDS), "c") == "c"


def test_what_was_written_of_one_stimulus_never_stands_in_the_description_of_another(ask, hands, link):
    answer = ask(WORDS)
    type_on(hands, "a")
    call_off(link, answer)
    assert describe(hands, ask(replace(WORDS, number=3, draft=1)), "b") == "b"


def test_a_rating_that_was_called_off_has_its_marker_where_it_was(ask, hands, link):
    answer = ask(SCALE)
    hands.click(RIGHT_END, LINE_Y)
    hands.key("Left")
    call_off(link, answer)
    again = ask(SCALE)
    hands.click(0.5, BUTTON_Y)
    assert again.result(PATIENCE_S).rating == 9.9


def test_the_marker_of_one_stimulus_never_stands_on_the_scale_of_another(ask, hands, link):
    answer = ask(SCALE)
    hands.click(RIGHT_END, LINE_Y)
    call_off(link, answer)
    other = ask(replace(SCALE, number=3, draft=1))
    hands.click(0.5, BUTTON_Y)
    hands.key("Return")
    hands.click(LEFT_END, LINE_Y)
    hands.key("Return")
    assert other.result(PATIENCE_S).rating == 0.0


@pytest.fixture
def maps(link, monkeypatch):
    """The mappings of the clocks from now on."""
    kept, map_clocks = [], link.map_clocks
    monkeypatch.setattr(link, "map_clocks", lambda: kept.append(map_clocks()) or kept[-1])
    return kept


def test_a_key_tells_the_direction_and_when_it_went_down(link, hands, console, maps):
    """After the press and before the answer came, as well as the clocks know; how close to it, `make soak` measures."""
    show(link, "Please wait")
    question = replace(WHICH, onset_s=time.monotonic())
    answer = hands.changing(lambda: console.submit(link.ask_direction, question, PATIENCE_S))
    hands.key("x")
    pressed_s = hands.key("b")
    given, unsure_s = answer.result(PATIENCE_S), maps[0].uncertainty_s
    in_order = [pressed_s - unsure_s, given.pressed_s, time.monotonic() + unsure_s]
    assert given.response == "backward"
    assert in_order == sorted(in_order)


def test_a_key_before_the_onset_is_no_answer_but_one_before_the_question_stands_is(link, hands):
    question = replace(WHICH, onset_s=time.monotonic())
    hands.key("b")
    before = link.ask_direction(question, PATIENCE_S)
    time.sleep(2 * FAR_S)
    hands.key("f")
    given = link.ask_direction(replace(question, onset_s=before.pressed_s + FAR_S), PATIENCE_S)
    assert (before.response, given.response) == ("backward", "forward")
    assert given.pressed_s > before.pressed_s + FAR_S


def test_after_a_pause_a_key_counts_once_the_question_stands_there_again(link, hands, console):
    show(link, "Paused")
    question = replace(WHICH, onset_s=time.monotonic(), once_seen=True)
    hands.key("b")
    answer = hands.changing(lambda: console.submit(link.ask_direction, question, PATIENCE_S))
    hands.key("f")
    assert answer.result(PATIENCE_S).response == "forward"


def test_without_a_sound_device_the_noise_stays_off_with_one_clear_message(link):
    noise = link.noise(on=True, level=0.0)
    if noise.on:
        link.noise(on=False)
        pytest.skip("this machine has a sound device")
    assert noise.message.startswith("Masking noise stays off: no sound device")
    assert "\n" not in noise.message
    assert link.noise(on=False).message == ""


def test_a_question_that_is_called_off_leaves_the_screen_ready_for_the_next(ask, hands, link):
    answer = ask(SCALE)
    assert link.cancel()
    with pytest.raises(ParticipantError, match="called off"):
        answer.result(PATIENCE_S)
    again = ask(SCALE)
    hands.key("End")
    hands.key("Return")
    assert again.result(PATIENCE_S).rating == 10.0


def test_a_window_that_is_closed_in_mid_question_ends_it_with_an_error(ask, hands, link):
    answer = ask(SCALE)
    hands.close_window()
    with pytest.raises(ParticipantError, match="window was closed"):
        answer.result(PATIENCE_S)


def test_a_full_screen_in_a_home_that_takes_no_files_opens_and_an_interrupt_from_the_keyboard_is_told(display):
    with started(display, "/proc/no-home", Look(theme="light")) as link:
        assert link.wait_ready(PATIENCE_S).window == f"{WIDTH}x{HEIGHT}"
        os.kill(link.pid, signal.SIGINT)
        with pytest.raises(ParticipantError, match="interrupted from the keyboard"):
            link.ask_rating(SCALE, PATIENCE_S)


def test_without_a_display_the_error_says_so(tmp_path):
    with started(":999", tmp_path) as link, pytest.raises(ParticipantError, match=r"NoSuchDisplay|display"):
        link.wait_ready(PATIENCE_S)
