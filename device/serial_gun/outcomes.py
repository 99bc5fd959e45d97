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
