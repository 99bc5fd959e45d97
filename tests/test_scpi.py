"""What SCPI's own programs ask of any instrument: complete, events, self-test, version; and pyvisa drives the gun.

The twin and the firmware on the emulated chip are driven by the same program, through pyvisa-py.
"""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import pyvisa
from pyvisa.resources import MessageBasedResource

from device.wire.errors import message
from tests.firmware import emulated
from tests.twin_hosts import PULSE, READY, Hand, Strict
from tests.twins import a_twin
from tests.waiting import wait_for

COMPLETE, DEVICE, EXECUTION, COMMAND, POWER_ON = 1, 8, 16, 32, 128
"""IEEE 488.2-1992, figure 11-6."""

DRIVER = Path(__file__).parent.parent / "docs/howto/driver.md"


@pytest.fixture
def hand():
    hand = Hand()
    hand.say("*CLS")
    hand.say(PULSE)
    hand.say("ARM", READY)
    return hand


@pytest.fixture
def host():
    host = Strict()
    host.say(PULSE)
    host.say("ARM", READY)
    return host


def events(hand: Hand) -> int:
    return int(hand.say("*ESR?")[0])


def test_a_gun_that_was_switched_on_says_so_once():
    hand = Hand()
    assert [events(hand), events(hand)] == [POWER_ON, 0]


@pytest.mark.parametrize(
    ("line", "number", "event"),
    [
        ("FOO", -113, COMMAND),
        ("TRIG x", -104, COMMAND),
        ("*ESR? 1", -108, COMMAND),
        ("SYST:WATC", -109, COMMAND),
        ("CONF asymmetric-1,FORW,PULS,24001,10000,211000", -222, EXECUTION),
        ("A" * 201, -363, DEVICE),
    ],
)
def test_each_error_that_is_queued_sets_the_bit_of_its_kind(hand, line, number, event):
    hand.say(line)
    assert (events(hand), events(hand), hand.error()) == (event, 0, message(number))


def test_a_full_queue_is_an_event_of_the_device_and_cls_forgets_all(hand):
    for _ in range(17):
        hand.say("FOO")
    assert events(hand) == COMMAND | DEVICE
    hand.say("FOO")
    hand.say("*CLS")
    assert (events(hand), hand.error()) == (0, message(0))


def test_errors_that_are_answered_in_frames_are_no_events_but_a_fault_is_one(host):
    host.say("*CLS")
    host.say("FOO")
    assert host.say("*ESR?") == ["0"]
    host.core.fail(3, host.now_us)
    assert (host.say("*ESR?"), host.say("*TST?")) == ([f"{DEVICE}"], ["3"])


def test_the_self_test_drives_nothing_and_passes_on_a_gun_without_a_fault(hand):
    before = len(hand.drives)
    assert (hand.say("*TST?"), len(hand.drives)) == (["0"], before)
    assert hand.say("SYST:VERS?") == ["1999.0"]


def test_complete_is_answered_when_the_shot_has_ended_and_meanwhile_everything_else_is(hand):
    assert hand.say("*OPC?") == ["1"]
    hand.say("TRIG 1")
    assert hand.say("*OPC?") == []
    assert hand.say("STAT?", 9_999)[0].startswith("STAT FIRING")
    assert hand.say("", 1) == ["1"]
    assert hand.shot().ending == "DONE"


def test_complete_is_an_event_as_well_and_cls_calls_it_off(hand):
    hand.say("*OPC")
    assert events(hand) == COMPLETE
    hand.say("TRIG 1")
    hand.say("*OPC")
    assert events(hand) == 0
    hand.say("", 10_000)
    assert events(hand) == COMPLETE
    hand.say("TRIG 2", 300_000)
    for line in ("*OPC", "*CLS"):
        hand.say(line)
    hand.say("", 10_000)
    assert events(hand) == 0


def test_a_second_question_while_one_waits_is_refused(hand):
    hand.say("TRIG 1")
    assert (hand.say("*OPC?"), hand.say("*OPC?"), hand.error()) == ([], [], message(108))
    assert hand.say("", 10_000) == ["1"]


@pytest.mark.parametrize("end", ["ABOR", "*RST"])
def test_a_shot_that_is_called_off_is_complete(hand, end):
    hand.say(f"TRIG 1,{hand.now_us + 500_000}")
    hand.say("*OPC?")
    assert hand.say(end) == ["1"]


def test_in_frames_complete_comes_behind_the_shots_record_and_a_new_session_forgets_it(host):
    host.say("TRIG 1")
    assert host.say("*OPC?") == []
    shot, complete = host.say("", 10_000)
    assert (shot.split(",")[2], complete) == ("DONE", "1")
    host.say(f"TRIG 2,{host.now_us + 500_000}")
    host.say("*OPC?")
    assert host.say("SYST:STRI 8") == ["STRI 7"]
    assert host.say("", 600_000) == []


