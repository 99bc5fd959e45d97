"""The start window's form, and its table of the participants: who, which experiment, and what is asked of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from PyQt6 import QtWidgets
from PyQt6.QtCore import Qt, pyqtSignal
from PyQt6.QtGui import QGuiApplication, QResizeEvent, QScreen

from experiments.catalogues.catalogue import ENGLISH, Language
from experiments.config.door import Fact, Handedness, Sex
from experiments.run_request import ParticipantOptions
from experiments.screens.console import widgets
from experiments.screens.console.people import cell_text, note_text
from experiments.screens.console.widgets import LineEdit, ListBox, TextLines, TickBox
from experiments.screens.phrases import phrase
from experiments.study.enrolment import Entered, typed_facts
from experiments.study.study import Participant

_LEVELS: dict[str, tuple[str, ...]] = {"sex": get_args(Sex), "handedness": get_args(Handedness)}
_FACT_TEXT = {"age_years": phrase("Age in years"), "sex": phrase("Sex"), "handedness": phrase("Handedness")}
_HOW_TO_START = phrase("Read the code back with the participant, fill in what is asked, then Start.")
_AGE_DIGITS = 3
_BETWEEN_ROWS_PX = 3
"""So every field that there can be has room at 1280 × 800, below a title bar, a long path and a long remark."""
SENDS_MARKERS = phrase("sends markers (LSL)")
_NO_SENSOR = phrase("none; csv:PATH or another")


class Form(QtWidgets.QFrame):
    """The fields. `edited` after any change; `code_edited` after one of the code, `experiment_edited` of the other."""

    edited = pyqtSignal()
    code_edited = pyqtSignal()
    experiment_edited = pyqtSignal()

    def __init__(self, experiments: Sequence[str], asked: Sequence[Fact], opening: Opening) -> None:
        super().__init__()
        self._languages = opening.languages
        self.languages = ListBox([one.title for one in self._languages])
        self.languages.setCurrentIndex([one.code for one in self._languages].index(opening.language))
        self.setObjectName("panel")
        self.experiment, self.code, self.code_again = ListBox(experiments), LineEdit(), LineEdit()
        self.facts: dict[str, LineEdit | ListBox] = {fact: _fact(fact) for fact in asked}
        self.own_screen, self.own_keys = (
            TickBox(phrase("rates on their own screen")),
            TickBox(phrase("answers with own keys")),
        )
        self.noise, self.monitor = TickBox(phrase("hears masking noise")), ListBox(monitors())
        self.sensor, self.markers = LineEdit(), TickBox(SENDS_MARKERS)
        self.remark = TextLines("remark")
        self._typed: dict[str, str] | None = None
        self._tick(opening.options)
        self.markers.setChecked(opening.markers)
        self.sensor.setText(opening.sensor)
        self.sensor.setPlaceholderText(_NO_SENSOR)
        self._lay_out()
        self._connect()

    def _lay_out(self) -> None:
        form = QtWidgets.QFormLayout(fields := QtWidgets.QWidget())
        fields.setObjectName("form")
        form.setRowWrapPolicy(QtWidgets.QFormLayout.RowWrapPolicy.WrapLongRows)
        margins = form.contentsMargins()
        form.setContentsMargins(margins.left(), 0, margins.right(), 0)
        form.setVerticalSpacing(_BETWEEN_ROWS_PX)
        form.setFieldGrowthPolicy(QtWidgets.QFormLayout.FieldGrowthPolicy.ExpandingFieldsGrow)
        for name, widget in self._rows():
            widget.setAccessibleName(name)
            form.addRow(_field_name(name), widget)
        scroll = QtWidgets.QScrollArea()
        scroll.setWidget(fields)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QtWidgets.QFrame.Shape.NoFrame)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        how = widgets.text_label("quiet", _HOW_TO_START)
        widgets.fill(QtWidgets.QVBoxLayout(self), how, self.remark, (scroll, 1), margins=None)

    def _rows(self) -> list[tuple[str, QtWidgets.QWidget]]:
        rows: list[tuple[str, QtWidgets.QWidget]] = [
            (phrase("Experiment"), self.experiment),
            (phrase("Code"), self.code),
        ]
        rows += [(phrase("Code, read back"), self.code_again)]
        rows += [(_FACT_TEXT[fact], widget) for fact, widget in self.facts.items()]
        rows += [(phrase("Participant"), self.own_screen), ("", self.own_keys), ("", self.noise)]
        rows += [(phrase("Their language"), self.languages)] if len(self._languages) > 1 else []
        rows += [(phrase("Their monitor"), self.monitor)] if self.monitor.count() > 1 else []
        return [*rows, (phrase("The run"), self.markers), (phrase("Sensor"), self.sensor)]

    def _connect(self) -> None:
        for line in (self.code, self.code_again, self.sensor, *self.facts.values()):
            if isinstance(line, LineEdit):
                line.textChanged.connect(self.edited)
        for box in (self.experiment, self.languages, self.monitor, *self.facts.values()):
            if isinstance(box, ListBox):
                box.currentIndexChanged.connect(self.edited)
        for tick in (self.own_screen, self.own_keys, self.noise, self.markers):
            tick.toggled.connect(self.edited)
        self.code.textChanged.connect(self.code_edited)
        self.experiment.currentIndexChanged.connect(self.experiment_edited)

    def _tick(self, options: ParticipantOptions) -> None:
        self.own_screen.setChecked(options.screen)
        self.own_keys.setChecked(options.keys)
        self.noise.setChecked(options.noise)
        last = self.monitor.count() - 1
        self.monitor.setCurrentIndex(last if options.monitor is None else options.monitor)

    @property
    def participant_id(self) -> str:
        """The code that stands there."""
        return self.code.text().strip()

    @property
    def language(self) -> Language:
        """The participant's language."""
        return self._languages[self.languages.currentIndex()]

    def entered(self) -> Entered:
        """What stands in the fields about the participant."""
        return Entered(
            participant_id=self.participant_id,
            read_back=self.code_again.text().strip(),
            experiment=self.experiment.currentText(),
            facts={fact: _text(widget) for fact, widget in self.facts.items()},
        )

    def options(self) -> ParticipantOptions:
        """What is ticked."""
        return ParticipantOptions(
            screen=self.own_screen.isChecked(),
            keys=self.own_keys.isChecked(),
            noise=self.noise.isChecked(),
            monitor=self.monitor.currentIndex() if self.monitor.count() > 1 else None,
        )

    def show_facts(self, person: Participant | None) -> None:
        """Show what is on record of somebody; where nothing is, what was typed before another's record stood there."""
        if person is not None and person.facts is not None:
            if self._typed is None:
                self._typed = dict(self.entered().facts)
            self._fill(typed_facts(person.facts))
        elif self._typed is not None:
            self._fill(self._typed)
            self._typed = None

    def _fill(self, values: dict[str, str]) -> None:
        for fact, widget in self.facts.items():
            if isinstance(widget, LineEdit):
                widget.setText(values[fact])
            else:
                widget.setCurrentText(values[fact])


