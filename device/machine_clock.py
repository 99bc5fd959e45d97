"""The machine's clock: seconds that never run backwards, the same for every process of the machine.

Every time of a run is one of it, so that of different processes can be compared. Before Python 3.13 `time.monotonic`
moves in steps of 15.6 ms on Windows, as coarse as a response time is to be fine, and too coarse to bound a gun's clock
between two readings; `time.perf_counter` is as fine there as elsewhere, and common to all processes (since 3.10).
"""

from __future__ import annotations

import sys
import time
from typing import Literal

MACHINE_CLOCK: Literal["monotonic", "perf_counter"] = "perf_counter" if sys.platform == "win32" else "monotonic"
"""The clock's name in Python's `time`."""
machine_s = time.perf_counter if sys.platform == "win32" else time.monotonic
"""Seconds on it."""
