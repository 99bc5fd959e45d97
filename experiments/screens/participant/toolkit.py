"""Where PsychoPy is imported, all but its sound, and only when the program runs: it takes seconds and a display."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Toolkit:
    """The parts of PsychoPy that this program uses. It has no types."""

    version: str
    visual: Any
    event: Any
    keyboard: Any
    key_epoch_s: float
    key: Any
    fonts: Path
    now: Any


@contextmanager
def writable_home() -> Iterator[None]:
    """A home folder for PsychoPy, which writes to it when it is imported: another if this one takes nothing."""
    if _takes_files(Path(os.environ.get("HOME", "")) / ".psychopy3"):
        yield
        return
    with tempfile.TemporaryDirectory(prefix="recoil-home-", ignore_cleanup_errors=True) as home:
        os.environ["HOME"] = home
        yield


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def load() -> Toolkit:
    """Import PsychoPy. What it raises without a display or without a part of itself passes through."""
    # imported when used: see above
    import psychopy  # noqa: PLC0415
    from psychopy import clock, event, logging, visual  # noqa: PLC0415
    from psychopy.hardware import keyboard  # noqa: PLC0415
    from pyglet.window import key  # noqa: PLC0415

    logging.console.setLevel(logging.ERROR)
    return Toolkit(
        version=psychopy.__version__,
        visual=visual,
        event=event,
        keyboard=keyboard,
        key_epoch_s=logging.defaultClock.getLastResetTime(),
        key=key,
        fonts=Path(psychopy.__file__).parent / "assets" / "fonts",
        now=clock.getTime,
    )
