"""The firmware's limits, whatever the host says: shots a minute, duty, warmth, the time after a boot."""

from __future__ import annotations

import pytest

from device import limits, words
from device.twin import machine
from device.twin.machine import DUTY_US, Budget
from device.wire.errors import WireError, message
from device.wire.records import Setting
from tests.twin_hosts import PULSE, READY, Hand

STRONG = Setting(method="M", way="FORW", kind="PULS", amount=16_000, length_us=20_000, rest_us=50_000)
EFFECT = Setting(method="M", way="FORW", kind="EFF", amount=1, length_us=24_000, rest_us=50_000)


def spent(*settings: Setting) -> Budget:
    taken = Budget()
    for number, setting in enumerate(settings):
        taken.spend(setting, 50_000 * number)
    return taken


def test_five_pulses_of_20_ms_fill_a_second() -> None:
    assert 5 * STRONG.length_us == DUTY_US
    assert spent(*[STRONG] * 4).refusal(STRONG, 200_000) == WireError.NO_DEVICE_ERROR
    assert spent(*[STRONG] * 5).refusal(STRONG, 250_000) == WireError.DUTY


def test_a_vibration_in_between_hides_no_earlier_pulse() -> None:
    assert spent(*[STRONG] * 4, EFFECT).refusal(STRONG, 250_000) == WireError.NO_DEVICE_ERROR
    assert spent(*[STRONG] * 4, EFFECT, STRONG).refusal(STRONG, 300_000) == WireError.DUTY


def test_what_lies_a_second_back_counts_no_more() -> None:
    assert spent(*[STRONG] * 5).refusal(STRONG, 1_000_000) == WireError.NO_DEVICE_ERROR


def shots_until(hand, code, every_us):
    for shot in range(1000):
        if shot:
            hand.say("", every_us)
        (answer,) = [text for text in [*hand.say("TRIG"), *hand.say("SYST:ERR?")] if '"' in text]
        if not answer.startswith("0,"):
            assert answer == message(code)
            return shot
    raise AssertionError


def test_ten_pulses_of_10_ms_a_second_and_no_more():
    hand = Hand()
    hand.say("CONF a,FORW,PULS,1000,10000,50000", READY)
    hand.say("ARM")
    assert shots_until(hand, WireError.DUTY, 50_000) == 10
    hand.say("TRIG", 499_999)
    assert hand.error() == message(WireError.DUTY)
    hand.say("TRIG", 1)  # the second that ends with the new pulse now begins with the first one's end
    assert hand.error() == '0,"No error"'


def test_three_hundred_shots_a_minute_and_no_more():
    hand = Hand()
    hand.say("CONF a,FORW,EFF,1,10000,10000", READY)
    hand.say("ARM")
    assert shots_until(hand, WireError.RATE, 100_000) == 300
    assert hand.now_us == READY + 300 * 100_000


def test_the_coil_stays_below_80_degrees_and_cools_as_the_host_thinks_or_slower():
    hand = Hand()
    hand.say("CONF a,FORW,PULS,24000,20000,210000", READY)
    hand.say("ARM")
    history, load = limits.DriveHistory(), limits.load_of(words.Pulse(voltage_V=24.0, pulse_s=0.020), 2.9)
    for shot in range(shots_until(hand, WireError.HOT, 210_000)):
        start_s = 1.0 + 0.21 * shot
        history = history.record(load, start_s, start_s)
    assert hand.standing().coil_mC / 1000 == pytest.approx(history.coil_celsius(hand.now_us / 1e6), abs=0.05)
    for _ in range(10):
        hand.say("", 60_000_000)
        warmer_K = hand.standing().coil_mC / 1000 - history.coil_celsius(hand.now_us / 1e6)
        assert -0.001 <= warmer_K < 0.05


def test_the_firmwares_limits_are_the_hosts():
    assert machine.MAX_MILLIVOLTS == 1000 * words.MAX_VOLTAGE_V
    assert machine.MAX_PULSE_US == 1e6 * words.MAX_PULSE_S
    assert machine.DUTY_US / machine.SECOND_US == limits.MAX_DUTY
    assert machine.MAX_SHOTS == limits.MAX_SHOTS_PER_MINUTE
    assert machine.MAX_AHEAD_US == 1e6 * limits.MAX_AHEAD_S
    assert machine.MAX_WARMTH_NJ / 1e9 == (limits.MAX_COIL_C - limits.AMBIENT_C) * limits.HEAT_CAPACITY_J_K


def test_after_a_boot_nothing_is_fired_for_a_second():
    hand = Hand()
    hand.say(PULSE)
    hand.say("ARM")
    hand.say("TRIG", READY - 1)
    assert hand.error() == '114,"Just booted"'
    hand.say("TRIG", 1)
    assert hand.error() == '0,"No error"'
