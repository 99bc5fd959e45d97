"""A test shot: one shot of one method as a run fires it, beside the window, after a countdown; and its page.

The emergency stop is a latch: it is set before the gun is told to disarm, and looked at after the gun was armed and
before it fires, so that nothing of this test fires after it, whatever the gun does meanwhile.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from PyQt6.QtCore import Qt, QTimer, pyqtSignal
from PyQt6.QtWidgets import QVBoxLayout, QWidget

from device import DeviceError, Gun, GunStatus, Shot, ShotReport, open_gun
from device.methods import drive_of
from device.words import Drive
from experiments.clock import Clock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.earlier_run import owes_shot
from experiments.record.journal import JournalError
from experiments.record.owed_shot import OWED_FILE, DebtKeeper, OwedShot, owe_shot, shot_was_fired, take_back
from experiments.record.tables import is_simulated
from experiments.screens.console import widgets
from experiments.screens.console.instructions import DISARMING
from experiments.screens.console.over_all import KeepsKeys
from experiments.screens.console.shot_words import report_text, state_text
from experiments.screens.console.widgets import TextLines
from experiments.screens.console.windows import has_keys
from experiments.screens.phrases import phrase
from experiments.session.judging import BEAT_S, STANDSTILL_S, Beats

COUNTDOWN_S = 3
HUNG = phrase("The console did not hear its keys all through the countdown: nothing was fired.")
_LOOK_S = 0.02
RESULT_S = 0.5
"""What is pressed so soon after a shot was meant for the countdown: what came of it is still to be read (assumed)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotProgress:
    """What a test shot has to tell: how far it is, the seconds until the shot, and at the end what came of it."""

    phase: Literal["opening", "counting", "arming", "firing", "over"]
    seconds: int = 0
    fired: bool = False
    text: str = ""
    mood: str = "wait"


