"""The sensor's own process, `python -m device.sensor ADDRESS`; it ends with the run that started it."""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
from collections import deque

import numpy as np

from device.machine_clock import machine_s
from device.messages import error_line, said_by
from device.sensor.door import open_sensor
from device.sensor.link import SensorSaid, asked_of, said_line
from device.sensor.process import (
    LEAST_RATE_HZ,
    LOOK_EVERY_S,
    SAMPLES_S,
    SampleBuffer,
    SensorReady,
    SensorSilence,
    ShotAsked,
)
from device.sensor.streams import CsvSensor, Sensor, SensorError, checked_samples
from device.words import DeviceError

READ_EVERY_S = 0.005, 0.015
"""It is read at uneven times: a sensor whose batches come evenly would else always be heard equally late."""
_RANDOM = np.random.default_rng()
FIRST_SAMPLES_S = 5.0
"""So long a sensor that was opened may take until it has given a second of samples."""


def serve_sensor(address: str, out: int) -> None:
    """Read the sensor, and answer what stdin asks. `DeviceError`, `ValueError`: why it ended."""
    asked: queue.SimpleQueue[ShotAsked] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()  # first, as opening may hang
    sensor = open_sensor(address, machine_s)
    try:
        buffer, silence = SampleBuffer(), SensorSilence()
        _become_ready(sensor, buffer, silence)
        ready = SensorReady(rate_Hz=buffer.rate_Hz, noise_m_s2=buffer.noise_m_s2())
        os.write(out, said_line(SensorSaid(ready=ready)))
        threading.Thread(target=_watch, args=(sensor, silence, out), daemon=True).start()
        waiting = deque[ShotAsked]()
        while True:
            asked_s = _read(sensor, buffer, silence)
            while not asked.empty():
                waiting.append(asked.get())
            while waiting and (reply := buffer.reply_to(waiting[0], asked_s)):
                waiting.popleft()
                os.write(out, said_line(SensorSaid(reply=reply)))
            time.sleep(_RANDOM.uniform(*READ_EVERY_S))
    finally:
        sensor.close()


def _read(sensor: Sensor, buffer: SampleBuffer, silence: SensorSilence) -> float:
    """Take what it gives; back comes when it was asked."""
    asked_s = machine_s()
    silence.ask()
    try:
        said: object = sensor.read()
    except DeviceError as error:
        raise SensorError(error_line(error)) from error
    except BaseException as error:  # SystemExit too
        raise SensorError(f"it broke off: {said_by(error)}") from error
    samples = checked_samples("read", said, buffer.last_s)
    silence.answered(len(samples))
    buffer.take(samples, machine_s())
    return asked_s


_WHY = {False: "is it on?", True: "does its time go, in seconds?"}
"""What to ask of a sensor that gave too little, by whether it gave anything."""


def _become_ready(sensor: Sensor, buffer: SampleBuffer, silence: SensorSilence) -> None:
    end_s = machine_s() + FIRST_SAMPLES_S
    while buffer.length_s < SAMPLES_S:
        _read(sensor, buffer, silence)
        if machine_s() > end_s:
            heard = bool(np.isfinite(buffer.last_s))
            raise SensorError(f"it gave {buffer.length_s:.2f} s of samples in {FIRST_SAMPLES_S:g} s: {_WHY[heard]}")
        time.sleep(_RANDOM.uniform(*READ_EVERY_S))
    if buffer.rate_Hz < LEAST_RATE_HZ:
        rate = f"it gives {buffer.rate_Hz:.0f} samples a second of its time; at least {LEAST_RATE_HZ:g} are needed"
        raise SensorError(f"{rate}: is its time in seconds?")


def _watch(sensor: Sensor, silence: SensorSilence, out: int) -> None:
    """Say when samples come no more, and again, and what was left out: beside the reading, which may hang."""
    silent, dropped = False, 0
    while True:
        time.sleep(LOOK_EVERY_S)
        if silent != (silent := silence.look(machine_s())):
            os.write(out, said_line(SensorSaid(silent=silent)))
        if isinstance(sensor, CsvSensor) and dropped != (dropped := sensor.dropped):
            os.write(out, said_line(SensorSaid(dropped=dropped)))


def _listen(asked: queue.SimpleQueue[ShotAsked]) -> None:
    for line in sys.stdin.buffer:
        asked.put(asked_of(line))
    os._exit(0)  # the run is over, whatever the sensor does


def main(address: str) -> None:
    """Serve it, and end the process. 0: stdin ended; 1: the last line of stdout says why."""
    out = os.dup(1)
    os.dup2(2, 1)  # what a plug-in prints is none of our words
    try:
        serve_sensor(address, out)
    except (DeviceError, ValueError) as error:
        os.write(out, said_line(SensorSaid(ended=str(error))))
    os._exit(1)  # the thread that listens would keep the interpreter from its end


if __name__ == "__main__":
    main(sys.argv[1])
