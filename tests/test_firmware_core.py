"""The firmware's core in C says and does what the twin does: compiled for this machine, and for the emulated chip.

Scripts and transcripts are those of `tests.twin_scripts`; the times are the scripts', so nothing needs to be masked.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterable
from math import exp

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from device.wire.errors import WireError, message
from device.wire.records import Frame, encode
from tests.firmware import CORES, built, one_after_the_other, told
from tests.twin_scripts import TELLING_SEEDS, transcript


def differences(core: str, script: list[str]) -> list[tuple[str, str]]:
    """Where a core's transcript differs from the twin's, as far as both go."""
    found, expected = told(core, script), list(transcript(script))
    length = [] if len(found) == len(expected) else [(f"{len(expected)} lines", f"{len(found)} lines")]
    return [pair for pair in zip(expected, found, strict=False) if pair[0] != pair[1]] + length


def said(lines: Iterable[str]) -> str:
    """The bytes of a transcript as text."""
    return "".join(bytes.fromhex(line.split()[2]).decode() for line in lines if line.startswith("out "))


def by_hand(*lines: tuple[int, str]) -> list[str]:
    return [f"in {time_us} {text.encode().hex().upper()}0A" for time_us, text in lines]


pytestmark = pytest.mark.slow  # the firmware has to be built
ALL = ("twin", *CORES)


@pytest.fixture(scope="module")
def scripts():
    """Random scripts as one, and what the twin says to it."""
    script = list(one_after_the_other(TELLING_SEEDS))
    return script, list(transcript(script))


@pytest.mark.parametrize("core", CORES)
def test_random_scripts_have_the_twins_transcript(core, scripts):
    script, expected = scripts
    assert told(core, script) == expected


def test_these_scripts_meet_every_error_that_the_gun_knows(scripts):
    answers = said(scripts[1])
    assert {code for code in WireError if message(code) in answers} == set(WireError) - {
        WireError.QUEUE_OVERFLOW
    }  # the next


@pytest.mark.parametrize("core", CORES)
def test_the_last_place_of_a_full_queue_tells_of_the_overflow(core):
    script = by_hand(*[(0, "FOO")] * 15, (0, "TRIG"), (0, "FOO"), *[(1, "SYST:ERR?")] * 18)
    assert differences(core, script) == []
    assert said(told(core, script)).splitlines()[14:] == [message(code) for code in (-113, -350, 0, 0)]


CALLS = st.tuples(
    st.sampled_from((0, 0, 1, 999, 50_000, 211_000, 1_000_000, 30_000_000)),
    st.one_of(
        st.binary(max_size=250),
        st.text("ARMTRIGCONF?*,:~>0129 \r\n", max_size=40).map(str.encode),
        st.sampled_from((b"\n", b"\r\n", b"\r\r\n", b"*IDN?\n", b"*IDN?\r\n", b"ARM\n", b"TRIG 1,2,3\nSTAT?\n")),
        st.builds(
            lambda number, body: encode(Frame(number=number, body=body), "host"),
            st.sampled_from((0, 1, 2, 3, 0x7FFF, 0x8000, 0x8001, 0xFFFE, 0xFFFF)),
            st.sampled_from(("SYST:STRI 7", "SYST:STRI 07", "ARM", "TRIG", "TIME?", "SYST:PLAI", "~", "A" * 185)),
        ),
    ),
)


@settings(max_examples=100)
@given(calls=st.lists(CALLS, max_size=20))
def test_whatever_bytes_come_the_core_in_c_says_what_the_twin_says(calls):
    time_us, script = 0, []
    for gap_us, data in calls:
        time_us += gap_us
        script.append(f"in {time_us} {data.hex().upper()}")
    assert differences("host", script) == []


@pytest.mark.parametrize("core", CORES)
def test_a_frame_with_the_number_0000_is_answered_as_no_frame(core):
    script = [f"in {time_us} {encode(Frame(number=0, body='SYST:STRI 8'), 'host').hex().upper()}" for time_us in (1, 2)]
    script.insert(1, f"in 1 {encode(Frame(number=1, body='SYST:STRI 7'), 'host').hex().upper()}")
    nak, entered = (
        encode(Frame(number=number, body=body), "gun").decode() for number, body in ((0, "NAK"), (1, "STRI 0"))
    )
    assert said(told(core, script)) == nak + entered + nak


def errors_after(core: str, lines: list[tuple[int, str]]) -> list[str]:
    end_us = lines[-1][0] + 1_000_000
    script = by_hand(*lines, *[(end_us, "SYST:ERR?")] * 2, (end_us, "SHOT?"))
    return said(told(core, script)).splitlines()[-3:]


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize(
    "setting",
    [
        "a,FORW,PULS,24001,10000,211000",
        "a,FORW,PULS,16000,20001,211000",
        "a,FORW,PULS,16000,10000,49999",
        "a,FORW,PULS,16000,10000,10000001",
        "a,FORW,EFF,0,10000,20000",
        "a,FORW,EFF,124,10000,20000",
        "a,FORW,EFF,1,1000001,2000000",
        "a,FORW,EFF,1,30000,20000",
    ],
)
def test_what_no_shot_may_be_made_of_is_refused_by_the_firmware_itself(core, setting):
    lines = [(2_000_000, f"CONF {setting}"), (2_000_000, "ARM"), (2_000_000, "TRIG")]
    first, second, shot = errors_after(core, lines)
    assert (first, second) == ('-222,"Data out of range"', '106,"Not configured"')
    assert shot.startswith("SHOT 0,0,NONE")


@pytest.mark.parametrize("core", CORES)
def test_in_the_first_second_it_says_that_it_has_just_booted_and_later_that_the_magnet_is_not_home(core):
    setting = "CONF a,FORW,PULS,16000,10000,2000000"
    lines = [(0, setting), (0, "ARM"), (999_999, "TRIG"), (1_000_000, "TRIG"), (2_999_999, "TRIG"), (3_000_000, "TRIG")]
    first, second, shot = errors_after(core, lines)
    assert (first, second) == ('114,"Just booted"', '102,"Magnet not home"')
    assert shot.startswith("SHOT 2,")


@pytest.mark.parametrize("core", CORES)
@pytest.mark.parametrize(
    ("rest_us", "length_us", "error", "fired"),
    [(50_000, 20_000, 103, 5), (199_000, 1_000, 104, 300)],
    ids=["duty over a second", "shots a minute"],
)
def test_a_train_beyond_a_limit_is_refused_by_the_firmware_itself(core, rest_us, length_us, error, fired):
    lines = [(2_000_000, f"CONF a,FORW,PULS,16000,{length_us},{rest_us}"), (2_000_000, "ARM")]
    lines += [(2_000_000 + shot * rest_us, "TRIG") for shot in range(fired + 1)]
    first, second, shot = errors_after(core, lines)
    assert (first, second) == (message(error), message(0))
    assert shot.startswith(f"SHOT {fired},")


@pytest.mark.parametrize("core", CORES)
def test_a_coil_that_would_be_too_hot_is_not_driven(core):
    """55 K at 20 J/K are 1100 J, 3.97 J a pulse of 24 V and 20 ms: 277 shots, and more as it cools meanwhile."""
    lines = [(2_000_000, "CONF a,FORW,PULS,24000,20000,200000"), (2_000_000, "ARM")]
    lines += [(2_000_000 + shot * 200_000, "TRIG") for shot in range(450)]
    script = by_hand(*lines)
    refused = said(told(core, [*script, *by_hand(*[(92_000_000, "SYST:ERR?")] * 3)])).splitlines()
    assert refused[0] == '105,"Coil too hot"'
    shots = sum(line.startswith("drive") and "PULS" in line for line in told(core, script))
    assert 277 < shots < 450


@pytest.mark.parametrize("core", CORES)
def test_a_vibration_between_pulses_hides_none_of_them_from_the_duty_limit(core):
    effect, pulse = "CONF v,FORW,EFF,1,0,10000", "CONF a,FORW,PULS,16000,20000,50000"
    lines = [(2_000_000, pulse), (2_000_000, "ARM")]
    lines += [(2_000_000 + shot * 50_000, "TRIG") for shot in range(5)]
    lines += [(2_250_000, effect), (2_250_000, "TRIG"), (2_260_000, pulse), (2_260_000, "TRIG")]
    first, second, shot = errors_after(core, lines)
    assert (first, second) == ('103,"Duty limit"', '0,"No error"')
    assert shot.startswith("SHOT 6,")


@pytest.mark.parametrize("core", CORES)
def test_left_alone_in_mid_shot_it_switches_off_at_the_watchdogs_microsecond(core):
    lines = ["CONF v,FORW,EFF,1,1000000,1000000", "SYST:WATC 100", "ARM", "TRIG 5"]
    script = by_hand(*[(2_000_000, line) for line in lines])
    found = told(core, [*script, "tick 9000000", *by_hand((9_000_000, "STAT?"), (9_000_000, "SYST:ERR?"))])
    assert [line for line in found if line.startswith("drive")] == ["drive 2000000 EFF 1", "drive 2100000 OFF"]
    assert re.match(r'STAT DISARMED,.*\n109,"Watchdog"\n', said(found))


PULSE, EFFECT = "CONF a,FORW,PULS,16000,10000,211000", "CONF v,FORW,EFF,1,24000,24000"
START_US, END_US = 2_000_000, 2_010_000


def shot_of(core: str, setting: str, *calls: str) -> tuple[str, list[str], list[str]]:
    """The shot with the mark 5 that is fired at 2 s, after some calls and 1 s: its record, the errors, the drives."""
    before = [call for call in calls if int(call.split()[1]) <= START_US]
    after = [call for call in calls if call not in before]
    lines = by_hand(*[(START_US, line) for line in (setting, "ARM", "TRIG 5")])
    asked = by_hand(*[(3_000_000, line) for line in ("SHOT?", *["SYST:ERR?"] * 2)])
    found = told(core, [*before, *lines, *after, *asked])
    record, *errors_told = said(found).splitlines()
    return record, errors_told, [line for line in found if line.startswith("drive")]


@pytest.mark.parametrize("core", ALL)
def test_a_pulse_that_is_begun_late_is_cut_and_its_record_tells_when_it_was_on(core):
    record, found, drives = shot_of(core, PULSE, f"late {START_US} 4000", f"tick {END_US - 1}", f"late {END_US - 1} 0")
    on_us, home_us = START_US + 4_000, START_US + 4_000 + 211_000
    assert record == f"SHOT 1,5,CUT,{START_US},{on_us},{END_US},{home_us},{PULSE[5:]}"
    assert found == [message(0)] * 2
    assert drives == [f"drive {on_us} PULS 16000", f"drive {END_US} OFF"]


@pytest.mark.parametrize("core", ALL)
@pytest.mark.parametrize("late_us", [10_000, 500_000])
def test_a_pulse_that_would_begin_when_it_ought_to_be_over_is_not_begun_and_not_counted(core, late_us):
    record, found, drives = shot_of(core, PULSE, f"late {START_US} {late_us}")
    assert record.startswith("SHOT 0,5,NONE,")
    assert found == [message(107), message(0)]
    assert drives == []


@pytest.mark.parametrize("core", ALL)
@pytest.mark.parametrize(
    ("setting", "late_us", "ending", "told_us"),
    [
        (PULSE, 200, "DONE", 0),
        (PULSE, 201, "CUT", 201),
        ("CONF a,FORW,PULS,16000,20000,211000", 200, "DONE", 0),
        ("CONF a,FORW,PULS,16000,20000,211000", 201, "CUT", 201),
        ("CONF a,FORW,PULS,16000,1000,211000", 20, "DONE", 0),
        ("CONF a,FORW,PULS,16000,1000,211000", 21, "CUT", 21),
        ("CONF a,FORW,PULS,16000,1,211000", 1, "NONE", 0),
        ("CONF a,FORW,PULS,16000,0,211000", 0, "DONE", 0),
        (EFFECT, 1000, "DONE", 0),
        (EFFECT, 1001, "DONE", 1001),  # its driver is told to stop as much later: it was whole
        (EFFECT, 24000, "NONE", 0),
    ],
)
def test_a_pulse_is_on_time_within_2_percent_and_200_us_a_vibration_within_1_ms(
    core, setting, late_us, ending, told_us
):
    record, _, _ = shot_of(core, setting, f"late {START_US} {late_us}")
    fields = record.split(",")
    assert (fields[2], int(fields[4])) == (ending, START_US + told_us)


@pytest.mark.parametrize("core", ALL)
def test_the_rest_counts_from_when_a_late_pulse_truly_began(core):
    late = [f"late {START_US} 4000", *by_hand((START_US, PULSE), (START_US, "ARM"), (START_US, "TRIG"))]
    again = by_hand(*[(START_US + 211_000 + after_us, "TRIG") for after_us in (3_999, 4_000)])
    asked = by_hand((3_000_000, "SHOT?"), (3_000_000, "SYST:ERR?"))
    record, error = said(told(core, [*late, f"late {START_US + 1} 0", *again, *asked])).splitlines()
    assert (record.split(",")[0], error) == ("SHOT 2", message(102))


@pytest.mark.parametrize("core", CORES)
def test_the_coil_does_not_cool_twice_in_the_100_ms_into_which_a_pulse_came_late(core):
    lines = [(2_000_000, "CONF a,FORW,PULS,24000,15000,150000"), (2_000_000, "ARM")]
    lines += [(2_099_000 + 200_000 * shot, "TRIG") for shot in range(100)]
    script = ["late 1 5000", *by_hand(*lines, (23_000_000, "STAT?"))]
    assert differences(core, script) == []
    coil_mC = int(said(told(core, script)).split(",")[4])
    whole_mK = 100 * 24**2 / 2.9 * 0.015 / 20 * 1000  # V^2/R t over 20 J/K
    left_mK = whole_mK * exp(-11 / 200)  # it cools for 11 s on average, by a time constant of 200 s
    assert coil_mC - 25_000 == pytest.approx(left_mK, rel=0.003)


@pytest.mark.parametrize("core", ALL)
def test_a_driver_that_does_not_answer_begins_no_shot_and_the_answer_says_so(core):
    record, found, drives = shot_of(core, EFFECT, f"dead {START_US} 1")
    assert record.startswith("SHOT 0,5,NONE,")
    assert found == [message(110), message(0)]
    assert drives == []


@pytest.mark.parametrize("core", ALL)
def test_a_shot_that_was_never_begun_may_be_asked_for_again_by_its_mark_and_is_fired_once(core):
    retry = by_hand(*[(time_us, "TRIG 5") for time_us in (START_US + 600_000, START_US + 900_000)])
    off = f"late {START_US + 500_000} 0"
    record, found, drives = shot_of(core, PULSE, f"late {START_US} 20000", off, *retry)
    assert record.startswith("SHOT 1,5,DONE,")
    assert found == [message(107), message(113)]
    assert drives == [f"drive {START_US + 600_000} PULS 16000", f"drive {START_US + 610_000} OFF"]


@pytest.mark.parametrize("core", ALL)
def test_a_trigger_in_a_frame_is_told_why_its_shot_was_never_begun(core):
    bodies = ("SYST:STRI 1", PULSE, "ARM", "TRIG 5", "STAT?")
    frames = [encode(Frame(number=number, body=body), "host") for number, body in enumerate(bodies, 1)]
    script = [f"late {START_US} 10000", *[f"in {START_US} {frame.hex().upper()}" for frame in frames]]
    answers = [line[6:].split("~")[0] for line in said(told(core, script)).splitlines()]
    assert answers[3] == 'ERR 107,"Too late"'
    assert answers[4].startswith("STAT ARMED,0,")


@pytest.mark.parametrize("core", ALL)
@pytest.mark.parametrize(
    ("setting", "late_us", "ending", "lasted_us"),
    [
        (PULSE, 0, "CUT", 4_000),
        (PULSE, 200, "CUT", 4_000),
        (PULSE, 3_000, "CUT", 7_000),
        (PULSE, 9_000, "DONE", 10_000),  # its own timer had ended it
        (EFFECT, 9_000, "CUT", 13_000),
        (EFFECT, 30_000, "DONE", 34_000),
    ],
)
def test_a_shot_that_is_called_off_after_4_ms_ends_when_the_board_says(core, setting, late_us, ending, lasted_us):
    cut_us = START_US + 4_000
    record, _, _ = shot_of(core, setting, f"late {cut_us} {late_us}", *by_hand((cut_us, "ABOR")))
    fields = record.split(",")
    assert (fields[2], int(fields[5]) - int(fields[4])) == (ending, lasted_us)


def test_the_image_holds_no_floating_point_and_no_heap():
    """What the compiler would call for floats (Arm's run-time ABI names them) or a heap is not in it."""
    names = subprocess.run(
        ["arm-none-eabi-nm", built("chip") / "gun-f446.elf"], capture_output=True, text=True, check=True
    ).stdout
    assert "core_step" in names
    assert re.findall(r"__aeabi_(?:[fd]\w+|\w+2[fd])|malloc|sbrk", names) == []
