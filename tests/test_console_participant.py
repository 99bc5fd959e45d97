"""The console with the participant's real screen beside it, on one virtual desktop, both worked by real events."""

from __future__ import annotations

import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from string import ascii_lowercase

import pytest

from tests.at_display import (
    AtConsole,
    AtDisplay,
    check_disarmed,
    needs_display,
    records,
    remarks,
    taken_keyboard,
    virtual_display,
)
from tests.at_runs import DIRECTION, PREFERENCE, RUN, rows, words
from tests.waiting import stand_still, wait_for
from tests.warm_start import warm
from tests.watched_console import Watch

pytestmark = [
    pytest.mark.slow,
    needs_display,
    pytest.mark.skipif(importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`"),
]
PARTICIPANT = "Recoil: participant"
LEFT_END, LINE_Y, BUTTON_Y = 0.1428, 0.56, 0.84
CLOCKS_S = 0.05
"""How far the two programs' clocks may lie apart, as they are mapped."""


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display("1400x900") as name:  # the participant's window is there as a whole
        yield name


def click(screen: AtDisplay, x: float, y: float) -> None:
    """Click on the participant's window at a place in parts of it."""
    left, top, width, height = screen.focus_on(PARTICIPANT)
    screen.keys.click(left + int(x * width), top + int(y * height))


def rate_by_mouse(screen: AtConsole) -> None:
    """0 by a click on the scale's left end, then a typed description, ended by the button."""
    click(screen, LEFT_END, LINE_Y)
    click(screen, 0.5, BUTTON_Y)
    screen.participant_shows("DescriptionPage")
    screen.keys.type("soft")

    def clicked_again() -> bool:  # a click soon after the page came may be the second one on Confirm, and is none
        click(screen, 0.5, BUTTON_Y)
        return screen.look().state != "describing"

    wait_for(clicked_again, "the description does not end")


def rate_by_keys(screen: AtConsole) -> None:
    """6.1 by keys alone, then a typed description, ended by keys."""
    screen.focus_on(PARTICIPANT)
    for name in ("Right", "Next", "Right", "Return"):
        screen.keys.press(name)
    screen.participant_shows("DescriptionPage", 3)
    screen.keys.type("hard")
    screen.keys.press("Return", "Control_L")


def rate_here(screen: AtConsole) -> None:
    """The experimenter's rating and the description they are told, although the participant's screen asks for both.

    They type the one behind the other: the page to describe it on takes no key of that.
    """
    screen.until(lambda look: look.active)
    before = len(screen.watch.looks())
    screen.go_on(screen.at("rating"))
    screen.participant_shows("DescriptionPage", 2)
    screen.go_on(screen.at("describing"))
    assert all(look.active for look in screen.watch.looks()[before:] if look.state == "describing")


def plays_sound(home: Path) -> bool:
    """Whether there is a device for the noise, as the sound library says in a process of its own."""
    ask = "import sounddevice; sounddevice.check_output_settings(channels=2, samplerate=44_100)"
    environment = os.environ | {"HOME": str(home)}
    asked = subprocess.run([sys.executable, "-c", ask], env=environment, capture_output=True, check=False)
    return asked.returncode == 0


def told_of_noise(screen: AtConsole) -> list[str]:
    """What the console's window said of the noise so far."""
    return [text for look in screen.watch.looks() for text in look.texts if text.startswith("Masking noise")]


def test_two_ratings_by_the_participants_own_hand_and_one_entered_for_them(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        screen.participant_shows("RatingPage")
        rate_by_mouse(screen)
        screen.until(lambda look: look.state == "rating" and look.trial == 2)
        screen.participant_shows("RatingPage", 2)
        screen.focus_on(RUN)
        rate_here(screen)
        screen.until(lambda look: look.state == "rating" and look.trial == 3)
        screen.participant_shows("RatingPage", 3)
        rate_by_keys(screen)
        screen.until(lambda look: look.state == "closing" and look.active)  # the console has the keys again
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [row["rating"] for row in table] == ["0.0", "7.5", "6.1"]
    assert [row["rating_by"] for row in table] == ["participant", "experimenter", "participant"]
    assert [row["comment"] for row in table] == ["soft", "like a toy", "hard"]


def rated_and_half_described(screen: AtConsole, journal: Path, trial: int) -> None:
    """A trial is rated on the participant's screen, which had the keys ever since, and half a word is typed there."""
    screen.participant_shows("RatingPage", trial)
    click(screen, LEFT_END, LINE_Y)
    screen.until(lambda look: not look.active)
    before = len(screen.watch.looks())
    click(screen, 0.5, BUTTON_Y)
    screen.participant_shows("DescriptionPage")
    assert isinstance(records(journal)[-2]["body"]["value"], float)
    look = screen.at("describing")
    assert look.says("Awaited: the participant's words")
    assert not any(look.active for look in screen.watch.looks()[before:])
    screen.keys.type("so")


def test_a_pause_and_f12_in_a_description_keep_the_rating_and_the_words_so_far(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        rated_and_half_described(screen, journal, trial=1)
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        screen.keys.press("p", "Control_L")
        screen.until(lambda look: look.state == "paused" and look.ready)
        screen.participant_shows("MessagePage Paused. Please wait.")
        screen.keys.press("p")
        screen.participant_shows("DescriptionPage", 2)
        screen.until(lambda look: look.says("Keys: the participant's screen"))
        screen.keys.type("ft")
        screen.keys.press("Return", "Control_L")
        screen.until(lambda look: look.state == "rating" and look.trial == 2)
        rated_and_half_described(screen, journal, trial=2)
        stand_still(screen.participant_pid)
        screen.keys.type("ft")
        screen.keys.press("F12")
        os.kill(screen.participant_pid, signal.SIGCONT)
        screen.until(lambda look: look.state == "halted")
        screen.participant_shows("MessagePage Please wait.")
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        screen.to_the_end()
        screen.until(lambda look: look.says("Read back from the disk: 3 answers, all that were given."))
        code, said = screen.close()
    assert code == 130, said
    assert remarks(journal, "halted") == [{"by": "participant", "kind": "halted"}]
    assert [one["text"] for one in remarks(journal, "noted")] == ["participant's description “comment”: soft"]
    answered = [
        body["value"] for record in records(journal) if (body := record.get("body", {})).get("kind") == "answered"
    ]
    assert [value for value in answered if isinstance(value, float)] == [0.0, 0.0]
    first, second, _ = rows(tmp_path, PREFERENCE, "ratings")
    assert (first["rating"], first["rating_by"], first["comment"]) == ("0.0", "participant", "soft")
    assert second["rating"] == "0.0"


def test_a_participants_key_is_a_response_time_from_the_onset_of_the_shot_and_in_a_note_it_is_no_answer(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    pressed_s: list[float] = []
    seen_s: list[float] = []
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        for trial, key in enumerate(("Up", "Down"), 1):
            asking = screen.to("asking", trial)
            screen.participant_shows("ChoicePage", trial)
            pressed_s.append(screen.keys.press(key))
            screen.until(lambda look, serial=asking.serial: look.serial != serial)
            seen_s.append(time.monotonic())
        screen.to("asking", trial=3)
        screen.participant_shows("ChoicePage", 3)  # an answer that comes before it leaves nothing to show
        asking = screen.to("asking", trial=4)
        screen.participant_shows("ChoicePage", 4)
        a_key_goes_into_a_note_and_a_page(screen, journal, shown=4)
        assert screen.look().serial == asking.serial
        screen.keys.press("Down")
        screen.until(lambda look: look.serial != asking.serial)
        code, said = screen.stop()
    assert code == 130, said
    first, second, third, fourth, *_ = rows(tmp_path, DIRECTION, "trials")
    assert [row["response"] for row in (first, second, third)] == ["forward", "backward", "forward"]
    assert [row["response_source"] for row in (first, second, third)] == ["participant"] * 2 + ["experimenter"]
    assert [row["response_time_valid"] for row in (first, second, third)] == ["1", "1", "0"]
    for row, key_s, saved_s, onset_s in zip((first, second), pressed_s, seen_s, onsets_s(journal), strict=False):
        assert key_s - onset_s - CLOCKS_S <= float(row["response_time_s"]) <= saved_s - onset_s
    assert (fourth["response"], fourth["response_source"]) == ("backward", "participant")


def test_on_one_screen_a_question_for_the_participants_keys_is_seen_until_it_is_answered_or_the_console_is_worked(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    def seen(screen: AtConsole, title: str) -> None:
        wait_for(lambda: title in screen.keys.title_at(700, 450), lambda: screen.keys.title_at(700, 450))

    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=1)
        seen(screen, PARTICIPANT)
        assert screen.look().active  # its keys are the console's still
        screen.keys.press("Up")
        screen.at("setting", "preparing")
        seen(screen, RUN)
        screen.to("asking", trial=2)
        seen(screen, PARTICIPANT)
        screen.keys.press("n")
        screen.until(lambda look: look.line)
        seen(screen, RUN)
        screen.keys.press("Up")
        screen.until(lambda look: look.says("The participant’s answer was not taken."))
        screen.participant_shows("ChoicePage", 3)
        seen(screen, RUN)
        screen.keys.press("Escape")
        screen.until(lambda look: not look.line)
        screen.keys.press("Down")
        screen.to("asking", trial=3)
        seen(screen, PARTICIPANT)
        is_stopped_by_f12(screen)


@pytest.mark.parametrize("is_clicked", [True, False])
def test_a_train_does_not_go_on_while_another_program_has_the_keyboard_whosever_window_has_the_focus(
    is_clicked: bool, quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        if not is_clicked:
            screen.focus_on(PARTICIPANT)
            screen.until(lambda look: look.says("Keys: the participant's screen"))
        with taken_keyboard(display):
            if is_clicked:
                screen.focus_on(PARTICIPANT)
            screen.until(lambda look: look.state == "paused" and look.says("ANOTHER WINDOW"))
        screen.until(lambda look: look.says("Keys: the participant's screen"))  # which has them again
        is_stopped_by_f12(screen)


def test_a_participants_window_that_is_minimised_holds_the_run_and_is_said_until_it_is_seen_again(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal, told = tmp_path / f"{PREFERENCE}_journal.jsonl", "The participant's window is minimised"
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.keys.minimise(PARTICIPANT)
        look = screen.until(lambda look: look.state == "paused" and look.ready)
        assert look.says(told)
        check_disarmed(screen.watch)
        screen.stands(RUN)
        screen.keys.press("p")
        wait_for(lambda: remarks(journal, "refused"))
        assert screen.heard().state == "paused"
        screen.keys.bring_back(PARTICIPANT)
        screen.until(lambda look: not look.says(told))
        screen.stands(RUN)
        screen.to("train", trial=2)
        code, said = screen.stop()
    assert code == 130, said
    held, by_stop = remarks(journal, "paused")
    assert held["cause"].startswith(told)
    assert not by_stop["cause"]  # Q in a train
    assert [one["text"] for one in remarks(journal, "noted")] == ["The participant's window is seen again."]


def a_key_goes_into_a_note_and_a_page(screen: AtConsole, journal: Path, shown: int) -> None:
    """The participant's key is refused while the experimenter types or reads; then the question stands there again."""
    for count, (opened, why) in enumerate((("n", lambda look: look.line), ("F1", lambda look: look.page)), shown + 1):
        screen.keys.press(opened)
        screen.until(why)
        before = len(remarks(journal, "refused"))
        screen.keys.press("Up")
        screen.until(lambda look: look.says("The participant’s answer was not taken."))
        wait_for(lambda before=before: len(remarks(journal, "refused")) > before)
        screen.keys.press("Escape")
        screen.until(lambda look: not look.line and not look.page)
        screen.participant_shows("ChoicePage", count)


def test_a_time_that_is_lost_is_said_until_the_next_trial_is_answered(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    lost = "The participant’s screen stood still for"
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=1)
        screen.participant_shows("ChoicePage")
        stand_still(screen.participant_pid)
        screen.keys.press("Up")
        time.sleep(0.5)
        os.kill(screen.participant_pid, signal.SIGCONT)
        screen.until(lambda look: look.state != "asking" and look.says(lost))
        screen.to("asking", trial=2)
        assert screen.look().says(lost)
        screen.participant_shows("ChoicePage", 2)
        screen.keys.press("Down")
        screen.until(lambda look: look.says("Saved.") and not look.says(lost))
        code, said = screen.stop()
    assert code == 130, said
    first, second, *_ = rows(tmp_path, DIRECTION, "trials")
    assert "key-time-lost" in first["flags"]
    assert "key-time-lost" not in second["flags"]


def test_a_question_that_could_not_be_shown_at_the_shot_has_no_time_to_its_answer(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("preparing", trial=1)
        stand_still(screen.participant_pid)
        screen.to("asking", trial=1)
        time.sleep(0.5)
        os.kill(screen.participant_pid, signal.SIGCONT)
        screen.participant_shows("ChoicePage")
        time.sleep(0.5)  # the key itself is stamped well
        screen.keys.press("Up")
        screen.until(lambda look: look.state != "asking" and look.says("The participant’s screen stood still for"))
        code, said = screen.stop()
    assert code == 130, said
    first, *_ = rows(tmp_path, DIRECTION, "trials")
    assert (first["response"], first["response_time_valid"], first["flags"]) == ("forward", "0", "key-time-lost")


def test_a_run_that_is_stopped_keeps_where_the_participants_marker_stood(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        screen.participant_shows("RatingPage")
        click(screen, LEFT_END, LINE_Y)
        screen.until(lambda look: not look.active)
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        code, said = screen.stop()
    assert code == 130, said
    assert [one["text"] for one in remarks(journal, "noted")] == ["participant's rating: 0"]


def test_a_marker_that_another_answer_leaves_behind_is_noted_by_its_question_and_that_answer_stands_below(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE.replace('preference', 'realism')}_journal.jsonl"
    run = words(quick_configs, "realism", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        for count, (rating, question) in enumerate((("5", "realism"), ("6", "comfort")), start=1):
            screen.to("rating", trial=1)
            screen.participant_shows("RatingPage", count)
            screen.focus_on(PARTICIPANT)
            screen.keys.press("Right")
            time.sleep(0.5)  # their program tells where it stands as it looks next
            screen.focus_on(RUN)
            asked = screen.until(lambda look: look.active)
            screen.keys.type(f"{rating}\n")
            screen.until(lambda look, asked=asked: look.serial != asked.serial and look.says("Saved. Note."))
            assert remarks(journal, "noted")[-1]["text"] == f"participant's rating “{question}”: 4"
        screen.until(lambda look: look.says("Saved. Trial 1, rating “comfort”: 6."))
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        code, said = screen.stop()
    assert code == 130, said


def test_what_the_participant_had_written_as_their_program_was_lost_is_kept_as_a_note(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        rated_and_half_described(screen, journal, trial=1)
        time.sleep(0.5)  # their program tells what stands there as it looks next
        os.kill(screen.participant_pid, signal.SIGKILL)
        screen.until(lambda look: look.state == "paused" and look.ready)
        screen.stands(RUN)
        screen.keys.press("s")
        screen.keys.press("p")
        screen.participant_shows("DescriptionPage", 2)
        screen.focus_on(PARTICIPANT)
        screen.keys.type("ft")
        screen.keys.press("F12")
        screen.until(lambda look: look.state == "halted")
        screen.focus_on(RUN)
        screen.keys.press("q")
        assert screen.close()[0] == 130
    notes = [one["text"] for one in remarks(journal, "noted") if one["trial"]]
    assert notes == [f"participant's description “comment”: {half}" for half in ("so", "ft")]


def test_a_key_that_loses_to_what_the_experimenter_entered_is_on_record_and_said_until_the_next_trial(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    """As the console wakes up it hears them in either order: what came second is on record."""
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    differs = "“backward” was entered at the console and taken before “forward” came, though that went down"
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=1)
        screen.participant_shows("ChoicePage")
        with screen.standing_still(0.2):
            screen.keys.press("Up")
            time.sleep(0.2)
            screen.keys.press("b")
        look = screen.until(lambda look: look.says(differs) or look.says("Saved. Trial 1: FORWARD"))
        if not look.says(differs):
            wait_for(lambda: [one["answer"] for one in remarks(journal, "refused")] == ["backward"])
            return
        assert remarks(journal, "refused")[-1]["answer"] == "forward"
        screen.to("asking", trial=2)
        assert screen.look().says(differs)
        screen.participant_shows("ChoicePage", 2)
        screen.keys.press("Down")
        screen.until(lambda look: look.trial == 3 and not look.says(differs))
        code, said = screen.stop()
    assert code == 130, said
    assert "Go on with --resume --participant-keys." in said
    first, *_ = rows(tmp_path, DIRECTION, "trials")
    assert (first["response"], first["response_source"]) == ("backward", "experimenter")


def test_a_key_for_which_their_program_stood_still_until_the_experimenter_answered_is_on_record(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=1)
        screen.participant_shows("ChoicePage")
        stand_still(screen.participant_pid)
        screen.keys.press("Up")
        screen.keys.press("b")
        screen.until(lambda look: look.says("Saved. Trial 1: BACKWARD"))
        os.kill(screen.participant_pid, signal.SIGCONT)
        screen.until(lambda look: look.says("“backward” was entered at the console and taken before “forward” came:"))
        code, said = screen.stop()
    assert code == 130, said
    (late,) = remarks(journal, "refused")
    assert (late["event"], late["by"], late["answer"]) == ("participant's key", "participant", "forward")


def onsets_s(journal: Path) -> list[float]:
    """When the shots began, on the machine's monotonic clock."""
    bodies = [record.get("body", {}) for record in records(journal)]
    return [body["pulse_start_s"] for body in bodies if body.get("kind") == "fired"]


@pytest.mark.parametrize("device", ["", "pcm.!default { type null }\n"])  # what there is; one without a sound
def test_of_masking_noise_the_console_says_why_it_stays_off_and_else_nothing(
    quick_configs: Path, tmp_path: Path, display: str, device: str
) -> None:
    if device:
        (tmp_path / ".asoundrc").write_text(device)
    plays = plays_sound(tmp_path)
    if device and not plays:
        pytest.skip("the sound library does not take its devices from ALSA")
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--noise")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.ready()
        noted = wait_for(lambda: remarks(journal, "noted"))[0]["text"]
        if plays:
            assert noted == "Masking noise plays."
        else:
            screen.until(lambda look: look.says("Masking noise stays off: no sound device"))
            assert "Connect headphones" in told_of_noise(screen)[0]
        code, said = screen.stop()
    assert code == 130, said
    assert not plays or not told_of_noise(screen)


def test_noise_that_ends_in_mid_run_is_said_and_shown_and_on_record(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    sink = tmp_path / "sink"
    sink.write_text(f"#!/bin/sh\necho $$ > {tmp_path}/pid\nexec cat > /dev/null\n")
    sink.chmod(0o700)
    (tmp_path / ".asoundrc").write_text(
        f'pcm.!default {{ type file slave.pcm {{ type null }} file "|exec {sink}" format raw }}\n'
    )
    if not plays_sound(tmp_path):
        pytest.skip("the sound library does not take its devices from ALSA")
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    run = words(quick_configs, "direction", "--participant", "P01", "--noise")
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.ready()
        wait_for(lambda: remarks(journal, "noted"))
        assert not screen.look().says("Masking noise: OFF")
        os.kill(int((tmp_path / "pid").read_text()), signal.SIGKILL)
        screen.until(lambda look: look.says("Masking noise has ended: its sound device is gone. Connect headphones"))
        screen.until(lambda look: look.says("Masking noise: OFF"))
        screen.keys.press("Return")
        screen.to("asking", trial=1)
        assert screen.look().says("Masking noise: OFF")
        code, said = screen.stop()
    assert code == 130, said
    plays, ended = (one["text"] for one in remarks(journal, "noted"))
    assert (plays, ended.split(":")[0]) == ("Masking noise plays.", "Masking noise has ended")


def test_a_synthetic_participant_rates_on_the_participants_screen_as_in_data_mode(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "preference", "--participant", "P01", "--visual", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        code, said = screen.end()
    assert code == 0, said
    data = ["run", quick_configs / "preference.toml", "--participant", "P01", "--seed", "1"]
    subprocess.run(
        warm(*data, "--screen", "synthetic", "--results", "data"), cwd=tmp_path, check=True, capture_output=True
    )
    seen = rows(tmp_path, PREFERENCE, "ratings")
    expected = rows(tmp_path, re.sub("^results", "data", PREFERENCE), "ratings")
    for column in ("rating", "rating_by", "comment"):
        assert [row[column] for row in seen] == [row[column] for row in expected]


def test_a_number_of_any_size_has_no_page_and_is_typed_at_the_console_which_says_so(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    config = quick_configs / "magnitude.toml"
    config.write_text(config.read_text().replace("sets = 3", "sets = 1").replace("repetitions = 3", "repetitions = 1"))
    run = words(quick_configs, "magnitude", "--participant", "P01", "--visual", "--participant-screen")
    with AtConsole(run, tmp_path, display) as screen:
        code, said = screen.end()
        asked = [look for look in screen.watch.looks() if look.state == "rating"]
        assert code == 0, said
        assert "RatingPage" not in screen.pages
    assert any(look.says("Type here what they say: it has no page on their screen.") for look in asked)
    assert not any(look.says("Awaited") for look in asked)


def test_where_there_is_no_x_the_synthetic_rating_is_refused_with_one_message(
    quick_configs: Path, tmp_path: Path
) -> None:
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    run = words(quick_configs, "preference", "--participant", "P01", "--visual", "--participant-screen")
    done = subprocess.run(
        warm(*run),
        cwd=tmp_path,
        env=environment | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("recoil: --visual --participant-screen rates by synthetic events, which only an X")
    assert done.stderr.count("\n") == 1


def is_stopped_by_f12(screen: AtConsole) -> None:
    """F12, wherever the keys are, halts the run, which is then closed."""
    screen.keys.press("F12")
    screen.until(lambda look: look.state == "halted" and look.says("EMERGENCY STOP"))
    screen.focus_on(RUN)
    screen.keys.press("q")
    assert screen.close()[0] == 130


def start_their_screen_again(screen: AtConsole) -> None:
    """Their program is killed, and S is pressed."""
    screen.stands(RUN)
    screen.to("preparing", trial=1)
    os.kill(screen.participant_pid, signal.SIGKILL)
    screen.until(lambda look: look.state == "paused")
    screen.stands(RUN)
    screen.watch.pages.unlink()
    screen.keys.press("s")


@pytest.mark.parametrize(("window", "by"), [(PARTICIPANT, "participant"), ("please wait", "experimenter")])
def test_f12_while_the_participants_window_is_starting_halts_the_run(
    window: str, by: str, quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        screen.focus_on(window)
        assert not screen.watch.pages.exists()  # nothing was shown there yet
        is_stopped_by_f12(screen)
    assert [one["by"] for one in remarks(tmp_path / f"{DIRECTION}_journal.jsonl", "halted")] == [by]


def test_a_note_that_is_typed_while_the_participants_window_comes_again_goes_on_before_that_is_ready(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    """How many letters go astray until the console has the keys again hangs on the machine."""
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        start_their_screen_again(screen)
        screen.until(lambda look: look.says("Their screen is being started again."))
        screen.keys.press("s")
        screen.until(lambda look: look.says("The participant's screen is being started already."))
        screen.keys.press("n")
        screen.until(lambda look: look.line)
        pressed = ""
        while not screen.watch.pages.exists():
            pressed += ascii_lowercase[len(pressed) % 26]  # a key that was let go elsewhere is down still
            screen.keys.press(pressed[-1])
            time.sleep(0.1)
        screen.until(lambda look: look.typed.endswith(pressed[-1]))
        screen.keys.press("Escape")
        code, said = screen.stop()
    assert code == 130, said


def test_f12_on_the_participants_window_while_it_is_started_again_halts_the_run(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = words(quick_configs, "direction", "--participant", "P01", "--participant-keys")
    with AtConsole(run, tmp_path, display) as screen:
        start_their_screen_again(screen)
        screen.focus_on(PARTICIPANT)
        assert not screen.watch.pages.exists()  # nothing was shown there yet
        is_stopped_by_f12(screen)
    assert [one["by"] for one in remarks(tmp_path / f"{DIRECTION}_journal.jsonl", "halted")] == ["participant"]


@pytest.mark.parametrize("stood_s", [0.7, 2.5])
def test_f12_on_the_participants_window_while_the_console_stands_still_in_a_train_is_heard_before_a_shot(
    quick_configs: Path, tmp_path: Path, display: str, stood_s: float
) -> None:
    watch = Watch(str(tmp_path))
    run = words(quick_configs, "preference", "--participant", "P01", "--participant-screen")
    with AtConsole(run, tmp_path, display, watch) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.focus_on(PARTICIPANT)
        fired = len(watch.calls("fired"))
        wait_for(lambda: len(watch.calls("fired")) > fired)
        time.sleep(0.5)  # half-way to the next shot
        with screen.standing_still(stood_s):
            fired = len(watch.calls("fired"))
            screen.keys.press("F12")
        screen.until(lambda look: look.state == "halted")
        assert len(watch.calls("fired")) == fired
        screen.focus_on(RUN)
        screen.until(lambda look: look.active)
        screen.keys.press("q")
        screen.close()
