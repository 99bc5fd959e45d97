"""What a start window opens with, and what is chosen in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from experiments.config.setup import Setup
from experiments.run import Again
from experiments.screens.console.form import Beside


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What was chosen: who does which experiment, and how. `anew_reason`: why an unfinished run is set aside."""

    setup: Setup[Any]
    participant_id: str
    again: Again = "ask"
    anew_reason: str = ""
    practice: bool = False
    training: bool = False
    participant_screen: bool = False
    participant_keys: bool = False
    noise: bool = False
    monitor: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """How a start window opens: on which gun, with what ticked, with whom (empty: who comes next), and what it says.

    `named` is the experiment whose config was named when the program was started; later windows have none.
    """

    gun: str
    named: str = ""
    beside: Beside = field(default_factory=Beside)
    participant_id: str = ""
    said: str = ""
