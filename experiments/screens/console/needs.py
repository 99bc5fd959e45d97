"""What the controls need of the window, and of the participant's screen."""

from __future__ import annotations

from typing import Literal, Protocol

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
