"""The tone that the console plays, as a break ends, say: beside everything else."""

from __future__ import annotations

import math
import threading
from array import array

RATE_Hz = 44_100
PITCH_Hz = 880.0
LENGTH_S = 0.35
LOUDNESS = 0.4
MOST_S = 3.0
"""How long a sound system that hangs is waited for."""
_TONE = "tone"


def tone() -> array[float]:
    """The tone, faded in and out so that it does not click: 32-bit samples from -1 to 1."""
    count = int(RATE_Hz * LENGTH_S)
    fade = RATE_Hz // 50
    return array(
        "f",
        (
            LOUDNESS * min(1.0, n / fade, (count - n) / fade) * math.sin(2 * math.pi * PITCH_Hz * n / RATE_Hz)
            for n in range(count)
        ),
    )


def play_tone() -> None:
    """Play the tone beside everything else; silence is no error."""
    threading.Thread(target=_play_tone, daemon=True, name=_TONE).start()


def finish_tone() -> None:
    """Wait until no tone is played: as the sound system opens it swallows what the program says on the terminal."""
    for thread in threading.enumerate():
        if thread.name == _TONE:
            thread.join(MOST_S)


def _play_tone() -> None:
    try:
        import sounddevice  # noqa: PLC0415 - opens the sound system

        with sounddevice.RawOutputStream(samplerate=RATE_Hz, channels=1, dtype="float32") as stream:
            stream.write(tone().tobytes())
    except Exception:  # noqa: BLE001, S110 - no library, no device: `recoil doctor` says so
        pass
