"""`recoil` as it is, with an eye on its start window: called as a program with a file, then the words of the command.

Whenever what stands in the window changes, the file gets a line of JSON: its size and its screen's, the texts that can
be read, and what is cut: outside of the window, or without room for its text.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

LOOK_MS = 20


def words(file: Path, command: list[object]) -> list[object]:
    """A `recoil` command, to be carried out under the eye."""
    return ["-m", "tests.watched_start", file, *command]


def seen(file: Path) -> list[dict[str, Any]]:
    """What stood in the window, from the first look to the last."""
    lines = file.read_bytes().split(b"\n")[:-1] if file.exists() else []
    return [json.loads(line) for line in lines]


def wait_for(file: Path, right: Callable[[dict[str, Any]], bool], timeout_s: float = 60) -> dict[str, Any]:
    """The window as it stands as soon as it is as it should be; fails with what was seen last."""
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s:
        looks = seen(file)
        if looks and right(looks[-1]):
            return looks[-1]
        time.sleep(0.02)
    raise AssertionError(f"the window never was as it should be; it is {seen(file)[-1:]}")


def look_at(window: Any) -> dict[str, Any]:
    """The window now."""
    from PyQt6.QtWidgets import QCheckBox

    screen, frame = window.screen().geometry(), window.frameGeometry()
    return {
        "size": [window.width(), window.height()],
        "screen": [screen.width(), screen.height()],
        "maximised": window.isMaximized(),
        "ticked": [text_of(box) for box in window.findChildren(QCheckBox) if box.isChecked()],
        "texts": [text for widget in watched(window) if (text := text_of(widget))],
        "cut": [*cut(window), *([] if screen.contains(frame) else ["the window itself"])],
    }


def watched(window: Any) -> list[Any]:
    """What is to be read or pressed, as far as it is there to be seen."""
    from PyQt6.QtWidgets import QCheckBox, QComboBox, QLabel, QLineEdit, QPushButton, QTextEdit

    kinds = (QCheckBox, QComboBox, QLabel, QLineEdit, QPushButton, QTextEdit)
    return [widget for kind in kinds for widget in window.findChildren(kind) if widget.isVisible()]


def text_of(widget: Any) -> str:
    for name in ("toPlainText", "currentText", "text"):
        if hasattr(widget, name):
            return str(getattr(widget, name)())
    return ""


def cut(window: Any) -> Iterator[str]:
    for widget in watched(window):
        if text_of(widget) and not (has_room(widget) and is_inside(widget, window)):
            yield f"{type(widget).__name__} {text_of(widget)!r}"


def has_room(widget: Any) -> bool:
    """Whether its text fits into it; a line that is typed in may scroll."""
    from PyQt6.QtWidgets import QCheckBox, QLabel, QPushButton, QTextEdit

    if isinstance(widget, QTextEdit):
        return bool(widget.height() >= int(widget.document().size().height()))
    if isinstance(widget, QLabel) and widget.wordWrap():
        return bool(widget.height() >= widget.heightForWidth(widget.width()))
    if isinstance(widget, QLabel | QPushButton | QCheckBox):
        return bool(widget.width() >= widget.sizeHint().width() and widget.height() >= widget.sizeHint().height())
    return bool(widget.height() >= widget.sizeHint().height())


def is_inside(widget: Any, window: Any) -> bool:
    """Whether it lies within the window; in what scrolls up and down, across."""
    from PyQt6.QtCore import QPoint, QRect
    from PyQt6.QtWidgets import QAbstractScrollArea

    above = widget.parentWidget()
    while above is not None and above is not window and not isinstance(above, QAbstractScrollArea):
        above = above.parentWidget()
    room = above.viewport() if isinstance(above, QAbstractScrollArea) else window
    place = QRect(widget.mapTo(room, QPoint(0, 0)), widget.size())
    across = room.rect().left() <= place.left() and place.right() <= room.rect().right()
    return across and (room is not window or bool(window.rect().contains(place)))


def watch(file: Path) -> Any:
    """Look from now on, as long as the timer that is given back lives."""
    from PyQt6.QtCore import QTimer
    from PyQt6.QtWidgets import QApplication

    from experiments.screens.console.start import StartWindow

    last: list[Any] = []

    def look() -> None:
        windows = [one for one in QApplication.topLevelWidgets() if isinstance(one, StartWindow) and one.isVisible()]
        now = [look_at(window) for window in windows]
        if now != last:
            last[:] = now
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(now[0] if now else {"texts": [], "cut": []}) + "\n")

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(LOOK_MS)
    return timer


if __name__ == "__main__":
    from experiments.screens.console.app import application
    from recoil.cli import main

    application()
    eye = watch(Path(sys.argv.pop(1)))
    main()