def test_the_watchdog_answers_what_waits_before_the_mode_is_plain(host):
    host.say("SYST:WATC 100")
    host.say(f"TRIG 2,{host.now_us + 500_000}")
    host.say("*OPC?")
    assert host.say("", 100_000) == [f"ERR {message(112)}", "1"]


# pyvisa


@contextmanager
def instrument(address: str) -> Iterator[MessageBasedResource]:
    manager = pyvisa.ResourceManager("@py")
    try:
        gun = manager.open_resource(address, read_termination="\n", write_termination="\n", timeout=10_000)
        assert isinstance(gun, MessageBasedResource)
        yield gun
    finally:
        manager.close()


def visa_error(gun: MessageBasedResource) -> tuple[str, int]:
    """The oldest error, and the events since they were asked for."""
    return gun.query("SYST:ERR?"), int(gun.query("*ESR?"))


def a_session(gun: MessageBasedResource) -> None:
    """What a laboratory's own program does: look, configure, be refused, fire, wait, read, leave it safe."""
    maker, model, *_ = gun.query("*IDN?").split(",")
    assert (maker, model) == ("Recoil", "haptic-gun")
    gun.write("*RST")
    gun.write("*CLS")
    assert (gun.query("*TST?"), gun.query("SYST:VERS?")) == ("0", "1999.0")
    gun.write("CONF asymmetric-1,FORW,PULS,24001,10000,211000")
    assert visa_error(gun) == (message(-222), EXECUTION)
    gun.write("CONFIGURE")
    assert visa_error(gun) == (message(-113), COMMAND)
    gun.write(PULSE)
    assert gun.query("CONF?") == PULSE
    gun.write("TRIG 1")
    assert visa_error(gun) == (message(101), DEVICE)
    gun.write("ARM")
    wait_for(lambda: gun.query("STAT?").startswith("STAT ARMED"))
    gun.write("TRIG 1")
    assert gun.query("*OPC?") == "1"
    assert gun.query("SHOT?").startswith("SHOT 1,1,DONE,")
    gun.write("*OPC")
    assert visa_error(gun) == (message(0), COMPLETE)
    gun.write("ABOR")
    assert gun.query("STAT?").startswith("STAT DISARMED,1,")


@pytest.mark.slow
@pytest.mark.parametrize("tcp", [False, True], ids=["line", "TCP"])
def test_pyvisa_drives_the_twin(tmp_path: Path, tcp: bool) -> None:
    with a_twin(tmp_path, speed=1.0, tcp=tcp, rested=True) as (_, socket):
        port = socket.address.rpartition(":")[2]
        with instrument(f"TCPIP::127.0.0.1::{port}::SOCKET" if tcp else f"ASRL{socket.address}::INSTR") as gun:
            a_session(gun)


@pytest.mark.slow
def test_the_program_of_the_page_fires_whenever_it_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (program,) = re.findall(r"```python hardware\n(.*?)```", DRIVER.read_text(encoding="utf-8"), re.DOTALL)
    with a_twin(tmp_path, speed=1.0, tcp=True, rested=True) as (_, socket):
        script = tmp_path / "program.py"
        script.write_text(program.replace("5025", socket.address.rpartition(":")[2]), encoding="utf-8")
        runpy.run_path(str(script))
        runpy.run_path(str(script))
    said = capsys.readouterr().out.splitlines()
    assert [line.split(",")[0::2][:2] for line in said if line.startswith("SHOT")] == [
        ["SHOT 1", "DONE"],
        ["SHOT 2", "DONE"],
    ]
    assert said.count('0,"No error"') == 2


@pytest.mark.parametrize("line", ["*esr?", "SYSTEM:VERSION?", "*IDN?;*OPC?"])
def test_commands_are_taken_in_short_capitals_one_a_line(hand: Hand, line: str) -> None:
    hand.say(line)
    assert hand.say("SYST:ERR?") == [message(-113)]


def test_the_last_shot_s_name_outlives_a_reset_and_none_always_fires(hand: Hand) -> None:
    hand.say("TRIG 1")
    for line in ("*RST", PULSE):
        hand.say(line, 300_000)
    hand.say("ARM", READY)
    hand.say("TRIG 1")
    assert hand.say("SYST:ERR?") == [message(113)]
    hand.say("TRIG")
    assert hand.say("SYST:ERR?") == [message(0)]


@pytest.mark.slow
def test_pyvisa_drives_the_firmware(tmp_path: Path) -> None:
    with emulated(tmp_path) as chip, instrument(f"ASRL{chip.port}::INSTR") as gun:
        a_session(gun)
