"""What stands on the participant's screen follows the run: the words that reach its program."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.catalogues.messages import ENGLISH_MESSAGES, ParticipantMessages, translated
from experiments.design import planning
from experiments.live_run import LiveRun
from experiments.load import load_setup
from experiments.run_request import RunRequest
from experiments.screens.console.participant_link import PAUSED, ParticipantSide
from experiments.screens.console.participant_opening import look_of
from experiments.screens.console.view import Message, ParticipantSeen, Trouble
from experiments.screens.participant.link import ParticipantLink
from experiments.screens.participant.messages import (
    BETWEEN,
    EmergencyPressed,
    Focused,
    Minimised,
    NoiseBroken,
    NoiseEnded,
    NoiseIs,
    line,
)
from experiments.screens.texts import ordinal, place_text
from experiments.session.events import Answer, Rating
from experiments.session.judging import MINIMISED
from experiments.session.remarks import Noted
from experiments.session.states import Position, State
from experiments.session.steps import Asking
from experiments.tasks.questions import choices
from tests.asked import ask, describe, rate
from tests.at_controls import PREFERENCE, sat
from tests.waiting import PATIENCE_S, wait_for

SETUP = load_setup("preference")
PROGRAM = """
import json, sys
with open(sys.argv[1], 'wb') as told:
    for line in sys.stdin.buffer:
        word = json.loads(line)
        if word["kind"] == "ping":
            print(json.dumps({"kind": "pong", "sent_s": word["sent_s"], "there_s": word["sent_s"]}), flush=True)
            continue
        told.write(line)
        told.flush()
"""
PLAN = planning.plan_of(SETUP.config, "P01", 1)
TRIAL = PLAN.trials[0]
STEP = rate(TRIAL)


class Told:
    """A participant's screen whose program writes down what it is told, and answers nothing that is asked."""

    def __init__(self, folder: Path, said: ParticipantMessages = ENGLISH_MESSAGES) -> None:
        self._file = folder / "told"
        self.link = ParticipantLink.start(command=(sys.executable, "-c", PROGRAM, str(self._file)))
        self.side = ParticipantSide(self.link, lambda: self.link, SETUP, rates=True, own_keys=False, said=said)
        self.side.plan = PLAN

    def at(self, serial: int, *states: State, step: Asking = STEP) -> None:
        self.side.follow(Position(states=states, serial=serial, number=3, step=step))

    @property
    def words(self) -> list[str]:
        """The questions by their kind, and the texts."""
        return [word.get("text", word["kind"]) for word in self.all]

    @property
    def all(self) -> list[dict[str, Any]]:
        """What was told, in full."""
        lines = self._file.read_bytes().split(b"\n")[:-1] if self._file.exists() else []
        return [json.loads(line) for line in lines]

    def end(self) -> list[str]:
        """What was told until the end."""
        self.link.show("end")
        wait_for(lambda: "end" in self.words)
        return self.words


@pytest.fixture
def told(tmp_path: Path) -> Iterator[Told]:
    told = Told(tmp_path)
    yield told
    told.link.close()


def test_a_position_that_is_told_late_takes_no_question_off_the_participants_screen(told: Told) -> None:
    told.at(7, State.RATING)
    wait_for(lambda: told.words)
    told.at(6, State.SAVING)
    assert told.link.asking
    assert told.end() == ["ask-rating", "end"]


@pytest.mark.slow
def test_what_takes_a_question_off_the_participants_screen_stays_on_it(told: Told) -> None:
    for serial in range(0, 100, 2):
        told.at(serial, State.RATING)
        wait_for(lambda: told.link.asking)
        told.at(serial + 1, State.RATING, State.PAUSED)
        wait_for(lambda: not any(thread.name == "participant" for thread in threading.enumerate()))
    shown = told.end()
    assert "" not in shown
    assert shown[-2:] == ["Paused. Please wait.", "end"]


