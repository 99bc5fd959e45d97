"""How close a key's time on the participant's screen is to the press, kept as a table: `make soak`."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from experiments.screens.participant.link import ParticipantLink
from tests import at_participant as screen
from tests.at_participant import Hands, console, display, hands, link
from tests.conftest import Soak
from tests.waiting import PATIENCE_S

pytestmark = [pytest.mark.soak, *screen.pytestmark]

PRESSES = 300
STAMP_MS = 50.0

__all__ = ["console", "display", "hands", "link"]


def test_keys_beside_their_presses(link: ParticipantLink, hands: Any, console: ThreadPoolExecutor, soak: Soak) -> None:
    late_ms = [stamp_ms(link, hands, console) for _ in range(PRESSES)]
    found = float(np.percentile(np.abs(late_ms), 99))
    how = f"{PRESSES} keys by XTest on Xvfb, clocks mapped; median {np.median(late_ms):.2f} ms"
    soak("99th percentile, a key's time beside its press", f"{found:.2f} ms", f"{STAMP_MS:g} ms", how)
    assert found < STAMP_MS


def stamp_ms(link: ParticipantLink, hands: Hands, console: ThreadPoolExecutor) -> float:
    """How much later than its press a key that answers was stamped."""
    question = replace(screen.WHICH, onset_s=time.monotonic())
    answer = console.submit(link.ask_choice, question)
    time.sleep(0.1)
    pressed_s = hands.key("f")
    return 1000 * (answer.result(PATIENCE_S).pressed_s - pressed_s)
