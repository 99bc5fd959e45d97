"""Masking noise through the participant's headphones. The sound library is imported only where noise is wanted.

Not by PsychoPy's sound: one of an array that is to be repeated for ever ends with its first round, and is silent then
without a word (2026.2.5).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from device.machine_clock import machine_s
from experiments.screens.participant import messages

NOISE_ROUND = 441_000
"""Samples until it begins again: some ten seconds, by the rate that the device has."""
_SILENT_S, _LOOK_S = 3.0, 1.5
"""So long a device may take nothing; and what a look counts for at most: the program may have stood still before it."""
_SEED = 20_240  # assumed; any will do, and the same noise for everybody


class MaskingNoise:
    """White noise in a loop. Where it cannot play it stays off and says why, in one message."""

    def __init__(self) -> None:
        self._stream: Any = None
        self._loop: NoiseLoop | None = None
        self._silence = Silence()

    def turn(self, asked: messages.Noise) -> messages.NoiseIs:
        """Turn it on or off."""
        self.stop()
        if not asked.on:
            return messages.NoiseIs(on=False, message="", ask=asked.ask)
        try:
            self._loop = NoiseLoop(asked.level)
            self._stream = _playing(self._loop)
        except Exception as error:  # noqa: BLE001 - whatever the sound library says of its devices
            return messages.NoiseIs(on=False, message=_why_not(error), ask=asked.ask)
        return messages.NoiseIs(on=True, message="", ask=asked.ask)

    @property
    def plays(self) -> bool:
        """Whether it is on, and has not been found to have ended."""
        return self._stream is not None

    def ended(self) -> messages.NoiseEnded | None:
        """What is to be said where it was on and ended by itself: a sound device that is gone ends its stream."""
        if self._stream is None or self._loop is None:
            return None
        if not self._stream.active:
            self.stop()
            return messages.NoiseEnded(message=f"Masking noise has ended: its sound device is gone. {_REMEDY}")
        if self._silence.lasts(self._loop.blocks):
            self._stream = None  # closing it would wait for the device
            return messages.NoiseEnded(message=f"Masking noise has ended: its sound device stands still. {_REMEDY}")
        return None

    def stop(self) -> None:
        """Silence."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def _playing(noise: NoiseLoop) -> Any:
    # imported when used: looking for sound devices takes seconds, and most studies use none
    from sounddevice import OutputStream, query_devices  # noqa: PLC0415

    if not any(device["max_output_channels"] for device in query_devices()):
        raise RuntimeError("the system lists none")

    def fill(out: Any, frames: int, *_: object) -> None:
        out[:] = noise.block(frames)

    stream = OutputStream(channels=2, dtype="float32", callback=fill)
    stream.start()
    return stream


class Silence:
    """Whether a device that plays takes no blocks any more. `now_s` is a clock."""

    def __init__(self, now_s: Callable[[], float] = machine_s) -> None:
        self._now_s, self._blocks = now_s, -1
        self._looked_s = self._silent_s = 0.0

    def lasts(self, blocks: int) -> bool:
        """Whether it has taken none for a while, in which this program itself did not stand still."""
        now_s = self._now_s()
        passed_s = min(now_s - self._looked_s, _LOOK_S)
        self._silent_s = self._silent_s + passed_s if blocks == self._blocks else 0.0
        self._blocks, self._looked_s = blocks, now_s
        return self._silent_s > _SILENT_S


class NoiseLoop:
    """White noise from -`level` to `level` without an end: the same few seconds again and again, without a gap."""

    def __init__(self, level: float) -> None:
        import numpy as np  # noqa: PLC0415 - as above

        drawn = np.random.default_rng(_SEED).uniform(-level, level, NOISE_ROUND)
        self._round, self._at = drawn.astype(np.float32)[:, None], 0
        self.blocks = 0
        """How many were taken."""

    def block(self, frames: int) -> Any:
        """The next samples (frames, 1), the same for both ears."""
        self.blocks += 1
        places = range(self._at, self._at + frames)
        self._at = places.stop % len(self._round)
        return self._round.take(places, axis=0, mode="wrap")


_REMEDY = "Connect headphones, see that the system lists them, then stop this run and resume it."


def _why_not(error: BaseException) -> str:
    reason = " ".join(str(error).split()) or type(error).__name__
    return f"Masking noise stays off: no sound device plays it ({reason}). {_REMEDY}"
