"""The firmware on an emulated chip, in real time: its own clock, its own interrupts, on a port that pyserial opens.

The image keeps a record of every call of its core and of every drive; the twin, given the same calls, must say and do
the same, to the byte and the microsecond.
"""

from __future__ import annotations

import os
import re
import select
import subprocess
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest
import serial

from device.twin.core import IDENTITY
from device.twin.scripts import random_script, transcript
from device.wire.frame import LAST_NUMBER, Frame, encode
from device.wire.records import ShotRecord, Standing
from tests.test_firmware_core import EMULATOR, built, message
from tests.waiting import PATIENCE_S, wait_for

NAME = re.compile(rb"QEMU-1")
SCRIPTS = 6
LONGEST_WAIT_S = 0.003
"""Between the calls of a random script, whose times are too long to wait for."""


@dataclass(frozen=True)
class Call:
    """A drive as the chip carried it out: when it says, and when it wrote it down."""

    text: str
    due_us: int
    done_us: int


class Emulated:
    """An emulated chip that runs; `port` is where the gun answers, a byte to `faults` is a fault of its driver."""

    def __init__(self, process: subprocess.Popen[str], record: Path) -> None:
        self.process, self._record = process, record
        self.port, self.faults = (_next_port(process) for _ in range(2))
        # Held open: QEMU drops what is said while nobody holds the other end, and looks only once a second.
        self._held = [_opened(name) for name in (self.port, self.faults)]
        self._greet()
        self.greetings = len(self.calls()) - 1

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()
        for descriptor in self._held:
            os.close(descriptor)

    def _greet(self) -> None:
        """Until the firmware has booted, QEMU has seen that somebody holds the other end, and all is answered."""
        heard = b""

        def answers() -> bool:
            nonlocal heard
            if not heard and self.calls():
                os.write(self._held[0], b"*IDN?\n")
            quiet = not select.select(self._held[:1], [], [], 0.05)[0]
            heard += b"" if quiet else os.read(self._held[0], 4096)
            return heard.endswith(b"\n") and quiet

        wait_for(answers, "the firmware does not answer")

    def fail(self, number: int) -> None:
        os.write(self._held[1], bytes([number]))

    def be_late(self, late_ms: int) -> None:
        """From now on the board carries out so much later what it is told."""
        before = len(self._lates())
        os.write(self._held[1], bytes([128 + late_ms]))
        wait_for(lambda: len(self._lates()) > before, "the board takes no order")

    def _lates(self) -> list[str]:
        return [line for line in self._lines() if line.startswith("late")]

    def calls(self) -> list[str]:
        """What the core was called with, as a script."""
        return [line for line in self._lines() if not line.startswith("drive")]

    def drives(self) -> list[Call]:
        """What was driven; without the last field a line reads as in a transcript."""
        found = []
        for line in self._lines():
            if line.startswith("drive"):
                word, due, kind, amount, done = line.split()
                text = f"{word} {due} {kind}" + ("" if kind == "OFF" else f" {amount}")
                found.append(Call(text, int(due), int(done)))
        return found

    def _lines(self) -> list[str]:
        return self._record.read_text().split("\n")[:-1]


def _opened(port: str) -> int:
    descriptor = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(descriptor)
    return descriptor


