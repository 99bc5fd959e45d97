"""An unfinished run is there: the console shows when it stopped, and asks."""

from __future__ import annotations

from PyQt6.QtWidgets import QMessageBox

from experiments.run import Again, UnfinishedRun
from experiments.screens.console import theme


def ask(found: UnfinishedRun) -> Again | None:
    """Go on with the run, set it aside, or leave it (`None`). Nothing is chosen by closing the window."""
    box = QMessageBox()
    box.setWindowTitle("Recoil – unfinished run")
    box.setStyleSheet(theme.sheet("dark"))
    box.setText(str(found).split(";", maxsplit=1)[0])
    go_on = box.addButton("&Go on with it", QMessageBox.ButtonRole.AcceptRole)
    fresh = box.addButton("Set it aside and start &anew", QMessageBox.ButtonRole.DestructiveRole)
    box.setDefaultButton(go_on)
    leave = box.addButton("&Leave it", QMessageBox.ButtonRole.RejectRole)
    box.setEscapeButton(leave)
    box.exec()
    chosen = box.clickedButton()
    return "resume" if chosen is go_on else "fresh" if chosen is fresh else None
