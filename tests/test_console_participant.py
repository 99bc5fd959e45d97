"""The console with the participant's real screen beside it, on one virtual display, both worked by real events."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import watched_console
from tests.at_display import AtDisplay, last_record, needs_display, virtual_display, work_console
from tests.conftest import RECOIL
from tests.test_console import DIRECTION, PREFERENCE, answer_by, leave, rows, type_in, watched, words
from tests.test_participant_screen import HINT, Hands
from tests.waiting import wait_for

pytestmark = [
    needs_display,
    pytest.mark.skipif(importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`"),
]
PARTICIPANT = "Recoil: participant"
CONSOLE = "Recoil – P01"
GONE = "Enter the answer here: the participant's screen was killed by signal 9."
LEFT_END, LINE_Y, BUTTON_Y = 0.1428, 0.56, 0.84
MAP_S = 0.5
"""Further than the clocks' mapping is ever wrong."""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def console_stands(screen: AtDisplay, journal: Path) -> None:
    wait_for(lambda: last_record(journal) or screen.process.poll() is not None)
    screen.focus_on(CONSOLE)


def is_at(journal: Path, kind: str, trial: int) -> bool:
    body = last_record(journal).get("body", {})
    return body.get("kind") == kind and body["trial"]["trial"] == trial


def participant_pid(screen: AtDisplay) -> int:
    """The participant's process: the console's child that runs its program."""
    found = subprocess.run(
        ["pgrep", "-P", str(screen.process.pid), "-f", "screens.participant"],
        capture_output=True,
        text=True,
        check=True,
    )
    return int(found.stdout)


def click(screen: AtDisplay, x: float, y: float) -> None:
    """Click on the participant's window at a place in parts of it."""
    place = screen.keys.focus_on(PARTICIPANT)
    assert place is not None
    left, top, width, height = place
    screen.keys.click(left + int(x * width), top + int(y * height))


@pytest.fixture
def eyes(display: str) -> Iterator[Hands]:
    """What the display shows, and which window has the keys there."""
    eyes = Hands(display)
    yield eyes
    eyes.display.close()


def participant_has_keys(eyes: Hands) -> bool:
    """Whether the participant's window has the keys: a page that is typed on takes them, and gives them back."""
    holder = eyes.display.get_input_focus().focus
    return not isinstance(holder, int) and PARTICIPANT in str(holder.get_wm_name())


def page_stands(journal: Path, eyes: Hands, trial: int) -> None:
    """The page of a trial's rating stands on the participant's screen."""
    wait_for(lambda: is_at(journal, "rate", trial) and participant_has_keys(eyes))


def rate_by_mouse(screen: AtDisplay, eyes: Hands) -> None:
    """0 by a click on the scale's left end, then a typed description, ended by the button."""
    screen.focus_on(PARTICIPANT)
    eyes.changing(lambda: click(screen, LEFT_END, LINE_Y))
    eyes.changing(lambda: click(screen, 0.5, BUTTON_Y))
    screen.keys.type("soft")
    eyes.changing(lambda: click(screen, 0.5, BUTTON_Y), *HINT)


def rate_by_keys(screen: AtDisplay, eyes: Hands) -> None:
    """6.1 by keys alone, then a typed description, ended by keys."""
    screen.focus_on(PARTICIPANT)
    for name in ("Right", "Next", "Right", "Return"):
        eyes.changing(lambda name=name: screen.keys.press(name))
    screen.keys.type("hard")
    screen.keys.press("Return", "Control_L")


def fire(screen: AtDisplay, journal: Path, body: dict[str, Any]) -> None:
    """What the experimenter presses until there is something to answer."""
    if body["kind"] in ("prepare", "present"):
        answer_by(screen, body)


def until(screen: AtDisplay, journal: Path, kind: str, trial: int) -> None:
    """Fire until a trial's question stands, on the participant's screen as well."""

    def stands() -> bool:
        if not is_at(journal, kind, trial):
            work_console(screen, journal, lambda body: fire(screen, journal, body), timeout_s=0.2)
        return is_at(journal, kind, trial)

    wait_for(stands, lambda: f"{kind} of trial {trial} did not come: {last_record(journal)}")