def _next_port(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.search(r"redirected to (\S+)", line)
    assert found, line
    return found[1]


@contextmanager
def emulated(folder: Path, image: str = "gun-qemu.elf") -> Iterator[Emulated]:
    record = folder / "record"
    quiet = ["-display", "none", "-monitor", "none", "-chardev", f"file,id=record,path={record}"]
    ports = ["-serial", "pty", "-serial", "chardev:record", "-serial", "pty"]
    words = [EMULATOR, "-M", "netduinoplus2", "-kernel", str(built("chip") / image), *quiet, *ports]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        chip = Emulated(process, record)
        try:
            yield chip
        finally:
            chip.close()


class Hand:
    """A hand at a terminal: pyserial, and a note of all that came."""

    def __init__(self, chip: Emulated) -> None:
        self.chip = chip
        self.line = serial.Serial(chip.port, 460_800, timeout=PATIENCE_S)
        self.heard = b""

    def close(self) -> None:
        self.line.close()

    def say(self, *lines: str) -> None:
        self.write("".join(f"{line}\n" for line in lines).encode())

    def write(self, data: bytes) -> None:
        """Not by pyserial, which then waits for room for more: a busy pseudo-terminal may never tell of it."""
        left = memoryview(data)

        def written() -> bool:
            nonlocal left
            with suppress(BlockingIOError):
                left = left[os.write(self.line.fileno(), left) :]
            return not left

        wait_for(written, "the chip reads nothing")

    def ask(self, line: str) -> str:
        self.say(line)
        return self.read().decode().strip()

    def read(self) -> bytes:
        line = self.line.readline()
        self.heard += line
        return line

    def standing(self) -> Standing:
        return Standing.parse(self.ask("STAT?"))

    def shot(self) -> ShotRecord:
        return ShotRecord.parse(self.ask("SHOT?"))

    def wait_until_driven(self) -> None:
        self.wait_for_ending("DONE")

    def wait_for_ending(self, ending: str) -> None:
        wait_for(lambda: self.shot().ending == ending)

    def wait_for_rest(self) -> None:
        """No shot before the magnet is home, nor in the first second after a boot."""
        standing = self.standing()
        time.sleep(max(0, standing.ready_us - standing.clock_us) / 1e6)


@pytest.fixture
def hand(tmp_path):
    with emulated(tmp_path) as chip:
        hand = Hand(chip)
        yield hand
        hand.close()


def play(hand: Hand, script: Iterator[str]) -> None:
    """Says what a script says, as fast as may be; power is not switched off."""
    before_us = 0
    for line in script:
        word, time_us, *rest = line.split()
        time.sleep(min((int(time_us) - before_us) / 1e6, LONGEST_WAIT_S))
        before_us = int(time_us)
        if word == "in":
            hand.write(bytes.fromhex("".join(rest)))
        elif word == "fault":
            hand.chip.fail(int(rest[0]))
        hand.heard += hand.line.read(hand.line.in_waiting)


def finish(hand: Hand, mark: str) -> None:
    """Everything that was said is answered: the answer to a question in both modes is the last."""
    hand.write(b"\n*IDN?\n" + encode(Frame(number=LAST_NUMBER, body=f"SYST:STRI {mark}"), "host"))
    wait_for(lambda: b"<FFFF STRI" in hand.read(), "the last question is not answered")


def as_the_twin_would(chip: Emulated) -> tuple[bytes, list[str]]:
    """What the twin says and does for the chip's calls, but for what it says to the greetings."""
    calls = chip.calls()
    assert calls[0].startswith("reset ")
    lines = list(transcript(calls))
    answers = [bytes.fromhex(line.split()[2]) for line in lines if line.startswith("out")]
    said = b"".join(answers[chip.greetings :])
    return said, [line for line in lines if line.startswith("drive")]


def agree(hand: Hand) -> int:
    """Chip and twin agree on all that the chip was told. How many bytes it said."""
    said, drives = as_the_twin_would(hand.chip)
    heard = _renamed(hand.heard)
    assert heard[: len(said)] == said
    assert [call.text for call in hand.chip.drives()][: len(drives)] == drives
    return len(said)


def _renamed(heard: bytes) -> bytes:
    """The chip under the twin's name; it is said in plain lines and in frames, whose checksums it changes."""
    lines = []
    for line in heard.splitlines(keepends=True):
        if line.startswith(b"<") and NAME.search(line):
            body = NAME.sub(IDENTITY.serial.encode(), line[6:-10]).decode()
            lines.append(encode(Frame(number=int(line[1:5], 16), body=body), "gun"))
        else:
            lines.append(NAME.sub(IDENTITY.serial.encode(), line))
    return b"".join(lines)


def play_all(hand: Hand, seeds: range) -> int:
    for seed in seeds:
        play(hand, random_script(seed))
        finish(hand, str(seed))
    return agree(hand)


def test_the_chip_in_real_time_says_and_does_what_the_twin_does_for_the_same_calls(hand):
    hand.wait_for_rest()
    assert play_all(hand, range(SCRIPTS)) > 10_000
    assert len(hand.chip.drives()) > 10


def test_it_says_who_it_is(hand):
    assert hand.ask("*IDN?") == "Recoil,haptic-gun,QEMU-1,wire 1 firmware 1.0.0"


def test_its_clock_goes_as_the_worlds(hand):
    times = []
    for _ in range(2):
        begin_s = time.monotonic()
        gun_us = int(hand.ask("TIME?").split()[1])
        times.append((begin_s, time.monotonic(), gun_us / 1e6))
        time.sleep(0.5)
    (begin, first, gun), (later, last, gun_later) = times
    assert later - first - 0.001 < gun_later - gun < last - begin + 0.001


def test_a_train_at_its_rest_is_driven_to_the_microsecond(hand):
    hand.wait_for_rest()
    hand.say("CONF asymmetric-2,FORW,PULS,16000,10000,200000", "ARM")
    trains = list[list[int]]()
    wait_for(lambda: in_time(hand, trains), "the host was always too late")
    starts = [call.due_us for call in hand.chip.drives() if "PULS" in call.text]
    assert starts[-6:] == trains[-1]
    assert agree(hand)


def in_time(hand: Hand, trains: list[list[int]]) -> bool:
    """Ask for one more train of six shots, 200 ms apart; whether each was accepted before its tick."""
    start_us = hand.standing().clock_us + 200_000
    trains.append([start_us + 200_000 * shot for shot in range(6)])
    for shot, at_us in enumerate(trains[-1]):
        hand.say(f"TRIG {6 * len(trains) + shot},{at_us}")
        hand.wait_until_driven()
        if hand.shot().accepted_us >= at_us:
            return False
    return True


def test_left_alone_it_switches_off_and_disarms_in_the_stated_time(hand):
    hand.wait_for_rest()
    hand.say("CONF vibration,FORW,EFF,1,1000000,1000000", "SYST:WATC 300", "ARM", "TRIG 1")
    wait_for(lambda: any(call.text.endswith("OFF") for call in hand.chip.drives()))
    standing, shot = hand.standing(), hand.shot()
    assert (standing.state, hand.ask("SYST:ERR?")) == ("DISARMED", message(109))
    assert (shot.ending, shot.end_us - shot.accepted_us) == ("CUT", 300_000)
    off = hand.chip.drives()[-1]
    assert off.text == f"drive {shot.end_us} OFF"
    assert agree(hand)


def test_a_driver_that_fails_in_mid_shot_is_switched_off_until_reset(hand):
    hand.wait_for_rest()
    hand.say("CONF vibration,FORW,EFF,1,1000000,1000000", "ARM", "TRIG 1")
    assert hand.standing().state == "FIRING"
    hand.chip.fail(7)
    while (standing := hand.standing()).state == "FIRING":
        time.sleep(0.001)
    assert (standing.state, standing.fault, hand.shot().ending) == ("FAULT", 7, "CUT")
    hand.say("ARM", "*RST")
    assert [hand.ask("SYST:ERR?") for _ in range(2)] == [message(110)] * 2
    assert hand.standing().state == "DISARMED"
    assert agree(hand)


def test_a_pulse_that_the_board_begins_4_ms_late_is_told_as_cut_with_its_true_start(hand):
    hand.wait_for_rest()
    hand.say("CONF a,FORW,PULS,16000,10000,211000", "ARM")
    hand.standing()
    hand.chip.be_late(4)
    hand.say("TRIG 5")
    hand.wait_for_ending("CUT")
    shot = hand.shot()
    assert (shot.start_us - shot.accepted_us, shot.end_us - shot.accepted_us) == (4_000, 10_000)
    assert [call.due_us for call in hand.chip.drives()] == [shot.start_us, shot.end_us + 4_000]
    assert agree(hand)


def test_a_pulse_that_the_board_would_begin_after_its_end_is_told_as_never_begun_and_fired_when_asked_again(hand):
    hand.wait_for_rest()
    hand.say("CONF a,FORW,PULS,16000,10000,211000", "ARM")
    hand.standing()
    hand.chip.be_late(12)
    hand.say("TRIG 5")
    hand.wait_for_ending("NONE")
    assert (hand.ask("SYST:ERR?"), hand.shot().count, hand.chip.drives()) == (message(107), 0, [])
    hand.chip.be_late(0)
    hand.say("TRIG 5")
    hand.wait_until_driven()
    assert hand.shot().count == 1
    assert agree(hand)


@pytest.mark.parametrize(
    "setting", ["a,FORW,PULS,24001,10000,211000", "a,FORW,PULS,16000,20001,211000", "a,FORW,PULS,16000,10000,49999"]
)
def test_a_setting_beyond_the_limits_is_refused_and_nothing_driven(hand, setting):
    hand.wait_for_rest()
    hand.say(f"CONF {setting}", "ARM", "TRIG")
    assert [hand.ask("SYST:ERR?") for _ in range(2)] == [message(-222), message(106)]
    assert hand.chip.drives() == []


def test_a_shot_before_the_magnet_is_home_is_refused(hand):
    hand.wait_for_rest()
    hand.say("CONF a,FORW,PULS,24000,20000,5000000", "ARM", "TRIG")
    hand.wait_until_driven()
    hand.say("TRIG")
    assert hand.ask("SYST:ERR?") == message(102)
    assert agree(hand)


def test_a_sixth_pulse_in_a_second_that_is_full_is_refused(hand):
    """As fast as this machine is; where it is away for long, the next five may fill a second."""
    hand.wait_for_rest()
    hand.say("CONF a,FORW,PULS,24000,20000,50000", "ARM")
    errors = list[str]()

    def refused() -> bool:
        hand.wait_for_rest()
        hand.say("TRIG")
        errors.append(hand.ask("SYST:ERR?"))
        hand.wait_until_driven()
        return errors[-1] != message(0)

    wait_for(refused)
    starts = [call.due_us for call in hand.chip.drives() if "PULS" in call.text]
    assert errors[-1] == message(103)
    assert starts[-1] - starts[-5] < 1_000_000
    assert agree(hand)
