"""The start window on virtual screens, by real keys: it fits, opens as it was left, and ends when it is told to."""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.new_study import new_study
from experiments.study.register import read_register
from tests import watched_start
from tests.at_display import (
    HAND_S,
    AtDisplay,
    last_record,
    needs_display,
    remarks,
    taken_keyboard,
    window_manager,
    x_server,
)
from tests.gun_plugins import ROOT
from tests.watched_start import wait_for

pytest.importorskip("PyQt6")
pytestmark = [needs_display, pytest.mark.slow]
needs_manager = pytest.mark.skipif(shutil.which("openbox") is None, reason="needs a window manager: openbox")

LONG = "a-folder-with-a-name-that-has-no-blank-at-which-a-line-could-be-broken-and-goes-on-and-on"


@contextmanager
def virtual_screen(size: str, *, manager: bool = False) -> Iterator[str]:
    """A virtual screen of a size, with or without a window manager; its name."""
    with x_server(size) as (name, _), window_manager(name) if manager else nullcontext():
        yield name


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_screen("1280x800") as name:
        yield name


@pytest.fixture
def pilot(tmp_path: Path) -> Path:
    """A study in which P01 stopped, in a folder with a long name."""
    new_study(tmp_path / "pilot")
    setup = load_setup(str(tmp_path / "pilot" / "direction.toml"))
    where = RunRequest(setup=setup, participant_id="P01", results=tmp_path / LONG, seed=1, screen="terminal")
    journal = run(where, synthetic_screen, VirtualClock()).place.journal
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:40]))
    return tmp_path


@contextmanager
def started(folder: Path, display: str, *more: object) -> Iterator[tuple[AtDisplay, Path]]:
    """The start window under the eye: the program at the display, and what the eye saw."""
    eye = folder / "eye.jsonl"
    eye.unlink(missing_ok=True)
    command = ["run", folder / "pilot" / "direction.toml", "--screen", "console", "--results", LONG, *more]
    with AtDisplay(watched_start.words(eye, command), folder, display) as screen:
        screen.focus_on("start")
        try:
            yield screen, eye
        except AssertionError as error:
            ended = screen.process.poll()
            raise AssertionError(f"{error}; the program (exit code {ended}) said: {screen.kill()}") from error


def having(*starts: str) -> Callable[[dict[str, Any]], bool]:
    """Whether texts that begin so stand in the window, and nothing is cut."""

    def right(look: dict[str, Any]) -> bool:
        return not look["cut"] and all(any(text.startswith(start) for text in look["texts"]) for start in starts)

    return right


def enter(screen: AtDisplay, code: str = "P01") -> None:
    """The read-back, and what the study asks for."""
    keys = screen.keys
    keys.type(code)
    keys.press("Tab")
    keys.type("25")
    for _ in range(2):
        keys.press("Tab")
        keys.press("Down")
    time.sleep(HAND_S)  # Enter may have been pressed just before all this, which no hand types in 14 ms


# it fits


SCREENS = [("1024x600", 1, False), ("1536x1024", 1.5, True)]
MORE_SCREENS = [("1366x768", 1, True), ("1920x1080", 1, False)]


