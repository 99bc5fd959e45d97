"""The firmware's core: bytes and the time go in, bytes and drive events come out. It waits for nothing.

`PROTOCOL.md` says what it does; the C core must say the same, byte for byte, for the same calls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from device.twin import MODEL, SERIAL
from device.twin.machine import Carried, DriveEvent, StateMachine
from device.wire import records
from device.wire.errors import WireError, message

QUEUE_SIZE: Final = 16
WATCHDOG_MS: Final = 30_000
"""At boot, for a hand at a terminal; `SerialGun` asks for a shorter one."""
MIN_WATCHDOG_MS, MAX_WATCHDOG_MS = 100, 60_000

IDENTITY: Final = records.Named(model=MODEL, serial=SERIAL, wire=records.WIRE_VERSION, firmware="1.1.0")

Said = str | int | None
"""What a command comes to: an answer, an error's number, or nothing to say but that it is done."""

SCPI_VERSION: Final = "1999.0"
COMPLETE, DEVICE_ERROR, EXECUTION_ERROR, COMMAND_ERROR, POWER_ON = 1, 8, 16, 32, 128
"""The bits of the standard event status register (IEEE 488.2, 11.5.1) that a gun sets."""


def event_of(error: int) -> int:
    """The bit of an error by its number: -1xx a command's, -2xx its execution's, all others the device's.

    >>> event_of(WireError.UNDEFINED), event_of(WireError.OUT_OF_RANGE), event_of(WireError.WATCHDOG)
    (32, 16, 8)
    """
    return {1: COMMAND_ERROR, 2: EXECUTION_ERROR}.get(-error // 100, DEVICE_ERROR)


class Core:
    """One gun from its boot at `now_us` on. Calls come with times that never run back; `board` carries drives out."""

    def __init__(
        self, identity: records.Named = IDENTITY, now_us: int = 0, board: Callable[[DriveEvent], Carried] | None = None
    ) -> None:
        self.machine = StateMachine(now_us, board)
        self.strict = False
        self._identity = identity
        self._splitter = records.Splitter()
        self.errors: list[int] = []
        self._events = POWER_ON
        self._tells_complete = False  # *OPC waits for the end of the shot
        self._asked_complete: int | None = None  # sequence number of the *OPC? that does, 0 in the plain mode
        self._number = 0  # of the frame that is being carried out, 0 in the plain mode
        self._out = bytearray()
        self._last = 0  # sequence number
        self._token = 0
        self._pending = 0  # sequence number of the trigger that waits for its answer, 0 if none does
        self.heard_us = now_us
        self._watchdog_us = 1000 * WATCHDOG_MS

    def wake_us(self) -> int | None:
        """When `step` must be called at the latest even if no byte comes; None if nothing is due."""
        times = [self.machine.due_us(), self._watchdog_due_us()]
        return min((time for time in times if time is not None), default=None)

    def step(self, data: bytes, now_us: int) -> tuple[bytes, list[DriveEvent]]:
        """What is due by now happens, each at its own time; then the bytes are taken. Bytes to send; drive events."""
        self._run_due(now_us)
        for line in self._splitter.feed(data):
            self._take(line, now_us)
            self._run_due(now_us)
        return self._taken()

    def forget_line(self) -> None:
        """Drop the line that was begun."""
        self._splitter = records.Splitter()

    def fail(self, fault: int, now_us: int) -> tuple[bytes, list[DriveEvent]]:
        """The board's driver reports a fault, by its number above 0."""
        self._run_due(now_us)
        if self.machine.fail(fault, now_us):
            self._answer_trigger()
        self._queue(WireError.FAULT)
        return self._taken()

    def _taken(self) -> tuple[bytes, list[DriveEvent]]:
        out, drives = bytes(self._out), self.machine.drives
        self._out.clear()
        self.machine.drives = []
        return out, drives

    def _watchdog_due_us(self) -> int | None:
        watched = self.strict or self.machine.state in {"ARMED", "WAITING", "FIRING"}
        return self.heard_us + self._watchdog_us if watched else None

    def _run_due(self, now_us: int) -> None:
        """At the same microsecond the gun's own event comes before the watchdog."""
        while (time_us := self.wake_us()) is not None and time_us <= now_us:
            if time_us == self.machine.due_us():
                if self.machine.run_due():
                    self._answer_ended()
            else:
                self._abort(time_us)
                self._queue(WireError.WATCHDOG)
                self.strict = False

    def _take(self, line: bytes | None, now_us: int) -> None:
        """A line, or None for one that was too long."""
        if line is not None and (line.startswith(b">") or self.strict):
            self._take_frame(line, now_us)
        elif self.strict:
            self._send(0, "NAK")
        elif line is None:
            self._queue(WireError.OVERRUN)
        else:
            self._number = 0
            said = self._do(_text(line), now_us)
            self.heard_us = self.heard_us if isinstance(said, int) else now_us
            self._say(said)

    def _take_frame(self, line: bytes, now_us: int) -> None:
        try:
            frame = records.decode(line, "host")
        except records.Garbled:
            if line == b"*IDN?":
                self._say(self._identity.text())
            else:
                self._send(0, "NAK")
            return
        if frame.body.startswith("SYST:STRI "):
            self._enter(frame, now_us)
        elif not self.strict:
            self._send(frame.number, f"ERR {message(WireError.NO_SESSION)}")
        elif records.is_newer(frame.number, self._last):
            self._last, self.heard_us = frame.number, now_us
            self._answer(frame, now_us)

    def _enter(self, frame: records.Frame, now_us: int) -> None:
        """A session of the strict mode begins: disarmed, numbered from this frame on. It tells the token before."""
        try:
            token = records.whole_number(frame.body.removeprefix("SYST:STRI "))
        except records.Garbled:
            self._send(frame.number, f"ERR {message(WireError.BAD_TYPE)}")
            return
        self._pending, self._asked_complete = 0, None
        self._abort(now_us)
        self._send(frame.number, f"STRI {self._token}")
        self.strict, self._token, self._last, self.heard_us = True, token, frame.number, now_us

    def _answer(self, frame: records.Frame, now_us: int) -> None:
        if frame.body == "SYST:PLAI":
            self._abort(now_us)
            self._send(frame.number, "OK")
            self.strict = False
            return
        self._number = frame.number
        said = self._do(frame.body, now_us)
        if isinstance(said, int):
            self._send(frame.number, f"ERR {message(said)}")
        elif frame.body.startswith("TRIG"):
            self._pending = frame.number
        elif self._asked_complete != frame.number:
            self._send(frame.number, said or "OK")

    def _answer_ended(self) -> None:
        """Tell what became of a shot whose time has come; in the plain mode an error is queued."""
        if not self._pending and self.machine.shot.ending == "NONE":
            self._queue(self.machine.never)
        self._answer_trigger()

    def _answer_trigger(self) -> None:
        """A shot has ended: tell what became of it, and that it has."""
        if self._pending:
            ended = self.machine.shot.ending != "NONE"
            self._send(self._pending, self.machine.shot.text() if ended else f"ERR {message(self.machine.never)}")
        self._pending = 0
        self._events |= COMPLETE if self._tells_complete else 0
        asked, self._tells_complete, self._asked_complete = self._asked_complete, False, None
        if asked == 0:
            self._say("1")
        elif asked is not None:
            self._send(asked, "1")

    def _do(self, text: str, now_us: int) -> Said:
        """Carry a command out: header, blank, parameters."""
        header, blank, rest = text.partition(" ")
        parameters = rest.split(",") if blank else []
        if header in _WITHOUT:
            return WireError.NOT_ALLOWED if parameters else self._simple(header, now_us)
        try:
            return self._with(
                header, rest, [] if header == "CONF" else [records.whole_number(text) for text in parameters], now_us
            )
        except records.Garbled:
            return WireError.BAD_TYPE if header in _WITH else WireError.UNDEFINED

    def _simple(self, header: str, now_us: int) -> Said:
        match header:
            case "ARM":
                return self.machine.arm() or None
            case "ABOR" | "*RST":
                self._abort(now_us)
                if header == "*RST":
                    self.machine.clear()
                return None
            case "*CLS":
                self.errors.clear()
                self._events, self._tells_complete = 0, False
                return None
            case "*OPC":
                self._tells_complete = self.machine.due_us() is not None
                self._events |= 0 if self._tells_complete else COMPLETE
                return None
            case "*OPC?":
                return self._ask_complete()
            case _:
                return self._question(header, now_us)

    def _ask_complete(self) -> Said:
        """1, at once or when the shot that waits or is driven has ended. One question waits at a time."""
        if self.machine.due_us() is None:
            return "1"
        if self._asked_complete is not None:
            return WireError.BUSY
        self._asked_complete = self._number
        return None

    def _question(self, header: str, now_us: int) -> Said:
        match header:
            case "*IDN?":
                return self._identity.text()
            case "TIME?":
                return f"TIME {now_us}"
            case "STAT?":
                return self.machine.standing(now_us).text()
            case "SHOT?":
                return self.machine.shot.text()
            case "CONF?":
                setting = self.machine.setting
                return WireError.NOT_CONFIGURED if setting is None else f"CONF {setting.text()}"
            case "SYST:WATC?":
                return f"WATC {self._watchdog_us // 1000}"
            case _:
                return self._say_of_itself(header, now_us)

    def _say_of_itself(self, header: str, now_us: int) -> Said:
        match header:
            case "*TST?":
                return f"{self.machine.standing(now_us).fault}"
            case "*ESR?":
                events, self._events = self._events, 0
                return f"{events}"
            case "SYST:VERS?":
                return SCPI_VERSION
            case _:
                return message(self.errors.pop(0) if self.errors else WireError.NO_DEVICE_ERROR)

    def _with(self, header: str, rest: str, numbers: list[int], now_us: int) -> Said:
        match header:
            case "CONF":
                return (
                    self.machine.configure(records.Setting.parse(rest)) if rest else WireError.MISSING_PARAMETER
                ) or None
            case "TRIG" if len(numbers) <= 3:
                mark, at_us, before_us = [*numbers, 0, 0, 0][:3]
                return self.machine.trigger(mark, at_us, before_us, now_us) or None
            case "SYST:WATC" if len(numbers) == 1:
                if not MIN_WATCHDOG_MS <= numbers[0] <= MAX_WATCHDOG_MS:
                    return WireError.OUT_OF_RANGE
                self._watchdog_us = 1000 * numbers[0]
                return None
            case _:
                return _wrong_count(header, len(numbers))

    def _abort(self, now_us: int) -> None:
        if self.machine.abort(now_us):
            self._answer_trigger()

    def _say(self, said: Said) -> None:
        """In the plain mode questions are answered, errors queued, and everything else is silent."""
        if isinstance(said, int):
            self._queue(said)
        elif said is not None:
            self._out.extend(f"{said}\n".encode("ascii"))

    def _send(self, sequence: int, body: str) -> None:
        self._out.extend(records.encode(records.Frame(number=sequence, body=body), "gun"))

    def _queue(self, error: int) -> None:
        self._events |= event_of(error)
        if len(self.errors) < QUEUE_SIZE:
            self.errors.append(error)
        else:
            self.errors[-1] = WireError.QUEUE_OVERFLOW
            self._events |= event_of(WireError.QUEUE_OVERFLOW)


_WITHOUT: Final = frozenset(
    (
        *("ARM", "ABOR", "*RST", "*CLS", "*OPC", "*OPC?", "*IDN?", "*TST?", "*ESR?", "TIME?", "STAT?", "SHOT?"),
        *("CONF?", "SYST:WATC?", "SYST:ERR?", "SYST:VERS?"),
    )
)
_WITH: Final = frozenset(("CONF", "TRIG", "SYST:WATC"))


def _wrong_count(header: str, count: int) -> int:
    if header not in _WITH:
        return WireError.UNDEFINED
    return WireError.MISSING_PARAMETER if count == 0 else WireError.NOT_ALLOWED


def _text(line: bytes) -> str:
    """A line as text; a byte that is no printable ASCII makes it a line that means nothing."""
    return line.decode("latin-1") if all(0x20 <= byte <= 0x7E for byte in line) else "?"
