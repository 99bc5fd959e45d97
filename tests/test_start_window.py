"""The start window by keys, fields and clicks, off screen: what it proposes, asks, refuses, records and chooses."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("PyQt6")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PyQt6.QtCore import QEvent, QPoint, QPointF, QRect, Qt
from PyQt6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent
from PyQt6.QtTest import QTest
from PyQt6.QtWidgets import QApplication, QPushButton, QScrollArea, QWidget

from experiments.catalogues.catalogue import ENGLISH, language
from experiments.clock import RealClock, VirtualClock
from experiments.live_run import RunStopped
from experiments.load import load_setup
from experiments.record.journal import JournalError, hold_journal
from experiments.record.owed_shot import OWED_FILE, OwedShot, owe_shot, owed_shots, shot_was_fired
from experiments.run import run
from experiments.run_request import ParticipantOptions, RunRequest
from experiments.screens.console import lab_day, shot_check, widgets
from experiments.screens.console.app import application
from experiments.screens.console.form import Opening, PeopleTable
from experiments.screens.console.lab_day import study_of
from experiments.screens.console.shot_check import HUNG
from experiments.screens.console.start import NOTHING_ARMED, StartWindow
from experiments.screens.console.windows import FreshShortcuts
from experiments.screens.synthetic import synthetic_screen
from experiments.study import enrolment, register
from experiments.study.folders import PlaceError, StudyFolder, open_study, place
from experiments.study.new_study import new_study
from experiments.study.register import read_register
from experiments.study.study import Facts, Participant, RunProgress

pytestmark = pytest.mark.slow

FACTS = Facts(age_years=25, sex="female", handedness="right")
PATIENCE_S = 60
TITLE_BAR_PX = 24
SERIAL = "serial:/dev/nowhere"


@pytest.fixture(scope="module", autouse=True)
def qt() -> None:
    application()


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StudyFolder:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    new_study(tmp_path / "pilot")
    return open_study(tmp_path / "pilot")


Open = Callable[..., StartWindow]


@pytest.fixture
def opened(study: StudyFolder, monkeypatch: pytest.MonkeyPatch) -> Iterator[Open]:
    """Opens start windows, with a real gun's address unless told otherwise; none opens the gun before a test shot.

    What came of a shot is read at once.
    """
    windows: list[StartWindow] = []
    monkeypatch.setattr(shot_check, "RESULT_S", -1.0)

    def open_(**how: Any) -> StartWindow:
        window = StartWindow(study, Opening(**{"gun": SERIAL} | how), RealClock())
        windows.append(window)
        window.resize(1280, 800)
        window.show()
        window.activateWindow()
        assert QTest.qWaitForWindowActive(window, 1000 * PATIENCE_S)
        return window

    yield open_
    for window in windows:
        window.close()
        window.deleteLater()


def do(study: StudyFolder, code: str, experiment: str = "direction", records: int | None = None) -> Path:
    """A run by a synthetic participant, to its end or broken off after some records; its journal."""
    where = place(study.results, code, experiment)
    where.folder.mkdir(parents=True, exist_ok=True)
    lines, table = whole_run(code, experiment)
    where.journal.write_bytes(b"".join(lines[:records]))
    if records is None:
        where.table.write_bytes(table)
    return where.journal


@lru_cache
def whole_run(code: str, experiment: str) -> tuple[list[bytes], bytes]:
    """The lines of the journal of a run with the shipped configs, and its table."""
    with tempfile.TemporaryDirectory() as results:
        request = RunRequest(
            setup=load_setup(experiment), participant_id=code, results=Path(results), screen="terminal"
        )
        done = run(request, synthetic_screen, VirtualClock()).place
        return done.journal.read_bytes().splitlines(keepends=True), done.table.read_bytes()


def join(study: StudyFolder, code: str, facts: Facts = FACTS) -> None:
    enrolment.join(study, code, facts, VirtualClock())


def key(window: QWidget, name: str, *held: Qt.KeyboardModifier) -> None:
    """A key pressed and let go, with others held, wherever the keys go to."""
    modifiers = Qt.KeyboardModifier.NoModifier
    for one in held:
        modifiers |= one
    target = QApplication.focusWidget() or window
    QTest.keyClick(target, getattr(Qt.Key, f"Key_{name}"), modifiers)


CTRL, ALT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.AltModifier


def until(happened: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not happened() and time.monotonic() < end_s:
        QTest.qWait(5)
    assert happened()


def fill(window: StartWindow, code: str, facts: Facts | None = FACTS, again: str | None = None) -> None:
    """Fill the form; `again` is what is read back."""
    window.form.code.setText(code)
    window.form.code_again.setText(code if again is None else again)
    if facts is not None:
        window.form.facts["age_years"].setText(str(facts.age_years))
        for fact in ("sex", "handedness"):
            window.form.facts[fact].setCurrentText(getattr(facts, fact))


def question(window: StartWindow) -> str:
    return window.question.text.toPlainText() if window.question is not None else ""


def said(window: StartWindow) -> str:
    return window.saved.toPlainText()


def remark(window: StartWindow) -> str:
    return window.form.remark.toPlainText()


def experiment(window: StartWindow) -> str:
    return str(window.form.experiment.currentText())


def entries(study: StudyFolder) -> list[tuple[str, str]]:
    return [(one.kind, one.participant_id) for _, one in read_register(study.results).entries]


def table(window: StartWindow) -> dict[str, list[str]]:
    rows = range(window.table.rowCount())
    cells = [[window.table.item(row, column).text() for column in range(window.table.columnCount())] for row in rows]
    return {line[0]: line[1:] for line in cells}


# the experiment follows the code


def test_a_code_that_is_typed_sets_the_first_experiment_that_they_have_not_done(
    study: StudyFolder, opened: Open
) -> None:
    do(study, "P01")
    window = opened()
    assert (window.form.code.text(), experiment(window)) == ("P01", "preference")
    window.form.code.clear()
    QTest.keyClicks(window.form.code, "P02")
    assert experiment(window) == "direction"
    assert remark(window) == "P02 is new."
    window.form.code.clear()
    QTest.keyClicks(window.form.code, "P1")
    assert remark(window) == "P1 is new, and P01 is there: is it the same person?"
    window.form.code.setText("X99")
    assert remark(window) == "X99 is new, and the codes of this study begin with P: is it right?"
    window.form.code.clear()
    QTest.keyClicks(window.form.code, "P01")
    assert experiment(window) == "preference"


def test_a_row_that_is_chosen_sets_code_and_experiment(study: StudyFolder, opened: Open) -> None:
    do(study, "P01")
    do(study, "P02", records=40)
    window = opened()
    assert window.form.code.text() == "P02"
    window.table.selectRow(0)
    assert (window.form.code.text(), experiment(window)) == ("P01", "preference")


def test_a_row_that_was_chosen_before_is_chosen_again_by_a_click(study: StudyFolder, opened: Open) -> None:
    do(study, "P01")
    window = opened()
    window.table.selectRow(0)
    window.form.code.setText("P09")
    item = window.table.item(0, 0)
    assert item is not None
    place = window.table.visualItemRect(item).center()
    QTest.mouseClick(window.table.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert window.form.code.text() == "P01"


def test_who_comes_back_to_the_window_sees_what_was_done_meanwhile_and_finds_all_that_was_typed(
    study: StudyFolder, opened: Open
) -> None:
    do(study, "P02", records=40)
    window = opened()
    window.table.selectRow(0)
    QTest.keyClicks(window.form.code_again, "P0")
    other = QWidget()
    other.show()
    other.activateWindow()
    assert QTest.qWaitForWindowActive(other, 1000 * PATIENCE_S)
    do(study, "P01")
    do(study, "P02")
    assert window.table.rowCount() == 1
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window, 1000 * PATIENCE_S)
    shown = [[item.text() for at in range(2) if (item := window.table.item(row, at))] for row in range(2)]
    assert shown == [["P01", "done"], ["P02", "done"]]
    assert [item.text() for item in window.table.selectedItems()][:1] == ["P02"]
    assert (window.form.code.text(), window.form.code_again.text()) == ("P02", "P0")
    assert remark(window) == "P02 has done direction."
    other.close()


def test_to_break_the_order_of_the_study_is_said_in_words_and_a_new_code_mends_it(
    study: StudyFolder, opened: Open
) -> None:
    do(study, "P01")
    window = opened()
    window.form.code.setText("P02")
    window.form.experiment.setCurrentText("preference")
    assert remark(window) == "Order broken: direction comes before preference in this study, and P02 has not done it."
    window.form.code.setText("P03")
    assert experiment(window) == "direction"
    assert remark(window) == "P03 is new."


def test_who_was_there_stays_if_they_have_something_left_to_do(study: StudyFolder, opened: Open) -> None:
    for code in ("P01", "P02"):
        join(study, code)
    assert opened(participant_id="P02").form.code.text() == "P02"
    for name in study.experiments:
        do(study, "P02", name)
    assert opened(participant_id="P02").form.code.text() == "P01"


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ("direction", "direction was named, but P01 has done it: preference is chosen."),
        ("preference", ""),
    ],
)
def test_where_the_experiment_is_not_the_one_that_was_named_it_is_said_why(
    named: str, words: str, study: StudyFolder, opened: Open
) -> None:
    do(study, "P01")
    window = opened(named=named)
    assert (said(window), experiment(window)) == (words, "preference")


def test_an_experiment_that_was_named_too_early_is_not_chosen(opened: Open) -> None:
    window = opened(named="preference")
    assert experiment(window) == "direction"
    assert said(window) == "preference was named, but P01 comes to direction first: direction is chosen."


def test_a_config_that_the_study_does_not_name_is_run_alone_by_the_rules_of_the_study(study: StudyFolder) -> None:
    folder = study.source.parent
    shutil.copy(folder / "direction.toml", folder / "mine.toml")
    asked = RunRequest(setup=load_setup(str(folder / "mine.toml")), participant_id="", results=study.results)
    found = study_of(asked)
    assert [one.source.name for one in found.setups] == ["mine.toml"]
    assert found.config == study.config
    named = RunRequest(setup=load_setup(str(folder / "preference.toml")), participant_id="", results=study.results)
    assert [one.source.name for one in study_of(named).setups] == ["direction.toml", "preference.toml"]


def test_what_cannot_be_read_is_said_when_the_window_opens_below_what_there_is_to_say(
    study: StudyFolder, opened: Open
) -> None:
    journal = do(study, "P01")
    journal.write_bytes(b"damage\n")
    first, second = said(opened(said="P02 stopped: emergency stop.")).splitlines()
    assert first == "P02 stopped: emergency stop."
    assert "line 1: not a JSON record" in second


@pytest.mark.parametrize("gun", ["simulated", SERIAL])
@pytest.mark.parametrize("practice", [True, False])
@pytest.mark.parametrize("halted", [True, False])
def test_after_an_emergency_stop_the_next_window_says_that_a_test_shot_comes_first(
    halted: bool, practice: bool, gun: str, study: StudyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was typed, as “emergency stop practised”, is none. A simulated gun owes nothing to the next on it."""
    request = RunRequest(setup=study.setups[0], participant_id="P01", results=study.results, practice=practice, gun=gun)
    choices, told = [request, None], list[str]()

    def choose(_: StudyFolder, opening: Opening, __: object) -> RunRequest | None:
        told.append(opening.said)
        return choices.pop(0)

    def stops(*_: object, **__: object) -> None:
        stop = RunStopped("emergency stop practised")
        stop.halted = halted
        raise stop

    monkeypatch.setattr(lab_day, "choose_run", choose)
    monkeypatch.setattr(lab_day, "run_live", stops)
    lab_day.lab_day(request, (), lambda *_: nullcontext())
    assert "P01 stopped: emergency stop practised." in told[1]
    assert ("Whatever they do next begins with a test shot" in told[1]) is halted
    assert told[1].endswith(", and so does the next run on that gun.") is (halted and gun == SERIAL)


