"""The participant's real window under Xvfb, answered by real key and mouse events."""

import os
import signal
import subprocess
import time
from contextlib import closing, contextmanager
from dataclasses import replace

import pytest

from experiments.screens.participant.link import ParticipantError, ParticipantLink
from experiments.screens.participant.messages import (
    CloseScreen,
    Look,
    Noise,
    NoiseIs,
    Ready,
    arguments,
    from_participant_from,
    line,
)
from experiments.screens.xkeys import Hands as XHands
from tests.at_participant import (
    BUTTON_Y,
    FAR_S,
    HEIGHT,
    HINT,
    LEFT_END,
    LINE_Y,
    LOOK,
    OFF_LINE_Y,
    RIGHT_END,
    SCALE,
    WHICH,
    WIDTH,
    WORDS,
    ask,
    console,
    display,
    hands,
    link,
    pytestmark,
    show,
    started,
)
from tests.waiting import PATIENCE_S, stand_still, wait_for
from tests.warm_start import warm

REPEATED_S = 1.2
"""After so long X has repeated a key that is held: it begins after 0.66 s if nobody sets that."""

__all__ = ["ask", "console", "display", "hands", "link", "pytestmark"]


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


def test_each_place_of_a_ranking_has_its_number_and_a_cross_above_it_where_another_one_has_it(ask, hands, link):
    ranking = replace(SCALE, minimum=1.0, maximum=3.0, minimum_text="most", maximum_text="", grain=1.0, distinct=True)
    across = [LEFT_END + (RIGHT_END - LEFT_END) * part for part in (0, 0.5, 1)]
    for taken, crosses in (((), [False, False, False]), ((2.0, 3.0), [False, True, True])):
        answer = ask(replace(ranking, taken=taken))
        hands.settled()
        seen = [
            [hands.is_drawn_on(x - 0.03, 0.46, x + 0.03, 0.53) for x in across],
            [hands.is_drawn_on(x - 0.01, 0.61, x + 0.01, 0.66) for x in across],
        ]
        type_on(hands, "Home", "Return")
        assert answer.result(PATIENCE_S).rating == 1.0
        assert seen == [crosses, [True, True, True]]


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
def console_window(hands):
    """Another program's window, which has the keys when it is given them and hears of none."""
    from Xlib import X  # it comes with PsychoPy

    root = hands.display.screen().root
    window = root.create_window(0, 0, 9, 9, 0, root.get_geometry().depth)
    window.map()
    yield lambda: (window.set_input_focus(X.RevertToParent, X.CurrentTime), hands.display.sync())
    window.destroy()
    hands.display.sync()


@contextmanager
def held(hands, *names):
    """Some keys are down meanwhile, for so long at first that the last one is repeated."""
    with closing(XHands(hands.display.get_display_name())) as keys:
        for name in names:
            keys.key_down(name)
        time.sleep(REPEATED_S)
        yield
        for name in reversed(names):
            keys.key_up(name)


def test_a_key_held_as_a_scale_takes_the_keys_does_nothing_on_it_until_it_goes_down_again(
    ask, hands, link, console_window
):
    show(link, "Please wait")
    console_window()
    with held(hands, "Up"):
        answer = ask(SCALE)
        time.sleep(REPEATED_S)
        hands.key("Return")
        time.sleep(FAR_S)
        assert not answer.done(), answer.result()
    for name in ("Up", "Up", "Return"):
        hands.key(name)
    assert answer.result(PATIENCE_S).rating == 5.1


def test_a_letter_held_as_a_description_takes_the_keys_is_not_written_in_it(ask, hands, link, console_window):
    show(link, "Please wait")
    console_window()
    with held(hands, "t"):
        answer = ask(WORDS)
        time.sleep(REPEATED_S)
    assert describe(hands, answer, "a", "t") == "at"


def test_what_ends_a_description_is_held_and_does_not_end_the_next_one(ask, hands):
    answer = ask(WORDS)
    with held(hands, "Control_L", "Return"):
        assert answer.result(PATIENCE_S).comment == ""
        answer = ask(replace(WORDS, number=3, draft=1))
        time.sleep(REPEATED_S)
        assert not answer.done(), answer.result()
    assert describe(hands, answer, "b") == "b"


@pytest.fixture
def maps(link, monkeypatch):
    """The mappings of the clocks from now on."""
    kept, map_clocks = [], link.map_clocks
    monkeypatch.setattr(link, "map_clocks", lambda: kept.append(map_clocks()) or kept[-1])
    return kept


