"""Lines, frames, and the records in them: what both sides of the wire agree on. Pure and bounded.

A line ends with LF; a frame is a line of the strict mode, with a sequence number and a CRC-32 (`PROTOCOL.md`).

Each record reads itself with `parse`, which gives a record or raises `Garbled`, and writes itself with `text`.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, Self, cast, get_args

from device.words import LinkError

MAX_LINE: Final = 200
"""Bytes of a line without its end."""
MAX_BODY: Final = MAX_LINE - 15
"""Bytes of a frame's body: what is around it takes 15."""
LAST_NUMBER: Final = 0xFFFF
"""Sequence numbers go from 1 to here and start again at 1; 0 is only the gun's, for what answers no command."""

Sender = Literal["host", "gun"]
_MARKS: Final[dict[Sender, bytes]] = {"host": b">", "gun": b"<"}
_FRAME: Final = re.compile(rb"([<>][0-9A-F]{4} ([ -~]{1,%d}))~([0-9A-F]{8})" % MAX_BODY)


class Garbled(LinkError):  # noqa: N818 - an outcome, as the protocol names it
    """Bytes that are no word of this language."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """One line of the strict mode. `ValueError`: number or body cannot be written."""

    number: int
    body: str

    def __post_init__(self) -> None:
        if not 0 <= self.number <= LAST_NUMBER:
            raise ValueError(f"number is {self.number}; it must be 0 to {LAST_NUMBER}")
        if not 1 <= len(self.body) <= MAX_BODY or not all(" " <= char <= "~" for char in self.body):
            raise ValueError(f"body is {self.body[:40]!r}; it must be 1 to {MAX_BODY} printable ASCII characters")


def encode(frame: Frame, sender: Sender) -> bytes:
    r"""A frame as a line with its end.

    >>> encode(Frame(number=1, body="TIME?"), "host")
    b'>0001 TIME?~B3899DE3\n'
    """
    head = _MARKS[sender] + f"{frame.number:04X} {frame.body}".encode("ascii")
    return head + f"~{zlib.crc32(head):08X}\n".encode("ascii")


def decode(line: bytes, sender: Sender) -> Frame:
    """The frame that a line without its end is, if `sender` sent it. `Garbled`: it is none, or a command's number 0."""
    found = _FRAME.fullmatch(line)
    if found is None or not line.startswith(_MARKS[sender]):
        raise Garbled(f"not a frame of the {sender}: {line[:40]!r}")
    if int(found[3], 16) != zlib.crc32(found[1]):
        raise Garbled(f"the checksum does not fit: {line[:40]!r}")
    frame = Frame(number=int(line[1:5], 16), body=found[2].decode("ascii"))
    if sender == "host" and frame.number == 0:
        raise Garbled(f"a command's number is 0001 to FFFF: {line[:40]!r}")
    return frame


def is_newer(number: int, last: int) -> bool:
    """Whether a sequence number comes after the last one: at most half of all numbers ahead."""
    return 0 < (number - last) % LAST_NUMBER <= LAST_NUMBER // 2


def following(number: int) -> int:
    """The sequence number after this one."""
    return number % LAST_NUMBER + 1


class Splitter:
    """Cuts a stream of bytes into lines, in bounded memory. What is too long is left out and counted."""

    def __init__(self) -> None:
        self._begun = bytearray()
        self._too_long = False

    def feed(self, data: bytes) -> list[bytes | None]:
        """The lines that these bytes complete, without LF, a CR before it, and empty ones; None for one too long."""
        pieces = data.split(b"\n")
        found: list[bytes | None] = []
        for piece in pieces[:-1]:
            self._take(piece)
            found += self._line()
        self._take(pieces[-1])
        return found

    def _take(self, piece: bytes) -> None:
        room = MAX_LINE + 1 - len(self._begun)  # one more: a CR may end it
        self._too_long = self._too_long or len(piece) > room
        self._begun += piece[:room]

    def _line(self) -> list[bytes | None]:
        line = bytes(self._begun).removesuffix(b"\r")
        too_long = self._too_long or len(line) > MAX_LINE
        self._begun.clear()
        self._too_long = False
        return [None] if too_long else [line] if line else []


WIRE_VERSION: Final = 1
"""Counts up whenever a host of the version before would be misunderstood."""

Way = Literal["FORW", "BACK"]
SettingKind = Literal["PULS", "EFF"]
Ending = Literal["NONE", "WAIT", "DRIV", "DONE", "CUT"]
"""No shot yet; accepted and waiting; being driven; driven to its end; cut short."""
WireState = Literal["DISARMED", "ARMED", "RESETTING", "WAITING", "FIRING", "FAULT"]