def test_between_a_rating_and_its_description_the_participants_window_keeps_the_keys_but_not_in_a_pause(
    told: Told,
) -> None:
    described = describe(TRIAL)
    told.at(1, State.RATING)
    wait_for(lambda: told.words == ["ask-rating"])
    told.at(2, State.SAVING)
    told.at(3, State.DESCRIBING, step=described)
    wait_for(lambda: told.words.count("ask-description") == 1)
    told.at(4, State.DESCRIBING, State.PAUSED, step=described)
    told.at(5, State.DESCRIBING, step=described)
    wait_for(lambda: told.words.count("ask-description") == 2)
    told.at(6, State.SAVING, step=described)
    assert told.end() == [
        "ask-rating", BETWEEN, "ask-description", PAUSED, "ask-description", BETWEEN, "end"
    ]  # fmt: skip
    assert {word["text"]: word["keep_keys"] for word in told.all if word["kind"] == "show"} == {
        BETWEEN: True, PAUSED: False, "end": False
    }  # fmt: skip
    asked = next(word for word in told.all if word["kind"] == "ask-description")
    assert (asked["number"], asked["of"], asked["question"]) == (1, 3, "?")


def test_a_page_leaves_the_keys_to_the_console_where_the_one_before_was_answered_there_and_else_takes_them(
    told: Told,
) -> None:
    typed, number = (3, Rating(rating=5.0)), 3
    for step, entered in ((STEP, None), (describe(TRIAL), typed), (STEP, typed), (STEP, (5, typed[1]))):
        told.side.follow(Position(states=(State.RATING,), serial=2 * number, number=number, step=step, entered=entered))
        wait_for(lambda: told.words and told.words[-1].startswith("ask"))
        told.side.follow(Position(states=(State.SAVING,), serial=2 * number + 1, number=number, step=step))
        wait_for(lambda: told.words[-1] == BETWEEN)
        number += 1
    asked = [word["keep_keys"] for word in told.all if word["kind"].startswith("ask")]
    assert asked == [False, True, False, True]


def test_where_an_answer_without_a_page_was_entered_at_the_console_the_next_page_takes_the_keys(told: Told) -> None:
    told.side.follow(Position(states=(State.ASKING,), serial=1, number=3, step=ask(TRIAL)))
    answer = Answer(response="forward", at_s=0.0)
    told.side.follow(Position(states=(State.RATING,), serial=2, number=4, step=STEP, entered=(3, answer)))
    wait_for(lambda: told.words[-1:] == ["ask-rating"])
    assert told.all[-1]["keep_keys"] is False


def test_a_trial_has_one_number_on_the_participants_screen_and_at_the_console_also_in_a_later_session_or_set(
    told: Told,
) -> None:
    plan = planning.plan_of(load_setup("realism").config, "P01", 1)
    trial = plan.trials[7]
    told.side.plan, told.side.own_keys = plan, True
    told.at(1, State.RATING, step=replace(rate(trial), later=False))
    wait_for(lambda: told.words == ["ask-rating"])
    assert (trial.session, place_text(plan, trial)) == (2, "Trial 2 of 6 · set 1 of 1 · session 2 of 2")
    assert (told.all[-1]["number"], told.all[-1]["of"]) == (2, 6)
    told.side.plan = plan = planning.plan_of(load_setup("direction").config, "P01", 1)
    sixth = next(one for one in plan.trials if (one.set, one.trial) == (2, 6))
    told.at(2, State.SAVING)
    told.at(3, State.ASKING, step=replace(ask(sixth), later=True))
    wait_for(lambda: told.words[-1] == "ask-choice")
    assert ordinal(plan, sixth) == "Trial 1 of 5"
    assert told.all[-1]["question"] == "1. Which way?"


