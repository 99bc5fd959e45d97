"""Dark and light, for a dim and a bright lab. Text keeps a contrast of at least 7 to 1 against its ground."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from PyQt6.QtCore import Qt
from PyQt6.QtGui import QKeySequence, QShortcut
from PyQt6.QtWidgets import QFrame, QHBoxLayout, QLabel, QListWidget, QPushButton, QVBoxLayout, QWidget

Theme = Literal["dark", "light"]
MOODS = ("act", "ask", "rest", "wait", "good", "bad")
BANDS = ("practice", "simulated")
"""What a line is about, which chooses its colour; the words say it as well."""

_COLOURS: dict[Theme, dict[str, str]] = {
    "dark": {
        "ground": "#101418",
        "panel": "#1b2229",
        "line": "#4a5764",
        "filled": "#34414d",
        "text": "#f2f5f7",
        "quiet": "#b9c4ce",
        "dim": "#8593a1",
        "act": "#8fd0ff",
        "ask": "#ffd479",
        "rest": "#9fe0b5",
        "wait": "#c8d0d8",
        "good": "#9fe0b5",
        "bad": "#ffb3a7",
        "stop": "#b3261e",
        "stop_text": "#ffffff",
        "practice": "#5b2a86",
        "practice_text": "#ffffff",
        "simulated": "#ffb000",
        "simulated_text": "#000000",
    },
    "light": {
        "ground": "#ffffff",
        "panel": "#f0f3f6",
        "line": "#7a8794",
        "filled": "#c3ccd5",
        "text": "#10161c",
        "quiet": "#3c4852",
        "dim": "#66727e",
        "act": "#00497a",
        "ask": "#6b4300",
        "rest": "#0b5028",
        "wait": "#3c4852",
        "good": "#0b5028",
        "bad": "#8c1d18",
        "stop": "#b3261e",
        "stop_text": "#ffffff",
        "practice": "#5b2a86",
        "practice_text": "#ffffff",
        "simulated": "#ffb000",
        "simulated_text": "#000000",
    },
}


def colour(theme: Theme, name: str) -> str:
    """A colour by what it is for."""
    return _COLOURS[theme][name]


def contrast(theme: Theme, name: str, ground: str = "ground") -> float:
    """The contrast ratio of a colour against a ground (WCAG 2): 1 to 21."""
    light, dark = sorted((_luminance(colour(theme, name)), _luminance(colour(theme, ground))), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(hex_colour: str) -> float:
    parts = [int(hex_colour[start : start + 2], 16) / 255 for start in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _with_mood(mood: str) -> str:
    """The labels of a mood. Those that have a colour by their name are named, or that colour would win."""
    return ", ".join(f'QLabel{name}[mood="{mood}"]' for name in ("", "#saved", "#quiet", "#title", "#damper"))


def sheet(theme: Theme) -> str:
    """The Qt style sheet of a theme, in the sizes of the window that it was designed for."""
    c = _COLOURS[theme]
    moods = "\n".join(f"{_with_mood(mood)} {{ color: {c[mood]}; }}" for mood in MOODS)
    bands = "\n".join(
        f'QLabel#band[mood="{band}"] {{ background: {c[band]}; color: {c[f"{band}_text"]}; }}' for band in BANDS
    )
    return f"""
    QWidget {{ background: {c["ground"]}; color: {c["text"]}; font-size: 17px;
        font-family: "DejaVu Sans", "Noto Sans"; }}
    {moods}
    {bands}
    {_labels_and_buttons(c)}
    {_fields_and_lists(c)}
    """


def _labels_and_buttons(c: dict[str, str]) -> str:
    return f"""
    QFrame#panel {{ background: {c["panel"]}; border: 1px solid {c["line"]}; border-radius: 8px; }}
    QFrame#panel QLabel, QFrame#panel QCheckBox, QWidget#form {{ background: transparent; }}
    QLabel#place {{ font-size: 22px; color: {c["quiet"]}; }}
    QLabel#band {{ font-size: 20px; font-weight: bold; padding: 4px 10px; border-radius: 4px; }}
    QLabel#quiet {{ font-size: 18px; color: {c["quiet"]}; }}
    QLabel#saved {{ font-size: 22px; color: {c["good"]}; }}
    QPushButton {{ background: {c["panel"]}; border: 2px solid {c["line"]}; border-radius: 8px;
        padding: 6px 4px; font-size: 16px; }}
    QPushButton:focus {{ border: 3px solid {c["act"]}; }}
    QPushButton:hover {{ border-color: {c["act"]}; }}
    QPushButton:disabled, QPushButton[dim="yes"] {{ color: {c["dim"]}; border-style: dashed; }}
    QPushButton#large {{ font-size: 26px; font-weight: bold; padding: 8px 4px; }}
    QPushButton#stop {{ background: {c["stop"]}; color: {c["stop_text"]}; font-weight: bold; font-size: 22px;
        padding: 14px 6px; }}
    """


def _fields_and_lists(c: dict[str, str]) -> str:
    return f"""
    QLineEdit, QDoubleSpinBox, QSpinBox, QComboBox {{ background: {c["panel"]}; border: 2px solid {c["line"]};
        border-radius: 6px; padding: 8px; font-size: 24px; }}
    QLineEdit:focus, QDoubleSpinBox:focus, QSpinBox:focus, QComboBox:focus {{ border: 3px solid {c["act"]}; }}
    QProgressBar {{ border: 1px solid {c["line"]}; border-radius: 6px; text-align: center; background: {c["panel"]};
        color: {c["text"]}; min-height: 24px; }}
    QProgressBar::chunk {{ background: {c["filled"]}; }}
    QCheckBox::indicator {{ width: 22px; height: 22px; border: 2px solid {c["line"]}; border-radius: 4px; }}
    QCheckBox::indicator:checked {{ background: {c["act"]}; }}
    QCheckBox:focus {{ color: {c["act"]}; }}
    QListWidget, QTableWidget, QPlainTextEdit {{ background: {c["panel"]}; border: 1px solid {c["line"]};
        font-size: 19px; }}
    QPlainTextEdit {{ font-family: "DejaVu Sans Mono", monospace; }}
    QListWidget::item:selected, QTableWidget::item:selected {{ background: {c["act"]}; color: {c["ground"]}; }}
    QHeaderView::section {{ background: {c["ground"]}; color: {c["quiet"]}; border: none; padding: 6px; }}
    """


Slot = Callable[[], object]
NO_FOCUS = Qt.FocusPolicy.NoFocus


def label(name: str, text: str = "", *, wrap: bool = True) -> QLabel:
    """A label in the style of its name."""
    made = QLabel(text)
    made.setObjectName(name)
    made.setWordWrap(wrap)
    made.setTextFormat(Qt.TextFormat.PlainText)
    return made


def set_mood(widget: QWidget, mood: str) -> None:
    """Give a label the colour of a mood; drawn anew only if it changes."""
    if widget.property("mood") != mood:
        widget.setProperty("mood", mood)
        restyle(widget)


def restyle(widget: QWidget) -> None:
    """Have a widget drawn anew after a property that the style knows has changed."""
    style = widget.style()
    if style is not None:
        style.unpolish(widget)
        style.polish(widget)


def button(parent: QWidget, text: str, key: str, slot: Slot, *, name: str = "") -> QPushButton:
    """A button that shows its key, and the key. Both do the same, and only while the button is there to be seen."""
    made = _button(f"{text}  [{key.replace('Return', 'Enter')}]", text, slot, name)

    def pressed() -> None:
        if made.isVisible():
            slot()

    shortcut = QShortcut(QKeySequence(key), parent)
    shortcut.setAutoRepeat(False)
    shortcut.activated.connect(pressed)
    return made


def _button(shown: str, spoken: str, slot: Slot, name: str) -> QPushButton:
    made = QPushButton(shown)
    made.setObjectName(name)
    made.setAccessibleName(spoken)
    made.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    made.clicked.connect(lambda _: slot())
    return made


def panel(*widgets: QWidget) -> QFrame:
    """A framed column."""
    frame = QFrame()
    frame.setObjectName("panel")
    column = QVBoxLayout(frame)
    for widget in widgets:
        column.addWidget(widget)
    return frame


def row(*widgets: QWidget) -> QWidget:
    """Widgets side by side."""
    made = QWidget()
    across = QHBoxLayout(made)
    across.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        across.addWidget(widget)
    return made


def column(*widgets: QWidget) -> QWidget:
    """Widgets below each other."""
    made = QWidget()
    down = QVBoxLayout(made)
    down.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        down.addWidget(widget)
    return made


def quiet_list() -> QListWidget:
    """A list that is only looked at; long lines go on below."""
    made = QListWidget()
    made.setWordWrap(True)
    made.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    made.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    made.setSelectionMode(QListWidget.SelectionMode.SingleSelection)
    return made
