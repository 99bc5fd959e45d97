"""The firmware on an emulated chip, in real time: its own clock, its own interrupts, on a port that pyserial opens.

The image keeps a record of every call of its core and of every drive; the twin, given the same calls, must say and do
the same, to the byte and the microsecond.
"""

from __future__ import annotations

import time

import pytest

from device.wire.errors import message
from tests.firmware import Hand, agree, emulated, play_all
from tests.waiting import wait_for

pytestmark = pytest.mark.slow  # the firmware has to be built
SCRIPTS = range(6, 10)
"""Of two hundred in `make soak`: short ones in lines and in frames, with faults of the driver, and power that goes."""


@pytest.fixture
def hand(tmp_path):
    with emulated(tmp_path) as chip:
        hand = Hand(chip)
        yield hand
        hand.close()


def test_the_chip_in_real_time_says_and_does_what_the_twin_does_for_the_same_calls(hand):
    hand.wait_for_rest()
    assert play_all(hand, SCRIPTS) > 1_000
    assert any("PULS" in call.text for call in hand.chip.drives())  # how many a script still finds at rest is chance


def test_it_says_who_it_is(hand):
    assert hand.ask("*IDN?") == "Recoil,haptic-gun,QEMU-1,wire 1 firmware 1.1.0"


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