def enter_rating(screen: AtDisplay, journal: Path, trial: int) -> None:
    """The experimenter's rating and the description they are told."""
    for kind, text in (("rate", "7.5\n"), ("describe", "like a toy\n")):
        wait_for(lambda kind=kind: is_at(journal, kind, trial))
        type_in(screen, last_record(journal)["body"], text)


def plays_sound(home: Path) -> bool:
    """Whether there is a device for the noise, as the sound library says in a process of its own."""
    ask = "import sounddevice; sounddevice.check_output_settings(channels=2, samplerate=44_100)"
    environment = os.environ | {"HOME": str(home)}
    asked = subprocess.run([sys.executable, "-c", ask], env=environment, capture_output=True, check=False)
    return asked.returncode == 0


def told_at_hand_over(eye: Path, start: str) -> list[str]:
    """What stands in the console's window at a hand-over and starts so."""
    hand_overs = [texts for texts in watched_console.seen(eye) if any(text.startswith("Turn the") for text in texts)]
    return [text for texts in hand_overs for text in texts if text.startswith(start)]


def check_noise_is_told_of(eye: Path, home: Path) -> None:
    """At the hand-over the console says why the noise stays off if nothing can play it, and else nothing."""
    wait_for(lambda: told_at_hand_over(eye, "Turn the"))
    if plays_sound(home):
        assert not told_at_hand_over(eye, "Masking noise")
    else:
        wait_for(lambda: told_at_hand_over(eye, "Masking noise stays off: no sound device"))
        assert "Connect headphones" in told_at_hand_over(eye, "Masking noise")[0]


def kill_participants_process(screen: AtDisplay, eye: Path) -> None:
    """The console says that the participant's screen is gone and where the answer goes now, and not before."""
    assert not any(GONE in texts for texts in watched_console.seen(eye))
    os.kill(participant_pid(screen), signal.SIGKILL)
    wait_for(lambda: GONE in watched_console.seen(eye)[-1])


