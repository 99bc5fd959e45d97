"""The console's window. It draws what the live run says, in large type, with the keys that do something now.

It decides nothing: keys and buttons become events, and the table of states judges them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from PyQt6 import QtWidgets
from PyQt6.QtCore import QCoreApplication, QEvent, QTimer, pyqtSignal
from PyQt6.QtGui import QCloseEvent, QResizeEvent, QShowEvent

from experiments.clock import Clock
from experiments.live_run import LiveRun
from experiments.record.tables import is_simulated
from experiments.screens.console import view, widgets
from experiments.screens.console.buttons import Buttons
from experiments.screens.console.controls import Controls, TextField
from experiments.screens.console.instructions import instruction
from experiments.screens.console.keys import BY_NAME, Name, Typing, own_arrows
from experiments.screens.console.over_all import KeepsKeys, WhateverPressed
from experiments.screens.console.panels import FITS, Bars, Notice, SidePanel, TextFields, TextPage
from experiments.screens.console.progress import are_keys_heard, marks
from experiments.screens.console.said_line import SaidAt, SaidLine
from experiments.screens.console.tone import play_tone
from experiments.screens.console.windows import Keyboard, has_keys, remember, scaled_sheet
from experiments.screens.participant.messages import Theme
from experiments.screens.phrases import phrase
from experiments.screens.texts import saved_text
from experiments.session.duration import RunTiming
from experiments.session.events import Press
from experiments.session.history import GrowingHistory, History
from experiments.session.judging import BEAT_S
from experiments.session.states import Position, State
from experiments.session.steps import Rested
from experiments.session.tracks import Tracks, adaptive_tracks

SOON_MS = 3
"""How soon news is drawn: an answer's record is on the disk by then, and what it leads to is drawn with it."""
WIDE_PX, HIGH_PX = 1280.0, 760.0
"""The size at which type has its own size."""
SMALLEST, LARGEST = 0.55, 2.2
"""How far type shrinks and grows with the window."""
_AFTER_PAINT = -2
"""A priority below that of the paints which Qt posts (`Qt.EventPriority.LowEventPriority`, -1)."""


class _Painted(QEvent):
    """Comes when the position of a serial number has been painted."""

    Kind = QEvent.Type(QEvent.registerEventType())

    def __init__(self, serial: int) -> None:
        super().__init__(self.Kind)
        self.serial = serial


