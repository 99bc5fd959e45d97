"""Hosts of the twin's core without a port: a hand at a terminal, and a program in the strict mode."""

from __future__ import annotations

from device.twin.core import Core
from device.wire.records import Frame, ShotRecord, Splitter, StatusRecord, decode, encode, following

PULSE = "CONF asymmetric-1,FORW,PULS,16000,10000,211000"
READY = 1_000_000


class Hand:
    """A hand at a terminal: says lines in the plain mode, and reads what the gun says."""

    def __init__(self):
        self.core, self.now_us, self.drives = Core(), 0, []

    def say(self, text, after_us=0):
        self.now_us += after_us
        out, drives = self.core.step(f"{text}\n".encode() if text else b"", self.now_us)
        self.drives += drives
        return out.decode("ascii").splitlines()

    def error(self):
        return self.say("SYST:ERR?")[0]

    def standing(self):
        return StatusRecord.parse(self.say("STAT?")[0])

    def shot(self):
        return ShotRecord.parse(self.say("SHOT?")[0])


class Strict(Hand):
    """A host in the strict mode: frames, each with its answer."""

    def __init__(self, token=7):
        super().__init__()
        self.number = 0
        assert self.say(f"SYST:STRI {token}") == ["STRI 0"]

    def say(self, text, after_us=0):
        self.now_us += after_us
        self.number = following(self.number)
        return self.send(encode(Frame(number=self.number, body=text), "host") if text else b"")

    def send(self, data):
        out, drives = self.core.step(data, self.now_us)
        self.drives += drives
        return [decode(line, "gun").body for line in Splitter().feed(out)]

    def standing(self):
        return StatusRecord.parse(self.say("STAT?")[-1])
