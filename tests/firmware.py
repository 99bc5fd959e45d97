"""The firmware, built once for all tests."""

from __future__ import annotations

import fcntl
import json
import os
import re
import select
import shutil
import subprocess
import time
import tty
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

import pytest
import serial

from device.serial_gun.reports import WAYS
from device.twin.core import IDENTITY
from device.twin.machine import LATE_PULSE_US
from device.wire.records import LAST_NUMBER, Frame, ShotRecord, StatusRecord, encode
from experiments.record.journal import read_journal
from tests import warm_start
from tests.conftest import Recoil
from tests.serial_runs import rows, timings_of
from tests.twin_scripts import random_script, transcript
from tests.waiting import PATIENCE_S, wait_for

ROOT = Path(__file__).parent.parent
EMULATOR = "qemu-system-arm"
COMPILERS = {"host": "cc", "chip": "arm-none-eabi-gcc"}


@cache
def built(which: str) -> Path:
    """The folder of what `scripts/firmware` builds; the test is left out where a program for it is missing."""
    for program in [COMPILERS[which]] + [EMULATOR] * (which == "chip"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed; scripts/system-packages installs it")
    folder = Path(os.environ[warm_start.FOLDER]) / f"firmware-{which}"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another worker may be building it
        if not (folder / "built").exists():
            subprocess.run([ROOT / "scripts" / "firmware", f"--{which}", folder], check=True)
            (folder / "built").touch()
    return folder


def command(core: str) -> list[str]:
    """The program that turns scripts into transcripts by this core."""
    if core == "host":
        return [str(built("host") / "filter")]
    image = str(built("chip") / "filter.elf")
    quiet = ["-display", "none", "-monitor", "none", "-serial", "none"]
    return [EMULATOR, "-M", "netduinoplus2", "-kernel", image, *quiet, "-semihosting-config", "enable=on,target=native"]


def told(core: str, script: Iterable[str]) -> list[str]:
    """A core's transcript of a script."""
    if core == "twin":
        return list(transcript(script))
    text = "".join(f"{line}\n" for line in script)
    return subprocess.run(
        command(core), input=text, capture_output=True, text=True, check=True, timeout=PATIENCE_S
    ).stdout.splitlines()


def one_after_the_other(seeds: Iterable[int]) -> Iterator[str]:
    """Random scripts as one: each begins with a gun that boots at 0."""
    for seed in seeds:
        yield "reset 0"
        yield from random_script(seed)


CORES = ("host", "chip")


NAME = re.compile(rb"QEMU-1")
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

    def standing(self) -> StatusRecord:
        return StatusRecord.parse(self.ask("STAT?"))

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


PULSE, EFFECT = "CONF a,FORW,PULS,16000,10000,211000", "CONF v,FORW,EFF,47,24000,50000"
LEAST_WATCHDOG_US, MOST_WATCHDOG_US = 36_000, 101_000
"""425 ticks of LSI / 4, whose frequency the data sheet (DS10693) gives as 17 to 47 kHz."""
BUSES = ("absent", "error", "low", "sb", "addr", "txe", "btf", "stop")
"""No driver, a bus error, the clock held low; where a transfer hangs (RM0390, "Transfer sequence diagram for master
transmitter")."""


class Run:
    """What was seen from outside of a run of the chip, in microseconds since power came on."""

    def __init__(self, *script: str) -> None:
        ordered = sorted(script, key=lambda line: int(line.split()[0]))
        text = "".join(f"{line}\n" for line in [*ordered, "9000000 end"])
        program = built("host") / "fake-f446"
        done = subprocess.run([program], input=text, capture_output=True, text=True, check=True, timeout=600)
        self.lines = [(int(time), words) for time, words in (line.split(" ", 1) for line in done.stdout.splitlines())]

    def times(self, begin: str) -> list[int]:
        return [time for time, words in self.lines if words.startswith(begin)]

    def said(self, begin: str = "") -> list[str]:
        return [words[5:] for _, words in self.lines if words.startswith(f"says {begin}")]

    @property
    def shots(self) -> list[ShotRecord]:
        return [ShotRecord.parse(text) for text in self.said("SHOT ")]

    @property
    def standing(self) -> StatusRecord:
        return StatusRecord.parse(self.said("STAT ")[-1])

    @property
    def seen(self) -> list[str]:
        """All but what it said and how it went."""
        return [words for _, words in self.lines[:-2] if not words.startswith("says ")]

    @property
    def longest_unfed_us(self) -> int:
        return int(re.fullmatch(r"longest between two feeds of the watchdog: (\d+) us", self.lines[-1][1])[1])


def say(time_us: int, *lines: str) -> list[str]:
    """Lines of a hand at a terminal, 1 ms apart."""
    return [f"{time_us + 1_000 * number} say {line}" for number, line in enumerate(lines)]


def well(run: Run) -> bool:
    """The chip ran to the end of the script, and no rule of the manual was broken."""
    return run.lines[-2][1] == "end" and not run.times("broken rule")


def dead_bus(bus: str) -> list[str]:
    """An effect on a bus that is dead, and another when it is well again."""
    return [
        f"1000000 bus {bus}",
        *say(1_100_000, EFFECT, "ARM", "TRIG 5"),
        *say(1_200_000, "SHOT?", "STAT?", "SYST:ERR?", "SYST:ERR?"),
        "1300000 bus good",
        *say(1_400_000, "*RST", EFFECT.replace("47", "48"), "ARM", "TRIG 5"),
        *say(1_500_000, "SHOT?"),
    ]


EVERY_US = 400_000


def mishaps(draw: Random, time_us: int) -> list[str]:
    """What befalls the chip around a shot, and is over before the next."""
    around_us = time_us + draw.randrange(-5_000, 30_000)
    return draw.choice(
        (
            [],
            [f"{around_us} stall {draw.randrange(30_000)}"],
            [f"{around_us} bus {draw.choice(BUSES)}", f"{time_us + 150_000} bus good"],
            [f"{around_us} held {draw.randrange(1, 9)}"],
            [f"{around_us} coil-fault 1", f"{around_us + 20_000} coil-fault 0"],
            [f"{around_us} say ABOR"],
        )
    )


def chances(seed: int, shots: int) -> list[str]:
    """Shots of both kinds, each asked for ahead of its time, with what befalls them, and then asked about."""
    draw, script = Random(seed), []
    for mark in range(1, shots + 1):
        time_us = 1_000_000 + EVERY_US * mark
        script += say(time_us - 60_000, "*RST", draw.choice((PULSE, EFFECT)), "ARM", f"TRIG {mark},{time_us}")
        script += [*mishaps(draw, time_us), *say(time_us + 200_000, "SHOT?")]
    return script


def lasted_us(run: Run, begin: str, end: str, asked_us: int) -> int:
    """How long something lasted in the time before a shot was asked about; 0 if it was not."""
    ons, offs = ([time for time in run.times(words) if asked_us - EVERY_US < time < asked_us] for words in (begin, end))
    return min(time for time in offs if time > ons[0]) - ons[0] if ons else 0


def check_records(run: Run) -> int:
    """Every record is what the coil saw. How many shots were less than whole."""
    assert well(run)
    assert run.longest_unfed_us < LEAST_WATCHDOG_US
    for asked_us, shot in zip(run.times("says SHOT"), run.shots, strict=True):
        if shot.setting.kind == "EFF":
            continue
        coil_us = lasted_us(run, "coil on", "coil off", asked_us)
        told_us = 0 if shot.ending == "NONE" else shot.end_us - shot.start_us
        assert coil_us == pytest.approx(told_us, abs=LATE_PULSE_US + 10), shot
        assert (shot.ending == "DONE") == (told_us == shot.setting.length_us)
    return sum(shot.ending != "DONE" for shot in run.shots)


FAST = 10


def logs_of(recoil: Recoil, folder: Path, config: Path, gun: str) -> tuple[list[dict[str, str]], list[dict]]:
    """A run's table but for times and for how many shots a train had time for, and how each shot came about."""
    words = ("--participant", "P01", "--screen", "synthetic", "--seed", 3, "--json", "--results", folder)
    done = recoil("run", config, *words, "--gun", gun)
    while "Go on with --resume" in done.stderr:  # a busy machine heard the gun too late, three times in a row
        done = recoil("run", config, *words, "--gun", gun, "--resume")
    assert done.returncode == 0, done.stderr
    paths = {key: config.parent.parent / path for key, path in json.loads(done.stdout).items()}
    table = [{key: cell for key, cell in row.items() if key != "shots"} for row in rows(paths["table"])]
    return table, timings_of(read_journal(paths["journal"]))


def driven(chip: Emulated) -> list[int]:
    """When the chip says that something was begun to be driven."""
    return [call.due_us for call in chip.drives() if not call.text.endswith("OFF")]


def as_on_the_simulated_gun(recoil: Recoil, config: Path, speed: int) -> int:
    """The logs of a chip that lives so many times faster than the world are the same but for times.

    Every shot in them was driven, once, when they say. How many. Where a busy machine heard the gun too late, the trial
    is marked and was presented again: its first shot, if there was one, is driven and not in the logs, but for how long
    it was felt.
    """
    simulated, _ = logs_of(recoil, Path("simulated"), config, "simulated")
    with emulated(config.parent.parent, "gun-qemu.elf" if speed == 1 else f"gun-qemu-{speed}.elf") as chip:
        emulated_rows, timings = logs_of(recoil, Path("emulated"), config, f"serial:{chip.port}?speed={speed}")
        starts, settings = driven(chip), settings_in_force(chip)
    late = [row for row in emulated_rows if "device-error" in row["flags"]]
    of_repeats = {"flags", "earlier_exposure_s"}
    assert [{key: "" if key in of_repeats else row[key] for key in row} for row in emulated_rows] == simulated
    assert {row["flags"] for row in emulated_rows} <= {"", "device-error", "device-error interrupted"}
    told = [timing["gun_start_us"] for timing in timings]
    assert (starts == told) if not late else (set(told) <= set(starts))
    if config.stem == "direction" and not late:
        assert [call.split(",")[1] for call in settings] == [WAYS[row["direction"]] for row in simulated]
    return len(starts)


def settings_in_force(chip: Emulated) -> list[str]:
    """The setting of each shot: the last CONF before its TRIG, among what the core was given.

    On a busy machine a trigger may come too late, and is written again with its mark: it is one shot.
    """
    found, setting = {}, ""
    for call in chip.calls():
        text = bytes.fromhex(call.split()[2]).decode("latin-1") if call.startswith("in ") else ""
        setting = text if " CONF " in text else setting
        if trigger := re.search(r" TRIG (\d+)", text):
            found[trigger[1]] = setting
    return [*found.values()]
