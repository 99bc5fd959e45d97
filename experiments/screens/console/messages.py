"""What the run, which works in a thread of its own, tells the window, and what the controls need of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from device import GunStatus
from experiments.live_run import LiveRun
from experiments.session.remarks import Remark
from experiments.session.states import Position
from experiments.session.steps import Outcome, Step


@dataclass(frozen=True, slots=True, kw_only=True)
class Began:
    """The run is there, and can be worked."""

    live: LiveRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """A position is to be shown."""

    position: Position


@dataclass(frozen=True, slots=True, kw_only=True)
class Saved:
    """A step's outcome, or a remark, is on the disk."""

    step: Step | None
    word: Outcome | Remark


@dataclass(frozen=True, slots=True, kw_only=True)
class GunSeen:
    """The gun as it was a moment ago, or why it does not answer."""

    status: GunStatus | None
    fault: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParticipantSeen:
    """Whether the participant's screen has the keys, or why it is gone."""

    focused: bool = False
    failure: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """Something went wrong, and what; or, by its mood, what is done about it."""

    text: str
    mood: str = "bad"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """The run is over: finished (no reason), or stopped or failed for one.

    `saved`: the answers that were read back from the disk; `None` if none were looked for.
    """

    reason: str | None
    saved: int | None = None


Message = Began | Shown | Saved | GunSeen | ParticipantSeen | Trouble | Ended

Field = Literal["line", "number", "words"]


class View(Protocol):
    """What the controls need of the window."""

    def say(self, text: str, mood: str) -> None:
        """Show a line of answer, for a few seconds."""

    def open_line(self, question: str) -> None:
        """Let a line be typed."""

    def close_line(self) -> None:
        """Take the line away."""

    def typed(self, field: Field) -> str:
        """What is typed in a field."""

    def show_page(self, title: str, lines: list[str]) -> None:
        """Cover the run with a page of text."""

    def close_page(self) -> None:
        """Show the run again."""

    def show_list(self) -> None:
        """Cover the run with the marks of the set."""

    def other_theme(self) -> None:
        """Change the colours."""

    def shut(self) -> None:
        """Close the window of a run that has ended."""


class Beside(Protocol):
    """What the controls need of the participant's screen."""

    @property
    def lost(self) -> bool:
        """Whether it is gone, and not being started again."""

    def restart(self) -> None:
        """Start it again."""
