"""How long does a key take to a Qt window? Keys are injected by X's test extension, and only while it has the focus."""

from __future__ import annotations

from PyQt6.QtCore import QCoreApplication, QEventLoop, QTimer
from PyQt6.QtGui import QKeyEvent
from PyQt6.QtWidgets import QApplication, QLabel
from Xlib import XK, X, display  # type: ignore[import-untyped, unused-ignore]
from Xlib.ext import xtest  # type: ignore[import-untyped, unused-ignore]

from device.machine_clock import machine_s
from experiments.doctor.figures import Keys
from experiments.doctor.programs import Absent
from experiments.doctor.programs.display import until_seen

KEYS = 30
PAUSE_MS = 10
"""Between two keys, so that each finds the window at rest, as a person's would."""
PATIENCE_MS = 500
"""For one key, and for the focus."""


class Target(QLabel):
    """A window that stamps each key when it comes and again when it is painted."""

    def __init__(self, loop: QEventLoop) -> None:
        super().__init__("Recoil times keys: please do not type.")
        self.setWindowTitle("Recoil doctor")
        self.resize(480, 120)
        self._loop = loop
        self.stamps: tuple[float, float] | None = None

    def forget(self) -> None:
        """No key has come yet."""
        self.stamps = None

    def keyPressEvent(self, _: QKeyEvent | None) -> None:  # noqa: N802 - Qt's name
        """Stamp, paint as the console does after an answer, stamp again."""
        came_s = machine_s()
        self.setText(f"Recoil times keys: {came_s:.6f} s")
        self.repaint()
        self.stamps = came_s, machine_s()
        self._loop.quit()


class Injector:
    """X's test extension. `Absent` where there is none."""

    def __init__(self) -> None:
        self._display = display.Display()
        if self._display.query_extension("XTEST") is None:
            raise Absent("this display has no extension XTEST")
        self._code = self._display.keysym_to_keycode(XK.string_to_keysym("f"))

    def focus(self, window: int) -> None:
        """Give a window the keyboard, also where no window manager would."""
        self._display.create_resource_object("window", window).set_input_focus(X.RevertToParent, X.CurrentTime)
        self._display.sync()

    def press(self) -> float:
        """Press and let go of the key F; gives back when."""
        start_s = machine_s()
        for event in (X.KeyPress, X.KeyRelease):
            xtest.fake_input(self._display, event, self._code)
        self._display.flush()
        return start_s


def look() -> Keys:
    """Inject keys one by one and time each."""
    app = QApplication(["recoil"])
    if app.platformName() != "xcb":
        raise Absent(f"this display is no X display ({app.platformName()})")
    loop, injector = QEventLoop(), Injector()
    target = Target(loop)
    if not until_seen(target):
        raise RuntimeError("no window was seen")
    injector.focus(int(target.winId()))
    _turn(loop, PATIENCE_MS if QApplication.focusWindow() is None else PAUSE_MS)
    stamped = [times for times in (_one(loop, injector, target) for _ in range(KEYS)) if times]
    return Keys(injected=KEYS, to_event_ms=[came for came, _ in stamped], to_painted_ms=[done for _, done in stamped])


def _one(loop: QEventLoop, injector: Injector, target: Target) -> tuple[float, float] | None:
    """Milliseconds from one key to its event and to its paint; none if the key would go, or went, elsewhere."""
    _turn(loop, PAUSE_MS)
    QCoreApplication.processEvents()
    if not target.isActiveWindow():
        return None
    target.forget()
    start_s = injector.press()
    _turn(loop, PATIENCE_MS)
    if target.stamps is None:
        return None
    came_s, painted_s = target.stamps
    return 1000 * (came_s - start_s), 1000 * (painted_s - start_s)


def _turn(loop: QEventLoop, at_most_ms: int) -> None:
    """Let Qt work until the loop is left or the time is over."""
    timer = QTimer()
    timer.setSingleShot(True)
    timer.timeout.connect(loop.quit)
    timer.start(at_most_ms)
    loop.exec()
    timer.stop()