@pytest.mark.parametrize("emptied", [True, False])
def test_nobody_begins_anew_where_the_results_folder_is_gone(emptied: bool, opened: Open, study: StudyFolder) -> None:
    do(study, "P01", records=20)
    window = opened()
    fill(window, "P01")
    study.results.rename(away := study.results.with_name("away"))
    if emptied:  # as where a disk was mounted
        study.results.mkdir()
    for _ in range(2):
        key(window, "Return", CTRL)
        assert window.choice is None
        assert "all that was in it is gone" in said(window)
        assert not remark(window)
        assert window.next.toPlainText().startswith("Nobody can be named next")
        key(window, "P", CTRL)
        assert window.choice is None
    window.form.markers.toggle()  # takes the refusal back
    assert "all that was in it is gone" in remark(window)
    assert not said(window)
    assert not list(study.results.glob("*"))
    if emptied:
        study.results.rmdir()
    away.rename(study.results)
    key(window, "Return", CTRL)
    assert "Go on there, or set it aside" in question(window)


def test_nobody_begins_anew_either_where_the_results_folder_went_while_they_ran(
    opened: Open, study: StudyFolder
) -> None:
    opening: dict[str, Any] = {"had": set()}
    window = opened(**opening)
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert window.choice is not None
    do(study, "P01", records=20)
    study.results.rename(study.results.with_name("away"))
    window = opened(**opening)
    assert "all that was in it is gone" in said(window)
    assert not remark(window)
    fill(window, "P02")
    key(window, "Return", CTRL)
    assert window.choice is None
    assert not study.results.exists()