class ConsoleWindow(QtWidgets.QMainWindow):
    """What to do now, the keys that do it, and what an experimenter looks for: progress, gun, what comes next."""

    closed = pyqtSignal()

    def __init__(self, about: view.About, clock: Clock) -> None:
        super().__init__()
        self.about, self.clock = about, clock
        self.live: LiveRun | None = None
        self._told: GrowingHistory = []
        self._tracks: Tracks | None = None
        self.controls: Controls | None = None
        self._own_arrows = own_arrows(about.setup.config)
        self.drawn, self._painted = Position(), -1
        self.gun: view.GunSeen | None = None
        self.participant: view.ParticipantSeen | None = None
        self.ended: view.Ended | None = None
        self._progress = RunTiming()
        self.theme: Theme = "dark"
        self._takes_keys, self._scale = False, 0.0
        self._build()
        self._keyboard = Keyboard(self, clock.now)
        KeepsKeys(self)
        WhateverPressed(self, partial(self.let_go, by_hand=False), but=BY_NAME["rearm"].key, mouse=True)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._beat)
        self._timer.start(round(1000 * BEAT_S))
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.setInterval(SOON_MS)
        self._soon.timeout.connect(self.refresh)

    def _build(self) -> None:
        what = self.about.band or self.about.plan.experiment
        self.setWindowTitle(
            phrase("Recoil – {participant_id}, {what}", participant_id=self.about.plan.participant_id, what=what)
        )
        self.bands = [widgets.text_label("band", wrap=False) for _ in range(2)]
        self.notice, self.fields, self.side, self.buttons = Notice(), TextFields(), SidePanel(self.about), Buttons(self)
        self.bars = Bars(self.about)
        self.place, self.saved = widgets.text_label("place"), self.notice.said
        self._main = QtWidgets.QWidget()
        left = widgets.fill(QtWidgets.QVBoxLayout(self._main), *self.notice.labels)
        left.addStretch(1)
        widgets.fill(left, self.fields.pages, self.buttons.slots, self.fields.bar, self.saved)
        across = widgets.fill(QtWidgets.QHBoxLayout(), (self._main, 3), (self.side, 1))
        down = QtWidgets.QVBoxLayout(whole := QtWidgets.QWidget())
        widgets.fill(down, self.place, (across, 1), self.bars, margins=(10, 6, 10, 6))
        self.pages, self.page = QtWidgets.QStackedWidget(), TextPage()
        self._said = SaidLine(self.saved, self.page.said)
        self.pages.addWidget(whole)
        self.pages.addWidget(self.page)
        outer, bands = QtWidgets.QVBoxLayout(central := QtWidgets.QWidget()), QtWidgets.QWidget()
        widgets.fill(QtWidgets.QHBoxLayout(bands), *self.bands)
        widgets.fill(outer, bands, (self.pages, 1), self.buttons.row, margins=(0, 0, 0, 4))
        self.setCentralWidget(central)
        central.setMinimumSize(1, 1)
        self.setMinimumSize(640, 400)
        self.resize(1280, 800)

    # messages

    def begin(self, live: LiveRun, controls: Controls) -> None:
        """A live run is there, and who works it."""
        self.live, self.controls, self._painted = live, controls, -1
        self.about = replace(self.about, simulated=is_simulated(live.gun_name))
        self._tracks = adaptive_tracks(self.about.setup.config, self.about.plan, self._told)

    def take(self, message: view.Message) -> None:
        """Take a message from the run, which is shown soon."""
        match message:
            case view.Began() | view.Shown():
                self._arrive()
            case view.Saved():
                self._acknowledge(message)
            case view.GunSeen():
                self.gun = message
            case view.ParticipantSeen():
                self._see_participant(message)
            case view.Trouble():
                self._said.trouble(message, self._said_at())
            case view.Ended():
                self._end(message)
        self._show_soon()

    def _see_participant(self, seen: view.ParticipantSeen) -> None:
        """How the participant's screen stands; one that is started again comes with the keys."""
        before, self.participant = self.participant, seen
        if before is not None and before.starting and not seen.starting:
            self.activateWindow()
        self._takes_keys = seen.starting
        if seen.failure:
            self._said.forget()

    def _show_soon(self) -> None:
        if not self._soon.isActive():
            self._soon.start()

    def changeEvent(self, event: QEvent | None) -> None:  # noqa: N802 - Qt's name
        """Once while the participant's screen is started again, take the keys back that its window comes with."""
        super().changeEvent(event)
        if event is not None and event.type() == QEvent.Type.ActivationChange and not self.isActiveWindow():
            if self._takes_keys:
                self.activateWindow()
            self._takes_keys = False

    def customEvent(self, event: QEvent | None) -> None:  # noqa: N802 - Qt's name
        """A position is on the screen."""
        if isinstance(event, _Painted) and self.live is not None:
            self.live.painted(event.serial, self.clock.now())

    def _end(self, message: view.Ended) -> None:
        self.ended = message
        self._said.forget("wait")  # what is begun is not done any more
        if message.reason is not None and message.saved is None:
            self._said.forget()
        if self.controls is not None:
            self.controls.end()
        self.close_line()
        self.refresh()  # at once: a window that is closed in this moment has said how it ended
        play_tone()

    def _arrive(self) -> None:
        """Draw the newest position: its field, and where the cursor goes; a line that is being typed keeps it."""
        if self.live is None:
            return
        before, self.drawn = self.drawn, self.live.position
        if view.typed_there(self.about, before) and not view.typed_there(self.about, self.drawn):
            self.activateWindow()  # the participant's screen took the keys
        if self.drawn.base is State.HALTED and before.base is not State.HALTED:
            self._said.forget()
        if self.controls is not None:
            self.controls.draw(self.drawn)
            self._said.at(self.drawn)
        self._progress.at(self.drawn, self.clock.now())
        self.fields.at(self.drawn, self.controls.entered_so_far() if self.controls is not None else "")
        self.fields.focus(self.drawn, self)

    def _acknowledge(self, message: view.Saved) -> None:
        """Say that it is safe; a tone at the end of a break."""
        self._progress.saved(message.step, message.word, self.clock.now())
        text = saved_text(self.about.plan, self.seen.told, message.step, message.word)
        self._said.saved(message, text, self._said_at())
        if isinstance(message.word, Rested):
            play_tone()

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer, for a few seconds."""
        self._said.say(text, mood, self._said_at())

    def _said_at(self) -> SaidAt:
        position = self.drawn if self.live is None else self.live.position  # what it led to may not be drawn yet
        return SaidAt(now_s=self.clock.now(), serial=position.serial)

    # showing

    @property
    def seen(self) -> view.Seen:
        """Everything that is shown now."""
        told = () if self.live is None else self.live.history
        return view.Seen(
            about=self.about,
            position=self.drawn,
            told=told,
            gun=self.gun,
            participant=self.participant,
            ended=self.ended,
            over=self._tracks_over(told),
            letters=self._typing.letters,
            halt_unsaved=self.live is not None and self.live.halt_unsaved,
            now_s=self.clock.now(),
        )

    def _tracks_over(self, told: History) -> frozenset[int]:
        if self._tracks is None:
            return frozenset()
        self._told.extend(told[len(self._told) :])  # one list that grows: each answer is taken once
        return self._tracks.over

    def _beat(self) -> None:
        if self.live is not None:
            self.live.beats.beat(heard=are_keys_heard(self.participant, here=has_keys(self)))
        self.refresh()

    def refresh(self) -> None:
        """Show what is so now.

        Qt paints it by itself, when Python's other threads can run: the record of an answer does not wait meanwhile.
        """
        self._soon.stop()
        if self.controls is not None:
            self.controls.tick(here=self.isActiveWindow(), down=self._keyboard.is_down(BY_NAME["rearm"].key))
        seen = self.seen
        if self.live is not None:
            self.live.gun_silence = seen.gun_silence
        self.notice.put(instruction(seen))
        self.place.setText(view.where_text(seen))
        self._show_bands(seen)
        self.bars.put(seen)
        self.side.put(seen, self._progress)
        self.buttons.put(self.drawn, over=self.ended is not None, letters=self._typing.letters, idle=self._idle)
        self._said.tick(seen.now_s)
        self._fit()
        if self.drawn.serial != self._painted:
            self._painted = self.drawn.serial
            QCoreApplication.postEvent(self, _Painted(self._painted), _AFTER_PAINT)

    def _show_bands(self, seen: view.Seen) -> None:
        found = view.bands(seen)
        for label, (text, name) in zip(self.bands, [*found, *[("", "")] * (2 - len(found))], strict=True):
            label.setVisible(bool(text))
            label.setText(text)
            widgets.set_mood(label, name)

    def _idle(self, name: Name) -> bool:
        """Whether a command does nothing now; a run that never began has one alone, which closes its window."""
        if self.controls is None:
            return name != "stop" or self.ended is None
        return bool(self.controls.idle(name))

    # fitting

    def _fit(self) -> None:
        """Shrink what was said last and the instruction until all of it is there."""
        layout = self._main.layout()
        if layout is None or not self.isVisible():
            return
        for fit in FITS:
            self.notice.size(self._scale, fit)
            if layout.heightForWidth(self._main.width()) <= self._main.height():
                return

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """Type grows and shrinks with the window."""
        super().resizeEvent(event)
        wanted = min(max(min(self.width() / WIDE_PX, self.height() / HIGH_PX), SMALLEST), LARGEST)
        if abs(wanted - self._scale) > 0.01:
            self._scale = wanted
            self._restyle()

    def _restyle(self) -> None:
        self.setStyleSheet(scaled_sheet(widgets.sheet(self.theme), self._scale))

    def showEvent(self, event: QShowEvent | None) -> None:  # noqa: N802 - Qt's name
        """Hear the keys before any widget does."""
        super().showEvent(event)
        if (handle := self.windowHandle()) is not None:
            handle.removeEventFilter(self._keyboard)
            handle.installEventFilter(self._keyboard)

    # keys and buttons

    @property
    def _typing(self) -> Typing:
        return Typing() if self.controls is None else self.controls.typing

    def press(self) -> Press:
        """A press of a button that begins now."""
        return Press(at_s=self.clock.now(), serial=self.drawn.serial)

    def command(self, key: str, *, ctrl: bool) -> Name | None:
        """The command that a key is now."""
        if self.controls is None:
            return "stop" if key == BY_NAME["stop"].key and not self._idle("stop") else None
        return self.controls.command(key, ctrl=ctrl)

    def is_elsewhere(self, key: str) -> bool:
        """Whether a key is the participant's, and does nothing here: in a field it would move the caret."""
        return self.about.participant_keys and key in self._own_arrows

    def down(self, name: Name, at_s: float) -> None:
        """The key of a command went down: what it does is to be seen, where a question is in front of the console."""
        self.raise_()
        if self.controls is None:
            self.do(name, self.press())
        else:
            self.controls.down(name, at_s)
        self._show_soon()

    def up(self, key: str) -> None:
        """A key was let go."""
        if self.controls is not None:
            self.controls.up(key)

    def do(self, name: Name, press: Press) -> None:
        """The button of a command was clicked."""
        if self.controls is not None:
            self.controls.clicked(name, press, heard=has_keys(self))
        elif name == "stop" and self.ended is not None:
            self.close()
        self._show_soon()

    def hold(self, press: Press) -> None:
        """The button that has to be held went down."""
        if self.controls is not None:
            self.controls.hold(press)

    def let_go(self, *, by_hand: bool = True) -> None:
        """It was let go, or something else was pressed."""
        if self.controls is not None:
            self.controls.let_go(by_hand=by_hand)

    # what the controls need

    def open_line(self, question: str) -> None:
        """Let a line be typed."""
        self.fields.open_line(question)

    def close_line(self) -> None:
        """Take the line away."""
        self.fields.close_line(self.drawn, self)

    def typed(self, field: TextField) -> str:
        """What is typed in a field."""
        return self.fields.typed(field)

    def take_typed(self) -> str:
        """What was typed for the step at hand and not entered; it is taken away."""
        return self.fields.take_typed()

    def show_page(self, title: str, lines: list[str]) -> None:
        """Cover the run with a page of text."""
        self.page.put(title, lines)
        self.pages.setCurrentIndex(1)

    def close_page(self) -> None:
        """Show the run again."""
        self.pages.setCurrentIndex(0)

    def show_list(self) -> None:
        """Cover the run with the marks of the set."""
        self.show_page(
            phrase("Flags, notes, corrections and repeats of this set. Esc leaves this page."), marks(self.seen)
        )

    def other_theme(self) -> None:
        """Change the colours."""
        self.theme = "light" if self.theme == "dark" else "dark"
        self._restyle()

    def closeEvent(self, event: QCloseEvent | None) -> None:  # noqa: N802 - Qt's name
        """Closing the window of a live run pauses it and asks why it stops; once it has ended, the window goes."""
        if event is None:
            return
        if self.ended is None:
            event.ignore()
            if self.controls is not None:
                self.controls.ask_why_it_stops()
            return
        remember(self, "run")
        event.accept()
        self.closed.emit()
