"""Does PsychoPy open a window here? Imported as the participant's screen imports it."""

from __future__ import annotations

import time
from typing import Any

from experiments.doctor.figures import PsychoPyStage, percentile
from experiments.screens.participant.stage import load_toolkit, writable_home

FRAMES = 60


def look() -> PsychoPyStage:
    """Import PsychoPy, open a window, draw some frames."""
    with writable_home():
        start_s = time.monotonic()
        toolkit = load_toolkit()
        imported_s = time.monotonic()
        window = toolkit.visual.Window(size=(480, 120), fullscr=False, checkTiming=False)
        opened_s = time.monotonic()
        frame_s = _frame_s(window)
        window.close()
    return PsychoPyStage(
        version=toolkit.version,
        import_s=imported_s - start_s,
        opened_s=opened_s - imported_s,
        frames_Hz=1 / frame_s,
    )


def _frame_s(window: Any) -> float:
    """The median time of a frame."""
    times = []
    for _ in range(FRAMES):
        start_s = time.monotonic()
        window.flip()
        times.append(time.monotonic() - start_s)
    return percentile(times, 50)
