"""Whether the gun is armed, and for whom; and questions that may be asked again, as their answers only tell."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from device.serial_gun.checks import check_standing
from device.serial_gun.commands import CalledOff, CommandRefused, Contradiction, Disconnected, Reply, TimedOut
from device.serial_gun.link import Link
from device.wire.frame import Garbled
from device.wire.records import ShotRecord, StatusRecord
from device.words import LinkError

TRIES = 4
RECONNECT_S = 5.0
"""So long a command waits for a gun that was unplugged."""

_T = TypeVar("_T")


def ask_again(link: Link, body: str, allowed: Callable[[], bool] = lambda: True) -> Reply:
    """Ask what may be asked again, until there is an answer; the last trouble if there is none."""
    trouble: LinkError = TimedOut("no answer")
    for _ in range(TRIES):
        link.wait_up(RECONNECT_S)
        try:
            return link.ask(body, allowed=allowed)
        except (TimedOut, Garbled, Disconnected) as error:
            trouble = error
    raise trouble


def standing(link: Link) -> tuple[Reply, StatusRecord]:
    """How the gun stands. `Contradiction`: as it cannot stand."""
    reply, found = _read(link, "STAT?", StatusRecord.parse)
    try:
        check_standing(found)
    except Contradiction as error:
        raise Contradiction(f"the gun's answer to STAT? is not believed: {error}") from error
    return reply, found


def last_shot(link: Link) -> tuple[Reply, ShotRecord]:
    """What the gun says of the last shot that it accepted."""
    return _read(link, "SHOT?", ShotRecord.parse)


def _read(link: Link, question: str, parse: Callable[[str], _T]) -> tuple[Reply, _T]:
    """An answer as the record that it is. One that cannot be read is asked for again."""
    trouble = Garbled()
    for _ in range(TRIES):
        reply = ask_again(link, question)
        try:
            return reply, parse(reply.body)
        except Garbled as error:
            trouble = error
    raise Garbled(f"the gun's answer to {question} cannot be read: {trouble}")


MARGIN_S = 0.1
"""Beyond the watchdog's time, until a gun that says nothing is taken for disarmed."""


class Arming:
    """The arming of the gun on a link, from any thread.

    `disarms` counts the disarmings. Who wants to arm or fire notes it first: once it has changed, no more is written
    for them. The link asks while nobody else can write, so that what was written before is followed by `ABOR`.
    """

    def __init__(self, link: Link) -> None:
        self.disarms = 0
        self.session = 0  # the link's, in which the gun was armed; 0 if it is disarmed
        self._link = link
        self._lock = threading.Lock()

    @property
    def lapsed(self) -> bool:
        """Whether the gun was armed, and has disarmed itself since, as it does when the line is lost."""
        return self.session not in {0, self._link.session}

    def stands(self, disarms: int, session: int) -> bool:
        """Whether the gun is still armed for what was asked for after so many disarmings, in this session."""
        return (self.disarms, self._link.session) == (disarms, session)

    def arm(self, disarms: int) -> None:
        """Arm, unless it was disarmed since. `LinkError`: it was, or the gun does not answer, or has a fault."""
        try:
            session = ask_again(self._link, "ARM", lambda: self.disarms == disarms).session
        except (CommandRefused, CalledOff):
            raise
        except LinkError:  # it may be armed, and its answer lost
            self.disarm()
            raise
        with self._lock:
            if self.disarms != disarms:
                raise CalledOff("ARM was called off: the gun was disarmed meanwhile")
            self.session = session

    def disarm(self) -> None:
        """Forbid shots. If the gun cannot be told, wait until its watchdog has done it."""
        with self._lock:
            self.disarms += 1
            self.session = 0
        session = self._link.session
        for _ in range(TRIES):
            try:
                self._link.ask("ABOR")
            except (TimedOut, Garbled):
                continue
            except LinkError:
                break
            return
        self._link.drop("the gun did not say that it is disarmed")
        end_s = time.monotonic() + self._link.watchdog_s + MARGIN_S - self._link.silent_for_s
        while self._link.session == session and time.monotonic() < end_s:
            time.sleep(0.005)
