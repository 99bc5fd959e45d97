"""How runs at the console end that nobody ended in order: displays, folders, processes and windows that go away."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.at_display import (
    OTHER,
    AtConsole,
    another_window,
    check_disarmed,
    lose_the_display,
    needs_display,
    records,
    remarks,
    run_words,
    virtual_display,
)
from tests.at_hand import check_gun
from tests.at_runs import DIRECTION, PREFERENCE, RUN, answers, rows
from tests.conftest import RECOIL
from tests.waiting import stand_still, wait_for
from tests.watched_console import Look, Watch

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]
needs_psychopy = pytest.mark.skipif(
    importlib.util.find_spec("psychopy") is None, reason="PsychoPy is not installed: extra `gui`"
)


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


def check_resumes(command: list[object], folder: Path, display: str, trial: int) -> None:
    """The run goes on at a trial."""
    with AtConsole([*command, "--resume"], folder, display) as screen:
        screen.stands(RUN)
        assert screen.to("preparing").trial == trial
        assert screen.stop()[0] == 130


# the display


@pytest.mark.parametrize(("experiment", "state"), [("direction", "asking"), ("preference", "train")])
def test_a_run_whose_display_is_lost_ends_disarmed_and_can_be_resumed(
    quick_configs: Path, tmp_path: Path, display: str, experiment: str, state: str
) -> None:
    lose_the_display(quick_configs, tmp_path, experiment, state)
    check_disarmed(Watch(str(tmp_path)))
    stem = DIRECTION if experiment == "direction" else PREFERENCE
    last = records(tmp_path / f"{stem}_journal.jsonl")[-1]
    assert (last["kind"], last["reason"]) == ("stopped", "the display was lost")
    check_resumes(run_words(quick_configs, experiment), tmp_path, display, trial=2)


# the results


def lose_the_results(screen: AtConsole, lose: Callable[[], object]) -> str:
    """Take the results away at the second trial; what stands on the end screen."""
    screen.stands(RUN)
    screen.to("preparing", trial=2)
    lose()
    screen.keys.press("space")
    look = screen.until(lambda look: look.ended and look.says("the journal was"))
    assert not look.says("all that were given")
    return next(text for text in look.texts if "the journal was" in text)


def test_results_that_are_deleted_under_a_run_are_noticed_and_written_again(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = run_words(quick_configs)
    with AtConsole(run, tmp_path, display) as screen:
        said = lose_the_results(screen, lambda: shutil.rmtree(tmp_path / "results"))
        screen.close()
    assert "was deleted during the run" in said
    assert "; resume the run." in said
    check_disarmed(Watch(str(tmp_path)))
    assert answers(tmp_path / f"{DIRECTION}_journal.jsonl") == ["forward"]
    check_resumes(run, tmp_path, display, trial=2)


def test_results_that_are_moved_under_a_run_are_gone_on_with_where_they_are(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run = run_words(quick_configs)
    with AtConsole(run, tmp_path, display) as screen:
        said = lose_the_results(screen, lambda: (tmp_path / "results").rename(tmp_path / "elsewhere"))
        screen.close()
    journal = tmp_path / DIRECTION.replace("results", "elsewhere")
    assert f"was moved to {journal}_journal.jsonl" in said
    check_disarmed(Watch(str(tmp_path)))
    check_resumes([*run, "--results", "elsewhere"], tmp_path, display, trial=2)


def test_results_that_cannot_be_written_again_in_their_place_are_written_to_another_that_is_named(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run, results = run_words(quick_configs), tmp_path / "results"

    def replace_by_a_file() -> None:
        shutil.rmtree(results)
        results.write_text("no folder")

    with AtConsole(run, tmp_path, display) as screen:
        said = lose_the_results(screen, replace_by_a_file)
        screen.close()
    there = tmp_path / f"{Path(DIRECTION).name}_journal.jsonl"
    assert f"written again to {there}; put it back" in said
    results.unlink()
    back = tmp_path / f"{DIRECTION}_journal.jsonl"
    back.parent.mkdir(parents=True)
    there.rename(back)
    check_resumes(run, tmp_path, display, trial=2)


# windows and signals


def test_a_run_that_is_refused_when_its_window_is_open_says_why_and_q_closes_it(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with AtConsole([*run_words(quick_configs), "--sensor", "csv:nowhere"], tmp_path, display) as screen:
        screen.stands(RUN)
        screen.until(lambda look: look.ended and look.says("Sensor csv:nowhere: cannot be opened"))
        screen.keys.press("q")
        code, said = screen.end()
    assert code == 2, said
    assert not list(tmp_path.glob("results/**/*.jsonl"))


def test_closing_the_window_asks_why_and_ends_nothing_by_itself(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtConsole(run_words(quick_configs), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=2)
        screen.keys.press("F4", "Alt_L")  # by the window manager
        screen.until(lambda look: look.line and look.says("Why does the run stop here?"))
        screen.keys.press("Escape")
        screen.until(lambda look: not look.line)
        assert screen.to("preparing", trial=3)
        screen.keys.press("F4", "Alt_L")
        screen.until(lambda look: look.line)
        screen.keys.type("fire alarm\n")
        code, said = screen.close()
    assert code == 130, said
    assert records(journal)[-1]["reason"] == "fire alarm"
    assert answers(journal) == ["forward", "backward"]


def test_closing_the_window_in_a_train_disarms_before_it_asks_why(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal, watch = tmp_path / f"{PREFERENCE}_journal.jsonl", Watch(str(tmp_path))
    with AtConsole(run_words(quick_configs, "preference"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.keys.press("F4", "Alt_L")
        screen.until(lambda look: look.line and look.state == "paused")
        screen.until(lambda look: look.says("Gun: disarmed"))
        screen.keys.type("fire alarm\n")
        code, said = screen.close()
    assert code == 130, said
    assert remarks(journal, "paused")
    assert records(journal)[-1]["reason"] == "fire alarm"
    check_gun(watch, journal)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_run_and_window_in_order(
    quick_configs: Path, tmp_path: Path, display: str, number: signal.Signals
) -> None:
    with AtConsole(run_words(quick_configs, "preference"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=2)
        screen.keys.press("n")  # whatever is open
        screen.until(lambda look: look.line)
        screen.keys.type("it got warm")
        screen.until(lambda look: look.typed == "it got warm")
        screen.process.send_signal(number)
        code, said = screen.end()
    assert code == 130, said
    assert f"recoil: stopped: {number.name}. Go on with --resume." in said
    check_disarmed(Watch(str(tmp_path)))
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    assert (records(journal)[-1]["kind"], records(journal)[-1]["reason"]) == ("stopped", number.name)
    (noted,) = remarks(journal, "noted")
    assert noted["text"] == "note: it got warm"


# the emergency stop


def test_a_note_that_is_half_typed_at_the_emergency_stop_is_kept_and_a_reason_can_be_added(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    with AtConsole(run_words(quick_configs, "preference"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.keys.press("n")
        screen.until(lambda look: look.line)
        screen.keys.type("it got")
        screen.keys.press("F12")
        screen.until(lambda look: look.state == "halted" and not look.line)
        screen.until(lambda look: look.says("The gun itself says that it is disarmed."))
        screen.line("y", "smoke from the coil")
        screen.at("halted")
        screen.keys.press("q")
        code, said = screen.close()
    assert code == 130, said
    halted, noted, reason = remarks(journal, "halted", "noted", "halt-reason")
    assert halted["by"] == "experimenter"
    assert (noted["text"], reason["text"]) == ("note: it got", "smoke from the coil")
    assert records(journal)[-1]["reason"] == "emergency stop"
    check_gun(Watch(str(tmp_path)), journal)


@contextmanager
def twin_process() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The gun's twin as a program: its address, and what can be killed."""
    with subprocess.Popen([RECOIL, "twin"], stdout=subprocess.PIPE, text=True) as twin:
        assert twin.stdout is not None
        try:
            yield f"serial:{twin.stdout.readline().strip()}", twin
        finally:
            twin.kill()


