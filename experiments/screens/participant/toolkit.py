"""Where PsychoPy is imported, all but its sound, and only when the program runs: it takes seconds and a display.

Its keyboard stamps keys as they happen and not as frames are drawn, and hears them whichever window has the focus: a
two-button box that acts as keys needs none; and so the console must not use the participant's keys for its own ends.
"""

from __future__ import annotations

import os
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.screens.participant.words import Noise, NoiseIs


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


_KEPT = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Press:
    """A key by PsychoPy's name, and when it went down on the clock of this process."""

    name: str
    pressed_s: float


class Keys:
    """The last keys that went down, oldest first."""

    def __init__(self, toolkit: Toolkit) -> None:
        self._board = toolkit.keyboard.Keyboard()
        self._epoch_s = toolkit.key_epoch_s
        self._presses: deque[Press] = deque(maxlen=_KEPT)

    def since(self, onset_s: float) -> Iterator[Press]:
        """The keys that went down from a moment on."""
        self.poll()
        return (
            press for press in sorted(self._presses, key=lambda press: press.pressed_s) if press.pressed_s >= onset_s
        )

    def poll(self) -> None:
        """Take what PsychoPy holds. It gives keys still down and keys let go apart, a key that was both twice."""
        for released in (False, True):
            for found in self._board.getKeys(waitRelease=released):
                press = Press(name=str(found.name), pressed_s=float(found.tDown) + self._epoch_s)
                if press not in self._presses:
                    self._presses.append(press)


_LOOP_S = 10.0
_RATE_Hz = 44_100
_SEED = 20_240  # assumed; any will do, and the same noise for everybody


class MaskingNoise:
    """White noise in a loop. Where it cannot play it stays off and says why, in one message."""

    def __init__(self) -> None:
        self._sound: Any = None

    def turn(self, asked: Noise) -> NoiseIs:
        """Turn it on or off."""
        self.stop()
        if not asked.on:
            return NoiseIs(on=False, message="", ask=asked.ask)
        try:
            self._sound = _playing(asked.level)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # noqa: BLE001 - PsychoPy raises plain Exception, and some that derive from BaseException alone
            return NoiseIs(on=False, message=_why_not(error), ask=asked.ask)
        return NoiseIs(on=True, message="", ask=asked.ask)

    def stop(self) -> None:
        """Silence."""
        if self._sound is not None:
            self._sound.stop()
            self._sound = None


def _playing(level: float) -> Any:
    # imported when used: looking for sound devices takes seconds, and most studies use none
    import numpy as np  # noqa: PLC0415
    from psychopy import prefs  # noqa: PLC0415

    prefs.hardware["audioLib"] = ["sounddevice"]
    from psychopy import sound  # noqa: PLC0415

    mono = np.random.default_rng(_SEED).uniform(-1, 1, int(_LOOP_S * _RATE_Hz))
    noise = sound.Sound(
        np.column_stack([mono, mono]), sampleRate=_RATE_Hz, stereo=True, volume=level, loops=-1, hamming=False
    )
    noise.play()
    return noise


def _why_not(error: BaseException) -> str:
    reason = " ".join(str(error).split()) or type(error).__name__
    return (
        f"Masking noise stays off: no sound device plays it ({type(error).__name__}: {reason}). "
        "Connect headphones, see that the system lists them, then stop this run and resume it."
    )
