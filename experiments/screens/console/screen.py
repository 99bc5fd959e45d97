"""The console as the run sees it: what it shows is told to the window, in a thread of its own. Knows nothing of Qt."""

from __future__ import annotations

import threading
from collections.abc import Callable

from device import DeviceError, Gun, GunStatus
from experiments.live_run import LiveRun
from experiments.screens.console.beside import ParticipantSide
from experiments.screens.console.messages import Began, GunSeen, Message, Saved, Shown, Trouble
from experiments.session.remarks import Noted, Remark
from experiments.session.states import Position
from experiments.session.steps import Outcome, Step

GUN_LOOK_S = 0.2
"""How often the gun's state is looked at."""


class ConsoleScreen:
    """Shows a run in a window, which offers what its keys and buttons mean. `tell` takes messages to it.

    `beside` is the participant's own screen, where there is one.
    """

    def __init__(self, tell: Callable[[Message], None], beside: ParticipantSide | None = None) -> None:
        self._tell, self._beside = tell, beside
        self._stop_looking = threading.Event()

    def begin(self, live: LiveRun) -> None:
        """Show where the run stands, and look after the gun from now on."""
        self._tell(Began(live=live))
        if self._beside is not None:
            noise = self._beside.begin(live, self._tell)
            if noise:
                live.remark(Noted(trial=None, text=noise))
        threading.Thread(target=self._look, args=(live.gun,), daemon=True, name="gun-look").start()

    def end(self) -> None:
        """Look no more, and let the participant's screen go."""
        self._stop_looking.set()
        if self._beside is not None:
            threading.Thread(target=self._beside.close, daemon=True).start()

    def show(self, position: Position) -> None:
        """Have a position shown, on the participant's screen as well."""
        self._tell(Shown(position=position))
        if self._beside is not None:
            self._beside.follow(position)

    def act(self, position: Position, until_s: float | None) -> None:
        """The window acts whenever a key does."""

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that it is safe."""
        self._tell(Saved(step=step, word=word))

    def trouble(self, text: str) -> None:
        """Show what went wrong."""
        self._tell(Trouble(text=text))

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says."""
        self._tell(GunSeen(status=status, fault=fault))

    def _look(self, gun: Gun) -> None:
        """Look at the gun until the run ends."""
        while not self._stop_looking.is_set():
            try:
                self.gun_seen(gun.status(), "")
            except DeviceError as error:
                self.gun_seen(None, str(error))
            self._stop_looking.wait(GUN_LOOK_S)
