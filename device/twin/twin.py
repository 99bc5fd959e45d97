"""The twin: the firmware's core on a hardware of physics, on a clock of its own, plugged in; and troubles to order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from random import Random
from threading import Event, Thread
from typing import Self

from device.machine_clock import machine_s
from device.methods import Method, rendering_of
from device.twin.core import IDENTITY, Core
from device.twin.machine import Board, Carried, DriveEvent
from device.twin.sockets import Socket
from device.wire.records import Named, ShotRecord
from device.words import Effect, LimitError, Pulse


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
        for name in (one.name for one in fields(self)):
            value, most = getattr(self, name), 60.0 if name.endswith("_s") else 1.0
            if not 0 <= value <= most:
                raise ValueError(f"{name} is {value}; it must be 0 to {most:g}")

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendered:
    """One shot as it was, on the twin's own clock of the world in seconds; `end_s` is None while it lasts.

    `too_soon`: it began before the magnet was home, by the physics. `home_s` is None where the model knows no return.
    """

    mark: int
    method: str
    way: str
    kind: str
    amount: int
    start_s: float
    end_s: float | None
    home_s: float | None
    too_soon: bool


class Body:
    """The magnet and the vibrator of one gun, which a reset of its firmware does not stop."""

    def __init__(self, methods: Mapping[str, Method]) -> None:
        self._methods = dict(methods)
        self.ledger: list[Rendered] = []
        for method in methods.values():  # the first use takes long, and a gun has no time
            with suppress(LimitError):
                rendering_of(method)

    def drive(self, event: DriveEvent, shot: ShotRecord, time_s: float) -> None:
        """The board was told to drive, or to stop."""
        if event.kind == "OFF":
            self.stop(time_s)
            return
        before = self.ledger[-1].home_s if self.ledger else None
        settle_s = self._settle_s(shot)
        self.ledger.append(
            Rendered(
                mark=shot.mark,
                method=shot.setting.method,
                way=shot.setting.way,
                kind=event.kind,
                amount=event.amount,
                start_s=time_s,
                end_s=None,
                home_s=None if settle_s is None else time_s + settle_s,
                too_soon=before is not None and time_s < before - 1e-6,
            )
        )

    def stop(self, time_s: float) -> None:
        """Nothing drives any more."""
        if self.ledger and self.ledger[-1].end_s is None:
            self.ledger[-1] = replace(self.ledger[-1], end_s=time_s)

    def _settle_s(self, shot: ShotRecord) -> float | None:
        setting = shot.setting
        method = self._methods.get(setting.method)
        if method is None:
            return None
        length_s = setting.length_us / 1e6
        pulse = setting.kind == "PULS"
        drive = Pulse(voltage_V=setting.amount / 1000, pulse_s=length_s) if pulse else Effect(effect=setting.amount)
        try:
            return rendering_of(method, drive).settle_s
        except LimitError:  # by the model it stays out; the next shot is not judged
            return None


LONGEST_WAIT_S = 0.02
BUSY_US = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Make:
    """What kind of twin: who it says it is, how many times faster than the world it lives, and its crystal's error."""

    identity: Named = IDENTITY
    speed: float = 1.0
    drift_ppm: float = 0.0
    troubles: Troubles = Troubles()
    seed: int = 1