def test_an_answer_lies_on_the_side_of_its_key(told: Told) -> None:
    told.side.own_keys = True
    felt = choices(load_setup("detection").config.questions["felt"])
    told.at(1, State.ASKING, step=replace(ask(TRIAL), choices=felt))
    wait_for(lambda: told.words == ["ask-choice"])
    sides = [(one["answer"], one["key"]) for one in told.all[-1]["answers"]]
    assert sides == [("no", "left"), ("yes", "right")]
    told.at(2, State.PREPARING)
    told.at(3, State.ASKING, step=ask(TRIAL))
    wait_for(lambda: told.words.count("ask-choice") == 2)
    assert [one["answer"] for one in told.all[-1]["answers"]] == ["forward", "backward"]


def test_what_stands_between_questions_is_in_the_participants_language(tmp_path: Path) -> None:
    said = translated(lambda text: f"¿{text}")
    told = Told(tmp_path, said)
    told.at(1, State.PREPARING)
    told.at(2, State.RATING)
    wait_for(lambda: "ask-rating" in told.words)
    told.at(3, State.SAVING)
    told.at(4, State.RATING, State.PAUSED)
    told.at(5, State.CLOSING)
    assert told.end() == ["ask-rating", said.between, said.paused, said.thanks, "end"]
    told.link.close()


def test_whose_the_keys_are_is_told_also_if_it_was_said_before_anybody_listened() -> None:
    word = line(Focused(on=True)).decode().strip()
    program = f"import sys, time; print({word!r}, flush=True); sys.stdin.read()"
    heard: list[object] = []
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    try:
        wait_for(lambda: link.focused)
        link.listen(heard.append, lambda _: None)
    finally:
        link.close()
    assert heard == [Focused(on=True)]


@pytest.mark.slow
def test_noise_that_ended_before_anybody_listened_is_said_once_the_run_begins(tmp_path: Path) -> None:
    word = line(NoiseEnded(message="Masking noise has ended")).decode().strip()
    program = f"import sys, time; print({word!r}, flush=True); sys.stdin.read()"
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    told: list[Message] = []
    try:
        wait_for(lambda: link.noise_ended)
        with sat(SETUP, tmp_path) as sitting:
            beside(link).begin(sitting.live, told.append)
            assert notes(sitting.live) == ["Masking noise plays.", "Masking noise has ended"]
    finally:
        link.close()
    assert [one.noise_off for one in told if isinstance(one, ParticipantSeen)][-1]
    assert [one.text for one in told if isinstance(one, Trouble)] == ["Masking noise has ended"]


def test_noise_that_goes_with_the_participants_screen_is_said_shown_and_on_record(tmp_path: Path) -> None:
    link = ParticipantLink.start(command=(sys.executable, "-c", "import sys; sys.stdin.read()"))
    told: list[Message] = []
    try:
        with sat(SETUP, tmp_path) as sitting:
            beside(link).begin(sitting.live, told.append)
            assert not [one for one in told if isinstance(one, ParticipantSeen)][-1].noise_off
            os.kill(link.pid, signal.SIGKILL)
            wait_for(lambda: len(notes(sitting.live)) > 1)
            ended = "Masking noise has ended with the participant's screen, and begins again with it."
            assert notes(sitting.live) == ["Masking noise plays.", ended]
            assert sitting.live.position.state is State.PAUSED
    finally:
        link.close()
    assert [one for one in told if isinstance(one, ParticipantSeen)][-1].noise_off
    assert [one.text for one in told if isinstance(one, Trouble)] == [ended]


@pytest.mark.slow
def test_noise_begins_again_with_the_participants_screen_also_if_the_run_has_gone_on_to_a_question(
    tmp_path: Path,
) -> None:
    first = ParticipantLink.start(command=(sys.executable, "-c", "import sys; sys.stdin.read()"))
    again, go = ParticipantLink.start(command=(sys.executable, "-c", PLAYS)), threading.Event()
    side = beside(first, lambda: again if go.wait(PATIENCE_S) else first)
    try:
        with sat(PREFERENCE, tmp_path) as sitting:

            def tell(message: Message) -> None:
                if isinstance(message, Trouble) and "there again" in message.text:
                    side.follow(sitting.position)  # as the console does at any moment
                    wait_for(lambda: again.asking)

            sitting.to(State.RATING)
            side.begin(sitting.live, tell)
            os.kill(first.pid, signal.SIGKILL)
            wait_for(lambda: sitting.state is State.PAUSED)
            side.restart()
            sitting.press("P")
            go.set()
            wait_for(lambda: len(notes(sitting.live)) > 3)
            assert notes(sitting.live)[2:] == ["Masking noise plays.", "The participant's screen was started again."]
    finally:
        first.close()
        again.close()