def _field_name(name: str) -> QtWidgets.QLabel:
    """The name of a field, at half its height."""
    made = widgets.text_label("", name, wrap=False)
    made.setAlignment(Qt.AlignmentFlag.AlignVCenter)
    made.setSizePolicy(QtWidgets.QSizePolicy.Policy.Preferred, QtWidgets.QSizePolicy.Policy.Expanding)
    return made


def _fact(fact: str) -> LineEdit | ListBox:
    if fact in _LEVELS:
        return ListBox(["", *_LEVELS[fact]])
    line = LineEdit()
    line.setMaxLength(_AGE_DIGITS)
    return line


def _text(widget: LineEdit | ListBox) -> str:
    return widget.text() if isinstance(widget, LineEdit) else widget.currentText()


def monitors() -> list[str]:
    """The screens in the order of their numbers, as somebody in the lab would tell them apart."""
    return [_monitor(number, screen) for number, screen in enumerate(QGuiApplication.screens())]


def _monitor(number: int, screen: QScreen) -> str:
    size = screen.size() * screen.devicePixelRatio()
    return f"{number}: {screen.name()}, {size.width()} × {size.height()}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """How a start window opens: on which gun, with what ticked, with whom (empty: who comes next), and what it says.

    `named` is the experiment whose config was named when the program was started; later windows have none.
    `language` is the code of one of the `languages`; `sensor` and `markers` are as of a `RunRequest`. `had` grows from
    window to window by the files of people that were seen in the results folder.
    """

    gun: str
    named: str = ""
    languages: tuple[Language, ...] = (ENGLISH,)
    language: str = ENGLISH.code
    options: ParticipantOptions = field(default_factory=ParticipantOptions)
    sensor: str = ""
    markers: bool = False
    participant_id: str = ""
    said: str = ""
    had: set[Path] = field(default_factory=set)


class PeopleTable(QtWidgets.QTableWidget):
    """A row a participant, a column an experiment. `person_chosen` with the code of a row that somebody chose."""

    person_chosen = pyqtSignal(str)

    def __init__(self, experiments: Sequence[str]) -> None:
        super().__init__()
        columns = [phrase("code"), *experiments, phrase("note")]
        self.setColumnCount(len(columns))
        self.setHorizontalHeaderLabels(columns)
        self.setEditTriggers(QtWidgets.QTableWidget.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QtWidgets.QTableWidget.SelectionBehavior.SelectRows)
        self.setSelectionMode(QtWidgets.QTableWidget.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)
        self.setMinimumSize(120, 60)
        across, down = self.horizontalHeader(), self.verticalHeader()
        if across is not None and down is not None:
            across.setSectionResizeMode(QtWidgets.QHeaderView.ResizeMode.ResizeToContents)
            down.setVisible(False)  # numbers beside codes are no codes
            down.setSectionResizeMode(QtWidgets.QHeaderView.ResizeMode.ResizeToContents)
        self.itemSelectionChanged.connect(self._chosen)
        self.cellClicked.connect(self._chosen)  # also the row that was chosen before

    def show_people(self, seen: Sequence[Participant]) -> None:
        """Show how the participants stand; whoever was chosen stays so."""
        chosen = self.item(self.currentRow(), 0) if self.selectedItems() else None
        code = "" if chosen is None else chosen.text()
        self.blockSignals(True)
        self.setRowCount(len(seen))
        for line, person in enumerate(seen):
            cells = [person.participant_id, *map(cell_text, person.runs), note_text(person)]
            for column, text in enumerate(cells):
                self.setItem(line, column, QtWidgets.QTableWidgetItem(text))
            if person.participant_id == code:
                self.selectRow(line)
        self.blockSignals(False)
        self._fit()

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """The last column takes what room there is."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Stretch the last column where all of them have room; else it is scrolled to, and not cut."""
        across, view = self.horizontalHeader(), self.viewport()
        if across is not None and view is not None:
            columns = range(self.columnCount())
            wide = sum(max(self.sizeHintForColumn(one), across.sectionSizeHint(one)) for one in columns)
            across.setStretchLastSection(wide <= view.width())

    def _chosen(self) -> None:
        code = self.item(self.currentRow(), 0)
        if code is not None:
            self.person_chosen.emit(code.text())