@pytest.mark.parametrize("ends", ["stopped", "finished", "never began"])
def test_the_folder_of_somebody_who_began_just_now_is_missed(
    ends: str, opened: Open, study: StudyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    join(study, "P02")
    request = RunRequest(setup=study.setups[0], participant_id="P01", results=study.results)
    choices, openings = [request, None], list[Opening]()

    def choose(_: StudyFolder, opening: Opening, __: object) -> RunRequest | None:
        openings.append(opening)
        return choices.pop(0)

    def runs(*_: object, **__: object) -> None:
        if ends != "finished":
            raise RunStopped("moved") if ends == "stopped" else PlaceError("no gun")

    monkeypatch.setattr(lab_day, "choose_run", choose)
    monkeypatch.setattr(lab_day, "run_live", runs)
    lab_day.lab_day(request, (), lambda *_: nullcontext())
    window = opened(had=openings[1].had)  # where their folder is not
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert (window.choice is None) is (ends != "never began")


@pytest.mark.parametrize(("done", "says"), [((), "Next: preference."), (("preference",), "Thank the participant.")])
def test_what_a_window_says_comes_next_is_what_the_participant_has_not_done(
    done: tuple[str, ...], says: str, study: StudyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    for experiment in done:
        do(study, "P01", experiment)
    request = RunRequest(setup=study.setups[0], participant_id="P01", results=study.results)
    choices, told = [request, None], list[str]()
    monkeypatch.setattr(lab_day, "choose_run", lambda *_: choices.pop(0))
    monkeypatch.setattr(lab_day, "run_live", lambda *_, last, **__: told.append(last))
    monkeypatch.setattr(lab_day, "study_of", lambda _: study)
    lab_day.lab_day(request, (), lambda *_: nullcontext())
    assert told == [says]


def test_nobody_begins_where_the_register_is_gone_which_says_who_is_excluded(opened: Open, study: StudyFolder) -> None:
    do(study, "P01", records=20)
    join(study, "P01")
    window = opened()
    (study.results / "participants.jsonl").rename(study.results.parent / "away")
    fill(window, "P03")
    key(window, "Return", CTRL)
    assert window.choice is None
    assert "participants.jsonl: was there, and is gone" in said(window)
    key(window, "R", CTRL)  # the training is nobody's
    assert window.choice is not None


def test_nobody_is_excluded_in_a_new_register_where_the_old_one_is_gone(opened: Open, study: StudyFolder) -> None:
    """It would say of everybody else that they may begin."""
    for code in ("P01", "P02"):
        do(study, code, records=20)
        join(study, code)
    window = opened()
    register = study.results / "participants.jsonl"
    register.rename(away := study.results.parent / "away")
    fill(window, "P01")
    key(window, "E", ALT)
    assert window.question is not None
    window.question.reason.setText("left")
    key(window, "D", CTRL)
    assert "participants.jsonl: was there, and is gone" in said(window)
    assert not register.exists()
    away.rename(register)
    fill(window, "P01")
    key(window, "E", ALT)
    assert window.question is not None
    window.question.reason.setText("left")
    key(window, "D", CTRL)
    assert "left" in register.read_text(encoding="utf-8")


def test_that_somebody_is_new_gives_way_to_why_they_may_not_begin(opened: Open) -> None:
    window = opened()
    fill(window, "P03", again="P04")
    assert remark(window) == "P03 is new."
    key(window, "Return", CTRL)
    assert said(window).startswith("The two codes differ: P03 and P04.")
    assert not remark(window)
    window.form.code_again.setText("P03")
    assert (remark(window), said(window)) == ("P03 is new.", "")


def test_somebody_whose_logs_are_gone_does_not_begin_anew(opened: Open, study: StudyFolder) -> None:
    for code in ("P01", "P02"):
        join(study, code)
        do(study, code, records=20)
    window = opened()
    folder = study.results / "sub-P01"
    folder.rename(away := study.results.parent / "away")
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert window.choice is None
    assert f"{folder.resolve()}: was there, and is gone" in said(window)
    assert not folder.exists()
    assert not remark(window)
    window.form.markers.toggle()
    assert f"{folder.resolve()}: was there, and is gone" in remark(window)
    fill(window, "P02")
    key(window, "Return", CTRL)
    assert "Go on there, or set it aside" in question(window)
    away.rename(folder)
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert "Go on there, or set it aside" in question(window)


HELD = [(), (CTRL,), (ALT,), (Qt.KeyboardModifier.ShiftModifier,), (CTRL, ALT)]


@pytest.mark.parametrize("held", HELD)
def test_f12_is_said_to_be_heard_where_nothing_is_armed(held: tuple[Qt.KeyboardModifier, ...], opened: Open) -> None:
    window = opened()
    key(window, "F12", *held)
    assert said(window) == NOTHING_ARMED


@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("name", ["F12", "Escape"])
def test_whatever_is_held_a_test_shot_is_stopped_and_called_off(
    name: str, held: tuple[Qt.KeyboardModifier, ...], opened: Open
) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, name, *held)
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == {"F12": "EMERGENCY STOP", "Escape": "Not fired"}[name]
    assert window.shots.owed is (name == "F12")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "held", "fired"),
    [("Return", (), False), ("Q", (CTRL,), False), ("K", (), False), ("Shift", (), False), ("T", (), False)],
)
def test_whatever_else_is_pressed_calls_a_test_shot_off(
    opened: Open, monkeypatch: pytest.MonkeyPatch, name: str, held: tuple[Qt.KeyboardModifier, ...], fired: bool
) -> None:
    monkeypatch.setattr(shot_check, "COUNTDOWN_S", 1)
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, name, *held)
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == ("Fired" if fired else "Not fired")
    assert window.isVisible()


def test_a_click_stops_again_whose_button_was_down_as_its_window_was_minimised(opened: Open) -> None:
    window = opened(gun="simulated")
    for names in ("T", "TS"):  # after an emergency stop it is asked for
        for one in names:
            key(window, one, CTRL)
        until(lambda: window.shots.count.text() != "")
        QTest.mousePress(window.shots.stop_button, Qt.MouseButton.LeftButton)
        assert window.shots.stopped
        until(lambda: not window.shots.is_running)
        window.showMinimized()
        window.showNormal()
        window.activateWindow()
        assert QTest.qWaitForWindowActive(window)
        key(window, "Escape")


@pytest.mark.slow
def test_what_came_of_a_shot_is_read_before_the_key_of_the_next(opened: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shot_check, "COUNTDOWN_S", 0)
    monkeypatch.setattr(shot_check, "RESULT_S", 1e9)
    window = opened(gun="simulated")
    for _ in range(2):
        key(window, "T", CTRL)
        until(lambda: window.shots.title.text() == "Fired" and not window.shots.is_running)
    assert window.shots.detail.toPlainText().startswith("Vibration")


# starting


def test_start_chooses_who_was_entered_and_has_their_facts_on_record(study: StudyFolder, opened: Open) -> None:
    window = opened()
    fill(window, "P01")
    window.form.own_screen.setChecked(True)
    key(window, "Return", CTRL)
    choice = window.choice
    assert choice is not None
    assert (choice.participant_id, choice.setup.config.experiment, choice.again) == ("P01", "direction", "ask")
    assert (choice.options, choice.practice) == (ParticipantOptions(screen=True), False)
    assert (choice.screen, choice.gun, choice.results) == ("console", SERIAL, study.results)
    assert not window.isVisible()
    assert read_register(study.results).members["P01"].facts == FACTS


def test_a_run_begins_with_the_configs_as_they_are_when_start_is_pressed(study: StudyFolder, opened: Open) -> None:
    window = opened()
    design = study.setups[0].source
    design.write_text(design.read_text().replace("answer_s = 1.2", "answer_s = 1.3"))
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert window.choice is not None
    assert window.choice.setup.config == load_setup(design).config != study.setups[0].config


EDITED: dict[str, tuple[str, str, str, str]] = {
    "a config that cannot be used": ("direction.toml", "answer_s = 1.2", "answer_s = -1.2", "timing.answer_s"),
    "another experiment": ("study.toml", ', "preference.toml"', "", "not those that this window opened with"),
    "something else asked": ("study.toml", '"sex", ', "", "not those that this window opened with"),
}


@pytest.mark.parametrize("edit", EDITED)
@pytest.mark.parametrize("press", ["Return", "P", "R", "T"])
def test_nothing_begins_while_the_configs_cannot_be_used_or_are_those_of_another_window(
    press: str, edit: str, study: StudyFolder, opened: Open
) -> None:
    window = opened()
    name, before, after, words = EDITED[edit]
    config = study.source.parent / name
    assert before in config.read_text()
    config.write_text(config.read_text().replace(before, after, 1))
    fill(window, "P01")
    key(window, press, CTRL)
    assert words in said(window)
    assert window.choice is None
    assert not window.shots.is_running
    assert entries(study) == []
    assert words in said(opened())


def test_the_language_is_chosen_where_there_are_several_and_chinese_says_that_nobody_checked_it(opened: Open) -> None:
    alone = opened()
    assert not alone.form.languages.isVisible()
    window = opened(languages=(ENGLISH, language("zh")), language="zh")
    assert window.form.languages.isVisible()
    assert window.form.languages.currentText() == "zh (中文, unchecked)"
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert window.choice is not None
    assert window.choice.language.code == "zh"


