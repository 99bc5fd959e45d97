"""The link against small real programs that speak, stammer, hang and die."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import pytest

from experiments.screens.participant.link import Mailbox, ParticipantError, ParticipantLink
from experiments.screens.participant.messages import (
    AskChoice,
    AskDescription,
    AskRating,
    DescriptionGiven,
    KeyedAnswer,
    RatingGiven,
)
from tests.waiting import PATIENCE_S, wait_for

SCALE = AskRating(
    number=1, of=3, question='"?"\n很', minimum=0, maximum=10, minimum_text="low", maximum_text="high", grain=0.1
)
WORDS = AskDescription(number=1, of=3, question='"?"\n很')
WHICH = AskChoice(
    question="?",
    answers=(
        KeyedAnswer(answer="forward", label="forward", key="f"),
        KeyedAnswer(answer="backward", label="backward", key="b"),
    ),
    onset_s=0.0,
)

CHILD = """
import json, os, sys, time
step_s = 0.0
def now(): return time.monotonic() + 1000 + step_s
def say(**word): print(json.dumps(word), flush=True)
def ready(): say(kind="ready", psychopy="none", window="1x1", refresh_Hz=None)
def rate(word, rating=0): say(kind="rating-given", rating=rating, ask=word["ask"])
def describe(word): say(kind="description-given", comment=word["question"], ask=word["ask"])
def direct(word): say(kind="choice-given", response="backward", pressed_s=word["onset_s"] + 0.5, ask=word["ask"])
def words():
    for line in sys.stdin:
        word = json.loads(line)
        if word["kind"] == "ping": say(kind="pong", sent_s=word["sent_s"], there_s=now())
        elif word["kind"] == "close": sys.exit()
        else: yield word
