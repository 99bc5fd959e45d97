"""How a command over the line ends, and what is kept of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from device.wire.frame import Garbled
from device.words import LinkError

Outcome = Literal["done", "refused", "timed out", "garbled", "disconnected"]


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


class Refused(LinkError):  # noqa: N818
    """The gun said no: nothing was done. `code` is the number of its error."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


OUTCOMES: dict[type[LinkError], Outcome] = {
    Refused: "refused",
    TimedOut: "timed out",
    Garbled: "garbled",
    Disconnected: "disconnected",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """One command as it went: its number, when it was written and when it ended, on the host's clock, and how."""

    number: int
    body: str
    written_s: float
    ended_s: float
    outcome: Outcome
