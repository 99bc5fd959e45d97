"""What the pages share that are answered and confirmed: heading, button, hint."""

from __future__ import annotations

from typing import Any

from experiments.screens.participant.stage import Box, Stage
from experiments.screens.participant.words import AskDescription, AskRating

ENTER = ("RETURN", "ENTER", "NUM_ENTER")
"""Keys that confirm, as pyglet names them."""


class Button:
    """A button that can be pressed once there is something to confirm."""

    def __init__(self, stage: Stage, text: str) -> None:
        self._box = Box(y=-0.34, width=0.36, height=0.1, anchor="center")
        inner = Box(y=self._box.y, width=0.32, height=0.08, anchor="center")
        colors = stage.palette
        self._off = [stage.panel(self._box, colors.panel), stage.text(text, inner, 0.045, colors.muted)]
        self._on = [stage.panel(self._box, colors.accent), stage.text(text, inner, 0.045, colors.on_accent)]

    def draw(self, enabled: bool) -> None:
        """Lit or not."""
        for stimulus in self._on if enabled else self._off:
            stimulus.draw()

    def holds(self, x: float, y: float) -> bool:
        """Whether a place is on it."""
        return abs(x - self._box.x) <= self._box.width / 2 and abs(y - self._box.y) <= self._box.height / 2


def heading(stage: Stage, asked: AskRating | AskDescription) -> list[Any]:
    """Which stimulus is meant, by its order of presentation, and the question."""
    width = 2 * stage.half_width
    which = f"Feedback {asked.number} of {asked.of}"
    return [
        stage.text(which, Box(y=0.46, width=width, height=0.07), 0.05, stage.palette.accent),
        stage.text(asked.question, Box(y=0.37, width=width, height=0.3), 0.045, stage.palette.ink),
    ]


def hint(stage: Stage, text: str) -> Any:
    """How to answer, small, at the foot."""
    return stage.text(text, Box(y=-0.425, width=2 * stage.half_width, height=0.05), 0.034, stage.palette.muted)