@contextmanager
def kept(address: str) -> Iterator[None]:
    """No other test's twin gets the name of this line when its twin is gone: the console would speak to that one."""
    line = os.open(address.removeprefix("serial:"), os.O_RDWR | os.O_NOCTTY)
    try:
        yield
    finally:
        os.close(line)


def gone(twin: subprocess.Popen[str]) -> None:
    """The twin is killed, and has ended."""
    twin.kill()
    twin.wait()


def silent(twin: subprocess.Popen[str]) -> None:
    """The twin is there, and does nothing."""
    stand_still(twin.pid)


@pytest.mark.parametrize("befalls", [gone, silent])
def test_a_gun_that_went_silent_before_the_emergency_stop_is_never_shown_as_disarmed(
    quick_configs: Path, tmp_path: Path, display: str, befalls: Callable[[subprocess.Popen[str]], None]
) -> None:
    def told(look: Look) -> bool:
        assert not look.says("The gun itself says that it is disarmed.")
        return look.says("The gun does not say that it is disarmed: SWITCH OFF ITS POWER.")

    with (
        twin_process() as (address, twin),
        AtConsole(run_words(quick_configs, "direction", "--gun", address), tmp_path, display) as screen,
    ):
        screen.stands(RUN)
        screen.to("asking", trial=1)
        screen.until(lambda look: look.says("SIMULATED GUN – nothing is felt"))  # a twin is one as well
        with kept(address):
            befalls(twin)
            screen.keys.press("F12")
            screen.until(told)
            screen.keys.press("q")
            code, said = screen.close()
    assert code == 130, said
    assert "stopped: emergency stop" in said


