"""Where the twin is plugged in, a pseudo-terminal or a TCP port, and the troubles to order on the way of the bytes."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import time
from dataclasses import dataclass, fields
from pathlib import Path
from random import Random
from typing import Protocol


@dataclass(frozen=True, slots=True, kw_only=True)
class Troubles:
    """Probabilities from 0 to 1, and times in seconds. `ValueError` names what is out of range.

    A damage is drawn for each piece of bytes, either way; an accident for each shot (in mid-pulse) or answer.
    """

    latency_s: float = 0.0  # each way
    jitter_s: float = 0.0  # at most so much more, each way
    lose: float = 0.0  # a byte
    double: float = 0.0  # a byte
    corrupt: float = 0.0  # a bit
    partial: float = 0.0  # the rest of a piece
    reset: float = 0.0  # of the gun, in mid-shot
    busy: float = 0.0  # the pulse does not end for 2 s
    late: float = 0.0  # the board begins the shot late, at most half its length after its end
    hang: float = 0.0  # the gun reads nothing for `hang_s` from a shot's start on
    unplug: float = 0.0  # in mid-shot
    unplug_reply: float = 0.0  # in mid-answer
    unplug_idle: float = 0.0  # after an answer
    hang_s: float = 0.5
    replug_s: float = 0.3

    def __post_init__(self) -> None:
        for field in fields(self):
            value, most = getattr(self, field.name), 60.0 if field.name.endswith("_s") else 1.0
            if not 0 <= value <= most:
                raise ValueError(f"{field.name} is {value}; it must be 0 to {most:g}")

    @property
    def unplugs(self) -> bool:
        """Whether the gun may be unplugged."""
        return max(self.unplug, self.unplug_reply, self.unplug_idle) > 0

    def delay_s(self, draw: Random) -> float:
        """How long a piece is on its way."""
        return self.latency_s + (draw.random() * self.jitter_s if self.jitter_s else 0.0)

    def damaged(self, data: bytes, draw: Random) -> bytes:
        """What becomes of a piece of bytes on its way."""
        for name, damage in _DAMAGES.items():
            rate = getattr(self, name)
            if data and rate and draw.random() < rate:
                data = damage(data, draw.randrange(len(data)), draw)
        return data


def _lose(data: bytes, place: int, _: Random) -> bytes:
    return data[:place] + data[place + 1 :]


def _double(data: bytes, place: int, _: Random) -> bytes:
    return data[: place + 1] + data[place:]


def _corrupt(data: bytes, place: int, draw: Random) -> bytes:
    return data[:place] + bytes([data[place] ^ 1 << draw.randrange(8)]) + data[place + 1 :]


def _partial(data: bytes, place: int, _: Random) -> bytes:
    return data[:place]


_DAMAGES = {"lose": _lose, "double": _double, "corrupt": _corrupt, "partial": _partial}


class Socket(Protocol):
    """The gun's end of the line."""

    address: str

    def plug(self) -> None:
        """Be there, at the same address as before."""

    def unplug(self) -> None:
        """Be gone, as if the plug were pulled."""

    def read(self, timeout_s: float) -> bytes:
        """Bytes from the host, at the latest after the time; empty if none came."""

    def write(self, data: bytes) -> None:
        """Bytes to the host; lost if nobody takes them."""


class Pty:
    """A pseudo-terminal; `link` is a path that leads to it and stays the same when it is plugged in again."""

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self._ends: tuple[int, int] | None = None
        self.address = ""

    def plug(self) -> None:
        """A new pseudo-terminal. `OSError`: the link's place is taken by a folder, or nothing can be made there."""
        if self._ends is not None:
            return
        import tty  # noqa: PLC0415 - not on every system

        gun, host = os.openpty()
        tty.setraw(host)
        os.set_blocking(gun, False)
        self._ends, name = (gun, host), os.ttyname(host)
        self.address = str(self._link or name)
        if self._link is not None:
            beside = self._link.with_name(f".{self._link.name}-{os.getpid()}")
            beside.symlink_to(name)
            beside.replace(self._link)

    def unplug(self) -> None:
        """Both ends are closed: the host's descriptor is dead, its path leads nowhere."""
        if self._ends is None:
            return
        if self._link is not None:
            self._link.unlink(missing_ok=True)
        for end in self._ends:
            os.close(end)
        self._ends = None

    def read(self, timeout_s: float) -> bytes:
        """Bytes from the host."""
        gun = [] if self._ends is None else [self._ends[0]]
        if not select.select(gun, [], [], timeout_s)[0]:
            return b""
        with contextlib.suppress(OSError):
            return os.read(gun[0], 4096)
        return b""

    def write(self, data: bytes) -> None:
        """Bytes to the host; what does not fit into the terminal's buffer is lost, as on a UART."""
        if self._ends is not None:
            with contextlib.suppress(OSError):
                os.write(self._ends[0], data)


class Tcp:
    """A TCP port of this machine alone; pyserial opens it by the URL `socket://127.0.0.1:PORT`. One host at a time."""

    def __init__(self, port: int = 0) -> None:
        self._port = port
        self._listening: socket.socket | None = None
        self._host: socket.socket | None = None
        self.address = ""

    def plug(self) -> None:
        """Listen. `OSError`: the port is taken."""
        if self._listening is not None:
            return
        self._listening = socket.create_server(("127.0.0.1", self._port))
        self._port = self._listening.getsockname()[1]
        self.address = f"socket://127.0.0.1:{self._port}"

    def unplug(self) -> None:
        """Drop the host and listen no more."""
        for end in (self._host, self._listening):
            if end is not None:
                end.close()
        self._host = self._listening = None

    def read(self, timeout_s: float) -> bytes:
        """Bytes from the host. One that comes takes the place of the one before, as a new opening of a port does."""
        ends = [end for end in (self._listening, self._host) if end is not None]
        if not ends:
            time.sleep(timeout_s)  # Windows waits for sockets alone
            return b""
        ready = select.select(ends, [], [], timeout_s)[0]
        if self._listening is not None and self._listening in ready:
            self._accept(self._listening)
        elif self._host is not None and ready:
            return self._received(self._host)
        return b""

    def write(self, data: bytes) -> None:
        """Bytes to the host."""
        if self._host is not None:
            with contextlib.suppress(OSError):
                self._host.send(data)

    def _accept(self, listening: socket.socket) -> None:
        if self._host is not None:
            self._host.close()
        self._host, _ = listening.accept()
        self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._host.setblocking(False)

    def _received(self, host: socket.socket) -> bytes:
        with contextlib.suppress(OSError):
            data = host.recv(4096)
            if data:
                return data
        host.close()
        self._host = None
        return b""
