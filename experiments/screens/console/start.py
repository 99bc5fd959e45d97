"""The start window: who comes next, what is asked of them, and a test shot, before a run begins."""

from __future__ import annotations

import threading
from contextlib import closing
from dataclasses import dataclass
from typing import Any, get_args

from PyQt6.QtCore import QEventLoop, QObject, pyqtSignal
from PyQt6.QtGui import QCloseEvent
from PyQt6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from device import DeviceError, Shot, open_gun
from experiments import enrolment
from experiments.clock import Clock
from experiments.config import Handedness, Sex
from experiments.limits import drives
from experiments.load import ConfigError
from experiments.places import PlaceError
from experiments.register import RegisterError
from experiments.run import Again
from experiments.screens.console import parts, theme
from experiments.setup import Setup
from experiments.standings import Overview, StudyFolder, overview
from experiments.study import Facts, Participant, RunStanding

_LEVELS: dict[str, tuple[str, ...]] = {"sex": get_args(Sex), "handedness": get_args(Handedness)}
_FACT_TEXT = {"age_years": "Age in years", "sex": "Sex", "handedness": "Handedness"}
_HOW_TO_START = "Read the code back with the participant, fill in what is asked, then Start."
_STATE_TEXT = {"done": "done", "not begun": "–"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What was chosen: who does which experiment, and how."""

    setup: Setup[Any]
    participant_id: str
    again: Again = "ask"
    practice: bool = False
    training: bool = False
    participant_screen: bool = False
    participant_keys: bool = False
    noise: bool = False


class _Told(QObject):
    """Takes what another thread has to say to the window's."""

    text = pyqtSignal(str, str)


class StartWindow(QWidget):
    """A table of the participants, a form for the next one, and four ways to go on. `choice` is what was chosen."""

    closed = pyqtSignal()

    def __init__(self, study: StudyFolder, experiment: str, gun: str, clock: Clock) -> None:
        super().__init__()
        self._study, self._gun, self._clock = study, gun, clock
        self.choice: Choice | None = None
        self._told = _Told()
        self._told.text.connect(self.say)
        self._wanted = experiment
        self._build(experiment)
        self.setStyleSheet(theme.sheet("dark"))
        self._fill()
        self.resize(1280, 800)

    # building

    def _build(self, experiment: str) -> None:
        self.setWindowTitle("Recoil – start")
        self.table = QTableWidget()
        self.table.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        self.table.setSelectionBehavior(QTableWidget.SelectionBehavior.SelectRows)
        header = self.table.horizontalHeader()
        if header is not None:
            header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
            header.setStretchLastSection(True)
        self.table.itemSelectionChanged.connect(self._selected)
        self.next, self.saved = parts.label("detail"), parts.label("saved")
        across, whole = QHBoxLayout(), QVBoxLayout(self)
        across.addWidget(parts.column(parts.label("quiet", "Participants of the study"), self.table), 3)
        across.addWidget(self._form(experiment), 2)
        title = parts.label("place", f"{self._study.config.title} · {self._study.results}")
        for widget in (title, self.next):
            whole.addWidget(widget)
        whole.addLayout(across, 1)
        whole.addWidget(self.saved)
        whole.addWidget(self._keys())

    def _form(self, experiment: str) -> QWidget:
        self.experiment, self.code, self.code_again = QComboBox(), QLineEdit(), QLineEdit()
        self.experiment.addItems(self._study.experiments)
        self.experiment.setCurrentText(experiment)
        self.own_screen, self.own_keys = QCheckBox("rates on a screen of their own"), QCheckBox("answers with own keys")
        self.noise = QCheckBox("hears masking noise")
        self.facts: dict[str, QLineEdit | QComboBox] = {fact: self._fact(fact) for fact in self._asked()}
        form = QFormLayout(holder := QWidget())
        holder.setObjectName("form")
        rows: dict[str, QWidget] = {"Experiment": self.experiment, "Code": self.code}
        rows["Code, read back"] = self.code_again
        rows |= {_FACT_TEXT[fact]: field for fact, field in self.facts.items()}
        for name, field in (rows | {"Participant": self.own_screen, "": self.own_keys, " ": self.noise}).items():
            field.setAccessibleName(name)
            form.addRow(name, field)
        return parts.panel(parts.label("quiet", _HOW_TO_START), holder)

    def _asked(self) -> tuple[str, ...]:
        return tuple(self._study.config.eligibility.ask)

    def _fact(self, fact: str) -> QLineEdit | QComboBox:
        if fact not in _LEVELS:
            return QLineEdit()
        box = QComboBox()
        box.addItems(["", *_LEVELS[fact]])
        return box

    def _keys(self) -> QWidget:
        return parts.row(
            parts.button(self, "Start", "Ctrl+Return", self._start, name="large"),
            parts.button(self, "Practice", "Ctrl+P", self._practice),
            parts.button(self, "Test shot", "Ctrl+T", self._test_shot),
            parts.button(self, "Training (simulated gun)", "Ctrl+R", self._training),
            parts.button(self, "Quit", "Ctrl+Q", self.close),
        )

    # showing

    def _fill(self) -> None:
        self._seen: Overview = overview(self._study)
        people = self._seen.participants
        self.table.setColumnCount(2 + len(self._study.experiments))
        self.table.setHorizontalHeaderLabels(["code", *self._study.experiments, "note"])
        self.table.setRowCount(len(people))
        for line, person in enumerate(people):
            cells = [person.participant_id, *map(_run_text, person.runs), _note_text(person)]
            for column, text in enumerate(cells):
                self.table.setItem(line, column, QTableWidgetItem(text))
        coming = self._seen.next
        if coming is None:
            self.next.setText("Everyone has done everything.")
        else:
            self.next.setText(f"Next: {coming.participant_id}, {' and '.join(run.experiment for run in coming.runs)}")
            self.code.setText(coming.participant_id)
            ahead = [run.experiment for run in coming.runs]
            self.experiment.setCurrentText(self._wanted if self._wanted in ahead else ahead[0])
        for problem in self._seen.problems:
            self.say(problem, "bad")
        self.code_again.setFocus()

    def _selected(self) -> None:
        line = self.table.currentRow()
        if 0 <= line < len(self._seen.participants):
            self.code.setText(self._seen.participants[line].participant_id)

    def closeEvent(self, event: QCloseEvent | None) -> None:  # noqa: N802 - Qt's name
        """Let whoever waits for a choice go on."""
        super().closeEvent(event)
        self.closed.emit()

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer."""
        self.saved.setText(text)
        parts.set_mood(self.saved, mood)

    # choosing

    def _start(self) -> None:
        self._choose(practice=False)

    def _practice(self) -> None:
        self._choose(practice=True)

    def _choose(self, *, practice: bool) -> None:
        code = self.code.text().strip()
        if code != self.code_again.text().strip():
            self.say("Read the code back: type it a second time, just as it stands above.", "bad")
            return
        try:
            self._enrol(code)
        except (PlaceError, RegisterError, ConfigError, ValueError) as error:
            self.say(str(error), "bad")
            return
        standing = self._standing(code)
        if standing is not None and standing.state == "in progress" and not practice:
            self._ask_resume(code, standing)
        else:
            self._leave(code, practice=practice)

    def _enrol(self, code: str) -> None:
        """Have what was said of a participant on record; nothing is asked of those who joined and said nothing new."""
        known = next((one for one in self._seen.participants if one.participant_id == code), None)
        given = self._given()
        if known is not None and known.facts is not None and not given:
            return
        enrolment.join(self._study, code, Facts(**given), self._clock)

    def _given(self) -> dict[str, Any]:
        values = {
            fact: field.text().strip() if isinstance(field, QLineEdit) else field.currentText()
            for fact, field in self.facts.items()
        }
        given: dict[str, Any] = {fact: value for fact, value in values.items() if value}
        if "age_years" in given:
            if not given["age_years"].isdecimal():
                raise ValueError(f"age {given['age_years']!r}: type whole years")
            given["age_years"] = int(given["age_years"])
        return given

    def _standing(self, code: str) -> RunStanding | None:
        runs = [run for one in self._seen.participants if one.participant_id == code for run in one.runs]
        return next((run for run in runs if run.experiment == self.experiment.currentText()), None)

    def _ask_resume(self, code: str, standing: RunStanding) -> None:
        """Show when the run stopped, and ask."""
        self.say(
            f"{code} stopped at {standing.last_utc} with {standing.answered} of {standing.planned} trials answered. "
            "Go on there: Ctrl+G. Set it aside and start anew: Ctrl+N.",
            "ask",
        )
        if not hasattr(self, "resume_keys"):
            self.resume_keys = parts.row(
                parts.button(self, "Go on with it", "Ctrl+G", lambda: self._leave(self.code.text(), again="resume")),
                parts.button(self, "Start anew", "Ctrl+N", lambda: self._leave(self.code.text(), again="fresh")),
            )
            layout = self.layout()
            if layout is not None:
                layout.addWidget(self.resume_keys)

    def _training(self) -> None:
        self._leave("training", practice=True, training=True)

    def _leave(self, code: str, *, again: Again = "ask", practice: bool = False, training: bool = False) -> None:
        self.choice = Choice(
            setup=self._setup(),
            participant_id=code.strip(),
            again=again,
            practice=practice,
            training=training,
            participant_screen=self.own_screen.isChecked(),
            participant_keys=self.own_keys.isChecked(),
            noise=self.noise.isChecked(),
        )
        self.close()

    def _setup(self) -> Setup[Any]:
        return next(s for s in self._study.setups if s.config.experiment == self.experiment.currentText())

    # the test shot

    def _test_shot(self) -> None:
        """Fire once, beside the window: a gun that hangs is not to freeze it."""
        self.say("Firing a test shot.", "wait")
        threading.Thread(target=self._shoot, args=(self._setup(),), daemon=True).start()

    def _shoot(self, setup: Setup[Any]) -> None:
        methods = setup.gun.renderings(setup.config.design.methods)
        method, drive = next(iter(drives(setup).items()))
        try:
            with closing(open_gun(self._gun, methods, clock=self._clock.now)) as gun:
                gun.arm()
                report = gun.fire(Shot(method=method, direction="forward", drive=drive))
                gun.disarm()
        except (DeviceError, ValueError) as error:
            self._told.text.emit(f"Test shot: {error}", "bad")
        else:
            name = setup.gun.methods[method].label
            self._told.text.emit(f"Test shot: {name} was rendered ({report.motion}); the gun is disarmed.", "good")


def _run_text(run: RunStanding) -> str:
    return _STATE_TEXT.get(run.state, f"{run.state}, {run.answered} of {run.planned}")


def _note_text(person: Participant) -> str:
    return f"excluded: {person.excluded}" if person.excluded is not None else ""


def choose(study: StudyFolder, experiment: str, gun: str, clock: Clock, said: str = "") -> Choice | None:
    """Show the start window until something is chosen; `None` if it was closed. `said` is what it has to tell first."""
    window = StartWindow(study, experiment, gun, clock)
    if said:
        window.say(said, "bad")
    loop = QEventLoop()
    window.closed.connect(loop.quit)
    window.show()
    window.activateWindow()
    loop.exec()
    return window.choice