def test_noise_that_may_have_broken_off_is_said_and_on_record(tmp_path: Path) -> None:
    word = line(NoiseBroken(stood_still_s=1.26)).decode().strip()
    program = f"import sys; sys.stdin.readline(); print({word!r}, flush=True); sys.stdin.read()"
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    told: list[Message] = []
    try:
        with sat(SETUP, tmp_path) as sitting:
            beside(link).begin(sitting.live, told.append)
            link.show("go")
            wait_for(lambda: len(notes(sitting.live)) > 1)
            broken = "Masking noise may have broken off for 1.3 s: the program that plays it stood still."
            assert notes(sitting.live) == ["Masking noise plays.", broken]
    finally:
        link.close()
    assert [one.text for one in told if isinstance(one, Trouble)] == [broken]
    assert not any(one.noise_off for one in told if isinstance(one, ParticipantSeen))


HIDDEN, SHOWN = (line(Minimised(on=on)).decode().strip() for on in (True, False))


def test_a_window_that_is_minimised_pauses_the_run_until_it_is_seen_again_also_if_it_was_so_before(
    tmp_path: Path,
) -> None:
    program = f"import sys; print({HIDDEN!r}, flush=True)\nfor _ in sys.stdin: print({SHOWN!r}, flush=True)"
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    told: list[Message] = []
    try:
        with sat(PREFERENCE, tmp_path) as sitting:
            side = ParticipantSide(link, lambda: link, PREFERENCE, rates=True, own_keys=False)
            side.begin(sitting.live, told.append)
            wait_for(lambda: sitting.state is State.PAUSED)
            assert (sitting.position.why, sitting.live.minimised) == (MINIMISED, True)
            link.show("Please wait")
            again = "The participant's window is seen again."
            wait_for(lambda: [one.text for one in told if isinstance(one, Trouble)] == [MINIMISED, again])
            assert (sitting.state, sitting.position.why, sitting.live.minimised) == (State.PAUSED, "", False)
            assert notes(sitting.live) == [again]
    finally:
        link.close()


def test_a_window_on_which_nothing_is_asked_may_be_minimised(tmp_path: Path) -> None:
    said = f"{HIDDEN}\n" + line(Focused(on=False)).decode().strip()
    program = f"import sys; print({said!r}, flush=True); sys.stdin.read()"
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    try:
        wait_for(lambda: link.focused)
        with sat(SETUP, tmp_path) as sitting:
            side = ParticipantSide(link, lambda: link, SETUP, rates=False, own_keys=False)
            side.begin(sitting.live, lambda _: None)
            assert State.PAUSED not in sitting.position.states
            assert not sitting.live.minimised
    finally:
        link.close()


@pytest.mark.slow
def test_a_minimised_window_whose_program_is_gone_holds_nothing_any_more(tmp_path: Path) -> None:
    program = f"import sys; print({HIDDEN!r}, flush=True); sys.stdin.read()"
    link = ParticipantLink.start(command=(sys.executable, "-c", program))
    try:
        with sat(PREFERENCE, tmp_path) as sitting:
            side = ParticipantSide(link, lambda: link, PREFERENCE, rates=True, own_keys=False)
            side.begin(sitting.live, lambda _: None)
            wait_for(lambda: sitting.live.minimised)
            os.kill(link.pid, signal.SIGKILL)
            wait_for(lambda: not sitting.live.minimised)
    finally:
        link.close()