def test_a_key_that_goes_down_while_the_program_stands_still_says_for_how_long(
    display, hands, console, tmp_path, monkeypatch
):
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("HOME", str(tmp_path))
    with ParticipantLink.start(Look()) as link:  # the program itself, and nothing in its stead that can be stopped
        link.wait_ready(PATIENCE_S)
        show(link, "Please wait")
        question = replace(WHICH, onset_s=time.monotonic())
        answer = hands.changing(lambda: console.submit(link.ask_choice, question))
        stand_still(link.pid)
        hands.key("f")
        time.sleep(0.5)
        os.kill(link.pid, signal.SIGCONT)
        assert answer.result(PATIENCE_S).stood_still_s > 0.4


@pytest.mark.slow
def test_a_program_that_stands_still_while_nothing_is_asked_is_noticed(display, tmp_path, monkeypatch):
    """Nobody there hears F12 meanwhile, whatever the console says."""
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("HOME", str(tmp_path))
    with ParticipantLink.start(Look()) as link:
        link.wait_ready(PATIENCE_S)
        stand_still(link.pid)
        wait_for(lambda: link.failure)
        assert link.failure == "the participant's screen stood still for 5 s and was ended"


def test_a_key_tells_the_direction_and_when_it_went_down(link, hands, console, maps):
    """After the press and before the answer came, as well as the clocks know; how close to it, `make soak` measures."""
    show(link, "Please wait")
    question = replace(WHICH, onset_s=time.monotonic())
    answer = hands.changing(lambda: console.submit(link.ask_choice, question))
    hands.key("x")
    pressed_s = hands.key("b")
    given, unsure_s = answer.result(PATIENCE_S), maps[0].uncertainty_s
    in_order = [pressed_s - unsure_s, given.pressed_s, time.monotonic() + unsure_s]
    assert given.response == "backward"
    assert in_order == sorted(in_order)


def test_a_digit_of_the_number_pad_is_that_digit(link, hands, console):
    show(link, "Please wait")
    digits = tuple(replace(one, key=key) for one, key in zip(WHICH.answers, "12", strict=True))
    question = replace(WHICH, answers=digits, onset_s=time.monotonic())
    answer = hands.changing(lambda: console.submit(link.ask_choice, question))
    hands.key("KP_2")
    assert answer.result(PATIENCE_S).response == "backward"


def test_a_key_before_the_onset_is_no_answer_but_one_before_the_question_stands_is(link, hands):
    question = replace(WHICH, onset_s=time.monotonic())
    time.sleep(FAR_S)  # farther than the two clocks may be apart: else the key may seem to be before the onset
    hands.key("b")
    before = link.ask_choice(question)
    time.sleep(2 * FAR_S)
    hands.key("f")
    given = link.ask_choice(replace(question, onset_s=before.pressed_s + FAR_S))
    assert (before.response, given.response) == ("backward", "forward")
    assert given.pressed_s > before.pressed_s + FAR_S


def test_after_a_pause_a_key_counts_once_the_question_stands_there_again(link, hands, console):
    show(link, "Paused")
    question = replace(WHICH, onset_s=time.monotonic(), once_seen=True)
    time.sleep(FAR_S)
    hands.key("b")
    answer = hands.changing(lambda: console.submit(link.ask_choice, question))
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


def test_the_program_ends_by_itself_though_its_sound_device_stands_still(display, tmp_path):
    sink, pid = tmp_path / "sink", tmp_path / "pid"
    sink.write_text(f"#!/bin/sh\necho $$ > {pid}\nexec cat > /dev/null\n")
    sink.chmod(0o700)
    (tmp_path / ".asoundrc").write_text(
        f'pcm.!default {{ type file slave.pcm {{ type null }} file "|exec {sink}" format raw }}\n'
    )
    program = subprocess.Popen(
        warm("-m", "experiments.screens.participant", *arguments(LOOK)),
        env=os.environ | {"DISPLAY": display, "HOME": str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    said = (from_participant_from(line) for line in program.stdout)
    try:
        next(word for word in said if isinstance(word, Ready))
        program.stdin.write(line(Noise(on=True)))
        program.stdin.flush()
        noise = next(word for word in said if isinstance(word, NoiseIs))
        if not noise.on:
            pytest.skip("the sound library does not take its devices from ALSA")
        wait_for(lambda: pid.exists() and pid.read_text().endswith("\n"))
        os.kill(int(pid.read_text()), signal.SIGSTOP)
        time.sleep(FAR_S)  # until the pipe to it is full, and the stream waits
        program.stdin.write(line(CloseScreen()))
        program.stdin.close()
        assert program.wait(PATIENCE_S) == 0
    finally:
        program.kill()
        program.stdout.close()
        program.wait()
        if pid.exists():
            os.kill(int(pid.read_text()), signal.SIGKILL)


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