METHOD_NAME: Final = re.compile(r"[a-z0-9-]{1,24}")
_NUMBER: Final = re.compile(r"0|[1-9][0-9]{0,15}")
_NAME: Final = re.compile(r"[A-Za-z0-9._-]{1,24}")
_VERSION: Final = re.compile(r"wire ([0-9]{1,4}) firmware ([A-Za-z0-9._-]{1,24})")
_ERROR: Final = re.compile(r'ERR (-?[0-9]{1,4}),"([ !#-~]{1,60})"')


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """Who answers, and which version of the language it speaks."""

    model: str
    serial: str
    wire: int
    firmware: str

    def text(self) -> str:
        """As `*IDN?` is answered."""
        return f"Recoil,{self.model},{self.serial},wire {self.wire} firmware {self.firmware}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """From the answer to `*IDN?`.

        >>> Named.parse("Recoil,haptic-gun,TWIN,wire 1 firmware 1.0").serial
        'TWIN'
        """
        fields = _fields(text, 4, "who a gun is, Recoil,MODEL,SERIAL,wire W firmware F")
        version = _VERSION.fullmatch(fields[3])
        if fields[0] != "Recoil" or version is None or not all(map(_NAME.fullmatch, fields[1:3])):
            raise Garbled(f"{text[:80]!r} names no Recoil gun")
        return cls(model=fields[1], serial=fields[2], wire=int(version[1]), firmware=version[2])


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What the next shots are made of. `amount` is mV of a pulse or the number of an effect."""

    method: str
    way: Way
    kind: SettingKind
    amount: int
    length_us: int
    rest_us: int

    def text(self) -> str:
        """As it stands behind `CONF` and in a shot's record."""
        return f"{self.method},{self.way},{self.kind},{self.amount},{self.length_us},{self.rest_us}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """From the parameters of `CONF`; their ranges are the gun's to judge."""
        fields = _fields(text, 6, "setting, METHOD,WAY,KIND,AMOUNT,LENGTH,REST")
        if METHOD_NAME.fullmatch(fields[0]) is None:
            raise Garbled(f"not the name of a method: {fields[0][:40]!r}")
        amount, length_us, rest_us = _numbers(fields[3:])
        return cls(
            method=fields[0],
            way=cast("Way", _one_of(fields[1], get_args(Way))),
            kind=cast("SettingKind", _one_of(fields[2], get_args(SettingKind))),
            amount=amount,
            length_us=length_us,
            rest_us=rest_us,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotRecord:
    """What became of the last shot that was accepted, on the gun's clock. Home is predicted, not measured."""

    count: int
    mark: int
    ending: Ending
    accepted_us: int
    start_us: int
    end_us: int
    home_predicted_us: int
    setting: Setting

    def text(self) -> str:
        """As `SHOT?` and a trigger are answered."""
        times = f"{self.accepted_us},{self.start_us},{self.end_us},{self.home_predicted_us}"
        return f"SHOT {self.count},{self.mark},{self.ending},{times},{self.setting.text()}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """From the answer to `SHOT?` or to a trigger."""
        fields = _fields(_behind(text, "SHOT"), 13, "record of a shot")
        count, mark = _numbers(fields[:2])
        accepted_us, start_us, end_us, home_us = _numbers(fields[3:7])
        return cls(
            count=count,
            mark=mark,
            ending=cast("Ending", _one_of(fields[2], get_args(Ending))),
            accepted_us=accepted_us,
            start_us=start_us,
            end_us=end_us,
            home_predicted_us=home_us,
            setting=Setting.parse(",".join(fields[7:])),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusRecord:
    """How the gun stands. `fault` is 0, or the number that the driver's fault was given."""

    state: WireState
    count: int
    clock_us: int
    ready_us: int
    coil_mC: int
    fault: int

    def text(self) -> str:
        """As `STAT?` is answered."""
        return f"STAT {self.state},{self.count},{self.clock_us},{self.ready_us},{self.coil_mC},{self.fault}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """From the answer to `STAT?`."""
        fields = _fields(_behind(text, "STAT"), 6, "standing of a gun")
        count, clock_us, ready_us, coil_mC, fault = _numbers(fields[1:])
        return cls(
            state=cast("WireState", _one_of(fields[0], get_args(WireState))),
            count=count,
            clock_us=clock_us,
            ready_us=ready_us,
            coil_mC=coil_mC,
            fault=fault,
        )


def refusal_in(text: str) -> tuple[int, str] | None:
    """The number and the text of the error that an answer is, or None if it is another answer.

    >>> refusal_in('ERR 101,"Disarmed"')
    (101, 'Disarmed')
    """
    found = _ERROR.fullmatch(text)
    return None if found is None else (int(found[1]), found[2])


def whole_number(text: str) -> int:
    """A whole number of at most 16 digits, without sign and leading zeros. `Garbled`: anything else."""
    if _NUMBER.fullmatch(text) is None:
        raise Garbled(f"not a whole number: {text[:40]!r}")
    return int(text)


def named_value(text: str, name: str) -> int:
    """The number behind a name: `TIME 123`. `Garbled`: anything else."""
    return whole_number(_behind(text, name))


def _behind(text: str, name: str) -> str:
    """What stands behind the word that names an answer."""
    if not text.startswith(f"{name} "):
        raise Garbled(f"{text[:80]!r} is no answer that begins with {name}")
    return text[len(name) + 1 :]


def _fields(text: str, count: int, what: str) -> list[str]:
    fields = text.split(",", count)
    if len(fields) != count:
        raise Garbled(f"{text[:80]!r} is no {what}: it must have {count} fields")
    return fields


def _numbers(fields: Sequence[str]) -> list[int]:
    return [whole_number(field) for field in fields]


def _one_of(text: str, words: Sequence[str]) -> str:
    if text not in words:
        raise Garbled(f"{text[:40]!r} is none of {', '.join(words)}")
    return text