@pytest.mark.slow
def test_f12_on_a_screen_that_was_started_again_is_heard_while_its_noise_is_awaited(tmp_path: Path) -> None:
    first = ParticipantLink.start(command=(sys.executable, "-c", "import sys; sys.stdin.read()"))
    word = line(EmergencyPressed()).decode().strip()
    program = f"import sys; sys.stdin.readline(); print({word!r}, flush=True); sys.stdin.read()"
    again = ParticipantLink.start(command=(sys.executable, "-c", program))
    told: list[Message] = []
    try:
        with sat(PREFERENCE, tmp_path) as sitting:
            side = beside(first, lambda: again)
            side.begin(sitting.live, told.append)
            os.kill(first.pid, signal.SIGKILL)
            wait_for(lambda: sitting.state is State.PAUSED)
            side.restart()
            wait_for(lambda: sitting.state is State.HALTED)
            assert not [one for one in told if isinstance(one, Trouble) and "there again" in one.text]
    finally:
        first.close()
        again.close()


PLAYS = """
import json, sys
for line in sys.stdin:
    word = json.loads(line)
    if word["kind"] == "noise":
        print(json.dumps({"kind": "noise-is", "on": True, "message": "", "ask": word["ask"]}), flush=True)
"""
"""A participant's program that plays noise and answers nothing."""


def beside(link: ParticipantLink, again: Callable[[], ParticipantLink] | None = None) -> ParticipantSide:
    """A participant's screen with noise that plays."""
    playing = NoiseIs(on=True, message="")
    return ParticipantSide(link, again or (lambda: link), SETUP, rates=True, own_keys=False, noise=playing)


def notes(live: LiveRun) -> list[str]:
    """What the record has of its own accord."""
    return [word.text for _, word in live.history if isinstance(word, Noted)]


@pytest.mark.slow
def test_the_program_is_started_again_once_however_often_it_is_asked_for(tmp_path: Path) -> None:
    started: list[ParticipantLink] = []
    go = threading.Event()

    def open_link() -> ParticipantLink:
        assert go.wait(PATIENCE_S)
        started.append(ParticipantLink.start(command=(sys.executable, "-c", PROGRAM, str(tmp_path / "again"))))
        return started[-1]

    first = ParticipantLink.start(command=(sys.executable, "-c", "pass"))
    side, told = ParticipantSide(first, open_link, SETUP, rates=True, own_keys=False), list[Message]()

    def starting() -> bool:
        return [one.starting for one in told if isinstance(one, ParticipantSeen)][-1]

    try:
        with sat(SETUP, tmp_path / "results") as sitting:
            side.begin(sitting.live, told.append)
            wait_for(lambda: first.failure is not None)
            assert side.not_lost == ""
            side.restart()
            assert side.not_lost == "The participant's screen is being started already."
            side.restart()
            assert starting()
            go.set()
            wait_for(lambda: not any(thread.name == "participant again" for thread in threading.enumerate()))
            assert not starting()
            side.restart()
            assert len(started) == 1
    finally:
        side.close()


def test_a_question_whose_time_is_over_before_it_is_asked_is_never_shown(told: Told) -> None:
    for serial in range(0, 100, 2):
        told.at(serial, State.RATING)
        told.at(serial + 1, State.RATING, State.PAUSED)
    wait_for(lambda: not any(thread.name == "participant" for thread in threading.enumerate()))
    shown = told.end()
    assert shown[-2:] == ["Paused. Please wait.", "end"]


@pytest.mark.parametrize(
    ("rooms", "seen"),
    [
        ([(1920, 1040)], (0, False, 1280, 800)),
        ([(1024, 600)], (0, False, 1024, 560)),
        ([(1920, 1080), (1024, 768)], (1, True, 1024, 728)),
    ],
)
def test_of_one_screen_their_window_takes_no_more_than_there_is(
    rooms: list[tuple[int, int]], seen: tuple[int, bool, int, int]
) -> None:
    request = RunRequest(setup=load_setup("preference"), participant_id="P01", results=Path("none"), screen="console")
    look = look_of(request, rooms)
    assert (look.screen, look.full_screen, look.width_px, look.height_px) == seen
