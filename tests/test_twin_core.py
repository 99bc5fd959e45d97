"""The gun's core, as `PROTOCOL.md` says it: by hand, in frames, in its states, and left alone."""

import os
import socket
from pathlib import Path

import pytest

from device.twin.core import Core
from device.twin.machine import REFUSED, DriveEvent
from device.twin.sockets import Pty
from device.wire.records import Frame, ShotRecord, decode, encode, following, refusal_in
from tests.twin_hosts import PULSE, READY, Hand, Strict
from tests.twins import a_twin
from tests.waiting import PATIENCE_S


@pytest.fixture
def hand():
    hand = Hand()
    assert hand.say(PULSE, READY) == hand.say("ARM") == []
    return hand


@pytest.fixture
def strict():
    strict = Strict()
    assert strict.say(PULSE, READY) == strict.say("ARM") == ["OK"]
    return strict


def test_it_boots_disarmed_plain_and_silent():
    hand = Hand()
    assert hand.say("") == []
    assert hand.say("*IDN?\r") == ["Recoil,haptic-gun,TWIN-1,wire 1 firmware 1.1.0"]
    assert hand.standing().state == "DISARMED"
    assert (hand.error(), hand.say("TRIG"), hand.error()) == ('0,"No error"', [], '101,"Disarmed"')


def test_a_shot_by_hand_is_driven_to_the_microsecond_and_kept(hand):
    assert hand.say("TRIG 5", 17) == []
    assert hand.say("", 50_000) == []
    start = READY + 17
    assert hand.drives == [
        DriveEvent(time_us=start, kind="PULS", amount=16_000, end_us=start + 10_000),
        DriveEvent(time_us=start + 10_000, kind="OFF", end_us=start + 10_000),
    ]
    assert hand.say("SHOT?") == [
        f"SHOT 1,5,DONE,{start},{start},{start + 10_000},{start + 211_000},asymmetric-1,FORW,PULS,16000,10000,211000"
    ]
    assert hand.standing().state == "RESETTING"


def test_a_trigger_in_a_frame_is_answered_when_the_shot_has_ended(strict):
    assert strict.say("TRIG 9") == []
    assert strict.say("TIME?", 9_999) == [f"TIME {READY + 9_999}"]
    (answer,) = strict.say("", 1)
    assert ShotRecord.parse(answer).ending == "DONE"


def test_a_shot_waits_for_its_tick(strict):
    assert strict.say(f"TRIG 9,{READY + 5_000}") == []
    assert strict.standing().state == "WAITING"
    assert strict.drives == []
    strict.say("", 100_000)
    assert [drive.time_us for drive in strict.drives] == [READY + 5_000, READY + 15_000]


def test_a_train_refires_at_its_rest_and_not_a_tick_sooner(hand):
    for shot in range(12):
        hand.say("TRIG")
        assert hand.error() == '0,"No error"', shot
        hand.say("TRIG", 210_999)
        assert hand.error() == '102,"Magnet not home"'
        hand.say("", 1)
    assert [drive.time_us for drive in hand.drives[::2]] == [READY + 211_000 * shot for shot in range(12)]


def test_a_mark_is_never_fired_twice(hand):
    for _ in range(3):
        hand.say("TRIG 4", 300_000)
    assert hand.shot().count == 1
    assert hand.error() == hand.error() == '113,"Already fired"'


def test_a_late_trigger_does_not_fire(strict):
    assert strict.say(f"TRIG 3,0,{READY + 10}", 11) == ['ERR 107,"Too late"']
    assert strict.drives == []


def test_abort_cuts_a_pulse_and_disarms(strict):
    strict.say("TRIG 3")
    shot, done = strict.say("ABOR", 4_000)
    found = ShotRecord.parse(shot)
    assert (done, found.ending, found.end_us - found.start_us) == ("OK", "CUT", 4_000)
    assert strict.drives[-1] == DriveEvent(time_us=READY + 4_000, kind="OFF", end_us=READY + 4_000)
    assert strict.standing().state == "DISARMED"


def test_abort_cancels_a_shot_that_waits(strict):
    strict.say(f"TRIG 3,{READY + 5_000}")
    assert strict.say("ABOR") == ['ERR 112,"Cancelled"', "OK"]
    assert strict.say("", 10_000) == []
    assert strict.drives == []