@pytest.mark.parametrize(
    ("size", "scale", "manager"),
    [
        pytest.param(*screen, marks=[*([needs_manager] if screen[2] else []), *soak])
        for screens, soak in ((SCREENS, []), (MORE_SCREENS, [pytest.mark.soak]))
        for screen in screens
    ],
)
def test_nothing_is_cut_on_a_small_a_usual_a_large_and_a_scaled_screen(
    size: str, scale: float, manager: bool, pilot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("QT_SCALE_FACTOR", str(scale))
    with virtual_screen(size, manager=manager) as display, started(pilot, display) as (screen, eye):
        keys = screen.keys
        look = wait_for(eye, having("SIMULATED GUN", "Start", "Quit", "Next: P01", "P01 stopped direction on "))
        assert look["size"][0] == look["screen"][0]  # it opens as wide as the screen
        keys.press("Return", "Control_L")
        wait_for(eye, having("Read the code back: type"))
        enter(screen)
        keys.press("Return", "Control_L")
        wait_for(eye, having("The gun is SIMULATED", "Start, simulated", "Leave it"))
        keys.press("s", "Control_L")
        wait_for(eye, having("P01 stopped direction on ", "Go on with it", "Set it aside, start anew"))
        keys.press("n", "Control_L")
        wait_for(eye, having("Type why, first.", "Go on with it"))
        keys.press("e", "Alt_L")
        wait_for(eye, having("Exclude P01?", "Exclude P01  ["))
        keys.press("t", "Control_L")
        wait_for(eye, having("STAND CLEAR", "EMERGENCY STOP  [F12]", "Call it off", "SIMULATED GUN"))
        keys.press("F12")
        wait_for(eye, having("EMERGENCY STOP", "Nothing was fired. The gun reports: disarmed.", "Back"))


def test_a_run_that_cannot_go_on_as_it_is_says_what_the_window_offers_in_its_stead(pilot: Path, display: str) -> None:
    design = pilot / "pilot" / "direction.toml"
    design.write_text(design.read_text(encoding="utf-8").replace("repetitions = 10", "repetitions = 12"))
    with started(pilot, display) as (screen, eye):
        enter(screen)
        for key, there in (("Return", "The gun is SIMULATED"), ("s", "P01 stopped direction on ")):
            screen.keys.press(key, "Control_L")
            wait_for(eye, having(there))
        screen.keys.press("g", "Control_L")
        look = wait_for(eye, lambda look: any("began with another config" in text for text in look["texts"]))
    (refused,) = (text for text in look["texts"] if "began with another config" in text)
    assert refused.endswith("gives back, or press Start and choose “Set it aside, start anew”.")
    assert look["cut"] == []


def test_type_is_larger_in_a_larger_window() -> None:
    from experiments.screens.console.windows import type_scale

    sizes = [(1024, 600), (1366, 749), (1536, 960), (1920, 1080), (3840, 2160)]
    scales = [type_scale(*size) for size in sizes]
    assert scales == sorted(set(scales))
    assert type_scale(320, 200) < 1 < type_scale(10_000, 10_000) < 3


# it opens as it was left


@needs_manager
def test_the_window_opens_maximised_and_then_as_it_was_left(pilot: Path) -> None:
    with virtual_screen("1600x1000", manager=True) as display:
        with started(pilot, display) as (screen, eye):
            wait_for(eye, lambda look: look.get("maximised", False))
            screen.keys.press("d", "Alt_L")  # a key that does nothing here
            toggle(display)
            left = wait_for(eye, lambda look: look.get("maximised") is False and look["size"][0] < 1600)
            screen.keys.press("q", "Control_L")
            assert screen.end()[0] == 0
        with started(pilot, display) as (screen, eye):
            assert wait_for(eye, lambda look: "size" in look)["size"] == left["size"]
            screen.keys.press("q", "Control_L")
            assert screen.end()[0] == 0


def toggle(display: str) -> None:
    """Have the window made smaller, as by its title bar: the window manager is asked, as a pager would."""
    from Xlib import X
    from Xlib.display import Display
    from Xlib.protocol.event import ClientMessage

    at = Display(display)
    root = at.screen().root
    (number,) = root.get_full_property(at.intern_atom("_NET_ACTIVE_WINDOW"), X.AnyPropertyType).value
    window = at.create_resource_object("window", number)
    across, down = (at.intern_atom(f"_NET_WM_STATE_MAXIMIZED_{axis}") for axis in ("HORZ", "VERT"))
    message = ClientMessage(
        window=window, client_type=at.intern_atom("_NET_WM_STATE"), data=(32, [0, across, down, 1, 0])
    )
    root.send_event(message, event_mask=X.SubstructureRedirectMask | X.SubstructureNotifyMask)
    at.sync()
    window.configure(width=1100, height=700)
    at.sync()
    at.close()


# it ends when it is told to


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_start_window(number: signal.Signals, pilot: Path, display: str) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        screen.process.send_signal(number)
        code, said = screen.end()
    assert code == 130
    assert said == f"recoil: ended by {number.name}\n"


def test_a_signal_ends_the_question_of_an_unfinished_run(pilot: Path, display: str) -> None:
    command = ["run", pilot / "pilot" / "direction.toml", "--screen", "console", "--participant", "P01"]
    before = (pilot / LONG / "sub-P01" / "sub-P01_task-direction_journal.jsonl").read_bytes()
    with AtDisplay([*command, "--results", LONG], pilot, display) as screen:
        screen.focus_on("unfinished")
        screen.process.terminate()
        assert screen.end()[0] == 130
    assert (pilot / LONG / "sub-P01" / "sub-P01_task-direction_journal.jsonl").read_bytes() == before


@needs_manager
def test_the_question_of_an_unfinished_run_is_no_wider_than_the_screen(
    pilot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("QT_SCALE_FACTOR", "1.5")
    command = ["run", pilot / "pilot" / "direction.toml", "--screen", "console", "--participant", "P01"]
    with (
        virtual_screen("1024x768", manager=True) as display,
        AtDisplay([*command, "--results", LONG], pilot, display) as screen,
    ):
        left, _, width, _ = screen.focus_on("unfinished")
    assert left >= 0
    assert left + width <= 1024


def test_a_signal_in_a_test_shot_disarms_and_ends_it(pilot: Path, display: str) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        screen.keys.press("t", "Control_L")
        wait_for(eye, having("STAND CLEAR"))
        screen.process.terminate()
        code, _ = screen.end()
    assert code == 130
    assert not any("Fired" in look["texts"] for look in watched_start.seen(eye))


@pytest.mark.parametrize(("key", "ends"), [("F12", "EMERGENCY STOP"), ("Escape", "Not fired")])
def test_no_menu_takes_the_keys_of_a_test_shot(pilot: Path, display: str, key: str, ends: str) -> None:
    """Every line of text has one elsewhere, of which the first key and the first click are."""
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        screen.keys.press("t", "Control_L")
        wait_for(eye, having("STAND CLEAR"))
        screen.ask_for_menu(*((300, y) for y in range(60, 400, 40)))
        screen.keys.press(key)
        wait_for(eye, having(ends, "Nothing was fired."))
    assert not any("Fired" in look["texts"] for look in watched_start.seen(eye))


def test_an_escape_that_is_let_go_in_a_test_shot_counts_again_behind_it(pilot: Path, display: str) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        hold_down(screen, "Escape")
        screen.keys.press("t", "Control_L")
        wait_for(eye, having("STAND CLEAR"))
        hold_down(screen, "Escape", down=False)
        screen.keys.press("F12")
        wait_for(eye, having("EMERGENCY STOP", "Nothing was fired."))
        time.sleep(HAND_S)
        screen.keys.press("Escape")
        wait_for(eye, having("Next: P01"))


@needs_manager
def test_no_test_shot_is_fired_while_another_program_has_the_keyboard(pilot: Path) -> None:
    with virtual_screen("1280x800", manager=True) as display, started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        with taken_keyboard(display):
            time.sleep(5 * HAND_S)
            screen.keys.click(*TEST_SHOT)
            wait_for(eye, having("Not fired"))  # the countdown may be over before it is looked at
    assert not any("Fired" in look["texts"] for look in watched_start.seen(eye))


TEST_SHOT = (637, 772)
"""Where its button is in a window of 1280 x 800."""


def test_f12_is_heard_while_a_menu_is_open(pilot: Path, display: str) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        screen.ask_for_menu((300, 40))
        time.sleep(HAND_S)
        screen.keys.press("F12")
        wait_for(eye, having("F12 is heard."))
        screen.keys.press("q", "Control_L")  # the menu is closed
        assert screen.end()[0] == 0


def begin_another(screen: AtDisplay, code: str) -> None:
    """Somebody else than who is next begins."""
    screen.keys.press("Tab", "Shift_L")
    screen.keys.type(code)
    screen.keys.press("Tab")
    enter(screen, code)
    screen.keys.press("Return", "Control_L")
    screen.keys.press("s", "Control_L")


def test_a_signal_in_a_run_ends_the_day_as_well(pilot: Path, display: str) -> None:
    journal = pilot / LONG / "sub-P02" / "sub-P02_task-direction_journal.jsonl"
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        begin_another(screen, "P02")
        wait_until(lambda: last_record(journal).get("kind") == "step")
        opened = len(watched_start.seen(eye))
        screen.process.terminate()
        code, said = screen.end()
    assert code == 130, said
    assert last_record(journal)["kind"] == "stopped"
    assert not any(look["texts"] for look in watched_start.seen(eye)[opened:])


SLOW_MARKERS = """
import time
time.sleep(3)
IRREGULAR_RATE, local_clock = 0.0, time.monotonic
class Any:
    def __init__(self, *_): pass
    def __getattr__(self, name): return lambda *_: self
    def have_consumers(self): return False
StreamInfo = StreamOutlet = Any
def resolve_bypred(*_): return [1, 2]
"""
"""A library of markers that takes its time to start."""


@contextmanager
def while_markers_start(pilot: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[AtDisplay]:
    """As a run of P02 is to begin."""
    (pilot / "fake").mkdir()
    (pilot / "fake" / "pylsl.py").write_text(SLOW_MARKERS)
    monkeypatch.setenv("PYTHONPATH", f"{pilot / 'fake'}{os.pathsep}{ROOT}")
    with (
        virtual_screen("1280x800", manager=True) as display,
        started(pilot, display, "--lsl") as (screen, eye),
    ):
        wait_for(eye, having("Next: P01"))
        begin_another(screen, "P02")
        wait_until(lambda: "please wait" in screen.keys.title_at(640, 400))
        time.sleep(10 * HAND_S)  # the window manager gives it the keys
        yield screen


@needs_manager
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=["TERM", "INT"])
def test_a_signal_while_markers_are_starting_ends_the_program_and_begins_no_run(
    pilot: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    with while_markers_start(pilot, monkeypatch) as screen:
        screen.process.send_signal(number)
        code, said = screen.end()
    assert code == 130
    assert "Traceback" not in said
    assert not (pilot / LONG / "sub-P02" / "sub-P02_task-direction_journal.jsonl").exists()


@needs_manager
def test_f12_while_markers_are_starting_halts_the_run_as_it_begins(
    pilot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = pilot / LONG / "sub-P02" / "sub-P02_task-direction_journal.jsonl"
    with while_markers_start(pilot, monkeypatch) as screen:
        screen.keys.press("F12")
        wait_until(lambda: bool(remarks(journal)))
        assert [one["kind"] for one in remarks(journal)] == ["halted"]
        screen.kill()


def wait_until(happened: Callable[[], bool], timeout_s: float = 60) -> None:
    end_s = time.monotonic() + timeout_s
    while not happened() and time.monotonic() < end_s:
        time.sleep(0.02)
    assert happened()


# hands


@pytest.mark.parametrize("keys", [["Menu"], ["Tab", "Tab", "space"]], ids=["menu of a field", "list"])
def test_f12_is_heard_where_a_menu_or_a_list_would_take_every_key(pilot: Path, display: str, keys: list[str]) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        for key in keys:
            screen.keys.press(key)
        time.sleep(HAND_S)
        screen.keys.press("F12")
        wait_for(eye, having("F12 is heard. Nothing is armed here"))
        screen.kill()


def test_a_key_that_is_held_tests_one_method(pilot: Path, display: str) -> None:
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        hold_down(screen, "Control_L", "t")
        wait_for(eye, having("Fired", "Vibration: the gun vibrated"))
        time.sleep(1.0)  # the server repeats a held key some 25 times a second
        hold_down(screen, "t", "Control_L", down=False)
        looks = watched_start.seen(eye)
        screen.keys.press("Escape")
        screen.keys.press("q", "Control_L")
        assert screen.end()[0] == 0
    begun = [look for look, before in zip(looks[1:], looks, strict=False) if began(look) and not began(before)]
    assert len(begun) == 1


def began(look: dict[str, Any]) -> bool:
    return "STAND CLEAR" in look["texts"]


def hold_down(screen: AtDisplay, *names: str, down: bool = True) -> None:
    """Press keys and keep them down, or let them go."""
    from Xlib import XK, X
    from Xlib.ext import xtest

    display = screen.keys.display
    for name in names:
        code = display.keysym_to_keycode(XK.string_to_keysym(name))
        xtest.fake_input(display, X.KeyPress if down else X.KeyRelease, code)
    display.sync()


def test_a_double_press_of_practice_practises_once(pilot: Path, display: str) -> None:
    practice = pilot / LONG / "sub-P01"
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        enter(screen)
        screen.keys.press("p", "Control_L")
        wait_for(eye, having("The gun is SIMULATED", "Practise, simulated", "Leave it"))
        for _ in range(2):
            screen.keys.press("s", "Control_L")
        wait_until(lambda: last_record(practice / "sub-P01_task-direction_practice_journal.jsonl") != {})
        screen.process.terminate()
        assert screen.end()[0] == 130
    assert len(list(practice.glob("*practice_journal*"))) == 1


def test_starting_anew_from_the_window_keeps_the_reason(pilot: Path, display: str) -> None:
    folder = pilot / LONG / "sub-P01"
    with started(pilot, display) as (screen, eye):
        wait_for(eye, having("Next: P01"))
        enter(screen)
        screen.keys.press("Return", "Control_L")
        screen.keys.press("s", "Control_L")
        wait_for(eye, having("P01 stopped direction on ", "Go on with it"))
        screen.keys.press("n", "Control_L")  # without a reason the line for it gets the keys
        screen.keys.type("loose")
        wait_for(eye, lambda look: "loose" in look["texts"])
        time.sleep(HAND_S)
        screen.keys.press("n", "Control_L")
        wait_until(lambda: len(list(folder.glob("*journal*.jsonl"))) == 2)
        wait_until(lambda: last_record(folder / "sub-P01_task-direction_journal.jsonl").get("kind") == "step")
        screen.process.terminate()
        assert screen.end()[0] == 130
    said = [(one.kind, getattr(one, "reason", "")) for _, one in read_register(pilot / LONG).entries]
    assert said == [("joined", ""), ("set-aside", "loose")]


# what was asked for on the command line


def test_what_was_asked_for_is_ticked_and_a_screen_that_is_not_there_is_refused(pilot: Path, display: str) -> None:
    ticks = ("--participant-screen", "--participant-keys", "--noise", "--participant-monitor", 0)
    with started(pilot, display, *ticks) as (screen, eye):
        look = wait_for(eye, having("rates on their own screen"))
        assert look["ticked"] == ["rates on their own screen", "answers with own keys", "hears masking noise"]
        screen.keys.press("q", "Control_L")
        assert screen.end()[0] == 0
    command = ["run", pilot / "pilot" / "direction.toml", "--screen", "console", "--participant-monitor", 7]
    with AtDisplay(command, pilot, display) as screen:
        code, said = screen.end()
    assert code == 2
    assert "--participant-monitor 7: there is no such screen; known are 0: " in said


def test_where_there_can_be_no_markers_the_window_says_so_and_begins_no_run(
    pilot: Path, display: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (pilot / "fake").mkdir()
    (pilot / "fake" / "pylsl.py").write_text("raise ImportError('no pylsl')")
    monkeypatch.setenv("PYTHONPATH", str(pilot / "fake"))
    before = read_register(pilot / LONG)
    with started(pilot, display, "--lsl") as (screen, eye):
        assert "sends markers (LSL)" in wait_for(eye, having("Next: P01"))["ticked"]
        enter(screen)
        screen.keys.press("p", "Control_L")
        wait_for(eye, having("The gun is SIMULATED"))
        screen.keys.press("s", "Control_L")
        said = wait_for(eye, having("no markers: no Lab Streaming Layer here (no pylsl): install the extra `lsl`"))
        assert any("The run was not begun: mend that, or untick" in text for text in said["texts"])
        screen.focus_on("start")  # a window that follows another has its texts before it has the keys
        time.sleep(HAND_S)
        screen.keys.press("q", "Control_L")
        assert screen.end()[0] == 0
    assert not list((pilot / LONG).glob("sub-*/*practice*"))
    assert before != read_register(pilot / LONG)