class ShotCheck:
    """One test shot of a method. `tell` is called from its own thread; the last it is told is `over`."""

    def __init__(
        self,
        setup: Setup[DesignConfig],
        method: str,
        address: str,
        clock: Clock,
        tell: Callable[[ShotProgress], None],
    ) -> None:
        self._setup, self._method, self._address = setup, method, address
        self._clock, self._tell = clock, tell
        self.beats = Beats(clock.now)
        """Of the window that hears what is pressed."""
        self._latched, self._off = threading.Event(), threading.Event()
        self._gun: Gun | None = None
        self.gun_name = ""
        """Known once it was opened."""
        self._report: ShotReport | None = None
        self.disarming: list[threading.Thread] = []

    def start(self) -> None:
        """Begin; returns at once."""
        threading.Thread(target=self.carry_out, name="test shot", daemon=True).start()

    def call_off(self) -> None:
        """Fire no more, if it has not fired yet."""
        self._off.set()

    def emergency_stop(self) -> None:
        """Latch, then disarm; returns at once, since a gun may take its time."""
        self._latched.set()
        self._off.set()
        disarming = threading.Thread(target=self._disarm, name="emergency stop", daemon=True)
        disarming.start()
        self.disarming.append(disarming)

    def _disarm(self) -> None:
        gun = self._gun
        if gun is not None:
            with suppress(DeviceError):  # the thread that fires disarms as well, and reads back what came of it
                gun.disarm()

    def carry_out(self) -> None:
        """All of it, in this thread."""
        text, mood = phrase("The test shot ended without a word; start Recoil from a terminal to see why."), "bad"
        try:
            text, mood = self._with_gun()
        except (DeviceError, ValueError) as error:
            text = phrase("Test shot of {label}: {error}.", label=self._label, error=error)
            if self._latched.is_set():
                text = f"{text} {state_text(None)[0]}"
        finally:
            self._tell(ShotProgress(phase="over", fired=self._report is not None, text=text, mood=mood))

    @property
    def _label(self) -> str:
        return self._setup.gun.methods[self._method].label

    def _with_gun(self) -> tuple[str, str]:
        """Open, fire, disarm, read back, close; what came of it, and a word for the colour."""
        self._tell(ShotProgress(phase="opening"))
        methods = self._setup.gun.renderings(self._setup.config.methods)
        drive = drive_of(methods[self._method])
        with closing(open_gun(self._address, methods, clock=self._clock.now)) as gun:
            self._gun = gun
            self.gun_name = gun.identify().name
            try:
                outcome, mood = self._fire(gun, drive), "good"
            except (DeviceError, ValueError) as error:
                outcome, mood = phrase("Test shot of {label}: {error}.", label=self._label, error=error), "bad"
            state, is_safe = state_text(self._disarmed(gun))
        return f"{outcome} {state}", "bad" if self._latched.is_set() or not is_safe else mood

    def _fire(self, gun: Gun, drive: Drive) -> str:
        began_s = self._clock.now()
        for seconds in range(COUNTDOWN_S, 0, -1):
            told_s = self._clock.now()
            self._tell(ShotProgress(phase="counting", seconds=seconds))
            if self._off.wait(1.0):
                break
            if self._clock.now() - told_s > 1.0 + STANDSTILL_S:  # what was pressed meanwhile is not heard yet
                return HUNG
        if not self._off.is_set():
            self._report = self._armed_shot(gun, drive, began_s)
            if self._report is None and not self._off.is_set():
                return HUNG
        return phrase("Nothing was fired.") if self._report is None else report_text(self._label, self._report, drive)

    def _armed_shot(self, gun: Gun, drive: Drive, began_s: float) -> ShotReport | None:
        """As the runner fires the first shot of a stimulus: armed for it alone, as soon as the magnet is home."""
        self._tell(ShotProgress(phase="arming"))
        gun.arm()
        ready_at_s = gun.status().ready_at_s
        self._tell(ShotProgress(phase="firing"))
        if self._off.wait(max(0.0, ready_at_s - self._clock.now())) or not self._is_heard(began_s):
            return None
        return gun.fire(Shot(method=self._method, direction="forward", drive=drive))

    def _is_heard(self, began_s: float) -> bool:
        """Whether all that was pressed since a countdown began was heard: the window neither stood still nor does."""
        give_up_s = self._clock.now() + STANDSTILL_S
        while not self.beats.prompt and self._clock.now() < give_up_s and not self._off.wait(_LOOK_S):
            pass
        heard = not self.beats.was_deaf_since(began_s) and self.beats.alive_since_s <= began_s
        return self.beats.prompt and heard

    def _disarmed(self, gun: Gun) -> GunStatus | None:
        """The state read back from the gun once it was told to disarm; `None` if it does not say."""
        try:
            gun.disarm()
            for disarming in self.disarming:
                disarming.join()
            return gun.status()
        except DeviceError:
            return None


