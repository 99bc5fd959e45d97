"""Questions to the gun that may be asked again, and answers that are read: each until there is one that will do."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from device.serial_gun.checks import check_standing
from device.serial_gun.link import Link
from device.serial_gun.outcomes import Contradiction, Disconnected, TimedOut
from device.serial_gun.pending import Reply
from device.wire.frame import Garbled
from device.wire.records import ShotRecord, Standing
from device.words import LinkError

TRIES = 4
RECONNECT_S = 5.0
"""So long a command waits for a gun that was unplugged."""

_T = TypeVar("_T")


def ask(link: Link, body: str, allowed: Callable[[], bool] = lambda: True) -> Reply:
    """Ask what may be asked again, until there is an answer; the last trouble if there is none."""
    trouble: LinkError = TimedOut("no answer")
    for _ in range(TRIES):
        link.wait_up(RECONNECT_S)
        try:
            return link.ask(body, allowed=allowed)
        except (TimedOut, Garbled, Disconnected) as error:
            trouble = error
    raise trouble


def standing(link: Link) -> tuple[Reply, Standing]:
    """How the gun stands. `Contradiction`: as it cannot stand."""
    reply, found = _read(link, "STAT?", Standing.parse)
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
        reply = ask(link, question)
        try:
            return reply, parse(reply.body)
        except Garbled as error:
            trouble = error
    raise Garbled(f"the gun's answer to {question} cannot be read: {trouble}")
