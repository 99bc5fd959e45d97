"""Does PsychoPy open a window here? Imported as the participant's screen imports it."""

from __future__ import annotations

from typing import Any

from device.machine_clock import machine_s
from experiments.doctor.figures import PsychoPyStage, percentile
from experiments.screens.participant.stage import load_toolkit, writable_home

FRAMES = 60


def look() -> PsychoPyStage:
    """Import PsychoPy, open a window, draw some frames."""
    with writable_home():
        start_s = machine_s()
        toolkit = load_toolkit()
        imported_s = machine_s()
        window = toolkit.visual.Window(size=(480, 120), fullscr=False, checkTiming=False)
        opened_s = machine_s()
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
        start_s = machine_s()
        window.flip()
        times.append(machine_s() - start_s)
    return percentile(times, 50)