def test_two_ratings_by_the_participants_own_hand_and_one_entered_for_them(
    quick_configs: Path, tmp_path: Path, display: str, eyes: Hands
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    run = watched(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtDisplay(run, tmp_path, display) as screen:
        console_stands(screen, journal)
        until(screen, journal, "rate", 1)
        page_stands(journal, eyes, 1)
        rate_by_mouse(screen, eyes)
        page_stands(journal, eyes, 2)
        screen.focus_on(CONSOLE)
        enter_rating(screen, journal, 2)
        page_stands(journal, eyes, 3)
        rate_by_keys(screen, eyes)
        wait_for(lambda: last_record(journal)["kind"] == "finished")
        wait_for(lambda: not participant_has_keys(eyes))
        leave(screen)
        code, said = screen.end()
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [row["rating"] for row in table] == ["0.0", "7.5", "6.1"]
    assert [row["rating_by"] for row in table] == ["participant", "experimenter", "participant"]
    assert [row["comment"] for row in table] == ["soft", "like a toy", "hard"]


def test_a_participants_key_is_a_response_time_and_a_killed_participants_process_loses_nothing(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal, eye = tmp_path / f"{DIRECTION}_journal.jsonl", tmp_path / "seen.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys", "--noise")
    pressed_s: list[float] = []
    with AtDisplay(watched_console.words(eye, run), tmp_path, display) as screen:
        console_stands(screen, journal)
        check_noise_is_told_of(eye, tmp_path)
        for trial, key in enumerate(("Up", "Down"), 1):
            until(screen, journal, "ask", trial)
            pressed_s.append(screen.keys.press(key))
        until(screen, journal, "ask", 3)
        time.sleep(0.3)
        kill_participants_process(screen, eye)
        screen.keys.press("f")
        wait_for(lambda: is_at(journal, "prepare", 4))
        screen.keys.press("F12")
        wait_for(lambda: last_record(journal)["kind"] == "stopped")
        leave(screen)
        code, said = screen.end()
    assert code == 130, said
    first, second, third, *_ = rows(tmp_path, DIRECTION, "trials")
    assert [row["response"] for row in (first, second, third)] == ["forward", "backward", "forward"]
    assert [row["response_source"] for row in (first, second, third)] == ["participant"] * 2 + ["experimenter"]
    assert [row["response_time_valid"] for row in (first, second, third)] == ["1", "1", "0"]
    answered_s = [
        record["monotonic_s"] for record in records(journal) if record.get("body", {}).get("kind") == "answered"
    ]
    for row, key_s, onset_s, after_s in zip((first, second), pressed_s, onsets_s(journal), answered_s, strict=False):
        in_order = [key_s - MAP_S, onset_s + float(row["response_time_s"]), after_s + MAP_S]
        assert in_order == sorted(in_order)  # how close to the press a key's time is, `make soak` measures


def test_of_a_masking_noise_that_plays_the_console_says_nothing(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    (tmp_path / ".asoundrc").write_text("pcm.!default { type null }\n")  # a device without a sound
    if not plays_sound(tmp_path):
        pytest.skip("the sound library does not take its devices from ALSA")
    journal, eye = tmp_path / f"{DIRECTION}_journal.jsonl", tmp_path / "seen.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--noise")
    with AtDisplay(watched_console.words(eye, run), tmp_path, display) as screen:
        console_stands(screen, journal)
        check_noise_is_told_of(eye, tmp_path)
        assert '"Masking noise plays."' in journal.read_text()
        screen.keys.press("F12")
        wait_for(lambda: last_record(journal)["kind"] == "stopped")
        leave(screen)
        code, said = screen.end()
    assert code == 130, said


def onsets_s(journal: Path) -> list[float]:
    """When the shots began, on the machine's monotonic clock."""
    bodies = [record.get("body", {}) for record in records(journal)]
    return [body["pulse_start_s"] for body in bodies if body.get("kind") == "fired"]


def records(journal: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in journal.read_text().splitlines()]


def test_a_participants_process_killed_in_mid_rating_leaves_the_answer_to_the_experimenter(
    quick_configs: Path, tmp_path: Path, display: str, eyes: Hands
) -> None:
    journal, eye = tmp_path / f"{PREFERENCE}_journal.jsonl", tmp_path / "seen.jsonl"
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtDisplay(watched_console.words(eye, run), tmp_path, display) as screen:
        console_stands(screen, journal)
        until(screen, journal, "rate", 1)
        page_stands(journal, eyes, 1)
        click_scale_only(screen)
        kill_participants_process(screen, eye)
        wait_for(lambda: screen.keys.focus_on(PARTICIPANT) is None)
        screen.focus_on(CONSOLE)  # as a window manager does when the window with the keys is gone
        for trial in (1, 2, 3):
            enter_rating(screen, journal, trial)
        wait_for(lambda: last_record(journal)["kind"] == "finished")
        leave(screen)
        code, said = screen.end()
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [(row["rating"], row["rating_by"]) for row in table] == [("7.5", "experimenter")] * 3


def click_scale_only(screen: AtDisplay) -> None:
    """A marker that is not confirmed yet."""
    click(screen, LEFT_END, LINE_Y)


def test_a_synthetic_participant_rates_on_the_participants_screen_as_in_data_mode(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "preference", "--participant", "P01", "--visual", "--participant-screen")
    with AtDisplay(run, tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 0, said
    data = [RECOIL, "run", quick_configs / "preference.toml", "--participant", "P01", "--seed", "1"]
    subprocess.run([*data, "--screen", "synthetic", "--results", "data"], cwd=tmp_path, check=True, capture_output=True)
    seen = rows(tmp_path, PREFERENCE, "ratings")
    expected = rows(tmp_path, re.sub("^results", "data", PREFERENCE), "ratings")
    for column in ("rating", "rating_by", "comment"):
        assert [row[column] for row in seen] == [row[column] for row in expected]


def test_where_there_is_no_x_the_synthetic_rating_is_refused_with_one_message(
    quick_configs: Path, tmp_path: Path
) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    run = words(quick_configs, "preference", "--participant", "P01", "--visual", "--participant-screen")
    done = subprocess.run(
        [str(word) for word in run],
        cwd=tmp_path,
        env=environment | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("recoil: --visual --participant-screen rates by synthetic events, which only an X")
    assert done.stderr.count("\n") == 1
