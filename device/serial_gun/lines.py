"""What the line to a gun is made of: the commands on their way, the gun's clock on the host's, the port.

Of each exchange it is certain that the gun read its clock between writing and answer. So the host's time of a tick
lies between two lines, host = offset + rate x gun, through all exchanges; the middle is the estimate, half the gap
its bound.
How long the bytes take, and how unlike they take each way, does not matter: one quick exchange each way is enough.
"""

from __future__ import annotations

import errno
import os
import re
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from device.wire.records import refusal_in
from device.words import LinkError


class TimedOut(LinkError):  # noqa: N818 - outcomes, as they are named in the log
    """No answer within the deadline; whether the command was carried out is not known."""


class Disconnected(LinkError):  # noqa: N818
    """The line is gone, or the gun has forgotten this session."""


class Forgotten(Disconnected):
    """The gun is in no session any more: it was reset, or its watchdog disarmed it. `alone`: how, if it was that."""

    def __init__(self, alone: str) -> None:
        super().__init__(f"the gun has forgotten this session: it was reset, or {alone}")
        self.alone = alone


class CalledOff(LinkError):  # noqa: N818
    """Nothing was written: what would have armed or fired was overtaken by a disarming."""


class Contradiction(LinkError):  # noqa: N818
    """What the gun says contradicts its order, itself, or this machine's clock. Nothing of it is believed."""


class Unsure(LinkError):  # noqa: N818
    """A shot was fired, or may have been, and not as it was ordered. The gun is disarmed: nothing more comes of it."""


class CutShort(LinkError):  # noqa: N818
    """A shot was fired, and switched off before its end."""


class WrongVersion(LinkError):  # noqa: N818
    """A gun that speaks another version of the wire."""


class AnotherGun(LinkError):  # noqa: N818
    """A gun with another serial number than the one that was there."""


class CommandRefused(LinkError):  # noqa: N818
    """The gun said no: nothing was done. `code` is the number of its error."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """An answer: when its command was written and it was read, on the host's clock; in which session of the link."""

    body: str
    written_s: float
    received_s: float
    session: int


@dataclass(slots=True, kw_only=True)
class Waiting:
    """A command whose answer is awaited. `since_s` and `gap_s`, for which nothing was written, are real seconds."""

    number: int
    body: str
    written_s: float
    since_s: float
    gap_s: float = 0.0
    ended: threading.Event = field(default_factory=threading.Event)
    reply: Reply | None = None
    trouble: LinkError | None = None

    @property
    def header(self) -> str:
        """The command without its parameters."""
        return self.body.split(maxsplit=1)[0]


class Pending:
    """Commands on their way, for one thread that writes at a time, one that reads, and any that wait."""

    def __init__(self) -> None:
        self._waiting: dict[int, Waiting] = {}
        self._lock = threading.Lock()

    def add(self, waiting: Waiting) -> None:
        """A command is about to be written."""
        with self._lock:
            self._waiting[waiting.number] = waiting

    def take(self, number: int) -> Waiting | None:
        """The command of this number, which waits no longer; None if none of it did."""
        with self._lock:
            return self._waiting.pop(number, None)

    def end_all(self, trouble: LinkError) -> None:
        """Nobody is to wait any longer."""
        with self._lock:
            ended, self._waiting = list(self._waiting.values()), {}
        for waiting in ended:
            waiting.trouble = trouble
            waiting.ended.set()

    def forget(self, body: str, since_s: float) -> None:
        """Commands of this text from before that time, for which nobody waits, were never answered."""
        with self._lock:
            self._waiting = {
                number: waiting
                for number, waiting in self._waiting.items()
                if waiting.body != body or waiting.since_s >= since_s
            }

    def outcome(self, waiting: Waiting) -> Reply:
        """The answer of a command. `LinkError`: its other outcomes, by their type."""
        self.take(waiting.number)
        if waiting.reply is None:
            raise waiting.trouble or TimedOut(f"no answer to {waiting.header} within its time")
        if (no := refusal_in(waiting.reply.body)) is not None:
            raise CommandRefused(no[0], f"the gun refused {waiting.header}: {no[1]}")
        return waiting.reply


MAX_DRIFT = 1e-3
"""Assumed bound of what a gun's crystal and a host's clock differ in rate: ten times what they are sold with."""
RECENT, LANDMARKS = 64, 32
MIN_APART_US = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Exchange:
    """A question and its answer: when it was written and read on the host's clock, and the gun's clock between."""

    sent_s: float
    gun_us: int
    received_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HostTime:
    """A time on the host's clock, true to within the uncertainty."""

    time_s: float
    uncertainty_s: float