def test_markers_are_ticked_and_a_sensor_is_named_in_the_window_or_on_the_command_line(opened: Open) -> None:
    plain = opened()
    assert (plain.form.markers.isChecked(), plain.form.sensor.text()) == (False, "")
    fill(plain, "P01")
    plain.form.markers.setChecked(True)
    plain.form.sensor.setText(" csv:/dev/nowhere ")
    key(plain, "Return", CTRL)
    assert plain.choice is not None
    assert (plain.choice.markers, plain.choice.sensor) == (True, "csv:/dev/nowhere")
    named = opened(markers=True, sensor="simulated")
    assert (named.form.markers.isChecked(), named.form.sensor.text()) == (True, "simulated")


@pytest.mark.parametrize(
    ("entered", "words"),
    [
        (("P01", FACTS, ""), "Read the code back"),
        (("P01", FACTS, "P1"), "The two codes differ: P01 and P1"),
        (("", FACTS, ""), "Type the participant's code"),
        (("P 1", FACTS, "P 1"), "must be 1 to 32 letters and digits"),
        (("P01", None, "P01"), "The study asks for what was not given: age, sex, handedness"),
        (("P01", Facts(age_years=31, sex="male", handedness="right"), "P01"), "not eligible: age_years = 31"),
    ],
)
@pytest.mark.parametrize("press", ["Return", "P"])
def test_start_and_practice_refuse_alike_and_record_nothing(
    press: str, entered: tuple[str, Facts | None, str], words: str, study: StudyFolder, opened: Open
) -> None:
    window = opened()
    fill(window, *entered)
    key(window, press, CTRL)
    assert words in said(window)
    assert window.choice is None
    assert entries(study) == []


def test_a_double_click_on_start_starts_once(study: StudyFolder, opened: Open) -> None:
    window = opened()
    closings: list[object] = []
    window.closed.connect(lambda: closings.append(window.choice))
    fill(window, "P01")
    start = next(b for b in window.findChildren(QPushButton) if b.text().startswith("Start"))
    QTest.mouseClick(start, Qt.MouseButton.LeftButton)
    QTest.mouseDClick(start, Qt.MouseButton.LeftButton)
    assert len(closings) == 1
    assert entries(study) == [("joined", "P01")]


