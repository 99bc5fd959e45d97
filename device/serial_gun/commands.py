"""The commands on a line: which answers are awaited, by their number, and how each ends."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from device.wire.records import Garbled, refusal_in
from device.words import LinkError

CommandOutcome = Literal["done", "refused", "timed out", "garbled", "disconnected"]


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


class CommandRefused(LinkError):  # noqa: N818
    """The gun said no: nothing was done. `code` is the number of its error."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


OUTCOMES: dict[type[LinkError], CommandOutcome] = {
    CommandRefused: "refused",
    TimedOut: "timed out",
    Garbled: "garbled",
    Disconnected: "disconnected",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingCommand:
    """One command as it went: its number, when it was written and when it ended, on the host's clock, and how."""

    number: int
    body: str
    written_s: float
    ended_s: float
    outcome: CommandOutcome


KEPT_COMMANDS = 10_000


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

    def __init__(self, clock: Callable[[], float]) -> None:
        self.log: deque[PendingCommand] = deque(maxlen=KEPT_COMMANDS)
        self._clock = clock
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
        """The answer of a command, which goes into the log. `LinkError`: its other outcomes, by their type."""
        self.take(waiting.number)
        found = _outcome(waiting)
        reply = waiting.reply
        self.log.append(
            PendingCommand(
                number=waiting.number,
                body=waiting.body,
                written_s=waiting.written_s,
                ended_s=reply.received_s if reply else self._clock(),
                outcome="done" if isinstance(found, Reply) else OUTCOMES.get(type(found), "disconnected"),
            )
        )
        if isinstance(found, LinkError):
            raise found
        return found


def _outcome(waiting: Waiting) -> Reply | LinkError:
    """The answer, or the trouble that there was instead."""
    reply = waiting.reply
    if reply is None:
        return waiting.trouble or TimedOut(f"no answer to {waiting.header} within its time")
    no = refusal_in(reply.body)
    return reply if no is None else CommandRefused(no.code, f"the gun refused {waiting.header}: {no.reason}")
