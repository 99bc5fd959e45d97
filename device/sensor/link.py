"""The run's end of a sensor: a process of its own reads it and measures. It may hang, lie or die.

A line of JSON each way: shots go out; back comes that it is ready, what was measured, or why it ended.
"""

from __future__ import annotations

import json
import queue
import subprocess
import threading
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Protocol

from pydantic import TypeAdapter, ValidationError

from device.machine_clock import machine_s
from device.methods import Method
from device.own_process import OWN_GROUP, how_ended, own_environment, own_program
from device.sensor.process import UNHEARD_S, SensorReady, ShotAsked, ShotReply
from device.sensor.streams import SensorError

START_S = 30.0
"""So long a sensor may take to be imported, opened and heard."""
SENSOR_ANSWER_S = 5.0
"""So long after its time an answer may take; a busy machine stands still for some of it."""
_LONGEST_S = 0.5
"""No trace goes on for longer after its pulse."""
_ENDED_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSaid:
    """One thing that the sensor's process says.

    `silent`: no sample comes any more, or one came again; `dropped`: so many lines that were none were left out.
    """

    ready: SensorReady | None = None
    reply: ShotReply | None = None
    silent: bool | None = None
    dropped: int | None = None
    ended: str = ""


_SAID, _ASKED = TypeAdapter(SensorSaid), TypeAdapter(ShotAsked)


def said_line(said: SensorSaid) -> bytes:
    """What is said as a line."""
    return json.dumps(asdict(said)).encode() + b"\n"


def asked_of(line: bytes) -> ShotAsked:
    """The shot on a line."""
    return _ASKED.validate_json(line)


class SensorEnd(Protocol):
    """Whoever measures shots for a run.

    `silent`: no sample comes just now; `ended`: why none will come any more; `dropped`: how many lines of its stream
    were no samples and were left out.
    """

    address: str
    silent: bool
    dropped: int
    ended: str

    def ask(self, pulse_start_s: float, actuator: Method) -> ShotReply:
        """What was measured of a shot; it waits for it. `SensorError`: it ended, and is asked no more."""

    def close(self) -> None:
        """Let go of it."""


class SensorLink:
    """A sensor in its own process. `SensorError`: it is refused, and why."""

    def __init__(self, address: str, start_s: float = START_S) -> None:
        self.address, self.silent, self.dropped, self.ended = address, False, 0, ""
        self._process = subprocess.Popen(
            own_program("device.sensor", address),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=own_environment(),
            start_new_session=True,  # Ctrl-C is for the run, which closes it
            creationflags=OWN_GROUP,
        )
        self._said: queue.Queue[SensorSaid] = queue.Queue()
        self._count = 0
        threading.Thread(target=self._listen, daemon=True, name="sensor").start()
        try:
            ready = self._heard(start_s).ready
            if ready is None:
                raise SensorError(f"{self.address}: spoke of a shot before it was ready")
        except queue.Empty:
            self.close()
            why = f"was not ready within {start_s:g} s; did its import, its device or a read hang?"
            raise SensorError(f"{self.address}: {why}") from None
        except BaseException:
            self.close()
            raise
        self.ready = ready

    def ask(self, pulse_start_s: float, actuator: Method) -> ShotReply:
        """What was measured of a shot. `SensorError`: it ended, or does not answer."""
        self._count += 1
        asked = ShotAsked(number=self._count, pulse_start_s=pulse_start_s, actuator=actuator)
        try:
            if self._process.stdin is None:
                raise BrokenPipeError
            self._process.stdin.write(json.dumps(asdict(asked)).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            pass  # it has ended, and says why below
        soon_s = max(machine_s(), pulse_start_s) + _LONGEST_S + UNHEARD_S
        for until_s in (soon_s, soon_s + SENSOR_ANSWER_S):
            reply = self._answer_until(until_s)
            if reply is not None:
                return reply
            if self.silent:
                return ShotReply(number=self._count, because="the sensor was silent")
        raise SensorError(f"{self.address}: does not answer")

    def _answer_until(self, until_s: float) -> ShotReply | None:
        """The answer on the last shot, if it comes in time; others are late, of shots while it was silent."""
        with suppress(queue.Empty):
            while True:
                reply = self._heard(until_s - machine_s()).reply
                if reply is None or reply.number > self._count:
                    raise SensorError(f"{self.address}: answered another shot than it was asked for")
                if reply.number == self._count:
                    return reply
        return None

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        try:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_ENDED_S)
        finally:  # after an interrupt too
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _heard(self, seconds: float) -> SensorSaid:
        """What it says next. `queue.Empty`: nothing in that time; `SensorError`: it ended."""
        said = self._said.get(timeout=max(0.0, seconds))
        if said.ended:
            self._said.put(said)  # for whoever asks again
            raise SensorError(f"{self.address}: {said.ended}")
        return said

    def _listen(self) -> None:
        """Take what it says, until it ends."""
        ended = ""
        with suppress(ValueError, OSError):  # closed meanwhile
            for line in self._process.stdout or ():
                try:
                    said = _SAID.validate_json(line)
                except ValidationError:
                    said = SensorSaid(ended="its process said what cannot be")
                ended = ended or said.ended
                self.silent = self.silent if said.silent is None else said.silent
                self.dropped = self.dropped if said.dropped is None else said.dropped
                if said.silent is None and said.dropped is None:
                    self._said.put(said)
        if not ended:
            ended = f"its process {how_ended(self._process.wait())}"
            self._said.put(SensorSaid(ended=ended))
        self.ended = f"{self.address}: {ended}"