"""


@pytest.fixture
def child():
    links = []

    def start(program: str) -> ParticipantLink:
        links.append(ParticipantLink.start(command=[sys.executable, "-c", CHILD + program]))
        return links[-1]

    yield start
    for link in links:
        link.close()


def test_a_rating_of_0_and_any_text_come_through(child):
    link = child("ready()\nfor word in words(): {'ask-rating': rate, 'ask-description': describe}[word['kind']](word)")
    assert link.wait_ready(PATIENCE_S).psychopy == "none"
    rated, described = link.ask_rating(SCALE, PATIENCE_S), link.ask_description(WORDS)
    assert rated == RatingGiven(rating=0.0, ask=rated.ask)
    assert described == DescriptionGiven(comment='"?"\n很', ask=described.ask)
    assert described.ask > rated.ask


def test_a_description_that_is_called_off_is_not_taken_for_the_next_one(child):
    link = child(
        "ready()\nasked = []\n"
        "for word in words():\n"
        "    if word['kind'] == 'ask-description': asked.append(word)\n"
        "    if len(asked) == 2: asked[0]['question'] = 'late'; describe(asked[0]); describe(asked[1])"
    )
    link.wait_ready(PATIENCE_S)
    with while_asking(link, link.cancel), pytest.raises(ParticipantError, match="called off"):
        link.ask_description(WORDS)
    assert link.ask_description(WORDS).comment == WORDS.question


def test_moments_are_mapped_there_and_back(child):
    link = child("ready()\nfor word in words(): direct(word)")
    link.wait_ready(PATIENCE_S)
    onset_s = time.monotonic()
    given = link.ask_choice(replace(WHICH, onset_s=onset_s))
    assert given.response == "backward"
    assert given.pressed_s == pytest.approx(onset_s + 0.5, abs=1e-6)
    clocks = link.map_clocks()
    assert clocks.offset_s == pytest.approx(1000, abs=clocks.uncertainty_s)


def fields(word):
    return {name: getattr(word, name) for name in word.__slots__}


def test_a_clock_that_is_set_in_mid_question_spoils_the_time_and_is_said(child):
    link = child("ready()\nfor word in words():\n    step_s = 3600.0\n    direct(word)")
    link.wait_ready(PATIENCE_S)
    with pytest.raises(ParticipantError, match=r"clock was set by (3599|3600)\.\d+ s.*'backward'"):
        link.ask_choice(WHICH)


@pytest.mark.slow
def test_a_screen_that_is_never_ready_is_not_waited_for_longer_than_said(child):
    link = child("time.sleep(600)")
    with pytest.raises(ParticipantError, match=r"no answer within 0\.3 s"):  # not how the screen ended
        link.wait_ready(0.3)


@pytest.mark.slow
def test_a_late_answer_is_never_taken_for_that_of_the_next_question(child):
    link = child(
        "ready()\nasked = []\n"
        "for word in words():\n"
        "    if word['kind'] == 'ask-rating': asked.append(word)\n"
        "    if len(asked) == 2: rate(asked[0], 1); rate(asked[1], 2); asked.clear()"
    )
    link.wait_ready(PATIENCE_S)
    with pytest.raises(ParticipantError, match="no answer within"):
        link.ask_rating(SCALE, 0.2)
    assert link.ask_rating(SCALE, PATIENCE_S).rating == 2


@pytest.mark.slow
def test_a_question_that_got_no_answer_is_taken_off_the_screen(child):
    link = child(
        "ready()\nfor word in words():\n    if word['kind'] == 'show': say(kind='failed', message='taken off')"
    )
    link.wait_ready(PATIENCE_S)
    with pytest.raises(ParticipantError, match="no answer within"):
        link.ask_rating(SCALE, 0.2)
    with pytest.raises(ParticipantError, match="taken off"):
        link.ask_rating(SCALE, PATIENCE_S)


def test_garbage_is_a_failure_that_shows_it(child):
    link = child("ready()\nfor word in words(): print('ALSA lib pcm.c', flush=True)")
    link.wait_ready(PATIENCE_S)
    with pytest.raises(ParticipantError, match=r"no word.*ALSA lib"):
        link.ask_rating(SCALE, PATIENCE_S)
    with pytest.raises(ParticipantError, match="ALSA lib"):
        link.ask_rating(SCALE, PATIENCE_S)


def test_a_screen_that_dies_tells_its_last_words(child):
    link = child("ready()\nfor word in words():\n    sys.exit('out of\\nmemory')")
    link.wait_ready(PATIENCE_S)
    with pytest.raises(ParticipantError, match="ended with exit code 1; its last words: memory"):
        link.ask_rating(SCALE, PATIENCE_S)


def test_a_screen_that_dies_tells_its_last_words_on_windows_too(child, monkeypatch):
    monkeypatch.delattr(os, "pread")  # without which nobody would hear that the screen is gone
    test_a_screen_that_dies_tells_its_last_words(child)


@contextmanager
def while_asking(link, act):
    """Has something done by another thread once the question is open."""

    def wait_and_act():
        wait_for(lambda: link.asking)
        act()

    thread = threading.Thread(target=wait_and_act)
    thread.start()
    yield
    thread.join()


def test_a_screen_that_is_killed_in_mid_question_is_noticed(child):
    link = child("ready()\nfor word in words(): pass")
    link.wait_ready(PATIENCE_S)
    with (
        while_asking(link, lambda: os.kill(link.pid, signal.SIGKILL)),
        pytest.raises(ParticipantError, match="killed by signal 9"),
    ):
        link.ask_rating(SCALE)
    assert "signal 9" in link.failure


@pytest.mark.slow
def test_a_screen_that_stands_still_while_nothing_is_asked_is_ended_and_told(child):
    link, told = child("ready()\nfor word in words(): say(kind='beat', within_s=1)"), []
    link.wait_ready(PATIENCE_S)
    link.listen(lambda _: None, told.append)
    link.show("Please wait")
    wait_for(lambda: told)
    assert told == ["the participant's screen stood still for 1 s and was ended"]
    link.close()
    assert len(told) == 1


def test_of_two_threads_that_find_the_screen_gone_one_tells_of_it():
    """That which reads its words, and that which waits for its beats."""
    mail = Mailbox()
    with ThreadPoolExecutor() as threads:
        first = [*threads.map(mail.fail, ["it ended", "it stood still"])]
    assert sorted(first) == [False, True]
    assert mail.failure == ("it ended" if first[0] else "it stood still")


@pytest.mark.slow
def test_what_the_screen_itself_fails_at_is_told(child):
    link = child("say(kind='failed', message='the window was closed')\ntime.sleep(600)")
    with pytest.raises(ParticipantError, match="the window was closed"):
        link.wait_ready(PATIENCE_S)


@pytest.mark.parametrize("way", ["cancel", "show", "close"])
def test_a_question_can_be_called_off_from_another_thread(child, way):
    link = child("ready()\nfor word in words(): pass")
    link.wait_ready(PATIENCE_S)
    call_off = {"cancel": link.cancel, "show": lambda: link.show("Please wait"), "close": link.close}[way]
    with while_asking(link, call_off), pytest.raises(ParticipantError, match=r"called off|closed by the console"):
        link.ask_rating(SCALE)


def test_there_is_nothing_to_call_off_when_nothing_is_asked(child):
    link = child("ready()\nfor word in words(): rate(word)")
    link.wait_ready(PATIENCE_S)
    link.ask_rating(SCALE, PATIENCE_S)
    assert link.cancel() is False
    assert link.ask_rating(SCALE, PATIENCE_S).rating == 0


def test_after_a_question_was_called_off_the_next_is_answered(child):
    link = child("ready()\nfor word in words():\n    if word.get('number') == 2: rate(word)")
    link.wait_ready(PATIENCE_S)
    with while_asking(link, link.cancel), pytest.raises(ParticipantError, match="called off"):
        link.ask_rating(SCALE)
    assert link.ask_rating(AskRating(**fields(SCALE) | {"number": 2}), PATIENCE_S).rating == 0


@pytest.mark.slow
def test_a_screen_that_reads_nothing_keeps_nobody_waiting_and_is_killed(child, monkeypatch):
    monkeypatch.setattr("experiments.screens.participant.process.END_S", 1.0)
    link = child("import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); ready(); time.sleep(600)")
    with pytest.raises(ParticipantError, match="no answer within"):
        link.ask_rating(AskRating(**fields(SCALE) | {"question": "long " * 100_000}), 0.5)
    link.close()
    with pytest.raises(ProcessLookupError):  # it would have lived for ten minutes
        os.kill(link.pid, 0)


def test_a_screen_that_is_closed_answers_nothing_more_and_may_be_closed_again(child):
    link = child("ready()\nfor word in words(): rate(word)")
    link.wait_ready(PATIENCE_S)
    link.close()
    link.close()
    with pytest.raises(ParticipantError, match="closed by the console"):
        link.ask_rating(SCALE)


def test_a_program_that_is_not_there_is_one_clear_error():
    with pytest.raises(ParticipantError, match=r"cannot be started.*no-such-program"):
        ParticipantLink.start(command=["no-such-program"])


@pytest.mark.slow
def test_importing_the_link_imports_no_psychopy():
    code = "import sys, experiments.screens.participant.link; sys.exit('psychopy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
