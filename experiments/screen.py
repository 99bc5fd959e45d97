"""What a run needs of the screen at which it is worked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from device import GunStatus
from experiments.session.remarks import Remark
from experiments.session.states import Position
from experiments.session.steps import Outcome, Step

if TYPE_CHECKING:
    from experiments.live_run import LiveRun


class Screen(Protocol):
    """Where a run is shown, and worked by a person, real or synthetic. All but `begin` and `act` come from any thread.

    Whoever works it offers events to the live run; nothing is decided here.
    """

    def begin(self, live: LiveRun) -> None:
        """Take the place before a run that stands where `live` says."""

    def show(self, position: Position) -> None:
        """Show a position; one of an earlier serial number than the last is out of date."""

    def act(self, position: Position, until_s: float | None) -> None:
        """The run waits now, at most until a time: who works in the run's own thread acts; others just go on."""

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Show that something is safe: its record is on the disk. A remark has no step."""

    def trouble(self, text: str) -> None:
        """Show what went wrong."""

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Show what the gun itself says of its state, or why it says nothing."""
