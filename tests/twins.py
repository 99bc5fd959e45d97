"""Twins to test with: each on a real pseudo-terminal or TCP port, opened by real pyserial."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from device import Pulse, Shot
from device.methods import paper_methods
from device.serial_gun import lines, link
from device.serial_gun.gun import SerialGun, open_serial
from device.twin.machine import BOOT_REST_US
from device.twin.sockets import Pty, Socket, Tcp
from device.twin.twin import Make, Troubles, Twin
from device.wire.records import Garbled
from device.words import LinkError

PULSE = Pulse(voltage_V=16.0, pulse_s=0.010)


def a_shot(method: str = "asymmetric-2", direction: Any = "forward", drive: Any = PULSE) -> Shot:
    return Shot(method=method, direction=direction, drive=drive)


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command that is over: how it ended, and when it was answered, if it was."""

    body: str
    written_s: float
    outcome: str
    received_s: float | None = None


_OUTCOMES = {lines.CommandRefused: "refused", lines.TimedOut: "timed out", Garbled: "garbled"}


@contextmanager
def noted_commands() -> Iterator[list[Command]]:
    """The commands of guns on a line from now on, in the order of their ends."""
    commands, outcome = list[Command](), lines.Pending.outcome

    def noted(pending: lines.Pending, waiting: lines.Waiting) -> lines.Reply:
        about = {"body": waiting.body, "written_s": waiting.written_s}
        try:
            reply = outcome(pending, waiting)
        except LinkError as error:
            commands.append(Command(**about, outcome=_OUTCOMES.get(type(error), "disconnected")))
            raise
        commands.append(Command(**about, outcome="done", received_s=reply.received_s))
        return reply

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lines.Pending, "outcome", noted)
        yield commands


def said(pair: Pair, *headers: str) -> list[str]:
    """The commands that begin so, as far as they are over, in the order of their ends."""
    return [command.body for command in pair.commands if command.body.split()[0] in headers]


def is_up(gun: SerialGun) -> bool:
    """Whether a gun is there, in a session of the strict mode."""
    try:
        gun.link.wait_up(0.0)
    except lines.Disconnected:
        return False
    return True


def disarmings_of(twin: Twin) -> list[float]:
    """When the twin disarms, or is disarmed, from now on: on its own clock, in seconds of its world."""
    times: list[float] = []
    abort = twin.core.machine.abort

    def noted(now_us: int) -> bool:
        times.append(twin.world_of(now_us))
        return abort(now_us)

    twin.core.machine.abort = noted  # type: ignore[method-assign]
    return times


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A twin and the gun that drives it; `clock` is both's, `commands` are the gun's."""

    twin: Twin
    gun: SerialGun
    socket: Socket
    speed: float
    commands: list[Command] = field(default_factory=list)

    def clock(self) -> float:
        return time.monotonic() * self.speed

    def ready(self) -> None:
        """Armed, and the magnet home."""
        self.gun.arm()
        time.sleep(max(0.0, (self.gun.status().ready_at_s - self.clock()) / self.speed))


SLOW = 0.1
"""The speed of a twin to which no machine is slow: its magnet is out for two seconds."""


def host_clock(speed: float) -> Callable[[], float]:
    return lambda: time.monotonic() * speed


PATIENT_S = 5.0
"""The watchdog's time of twins that share an interpreter, and a busy machine, with their host: none lapses for that."""


@contextmanager
def plugged_in(socket: Socket, make: Make, watchdog_s: float = PATIENT_S, *, rested: bool = False) -> Iterator[Twin]:
    """A twin at a socket, whose hosts in this process ask for this watchdog; rested, it was switched on a while ago."""
    twin = Twin(socket, paper_methods(), make)
    if rested:
        twin.boot_s -= BOOT_REST_US / 1e6
    with pytest.MonkeyPatch.context() as patch, twin:
        patch.setattr(link, "WATCHDOG_S", watchdog_s)
        yield twin


@contextmanager
def a_twin(
    folder: Path,
    troubles: Troubles | None = None,
    *,
    speed: float = 20.0,
    tcp: bool = False,
    watchdog_s: float = PATIENT_S,
    rested: bool = False,
    **make: Any,
) -> Iterator[tuple[Twin, Socket]]:
    """A twin that serves."""
    socket: Socket = Tcp() if tcp else Pty(folder / "gun")
    made = Make(speed=speed, troubles=troubles or Troubles(), **make)
    with plugged_in(socket, made, watchdog_s, rested=rested) as twin:
        yield twin, socket


@contextmanager
def a_pair(folder: Path, troubles: Troubles | None = None, *, speed: float = 20.0, **more: Any) -> Iterator[Pair]:
    with a_twin(folder, troubles, speed=speed, **more) as (twin, socket), noted_commands() as commands:
        address = f"serial:{socket.address}?speed={speed:g}"
        gun = open_serial(address, paper_methods(), host_clock(speed))
        try:
            yield Pair(twin=twin, gun=gun, socket=socket, speed=speed, commands=commands)
        finally:
            gun.close()


__all__ = [
    "PATIENT_S",
    "PULSE",
    "SLOW",
    "Pair",
    "Troubles",
    "a_pair",
    "a_shot",
    "a_twin",
    "disarmings_of",
    "host_clock",
    "is_up",
    "plugged_in",
    "said",
]
