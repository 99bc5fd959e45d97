"""An accelerometer on a serial port as a sensor for Recoil: `--sensor serial-accelerometer:/dev/ttyACM0`.

It sends a line `microseconds,x_mg` for each sample, its own clock first; x is along the barrel, recoil positive.
"""

from collections.abc import Callable

import serial

BAUD = 2_000_000
MG = 9.80665e-3
"""A thousandth of g in m/s2."""


class SerialAccelerometer:
    def __init__(self, port: str) -> None:
        self._port, self._rest = serial.Serial(port, BAUD, timeout=0), b""
        self._wraps, self._last_us = 0, 0

    def read(self) -> list[tuple[float, float]]:
        *lines, self._rest = (self._rest + self._port.read(65_536)).split(b"\n")
        return [sample for line in lines if (sample := self._sample(line)) is not None]

    def _sample(self, line: bytes) -> tuple[float, float] | None:
        try:
            us, x_mg = line.split(b",")
            return self._seconds(int(us)), float(x_mg) * MG
        except ValueError:  # a line that was cut, as the first may be
            return None

    def _seconds(self, us: int) -> float:
        """Its counter has 32 bits, and begins anew after 71 minutes."""
        if us < self._last_us - 2**31:
            self._wraps += 1
        self._last_us = us
        return (us + self._wraps * 2**32) / 1e6

    def close(self) -> None:
        self._port.close()


def open_sensor(address: str, _clock: Callable[[], float]) -> SerialAccelerometer:
    return SerialAccelerometer(address)  # which has a clock of its own
