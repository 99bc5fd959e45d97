"""`recoil` as it is, with an eye on its windows: called as a program with a file, then the words of the command.

Whenever what stands in the windows changes, the file gets a line of JSON: all texts that can be read whole.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

LOOK_MS = 20


def words(file: Path, command: list[object]) -> list[object]:
    """A `recoil` command, to be carried out under the eye."""
    return [sys.executable, "-m", "tests.watched_console", file, *command[1:]]


def seen(file: Path) -> list[list[str]]:
    """The texts that stood in the windows, from the first look to the last."""
    lines = file.read_bytes().split(b"\n")[:-1] if file.exists() else []
    return [json.loads(line) for line in lines]


def texts() -> list[str]:
    """What stands in the windows now."""
    from PyQt6.QtWidgets import QApplication, QLabel

    windows = QApplication.topLevelWidgets()
    return [label.text() for window in windows for label in window.findChildren(QLabel) if is_whole(label)]


def is_whole(label: Any) -> bool:
    """Whether a label is there to be seen, with room for all its lines."""
    return not label.visibleRegion().isEmpty() and label.height() >= label.heightForWidth(label.width())


def watch(file: Path) -> Any:
    """Look from now on, as long as the timer that is given back lives."""
    from PyQt6.QtCore import QTimer

    last: list[str] = []

    def look() -> None:
        nonlocal last
        if (now := texts()) != last:
            last = now
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(now) + "\n")

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(LOOK_MS)
    return timer


if __name__ == "__main__":
    from experiments.roof.cli import main
    from experiments.screens.console.app import application

    application()
    eye = watch(Path(sys.argv.pop(1)))
    main()