def test_a_double_click_on_start_does_not_answer_the_question_that_it_raised(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    fill(window, "P01")
    start = next(b for b in window.findChildren(QPushButton) if b.text().startswith("Start"))
    QTest.mouseClick(start, Qt.MouseButton.LeftButton)
    QTest.mouseDClick(start, Qt.MouseButton.LeftButton)
    assert window.choice is None
    assert question(window).startswith("P01 stopped direction on ")


def test_enter_in_a_field_goes_on_to_the_next_and_never_starts(opened: Open) -> None:
    window = opened()
    fill(window, "P01")
    window.form.code.setFocus()
    seen = []
    for _ in range(3):
        seen.append(QApplication.focusWidget())
        key(window, "Return")
    assert seen == [window.form.code, window.form.code_again, window.form.facts["age_years"]]
    assert window.choice is None


def test_a_code_that_a_scanner_types_at_once_keeps_its_double_digits(opened: Open) -> None:
    window = opened()
    window.form.code.clear()
    for digit in "P0011":  # so fast that Qt takes the second of two for a key that is held
        repeated = window.form.code.text().endswith(digit)
        press = QKeyEvent(QEvent.Type.KeyPress, ord(digit), Qt.KeyboardModifier.NoModifier, digit, repeated)
        QApplication.sendEvent(window.form.code, press)
    assert window.form.code.text() == "P0011"


def test_letters_that_are_typed_are_no_commands(opened: Open) -> None:
    window = opened()
    window.form.code.clear()
    window.form.code.setFocus()
    QTest.keyClicks(window.form.code, "qtpresgn")
    assert window.form.code.text() == "qtpresgn"
    assert window.isVisible()
    assert not window.shots.is_running


def held(widget: QWidget, name: str, modifiers: Qt.KeyboardModifier, text: str = "") -> None:
    """What a key that is held sends again and again."""
    for _ in range(5):
        press = QKeyEvent(QEvent.Type.KeyPress, getattr(Qt.Key, f"Key_{name}"), modifiers, text, True)
        QApplication.sendEvent(widget, press)


def test_a_key_that_is_held_since_before_the_window_does_nothing(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    fill(window, "P01")
    window.form.code_again.setFocus()
    for name in ("Return", "Q", "P", "R", "T"):
        held(window.form.code_again, name, CTRL)
    held(window.form.code_again, "Return", Qt.KeyboardModifier.NoModifier, "\r")
    assert window.form.code_again.text() == "P01"
    assert QApplication.focusWidget() is window.form.code_again
    assert window.choice is None
    assert question(window) == ""
    assert window.isVisible()


def test_the_wheel_over_a_list_does_not_turn_it(opened: Open) -> None:
    window = opened()
    box = window.form.experiment
    wheel = QWheelEvent(
        QPointF(5, 5),
        box.mapToGlobal(QPointF(5, 5)),
        QPoint(0, -120),
        QPoint(0, -120),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(box, wheel)
    assert experiment(window) == "direction"


# an unfinished run


def ask_resume(window: StartWindow, code: str = "P01") -> None:
    fill(window, code)
    key(window, "Return", CTRL)
    assert question(window).startswith(f"{code} stopped direction on ")


def test_to_go_on_is_chosen_by_its_own_key(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    key(window, "G", CTRL)
    assert window.choice is not None
    assert (window.choice.again, window.choice.anew_reason) == ("resume", "")


def test_to_start_anew_takes_a_reason(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    key(window, "N", CTRL)
    assert window.choice is None
    assert said(window) == "Type why, first."
    for words in ("the gun", " came loose"):  # Enter starts nothing, and no blank behind it presses a button
        QTest.keyClicks(QApplication.focusWidget(), words)
        key(window, "Return")
        assert window.choice is None
    key(window, "N", CTRL)
    assert window.choice is not None
    assert (window.choice.again, window.choice.anew_reason) == ("fresh", "the gun came loose")


EDITS: dict[str, Callable[[StartWindow], None]] = {
    "code": lambda window: window.form.code.setText("P02"),
    "read-back": lambda window: window.form.code_again.setText("P0"),
    "experiment": lambda window: window.form.experiment.setCurrentText("preference"),
    "age": lambda window: window.form.facts["age_years"].setText("26"),
    "sex": lambda window: window.form.facts["sex"].setCurrentText("male"),
    "handedness": lambda window: window.form.facts["handedness"].setCurrentText("left"),
    "screen": lambda window: window.form.own_screen.setChecked(True),
    "keys": lambda window: window.form.own_keys.setChecked(True),
    "noise": lambda window: window.form.noise.setChecked(True),
    "another row": lambda window: window.table.selectRow(1),
}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("answer", ["G", "N"])
def test_any_edit_takes_the_question_back_and_its_keys_with_it(
    answer: str, edit: str, study: StudyFolder, opened: Open
) -> None:
    for code in ("P01", "P02"):
        do(study, code, records=40)
    window = opened()
    ask_resume(window)
    assert window.question is not None
    window.question.reason.setText("why not")
    EDITS[edit](window)
    assert question(window) == ""
    key(window, answer, CTRL)
    assert window.choice is None


def test_the_reason_is_no_field_of_the_form_and_takes_nothing_back(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    assert window.question is not None
    window.question.reason.setText("why not")
    assert question(window)


@pytest.mark.parametrize("answer", ["G", "N"])
def test_both_answers_check_once_more_what_may_have_changed_meanwhile(
    answer: str, study: StudyFolder, opened: Open
) -> None:
    journal = do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    assert window.question is not None
    window.question.reason.setText("why not")
    enrolment.exclude(study.results, "P01", "fell ill", VirtualClock())
    key(window, answer, CTRL)
    assert window.choice is None
    assert "P01 is excluded (fell ill)" in said(window)
    assert table(window)["P01"][-1] == "excluded: fell ill"
    assert journal.exists()


@pytest.mark.parametrize("answer", ["G", "N"])
def test_a_run_that_was_opened_elsewhere_meanwhile_is_left_alone(answer: str, study: StudyFolder, opened: Open) -> None:
    journal = do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    assert window.question is not None
    window.question.reason.setText("why not")
    descriptor = hold_journal(journal)
    key(window, answer, CTRL)
    assert window.choice is None
    assert "P01 sits at another console" in said(window)
    assert table(window)["P01"][0].startswith("open elsewhere")
    os.close(descriptor)


def test_a_run_that_is_open_elsewhere_is_shown_as_such(study: StudyFolder, opened: Open) -> None:
    descriptor = hold_journal(do(study, "P01", records=40))
    window = opened()
    assert table(window)["P01"][0].startswith("open elsewhere, ")
    assert window.form.code.text() == "P02"
    fill(window, "P01")
    assert remark(window) == "P01 sits at another console."
    key(window, "Return", CTRL)
    assert question(window) == ""
    os.close(descriptor)


def test_escape_leaves_the_question(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    ask_resume(window)
    key(window, "Escape")
    assert question(window) == ""
    assert window.isVisible()


def test_what_was_said_goes_on_record_with_the_run_and_not_with_a_question_that_is_left(
    study: StudyFolder, opened: Open
) -> None:
    do(study, "P01", records=40)
    window = opened()
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert question(window).startswith("P01 stopped direction on ")
    key(window, "Escape")
    assert entries(study) == []
    key(window, "Return", CTRL)
    key(window, "G", CTRL)
    assert window.choice is not None
    assert entries(study) == [("joined", "P01")]


# facts on record


def test_facts_on_record_are_shown_when_somebody_is_chosen_again(study: StudyFolder, opened: Open) -> None:
    join(study, "P01")
    window = opened(participant_id="P01")
    assert window.form.entered().facts == {"age_years": "25", "sex": "female", "handedness": "right"}
    window.form.code_again.setText("P01")
    key(window, "Return", CTRL)
    assert window.choice is not None
    assert entries(study) == [("joined", "P01")]


def test_facts_of_one_person_do_not_stay_for_another(study: StudyFolder, opened: Open) -> None:
    join(study, "P01")
    window = opened()
    window.form.code.setText("P02")
    assert window.form.entered().facts == {"age_years": "", "sex": "", "handedness": ""}
    window.form.code.setText("P01")
    assert window.form.entered().facts["age_years"] == "25"


def test_facts_typed_for_a_new_code_outlive_the_codes_on_its_way(study: StudyFolder, opened: Open) -> None:
    join(study, "P1", Facts(age_years=22, sex="male", handedness="right"))
    window = opened()
    window.form.code.clear()
    window.form.facts["age_years"].setText("28")
    QTest.keyClicks(window.form.code, "P15")
    assert window.form.entered().facts["age_years"] == "28"


# excluding


def test_somebody_is_excluded_for_a_reason_and_readmitted(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    window = opened()
    fill(window, "P01")
    key(window, "E", ALT)
    assert question(window).startswith("Exclude P01?")
    key(window, "D", CTRL)
    assert said(window) == "Type why, first."
    QTest.keyClicks(QApplication.focusWidget(), "fell ill")
    key(window, "D", CTRL)
    assert register.read_register(study.results).excluded() == {"P01": "fell ill"}
    assert (table(window)["P01"][-1], remark(window)) == ("excluded: fell ill", "P01 is excluded: fell ill.")
    assert window.exclude_button.text().startswith("Readmit")
    key(window, "E", ALT)
    QTest.keyClicks(QApplication.focusWidget(), "well again")
    key(window, "D", CTRL)
    assert register.read_register(study.results).excluded() == {}
    assert entries(study) == [("excluded", "P01"), ("readmitted", "P01")]


def test_who_left_is_not_offered_as_next_and_comes_again_by_being_readmitted(study: StudyFolder, opened: Open) -> None:
    do(study, "P01", records=40)
    enrolment.leave(study.results, "P01", "moved away", VirtualClock())
    window = opened()
    assert window.form.participant_id == "P02"
    fill(window, "P01")
    assert (table(window)["P01"][-1], remark(window)) == ("comes no more: moved away", "P01 comes no more: moved away.")
    key(window, "E", ALT)
    assert question(window).startswith("Readmit P01? On record is: comes no more: moved away.")
    QTest.keyClicks(QApplication.focusWidget(), "is back")
    key(window, "D", CTRL)
    assert entries(study) == [("left", "P01"), ("readmitted", "P01")]


def test_nobody_is_excluded_whom_the_study_does_not_know(study: StudyFolder, opened: Open) -> None:
    window = opened()
    fill(window, "P07")
    key(window, "E", ALT)
    assert question(window) == ""
    assert said(window).startswith("Choose in the table who is to be excluded")


def test_the_exclusion_is_of_the_code_it_was_asked_for(study: StudyFolder, opened: Open) -> None:
    for code in ("P01", "P02"):
        do(study, code, records=40)
    window = opened()
    fill(window, "P01")
    key(window, "E", ALT)
    assert window.question is not None
    window.question.reason.setText("fell ill")
    window.form.code.setText("P02")
    key(window, "D", CTRL)
    assert register.read_register(study.results).excluded() == {}


# the simulated gun


def test_a_person_is_run_on_a_simulated_gun_only_after_a_question(study: StudyFolder, opened: Open) -> None:
    window = opened(gun="simulated")
    fill(window, "P01")
    key(window, "Return", CTRL)
    assert question(window).startswith("The gun is SIMULATED: P01 will feel nothing.")
    assert not read_register(study.results).members
    key(window, "Return", CTRL)
    assert window.choice is None
    assert not read_register(study.results).members
    key(window, "S", CTRL)
    assert window.choice is not None


def test_the_question_of_the_simulated_gun_comes_once_and_then_that_of_the_run(
    study: StudyFolder, opened: Open
) -> None:
    do(study, "P01", records=40)
    window = opened(gun="simulated")
    fill(window, "P01")
    key(window, "Return", CTRL)
    key(window, "S", CTRL)
    assert question(window).startswith("P01 stopped direction on ")
    key(window, "Escape")
    key(window, "Return", CTRL)
    assert question(window).startswith("P01 stopped direction on ")


def test_a_practice_on_a_simulated_gun_is_asked_about_before_anything_is_on_record(
    study: StudyFolder, opened: Open
) -> None:
    window = opened(gun="simulated")
    fill(window, "P01")
    key(window, "P", CTRL)
    assert question(window) == "The gun is SIMULATED: P01 will feel nothing. Practise all the same?"
    key(window, "Escape")
    assert window.choice is None
    assert not read_register(study.results).members
    key(window, "P", CTRL)
    key(window, "S", CTRL)
    assert window.choice is not None
    assert (window.choice.practice, window.choice.training) == (True, False)
    assert entries(study) == [("joined", "P01")]


def test_a_training_needs_no_question(opened: Open) -> None:
    training = opened(gun="simulated")
    key(training, "R", CTRL)
    assert training.choice is not None
    assert (training.choice.participant_id, training.choice.training) == ("training", True)


@pytest.mark.parametrize(("gun", "text"), [("simulated", "SIMULATED GUN"), (SERIAL, f"Gun: {SERIAL}")])
def test_which_gun_it_is_stands_in_the_window(gun: str, text: str, opened: Open) -> None:
    from PyQt6.QtWidgets import QLabel

    window = opened(gun=gun)
    shown = [label for label in window.findChildren(QLabel) if label.objectName() == "gun"]
    assert [label.text() for label in shown] == [text]
    assert shown[0].property("mood") == ("ask" if gun == "simulated" else "wait")


# what is ticked


def test_what_was_asked_for_on_the_command_line_is_ticked(opened: Open) -> None:
    options = ParticipantOptions(screen=True, keys=True, noise=True)
    window = opened(options=options)
    assert window.form.options() == options
    assert opened().form.options() == ParticipantOptions()


def colours_of_box(box: QWidget) -> set[str]:
    image = box.grab(QRect(0, 0, box.height(), box.height())).toImage()
    return {image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())}


def test_where_there_are_several_monitors_the_participants_is_chosen_by_its_number(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert opened().form.options().monitor is None
    screens = ["0: eDP-1, 1920 × 1080", "1: HDMI-1, 1280 × 800", "2: DP-1, 1280 × 800"]
    monkeypatch.setattr("experiments.screens.console.form.monitors", lambda: screens)
    assert opened().form.options().monitor == 2
    window = opened(options=ParticipantOptions(monitor=1))
    assert window.form.monitor.currentText() == "1: HDMI-1, 1280 × 800"
    fill(window, "P01")
    window.form.monitor.setCurrentIndex(0)
    key(window, "Return", CTRL)
    assert window.choice is not None
    assert window.choice.options.monitor == 0


def test_every_field_that_there_can_be_is_seen_at_once(opened: Open, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("experiments.screens.console.form.monitors", lambda: ["0: eDP-1", "1: HDMI-1"])
    window = opened(languages=(ENGLISH, language("zh")))
    window.resize(1280, 800 - TITLE_BAR_PX)
    window.form.remark.say("a remark\nof two lines", "ask")
    assert window.form.monitor.isVisible()
    bar = window.form.findChild(QScrollArea).verticalScrollBar()
    assert bar is not None
    until(lambda: bar.maximum() == 0)


def test_a_ticked_box_shows_a_tick(opened: Open) -> None:
    box = opened().form.noise
    tick = widgets.colour("dark", "ground")  # of a box that is ticked, on a ground of another colour
    assert tick not in colours_of_box(box)
    box.setChecked(True)
    assert {tick, widgets.colour("dark", "act")} <= colours_of_box(box)


# test shots


def test_each_method_of_the_experiment_is_tested_in_turn_and_the_next_one_is_named(
    study: StudyFolder, opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 0)
    window = opened(gun="simulated")
    for shown, title in [
        ("Vibration", "Vibration: the gun vibrated"),
        ("Asymmetric Force I, damper OFF", "Asymmetric Force I: the coil was driven at 16 V"),
        ("Asymmetric Force II, damper ON", "Asymmetric Force II: the coil was driven at 16 V"),
    ]:
        assert window.test_button.text() == f"Test shot: {shown}  [Ctrl+T]"
        key(window, "T", CTRL)
        until(lambda: not window.shots.is_running)
        assert window.shots.title.text() == "Fired"
        assert window.shots.detail.toPlainText().startswith(title)
        key(window, "Escape")
        assert window.pages.currentIndex() == 0
    assert window.test_button.text() == "Test shot: Vibration  [Ctrl+T]"


def test_while_a_test_shot_is_under_way_nothing_else_can_be_begun(opened: Open) -> None:
    window = opened(gun="simulated")
    fill(window, "P01")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    assert window.shots.title.text() == "STAND CLEAR"
    for name in ("Return", "P", "R", "T"):
        key(window, name, CTRL)
    assert window.choice is None
    key(window, "Escape")
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "Not fired"
    assert window.shots.detail.toPlainText() == "Nothing was fired. The gun reports: disarmed."
    assert window.shots.next_text() == "Test shot: Vibration"


def test_a_double_click_on_the_button_of_the_test_shot_neither_stops_it_nor_calls_it_off(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 1)
    window = opened(gun="simulated")
    place = window.test_button.mapTo(window, window.test_button.rect().center())
    QTest.mouseClick(window.test_button, Qt.MouseButton.LeftButton)
    until(lambda: window.shots.title.text() == "STAND CLEAR")  # and the page has taken its places
    under = window.childAt(place)
    QTest.mouseClick(under, Qt.MouseButton.LeftButton, pos=under.mapFrom(window, place))
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "Fired"


@pytest.mark.parametrize("by_mouse", [False, True])
def test_a_press_to_call_off_that_comes_behind_the_shot_leaves_what_came_of_it_to_be_read(
    opened: Open, monkeypatch: pytest.MonkeyPatch, by_mouse: bool
) -> None:
    monkeypatch.setattr(shot_check, "COUNTDOWN_S", 0)
    window = opened(gun="simulated")
    for read_s, page in ((1e9, 1), (-1.0, 0)):
        monkeypatch.setattr(shot_check, "RESULT_S", read_s)
        if not window.pages.currentIndex():
            key(window, "T", CTRL)
            until(lambda: window.shots.title.text() == "Fired" and not window.shots.is_running)
        if by_mouse:
            QTest.mouseClick(window.shots.call_off_button, Qt.MouseButton.LeftButton)
        else:
            key(window, "Escape")
        assert window.pages.currentIndex() == page


def test_the_same_key_again_calls_a_test_shot_off_and_begins_no_other_at_once(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shot_check, "RESULT_S", 1e9)
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, "T", CTRL)
    until(lambda: not window.shots.is_running)
    key(window, "T", CTRL)
    assert not window.shots.is_running
    assert window.shots.title.text() == "Not fired"
    key(window, "Escape")
    assert window.pages.currentIndex() == 0


@pytest.mark.parametrize(("apart_s", "taken"), [(0.0, True), (0.3, False)])
def test_a_repeat_that_a_busy_machine_tells_as_a_new_press_is_none_of_a_key_that_went_down_unseen(
    opened: Open, monkeypatch: pytest.MonkeyPatch, apart_s: float, taken: bool
) -> None:
    """Esc that calls a test shot off is taken before shortcuts see it."""
    fresh = FreshShortcuts(opened())
    for kind, at_s, kept in (("KeyRelease", 5.0, False), ("ShortcutOverride", 5.0 + apart_s, taken)):
        monkeypatch.setattr("experiments.screens.console.windows.machine_s", lambda at_s=at_s: at_s)
        event = QKeyEvent(getattr(QEvent.Type, kind), Qt.Key.Key_Escape, Qt.KeyboardModifier.NoModifier)
        assert fresh.eventFilter(None, event) is kept


@pytest.mark.parametrize(("place", "acts"), [(28, True), (29, False)])
def test_a_key_of_another_alphabet_acts_by_its_place(opened: Open, place: int, acts: bool) -> None:
    """A keyboard of Cyrillic letters alone has the one on T's place; the one beside it is no shortcut."""
    window = opened(gun="simulated")
    fresh = FreshShortcuts(window)
    event = QKeyEvent(QEvent.Type.ShortcutOverride, ord("Е"), CTRL, place, 0, 0, "е")
    assert fresh.eventFilter(None, event) is acts
    assert (window.pages.currentWidget() is window.shots) is acts
    key(window, "Escape")
    until(lambda: not window.shots.is_running)


@pytest.mark.parametrize(("name", "title"), [("stop_button", "EMERGENCY STOP"), ("call_off_button", "Not fired")])
def test_a_button_that_stops_a_test_shot_does_so_as_it_goes_down(opened: Open, name: str, title: str) -> None:
    """And what came of it stays there as it is let go."""
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    button = getattr(window.shots, name)
    QTest.mousePress(button, Qt.MouseButton.LeftButton)
    until(lambda: not window.shots.is_running)
    QTest.mouseRelease(button, Qt.MouseButton.LeftButton)
    assert window.shots.title.text() == title
    assert window.pages.currentWidget() is window.shots


@pytest.mark.parametrize("name", ["Start", "Practice", "Training", "Test shot", "Quit"])
def test_the_second_press_of_a_double_click_presses_nothing(name: str, opened: Open) -> None:
    """It may have begun on a page that the first one left: with Back on the page of the test shot, say."""
    window = opened(gun="simulated")
    fill(window, "P01")
    beneath = next(b for b in window.findChildren(QPushButton) if b.text().startswith(name))
    at = QPointF(beneath.rect().center())
    for kind in (QEvent.Type.MouseButtonDblClick, QEvent.Type.MouseButtonRelease):
        left = Qt.MouseButton.LeftButton
        held = left if kind is QEvent.Type.MouseButtonDblClick else Qt.MouseButton.NoButton
        there = QMouseEvent(kind, at, beneath.mapToGlobal(at), left, held, Qt.KeyboardModifier.NoModifier)
        QApplication.sendEvent(beneath, there)
    assert (window.choice, question(window), window.isVisible()) == (None, "", True)
    assert window.pages.currentWidget() is not window.shots


def test_a_window_that_hangs_from_the_press_on_fires_no_test_shot(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 1)
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    for thread in threading.enumerate():  # nothing is heard here until it has ended
        if thread.name == "test shot":
            thread.join()
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "Not fired"
    assert window.shots.detail.toPlainText().startswith(HUNG)


def test_a_stop_was_heard_though_another_window_had_the_keys_behind_it(opened: Open) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, "F12")
    window.shots.call_off("Another window had the keys.")
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "EMERGENCY STOP"
    assert "Another window" not in window.shots.detail.toPlainText()


def test_an_escape_that_is_held_calls_off_and_does_not_leave_what_came_of_it(opened: Open) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, "Escape")
    until(lambda: not window.shots.is_running)
    held(window.shots.call_off_button, "Escape", Qt.KeyboardModifier.NoModifier)
    assert window.pages.currentWidget() is window.shots


def test_the_emergency_stop_of_a_test_shot_says_what_the_gun_reports(opened: Open) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, "F12")
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "EMERGENCY STOP"
    assert window.shots.detail.toPlainText() == "Nothing was fired. The gun reports: disarmed."
    key(window, "T", CTRL)
    assert not window.shots.is_running
    assert not window.shots.next_button.isVisible()
    key(window, "Escape")
    assert said(window) == "The last test shot ended by an emergency stop."
    key(window, "T", CTRL)
    assert not window.shots.is_running
    assert "Is the gun where it hurts nobody?" in question(window)
    key(window, "S", CTRL)
    assert window.shots.is_running
    key(window, "Escape")
    until(lambda: not window.shots.is_running)
    key(window, "Escape")
    key(window, "T", CTRL)
    assert not window.shots.is_running  # none was fired: it is asked again
    assert "Is the gun where it hurts nobody?" in question(window)


def is_asked_for_a_test_shot(window: StartWindow, begins: str) -> None:
    """Nothing begins before it, and it is fired."""
    key(window, begins, CTRL)
    assert window.choice is None
    assert "A test shot comes first. Is the gun where it hurts nobody?" in question(window)
    key(window, "S", CTRL)
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "Fired"


@pytest.mark.parametrize("begins", ["Return", "P", "R"])
def test_after_an_emergency_stop_of_a_test_shot_nothing_begins_before_one_was_fired(
    begins: str, opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 1)
    window = opened(gun="simulated")
    fill(window, "P01")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    key(window, "F12")
    until(lambda: not window.shots.is_running)
    key(window, "Escape")
    is_asked_for_a_test_shot(window, begins)
    key(window, "Escape")
    key(window, begins, CTRL)
    key(window, "S", CTRL)  # simulated, all the same
    assert window.choice is not None


def test_a_test_shot_that_an_emergency_stop_left_owed_is_owed_in_later_windows_too(
    opened: Open, study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 1)
    with a_gun(tmp_path) as gun:
        first = opened(gun=gun)
        key(first, "T", CTRL)
        until(lambda: first.shots.count.text() != "")
        key(first, "F12")
        until(lambda: not first.shots.is_running and len(owed_shots(study.results)) == 1)
        first.close()
        window = opened(gun=gun)
        assert said(window) == "The last test shot ended by an emergency stop."
        fill(window, "P01")
        is_asked_for_a_test_shot(window, "Return")
        until(lambda: not owed_shots(study.results))
    assert not opened(gun=gun).shots.owed


@contextmanager
def a_gun(folder: Path, serial: str = "7") -> Iterator[str]:
    """The address of a gun on a line, which calls itself no twin."""
    from device.twin.core import IDENTITY
    from tests.twins import a_twin

    with a_twin(folder, speed=1.0, identity=replace(IDENTITY, serial=serial)) as (_, socket):
        yield f"serial:{socket.address}"


def test_a_simulated_gun_owes_nothing(opened: Open, study: StudyFolder) -> None:
    owe_shot(study.results, OwedShot(utc="2026-01-01T00:00:00.000+00:00", gun="", address=SERIAL))
    assert not opened(gun="simulated").shots.owed
    assert not opened(gun="serial:/dev/other").shots.owed
    assert opened().shots.owed


@pytest.mark.parametrize(
    "rubbish", [b"", b"\n", b" ", b"gone", b"[]", b'{"utc": 1}', b'{"utc": 1, "gun": "", "address": ""}', b"\xff\n"]
)
def test_a_file_of_owed_test_shots_that_nobody_can_read_owes_one(
    rubbish: bytes, opened: Open, study: StudyFolder
) -> None:
    study.results.mkdir(exist_ok=True)
    (study.results / OWED_FILE).write_bytes(rubbish)
    assert opened().shots.owed
    shot_was_fired(study.results, "shaker:7", SERIAL)
    assert not owed_shots(study.results)


def test_no_debt_is_lost_where_two_windows_write_them_at_once(study: StudyFolder) -> None:
    study.results.mkdir(exist_ok=True)

    def owe(window: int) -> None:
        for number in range(20):
            gun = f"shaker:{window}-{number}"
            owe_shot(study.results, OwedShot(utc="2026-01-01T00:00:00.000000Z", gun=gun, address=SERIAL))

    with ThreadPoolExecutor(2) as windows:
        list(windows.map(owe, range(2)))
    assert len(owed_shots(study.results)) == 40


def test_a_test_shot_pays_what_its_own_gun_owes(study: StudyFolder) -> None:
    guns = [
        ("", "serial:auto"),
        ("shaker:7", "serial:auto"),
        ("shaker:7", "serial:other"),
        ("shaker:8", SERIAL),
        ("", SERIAL),
    ]
    for gun, address in guns:
        owe_shot(study.results, OwedShot(utc="2026-01-01T00:00:00.000+00:00", gun=gun, address=address))
    shot_was_fired(study.results, "shaker:7", "serial:auto")
    assert [(one.gun, one.address) for one in owed_shots(study.results)] == guns[3:]


def test_what_a_gun_owes_that_was_at_the_address_it_owes_elsewhere(study: StudyFolder) -> None:
    owe_shot(study.results, OwedShot(utc="2026-01-01T00:00:00.000+00:00", gun="shaker:8", address=SERIAL))
    shot_was_fired(study.results, "shaker:7", SERIAL)
    (owed,) = owed_shots(study.results)
    assert owed.gun == "shaker:8"
    assert owed.address not in ("", SERIAL)


def test_a_test_shot_is_called_off_where_another_window_has_the_keys(opened: Open) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    other = QWidget()
    other.show()
    other.activateWindow()
    until(lambda: not window.shots.is_running)
    assert window.shots.title.text() == "Not fired"
    assert window.shots.detail.toPlainText().startswith("Another window had the keys")
    assert not window.shots.owed
    other.deleteLater()


@pytest.mark.parametrize("name", ["Space", "Return", "Enter"])
def test_a_key_pressed_behind_a_test_shot_neither_stops_nor_fires(
    name: str, opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 0)
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: not window.shots.is_running)
    key(window, name)
    assert not window.shots.owed
    assert not window.shots.is_running


def stopped_with(obstacle: Callable[[], object], window: StartWindow) -> None:
    """A test shot is stopped where something is in the way of its record, which is said."""
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    obstacle()
    key(window, "F12")
    until(lambda: not window.shots.is_running)
    until(lambda: window.shots.detail.toPlainText().count(UNKEPT) == 1)
    assert "The gun reports: disarmed." in window.shots.detail.toPlainText()


UNKEPT = f"{OWED_FILE} does not keep that a test shot is owed ("


@pytest.mark.parametrize("away", [True, False])
@pytest.mark.parametrize("closes", [True, False])
def test_that_a_test_shot_is_owed_is_kept_as_soon_as_the_disk_takes_it(
    away: bool, closes: bool, opened: Open, study: StudyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.record.owed_shot.RETRY_S", 3600.0 if closes else 0.01)
    results, file, elsewhere = study.results, study.results / OWED_FILE, study.results.with_name("away")
    results.mkdir(exist_ok=True)
    with a_gun(results.parent) as gun:
        window = opened(gun=gun)
        stopped_with(lambda: results.rename(elsewhere) if away else file.mkdir(), window)
    assert not (away and results.exists())
    if away:
        elsewhere.rename(results)
    else:
        file.rmdir()
    if closes:
        window.close()
        window.shots.end(wait=True)
    else:
        until(lambda: UNKEPT not in window.shots.detail.toPlainText())
    assert [(one.gun, one.address) for one in owed_shots(results)] == [("haptic-gun:7", gun)]


def test_what_is_owed_and_not_kept_when_the_window_closes_is_said(
    opened: Open, study: StudyFolder, tmp_path: Path
) -> None:
    study.results.mkdir(exist_ok=True)
    with a_gun(tmp_path) as gun:
        window = opened(gun=gun)
        stopped_with((study.results / OWED_FILE).mkdir, window)
    window.close()
    with pytest.raises(JournalError, match=re.escape(f"{UNKEPT}Is a directory)")):
        window.shots.end(wait=True)


def test_what_is_fired_before_the_stop_is_kept_is_not_owed(
    opened: Open, study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 1)
    study.results.mkdir(exist_ok=True)
    with a_gun(tmp_path) as gun:
        window = opened(gun=gun)
        stopped_with((study.results / OWED_FILE).mkdir, window)
        key(window, "Escape")
        is_asked_for_a_test_shot(window, "R")
        assert UNKEPT not in window.shots.detail.toPlainText()
    (study.results / OWED_FILE).rmdir()
    window.close()
    window.shots.end(wait=True)
    assert not owed_shots(study.results)


def test_what_stands_in_place_of_the_owed_test_shots_is_one_message(study: StudyFolder) -> None:
    """Of a window as of a run, before anything has begun; a simulated gun owes nothing."""
    (study.results / OWED_FILE).mkdir(parents=True)
    said = (
        f"{study.results / OWED_FILE}: cannot be read (Is a directory), and says which guns owe a test shot after an "
        "emergency stop; have it readable, or put away what stands there and fire a test shot before anything else"
    )
    with pytest.raises(JournalError, match=f"^{re.escape(said)}$"):
        StartWindow(study, Opening(gun=SERIAL), RealClock())
    request = RunRequest(setup=load_setup("direction"), participant_id="P01", results=study.results, screen="terminal")
    with pytest.raises(JournalError, match=f"^{re.escape(said)}$"):
        run(replace(request, gun=SERIAL), synthetic_screen, VirtualClock())
    assert not place(study.results, "P01", "direction").folder.exists()
    assert run(request, synthetic_screen, VirtualClock()).saved


@pytest.mark.parametrize("named", [True, False])
def test_a_twin_owes_a_test_shot_to_its_window_alone(
    named: bool, opened: Open, study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As every simulated gun; also where it was stopped before anybody knew what it is."""
    from tests.twins import a_twin

    opens, may_open = shot_check.open_gun, threading.Event()

    def open_gun(*args: Any, **more: Any) -> Any:
        assert may_open.wait(PATIENCE_S)
        return opens(*args, **more)

    monkeypatch.setattr("experiments.screens.console.shot_check.open_gun", open_gun)
    other = OwedShot(utc="2026-01-01T00:00:00.000+00:00", gun="shaker:8", address=SERIAL)
    owe_shot(study.results, other)
    with a_twin(tmp_path, speed=1.0) as (_, socket):
        window = opened(gun=f"serial:{socket.address}")
        key(window, "T", CTRL)
        if named:
            may_open.set()
            until(lambda: window.shots.count.text() != "")
        key(window, "F12")
        if not named:
            until(lambda: len(owed_shots(study.results)) == 2)
            may_open.set()
        until(lambda: not window.shots.is_running)
        assert window.shots.owed
        window.close()
        window.shots.end(wait=True)
        assert owed_shots(study.results) == [other]
        assert not opened(gun=f"serial:{socket.address}").shots.owed


def test_an_emergency_stop_behind_a_test_shot_counts(
    opened: Open, study: StudyFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("experiments.screens.console.shot_check.COUNTDOWN_S", 0)
    with a_gun(tmp_path) as gun:
        window = opened(gun=gun)
        key(window, "T", CTRL)
        until(lambda: not window.shots.is_running)
        fired = window.shots.detail.toPlainText()
        for _ in range(2):
            key(window, "F12")
        until(lambda: len(owed_shots(study.results)) == 1)
        assert window.shots.title.text() == "EMERGENCY STOP"
        assert window.shots.detail.toPlainText().startswith("The test shot was over, and the gun is not asked any more")
        assert window.shots.detail.toPlainText().endswith(f"It had ended so: {fired}")
        key(window, "T", CTRL)
        assert not window.shots.is_running
        (owed,) = owed_shots(study.results)
        assert owed.gun
        key(window, "Escape")
        is_asked_for_a_test_shot(window, "R")
        until(lambda: not owed_shots(study.results))


def test_a_window_that_is_closed_in_a_test_shot_stops_it_first(opened: Open) -> None:
    window = opened(gun="simulated")
    key(window, "T", CTRL)
    until(lambda: window.shots.count.text() != "")
    window.close()
    assert window.isVisible()
    assert window.shots.title.text() == "EMERGENCY STOP"
    until(lambda: not window.isVisible())
    assert not window.shots.is_running


# the table


def test_the_table_shows_practice_and_no_numbers_of_its_own(study: StudyFolder, opened: Open) -> None:
    setup = study.setups[0]
    run(
        RunRequest(setup=setup, participant_id="P01", results=study.results, practice=True, screen="terminal"),
        synthetic_screen,
        VirtualClock(),
    )
    window = opened()
    assert table(window)["P01"][0] == "–\npractice done"
    assert not window.table.verticalHeader().isVisible()


def test_why_somebody_is_excluded_is_not_cut_where_several_experiments_stand_before_it() -> None:
    out = Participant(
        participant_id="P01",
        runs=tuple(
            RunProgress(experiment=name, state="in progress", answered=3, planned=42, practised=True)
            for name in ("direction", "preference", "another")
        ),
        facts=None,
        excluded="felt unwell",
    )
    for width in (941, 560):
        table = PeopleTable([run.experiment for run in out.runs])
        table.resize(width, 300)
        table.show_people([out])
        table.show()
        QTest.qWait(0)
        assert table.columnWidth(4) >= table.sizeHintForColumn(4)
        table.close()
