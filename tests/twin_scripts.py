"""Scripts for a gun's core, and the transcripts that they must give: how twin and firmware are compared.

A script is text, one call a line, times in microseconds that never run back; the core boots at 0:

    in TIME HEX         step with these bytes
    tick TIME           step without bytes
    fault TIME NUMBER   the driver reports a fault
    late TIME US        from then on the board carries out so much later what it is told
    dead TIME FLAG      from then on the driver does not answer (1), or does again (0)
    reset TIME          power off and on: a new core, booted at this time; bytes not yet answered are gone

Its transcript has, for each line, what came of it: first what the board carried out, and when, then the bytes:

    boot TIME           for a reset; whatever was driven is off
    drive TIME PULS AMOUNT | drive TIME EFF AMOUNT | drive TIME OFF
    out TIME HEX        TIME is that of the call
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from random import Random
from typing import Final

from device.twin.core import Core
from device.twin.machine import Board, DriveEvent
from device.wire.records import Frame, encode, following


def transcript(script: Iterable[str]) -> Iterator[str]:
    """What the core says and does for a script."""
    board = Board()
    core = Core(board=board)
    for line in script:
        word, time, *rest = line.split()
        if word == "reset":
            core = Core(now_us=int(time), board=board)
            yield f"boot {time}"
            continue
        out, drives = _called(core, word, rest, int(time))
        if word in {"late", "dead"}:
            _change(board, word, int(rest[0]))
        yield from map(_drive, drives)
        if out:
            yield f"out {time} {out.hex().upper()}"


def _called(core: Core, word: str, rest: list[str], time_us: int) -> tuple[bytes, list[DriveEvent]]:
    if word == "fault":
        return core.fail(int(rest[0]), time_us)
    return core.step(bytes.fromhex("".join(rest)) if word == "in" else b"", time_us)


def _change(board: Board, word: str, number: int) -> None:
    if word == "late":
        board.late_us = number
    else:
        board.dead = number == 1


def _drive(drive: DriveEvent) -> str:
    return f"drive {drive.time_us} {drive.kind}" + ("" if drive.kind == "OFF" else f" {drive.amount}")


_PLAIN: Final = (
    *("*IDN?", "*RST", "*CLS", "ARM", "ABOR", "STAT?", "SHOT?", "TIME?", "CONF?", "SYST:ERR?", "SYST:WATC?"),
    *("CONF", "CONF ", "ARM 1", "TRIG x", "TRIG 1,2,3,4", "TRIG ,", "FOO", "FOO 1", "", "SYST:WATC", "SYST:WATC 99"),
    *("arm", " ARM", "SYST:WATC 500", "SYST:WATC 60001", "SYST:STRI 1", "SYST:PLAI", "TRIG 4294967296", "TRIG 01"),
    *("*OPC", "*OPC?", "*ESR?", "*TST?", "SYST:VERS?", "*OPC? 1"),
    *("CONF Xx,FORW,PULS,1,1,60000", "CONF a,LEFT,PULS,1,1,60000", "CONF a,FORW,PULS,1,1,60000,7"),
)
_STEPS_US: Final = (0, 0, 1, 100, 999, 10_000, 50_000, 99_000, 100_000, 211_000, 211_003, 1_000_000, 2_500_000)
_LONG: Final = 310
"""Shots of a train that meets the limits of a minute and of the coil."""
_LATE_US: Final = (1, 20, 21, 100, 101, 200, 201, 999, 1_000, 1_001, 9_999, 10_000, 19_999, 20_000, 30_000)
MAX_LATE_US: Final = max(_LATE_US)
_PAUSES_US: Final = (500_000, 29_999_999, 30_000_000, 61_000_000, 400_000_000)
TELLING_SEEDS: Final = (*range(24), 29)
"""Of random scripts that together meet every error but an overflow of the queue."""


def random_script(seed: int, phrases: int = 40) -> Iterator[str]:
    """A script of plain lines, frames, nonsense, trains, resets and faults; the same for a seed."""
    return _Writer(seed).write(phrases)


class _Writer:
    """Writes one script. Trains and pauses are as long as the limits of a second and a minute need."""

    def __init__(self, seed: int) -> None:
        self._draw = Random(seed)
        self._time_us = 0
        self._number = self._draw.randrange(0xFFFF)
        self._strict = self._draw.random() < 0.7

    def write(self, phrases: int) -> Iterator[str]:
        if self._strict:
            yield self._say("SYST:STRI 1")
        for _ in range(phrases):
            self._time_us += self._draw.choice(_STEPS_US)
            yield from self._phrase(self._draw.random())

    def _phrase(self, chance: float) -> Iterator[str]:
        if chance < 0.01:
            yield f"reset {self._time_us}"
        elif chance < 0.02:
            yield f"fault {self._time_us} {self._draw.randrange(1, 100)}"
        elif chance < 0.05:
            self._time_us += self._draw.choice(_PAUSES_US)
            yield f"tick {self._time_us}"
            if self._strict:
                yield self._say(f"SYST:STRI {self._draw.randrange(2**32)}")
        elif chance < 0.15:
            yield from self._train(self._draw.choice((2, 3, 12, 12, _LONG)))
        elif chance < 0.23:
            yield from self._special() if chance < 0.2 else self._late()
        elif chance < 0.28 and self._strict:
            yield self._say(f"SYST:STRI {self._draw.randrange(2**32)}")
        else:
            yield self._say(_body(self._draw, self._time_us))

    def _train(self, shots: int) -> Iterator[str]:
        """A setting, and its shots as fast as it may be, or a little faster."""
        hot = shots == _LONG and self._draw.random() < 0.5
        setting = "asymmetric-2,BACK,PULS,24000,20000,200001" if hot else _setting(self._draw)
        every_us = int(setting.rsplit(",", 1)[1]) + self._draw.choice((0, 0, 0, 1, -1))
        yield self._say(f"CONF {setting}")
        yield self._say("ARM")
        for _ in range(shots):
            yield self._say(f"TRIG {self._draw.randrange(2**32)}")
            self._time_us += every_us
        yield self._say("STAT?")

    def _late(self) -> Iterator[str]:
        """Shots that the board begins late or not at all, to their end, and called off."""
        dead = self._draw.random() < 0.2
        word, number = ("dead", 1) if dead else ("late", self._draw.choice(_LATE_US))
        self._time_us += self._draw.choice((0, 1_300_000))
        yield f"{word} {self._time_us} {number}"
        yield self._say(f"CONF {_setting(self._draw)}")
        trigger = f"TRIG {self._draw.randrange(2**32)}"
        for body in ("ARM", trigger, self._draw.choice(("ABOR", "STAT?", "SHOT?")), "ARM", trigger, "SHOT?"):
            yield self._say(body)
            self._time_us += self._draw.choice((0, 0, 5_000, 100_000, 1_200_000))
        yield f"{word} {self._time_us} 0"

    def _special(self) -> Iterator[str]:
        """A shot that waits and meets something else; one that is asked for twice; a line beyond all bounds."""
        ahead = f"TRIG {self._draw.randrange(2**32)},{self._time_us + self._draw.choice((1_000_000, 1_200_000))}"
        twice = f"TRIG {self._draw.randrange(1, 2**32)}"
        meets = self._draw.choice(("ABOR", "*RST", "TRIG", "CONF?", "SYST:STRI 5", "SYST:PLAI", "*OPC?"))
        opc = self._draw.choice(("*OPC", "*OPC?"))
        for body in ("*RST", f"CONF {_setting(self._draw)}", "ARM", ahead, opc, meets, "SHOT?", "*ESR?"):
            yield self._say(body)
        self._time_us += 2_000_000
        for body in ("ARM", twice, "STAT?"):
            yield self._say(body)
        self._time_us += 2_000_000
        for body in (twice, "*CLS"):
            yield self._say(body)
        yield f"in {self._time_us} {b'A'.hex() * self._draw.choice((200, 201, 400))}0A"
        yield self._say("SYST:ERR?")

    def _say(self, body: str) -> str:
        self._number = following(self._number)
        line = encode(Frame(number=self._number, body=body), "host") if self._strict and body else f"{body}\n".encode()
        return f"in {self._time_us} {_damaged(self._draw, line).hex().upper()}"


def _body(draw: Random, time_us: int) -> str:
    chance = draw.random()
    if chance < 0.3:
        return draw.choice(_PLAIN)
    if chance < 0.45:
        return f"CONF {_setting(draw)}"
    if chance < 0.7:
        return "ARM"
    at_us = draw.choice((0, 0, time_us + draw.randrange(3_000_000)))
    before_us = draw.choice((0, at_us + draw.randrange(200_000), time_us))
    return draw.choice(("TRIG", f"TRIG {draw.randrange(3)}", f"TRIG {draw.randrange(2**32)},{at_us},{before_us}"))


def _setting(draw: Random) -> str:
    way = draw.choice(("FORW", "BACK"))
    if draw.random() < 0.3:
        effect = draw.choice((1, 1, 1, 1, 123, 0, 124))
        return f"vibration,{way},EFF,{effect},{_mostly(draw, 10_000, 1_000_001)},{_mostly(draw, 24_000, 9_999)}"
    amount = _mostly(draw, draw.choice((16_000, 24_000, 0)), 24_001)
    length_us = _mostly(draw, draw.choice((10_000, 20_000, 0, 1)), 20_001)
    rest_us = _mostly(draw, draw.choice((50_000, 99_999, 100_000, 200_000, 211_003)), 49_999)
    return f"asymmetric-{draw.randrange(1, 3)},{way},PULS,{amount},{length_us},{rest_us}"


def _mostly(draw: Random, usual: int, other: int) -> int:
    return usual if draw.random() < 0.95 else other


def _damaged(draw: Random, line: bytes) -> bytes:
    chance, place = draw.random(), draw.randrange(len(line))
    if chance < 0.97:
        return line
    damages = (
        line[:place] + line[place + 1 :],
        line[:place] + bytes([line[place] ^ (1 << draw.randrange(8))]) + line[place + 1 :],
        line + line,
        line[:-1] + b"\r\n",
        draw.randbytes(draw.randrange(1, 300)),
    )
    return draw.choice(damages)