class ShotPage(QWidget):
    """Takes the window's place from the press of a button until somebody goes back. One test shot at a time."""

    told = pyqtSignal(object)
    left = pyqtSignal()
    unkept = pyqtSignal(str)

    def __init__(self, gun: str, results: Path, clock: Clock) -> None:
        super().__init__()
        self._gun, self._results, self._clock = gun, results, clock
        self._check: ShotCheck | None = None
        self._setup: Setup[DesignConfig] | None = None
        self.stopped = False
        """The emergency stop: nothing is fired from this page until it was left, and entered on purpose."""
        self.owed = not is_simulated(gun) and owes_shot(results, gun)
        """After an emergency stop, also of an earlier window, until a test shot was fired."""
        self._keeper = DebtKeeper(results, self.unkept.emit)
        self._debt: OwedShot | None = None
        self._method_at = 0
        self._calls_off, self._fired_s, self._over_s = False, -math.inf, -math.inf
        self.over: Callable[[], None] = lambda: None
        self._gun_name = self._unkept = self._why = ""
        self._shown_detail = ("", "wait")
        self.told.connect(self._take)
        self._beat = QTimer(self)
        self._beat.timeout.connect(self._beats)
        self._beat.start(round(1000 * BEAT_S))
        self.unkept.connect(self._say_unkept)
        self._build()

    def _build(self) -> None:
        self.title, self.count, self.detail = (
            widgets.text_label("title"),
            widgets.text_label("count"),
            TextLines("detail", most_lines=9),
        )
        self.count.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.call_off_button = widgets.button(self, phrase("Call it off"), "Esc", self._escape, clicked=self._clicked)
        self.call_off_button.went_down.connect(self._call_off_at_once)
        self.call_off_button.stops = True
        self.next_button = widgets.button(self, phrase("Next test shot"), "Ctrl+T", self.begin, unseen=self.call_off)
        self.stop_button = widgets.button(
            self, phrase("EMERGENCY STOP"), "F12", self.emergency_stop, name="stop", at_once=True
        )
        down = widgets.fill(QVBoxLayout(self), self.title, self.detail, self.count)
        down.addStretch(1)
        widgets.fill(down, self.stop_button, self.call_off_button, self.next_button)
        # its place stays empty: there the second click of a double click on the window's own button falls
        kept = self.next_button.sizePolicy()
        kept.setRetainSizeWhenHidden(True)
        self.next_button.setSizePolicy(kept)
        KeepsKeys(self)

    @property
    def owed_text(self) -> str:
        """Why a test shot comes first; empty where none is owed."""
        return phrase("The last test shot ended by an emergency stop.") if self.owed else ""

    def _beats(self) -> None:
        if self._check is not None:
            self._check.beats.beat(heard=has_keys(self))

    @property
    def is_running(self) -> bool:
        """Whether a test shot is under way."""
        return self._check is not None

    def enter(self) -> None:
        """The page was entered anew."""
        self.stopped = False

    def choose(self, setup: Setup[DesignConfig]) -> None:
        """Test the methods of an experiment, from the first on."""
        if self._setup != setup:
            self._setup, self._method_at = setup, 0

    def next_text(self) -> str:
        """What the button of the next test shot says: the method, and the damper that is to be set by hand before."""
        if self._setup is None:
            return phrase("Test shot")
        method = self._setup.gun.methods[self._next_method(self._setup)]
        damper = phrase(", damper {damper}", damper=method.damper.upper()) if method.damper else ""
        return phrase("Test shot: {label}{damper}", label=method.label, damper=damper)

    def _next_method(self, setup: Setup[DesignConfig]) -> str:
        methods: tuple[str, ...] = setup.config.methods
        return methods[self._method_at % len(methods)]

    def begin(self) -> None:
        """Test the next method; not at once behind another shot, or behind one that a hand just called off."""
        if self._check is not None or self._setup is None or self.stopped:
            return
        if self._clock.now() - self._over_s < RESULT_S:
            return
        method = self._next_method(self._setup)
        self._shown = self.next_text().removeprefix(phrase("Test shot: "))
        self._show(
            phrase("One moment"), phrase("Looking for the gun. Test shot of {shown}.", shown=self._shown), "wait"
        )
        self._running(True)
        self._check = ShotCheck(self._setup, method, self._gun, self._clock, self.told.emit)
        self._beats()  # the first: a window that hangs from here on fires nothing
        self._check.start()

    def emergency_stop(self) -> None:
        """Latch and disarm; also behind a shot, which the stop may be for."""
        if self.stopped and not self.is_running:
            return
        if self._check is not None:
            self._check.emergency_stop()
            self._gun_name = self._check.gun_name
        is_new, self.stopped, self.owed = not self.stopped, True, True
        if is_new:
            self._owe()
        over = phrase(
            "The test shot was over, and the gun is not asked any more: if in doubt, switch off its power. "
            "A test shot comes first, whatever is done next. It had ended so: {outcome}",
            outcome=self._shown_detail[0],
        )
        self._show(phrase("EMERGENCY STOP"), DISARMING if self.is_running else over, "bad")
        self._running(self.is_running)

    def _owe(self) -> None:
        if self._is_simulated:
            return
        self._debt = OwedShot(utc=self._clock.utc(), gun=self._gun_name, address=self._gun)
        self._keeper.keep(partial(owe_shot, self._results, self._debt))

    def _settle(self, *, fired: bool) -> None:
        """What was owed is fired, or the gun that was stopped before it said its name is a simulated one."""
        if self._debt is not None and not self._debt.gun and self._is_simulated:
            self._keeper.keep(partial(take_back, self._results, self._debt))
        elif fired and not self.owed and not is_simulated(self._gun):
            self._keeper.keep(partial(shot_was_fired, self._results, self._gun_name, self._gun))
        self._debt = None

    @property
    def _is_simulated(self) -> bool:
        """Nobody who comes later is in danger: such a gun owes a test shot to this window alone, also on a line."""
        return is_simulated(self._gun) or is_simulated(self._gun_name)

    def _say_unkept(self, why: str) -> None:
        """Whether the stop is not on the disk yet: only this window knows of it."""
        meanwhile = phrase("That is tried again until this window closes: see to the file, or fire a test shot before.")
        self._unkept = why and self._unkept_text(why, meanwhile)
        self._show_detail()

    def _unkept_text(self, why: str, what_then: str) -> str:
        return phrase(
            "{file} does not keep that a test shot is owed ({why}). {what_then}",
            file=self._results.resolve() / OWED_FILE,
            why=why,
            what_then=what_then,
        )

    def end(self, *, wait: bool) -> None:
        """Nothing more comes of this page. `JournalError`, where it is waited for that: what is owed is not kept."""
        self._keeper.end(wait=wait)
        if wait and self.owed and self._keeper.why:
            what_then = phrase("Nobody will be asked for it: fire one before anything else is done with the gun.")
            raise JournalError(self._unkept_text(self._keeper.why, what_then))

    def call_off(self, why: str = "") -> None:
        """Fire no more, if it has not fired."""
        if self._check is not None and not self.stopped:
            self._why = why
            self._check.call_off()

    def _call_off_at_once(self) -> None:
        self._calls_off = self.is_running
        self.call_off()

    def _clicked(self) -> None:
        """Go back, but not by the press that called off: what came of that is still to be read."""
        before, self._calls_off = self._calls_off, False
        if not before:
            self._escape()

    def _escape(self) -> None:
        if self.is_running:
            self.call_off()
        elif not self._is_to_be_read:
            self.left.emit()

    @property
    def _is_to_be_read(self) -> bool:
        return self._clock.now() - self._fired_s < RESULT_S

    def _take(self, told: ShotProgress) -> None:
        """Show how far the test shot is."""
        if told.phase == "over":
            self._end(told)
        elif self.stopped:
            return
        elif told.phase == "counting":
            self._show(
                phrase("STAND CLEAR"),
                phrase("{shown} will be fired. Nobody may hold the gun. Esc calls it off.", shown=self._shown),
                "ask",
            )
            self.count.setText(str(told.seconds))
        elif told.phase == "arming":
            self._show(phrase("STAND CLEAR"), phrase("{shown}: the gun is being armed.", shown=self._shown), "ask")
        else:
            self._show(phrase("Firing"), self._shown, "wait")

    def _end(self, told: ShotProgress) -> None:
        if self._check is not None:
            self._gun_name = self._check.gun_name
        self._check, why, self._why, self._over_s = None, self._why, "", self._clock.now()
        if told.fired:
            self._method_at += 1
            self.owed, self._fired_s = self.stopped, self._clock.now()
        self._settle(fired=told.fired)
        title = phrase("EMERGENCY STOP") if self.stopped else phrase("Fired") if told.fired else phrase("Not fired")
        self._show(title, told.text if told.fired else " ".join(filter(None, [why, told.text])), told.mood)
        self._running(False)
        self.over()

    def _show(self, title: str, detail: str, mood: str) -> None:
        self.title.setText(title)
        widgets.set_mood(self.title, mood)
        self._shown_detail = detail, mood
        self._show_detail()
        self.count.setText("")

    def _show_detail(self) -> None:
        detail, mood = self._shown_detail
        unkept = self._unkept if self.owed else ""
        self.detail.say(" ".join(filter(None, [detail, unkept])), "bad" if unkept else mood)

    def _running(self, running: bool) -> None:
        self.call_off_button.setFocus()  # Space calls off, and behind the shot stops nothing and fires nothing
        self.next_button.setVisible(not (running or self.stopped))
        self.next_button.setText(phrase("{next}  [Ctrl+T]", next=self.next_text()))
        self.call_off_button.setText(phrase("Call it off  [Esc]") if running else phrase("Back  [Esc]"))
