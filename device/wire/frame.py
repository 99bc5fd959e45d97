"""Bytes, lines and frames: what both sides of the wire agree on before they agree on words. Pure and bounded.

A line ends with LF; a frame is a line of the strict mode, with a sequence number and a CRC-32 (`PROTOCOL.md`).
"""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from typing import Final, Literal

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
