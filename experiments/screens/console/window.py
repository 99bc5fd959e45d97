"""The console's window. It shows what the state says, in large type, with the keys that do it; it touches no device."""

from __future__ import annotations

from collections.abc import Callable

from PyQt6.QtCore import QObject, QTimer, pyqtSignal
from PyQt6.QtGui import QCloseEvent, QKeySequence, QShortcut
from PyQt6.QtWidgets import (
    QHBoxLayout,
    QLineEdit,
    QListWidget,
    QMainWindow,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from experiments.clock import Clock
from experiments.remarks import AnswerCorrected, Flagged, Noted, RatingCorrected, Remark
from experiments.screens.console import parts, theme, tone
from experiments.screens.console.controls import Controls
from experiments.screens.console.messages import Began, Ended, Message, Saved, Trouble, Waiting
from experiments.screens.console.pace import clock_text
from experiments.screens.console.screen import ConsoleScreen
from experiments.screens.console.state import (
    Instruction,
    State,
    coming,
    gun_text,
    instruction,
    ordinal,
    place_text,
)
from experiments.steps import (
    Answered,
    Ask,
    Describe,
    Failed,
    Outcome,
    Prepare,
    Present,
    Rate,
    Rated,
    Repeat,
    Rest,
    Rested,
)

REFRESH_MS = 100
TWO_LINES_PX = 50


class Bridge(QObject):
    """Takes messages from any thread to the window's."""

    message = pyqtSignal(object)


class ConsoleWindow(QMainWindow):
    """What to do now, the keys that do it, and what an experimenter looks for: progress, gun, what comes next."""

    closed = pyqtSignal()

    def __init__(self, state: State, screen: ConsoleScreen, bridge: Bridge, clock: Clock) -> None:
        super().__init__()
        self.state, self._screen, self._clock = state, screen, clock
        self.controls = Controls(state, clock, self, screen.reply, bridge.message.emit)
        self._enter: Callable[[str], None] | None = None
        self._build()
        self._set_theme("dark")
        bridge.message.connect(self.take)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(REFRESH_MS)
        self.refresh()

    # building

    def _build(self) -> None:
        self.setWindowTitle(f"Recoil – {self.state.plan.participant_id}, {self.state.plan.experiment}")
        self.title, self.detail = parts.label("title"), parts.label("detail")
        self.place, self.saved = parts.label("place"), parts.label("saved")
        self.bars = [parts.bar(what) for what in ("set", "session", "experiment")]
        self._build_actions()
        self._build_entry()
        left = QVBoxLayout(main := QWidget())
        for line in (self.place, self.title, self.detail):
            left.addWidget(line)
        left.addStretch(1)
        for below in (self.stack, self.entry_bar, self.saved, *self.bars):
            left.addWidget(below)
        across = QHBoxLayout()
        across.addWidget(main, 3)
        across.addWidget(self._side(), 1)
        down = QVBoxLayout(whole := QWidget())
        down.addLayout(across, 1)
        down.addWidget(self._keys())
        self.setCentralWidget(whole)
        QShortcut(QKeySequence("Escape"), self).activated.connect(self._escape)
        QShortcut(QKeySequence("Space"), self).activated.connect(self._space)

    def _build_actions(self) -> None:
        """What can be done at each kind of step."""
        do = self.controls
        self.rating_ends, self.rating, self.words = parts.label("quiet"), parts.NumberEdit(), QLineEdit()
        self.rating.setPlaceholderText("type a number")
        self.rating.setAccessibleName("rating")
        self.rating.returnPressed.connect(lambda: do.rating(self.rating.text()))
        self.words.setAccessibleName("description")
        self.words.returnPressed.connect(lambda: do.words(self.words.text()))
        no_answer = parts.button(self, "No answer", "Ctrl+X", do.no_rating)
        hint = "Type the participant's words; Enter saves. For the keys below, press Tab first."
        self.areas: dict[type | None, QWidget] = {
            None: QWidget(),
            Prepare: parts.main_button("Fire", do.main),
            Ask: parts.row(
                parts.button(self, "FORWARD", "F", lambda: do.answer("forward"), name="large"),
                parts.button(self, "BACKWARD", "B", lambda: do.answer("backward"), name="large"),
            ),
            Present: parts.main_button("“Next” was said", do.main),
            Rest: parts.button(self, "End the break early…", "E", do.end_break),
            Rate: parts.column(self.rating_ends, self.rating, no_answer),
            Describe: parts.column(parts.label("quiet", hint), self.words),
        }
        self.stack = QStackedWidget()
        for area in self.areas.values():
            self.stack.addWidget(area)

    def _build_entry(self) -> None:
        self.entry_label, self.entry = parts.label("detail"), QLineEdit()
        self.entry.setAccessibleName("line of text")
        self.entry.returnPressed.connect(self._entered)
        self.entry_bar = parts.column(self.entry_label, self.entry)
        self.entry_bar.hide()

    def _side(self) -> QWidget:
        self.gun, self.times = parts.label("quiet"), parts.label("quiet")
        for lines in (self.gun, self.times):
            lines.setMinimumHeight(TWO_LINES_PX)
        self.coming, self.answers = parts.quiet_list(), parts.quiet_list()
        titles = parts.label("quiet", "Coming next"), parts.label("quiet", "Answers of this set")
        panels = parts.panel(self.gun), parts.panel(self.times)
        return parts.column(*panels, titles[0], self.coming, titles[1], self.answers)

    def _keys(self) -> QWidget:
        do = self.controls
        self.pause_button = parts.button(self, "Pause", "P", do.pause)
        self.stop_button = parts.button(self, "Stop", "Q", self._stop)
        return parts.row(
            parts.button(self, "Undo", "U", do.undo),
            parts.button(self, "Repeat", "R", do.repeat),
            parts.button(self, "Flag", "G", do.flag),
            parts.button(self, "Note", "N", do.note),
            self.pause_button,
            self.stop_button,
            parts.button(self, "Dark/light", "D", self._other_theme),
            parts.button(self, "EMERGENCY STOP · Esc", "F12", do.emergency_stop, name="stop"),
        )

    # messages

    def take(self, message: Message) -> None:
        """Take a message from the run, show it, and say when it was painted."""
        self.state.take(message, self._clock.now())
        match message:
            case Began():
                self.controls.desk = message.desk
            case Waiting():
                self._arrive(message)
            case Saved():
                self._acknowledge(message)
            case Trouble():
                self.say(message.text, "bad")
            case Ended():
                self._screen.end()
                tone.play()
        self.refresh()
        if isinstance(message, Waiting):
            self.repaint()
            self._screen.shown(self._clock.now())

    def _arrive(self, message: Waiting) -> None:
        """Put the cursor where the step wants it; a line that is being typed keeps it."""
        step = message.step
        if isinstance(step, Rate):
            ends = f"{step.minimum:g} = {step.minimum_text}     {step.maximum:g} = {step.maximum_text}"
            self.rating_ends.setText(f"{ends}     Enter saves.")
            self.rating.clear()
        elif isinstance(step, Describe):
            self.words.clear()
        if not self.entry_bar.isVisible():
            self._focus()

    def _focus(self) -> None:
        step = self.state.step
        wanted = self.rating if isinstance(step, Rate) else self.words if isinstance(step, Describe) else self
        self._show_action()
        wanted.setFocus()

    def _acknowledge(self, message: Saved) -> None:
        """Say that it is safe; a tone at the end of a break."""
        text = saved_text(self.state, message)
        if text:
            self.say(text, "bad" if isinstance(message.word, Failed) else "good")
        if isinstance(message.word, Rested):
            tone.play()
        if isinstance(message.word, Rated) and message.word.rating_by == "participant":
            self.activateWindow()  # the participant's screen took the keys to be rated on

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer."""
        self.saved.setText(text)
        parts.set_mood(self.saved, mood)

    # showing

    def refresh(self) -> None:
        """Show what is so now."""
        now_s, state = self._clock.now(), self.state
        shown = self._instruction(now_s)
        self.title.setText(shown.title)
        self.detail.setText(shown.detail)
        parts.set_mood(self.title, shown.mood)
        self.place.setText(place_text(state))
        self._show_action()
        self.pause_button.setText("Pause  [P]" if self.controls.paused_at_s is None else "Go on  [P]")
        self.stop_button.setText("Stop  [Q]" if state.ended is None else "Close  [Q]")
        found = state.progress()
        for bar, (done, planned) in zip(self.bars, (found.in_set, found.in_session, found.in_all), strict=True):
            bar.setMaximum(planned)
            bar.setValue(done)
        text, mood = gun_text(state.gun)
        self.gun.setText(text)
        parts.set_mood(self.gun, mood)
        elapsed, left = clock_text(state.elapsed_s(now_s)), clock_text(state.remaining_s())
        self.times.setText(f"Elapsed {elapsed}\nStill about {left}")
        _fill(self.coming, coming(state))
        _fill(self.answers, [f"Trial {t.trial}: {said}" for t in state.answered_in_set() if (said := state.said(t))])

    def _instruction(self, now_s: float) -> Instruction:
        trial = self.controls.correcting
        if self.controls.paused_at_s is not None:
            return Instruction(title="Paused", detail="P goes on.", mood="wait")
        if trial is None:
            return instruction(self.state, now_s)
        return Instruction(
            title=f"Correct trial {trial.trial}",
            detail=f"It was entered as {self.state.said(trial)}. Enter what the participant said: F or B.\n"
            "U goes further back, Esc leaves it.",
            mood="ask",
        )

    def _show_action(self) -> None:
        step = self.state.step
        kind: type | None = None if step is None else type(step)
        if self.controls.paused_at_s is not None and kind is not Rest:
            kind = None
        if self.controls.correcting is not None:
            kind = Ask
        area = self.areas.get(kind, self.areas[None])
        if self.stack.currentWidget() is not area:
            self.stack.setCurrentWidget(area)

    # keys that belong to the window

    def _space(self) -> None:
        """The main key; a button reached by Tab is pressed by it, as everywhere."""
        focused = self.focusWidget()
        if isinstance(focused, QPushButton):
            focused.click()
        else:
            self.controls.main()

    def _escape(self) -> None:
        """Leave what is open; where nothing is, stop for an emergency."""
        if self.entry_bar.isVisible():
            self._close_entry()
        elif not self.controls.leave_correction() and self.state.ended is None:
            self.controls.emergency_stop()
        self.refresh()

    def _stop(self) -> None:
        if self.state.ended is not None:
            self.close()
        else:
            self.controls.stop()

    def _other_theme(self) -> None:
        self._set_theme("light" if self._theme == "dark" else "dark")

    def _set_theme(self, name: theme.Theme) -> None:
        self._theme: theme.Theme = name
        self.setStyleSheet(theme.sheet(name))

    def ask_line(self, question: str, enter: Callable[[str], None]) -> None:
        """Ask for a line of text, and hand it over if one is entered."""
        self._enter = enter
        self.entry_label.setText(f"{question}  (Enter saves, Esc leaves it)")
        self.entry.clear()
        self.entry_bar.show()
        self.entry.setFocus()

    def _entered(self) -> None:
        text, enter = self.entry.text().strip(), self._enter
        if not text:
            self.say("Type a word or two, or leave it with Esc.", "bad")
            return
        self._close_entry()
        if enter is not None:
            enter(text)

    def _close_entry(self) -> None:
        self._enter = None
        self.entry_bar.hide()
        self._focus()

    def closeEvent(self, event: QCloseEvent | None) -> None:  # noqa: N802 - Qt's name
        """Closing the window stops the run; what was answered is safe."""
        if self.state.ended is None:
            self.controls.stop_for("the window was closed")
        super().closeEvent(event)
        self.closed.emit()


def saved_text(state: State, message: Saved) -> str:
    """What was saved, as the experimenter entered it; nothing for what needs no answer."""
    if message.step is None:
        return _remark_text(state, message.word)
    word, step = message.word, message.step
    match word:
        case Answered() if isinstance(step, Ask):
            return f"Saved: trial {step.trial.trial}, {word.response.upper()}"
        case Rated() if isinstance(step, Rate):
            return f"Saved: {ordinal(state, step.trial)}, {state.said(step.trial)}"
        case Failed():
            return f"The gun failed: {word.cause}. The trial is marked and presented again."
        case Repeat():
            return f"Saved: trial {word.trial.trial} is presented again ({word.reason})"
        case Rested():
            return "The break is over."
        case _:
            return ""


def _remark_text(state: State, remark: Outcome | Remark) -> str:
    match remark:
        case AnswerCorrected() | RatingCorrected():
            return f"Saved: trial {remark.trial.trial} corrected to {state.said(remark.trial)}"
        case Flagged():
            return f"Saved: trial {remark.trial.trial} flagged {remark.flag}"
        case Noted():
            return "Saved: note"
        case _:
            return ""


def _fill(shown: QListWidget, lines: list[str]) -> None:
    if [item.text() for i in range(shown.count()) if (item := shown.item(i))] != lines:
        shown.clear()
        shown.addItems(lines)
        shown.scrollToBottom()
