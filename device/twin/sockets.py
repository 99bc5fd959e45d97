"""Where a twin is plugged in: a pseudo-terminal, or a TCP port of this machine."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import time
from pathlib import Path
from typing import Protocol


class Socket(Protocol):
    """The gun's end of the line. `hosts` counts those that came, where it can be told that it is another one."""

    address: str
    hosts: int

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

    hosts = 0

    def __init__(self, link: Path | None = None) -> None:
        self._link = link
        self._ends: tuple[int, int] | None = None
        self.address = ""

    def plug(self) -> None:
        """A new pseudo-terminal. `OSError`: something else is where the link is to be, or none can be made here.

        Its host's end is locked for as long as it is there, by which another twin knows that its link is taken.
        """
        if self._ends is not None:
            return
        if self._link is not None and self._link.exists() and not self._link.is_symlink():
            raise FileExistsError(f"{self._link}: is no link, and would be lost")
        if not hasattr(os, "openpty"):
            raise OSError("this system has no pseudo-terminals")
        import fcntl  # noqa: PLC0415 - not on every system
        import tty  # noqa: PLC0415

        if self._link is not None and _is_taken(self._link):
            raise FileExistsError(f"{self._link}: leads to a twin that still runs")
        gun, host = os.openpty()
        tty.setraw(host)
        os.set_blocking(gun, False)
        with contextlib.suppress(OSError):  # a system that locks no terminals lets a link be taken over
            fcntl.lockf(host, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._ends, name = (gun, host), os.ttyname(host)
        self.address = str(self._link or name)
        if self._link is not None:
            beside = self._link.with_name(f".{self._link.name}-{os.getpid()}")
            try:
                beside.symlink_to(name)
                beside.replace(self._link)
            except OSError as error:
                raise OSError(f"{self._link}: {error.strerror}") from error  # nobody knows the other name

    def unplug(self) -> None:
        """Both ends are closed: the host's descriptor is dead, its path leads nowhere."""
        if self._ends is None:
            return
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()
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


def _is_taken(link: Path) -> bool:
    """Whether a link leads to the end of a twin that runs. One that was killed has left it to nobody, or to others."""
    import fcntl  # noqa: PLC0415 - not on every system

    if not os.path.realpath(link).startswith(_TERMINALS):
        return False
    try:
        end = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.lockf(end, fcntl.LOCK_EX | fcntl.LOCK_NB)  # not `flock`, which whoever opens the port has
    except OSError:
        return True
    finally:
        os.close(end)
    return False


_TERMINALS = ("/dev/pts/", "/dev/ttys")
"""Where pseudo-terminals are, on Linux and on macOS: a real port is not opened to look."""


class Tcp:
    """A TCP port of this machine alone; pyserial opens it by the URL `socket://127.0.0.1:PORT`. One host at a time."""

    def __init__(self, port: int = 0) -> None:
        self._port = port
        self._listening: socket.socket | None = None
        self._host: socket.socket | None = None
        self.address, self.hosts = "", 0

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
        self.hosts += 1
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