@pytest.mark.parametrize("strict_mode", [False, True])
def test_left_alone_it_disarms_at_its_watchdogs_time(strict_mode):
    gun = Strict() if strict_mode else Hand()
    gun.say(PULSE, READY // 2)
    gun.say("SYST:WATC 500")
    gun.say("ARM")
    armed_us = gun.now_us
    assert gun.core.wake_us() == armed_us + 500_000
    gun.core.step(b"", armed_us + 499_999)
    assert gun.core.machine.state == "ARMED"
    gun.core.step(b"", armed_us + 500_000)
    assert gun.core.machine.state == "DISARMED"
    assert not gun.core.strict
    out, _ = gun.core.step(b"SYST:ERR?\n", armed_us + 500_000)
    assert out == b'109,"Watchdog"\n'


def test_the_watchdog_cuts_a_pulse_even_when_it_is_called_late():
    gun = Strict()
    gun.say(PULSE, READY)
    gun.say("SYST:WATC 100")
    gun.say("ARM")
    gun.say(f"TRIG 1,{gun.now_us + 95_000}")
    gun.say("", 5_000_000)
    assert [drive.kind for drive in gun.drives] == ["PULS", "OFF"]
    assert gun.drives[1].time_us - gun.drives[0].time_us == 5_000
    assert gun.core.machine.shot.ending == "CUT"


def test_noise_does_not_feed_the_watchdog(strict):
    strict.say("SYST:WATC 100")
    for _ in range(20):
        assert set(strict.send(b">0001 noise\n")) <= {"NAK"}
        strict.now_us += 10_000
    assert strict.core.machine.state == "DISARMED"


def test_a_doubled_or_older_frame_does_nothing(strict):
    line = encode(Frame(number=following(strict.number), body="TRIG"), "host")
    assert strict.send(line + line) == []
    assert len(strict.send(b"")) == 0
    strict.now_us += 300_000
    assert len(strict.send(b"")) == 1
    assert strict.send(line) == []
    assert strict.core.machine.shot.count == 1


@pytest.mark.parametrize("body", ["ARM", "SYST:STRI 8", "SYST:PLAI"])
@pytest.mark.parametrize("in_session", [False, True])
def test_a_frame_with_the_number_0000_is_no_frame(body, in_session):
    gun = Strict() if in_session else Hand()
    out, _ = gun.core.step(encode(Frame(number=0, body=body), "host"), gun.now_us)
    assert decode(out.strip(), "gun") == Frame(number=0, body="NAK")
    assert gun.core.machine.state == "DISARMED"
    assert gun.core.strict == in_session


def test_frames_without_a_session_are_told_so_and_a_new_session_tells_the_token_before(strict):
    assert strict.say("SYST:STRI 8") == ["STRI 7"]
    assert strict.standing().state == "DISARMED"
    assert strict.say("SYST:PLAI") == ["OK"]
    assert strict.say("ARM") == ['ERR 111,"No session"']
    strict.core = Core(now_us=strict.now_us)
    assert strict.say("SYST:STRI 9") == ["STRI 0"]


def test_a_gun_in_the_strict_mode_still_says_who_it_is(strict):
    out, _ = strict.core.step(b"*IDN?\nARM\n", strict.now_us)
    assert out.splitlines()[0].startswith(b"Recoil,")
    assert decode(out.splitlines()[1], "gun").body == "NAK"


def test_a_driver_fault_cuts_and_stays_until_reset(strict):
    strict.say("TRIG 1")
    out, drives = strict.core.fail(3, strict.now_us + 2_000)
    strict.now_us += 2_000
    assert drives == [DriveEvent(time_us=READY + 2_000, kind="OFF", end_us=READY + 2_000)]
    assert ShotRecord.parse(decode(out.strip(), "gun").body).ending == "CUT"
    assert (strict.standing().state, strict.standing().fault) == ("FAULT", 3)
    for text in ("ARM", "TRIG"):
        assert strict.say(text) == ['ERR 110,"Driver fault"']
    assert strict.say("ABOR") == ["OK"]
    assert strict.standing().state == "FAULT"
    assert strict.say("*RST") == ["OK"]
    assert strict.standing().state == "DISARMED"


@pytest.mark.parametrize(("command", "state"), REFUSED)
def test_the_table_of_states_is_kept(command, state):
    gun = Strict()
    gun.say(PULSE, READY)
    ways = {
        "DISARMED": [],
        "WAITING": ["ARM", f"TRIG 1,{READY + 50_000}"],
        "FIRING": ["ARM", "TRIG 1"],
        "FAULT": [],
    }
    for text in ways[state]:
        gun.say(text)
    if state == "FAULT":
        gun.core.fail(1, gun.now_us)
    assert gun.standing().state == state
    (answer,) = gun.say({"CONF": PULSE, "ARM": "ARM", "TRIG": "TRIG 2"}[command])
    assert refusal_in(answer)[0] == REFUSED[command, state]
    assert gun.standing().state == state


@pytest.mark.parametrize(
    "text",
    [
        "CONF a,FORW,PULS,24001,10000,211000",
        "CONF a,FORW,PULS,16000,20001,211000",
        "CONF a,FORW,PULS,16000,10000,49999",
        "CONF a,FORW,PULS,16000,10000,10000001",
        "CONF a,FORW,EFF,0,24000,24000",
        "CONF a,FORW,EFF,124,24000,24000",
        "CONF a,FORW,EFF,1,24000,23999",
        "SYST:WATC 99",
        "SYST:WATC 60001",
    ],
)
def test_what_is_beyond_a_range_is_refused_and_changes_nothing(strict, text):
    assert strict.say(text) == ['ERR -222,"Data out of range"']
    assert strict.say("CONF?") == [PULSE]
    assert strict.say("SYST:WATC?") == ["WATC 30000"]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("FOO", -113),
        ("FOO x", -113),
        ("arm", -113),
        ("ARM 1", -108),
        ("TRIG x", -104),
        ("TRIG -1", -104),
        ("TRIG 01", -104),
        ("TRIG 1,2,3,4", -108),
        ("SYST:WATC", -109),
        ("CONF", -109),
        ("CONF a", -104),
        ("CONF A,FORW,PULS,1,1,60000", -104),
    ],
)
def test_what_is_no_command_is_refused_by_its_number(strict, text, code):
    assert [refusal_in(answer)[0] for answer in strict.say(text)] == [code]


