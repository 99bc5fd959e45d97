"""A serial port, or whatever pyserial opens by URL. Whatever breaks is `Disconnected`."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Protocol, TypeVar

from device.serial_gun.commands import Disconnected, TimedOut
from device.words import LinkError

BAUD = 460_800
READ_S = 0.02
WRITE_S = 0.5

_T = TypeVar("_T")

try:
    from termios import error as _TermiosError  # noqa: N812 - no OSError, and not on every system
except ImportError:
    _TermiosError = OSError  # type: ignore[misc,assignment]
_BROKEN = (OSError, TypeError, ValueError, _TermiosError)
"""What pyserial lets through when a line breaks; the second and third where its descriptor is gone already."""


class Port(Protocol):
    """An open line."""

    def read(self) -> bytes:
        """Bytes that came, at the latest after 20 ms; empty if none did."""

    def write(self, data: bytes) -> None:
        """All bytes, within half a second."""

    def close(self) -> None:
        """Let go of it."""


OpenPort = Callable[[str], Port]


class SerialPort:
    """A port by path, name or URL, open and emptied. `LinkError`: it cannot be opened."""

    def __init__(self, address: str) -> None:
        import serial  # noqa: PLC0415 - wanted only where a gun is on a line

        try:
            self._port = serial.serial_for_url(
                address,
                baudrate=BAUD,
                timeout=READ_S,
                write_timeout=WRITE_S,
                exclusive=True if os.name == "posix" else None,
            )
            self._port.reset_input_buffer()
        except _BROKEN as error:
            raise LinkError(f"cannot open {address}: {_reason(error)}") from error
        self._late = serial.SerialTimeoutException

    def read(self) -> bytes:
        """Bytes that came."""
        return self._try(self._read)

    def write(self, data: bytes) -> None:
        """All bytes. `TimedOut`: they do not go out."""
        try:
            self._try(lambda: self._port.write(data))
        except self._late as error:
            raise TimedOut("the line takes no more bytes") from error

    def close(self) -> None:
        """Let go of it; what goes wrong by then does not matter."""
        try:
            self._port.close()
        except OSError:
            return

    def _read(self) -> bytes:
        first: bytes = self._port.read(1)
        waiting = self._port.in_waiting if first else 0
        return first + self._port.read(waiting) if waiting else first

    def _try(self, act: Callable[[], _T]) -> _T:
        try:
            return act()
        except self._late:
            raise
        except _BROKEN as error:
            raise Disconnected(f"the line is gone: {error}") from error


def _reason(error: Exception) -> str:
    """What went wrong, in the system's words: pyserial's own repeat address and number."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if isinstance(number, int) else str(error)
