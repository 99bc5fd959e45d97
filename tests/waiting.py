"""Waiting for what must come: it ends when it has come, and gives up only when no machine would be so slow."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

PATIENCE_S = 300.0
"""The end of every wait; also of programs that tests start. Only a test that fails ever sees it."""
LOOK_S = 0.005


def wait_for(
    what: Callable[[], Any], why: Callable[[], object] | str = "it did not happen", *, look_s: float = LOOK_S
) -> Any:
    """Look until something holds, and give it back; `AssertionError` with the reason if it never does."""
    end_s = time.monotonic() + PATIENCE_S
    while not (found := what()):
        if time.monotonic() > end_s:
            raise AssertionError(why if isinstance(why, str) else why())
        time.sleep(look_s)
    return found