def test_a_practice_of_the_command_line_says_that_it_is_one_and_promises_no_resumption(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    with AtConsole(run_words(quick_configs, "direction", "--practice"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("preparing")
        screen.until(lambda look: look.says("PRACTICE – never analysed"))
        screen.keys.press("q")
        screen.until(lambda look: look.says("Why does it stop here? It is begun anew each time."))
        screen.keys.type("enough")
        screen.keys.press("Return")
        look = screen.until(lambda look: look.ended)
        assert not look.says("can be resumed")
        code, said = screen.close()
    assert (code, "A practice is begun anew each time" in said) == (130, True)


def test_a_gun_that_does_not_answer_is_not_fired_and_once_it_answers_it_is(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    def shots() -> int:
        return sum(record["kind"] == "shot" for record in records(tmp_path / f"{PREFERENCE}_journal.jsonl"))

    with (
        twin_process() as (address, twin),
        AtConsole(run_words(quick_configs, "preference", "--gun", address), tmp_path, display) as screen,
    ):
        screen.stands(RUN)
        screen.to("preparing", trial=1)
        stand_still(twin.pid)
        look = screen.until(lambda look: look.says("The gun has not answered for"))
        assert not look.says("Fire\n[Space]")
        screen.keys.press("space")
        twin.send_signal(signal.SIGCONT)
        screen.until(lambda look: look.says("hand it over") and look.state == "preparing")
        assert remarks(tmp_path / f"{PREFERENCE}_journal.jsonl", "refused")[-1]["event"] == "fire"
        assert shots() == 0
        screen.keys.press("space")
        screen.at("train")
        wait_for(lambda: shots() > 0)
        screen.keys.press("F12")
        screen.until(lambda look: look.says("The gun itself says that it is disarmed."))
        screen.keys.press("q")
        assert screen.close()[0] == 130


def test_what_is_half_typed_is_kept_as_a_note_when_another_command_comes_and_q_closes_the_window(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{DIRECTION}_journal.jsonl"
    with AtConsole(run_words(quick_configs), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=1)
        screen.keys.press("n")
        screen.until(lambda look: look.line)
        screen.keys.type("sneezed")
        screen.keys.press("g", "Control_L")
        screen.until(lambda look: look.line and look.says("Flag "))
        screen.keys.type("cough")
        screen.keys.press("F12")
        screen.at("halted")
        screen.keys.press("y", "Control_L")
        screen.until(lambda look: look.line and look.says("Why was there an emergency stop?"))
        screen.keys.type("was hurt")
        screen.keys.press("q", "Control_L")
        screen.until(lambda look: look.ended)
        screen.keys.press("q")
        code, said = screen.end()
    assert code == 130, said
    texts = [noted["text"] for noted in remarks(journal, "noted")]
    assert texts == ["note: sneezed", "flag: cough", "reason: was hurt"]
    assert records(journal)[-1]["reason"] == "emergency stop"


@pytest.mark.parametrize("how", ["emergency stop", "moved, and went on", "stop"])
def test_an_answer_that_is_half_typed_is_kept_as_a_note_when_its_question_goes(
    quick_configs: Path, tmp_path: Path, display: str, how: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    with AtConsole(run_words(quick_configs, "preference"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("rating", trial=1)
        screen.keys.type("7")
        screen.keys.press("p", "Control_L")  # what is typed outlives a pause
        screen.until(lambda look: look.state == "paused" and look.ready)
        if how == "moved, and went on":
            screen.keys.press("p")
            screen.at("rating")
            screen.keys.press("x", "Control_L")
            screen.at("describing")
            screen.keys.type("like a t")
        if how == "emergency stop":
            screen.keys.press("F12")
            screen.at("halted")
            screen.keys.press("q")
        code, said = screen.close() if how == "emergency stop" else screen.stop()
    assert code == 130, said
    texts = [noted["text"] for noted in remarks(journal, "noted")]
    assert texts == ["rating: 7", "description “comment”: like a t"][: 1 + (how == "moved, and went on")]


def test_after_an_emergency_stop_a_run_goes_on_only_by_a_held_key_and_a_test_shot(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal, run, watch = tmp_path / f"{DIRECTION}_journal.jsonl", run_words(quick_configs), Watch(str(tmp_path))
    with AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("asking", trial=2)
        screen.keys.press("F12")
        screen.at("halted")
        screen.keys.press("q")
        assert screen.close()[0] == 130
    fired = len(watch.calls("fired"))
    with AtConsole([*run, "--resume"], tmp_path, display) as screen:
        screen.stands(RUN)
        screen.at("rearming")
        screen.keys.press("t")
        screen.until(lambda look: look.says("Let go too soon: hold it for 1 s."))
        assert len(watch.calls("fired")) == fired
        screen.hold("t", until=lambda look: look.state in ("setting", "preparing"))
        screen.to("preparing", trial=2)
        assert len(watch.calls("fired")) == fired + 1
        assert screen.stop()[0] == 130
    (shot,) = remarks(journal, "test-shot")
    assert shot["held_s"] >= 1.0
    assert shot["cause"] == ""
    check_gun(watch, journal)


def test_a_key_that_is_held_for_the_test_shot_counts_as_let_go_when_another_window_gets_the_keys(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    run, watch = run_words(quick_configs), Watch(str(tmp_path))
    with another_window(display):
        with AtConsole(run, tmp_path, display) as screen:
            screen.stands(RUN)
            screen.to("preparing")
            screen.keys.press("F12")
            screen.at("halted")
            screen.keys.press("q")
            screen.close()
        with AtConsole([*run, "--resume"], tmp_path, display) as screen:
            screen.stands(RUN)
            screen.at("rearming")
            screen.keys.key_down("t")
            screen.focus_on(OTHER)
            screen.keys.key_up("t")
            screen.until(lambda look: look.says("Let go too soon: hold it for 1 s.") and not look.active)
            screen.focus_on(RUN)
            screen.until(lambda look: look.active)
            assert screen.stop()[0] == 130
    assert not watch.calls("fired")


# the participant's screen


def participant_pid(screen: AtConsole) -> int:
    """The participant's process: the console's child that runs its program."""
    found = subprocess.run(
        ["pgrep", "-f", f"tests.watched_participant {screen.watch.pages}"],
        capture_output=True,
        text=True,
        check=True,
    )
    return int(found.stdout)


def kill_participant(screen: AtConsole) -> None:
    """The run is paused and disarmed, and the console says why."""
    os.kill(participant_pid(screen), signal.SIGKILL)
    screen.until(lambda look: look.state == "paused")
    screen.until(lambda look: look.says("The participant's screen was killed by signal 9") and look.says("S starts it"))
    screen.focus_on(RUN)
    screen.until(lambda look: look.active and look.ready)


def start_again(screen: AtConsole) -> None:
    """The participant's screen is started again, and the run goes on."""
    screen.keys.press("s")
    screen.participant_shows("MessagePage Paused. Please wait.")
    screen.until(lambda look: look.says("The participant's screen is there again."))
    screen.until(lambda look: look.active)  # its window came with the keys, and gives them back
    screen.keys.press("p")
    screen.until(lambda look: look.state != "paused")


@needs_psychopy
@pytest.mark.parametrize(
    ("experiment", "side", "state", "page"),
    [
        pytest.param("preference", "--participant-screen", "rating", "RatingPage", marks=pytest.mark.soak),
        ("direction", "--participant-keys", "asking", "ChoicePage"),
    ],
)
def test_a_participants_screen_that_is_killed_in_a_question_can_be_started_again_and_asks_it(  # noqa: PLR0917 - each is looked at
    quick_configs: Path, tmp_path: Path, display: str, experiment: str, side: str, state: str, page: str
) -> None:
    journal = tmp_path / f"{DIRECTION if experiment == 'direction' else PREFERENCE}_journal.jsonl"
    with AtConsole(run_words(quick_configs, experiment, side), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to(state, trial=1)
        screen.participant_shows(page)
        kill_participant(screen)
        check_gun(screen.watch, journal)
        start_again(screen)
        screen.until(lambda look: look.state == state)
        screen.participant_shows(page, 2)
        screen.focus_on(RUN)
        screen.to({"rating": "describing", "asking": "preparing"}[state])
        if state == "rating":
            screen.participant_shows("DescriptionPage")
            screen.focus_on(RUN)
        assert screen.stop()[0] == 130
    check_started_again(journal)


def check_started_again(journal: Path) -> None:
    paused, noted, *_ = remarks(journal, "paused", "noted")
    assert "killed by signal 9" in paused["cause"]
    assert noted["text"] == "The participant's screen was started again."


@needs_psychopy
def test_a_killed_participants_screen_can_be_started_again_in_a_train_and_done_without_in_a_rating(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal = tmp_path / f"{PREFERENCE}_journal.jsonl"
    with AtConsole(run_words(quick_configs, "preference", "--participant-screen"), tmp_path, display) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        screen.participant_shows("MessagePage Please wait.")
        kill_participant(screen)
        check_gun(screen.watch, journal)
        start_again(screen)
        screen.to("rating", trial=1)
        screen.participant_shows("RatingPage")
        kill_participant(screen)
        screen.to_the_end()
        code, said = screen.close()
    assert code == 0, said
    check_started_again(journal)
    table = rows(tmp_path, PREFERENCE, "ratings")
    assert [(row["rating"], row["rating_by"]) for row in table] == [
        ("0.0", "experimenter"), ("7.5", "experimenter"), ("7.5", "experimenter"),
    ]  # fmt: skip


@needs_psychopy
def test_a_participants_screen_that_does_not_start_again_ends_nothing(
    quick_configs: Path, tmp_path: Path, display: str
) -> None:
    journal, watch = tmp_path / f"{PREFERENCE}_journal.jsonl", Watch(str(tmp_path), participants=1)
    run = run_words(quick_configs, "preference", "--participant-screen")
    with AtConsole(run, tmp_path, display, watch) as screen:
        screen.stands(RUN)
        screen.to("train", trial=1)
        kill_participant(screen)
        for tried in (1, 2):
            screen.keys.press("s")
            wait_for(lambda tried=tried: len(not_again(journal)) == tried)
            screen.until(lambda look: look.says("did not start again: ") and look.says("S starts it again. P goes on "))
            assert screen.look().state == "paused"
        screen.keys.press("s")
        screen.keys.press("p")
        screen.to("rating", trial=1)
        code, said = screen.stop()
    assert code == 130, said
    assert len(not_again(journal)) == 3
    assert records(journal)[-1]["reason"] == "enough"


def not_again(journal: Path) -> list[str]:
    """What is on record of a participant's screen that did not start again."""
    return [one["text"] for one in remarks(journal, "noted") if "did not start again: " in one["text"]]