def test_a_link_that_cannot_be_made_is_named_as_it_was_asked_for(tmp_path: Path) -> None:
    line = Pty(tmp_path / "nowhere" / "gun")
    with pytest.raises(OSError, match=f"^{tmp_path / 'nowhere' / 'gun'}: No such file or directory$"):
        line.plug()
    line.unplug()


def test_a_file_where_the_link_is_to_be_is_refused_and_kept(tmp_path: Path) -> None:
    precious = tmp_path / "journal.jsonl"
    precious.write_bytes(b"kept")
    line = Pty(precious)
    with pytest.raises(FileExistsError, match="is no link"):
        line.plug()
    line.unplug()
    assert precious.read_bytes() == b"kept"


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")
def test_a_link_that_a_killed_twin_has_left_is_taken_over_whoever_has_its_terminal_now(tmp_path: Path) -> None:
    gun, other = os.openpty()
    for left in (os.ttyname(other), "/dev/pts/nobody"):
        (tmp_path / "gun").symlink_to(left)
        line = Pty(tmp_path / "gun")
        line.plug()
        assert str((tmp_path / "gun").readlink()) not in (left, "")
        line.unplug()
    os.close(gun)
    os.close(other)


def test_what_a_host_on_tcp_has_half_said_or_was_to_be_told_is_nothing_to_the_next(tmp_path: Path) -> None:
    with a_twin(tmp_path, tcp=True) as (_, plug):
        place = plug.address.removeprefix("socket://").split(":")

        def host() -> socket.socket:
            return socket.create_connection((place[0], int(place[1])), timeout=PATIENCE_S)

        with host() as first:
            first.sendall(b"*IDN?\n" * 300 + f"{PULSE}\nAR".encode())
        with host() as second:
            second.sendall(b"M\nSTAT?\n")
            assert second.makefile("rb").readline().startswith(b"STAT DISARMED")
        with host() as third:
            third.sendall(b"TRI")
        with host() as fourth:
            fourth.sendall(b"*IDN?\n")
            assert fourth.makefile("rb").readline().startswith(b"Recoil,haptic-gun")