class Clocks:
    """The last exchanges, and the quickest of those before, in a bounded number."""

    def __init__(self) -> None:
        self._recent: deque[Exchange] = deque(maxlen=RECENT)
        self._landmarks: deque[Exchange] = deque(maxlen=LANDMARKS)
        self._rate = (1 - MAX_DRIFT, 1 + MAX_DRIFT)
        self._count = 0
        self.jumps = 0
        """How often an exchange contradicted those before."""

    @property
    def known(self) -> bool:
        """Whether there was any exchange."""
        return bool(self._recent)

    def add(self, exchange: Exchange) -> None:
        """Learn from an exchange. One that contradicts those before takes their place: a clock was set."""
        if not self._fits(exchange):
            self.jumps += 1
            self._forget()
        self._recent.append(exchange)
        self._count += 1
        if self._count % RECENT == 0:
            self._landmarks.append(min(self._recent, key=lambda one: one.received_s - one.sent_s))

    def host(self, gun_us: int) -> HostTime:
        """When the gun's clock showed this, on the host's. `ValueError`: there was no exchange yet."""
        low, high = self._bounds(gun_us)
        return HostTime(time_s=(low + high) / 2, uncertainty_s=(high - low) / 2)

    def gun_us(self, host_s: float) -> int:
        """What the gun's clock shows at a time on the host's. `ValueError`: there was no exchange yet."""
        last = self._last()
        middle = self.host(last.gun_us).time_s
        return last.gun_us + round((host_s - middle) * 1e6 / (sum(self._rate) / 2))

    def _last(self) -> Exchange:
        if not self._recent:
            raise ValueError("nothing is known of the gun's clock: no exchange yet")
        return self._recent[-1]

    def _fits(self, new: Exchange) -> bool:
        """Whether all exchanges with the new one lie on a line; the rates that it can have are narrowed."""
        low, high = self._rate
        for old in (*self._landmarks, *self._recent):
            apart_us = new.gun_us - old.gun_us
            if apart_us < 0:
                return False
            if apart_us >= MIN_APART_US:
                low = max(low, (new.sent_s - old.received_s) * 1e6 / apart_us)
                high = min(high, (new.received_s - old.sent_s) * 1e6 / apart_us)
        if low > high:
            return False
        self._rate = (low, high)
        if not self._recent:
            return True
        earliest_s, latest_s = self._bounds(new.gun_us)
        return max(earliest_s, new.sent_s) <= min(latest_s, new.received_s)

    def _forget(self) -> None:
        self._recent.clear()
        self._landmarks.clear()
        self._rate = (1 - MAX_DRIFT, 1 + MAX_DRIFT)

    def _bounds(self, gun_us: int) -> tuple[float, float]:
        self._last()
        bounds = [self._bound(one, (gun_us - one.gun_us) / 1e6) for one in (*self._landmarks, *self._recent)]
        return max(low for low, _ in bounds), min(high for _, high in bounds)

    def _bound(self, one: Exchange, since_s: float) -> tuple[float, float]:
        spans = (self._rate[0] * since_s, self._rate[1] * since_s)
        return one.sent_s + min(spans), one.received_s + max(spans)


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
        except (*_BROKEN, re.error) as error:  # the last: a pattern of hwgrep:// that is none
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
        connection = getattr(self._port, "_socket", None)  # over TCP: pyserial leaves it open if the other end has gone
        with suppress(OSError):
            self._port.close()
        if connection is not None:
            connection.close()

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
            raise Disconnected(LINE_GONE) from error  # what pyserial says is of its own parts


LINE_GONE = "the line is gone: look at its plug and at the gun's power"
IN_USE = "another program, or another run, has it open: close that first"


def _reason(error: Exception) -> str:
    """What went wrong, in the system's words: pyserial's own repeat address and number.

    Of Windows' errors it keeps the name alone. There a port is one program's at a time.
    """
    number, said = getattr(error, "errno", None), str(error)
    if number == errno.EAGAIN or "PermissionError(" in said:
        return IN_USE
    if "FileNotFoundError(" in said:
        return os.strerror(errno.ENOENT)
    return os.strerror(number) if isinstance(number, int) else said