class Twin:
    """A gun at a socket. `serve` runs it; as a context it runs in a thread of its own.

    `body.ledger` is what was truly rendered, in seconds of `world_s`: the machine's monotonic clock times the speed.
    """

    def __init__(self, socket: Socket, methods: Mapping[str, Method], make: Make | None = None) -> None:
        self.body = Body(methods)
        self.accidents: list[str] = []
        self._socket = socket
        self.make = make or Make()
        self._draw = Random(self.make.seed)  # noqa: S311 - troubles, no secrets
        self.boot_s = self.world_s()
        self.core = self._booted()
        self._coming: deque[tuple[float, bytes]] = deque()
        self._going: deque[tuple[float, bytes]] = deque()
        self._planned: list[tuple[float, Callable[[], None]]] = []
        self.hangs_until_s = 0.0
        self._hosts = 0
        self._stop = Event()
        self._thread: Thread | None = None

    def world_s(self) -> float:
        """The twin's world: monotonic seconds times the speed."""
        return machine_s() * self.make.speed

    def clock_us(self) -> int:
        """The gun's own clock: from its boot on, with its crystal's error."""
        return int((self.world_s() - self.boot_s) * (1e6 + self.make.drift_ppm))

    def world_of(self, clock_us: int) -> float:
        """When the gun's clock read this since its last boot."""
        return self.boot_s + clock_us / (1e6 + self.make.drift_ppm)

    def __enter__(self) -> Self:
        self._socket.plug()
        self._thread = Thread(target=self.serve, name="twin", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._socket.unplug()

    def serve(self) -> None:
        """Be a gun until stopped."""
        while not self._stop.is_set():
            self.once()

    def once(self) -> None:
        """Wait until something may happen, at most 20 ms, and let it happen."""
        data = self._socket.read(self._wait_s())
        if self._socket.hosts != self._hosts:
            self._meet_host()
        if data:
            self._post(self._coming, data)
        now_s = machine_s()
        for due_s, act in [plan for plan in self._planned if plan[0] <= now_s]:
            self._planned.remove((due_s, act))
            act()
        hangs = now_s < self.hangs_until_s  # its timers go on
        self._step(b"" if hangs else b"".join(_due(self._coming, now_s)))
        for piece in _due(self._going, now_s):
            self._socket.write(piece)

    def _meet_host(self) -> None:
        """Another host: what the one before had half said, or was still to be told, is not for this one."""
        self._hosts = self._socket.hosts
        self._coming.clear()
        self._going.clear()
        self.core.forget_line()

    def order(self, act: Callable[[], None]) -> None:
        """Have something done by the thread that serves: `unplug` or `reset`, now."""
        self._planned.append((0.0, act))

    def unplug(self) -> None:
        """Be unplugged, and plugged in again after the time that is set."""
        self.accidents.append("unplug")
        self._socket.unplug()
        self._coming.clear()
        self._going.clear()
        self._planned.append((machine_s() + self.make.troubles.replug_s, self._socket.plug))

    def reset(self) -> None:
        """The firmware boots anew; the magnet flies on."""
        self.accidents.append("reset")
        self.body.stop(self.world_s())
        self.boot_s = self.world_s()
        self.core = self._booted()
        self._coming.clear()

    def _booted(self) -> Core:
        return Core(self.make.identity, board=self._carry)

    def _carry(self, drive: DriveEvent) -> Carried:
        """What the board makes of a drive."""
        late = drive.kind != "OFF" and self._happens(self.make.troubles.late)
        if late:
            self.accidents.append("late")
        return Board(late_us=int(1.5 * self._draw.random() * (drive.end_us - drive.time_us)) if late else 0)(drive)

    def _wait_s(self) -> float:
        now_s, wake_us = machine_s(), self.core.wake_us()
        times = [plan[0] for plan in self._planned] + [queue[0][0] for queue in (self._coming, self._going) if queue]
        if wake_us is not None:
            times.append(self.world_of(wake_us) / self.make.speed)
        return min(max(min(times, default=now_s + 1) - now_s, 0.0), LONGEST_WAIT_S)

    def _post(self, queue: deque[tuple[float, bytes]], data: bytes) -> None:
        """Put bytes on their way; they stay in order."""
        troubles = self.make.troubles
        due_s = machine_s() + troubles.delay_s(self._draw)
        queue.append((max(due_s, queue[-1][0]) if queue else due_s, troubles.damaged(data, self._draw)))

    def _step(self, data: bytes) -> None:
        out, drives = self.core.step(data, self.clock_us())
        for drive in drives:
            self.body.drive(drive, self.core.machine.shot, self.world_of(drive.time_us))
            if drive.kind != "OFF":
                self._mishap(drive)
        if out:
            self._post(self._going, out)
            self._pull_out()

    def _mishap(self, drive: DriveEvent) -> None:
        """What befalls a shot."""
        troubles, shot = self.make.troubles, self.core.machine.shot
        middle_s = self.world_of(drive.time_us + int(shot.setting.length_us * self._draw.random()))
        real_s = middle_s / self.make.speed
        if self._happens(troubles.reset):
            self._planned.append((real_s, self.reset))
        elif self._happens(troubles.unplug):
            self._planned.append((real_s, self.unplug))
        elif self._happens(troubles.busy):
            self.accidents.append("busy")
            self.core.machine.shot = replace(shot, end_us=shot.end_us + BUSY_US)
        elif self._happens(troubles.hang):
            self.accidents.append("hang")
            self.hangs_until_s = machine_s() + troubles.hang_s

    def _pull_out(self) -> None:
        """What befalls an answer."""
        if self._happens(self.make.troubles.unplug_reply):
            _, piece = self._going.pop()
            self._socket.write(piece[: len(piece) // 2])
            self._planned.append((machine_s() + 0.001, self.unplug))
        elif self._happens(self.make.troubles.unplug_idle):
            self._planned.append((machine_s() + 0.01, self.unplug))

    def _happens(self, rate: float) -> bool:
        return rate > 0 and self._draw.random() < rate


def _due(queue: deque[tuple[float, bytes]], now_s: float) -> list[bytes]:
    found = []
    while queue and queue[0][0] <= now_s:
        found.append(queue.popleft()[1])
    return found
