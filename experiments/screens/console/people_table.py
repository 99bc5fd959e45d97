"""The table of participants: to look at, and to choose one."""

from __future__ import annotations

from collections.abc import Sequence

from PyQt6.QtCore import pyqtSignal
from PyQt6.QtWidgets import QHeaderView, QTableWidget, QTableWidgetItem

from experiments.screens.console.people import cell_text, note_text
from experiments.study.study import Participant


class PeopleTable(QTableWidget):
    """A row a participant, a column an experiment. `person_chosen` with the code of a row that somebody chose."""

    person_chosen = pyqtSignal(str)

    def __init__(self, experiments: Sequence[str]) -> None:
        super().__init__()
        columns = ["code", *experiments, "note"]
        self.setColumnCount(len(columns))
        self.setHorizontalHeaderLabels(columns)
        self.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QTableWidget.SelectionBehavior.SelectRows)
        self.setSelectionMode(QTableWidget.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)
        self.setMinimumSize(120, 60)
        across, down = self.horizontalHeader(), self.verticalHeader()
        if across is not None and down is not None:
            across.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
            across.setStretchLastSection(True)
            down.setVisible(False)  # numbers beside codes are no codes
            down.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.itemSelectionChanged.connect(self._chosen)
        self.cellClicked.connect(self._chosen)  # also the row that was chosen before

    def show_people(self, seen: Sequence[Participant]) -> None:
        """Show how the participants stand."""
        self.blockSignals(True)
        self.setRowCount(len(seen))
        for line, person in enumerate(seen):
            cells = [person.participant_id, *map(cell_text, person.runs), note_text(person)]
            for column, text in enumerate(cells):
                self.setItem(line, column, QTableWidgetItem(text))
        self.blockSignals(False)

    def _chosen(self) -> None:
        code = self.item(self.currentRow(), 0)
        if code is not None:
            self.person_chosen.emit(code.text())
