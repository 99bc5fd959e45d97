"""Masking noise through the participant's headphones, by PsychoPy's sound, imported only where noise is wanted."""

from __future__ import annotations

from typing import Any

from experiments.screens.participant import messages

_LOOP_S = 10.0
_RATE_Hz = 44_100
_SEED = 20_240  # assumed; any will do, and the same noise for everybody


class MaskingNoise:
    """White noise in a loop. Where it cannot play it stays off and says why, in one message."""

    def __init__(self) -> None:
        self._sound: Any = None

    def turn(self, asked: messages.Noise) -> messages.NoiseIs:
        """Turn it on or off."""
        self.stop()
        if not asked.on:
            return messages.NoiseIs(on=False, message="", ask=asked.ask)
        try:
            self._sound = _playing(asked.level)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:  # noqa: BLE001 - PsychoPy raises plain Exception, and some that derive from BaseException alone
            return messages.NoiseIs(on=False, message=_why_not(error), ask=asked.ask)
        return messages.NoiseIs(on=True, message="", ask=asked.ask)

    @property
    def plays(self) -> bool:
        """Whether it is on, and has not been found to have ended."""
        return self._sound is not None

    def ended(self) -> messages.NoiseEnded | None:
        """What is to be said where it was on and ended by itself: a sound device that is gone ends its stream."""
        if self._sound is None or self._sound.stream._sdStream.active:
            return None
        self.stop()
        return messages.NoiseEnded(message=f"Masking noise has ended: its sound device is gone. {_REMEDY}")

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
    from sounddevice import query_devices  # noqa: PLC0415

    if not any(device["max_output_channels"] for device in query_devices()):
        raise RuntimeError("the system lists none")  # PsychoPy takes the first of none
    mono = np.random.default_rng(_SEED).uniform(-1, 1, int(_LOOP_S * _RATE_Hz))
    noise = sound.Sound(
        np.column_stack([mono, mono]), sampleRate=_RATE_Hz, stereo=True, volume=level, loops=-1, hamming=False
    )
    noise.play()
    return noise


_REMEDY = "Connect headphones, see that the system lists them, then stop this run and resume it."


def _why_not(error: BaseException) -> str:
    reason = " ".join(str(error).split()) or type(error).__name__
    return f"Masking noise stays off: no sound device plays it ({reason}). {_REMEDY}"
