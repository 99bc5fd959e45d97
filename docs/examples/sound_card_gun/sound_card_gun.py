"""A sound card and an exciter on a hand-held case, as a gun: `--gun sound-card:DEVICE`, or `sound-card:null`.

A pulse is a step of the output, 24 V being full scale; a vibration is a sine that swells and dies away. The amplifier's
gain decides what a person feels: limit it there too. Limits, and the wait for the next shot, are kept by Recoil before
this module hears of a shot.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from device import GunStatus, Identity, LimitError, LinkError, Pulse, Shot, ShotReport
from device.methods import Method, rendering_of
from device.parameters import VibrationParameters
from device.words import MAX_VOLTAGE_V, GunState

RATE_Hz = 48_000
BEGUN_S = 1.0
"""So long a card may take to begin."""

Clock = Callable[[], float]
Samples = NDArray[np.float32]


def open_gun(address: str, methods: Mapping[str, Method], clock: Clock) -> SoundCardGun:
    """The card of this name or number, the system's own if it is empty; `null` is silent. `LinkError`: none there."""
    output: Output = Null(clock) if address == "null" else Card(address, clock)
    return SoundCardGun(output, methods, clock)


class Output(Protocol):
    """Where samples go."""

    name: str

    def play(self, samples: Samples, off: threading.Event) -> float:
        """Play to the end, or until `off`; when the first sample was heard. `LinkError`: the card does not play."""

    def close(self) -> None:
        """Let go of it."""


class Null:
    """No card: it takes as long as one, and nothing is heard."""

    name = "null"

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def play(self, samples: Samples, off: threading.Event) -> float:
        start_s = self._clock()
        off.wait(len(samples) / RATE_Hz)
        return start_s

    def close(self) -> None:
        pass


class Card:
    """A card by sounddevice (PortAudio), which asks for samples in a thread of its own."""

    def __init__(self, name: str, clock: Clock) -> None:
        import sounddevice  # not at the top: no card is looked for until one is opened

        self._clock, self._left, self._start_s = clock, np.zeros(0, np.float32), 0.0
        self._begun, self._ended, self._lock = threading.Event(), threading.Event(), threading.Lock()
        try:
            device = int(name) if name.isdigit() else name or None
            self._stream = sounddevice.OutputStream(
                RATE_Hz, channels=1, dtype="float32", device=device, latency="low", callback=self._more
            )
            self._stream.start()
        except (sounddevice.PortAudioError, ValueError) as error:
            raise LinkError(f"sound card {name or 'of the system'}: {error}") from error
        self.name = name or "default"

    def play(self, samples: Samples, off: threading.Event) -> float:
        self._begun.clear()
        with self._lock:  # the card's thread takes some and leaves the rest, which must not be the rest of others
            self._left = samples
            self._ended.clear()
        if not self._begun.wait(BEGUN_S) or not self._stream.active:
            self._silence()
            raise LinkError("the sound card takes no samples; is it still plugged in?")
        while not (self._ended.wait(0.001) or off.is_set()):
            pass
        self._silence()
        return self._start_s

    def close(self) -> None:
        self._stream.close()

    def _silence(self) -> None:
        with self._lock:
            self._left = self._left[:0]

    def _more(self, out: Samples, count: int, time: object, _status: object) -> None:
        """The card's thread asks for samples; `time` says when they will be heard."""
        with self._lock:
            now, self._left = self._left[:count], self._left[count:]
            if not len(self._left):
                self._ended.set()
        out[:] = 0.0
        out[: len(now), 0] = now
        if len(now) and not self._begun.is_set():
            self._start_s = self._clock() + time.outputBufferDacTime - time.currentTime  # type: ignore[attr-defined]
            self._begun.set()


class SoundCardGun:
    """A `Gun` on an output. It is born disarmed; `disarm` comes from any thread, in mid-pulse too."""

    def __init__(self, output: Output, methods: Mapping[str, Method], clock: Clock) -> None:
        self._output, self._methods, self._clock = output, methods, clock
        self._off = threading.Event()  # set: disarmed
        self._off.set()
        self._shots, self._ready_s = 0, clock()

    def identify(self) -> Identity:
        return Identity(model="sound-card", version="0.1.0", serial=self._output.name)

    def arm(self) -> None:
        self._off.clear()

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        if self._off.is_set():
            raise LimitError("the gun is disarmed; arm it before it may fire")
        method = self._methods[shot.method]
        rendering, samples = rendering_of(method, shot.drive), waveform(shot, method)
        requested_s = self._clock()
        if at_s is not None and self._off.wait(max(0.0, at_s - requested_s)):
            raise LinkError("called off while it waited for its time; nothing was played")
        start_s = self._output.play(samples, self._off)
        self._shots += 1
        self._ready_s = start_s + rendering.settle_s
        if self._off.is_set():
            raise LinkError("switched off in mid-pulse")
        end_s = start_s + len(samples) / RATE_Hz
        return ShotReport(
            shot=shot,
            requested_s=requested_s,
            pulse_start_s=start_s,
            pulse_end_s=end_s,
            home_predicted_s=max(end_s, self._ready_s),
            motion=rendering.motion,
        )

    def disarm(self) -> None:
        self._off.set()

    def status(self) -> GunStatus:
        state: GunState = "resetting" if self._clock() < self._ready_s else "armed"
        if self._off.is_set():
            state = "disarmed"
        return GunStatus(state=state, shots=self._shots, coil_temperature_C=25.0, ready_at_s=self._ready_s)

    def close(self) -> None:
        self.disarm()
        self._output.close()


def waveform(shot: Shot, method: Method) -> Samples:
    """What is played: forward is up. A vibration has half its time to swell and half to die away."""
    sign = 1.0 if shot.direction == "forward" else -1.0
    wave = np.zeros(0)
    if isinstance(method, VibrationParameters):
        time_s = np.arange(round(method.duration_s * RATE_Hz)) / RATE_Hz
        wave = np.sin(2 * np.pi * method.frequency_Hz * time_s) * np.sin(np.pi * time_s / method.duration_s)
    elif isinstance(shot.drive, Pulse):
        wave = np.full(round(shot.drive.pulse_s * RATE_Hz), shot.drive.voltage_V / MAX_VOLTAGE_V)
    return np.asarray(sign * wave, np.float32)
